"""Matrices in the binary files of other programs, through packages that are installed when they are wanted.

Nastran OP4, also of EXTSEOUT, through `pyyeti`; ANSYS ``.full`` through `ansys-mapdl-reader`:
``pip install microslip[nastran]`` or ``microslip[ansys]``.
"""

from __future__ import annotations

from pathlib import Path

import numpy as np
import scipy.sparse as sp

from microslip.errors import InputError
from microslip.model.readers.found import Found, Label, chosen, folded


def _missing(path: str, package: str, extra: str) -> InputError:
    return InputError(
        f"{path}: is read by the package {package}, which is not installed: pip install "
        f'"microslip[{extra}]"'
    )


def read_op4(path: str, name: str) -> Found:
    """A matrix of a Nastran OP4 file, text or binary.

    Raises
    ------
    InputError
        Where `pyyeti` is not installed, or there is no such matrix.
    """
    try:
        from pyyeti.nastran import op4
    except ImportError:
        raise _missing(path, "pyyeti", "nastran") from None
    try:
        found = op4.load(path, into="dct", justmatrix=True, sparse=None)
    except (OSError, ValueError, KeyError, IndexError) as error:
        raise InputError(f"{path}: is no OP4 file that can be read: {error}") from None
    matrices = {key.lower(): value for key, value in found.items()}
    matrix = matrices[chosen(path, name.lower(), matrices)]
    if np.iscomplexobj(matrix.data if sp.issparse(matrix) else matrix):
        raise InputError(f"{path}: {name} is complex; a real matrix was expected")
    return Found(sp.csc_matrix(matrix, dtype=float))


def read_external_labels(path: str) -> tuple[Label, ...]:
    """Degrees of freedom of an external superelement, from the EXTRN entry of its ``.asm`` file.

    Raises
    ------
    InputError
        Where `pyyeti` is not installed, or there is no such entry.
    """
    try:
        from pyyeti.nastran import bulk
    except ImportError:
        raise _missing(path, "pyyeti", "nastran") from None
    try:
        table = bulk.rdextrn(path)
    except (OSError, ValueError, TypeError, IndexError) as error:
        raise InputError(f"{path}: has no EXTRN entry that can be read: {error}") from None
    # scalar points, the modal coordinates, have the direction 0
    return tuple((int(node), int(direction)) for node, direction in np.asarray(table))


def read_full(path: str, name: str) -> Found:
    """Stiffness (``K``) or mass (``M``) of an ANSYS ``.full`` file, without what supports hold.

    Raises
    ------
    InputError
        Where `ansys-mapdl-reader` is not installed, or the file holds no such matrix.
    """
    try:
        from ansys.mapdl import reader
    except ImportError:
        raise _missing(path, "ansys-mapdl-reader", "ansys") from None
    own = chosen(path, name.upper(), ("K", "M"))
    if not Path(path).stat().st_size:
        raise InputError(f"{path}: is empty")
    try:
        labels, stiffness, mass = reader.read_binary(path).load_km(sort=True)
    except (OSError, ValueError, RuntimeError, AttributeError, TypeError) as error:
        raise InputError(f"{path}: is no .full file that can be read: {error}") from None
    matrix = sp.csc_matrix(stiffness if own == "K" else mass, dtype=float)
    numbers = tuple((int(node), int(direction) + 1) for node, direction in np.asarray(labels))
    return folded(Found(matrix, None, numbers))

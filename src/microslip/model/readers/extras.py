"""Matrices in the binary files of other programs, through packages that are installed when they are wanted.

Nastran OP4, OP2 and DMIG, also of EXTSEOUT, through `pyyeti`; ANSYS ``.full`` through `ansys-mapdl-reader`:
``pip install microslip[nastran]`` or ``microslip[ansys]``.
"""

from __future__ import annotations

import struct
from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import numpy as np
import scipy.sparse as sp

from microslip.errors import InputError
from microslip.model.readers.found import Found, Label, chosen, folded

UNREADABLE = (
    OSError,
    ValueError,
    RuntimeError,
    KeyError,
    IndexError,
    TypeError,
    AttributeError,
    struct.error,
)
"""What the reader of a package raises where a file is another one."""


def _nastran(path: str) -> Any:
    """Modules of `pyyeti.nastran`, without what they do to the way numpy prints on import."""
    try:
        with np.printoptions():
            from pyyeti.nastran import bulk, op2, op4
    except ImportError:
        raise _missing(path, "pyyeti", "nastran") from None
    return SimpleNamespace(bulk=bulk, op2=op2, op4=op4)


@contextmanager
def _readable(said: str) -> Iterator[None]:
    """Say what a file is not where the reader of a package stumbles over it."""
    try:
        yield
    except UNREADABLE as error:
        raise InputError(f"{said}: {error}") from None


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
    nastran = _nastran(path)
    with _readable(f"{path}: is no OP4 file that can be read"):
        found = nastran.op4.load(path, into="dct", justmatrix=True, sparse=None)
    return _named(path, name, found)


def read_op2(path: str, name: str) -> Found:
    """A matrix of a Nastran OP2 file: stored as one, or as DMIG with its degrees of freedom.

    Raises
    ------
    InputError
        Where `pyyeti` is not installed, or there is no such matrix.
    """
    nastran = _nastran(path)
    with _readable(f"{path}: is no OP2 file that can be read"):
        matrices = nastran.op2.rdmats(path)
        entries = {} if matrices else nastran.bulk.rddmig(path, square=True)
    if not matrices and not entries:
        raise InputError(
            f"{path}: holds no matrices; EXTSEOUT writes them with DMIGOP2, or as an .op4 with MATOP4"
        )
    return _named(path, name, matrices) if matrices else _labelled(path, name, entries)


def read_punch(path: str, name: str) -> Found:
    """A matrix of a Nastran punch file, DMIG with its degrees of freedom.

    Raises
    ------
    InputError
        Where `pyyeti` is not installed, or there is no such matrix.
    """
    nastran = _nastran(path)
    with _readable(f"{path}: has no DMIG entries that can be read"):
        entries = nastran.bulk.rddmig(path, square=True)
    return _labelled(path, name, entries)


def _labelled(path: str, name: str, entries: Mapping[str, Any]) -> Found:
    """The matrix that is meant of several tables whose rows are nodes and directions.

    Raises
    ------
    InputError
        Where there is none of the name, or it is complex.
    """
    table = {key.lower(): value for key, value in entries.items()}
    chosen_name = chosen(path, name.lower(), table)
    own = table[chosen_name]
    found = _named(path, chosen_name, {chosen_name: own.to_numpy()})
    if list(own.index) != list(own.columns):
        return found
    labels = tuple((int(node), int(direction)) for node, direction in own.index)
    return Found(found.matrix, "full", labels)


def _named(path: str, name: str, found: Mapping[str, Any]) -> Found:
    """The matrix that is meant of several, whatever the case of its name.

    Raises
    ------
    InputError
        Where there is none of the name, or it is complex.
    """
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
    nastran = _nastran(path)
    with _readable(f"{path}: has no EXTRN entry that can be read"):
        table = nastran.bulk.rdextrn(path)
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
    with _readable(f"{path}: is no .full file that can be read"):
        labels, stiffness, mass = reader.read_binary(path).load_km(sort=True)
    matrix = sp.csc_matrix(stiffness if own == "K" else mass, dtype=float)
    numbers = tuple((int(node), int(direction) + 1) for node, direction in np.asarray(labels))
    return folded(Found(matrix, None, numbers))

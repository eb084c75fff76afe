"""Arrays and sparse matrices by name: NumPy ``.npz`` and ``.npy``, MATLAB ``.mat`` of versions 5 and 7.3.

An ``.npz`` is what `scipy.sparse.save_npz` writes, or holds dense arrays by name, or sparse ones as
``K.data``, ``K.indices``, ``K.indptr``, ``K.shape`` and ``K.format``, so that one file has them all. In
a ``.mat`` of version 7.3, an HDF5 file, arrays are stored transposed, a sparse matrix is a group of ``data``,
``ir`` and ``jc``, and a structure is a group. Fields of structures are named ``structure.field``.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from pathlib import Path
from typing import Any

import h5py
import numpy as np
import scipy.io
import scipy.sparse as sp

from microslip.errors import InputError
from microslip.model.readers.found import Found, chosen

SPARSE = ("data", "indices", "indptr", "shape", "format")
"""Parts of a compressed sparse matrix in an ``.npz``."""


def read_arrays(path: str) -> dict[str, Callable[[], Any]]:
    """Everything that a file holds, by name; each is read when it is called for."""
    ending = Path(path).suffix.lower()
    if ending == ".npy":
        return {"array": lambda: np.load(path, allow_pickle=False)}
    return _npz(path) if ending == ".npz" else _mat(path)


def read_array_matrix(path: str, name: str) -> Found:
    """A matrix of such a file.

    Raises
    ------
    InputError
        Where there is none of the name, or it is no matrix of numbers.
    """
    value = read_value(path, name)
    if sp.issparse(value):
        return Found(sp.csc_matrix(value, dtype=float))
    matrix = np.asarray(value, dtype=float)
    if matrix.ndim != 2:
        raise InputError(f"{path}: {name or 'it'} has {matrix.ndim} dimensions; a matrix has two")
    return Found(sp.csc_matrix(matrix))


def read_value(path: str, name: str) -> Any:
    """An array or a sparse matrix of such a file.

    Raises
    ------
    InputError
        Where there is none of the name, or it cannot be read.
    """
    there = read_arrays(path)
    own = chosen(path, name, there)
    try:
        value = there[own]()
    except (OSError, ValueError, KeyError) as error:
        hint = ""
        if "index" in str(error) or "indices" in str(error):
            hint = "; do its indices count from 1? Here they count from 0"
        raise InputError(f"{path}: {own} cannot be read: {error}{hint}") from None
    if not sp.issparse(value) and np.asarray(value).dtype.kind not in "biuf":
        raise InputError(f"{path}: {own} does not hold real numbers")
    return value


def _npz(path: str) -> dict[str, Callable[[], Any]]:
    try:
        archive = np.load(path, allow_pickle=False)
        names = list(archive.files)
    except (OSError, ValueError) as error:
        raise InputError(f"{path}: is no .npz file: {error}") from None
    if {"data", "shape", "format"} <= set(names):
        return {"matrix": lambda: _checked(sp.load_npz(path))}
    found: dict[str, Callable[[], Any]] = {}
    for name in names:
        head, _, part = name.rpartition(".")
        if part in SPARSE and f"{head}.format" in names:
            found[head] = lambda head=head: _assembled(archive, head)  # type: ignore[misc]
        else:
            found[name] = lambda name=name: archive[name]  # type: ignore[misc]
    return found


def _assembled(archive: Mapping[str, Any], name: str) -> Any:
    data, indices, indptr, shape = (archive[f"{name}.{part}"] for part in SPARSE[:4])
    kinds = {"csc": sp.csc_matrix, "csr": sp.csr_matrix}
    written = archive[f"{name}.format"].item()
    kind = written.decode() if isinstance(written, bytes) else str(written)
    if kind not in kinds:
        raise ValueError(f"its format is {kind!r}; csc and csr can be read")
    return _checked(kinds[kind]((data, indices, indptr), shape=tuple(shape)))


def _checked(matrix: Any) -> Any:
    """The matrix, after a look whether its indices lie within its shape."""
    if hasattr(matrix, "check_format"):
        matrix.check_format()
    return matrix


def _mat(path: str) -> dict[str, Callable[[], Any]]:
    if h5py.is_hdf5(path):
        return _mat73(path)
    try:
        variables = scipy.io.whosmat(path)
        found: dict[str, Callable[[], Any]] = {}
        for name, shape, kind in variables:
            if kind == "struct" and shape == (1, 1):
                found |= _fields(name, _of_mat(path, name)[0, 0])
            else:
                found[name] = lambda name=name: _of_mat(path, name)  # type: ignore[misc]
    except (OSError, ValueError, TypeError, NotImplementedError) as error:
        raise InputError(f"{path}: is no .mat file: {error}") from None
    return found


def _of_mat(path: str, name: str) -> Any:
    return scipy.io.loadmat(path, variable_names=[name])[name]


def _fields(name: str, record: Any) -> dict[str, Callable[[], Any]]:
    """Fields of a structure of version 5, and of those in it, as ``structure.field``."""
    found: dict[str, Callable[[], Any]] = {}
    for field in record.dtype.names or ():
        value, own = record[field], f"{name}.{field}"
        if not sp.issparse(value) and value.dtype.names and value.shape == (1, 1):
            found |= _fields(own, value[0, 0])
        else:
            found[own] = lambda value=value: value  # type: ignore[misc]
    return found


def _mat73(path: str) -> dict[str, Callable[[], Any]]:
    def names_in(group: h5py.Group, head: str) -> list[str]:
        found: list[str] = []
        for name, member in group.items():
            if name.startswith("#"):
                continue
            whole = isinstance(member, h5py.Dataset) or "MATLAB_sparse" in member.attrs
            found += [head + name] if whole else names_in(member, f"{head}{name}.")
        return found

    with h5py.File(path) as file:
        names = names_in(file, "")

    def read(name: str) -> Any:
        with h5py.File(path) as file:
            member = file[name.replace(".", "/")]
            if isinstance(member, h5py.Dataset):
                return np.asarray(member).T
            if "data" not in member:  # MATLAB leaves out what an empty matrix does not have
                raise ValueError("is empty")
            rows = int(member.attrs["MATLAB_sparse"])
            starts = np.asarray(member["jc"], dtype=np.int64)
            parts = (np.asarray(member["data"]), np.asarray(member["ir"], dtype=np.int64), starts)
            return _checked(sp.csc_matrix(parts, shape=(rows, len(starts) - 1)))

    return {name: lambda name=name: read(name) for name in names}  # type: ignore[misc]

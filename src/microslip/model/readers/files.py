"""Matrices, vectors and tables from files, by the ending of their names."""

from __future__ import annotations

import csv
from collections import Counter
from collections.abc import Callable, Iterable
from pathlib import Path

import numpy as np
import scipy.sparse as sp

from microslip.describe.sources import split_source
from microslip.errors import InputError
from microslip.model.readers.arrays import read_array_matrix, read_arrays, read_value
from microslip.model.readers.extras import (
    read_external_labels,
    read_full,
    read_op2,
    read_op4,
    read_punch,
)
from microslip.model.readers.found import Found, Label
from microslip.model.readers.text import (
    read_calculix_labels,
    read_calculix_matrix,
    read_text_matrix,
)
from microslip.typing import Array

MATRICES: dict[str, Callable[[str, str], Found]] = {
    ".npz": read_array_matrix,
    ".npy": read_array_matrix,
    ".mat": read_array_matrix,
    ".mtx": read_text_matrix,
    ".mm": read_text_matrix,
    ".sti": read_calculix_matrix,
    ".mas": read_calculix_matrix,
    ".op4": read_op4,
    ".op2": read_op2,
    ".pch": read_punch,
    ".full": read_full,
}
"""Readers of matrices by the ending of the file."""

LABELS: dict[str, Callable[[str], tuple[Label, ...]]] = {
    ".dof": read_calculix_labels,
    ".asm": read_external_labels,
    ".pch": read_external_labels,
}
"""Readers of lists of degrees of freedom by the ending of the file."""

ARRAYS = (".npz", ".npy", ".mat")
"""Endings of files of arrays by name."""

Table = dict[str, Array]
"""Columns by name."""


def read_matrix(source: str) -> Found:
    """The matrix that a description names.

    Raises
    ------
    InputError
        Where the file is of no known kind, or does not hold it.
    """
    path, name = split_source(source)
    reader = MATRICES.get(Path(path).suffix.lower())
    if reader is None:
        known = ", ".join(MATRICES)
        raise InputError(f"{path}: no matrix can be read from such a file; known are {known}")
    return reader(path, name)


def read_vector(source: str, dofs: int) -> Array:
    """The vector that a description names.

    Parameters
    ----------
    source : str
    dofs : int
        How long it must be.

    Raises
    ------
    InputError
        Where it is no vector of that length.
    """
    path, name = split_source(source)
    if Path(path).suffix.lower() in ARRAYS:
        value = read_value(path, name)
        vector = np.asarray(value.toarray() if sp.issparse(value) else value, dtype=float)
    else:
        vector = read_matrix(source).matrix.toarray()
    if vector.ndim > 2 or max(vector.shape, default=0) != vector.size:
        shape = " by ".join(map(str, vector.shape))
        raise InputError(f"{source}: is {shape}; a vector was expected")
    if vector.size != dofs:
        raise InputError(
            f"{source}: has {vector.size} entries, and the stiffness has {dofs} degrees of freedom"
        )
    if not np.isfinite(vector).all() or not vector.any():
        raise InputError(f"{source}: holds nothing but zeros, or numbers that are not finite")
    return vector.ravel()


def read_table(source: str) -> Table:
    """Columns by name, of a CSV file with a header, or of a file of arrays.

    Raises
    ------
    InputError
        Where it is no such table, or its columns differ in length.
    """
    path, name = split_source(source)
    ending = Path(path).suffix.lower()
    if ending in ARRAYS:
        return _named_columns(path, name)
    if ending in LABELS:
        nodes, directions = np.array(LABELS[ending](path), dtype=float).T
        return {"node": nodes, "direction": directions}
    if ending not in (".csv", ".txt"):
        raise InputError(f"{path}: a table is a CSV file with a header, or an .npz or .mat file")
    try:
        text = Path(path).read_text(encoding="utf-8-sig")
    except (OSError, UnicodeDecodeError) as error:
        raise InputError(f"{path}: cannot be read: {error}") from None
    lines = [
        (number, line)
        for number, line in enumerate(text.splitlines(), start=1)
        if line.strip() and not line.lstrip().startswith("#")
    ]
    if len(lines) < 2:
        raise InputError(f"{path}: a header and at least one row were expected")
    rows = list(csv.reader(line for _, line in lines))
    header = [cell.strip().lower() for cell in rows[0]]
    columns: dict[str, list[float]] = {column: [] for column in header}
    for (number, _), row in zip(lines[1:], rows[1:], strict=True):
        if len(row) != len(header):
            raise InputError(
                f"{path}: line {number} has {len(row)} values, the header {len(header)}"
            )
        for column, cell in zip(header, row, strict=True):
            columns[column].append(_number(cell, column, f"{path}: line {number}"))
    return {column: np.array(values) for column, values in columns.items()}


WORDS = {"x": 1.0, "y": 2.0, "z": 3.0, "rx": 4.0, "ry": 5.0, "rz": 6.0}
"""Directions, which a table may give in words."""


def _number(cell: str, column: str, where: str) -> float:
    text = cell.strip().lower()
    if column == "direction" and text in WORDS:
        return WORDS[text]
    try:
        value = float(text)
    except ValueError:
        value = np.nan
    if not np.isfinite(value):
        raise InputError(f"{where}, {column} = {cell.strip()!r}: must be a finite number")
    return value


def _named_columns(path: str, name: str) -> Table:
    """Arrays as columns: all of a file, or those whose names begin with the one that is meant and _."""
    there = read_arrays(path)
    if name:
        own = {column: there[column] for column in there if column.startswith(f"{name}_")}
        if not own:
            listed = ", ".join(there)
            raise InputError(f"{path}: holds no columns {name}_...; there is {listed}")
        read = {column.removeprefix(f"{name}_"): value for column, value in own.items()}
    else:
        read = dict(there)
    table = {}
    for column, value in read.items():
        array = np.asarray(value())
        if array.size != max(array.shape, default=0):
            raise InputError(
                f"{path}: {column} is no column of numbers{'' if name else _begin(path, read)}"
            )
        table[column.lower()] = _in_numbers(array.ravel(), column, path)
    lengths = {len(values) for values in table.values()}
    if len(lengths) != 1:
        raise InputError(f"{path}: columns of {sorted(lengths)} rows are no table")
    return table


def _begin(path: str, names: Iterable[str]) -> str:
    """How the columns of a table are told from other arrays of a file; empty where no names begin alike."""
    begun = Counter(name.split("_")[0] for name in names if "_" in name)
    often = sorted(begin for begin, count in begun.items() if count > 1)
    if not often:
        return ""
    return f': write "{path}:NAME" for the columns NAME_...; names begin with {" or ".join(often)}'


def _in_numbers(values: Array, column: str, path: str) -> Array:
    if values.dtype.kind in "US":
        return np.array([_number(str(cell), column, path) for cell in values])
    return np.asarray(values, dtype=float)

"""Matrices as text: Matrix Market, Abaqus ``.mtx`` in its layouts, CalculiX ``.sti`` and ``.mas``.

All count from 1. Abaqus and CalculiX write the global matrices as triples ``row, column, value`` or, with
the default format of Abaqus, as ``node, direction, node, direction, value``; of a symmetric matrix one
triangle may be there or both. A substructure is written as a linear user element: its nodes in comments
below ``** ELEMENT NODES``, the directions of the first node, lines ``place, directions`` where they change,
and then the upper triangle of each matrix, column by column.
"""

from __future__ import annotations

import re
from itertools import accumulate
from pathlib import Path

import numpy as np
import scipy.io
import scipy.sparse as sp

from microslip.errors import InputError
from microslip.model.readers.found import Found, Label, chosen, folded, labelled, said
from microslip.typing import Array, Indices

MARKET = "%%MatrixMarket"
"""How a Matrix Market file begins."""

KEYWORD = re.compile(r"\*\s*MATRIX\s*,.*TYPE\s*=\s*(\w+)", re.IGNORECASE)


def read_text_matrix(path: str, name: str) -> Found:
    """The matrix of a ``.mtx`` or ``.mm`` file: Matrix Market or Abaqus.

    Raises
    ------
    InputError
        Where it is neither, or does not hold the matrix.
    """
    try:
        with open(path, encoding="utf-8", errors="replace") as file:
            head = file.read(4000)
    except OSError as error:
        raise InputError(f"{path}: cannot be read: {error.strerror}") from None
    if head.startswith(MARKET):
        return _market(path)
    if re.search(r"^\*\s*USER ELEMENT", head, re.IGNORECASE | re.MULTILINE):
        return _substructure(path, name)
    return _entries(path)


def read_calculix_matrix(path: str, name: str) -> Found:
    """Stiffness or mass that CalculiX stored, with the labels of the ``.dof`` file beside it.

    Raises
    ------
    InputError
        Where it cannot be read, or the ``.dof`` file is not of the same matrix.
    """
    found = _entries(path)
    beside = Path(path).with_suffix(".dof")
    if not beside.is_file():
        return found
    labels = read_calculix_labels(str(beside))
    rows = found.matrix.shape[0]
    if len(labels) < rows:
        raise InputError(f"{beside}: {len(labels)} degrees of freedom, and {path} has {rows}")
    # rows at the end without an entry are not in the file of a mass matrix
    whole = found.matrix.copy()
    whole.resize((len(labels), len(labels)))
    return Found(whole, found.stored, labels)


def read_calculix_labels(path: str) -> tuple[Label, ...]:
    """Node and direction of every row, ``12.2`` for node 12 along y.

    Raises
    ------
    InputError
        Where a line is something else.
    """
    labels = []
    for number, line in enumerate(Path(path).read_text(encoding="utf-8").splitlines(), start=1):
        found = re.fullmatch(r"\s*(\d+)\.([1-6])\s*", line)
        if found is None and line.strip():
            raise InputError(f"{path}: line {number}, {line.strip()!r}: must be node.direction")
        if found is not None:
            labels.append((int(found[1]), int(found[2])))
    if not labels:
        raise InputError(f"{path}: holds no degrees of freedom")
    return tuple(labels)


def _market(path: str) -> Found:
    try:
        matrix = scipy.io.mmread(path)
    except (OSError, ValueError, TypeError) as error:
        raise InputError(f"{path}: is no Matrix Market file that can be read: {error}") from None
    if np.iscomplexobj(matrix):
        raise InputError(f"{path}: is complex; a real matrix was expected")
    with open(path, encoding="utf-8", errors="replace") as file:
        general = "symmetric" not in file.readline().lower()
    return Found(sp.csc_matrix(matrix, dtype=float), None if general else "full")


def _entries(path: str) -> Found:
    """Lines of three numbers, or of five with labels."""
    try:
        with open(path, encoding="utf-8") as file:
            lines = (re.sub(r"[,;]", " ", line) for line in file)
            table = np.loadtxt(lines, comments=("*", "#", "%"), ndmin=2)
    except (OSError, ValueError) as error:
        raise InputError(f"{path}: is no table of matrix entries: {error}") from None
    if table.shape[1] not in (3, 5) or not len(table):
        raise InputError(
            f"{path}: has {table.shape[1]} numbers a line; row, column, value were expected, or node, "
            "direction, node, direction, value"
        )
    places = table[:, :-1]
    if (places != places.round()).any():
        raise InputError(f"{path}: rows, columns, nodes and directions are whole numbers")
    if table.shape[1] == 5:
        return _by_label(path, places.astype(int), table[:, -1])
    index = places.astype(int)
    if index.min() < 1:
        raise InputError(f"{path}: rows and columns count from 1, and one is {index.min()}")
    n = int(index.max())
    i, j = index.T - 1
    _check_once(path, Found(sp.csc_matrix((np.ones(len(i)), (i, j)), shape=(n, n))))
    return folded(Found(sp.csc_matrix((table[:, -1], (i, j)), shape=(n, n))))


def _by_label(path: str, places: Indices, values: Array) -> Found:
    """Of entries by node and direction. Internal nodes of Abaqus have negative numbers."""
    rows, columns = places[:, :2], places[:, 2:]
    for side in (rows, columns):
        odd = np.flatnonzero((side[:, 1] < 1) | (side[:, 1] > 6))
        if len(odd):
            node, direction = side[odd[0]].tolist()
            raise InputError(f"{path}: {said((node, direction))}: directions are 1 to 6")
    found = labelled(rows, columns, values)
    _check_once(path, labelled(rows, columns, np.ones(len(values))))
    return folded(found)


def _check_once(path: str, counted: Found) -> None:
    """Raise `InputError` where the number of an entry, which is counted here, is above one."""
    if counted.matrix.nnz and counted.matrix.data.max() > 1:
        raise InputError(f"{path}: an entry is there twice: were two files joined?")


def _substructure(path: str, name: str) -> Found:
    """A matrix of a linear user element."""
    nodes: list[int] = []
    layout: list[list[int]] = []
    matrices: dict[str, list[str]] = {}
    place = ""
    for line in Path(path).read_text(encoding="utf-8", errors="replace").splitlines():
        if line.startswith("**"):
            if "ELEMENT NODES" in line.upper():
                place = "nodes"
            elif place == "nodes":
                nodes += [int(part) for part in re.findall(r"-?\d+", line)]
            continue
        if line.lstrip().startswith("*"):
            found = KEYWORD.match(line.strip())
            place = "layout" if "USER ELEMENT" in line.upper() else ""
            if found is not None:
                place = found[1].upper()
                matrices[place] = []
        elif place in matrices:
            matrices[place] += [part for part in re.split(r"[,\s]+", line) if part]
        elif place in ("nodes", "layout"):
            layout.append([int(part) for part in re.findall(r"-?\d+", line)])
    own = chosen(path, name.upper(), matrices)
    labels = _layout(path, nodes, layout)
    values = np.array([float(text.upper().replace("D", "E")) for text in matrices[own]])
    n = len(labels)
    if len(values) == n * n:
        return _ordered(sp.csc_matrix(values.reshape(n, n)), labels, "full")
    if len(values) != n * (n + 1) // 2:
        raise InputError(
            f"{path}: {own} has {len(values)} entries, and {n} degrees of freedom need {n * (n + 1) // 2}"
        )
    column = np.repeat(np.arange(n), np.arange(1, n + 1))
    row = np.arange(len(values)) - np.array([0, *accumulate(range(1, n + 1))])[column]
    half = sp.csc_matrix((values, (row, column)), shape=(n, n))
    return _ordered(half, labels, "upper")


def _layout(path: str, nodes: list[int], layout: list[list[int]]) -> list[Label]:
    """Degrees of freedom from the nodes of an element and the lines that say their directions."""
    if not nodes or not layout:
        raise InputError(f"{path}: the nodes of the substructure, or their directions, are missing")
    change = {1: layout[0]} | {line[0]: line[1:] for line in layout[1:]}
    labels, own = [], layout[0]
    for number, node in enumerate(nodes, start=1):
        own = change.get(number, own)
        labels += [(node, direction) for direction in own]
    if len(set(labels)) < len(labels):
        raise InputError(f"{path}: a degree of freedom of the substructure is there twice")
    return labels


def _ordered(matrix: sp.csc_matrix, labels: list[Label], stored: str) -> Found:
    return Found(matrix, "upper" if stored == "upper" else "full", tuple(labels))

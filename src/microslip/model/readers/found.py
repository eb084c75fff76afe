"""What a reader finds in a file, and the numbers of directions that formats share."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Literal

import numpy as np
import scipy.sparse as sp
from numpy.typing import ArrayLike

from microslip.errors import InputError
from microslip.typing import Array

Stored = Literal["full", "upper", "lower"]

DIRECTIONS = {"x": 1, "y": 2, "z": 3, "rx": 4, "ry": 5, "rz": 6}
"""Numbers of displacements and rotations, as all programs count them."""

NAMES = {number: name for name, number in DIRECTIONS.items()}
"""The same the other way round."""

BASE = 10
"""Of one number for node and direction; internal nodes are negative."""

Label = tuple[int, int]
"""Node and direction of a degree of freedom."""


@dataclass(frozen=True)
class Found:
    """A matrix as a file holds it.

    Attributes
    ----------
    matrix : (n, k) sparse
    stored : str or None
        Which part of a symmetric matrix the format holds; None where it does not say.
    labels : tuple of (int, int), or None
        Node and direction of each row, where the file has them.
    """

    matrix: sp.csc_matrix
    stored: Stored | None = None
    labels: tuple[Label, ...] | None = None

    def whole(self, stored: Stored) -> sp.csc_matrix:
        """The symmetric matrix of which the file, or the user, says that a part is stored."""
        part = self.stored or stored
        if part == "full":
            return self.matrix
        kept = sp.triu(self.matrix) if part == "upper" else sp.tril(self.matrix)
        return (kept + kept.T - sp.diags(self.matrix.diagonal())).tocsc()


def chosen(path: str, name: str, there: Mapping[str, object] | Sequence[str]) -> str:
    """The one of several things in a file that is meant.

    Raises
    ------
    InputError
        Where none of them has the name, or none is named and there are several.
    """
    names = list(there)
    if name in names:
        return name
    listed = ", ".join(names) or "nothing"
    if name:
        raise InputError(f'{path}: holds no {name!r}; there is {listed}: write "{path}:NAME"')
    if len(names) != 1:
        raise InputError(f'{path}: which one is meant? It holds {listed}: write "{path}:NAME"')
    return names[0]


def labelled(rows: ArrayLike, columns: ArrayLike, values: Array) -> Found:
    """A square matrix whose entries are given by node and direction, in ascending order of both.

    Parameters
    ----------
    rows, columns : (k, 2) int arrays
        Node and direction of each entry's row and column.
    values : (k,) array

    Examples
    --------
    >>> found = labelled([(7, 1), (7, 2)], [(7, 1), (7, 2)], np.array([3.0, 5.0]))
    >>> found.labels, found.matrix.diagonal().tolist()
    (((7, 1), (7, 2)), [3.0, 5.0])
    """
    both = np.vstack([np.asarray(rows, dtype=int), np.asarray(columns, dtype=int)])
    codes, number = np.unique(BASE * both[:, 0] + both[:, 1], return_inverse=True)
    labels = tuple(zip((codes // BASE).tolist(), (codes % BASE).tolist(), strict=True))
    i, j = number.ravel()[: len(values)], number.ravel()[len(values) :]
    shape = (len(labels), len(labels))
    return Found(sp.csc_matrix((np.asarray(values, float), (i, j)), shape=shape), None, labels)


def folded(found: Found) -> Found:
    """The same with the upper triangle alone, where each entry off the diagonal is there on one side.

    Examples
    --------
    >>> half = Found(sp.csc_matrix([[2.0, 0.0], [-1.0, 3.0]]))
    >>> folded(half).whole("full").toarray().tolist()
    [[2.0, -1.0], [-1.0, 3.0]]
    """
    upper, lower = sp.triu(found.matrix, 1).tocsc(), sp.tril(found.matrix, -1).T.tocsc()
    both = abs(upper).sign().multiply(abs(lower).sign())
    if both.nnz:
        return Found(found.matrix, "full", found.labels)
    folded = upper + lower + sp.diags(found.matrix.diagonal())
    return Found(folded.tocsc(), "upper", found.labels)


def ordered(found: Found, labels: Sequence[Label]) -> Found:
    """The same matrix in another order of its degrees of freedom; those it lacks are empty.

    Raises
    ------
    InputError
        Where it has some that the order lacks.
    """
    if found.labels is None or found.labels == tuple(labels):
        return found
    number = {label: k for k, label in enumerate(labels)}
    missing = [label for label in found.labels if label not in number]
    if missing:
        raise InputError(f"{len(missing)} degrees of freedom are nowhere else: {said(missing[0])}")
    place = np.array([number[label] for label in found.labels])
    entries = found.matrix.tocoo()
    n = len(labels)
    moved = sp.csc_matrix((entries.data, (place[entries.row], place[entries.col])), shape=(n, n))
    if found.stored in ("upper", "lower"):
        moved = sp.triu(moved) + sp.tril(moved, -1).T
    stored: Stored | None = "upper" if found.stored in ("upper", "lower") else found.stored
    return Found(moved.tocsc(), stored, tuple(labels))


def said(label: Label) -> str:
    """A degree of freedom in words.

    Examples
    --------
    >>> said((12, 2))
    'node 12, direction y'
    """
    return f"node {label[0]}, direction {NAMES.get(label[1], str(label[1]))}"

"""PARDISO of the oneMKL, through `pypardiso` (the extra ``pardiso``): symmetric factors, Schur complements.

Matrices are taken as symmetric and indefinite, one triangle of them. A pivot that is too small is replaced by
one that is not, and counted: such factors are of another matrix and are not to be used.
"""

from __future__ import annotations

import weakref
from importlib import import_module
from typing import Any

import numpy as np
import scipy.sparse as sp

from microslip.typing import Array, Indices

INDEFINITE = -2
"""Type of the matrix: real, symmetric, indefinite."""

OWN_SETTINGS, NESTED_DISSECTION, COUNTED = 1, 2, -1
"""Not the defaults; order by METIS; entries of the factors are to be counted."""

SMALLEST = 13
"""A pivot below 10 to minus this of the largest entry is replaced."""

BLOCKS = 1
"""Pivots may be blocks of two rows."""

FACTORISE, SOLVE = 12, 33
"""Phases."""


class Pardiso:
    """Factors of a sparse symmetric matrix.

    Parameters
    ----------
    matrix : (n, n) sparse

    Attributes
    ----------
    perturbed : int
        Pivots that were replaced: with any, the factors are those of another matrix.
    """

    def __init__(self, matrix: sp.spmatrix) -> None:
        self._upper = _upper(matrix)
        self._solver = _solver()
        self._solver.set_phase(FACTORISE)
        self._solver._call_pardiso(self._upper, np.zeros((matrix.shape[0], 1)))
        self.perturbed = int(self._solver.get_iparm(14))
        self._solver.set_phase(SOLVE)
        weakref.finalize(self, self._solver.free_memory, True)

    @property
    def order(self) -> Indices:
        """Order of the rows: as they are, since it finds a better one of its own."""
        return np.arange(self._upper.shape[0])

    @property
    def negative(self) -> int | None:
        """Number of negative eigenvalues."""
        return int(self._solver.get_iparm(23))

    def solve(self, right: Array) -> Array:
        """Solution for one right-hand side, or for one in each column."""
        columns = np.asfortranarray(right, dtype=float)
        if not columns.size:
            return np.zeros(right.shape)
        return np.asarray(self._solver._call_pardiso(self._upper, columns)).reshape(right.shape)


def schur_complement(matrix: sp.spmatrix, count: int) -> Array | None:
    """``A_bb - A_bi A_ii^-1 A_ib`` of the last rows b of a symmetric matrix; None where pivots vanish."""
    n = matrix.shape[0]
    solver = _solver()
    solver.iparm[35] = 1  # the complement comes instead of a solution
    solver.perm = np.zeros(n, dtype=np.int32)
    solver.perm[n - count :] = 1
    solver.set_phase(FACTORISE)
    found = solver._call_pardiso(_upper(matrix), np.zeros(max(n, count * count)))
    replaced = solver.get_iparm(14)
    solver.free_memory(True)
    if replaced:
        return None
    complement = found[: count * count].reshape(count, count)
    return np.asarray(0.5 * (complement + complement.T))


def _upper(matrix: sp.spmatrix) -> sp.csr_matrix:
    """One triangle, with every diagonal entry, be it zero, in the order that PARDISO wants."""
    upper = sp.triu(matrix, format="coo")
    n = upper.shape[0]
    rows, columns = (np.concatenate([np.arange(n), each]) for each in (upper.row, upper.col))
    stored = sp.csr_matrix((np.concatenate([np.zeros(n), upper.data]), (rows, columns)), (n, n))
    stored.sort_indices()
    return stored


def _solver() -> Any:
    """A solver with our settings."""
    solver = import_module("pypardiso").PyPardisoSolver(mtype=INDEFINITE)
    solver.iparm[0] = OWN_SETTINGS
    solver.iparm[1] = NESTED_DISSECTION
    solver.iparm[9] = SMALLEST
    solver.iparm[20] = BLOCKS
    solver.iparm[17] = COUNTED
    return solver

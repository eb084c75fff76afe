"""PARDISO of the oneMKL (the extra ``pardiso``): symmetric factors, and Schur complements.

Matrices are taken as symmetric and indefinite, one triangle of them. A pivot that is too small is replaced by
one that is not, and counted: such factors are of another matrix and are not to be used. `pypardiso` finds
the library; what is called is its function ``pardiso`` as the manual of the oneMKL describes it.
"""

from __future__ import annotations

import ctypes
import weakref
from functools import cache
from typing import Any

import numpy as np
import scipy.sparse as sp

from microslip.errors import ModelError
from microslip.typing import Array, Indices

SETTINGS = {1: 1, 2: 2, 10: 13, 21: 1}
"""Of ``iparm``, numbered from one: not the defaults; ordered by nested dissection; a pivot below
1e-13 of the largest entry is replaced; pivots may be blocks of two."""

SCHUR, REPLACED, NEGATIVE = 36, 14, 23
"""Of ``iparm``: the Schur complement is wanted; pivots that were replaced; negative eigenvalues."""

INDEFINITE = -2
"""Type of the matrix: real, symmetric, indefinite."""

FACTORISE, SOLVE, RELEASE = 12, 33, -1
"""Phases."""


@cache
def _library() -> Any:
    from pypardiso import PyPardisoSolver

    return PyPardisoSolver().libmkl.pardiso


class _Problem:
    """One matrix in the memory of the library."""

    def __init__(self, matrix: sp.spmatrix, settings: dict[int, int]) -> None:
        upper = _upper(matrix)
        self.rows = upper.shape[0]
        self._values = np.ascontiguousarray(upper.data, dtype=np.float64)
        self._starts = upper.indptr.astype(np.int32) + 1
        self._columns = upper.indices.astype(np.int32) + 1
        self._memory = np.zeros(64, dtype=np.int64)
        self.settings = np.zeros(64, dtype=np.int32)
        for number, value in settings.items():
            self.settings[number - 1] = value

    def call(self, phase: int, right: Array, out: Array, marked: np.ndarray) -> None:
        """Call the library for as many right-hand sides as there are columns."""
        error = ctypes.c_int32(0)
        numbers = (1, 1, INDEFINITE, phase, self.rows)
        _library()(
            self._memory.ctypes.data_as(ctypes.POINTER(ctypes.c_int64)),
            *(ctypes.byref(ctypes.c_int32(number)) for number in numbers),
            self._values.ctypes.data_as(ctypes.POINTER(ctypes.c_double)),
            *(_integers(each) for each in (self._starts, self._columns, marked)),
            ctypes.byref(ctypes.c_int32(right.shape[1] if right.ndim > 1 else 1)),
            _integers(self.settings),
            ctypes.byref(ctypes.c_int32(0)),
            right.ctypes.data_as(ctypes.POINTER(ctypes.c_double)),
            out.ctypes.data_as(ctypes.POINTER(ctypes.c_double)),
            ctypes.byref(error),
        )
        if error.value:
            raise ModelError(f"PARDISO cannot factorise the structure: its error {error.value}")

    def setting(self, number: int) -> int:
        """An entry of ``iparm``, numbered from one."""
        return int(self.settings[number - 1])

    def release(self) -> None:
        """Give the memory back."""
        nothing = np.zeros(1)
        self.call(RELEASE, nothing, nothing, np.zeros(1, dtype=np.int32))


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
        self._problem = _Problem(matrix, SETTINGS)
        self._unmarked = np.zeros(matrix.shape[0], dtype=np.int32)
        nothing = np.zeros(matrix.shape[0])
        self._problem.call(FACTORISE, nothing, np.zeros_like(nothing), self._unmarked)
        weakref.finalize(self, self._problem.release)
        self.perturbed = self._problem.setting(REPLACED)
        self.negative: int | None = self._problem.setting(NEGATIVE)

    @property
    def order(self) -> Indices:
        """Order of the rows: as they are, since it finds a better one of its own."""
        return np.arange(self._problem.rows)

    def solve(self, right: Array) -> Array:
        """Solution for one right-hand side, or for one in each column."""
        columns = np.asfortranarray(right, dtype=np.float64)
        out = np.zeros_like(columns)
        if columns.size:
            self._problem.call(SOLVE, columns, out, self._unmarked)
        return np.ascontiguousarray(out)


def schur_complement(matrix: sp.spmatrix, count: int) -> Array | None:
    """``A_bb - A_bi A_ii^-1 A_ib`` of the last rows b of a symmetric matrix; None where pivots vanish."""
    n = matrix.shape[0]
    problem = _Problem(matrix, SETTINGS | {SCHUR: 1})
    marked = np.zeros(n, dtype=np.int32)
    marked[n - count :] = 1
    out = np.zeros(max(n, count * count))
    try:
        problem.call(FACTORISE, np.zeros(n), out, marked)
    finally:
        problem.release()
    if problem.setting(REPLACED):
        return None
    complement = out[: count * count].reshape(count, count)
    return np.asarray(0.5 * (complement + complement.T))


def _upper(matrix: sp.spmatrix) -> sp.csr_matrix:
    """One triangle, with every diagonal entry, be it zero, in the order that PARDISO wants."""
    upper = sp.triu(matrix, format="coo")
    n = upper.shape[0]
    rows, columns = (np.concatenate([np.arange(n), each]) for each in (upper.row, upper.col))
    stored = sp.csr_matrix((np.concatenate([np.zeros(n), upper.data]), (rows, columns)), (n, n))
    stored.sort_indices()
    return stored


def _integers(array: np.ndarray) -> Any:
    return array.ctypes.data_as(ctypes.POINTER(ctypes.c_int32))

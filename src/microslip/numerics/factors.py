"""Factors of sparse symmetric matrices: the one place that knows which library makes them.

SuperLU comes with scipy and serves everywhere. Where PARDISO of the oneMKL is installed (the extra
``pardiso``), matrices of `LARGE` rows and more are left to it: it keeps one triangle instead of two,
orders by nested dissection, uses every core that ``OMP_NUM_THREADS`` allows, and gives a Schur complement
without the factors.
"""

from __future__ import annotations

import importlib.util
from functools import cache
from typing import Protocol

import numpy as np
import scipy.sparse as sp
import scipy.sparse.linalg as spla

from microslip.errors import ModelError
from microslip.numerics import pardiso
from microslip.typing import Array, Indices

LARGE = 20_000
"""Rows from which PARDISO is taken where it is installed: below, either takes a fraction of a second."""


class SymmetricFactors(Protocol):
    """Factors of a sparse symmetric matrix.

    Attributes
    ----------
    order : (n,) int array
        Rows in an order of elimination that keeps the factors of SuperLU sparse.
    negative : int or None
        How many eigenvalues are negative; None where the factors do not tell.
    """

    @property
    def order(self) -> Indices:
        """Order of elimination."""

    @property
    def negative(self) -> int | None:
        """Number of negative eigenvalues."""

    def solve(self, right: Array) -> Array:
        """Solution for one right-hand side, or for one in each column."""


class SuperLU:
    """Factors by SuperLU, ordered symmetrically, without pivots off the diagonal.

    Parameters
    ----------
    matrix : (n, n) sparse
        Symmetric.
    ordered : bool
        Whether rows are eliminated as they stand.
    """

    def __init__(self, matrix: sp.spmatrix, *, ordered: bool = False) -> None:
        self._lu = spla.splu(
            matrix.tocsc(),
            permc_spec="NATURAL" if ordered else "MMD_AT_PLUS_A",
            diag_pivot_thresh=0.0,
            options={"SymmetricMode": True},
        )

    @property
    def order(self) -> Indices:
        """Order of elimination."""
        return np.argsort(self._lu.perm_c)

    @property
    def negative(self) -> int | None:
        """Number of negative eigenvalues, by the signs of the pivots."""
        if not np.array_equal(self._lu.perm_r, self._lu.perm_c):
            return None
        return int((self._lu.U.diagonal() < 0).sum())

    def solve(self, right: Array) -> Array:
        """Solution for one right-hand side, or for one in each column."""
        return np.asarray(self._lu.solve(right))

    def trailing_inverse(self, count: int) -> Array:
        """The last rows and columns of the inverse.

        Raises
        ------
        ModelError
            Where pivots have moved them.
        """
        lu = self._lu
        first = lu.shape[0] - count
        columns = lu.perm_c[first:]
        if not (np.array_equal(lu.perm_r, lu.perm_c) and (columns >= first).all()):
            raise ModelError("the factors of the stiffness do not keep the interface last")
        upper = np.asarray(lu.U[first:, first:].toarray())
        lower = np.asarray(lu.L[first:, first:].toarray())
        inverse = np.linalg.inv(lower @ upper)
        own = columns - first
        return np.asarray(0.5 * (inverse + inverse.T)[np.ix_(own, own)])


@cache
def pardiso_installed() -> bool:
    """Whether the extra ``pardiso`` is there."""
    return importlib.util.find_spec("pypardiso") is not None


def factorise(matrix: sp.spmatrix) -> SymmetricFactors:
    """Factors of a sparse symmetric matrix.

    Raises
    ------
    RuntimeError
        Where the matrix is singular, as SuperLU says it.

    Examples
    --------
    >>> factors = factorise(sp.diags([2.0, -4.0, 8.0]))
    >>> factors.solve(np.ones(3)).tolist(), factors.negative
    ([0.5, -0.25, 0.125], 1)
    """
    return _by_pardiso(matrix) or SuperLU(matrix)


def _by_pardiso(matrix: sp.spmatrix) -> pardiso.Pardiso | None:
    """Factors of a large matrix by PARDISO, where it is installed and has replaced no pivot."""
    if matrix.shape[0] < LARGE or not pardiso_installed():
        return None
    factors = pardiso.Pardiso(matrix)
    return None if factors.perturbed else factors


def trailing_inverse(matrix: sp.spmatrix, count: int) -> tuple[SymmetricFactors, Array]:
    """Factors of a matrix, and the last rows and columns of its inverse.

    With the last rows b and the others i the block is the inverse of the Schur complement,
    ``(A^-1)_bb = (A_bb - A_bi A_ii^-1 A_ib)^-1``.

    Parameters
    ----------
    matrix : (n, n) sparse
        A, symmetric; its first rows in an order of elimination that keeps the factors sparse.
    count : int
        Of rows and columns b.

    Returns
    -------
    factors : SymmetricFactors
    inverse : (count, count) array

    Raises
    ------
    ModelError
        Where the factors do not keep the last rows last.
    """
    factors = _by_pardiso(matrix)
    complement = None if factors is None else pardiso.schur_complement(matrix, count)
    if factors is not None and complement is not None:
        inverse = np.linalg.inv(complement)
        return factors, 0.5 * (inverse + inverse.T)
    lu = SuperLU(matrix, ordered=True)
    return lu, lu.trailing_inverse(count)

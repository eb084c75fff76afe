"""GMRES, and preconditioners that are kept while they serve."""

from __future__ import annotations

import numpy as np
import pytest

from microslip.analyses.harmonic.krylov import Kept, gmres

SIZE = 40


class Inverse:
    """The inverse of a matrix."""

    def __init__(self, matrix):
        self.matrix = matrix

    def solve(self, right):
        return np.linalg.solve(self.matrix, right)


@pytest.fixture
def system():
    draw = np.random.default_rng(0)
    return np.eye(SIZE) + 0.3 * draw.standard_normal((SIZE, SIZE)), draw.standard_normal(SIZE)


def solved(kept, matrix, right):
    """Solve with a preconditioner that is exact for the matrix that it is made of."""
    allowed = 1e-10 * np.linalg.norm(right)
    return kept.solve(matrix.__matmul__, lambda: Inverse(matrix), right, allowed, SIZE, 3)


def test_solution_is_that_of_a_dense_solver(system):
    matrix, right = system
    x, iterations, error = gmres(matrix.__matmul__, np.copy, right, 1e-10, SIZE)
    assert x == pytest.approx(np.linalg.solve(matrix, right), rel=1e-8)
    assert np.linalg.norm(matrix @ x - right) == pytest.approx(error, abs=1e-11)
    assert iterations <= SIZE


def test_one_that_serves_is_kept(system):
    """One iteration for its own matrix, a few for one beside that."""
    matrix, right = system
    kept = Kept()
    solved(kept, matrix, right)
    assert (kept.counts.krylov, kept.counts.factorisations) == (1, 1)
    x, error = solved(kept, matrix + 1e-5 * np.eye(SIZE), right)
    assert kept.counts.factorisations == 1
    assert error <= 1e-10 * np.linalg.norm(right)
    assert (matrix + 1e-5 * np.eye(SIZE)) @ x == pytest.approx(right, abs=1e-8)


def test_one_that_does_not_is_given_up_and_made_anew(system):
    """After as many iterations more as are allowed, and not after all."""
    matrix, right = system
    other = np.roll(matrix, 1, axis=0)
    kept = Kept()
    solved(kept, matrix, right)
    x, _ = solved(kept, other, right)
    assert other @ x == pytest.approx(right, abs=1e-8)
    assert kept.counts.factorisations == 2
    assert kept.counts.krylov == 1 + (1 + 2 * 3) + 1
    assert not kept.stale

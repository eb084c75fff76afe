"""Factors of symmetric matrices, by every library that is there: closed forms of a chain of springs."""

from __future__ import annotations

import importlib.util

import numpy as np
import pytest
import scipy.sparse as sp

from microslip.numerics import factors as module
from microslip.numerics.factors import factorise, trailing_inverse

PARDISO = pytest.mark.skipif(
    importlib.util.find_spec("pypardiso") is None, reason="needs pypardiso"
)


@pytest.fixture(params=["superlu", pytest.param("pardiso", marks=PARDISO)])
def library(request, monkeypatch):
    """Which library makes factors."""
    monkeypatch.setattr(module, "pardiso_installed", lambda: request.param == "pardiso")
    monkeypatch.setattr(module, "LARGE", 0)
    return request.param


def chain(n):
    """Springs between walls; its inverse is ``min(i, j) (n + 1 - max(i, j)) / (n + 1)``, from 1 to n."""
    i = np.arange(1.0, n + 1)
    inverse = np.minimum.outer(i, i) * (n + 1 - np.maximum.outer(i, i)) / (n + 1)
    return sp.diags([-np.ones(n - 1), 2 * np.ones(n), -np.ones(n - 1)], [-1, 0, 1]), inverse


def test_it_solves(library):
    matrix, inverse = chain(60)
    factors = factorise(matrix.tocsc())
    right = np.random.default_rng(1).normal(size=(60, 3))
    np.testing.assert_allclose(factors.solve(right), inverse @ right, rtol=1e-11)
    np.testing.assert_allclose(factors.solve(right[:, 0]), inverse @ right[:, 0], rtol=1e-11)
    assert factors.solve(right[:, :0]).shape == (60, 0)
    assert sorted(factors.order) == list(range(60))


def test_factors_outlive_others(library):
    matrix, inverse = chain(30)
    first = factorise(matrix.tocsc())
    factorise((5.0 * matrix).tocsc())
    np.testing.assert_allclose(first.solve(np.eye(30)), inverse, rtol=1e-11)


@pytest.mark.parametrize("shift", [0.0, 0.5, 1.7])
def test_negative_eigenvalues_are_counted(library, shift):
    n = 41
    eigenvalues = 2 - 2 * np.cos(np.pi * np.arange(1, n + 1) / (n + 1))
    shifted = (chain(n)[0] - shift * sp.identity(n)).tocsc()
    assert factorise(shifted).negative == (eigenvalues < shift).sum()


def test_trailing_block_of_the_inverse(library):
    matrix, inverse = chain(50)
    right = np.eye(50)[:, [3, 49]]
    factors, block = trailing_inverse(matrix.tocsc(), 7)
    np.testing.assert_allclose(block, inverse[-7:, -7:], rtol=1e-11)
    np.testing.assert_allclose(factors.solve(right), inverse @ right, rtol=1e-11)


@PARDISO
def test_a_singular_matrix_is_not_taken_by_pardiso(monkeypatch):
    """It would replace the vanishing pivot and answer; SuperLU does not."""
    monkeypatch.setattr(module, "LARGE", 0)
    n = 20
    free = chain(n)[0].tolil()
    free[0, 0] = free[n - 1, n - 1] = 1.0
    try:
        answer = factorise(free.tocsc()).solve(np.ones(n))
    except RuntimeError:
        return
    assert not np.abs(answer).max() < 1e6

"""Products with symmetric matrices by the library, against numpy's general ones."""

import numpy as np
import pytest

from microslip.contact.symmetric import symmetric_product


@pytest.mark.parametrize("n", [1, 2, 7, 82, 199, 200, 403])
def test_it_is_the_general_product(n):
    rng = np.random.default_rng(n)
    M, x, out = rng.normal(size=(n, n)), rng.normal(size=n), np.full(n, np.nan)
    M += M.T
    symmetric_product(M, x, out)
    np.testing.assert_allclose(out, M @ x, rtol=0, atol=4e-16 * np.abs(M).sum(axis=1).max())


def test_of_rows_and_columns_of_larger_arrays():
    """Vectors may have gaps between their entries, and rows of the matrix between them."""
    rng = np.random.default_rng(1)
    whole, x, out = rng.normal(size=(9, 12)), rng.normal(size=(9, 3)), np.zeros((9, 2))
    M = whole[:, :9]
    M += M.T.copy()
    symmetric_product(M, x[:, 1], out[:, 0])
    np.testing.assert_allclose(out[:, 0], M @ x[:, 1], atol=1e-14)
    assert (out[:, 1] == 0).all()


def test_what_is_no_number_stays_none():
    M, x, out = np.eye(3), np.array([1.0, np.nan, 2.0]), np.zeros(3)
    symmetric_product(M, x, out)
    assert np.isnan(out).any()


def test_of_nothing_is_nothing():
    symmetric_product(np.zeros((0, 0)), np.zeros(0), np.zeros(0))

"""Ritz values of maps whose eigenvalues stand on their diagonal."""

from __future__ import annotations

import numpy as np
import pytest

from microslip.numerics.ritz import by_modulus, ritz_values

DIAGONAL = np.array([0.3, -0.9, 0.05, 0.6])
MAP = np.diag(DIAGONAL)


def test_all_eigenvalues_of_a_diagonal_map():
    vectors = list(np.random.default_rng(2).standard_normal((4, 4)))
    found = ritz_values(vectors, [MAP @ x for x in vectors])
    assert found == pytest.approx([-0.9, 0.6, 0.3, 0.05], abs=1e-12)


def test_coordinate_vectors_give_their_own_entry():
    """Of any size: only directions matter."""
    vectors = [1e-9 * np.eye(4)[1], 1e3 * np.eye(4)[2]]
    assert ritz_values(vectors, [MAP @ x for x in vectors]).tolist() == [-0.9, 0.05]


def test_one_vector_gives_its_rayleigh_quotient():
    """``x A x / x x`` of (1, 1, 0, 0): the mean of the two entries."""
    x = np.array([1.0, 1.0, 0.0, 0.0])
    assert ritz_values([x], [MAP @ x]) == pytest.approx([-0.3], abs=1e-15)


def test_rotation_has_a_conjugate_pair():
    """Half a turn less a sixth, shrinking by 0.8: ``0.8 exp(±i pi/3)``."""
    c, s = 0.8 * np.cos(np.pi / 3), 0.8 * np.sin(np.pi / 3)
    turn = np.array([[c, -s, 0], [s, c, 0], [0, 0, 0.1]])
    vectors = list(np.random.default_rng(4).standard_normal((3, 3)))
    found = ritz_values(vectors, [turn @ x for x in vectors])
    assert np.abs(found) == pytest.approx([0.8, 0.8, 0.1], abs=1e-12)
    assert sorted(np.angle(found[:2])) == pytest.approx([-np.pi / 3, np.pi / 3], abs=1e-12)


def test_directions_that_repeat_count_once():
    """Also those that differ by rounding only, and vectors of no length."""
    x, y = np.array([1.0, 0.0, 0.0, 0.0]), np.array([0.0, 0.0, 0.0, 1.0])
    vectors = [x, y, x + 1e-9 * y, 2 * y, np.zeros(4)]
    found = ritz_values(vectors, [MAP @ z for z in vectors])
    assert found == pytest.approx([0.6, 0.3], abs=1e-8)


@pytest.mark.parametrize("vectors", [[], [np.zeros(3), np.zeros(3)]])
def test_no_directions_have_no_values(vectors):
    assert ritz_values(vectors, vectors).shape == (0,)


def test_order_is_by_modulus():
    values = np.array([0.1, -2.0, 1j, 0.5])
    assert by_modulus(values).tolist() == [-2.0, 1j, 0.5, 0.1]


def test_ritz_values_of_a_linear_map():
    """Deviations that span an invariant subspace give its eigenvalues."""
    rng = np.random.default_rng(3)
    vectors = rng.standard_normal((6, 6))
    values = np.array([0.95, 0.7, -0.4, 0.1, 0.05, 0.0])
    map = vectors @ np.diag(values) @ np.linalg.inv(vectors)
    z = list((vectors[:, :3] @ rng.standard_normal((3, 5))).T)
    found = ritz_values(z, [map @ x for x in z])
    assert found[:3] == pytest.approx(values[:3], abs=1e-6)
    assert len(ritz_values([], [])) == 0

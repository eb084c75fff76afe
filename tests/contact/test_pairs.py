"""The layout of contact pairs, written down by hand."""

from __future__ import annotations

import numpy as np
import pytest

from microslip.contact.pairs import (
    BACKWARD,
    FORWARD,
    SEPARATED,
    STICK,
    at_rest,
    by_pair,
    components,
    normal,
    normal_components,
    normal_rows,
    tangential,
    tangential_rows,
    touches,
)

PLANAR = np.array([[1.0, 10.0, 2.0, 20.0, 3.0, 30.0], [-1.0, -10.0, -2.0, -20.0, -3.0, -30.0]])
SPATIAL = np.array([1.0, 10.0, 100.0, 2.0, 20.0, 200.0])


def test_states_are_numbered_as_in_the_paper():
    """Figure 5: stick, forward and backward slip, separation."""
    assert (STICK, FORWARD, BACKWARD, SEPARATED) == (1, 2, 3, 4)


def test_normal_component_comes_first():
    assert np.array_equal(normal(PLANAR), [[1, 2, 3], [-1, -2, -3]])
    assert np.array_equal(tangential(PLANAR), [[10, 20, 30], [-10, -20, -30]])
    assert np.array_equal(normal(SPATIAL, 3), [1, 2])
    assert np.array_equal(by_pair(SPATIAL, 3), [[1, 10, 100], [2, 20, 200]])
    assert np.array_equal(by_pair(PLANAR)[1], [[-1, -10], [-2, -20], [-3, -30]])


def test_parts_are_views():
    x = PLANAR.copy()
    normal(x)[:], tangential(x)[0], by_pair(x)[1, 2, 1] = 0.0, 5.0, 7.0
    assert np.array_equal(x, [[0, 5, 0, 5, 0, 5], [0, -10, 0, -20, 0, 7]])


def test_rows_of_a_matrix():
    """A matrix of four components by three columns: rows are components, columns are not."""
    matrix = np.arange(12.0).reshape(4, 3)
    assert np.array_equal(matrix[normal_rows()], [[0, 1, 2], [6, 7, 8]])
    assert np.array_equal(matrix[tangential_rows()], [[3, 4, 5], [9, 10, 11]])
    assert np.array_equal(np.arange(9)[normal_rows(3)], [0, 3, 6])


@pytest.mark.parametrize(
    ("dimension", "every", "first"),
    [(2, [6, 7, 2, 3], [6, 2]), (3, [9, 10, 11, 3, 4, 5], [9, 3])],
)
def test_places_of_pairs_follow_their_order(dimension, every, first):
    pairs = np.array([3, 1])
    assert components(pairs, dimension).tolist() == every
    assert normal_components(pairs, dimension).tolist() == first


def test_no_pairs_have_no_components():
    none = np.array([], dtype=int)
    assert len(components(none)) == len(normal_components(none)) == 0


def test_pairs_that_touch_start_sticking():
    status = at_rest(np.array([True, False, True]))
    assert status.dtype == np.int8
    assert status.tolist() == [STICK, SEPARATED, STICK]
    every = np.array([STICK, FORWARD, BACKWARD, SEPARATED], dtype=np.int8)
    assert touches(every).tolist() == [True, True, True, False]

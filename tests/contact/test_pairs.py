"""Layout of contact pairs: one vector, the same components whichever way they are asked for."""

from __future__ import annotations

import numpy as np
import pytest

from microslip.contact.pairs import (
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


@pytest.mark.parametrize("dimension", [2, 3])
def test_every_component_is_found_in_every_way(dimension):
    pairs = 5
    x = np.arange(3.0 * dimension * pairs).reshape(3, -1)
    each = by_pair(x, dimension)
    assert each.shape == (3, pairs, dimension)
    for i in range(pairs):
        np.testing.assert_array_equal(each[:, i], x[:, dimension * i : dimension * (i + 1)])
        np.testing.assert_array_equal(x[:, components(np.array([i]), dimension)], each[:, i])
    np.testing.assert_array_equal(normal(x, dimension), each[..., 0])
    np.testing.assert_array_equal(x.T[normal_rows(dimension)].T, each[..., 0])
    chosen = np.array([4, 1])
    np.testing.assert_array_equal(x[:, normal_components(chosen, dimension)], each[:, chosen, 0])


def test_planar_pairs_have_one_tangential_component():
    x = np.arange(8.0)
    np.testing.assert_array_equal(tangential(x), [1, 3, 5, 7])
    np.testing.assert_array_equal(x[tangential_rows()], tangential(x))


def test_views_write_through():
    x = np.zeros(6)
    normal(x)[:] = [1, 2, 3]
    tangential(x)[:] = -1
    np.testing.assert_array_equal(x, [1, -1, 2, -1, 3, -1])


def test_pairs_at_rest_touch_as_they_did():
    touching = np.array([True, False, True])
    status = at_rest(touching)
    np.testing.assert_array_equal(status, [STICK, SEPARATED, STICK])
    np.testing.assert_array_equal(touches(status), touching)

"""What others make of a value: of many at once against scipy's interpolator, one by one."""

import numpy as np
import pytest
from scipy.interpolate import PchipInterpolator

from microslip.analyses.reduced.missed import AROUND, HALF, missed_across, missed_by_others


def by_scipy(x, y, i, others):
    """Monotone cubics through all of the others, or a straight line beyond them, less what is there."""
    if not others[0] < i < others[-1]:
        a, b = others[:2] if i < others[0] else others[:-3:-1]
        return y[a] + (y[b] - y[a]) * (x[i] - x[a]) / (x[b] - x[a]) - y[i]
    parts = [PchipInterpolator(x[others], part[others])(x[i]) for part in (y.real, y.imag)]
    return parts[0] + 1j * parts[1] - y[i]


def drawn(kind, count):
    """Ascending frequencies, some of them crowded, and values: rough, monotone, in stairs."""
    random = np.random.default_rng(count)
    x = np.cumsum(random.choice([0.02, 0.3, 1.0], count) * random.uniform(0.5, 1.0, count))
    y = random.standard_normal(count) + 1j * random.standard_normal(count)
    if kind == "monotone":
        y = np.cumsum(np.abs(y.real)) - 1j * np.cumsum(np.abs(y.imag))
    if kind == "stairs":
        y = np.floor(2 * y.real) + 1j * np.floor(np.cumsum(y.imag))
    return x, y


@pytest.mark.parametrize("kind", ["rough", "monotone", "stairs"])
@pytest.mark.parametrize("count", [2 * AROUND + 2, 9, 40])
def test_what_others_make_of_each(kind, count):
    x, y = drawn(kind, count)
    every = np.arange(count)
    # derivatives at the two beside hang on the next ones alone, but for those next to an end of four
    inner = slice(AROUND, count - AROUND)
    found = missed_by_others(x, y)
    expected = [by_scipy(x, y, i, every[every != i]) for i in every]
    np.testing.assert_allclose(found[inner], expected[inner], rtol=1e-12, atol=1e-12)
    np.testing.assert_allclose(found[[0, -1]], [expected[0], expected[-1]], rtol=1e-12)


@pytest.mark.parametrize("kind", ["rough", "monotone", "stairs"])
def test_what_others_make_of_both_ends_of_a_stretch(kind):
    """Those that crowd beyond an end are left out."""
    x, y = drawn(kind, 40)
    every = np.arange(40)
    left, right = missed_across(x, y, missed_by_others(x, y))
    crowded = 0
    for j in range(4, 35):
        for end, side, found in ((j, -1, left), (j + 1, 1, right)):
            away = side * (x - x[end]) / (x[j + 1] - x[j])
            crowd = (away > 0) & (away < HALF)
            others = every[~crowd & (every != end)]
            crowded += crowd.any()
            if AROUND <= np.searchsorted(others, end) <= len(others) - AROUND:
                expected = by_scipy(x, y, end, others)
                np.testing.assert_allclose(found[j], expected, rtol=1e-12, atol=1e-12)
    assert crowded > 5

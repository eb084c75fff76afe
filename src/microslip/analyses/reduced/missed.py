"""What others make of a correction that is known at some frequencies, less what it is there.

Monotone cubics through the others, between them; beyond all of them a straight line.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.lib.stride_tricks import sliding_window_view
from scipy.interpolate import PchipInterpolator

from microslip.typing import Array, Complex, Indices

AROUND = 2
"""Anchors to either side that the monotone cubics are laid through: more change nothing in between."""

HALF = 0.5
"""Others that are nearer to the end of a stretch, over its length, say nothing of it."""

FEWEST = 4
"""Anchors of a branch below which nothing is said of the error between them."""

NEAREST = 9
"""Anchors nearest to one, itself among them, that tell what is usual about it."""


def correction(x: Array, y: Complex, at: Array) -> Complex:
    """What the table misses at frequencies, from that at ascending others; constant beyond them."""
    if len(x) < 2:
        return np.full(np.shape(at), y[0] if len(x) else 0.0, complex)
    both = PchipInterpolator(x, np.stack([y.real, y.imag]), axis=1)(np.clip(at, x[0], x[-1]))
    return np.asarray(both[0] + 1j * both[1])


def missed_by_others(x: Array, y: Complex) -> Complex:
    """What the others make of the correction at each of ascending frequencies, less what it is."""
    every = np.arange(len(x))
    return _missed(x, y, [(i, every[every != i]) for i in range(len(x))])


def missed_across(x: Array, y: Complex, missed: Complex) -> tuple[Complex, Complex]:
    """What the others make of both ends of every stretch between two ascending frequencies.

    As `missed_by_others`, but of others that are at least half as far away as the stretch is long: those that
    stand close beyond an end would tell what is there, and nothing of the stretch.

    Parameters
    ----------
    x, y : (n,) arrays
    missed : (n,) array
        Of all others.

    Returns
    -------
    left, right : (n - 1,) arrays

    Examples
    --------
    A curve with a kink, and two frequencies close beyond it:

    >>> x = np.array([0.0, 1.0, 2.0, 3.0, 5.0, 5.01, 5.02])
    >>> y = np.maximum(x - 4.9, 0.0).astype(complex)
    >>> missed = missed_by_others(x, y)
    >>> left, right = missed_across(x, y, missed)
    >>> bool(abs(missed[4]) < 0.03), bool(abs(right[3]) > 0.09)
    (True, True)
    """
    every, left, right = np.arange(len(x)), missed[:-1].copy(), missed[1:].copy()
    for found, ends, side in ((left, every[:-1], -1), (right, every[1:], 1)):
        asked = dict[int, tuple[int, Indices]]()
        for j, width in enumerate(np.diff(x)):
            away = side * (x - x[ends[j]])
            crowd = (away > 0) & (away < HALF * width)
            if crowd.any():
                asked[j] = ends[j], every[~crowd & (every != ends[j])]
        found[list(asked)] = _missed(x, y, list(asked.values()))
    return left, right


def most_beside(width: Array, missed: Array) -> Array:
    """The most that is missed at a stretch and at the next to either side that is not much narrower."""
    most = missed.copy()
    for j in range(len(width)):
        wide = np.flatnonzero(width >= HALF * width[j])
        i = int(np.searchsorted(wide, j))
        most[j] = missed[wide[max(i - 1, 0) : i + 2]].max()
    return most


def place(x: Array, at: Array) -> tuple[Indices, Array]:
    """Number of the anchor to the left of frequencies, and how far along they are to the next, 0 to 1."""
    left = np.clip(np.searchsorted(x, at), 1, len(x) - 1) - 1
    return left, np.clip((at - x[left]) / (x[left + 1] - x[left]), 0.0, 1.0)


def arched(most: Array, t: Array) -> Array:
    """Zero at anchors, and the most in the middle between two."""
    with np.errstate(invalid="ignore"):
        return np.where((t > 0) & (t < 1), most * 4 * t * (1 - t), 0.0)


def usually_missed(missed: Array) -> Array:
    """Median of what is missed of every anchor and those nearest to it."""
    return np.asarray(np.median(_nearest(missed), axis=-1))


def nearly_most(values: Array) -> Array:
    """What one in `NEAREST` exceeds, of every anchor and those nearest to it; the largest of fewer."""
    near = np.sort(_nearest(values), axis=-1)
    return np.asarray(near[:, -1 - near.shape[1] // NEAREST])


def _missed(x: Array, y: Complex, asked: Sequence[tuple[int, Indices]]) -> Complex:
    """What others, ascending, make of the correction at frequencies, each by index, less what it is.

    Beyond all of them by a straight line.
    """
    guess = np.full(len(asked), np.inf, np.complex128)
    between, near = list[int](), list[Indices]()
    for k, (i, others) in enumerate(asked):
        if len(others) < 2:
            continue
        after = int(np.searchsorted(others, i))
        around = others[max(after - AROUND, 0) : after + AROUND]
        if after in (0, len(others)):
            a, b = others[[0, 1]] if after == 0 else others[[-1, -2]]
            guess[k] = y[a] + (y[b] - y[a]) * (x[i] - x[a]) / (x[b] - x[a])
        elif len(around) == 2 * AROUND:
            between.append(k)
            near.append(around)
        else:
            guess[k] = correction(x[around], y[around], x[i])
    at = np.array([i for i, _ in asked], dtype=int)
    if near:
        four = np.array(near)
        guess[between] = in_the_middle(x[four], y[four], x[at[between]])
    return guess - y[at]


def in_the_middle(x: Array, y: Complex, at: Array) -> Complex:
    """Monotone cubics through four points each, a row, between the middle two.

    As `correction` has them, of all rows at once: its interpolator takes 0.15 ms to make, and a search would
    make tens of thousands.

    Examples
    --------
    >>> x, y = np.array([[0.0, 1.0, 2.0, 4.0]]), np.array([[1.0, 2.0, 4.0, 5.0 + 1j]])
    >>> bool(np.isclose(in_the_middle(x, y, np.array([1.3])), correction(x[0], y[0], np.array([1.3]))))
    True
    """
    h = np.diff(x)
    width, t = h[:, 1], (at - x[:, 1]) / h[:, 1]
    weight = np.stack([2 * h[:, 1:] + h[:, :-1], h[:, 1:] + 2 * h[:, :-1]])

    def part(y: Array) -> Array:
        slope = np.diff(y) / h
        before, after = slope[:, :-1], slope[:, 1:]
        with np.errstate(divide="ignore", invalid="ignore"):
            mean = weight.sum(axis=0) / (weight[0] / before + weight[1] / after)
        left, right = np.where(before * after > 0, mean, 0.0).T * width
        rise = y[:, 2] - y[:, 1]
        curved = (3 * rise - 2 * left - right) * t**2 + (left + right - 2 * rise) * t**3
        return np.asarray(y[:, 1] + left * t + curved)

    return np.asarray(part(y.real) + 1j * part(y.imag))


def _nearest(values: Array) -> Array:
    """Values of every anchor and those nearest to it, a row each."""
    count = min(NEAREST, len(values))
    first = np.clip(np.arange(len(values)) - count // 2, 0, len(values) - count)
    return np.asarray(sliding_window_view(values, count)[first])

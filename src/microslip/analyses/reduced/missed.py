"""What others make of a correction that is known at some frequencies, less what it is there.

Monotone cubics through the others, between them; beyond all of them a straight line.
"""

from __future__ import annotations

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
    return np.array([_missed(x, y, i, every[every != i]) for i in range(len(x))], np.complex128)


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
    for j, width in enumerate(np.diff(x)):
        for end, side, found in ((j, -1, left), (j + 1, 1, right)):
            away = side * (x - x[end])
            crowd = (away > 0) & (away < HALF * width)
            if crowd.any():
                found[j] = _missed(x, y, end, every[~crowd & (every != end)])
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


def _missed(x: Array, y: Complex, i: int, others: Indices) -> complex:
    """What others, ascending, make of the correction at a frequency, less what it is.

    Beyond all of them by a straight line.
    """
    if len(others) < 2:
        return complex(np.inf)
    after = int(np.searchsorted(others, i))
    if after in (0, len(others)):
        a, b = others[[0, 1]] if after == 0 else others[[-1, -2]]
        guess = y[a] + (y[b] - y[a]) * (x[i] - x[a]) / (x[b] - x[a])
    else:
        near = others[max(after - AROUND, 0) : after + AROUND]
        guess = complex(correction(x[near], y[near], x[i]))
    return complex(guess - y[i])


def _nearest(values: Array) -> Array:
    """Values of every anchor and those nearest to it, a row each."""
    count = min(NEAREST, len(values))
    first = np.clip(np.arange(len(values)) - count // 2, 0, len(values) - count)
    return np.asarray(sliding_window_view(values, count)[first])

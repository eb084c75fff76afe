"""The frequencies of a response, from the joint: a band that holds every resonance, then steep places.

A band begins as the reach of the resonances, from the softest to the stiffest that the loads meet
with the sliding and the stuck state among them, and `WIDTHS` half-power widths to either side. An end
at which a curve is largest is moved outward, `MOVES` times at most.

In between, intervals are halved where neighbouring complex amplitudes of a curve differ by more than
`STEP` of its peak. A fold is a jump, which no halving makes smaller: it ends at `FINEST` of the band,
and in all at `MOST` frequencies.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np

from microslip.analyses.reduced.response import Response
from microslip.analyses.reduced.sweep import CONVERGED
from microslip.typing import Array, Mask

WIDTHS = 3.0
"""Half-power widths that a band goes beyond its outermost resonances."""

SHARE = 0.1
"""The least that it goes beyond them, over the distance between them ..."""

LEAST = 0.01
"""... and over the frequency."""

BLURRED = 0.1
"""Error of the answer at an end, relative, beyond which that says nothing of where a curve is largest."""

MOVES = 6
"""So often an end is moved outward, each time by half the band."""

STEP = 0.05
"""Neighbouring amplitudes may differ by this share of the peak."""

FINEST = 1e-6
"""Smallest interval, over the band."""

MOST = 4000
"""Frequencies in all."""

Respond = Callable[[Array], Sequence[Response]]
"""Every curve over given frequencies."""


@dataclass(frozen=True)
class Peak:
    """A resonance that a band must hold: frequency and half-power width, Hz."""

    frequency: float
    width: float


def band_around(peaks: Sequence[Peak]) -> tuple[float, float]:
    """Band that holds resonances with their widths, Hz, its ends rounded outward.

    Examples
    --------
    >>> band_around([Peak(171.2, 1.0), Peak(185.5, 0.1)])
    (168.0, 188.0)
    """
    low, high = min(p.frequency for p in peaks), max(p.frequency for p in peaks)
    room = SHARE * (high - low)
    below = min(p.frequency - max(WIDTHS * p.width, room, LEAST * p.frequency) for p in peaks)
    above = max(p.frequency + max(WIDTHS * p.width, room, LEAST * p.frequency) for p in peaks)
    below = max(below, 0.5 * low)
    step = 10.0 ** math.floor(math.log10((above - below) / 5))
    start = math.floor(below / step) * step
    return _plain(start if start > 0 else below), _plain(math.ceil(above / step) * step)


def _plain(value: float) -> float:
    """Without the rounding of the last digits."""
    return float(f"{value:.10g}")


def widened(
    respond: Respond, band: tuple[float, float], free: tuple[bool, bool], count: int
) -> tuple[float, float]:
    """A band at whose free ends every curve has an answer and none is largest, Hz.

    Parameters
    ----------
    respond : callable
    band : tuple of float
        To begin with, Hz.
    free : tuple of bool
        Whether the lower and the upper end may be moved.
    count : int
        Frequencies to look at.
    """
    low, high = band
    for _ in range(MOVES):
        curves = respond(np.linspace(low, high, count))
        down = free[0] and any(goes_on(curve, 0) for curve in curves)
        up = free[1] and any(goes_on(curve, -1) for curve in curves)
        if not (down or up):
            break
        low, high = _moved(low, high, down, up)
    return low, high


def _moved(low: float, high: float, down: bool, up: bool) -> tuple[float, float]:
    """A band with ends moved outward by half of it."""
    more = 0.5 * (high - low)
    low = _plain(max(low - more, 0.5 * low)) if down else low
    return low, _plain(high + more) if up else high


def goes_on(curve: Response, end: int) -> bool:
    """Whether a curve has its largest answer at an end of its band, 0 or -1, or none there.

    One that is held to motions over time may have it there for all that is known of both, to `BLURRED`.
    """
    size = np.abs(curve.amplitude)
    off, above = 0.0, 0.0
    if curve.anchors and curve.error_indicator is not None:
        off, above = np.minimum(curve.error_indicator[[end, curve.peak]], BLURRED)
    answered = curve.flag[end] == CONVERGED
    return bool(not answered or size[end] * (1 + off) >= size[curve.peak] * (1 - above))


def farther(frequency: Array, down: bool, up: bool) -> Array:
    """Frequencies, Hz, with others beyond one end or both: half the band, as densely on average.

    Examples
    --------
    >>> farther(np.array([4.0, 4.1, 5.0, 6.0]), down=True, up=False)
    array([3. , 3.5, 4. , 4.1, 5. , 6. ])
    """
    start, stop = float(frequency[0]), float(frequency[-1])
    low, high = _moved(start, stop, down, up)
    count = max(round(0.5 * len(frequency)), 2)
    below = np.linspace(low, start, count, endpoint=False) if down else frequency[:0]
    above = np.linspace(stop, high, count + 1)[1:] if up else frequency[:0]
    return np.concatenate([below, frequency, above])


def refined(respond: Respond, frequency: Array) -> Array:
    """Frequencies with more of them where a curve is steep, Hz, ascending.

    Parameters
    ----------
    respond : callable
    frequency : (n,) array
        To begin with, ascending; all are kept.
    """
    finest = FINEST * (frequency[-1] - frequency[0])
    while len(frequency) < MOST:
        steps = np.diff(frequency)
        excess = np.zeros(len(steps))
        for curve in respond(frequency):
            excess = np.maximum(excess, _change(curve) / STEP)
        halved: Mask = (excess > 1) & (steps > 2 * finest)
        chosen = np.flatnonzero(halved)
        if not len(chosen):
            break
        chosen = chosen[np.argsort(-excess[chosen], kind="stable")][: MOST - len(frequency)]
        middle = frequency[chosen] + 0.5 * steps[chosen]
        frequency = np.sort(np.concatenate([frequency, middle]))
    return frequency


def _change(curve: Response) -> Array:
    """Difference of neighbouring answers over the peak; 0 beside a point without one."""
    good = curve.flag == CONVERGED
    largest = np.abs(curve.amplitude[good]).max(initial=0.0)
    if largest == 0:
        return np.zeros(len(good) - 1)
    change: Array = np.abs(np.diff(curve.amplitude)) / largest
    return np.where(good[1:] & good[:-1], change, 0.0)

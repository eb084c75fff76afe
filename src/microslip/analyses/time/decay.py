"""Reading a history: amplitude, frequency and damping of a decay, first harmonic of a dwell."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from scipy.signal import find_peaks

from microslip.brief import Brief
from microslip.typing import Array, Complex


@dataclass(frozen=True, repr=False)
class Decay(Brief):
    """Amplitude, frequency and damping of a vibration, one value for each of its extremes.

    Attributes
    ----------
    time : (k,) array
        Of the extreme, s.
    amplitude, offset : (k,) arrays
        Half the difference, and the mean, of an extreme and the average of its two neighbours.
    frequency : (k,) array
        Hz, from the time between the neighbours.
    damping : (k - 1,) array
        Ratio to critical damping from two successive amplitudes.
    """

    time: Array
    amplitude: Array
    offset: Array
    frequency: Array
    damping: Array


def extremes(time: Array, q: Array, cycle_steps: int) -> tuple[Array, Array]:
    """Times and values of the maxima and minima of a vibration, in turn.

    Each is the vertex of the parabola through three samples.

    Parameters
    ----------
    time, q : (n,) arrays
    cycle_steps : int
        Samples in about one cycle: extremes closer than a quarter of it count as one.
    """
    apart = max(cycle_steps // 4, 1)
    found = sorted(
        (int(k), sign) for sign in (1, -1) for k in find_peaks(sign * q, distance=apart)[0]
    )
    k = np.array(
        [n for i, (n, sign) in enumerate(found) if i == 0 or sign != found[i - 1][1]], np.int64
    )
    before, here, after = q[k - 1], q[k], q[(k + 1) % len(q)]
    curvature = before - 2 * here + after
    shift = np.divide(0.5 * (before - after), curvature, out=np.zeros(len(k)), where=curvature != 0)
    step = time[1] - time[0] if len(time) > 1 else 0.0
    return time[k] + shift * step, here - 0.25 * (before - after) * shift


def decay(time: Array, q: Array, cycle_steps: int) -> Decay:
    """Read a vibration extreme by extreme; insensitive to an offset that stays.

    Parameters
    ----------
    time, q : (n,) arrays
    cycle_steps : int
        Samples in about one cycle.

    Examples
    --------
    >>> t = np.linspace(0, 1, 2001)
    >>> found = decay(t, 3 + np.exp(-0.5 * t) * np.sin(2 * np.pi * 10 * t), 200)
    >>> round(float(found.frequency.mean()), 3), round(float(found.damping.mean() * 62.83), 3)
    (10.0, 0.5)
    """
    at, top = extremes(time, q, cycle_steps)
    if len(at) < 3:
        nothing = np.zeros(0)
        return Decay(nothing, nothing, nothing, nothing, nothing)
    other = 0.5 * (top[:-2] + top[2:])
    amplitude = 0.5 * np.abs(top[1:-1] - other)
    with np.errstate(divide="ignore", invalid="ignore"):
        decrement = np.log(amplitude[:-1] / amplitude[1:]) / np.pi
    return Decay(
        time=at[1:-1],
        amplitude=amplitude,
        offset=0.5 * (top[1:-1] + other),
        frequency=1 / (at[2:] - at[:-2]),
        damping=decrement / np.sqrt(1 + decrement**2),
    )


DWELL_HARMONICS = 5
"""Harmonics fitted at the end of a dwell, so that higher ones do not leak into the first."""


def dwell_response(time: Array, q: Array, frequencies: Sequence[float], cycles: float) -> Complex:
    """First harmonic at the end of every dwell of a stepped sine, phase against its load.

    Least squares of a constant and five harmonics over the last whole cycle of each dwell, which
    need not be a whole number of steps; nan where the history ended before.

    Parameters
    ----------
    time, q : (n,) arrays
        From the start of the stepped sine.
    frequencies : sequence of float
        Hz, in order.
    cycles : float
        Periods at each.
    """
    found = np.full(len(frequencies), np.nan, dtype=complex)
    begin, turns = 0.0, 0.0
    for i, f in enumerate(frequencies):
        end = begin + cycles / f
        inside = (time > end - min(cycles, 1.0) / f) & (time <= end * (1 + 1e-12))
        if inside.sum() >= 4 * DWELL_HARMONICS and time[-1] >= end * (1 - 1e-9) - (
            time[1] - time[0]
        ):
            phase = 2 * np.pi * (turns + f * (time[inside] - begin))
            turns_of = phase[:, None] * np.arange(1, DWELL_HARMONICS + 1)
            basis = np.hstack([np.sin(turns_of), np.cos(turns_of), np.ones((len(phase), 1))])
            fit = np.linalg.lstsq(basis, q[inside], rcond=None)[0]
            found[i] = fit[0] + 1j * fit[DWELL_HARMONICS]
        begin, turns = end, turns + cycles
    return found

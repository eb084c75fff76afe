"""Frequency of a load that changes it, as an axis above one of time."""

from __future__ import annotations

import numpy as np
from matplotlib.axes import Axes
from matplotlib.ticker import MaxNLocator, NullLocator

from microslip.describe.excitation import Excitation, SteppedSine, SweptSine
from microslip.typing import Array

MOST_TICKS = 8


def frequency_ticks(entry: Excitation) -> tuple[Array, Array]:
    """Times and the frequencies that the load has then; none where it has one, or none of its own.

    Parameters
    ----------
    entry : Excitation

    Returns
    -------
    time, frequency : (k,) arrays
        s, Hz. Of a swept sine round frequencies, of a stepped one the middle of each dwell.

    Examples
    --------
    >>> sweep = {"signal": "swept_sine", "from": 100, "to": 200, "duration": 2, "moment": 1}
    >>> time, frequency = frequency_ticks(SweptSine(**sweep))
    >>> bool(np.allclose(frequency, 100 + 50 * time))
    True
    """
    if isinstance(entry, SweptSine):
        return _of_sweep(entry)
    if isinstance(entry, SteppedSine):
        frequency = np.asarray(entry.band(), dtype=float)
        ends = np.cumsum(entry.cycles / frequency)
        every = max(-(-len(frequency) // MOST_TICKS), 1)
        middle = ends - 0.5 * entry.cycles / frequency
        return middle[::every], frequency[::every]
    return np.array([]), np.array([])


def _of_sweep(entry: SweptSine) -> tuple[Array, Array]:
    low, high = sorted((entry.from_, entry.to))
    if low == high:
        return np.array([]), np.array([])
    found = np.asarray(MaxNLocator(MOST_TICKS - 1).tick_values(low, high))
    frequency = found[(found >= low) & (found <= high)]
    if entry.sweep == "linear":
        share = (frequency - entry.from_) / (entry.to - entry.from_)
    else:
        share = np.log(frequency / entry.from_) / np.log(entry.to / entry.from_)
    return entry.duration * share, frequency


def frequency_axis(ax: Axes, entry: Excitation) -> None:
    """Draw it above axes over time; nothing where the frequency stays."""
    time, frequency = frequency_ticks(entry)
    if not len(time):
        return
    above = ax.secondary_xaxis("top")
    above.set_xticks(time, [f"{value:.4g}" for value in frequency])
    above.xaxis.set_minor_locator(NullLocator())
    above.set_xlabel("frequency of the load (Hz)")

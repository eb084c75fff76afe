"""Resonances: of a sampled response, and of the time domain near the consistent model's."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from microslip.reproduce.study import Study
from microslip.reproduce.variants import CONSISTENT, respond
from microslip.typing import Array

OFFSETS = (-1.0, -0.5, 0.0, 0.5, 1.0)
"""Hz from the consistent model's resonance at which the time domain looks for its own."""


@dataclass(frozen=True)
class Peak:
    """A resonance; `inside` where samples on both sides enclose it.

    Beside a jump to the other branch of a fold, beside points without an answer and at the end of
    the samples it may be higher.
    """

    frequency: float
    amplitude: float
    inside: bool


def vertex(frequency: Array, size: Array) -> Peak:
    """Largest sample, by the parabola through it and its neighbours where these enclose it.

    Examples
    --------
    >>> x = np.array([1.0, 2.0, 3.5])
    >>> peak = vertex(x, 5 - (x - 2.2) ** 2)
    >>> round(peak.frequency, 9), round(peak.amplitude, 9), peak.inside
    (2.2, 5.0, True)
    """
    i = int(np.nanargmax(size))
    sides = size[max(i - 1, 0) : i + 2]
    if len(sides) < 3 or not np.isfinite(sides).all() or sides.min() < 0.5 * size[i]:
        return Peak(float(frequency[i]), float(size[i]), False)
    a, b, c = np.polyfit(frequency[i - 1 : i + 2] - frequency[i], sides, 2)
    shift = -b / (2 * a)
    return Peak(float(frequency[i] + shift), float(c - b**2 / (4 * a)), True)


def time_domain_peak(study: Study, rho: float) -> Peak:
    """Resonance of the time domain at a load."""
    response = respond(study, CONSISTENT, rho, study.settings.response_band())
    centre = round(response.peak_frequency, 1)
    points = study.time_points(rho, [centre + offset for offset in OFFSETS])
    return vertex(
        np.array([p.steady.frequency for p in points]),
        np.array([abs(p.steady.amplitude) for p in points]),
    )

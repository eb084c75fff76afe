"""A motion marched cycle by cycle: the first harmonic of each."""

from __future__ import annotations

import numpy as np

from microslip.analyses.time.scheme import (
    ContactMemory,
    State,
    TimeScheme,
    contact_memory,
    march,
)
from microslip.numerics.fourier import harmonic
from microslip.typing import Array, Complex

SLOWEST = 0.95
"""Factor by which a drift is taken to fall from a third of them to the next, at most."""


def watched(
    scheme: TimeScheme,
    load: float,
    state: State,
    cycles: int,
    phase: float = 0.0,
    memory: ContactMemory | None = None,
) -> tuple[Complex, list[State]]:
    """First harmonic of every cycle of a motion from a state at a phase of the load, and its ends."""
    theta = phase + 2 * np.pi * np.arange(scheme.steps + 1) / scheme.steps
    wave, memory = load * np.sin(theta), memory or contact_memory(scheme)
    port = scheme.joint.model.port(scheme.joint.coordinate)
    Q, ends = [], [state]
    for _ in range(cycles):
        cycle = march(scheme, ends[-1], wave, memory=memory)
        Q.append(harmonic(cycle.output[:, port], theta))
        ends.append(cycle.state)
    return np.array(Q), ends[1:]


def to_come(size: Array) -> float:
    """By how much a size will still change: a geometric progression of what it did from third to third.

    Of a size that does not change ever less, as much as `SLOWEST` makes of it.
    """
    first, second, third = (float(part.mean()) for part in np.array_split(size, 3))
    before, last = abs(second - first), abs(third - second)
    factor = np.clip(last / max(before, 1e-300), 0.0, SLOWEST)
    return float(last * factor / (1 - factor))

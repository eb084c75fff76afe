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
from microslip.typing import Complex


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

"""Bodies that walk past each other, and no place of rest is found: they are marched.

The vibration repeats, but moves on with them: it changes, and may fall from its branch on the way.
"""

from __future__ import annotations

import time as clock
from dataclasses import replace

import numpy as np

from microslip.analyses.time.deviations import StateSpace
from microslip.analyses.time.offset import HORIZON
from microslip.analyses.time.resting import SLOW, Rested, begun, sought_there
from microslip.analyses.time.scheme import ContactMemory, State, TimeScheme, contact_memory, march
from microslip.analyses.time.starts import Start, end_of
from microslip.analyses.time.steady import SteadyState, steady_state, walk_of
from microslip.analyses.time.watching import watched
from microslip.contact.pairs import mean_slip
from microslip.typing import Complex

BLOCK, AT_REST, WATCHED = 50, 2, 40
"""Cycles that are marched at once where no place of rest is found, such blocks in whose last cycle bodies are
at rest after which they are, and cycles that are looked at at last."""

STRAYS = 0.01
"""How far cycles may stray from the size of a motion that is beside them, relative."""


def marched_on(
    scheme: TimeScheme,
    steady: SteadyState,
    tolerance: float,
    memory: ContactMemory | None = None,
    begin: State | Start | None = None,
    most: float = HORIZON,
) -> Rested:
    """A motion that walks after so many cycles, or at rest before: where no place of rest is found.

    Marched cycle by cycle. What it has come to by then, on its branch or another, has settled if a search
    from there ends beside it; else it is returned as it is then, not converged.

    Parameters
    ----------
    scheme, steady, tolerance, memory, begin
        As for `rested`; the motion has settled, but for its walk.
    most : float
        Cycles.

    Raises
    ------
    ContactError
        Where a step does not solve.
    """
    began = clock.perf_counter()
    memory = memory or contact_memory(scheme)
    dimension, load = scheme.joint.model.dimension, steady.load
    first = begun(StateSpace(scheme, 2 * np.pi * steady.frequency), steady, memory, begin)
    assert first is not None, "it has settled"
    state = first.state
    start = mean_slip(state.v, dimension)
    wave = load * np.sin(2 * np.pi * np.arange(BLOCK * scheme.steps + 1) / scheme.steps)
    slow, cycles = 0, 0
    while cycles < most and slow < AT_REST:
        state = march(scheme, state, wave[: -scheme.steps], memory=memory).state
        last = march(scheme, state, wave[: scheme.steps + 1], keep=True, memory=memory)
        state, cycles = last.state, cycles + BLOCK
        walk = abs(walk_of(replace(steady, cycle=last), dimension))
        slow = slow + 1 if walk <= SLOW else 0
    Q, ends = watched(scheme, load, state, WATCHED, memory=memory)
    final, apart = _beside(scheme, steady, Q, ends[-1], tolerance, memory)
    place = mean_slip(final.cycle.state.v, dimension)
    rests = slow == AT_REST
    return Rested(
        steady=replace(final, seconds=clock.perf_counter() - began),
        apart=apart,
        offset=place if rests else None,
        walked=float(np.linalg.norm(place - start)),
        lasts=float(cycles) if rests else np.inf,
        ahead=0.0 if rests else np.nan,
        cycles=cycles + WATCHED + final.cycles,
    )


def _beside(
    scheme: TimeScheme,
    steady: SteadyState,
    Q: Complex,
    end: State,
    tolerance: float,
    memory: ContactMemory,
) -> tuple[SteadyState, float]:
    """The steady motion beside one that was watched, and how far cycles of that stray from its size.

    Where a search leads elsewhere or nowhere that itself, not converged.
    """
    final = sought_there(scheme, steady, end, tolerance, memory)
    apart = float(np.abs(np.abs(Q) / abs(final.amplitude) - 1).max())
    if final.converged and apart <= STRAYS:
        return final, apart
    start = end_of(end, 0.0, scheme, steady.frequency)
    itself = steady_state(
        scheme,
        steady.frequency,
        steady.load,
        start=start,
        accelerate=False,
        max_cycles=1,
        memory=memory,
    )
    return replace(itself, converged=False, cycles=final.cycles + itself.cycles), apart

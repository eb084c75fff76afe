"""Settled motions whose bodies still walk past each other, and where these come to rest.

The walk is left out of what a search measures, so that it settles within some cycles wherever the bodies are:
to the vibration at that offset. From how far they move on in its last cycle, and from another offset, follows
where they come to rest (`offset.py`), in some tens of cycles in all instead of the thousands of the walk.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from microslip.analyses.time.deviations import StateSpace
from microslip.analyses.time.offset import Looked, come_to_rest, walks
from microslip.analyses.time.scheme import ContactMemory, State, TimeScheme, contact_memory, march
from microslip.analyses.time.starts import end_of
from microslip.analyses.time.steady import SteadyState, steady_state, walk_of
from microslip.contact.pairs import tangential_vectors
from microslip.errors import ContactError
from microslip.typing import Array

CYCLES, CLOSE = 16, 1e-4
"""Cycles in which a search has to settle at an offset, and to what change: while the bodies walk the
vibration changes with them, and no search ends below that."""

SLOW = 1e-6
"""Share of the slip that bodies move on by in a cycle below which they are at rest."""

NARROW = 1e-4
"""Relative error of the amplitude at which it is known where they come to rest."""

FINAL = 50
"""Cycles at most of the search there."""


class Rested(NamedTuple):
    """A motion whose bodies have come to rest, or are on the way there for long.

    Attributes
    ----------
    steady : SteadyState
        Where they rest, or after `offset.HORIZON` cycles where they do not by then.
    apart : float
        By how much its amplitude may be off for the offset alone, relative.
    offset : (d - 1,) array
        Between the bodies where they rest, mean of the pairs, m.
    walked : float
        How far they walk until then, m.
    lasts : float
        In how many cycles, about.
    ahead : float
        Relative change of the amplitude until they rest; zero where they do.
    cycles : int
        Marched to find it.
    """

    steady: SteadyState
    apart: float
    offset: Array
    walked: float
    lasts: float
    ahead: float
    cycles: int


class AtOffset(NamedTuple):
    """The motion that a search has found at an offset, its state at phase 0 of the load, and its cycles."""

    looked: Looked
    state: State
    cycles: int


def at_phase_0(
    scheme: TimeScheme, steady: SteadyState, memory: ContactMemory | None = None
) -> State:
    """The end of the last cycle, marched on to where the load passes through zero."""
    left = -steady.phase % (2 * np.pi)
    per_cycle = len(steady.cycle.r) - 1
    steps = round(left / (2 * np.pi) * per_cycle)
    if steps % per_cycle == 0:
        return steady.cycle.state
    theta = steady.phase + left * np.arange(steps + 1) / steps
    wave = steady.load * np.sin(theta)
    return march(scheme, steady.cycle.state, wave, memory=memory).state


def searched(
    space: StateSpace,
    frequency: float,
    load: float,
    state: State,
    memory: ContactMemory,
) -> AtOffset | None:
    """The motion at the offset of a state, by a search; None where that does not settle.

    Parameters
    ----------
    space : StateSpace
        Of the scheme.
    frequency, load : float
    state : State
        At phase 0 of the load.
    memory : ContactMemory
    """
    scheme = space.scheme
    start = end_of(state, 0.0, scheme, frequency)
    try:
        steady = steady_state(
            scheme, frequency, load, start=start, max_cycles=CYCLES, memory=memory
        )
        if steady.change > CLOSE:
            return None
        end = at_phase_0(scheme, steady, memory)
    except ContactError:
        return None
    return AtOffset(_looked(space, steady, end), end, steady.cycles)


def rested(
    scheme: TimeScheme,
    steady: SteadyState,
    tolerance: float,
    memory: ContactMemory | None = None,
) -> Rested | None:
    """Where the bodies of a settled motion come to rest; None where they do not walk, or do not come to rest.

    Parameters
    ----------
    scheme : TimeScheme
        The one the motion was found with.
    steady : SteadyState
    tolerance : float
        Change over a cycle of the motion that is returned.
    memory : ContactMemory, optional
        As for `steady_state`.
    """
    dimension = scheme.joint.model.dimension
    if abs(walk_of(steady, dimension)) <= SLOW or not walks(_rate(steady, dimension)):
        return None
    memory = memory or contact_memory(scheme)
    frequency, load = steady.frequency, steady.load
    space = StateSpace(scheme, 2 * np.pi * frequency)
    last, spent = at_phase_0(scheme, steady, memory), 0

    def look(vector: Array) -> Looked:
        nonlocal last, spent
        found = searched(space, frequency, load, space.state(vector, last), memory)
        if found is None:
            raise ContactError("no steady motion at this offset")
        last, spent = found.state, spent + found.cycles
        return found.looked

    steps = len(steady.cycle.r) - 1
    wave = load * np.sin(2 * np.pi * np.arange(steps + 1) / steps)
    begin = _looked(space, steady, last)
    begin = begin._replace(
        way=space.vector(march(scheme, last, wave, memory=memory).state) - begin.vector
    )
    try:
        rest = come_to_rest(look, begin, narrow=NARROW)
        if rest is None:
            return None
        there = rest.on_the_way()
        vector = rest.vector if there is None else there[0]
        start = end_of(space.state(vector, last), 0.0, scheme, frequency)
        final = steady_state(
            scheme,
            frequency,
            load,
            start=start,
            tolerance=tolerance,
            max_cycles=FINAL,
            memory=memory,
        )
    except ContactError:
        return None
    if not final.converged:
        return None
    walked = float(np.linalg.norm(rest.offset - begin.offset.mean(axis=0)))
    size, apart, ahead = abs(final.amplitude), rest.apart, 0.0
    if there is not None:
        ahead, apart = abs(rest.amplitude) / size - 1, apart + abs(size / abs(there[1]) - 1)
    return Rested(final, apart, rest.offset, walked, rest.cycles, ahead, spent + final.cycles + 1)


def _looked(space: StateSpace, steady: SteadyState, end: State) -> Looked:
    """What a settled motion says of a walk, but for the way, which one cycle does not tell from the rest."""
    dimension = space.scheme.joint.model.dimension
    vector = space.vector(end)
    return Looked(
        offset=tangential_vectors(end.v, dimension),
        rate=_rate(steady, dimension),
        amplitude=steady.amplitude,
        vector=vector,
        way=np.zeros_like(vector),
    )


def _rate(steady: SteadyState, dimension: int) -> Array:
    slip = tangential_vectors(steady.cycle.v, dimension)
    return np.asarray(slip[-1] - slip[0])

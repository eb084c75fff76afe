"""Settled motions whose bodies still walk past each other, and where these come to rest.

The walk is left out of what a search measures, so that it settles within some cycles wherever the bodies are:
to the vibration at that offset. From how far they move on in its last cycle, and from another offset, follows
where they come to rest (`offset.py`), in some tens of cycles in all instead of the thousands of the walk.
Where that is not found these are marched (`walking_on.py`).
"""

from __future__ import annotations

from collections.abc import Callable
from typing import NamedTuple

import numpy as np

from microslip.analyses.time.deviations import StateSpace
from microslip.analyses.time.offset import (
    HORIZON,
    SURELY,
    Looked,
    Rest,
    as_far,
    come_to_rest,
    elsewhere,
    walks,
)
from microslip.analyses.time.scheme import ContactMemory, State, TimeScheme, contact_memory, march
from microslip.analyses.time.starts import Start, end_of
from microslip.analyses.time.steady import SteadyState, steady_state, walk_of
from microslip.contact.pairs import mean_slip, tangential_vectors
from microslip.errors import ContactError
from microslip.typing import Array

CYCLES, STEADY, CLOSE = 16, 1e-5, 1e-4
"""Cycles of a search at an offset, the change over one at which it ends before, and that to which it has to
have come: while the bodies walk the vibration changes with them, and no search ends below that."""

LONGER = 4
"""Times as many cycles of a second search, from where the first has come to."""

IN_VAIN = (1 + LONGER) * CYCLES
"""Cycles that both take where neither settles."""

SLOW = 1e-6
"""Share of the slip that bodies move on by in a cycle below which they are at rest."""

NARROW = 1e-4
"""Relative error of the amplitude at which it is known where they come to rest."""

REFINED = 4
"""Times at most that bodies on the way are looked at where they are, and half-way along the part before that
is known least: how fast they are there tells how far they get."""

FINAL, MISSED = 50, 0.05
"""Cycles at most of the search there, and by how much what it finds may differ from what the looks say,
relative: beside the end of a branch it may fall to another."""


class WalksOnError(ContactError):
    """Bodies walk past each other, and where they come to rest is not found, nor where they are later."""


class Rested(NamedTuple):
    """A motion whose bodies have come to rest, or are on the way there for long.

    Attributes
    ----------
    steady : SteadyState
        Where they rest, or after `offset.HORIZON` cycles where they do not by then.
    apart : float
        By how much its amplitude may be off for the offset alone, relative.
    offset : (d - 1,) array or None
        Between the bodies where they rest, mean of the pairs, m; None where that is not found.
    walked : float
        How far they walk until they rest, m; where that is not found, for `offset.HORIZON` cycles.
    lasts : float
        In how many cycles, about; infinite where that is not found.
    ahead : float
        Relative change of the amplitude until they rest; zero where they do, nan where that is not found.
    cycles : int
        Marched to find it.
    around : float
        By how much the amplitude differs after other numbers of cycles than `offset.HORIZON`, relative, per
        share that they differ by, up to half of them; nan where that is not known.
    began : Start or None
        The motion that it is counted from; None where they were marched.
    """

    steady: SteadyState
    apart: float
    offset: Array | None
    walked: float
    lasts: float
    ahead: float
    cycles: int
    around: float = float("nan")
    began: Start | None = None


class AtOffset(NamedTuple):
    """The motion that a search has found at an offset.

    Attributes
    ----------
    looked : Looked
    state : State
        At phase 0 of the load.
    cycles : int
    change : float
        Relative change of the vibration over its last cycle.
    """

    looked: Looked
    state: State
    cycles: int
    change: float


def at_phase_0(
    scheme: TimeScheme, steady: SteadyState, memory: ContactMemory | None = None
) -> State:
    """The end of the last cycle, marched on to where the load passes through zero."""
    left = -steady.phase % (2 * np.pi)
    per_cycle = steady.steps
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
    begin: State | Start,
    memory: ContactMemory,
    tolerance: float = STEADY,
) -> AtOffset | None:
    """The motion at the offset of a state, by a search; None where that does not settle.

    Parameters
    ----------
    space : StateSpace
        Of the scheme.
    frequency, load : float
    begin : State or Start
        A state is one at phase 0 of the load.
    memory : ContactMemory
    tolerance : float
        Change at which it ends at first; then `CLOSE`.
    """
    scheme = space.scheme
    start = begin if isinstance(begin, Start) else end_of(begin, 0.0, scheme, frequency)
    spent = 0
    try:
        for cycles, enough in ((CYCLES, tolerance), (LONGER * CYCLES, CLOSE)):
            steady = steady_state(
                scheme,
                frequency,
                load,
                start=start,
                tolerance=enough,
                max_cycles=cycles,
                memory=memory,
            )
            start, spent = steady.end, spent + steady.cycles
            if steady.change <= CLOSE or (enough == CLOSE and steady.converged):
                end = at_phase_0(scheme, steady, memory)
                return AtOffset(_looked(space, steady, end), end, spent, steady.change)
    except ContactError:
        return None
    return None


def rested(
    scheme: TimeScheme,
    steady: SteadyState,
    tolerance: float,
    memory: ContactMemory | None = None,
    begin: State | Start | None = None,
) -> Rested | None:
    """Where the bodies of a motion come to rest; None where they do not walk, or nothing has settled.

    Parameters
    ----------
    scheme : TimeScheme
        The one the motion was found with.
    steady : SteadyState
        What a search has ended with: a motion that walks need not have settled, since that changes it.
    tolerance : float
        Change over a cycle of the motion that is returned.
    memory : ContactMemory, optional
        As for `steady_state`.
    begin : State or Start, optional
        What the search has started from (a state is one at phase 0 of the load). A long one moves the bodies,
        by as much as hundreds of cycles do; then the walk is counted from where a short one leads. Where that
        has moved them by more than it lasts as well, from where they were.

    Raises
    ------
    WalksOnError
        Where they walk, and where they come to rest is not found.
    """
    if not may_walk(steady, scheme):
        return None
    memory = memory or contact_memory(scheme)
    frequency, load = steady.frequency, steady.load
    space = StateSpace(scheme, 2 * np.pi * frequency)
    first = begun(space, steady, memory, begin)
    if first is None or not walks(first.looked.rate):
        return None
    last, spent, seen = first.state, first.cycles, [first.looked]
    own = abs(first.looked.amplitude)

    def look(vector: Array) -> Looked:
        nonlocal last, own, spent
        found = searched(space, frequency, load, space.state(vector, last), memory)
        if found is None:
            raise ContactError("no steady motion at this offset")
        spent += found.cycles
        seen.append(found.looked)
        size = abs(found.looked.amplitude)
        if not elsewhere(size, (own, own)):
            last, own = found.state, size
        return found.looked

    steps = steady.steps
    wave = load * np.sin(2 * np.pi * np.arange(steps + 1) / steps)
    try:
        after = march(scheme, last, wave, memory=memory).state
        way = space.vector(after) - first.looked.vector
        start = first.looked._replace(way=way)
        cycles = 0.0 if begin is None else _moved_by(steady, start, begin)
        before = _before_the_search(start, cycles, look) if cycles else None
        if before is not None:
            start, seen = before, [before]
        rest = _end(start, look, seen)
        if first.change > CLOSE + SURELY * _by_the_walk(space, rest):
            raise WalksOnError("the bodies walk on, and the vibration changes by more than that")
        rest, there, moved = followed(rest, look)
        if there is not None and cycles and before is None:
            raise WalksOnError("the bodies walk on, and from where they began no motion is found")
        vector = rest.vector if there is None else there[0]
        final = sought_there(scheme, steady, space.state(vector, last), tolerance, memory)
    except ContactError as error:
        raise WalksOnError(str(error)) from error
    if not final.converged:
        raise WalksOnError("the bodies walk on, and the vibration where they rest does not settle")
    size, ahead = abs(final.amplitude), 0.0
    missed = abs(size / abs(rest.amplitude if there is None else there[1]) - 1)
    if missed > MISSED:
        raise WalksOnError("the bodies walk on, and where they rest the motion is another")
    apart = rest.apart + moved + missed
    if there is not None:
        ahead = abs(rest.amplitude) / size - 1
    place = rest.offset
    offset: Array | None = place
    if rest.speed:  # where they rest is not known
        place = mean_slip(final.cycle.state.v, scheme.joint.model.dimension)
        offset, ahead = None, np.nan
    walked = float(np.linalg.norm(place - start.offset.mean(axis=0)))
    spent += final.cycles + 1
    return Rested(
        steady=final,
        apart=float(apart),
        offset=offset,
        walked=walked,
        lasts=rest.cycles,
        ahead=ahead,
        cycles=spent,
        around=rest.around(),
        began=end_of(space.state(start.vector, last), 0.0, scheme, frequency),
    )


def sought_there(
    scheme: TimeScheme, steady: SteadyState, state: State, tolerance: float, memory: ContactMemory
) -> SteadyState:
    """What a search ends with from where the bodies of a motion have come to, a state at phase 0."""
    return steady_state(
        scheme,
        steady.frequency,
        steady.load,
        start=end_of(state, 0.0, scheme, steady.frequency),
        tolerance=tolerance,
        max_cycles=FINAL,
        memory=memory,
    )


def begun(
    space: StateSpace, steady: SteadyState, memory: ContactMemory, begin: State | Start | None
) -> AtOffset | None:
    """The motion that a walk begins with: by a short search where the one that was made was long."""
    own = None
    if steady.converged:
        end = at_phase_0(space.scheme, steady, memory)
        own = AtOffset(_looked(space, steady, end), end, 0, steady.change)
    if begin is None or steady.cycles <= CYCLES:
        return own
    short = searched(space, steady.frequency, steady.load, begin, memory, CLOSE)
    size = abs(steady.amplitude)
    if short is None or (own and elsewhere(abs(short.looked.amplitude), (size, size))):
        return own
    return short


def _moved_by(steady: SteadyState, after: Looked, begin: State | Start) -> float:
    """Cycles of the walk, as fast as it is now, by which a search has moved bodies; else zero.

    So it is where they walk as far in as many cycles as it lasts, or swing as far in one.
    """
    along, dimension = after.along, after.offset.shape[1] + 1
    speed = after.speed(along)
    way = after.at(along) - float(mean_slip(begin.v, dimension) @ along)
    swing = float(np.ptp(tangential_vectors(steady.cycle.v, dimension).mean(axis=1) @ along))
    return way / speed if abs(way) > max(IN_VAIN * speed, swing) else 0.0


def _before_the_search(
    after: Looked, cycles: float, look: Callable[[Array], Looked]
) -> Looked | None:
    """The motion where bodies were so many cycles of the walk before, as fast as it is now.

    None where none of the same branch is found that walks that way.
    """
    along, size = after.along, abs(after.amplitude)
    try:
        before = look(after.vector - cycles * after.way)
    except ContactError:
        return None
    rate = before.speed(along)
    if rate <= 0 or not walks(before.rate) or elsewhere(abs(before.amplitude), (size, size)):
        return None
    return before._replace(way=rate / after.speed(along) * after.way)


def _end(begin: Looked, look: Callable[[Array], Looked], seen: list[Looked]) -> Rest:
    """Where a walk ends; where that is not found, as far as it was seen: `offset.HORIZON` cycles at least."""
    try:
        rest = come_to_rest(look, begin, narrow=NARROW)
    except ContactError:
        rest = None
    if rest is None:
        rest = as_far(seen)
        if rest is None or rest.on_the_way() is None:
            raise WalksOnError("the bodies walk on, and where they come to rest is not found")
    return rest


def followed(
    rest: Rest, look: Callable[[Array], Looked], cycles: float = HORIZON
) -> tuple[Rest, tuple[Array, complex] | None, float]:
    """Where bodies are on the way, if they are, with more looks, and what the last have moved it by.

    Parameters
    ----------
    rest : Rest
        Where they come to rest, by few looks.
    look : callable
        As for `microslip.analyses.time.offset.come_to_rest`.
    cycles : float
        After which they are to be known, from the first look.

    Returns
    -------
    rest : Rest
        With more looks.
    there : tuple or None
        State and amplitude after those cycles; None where the bodies rest by then.
    moved : float
        What the last looks have changed the size there by, relative.

    Raises
    ------
    ContactError
        Where a look is of another branch, or neither where they rest nor where they are by then is known.
    """
    there, moved = rest.on_the_way(cycles), 0.0
    for _ in range(REFINED):
        if there is None:
            break
        here = look(there[0])
        more = here, look(rest.widest(here))
        if any(elsewhere(abs(one.amplitude), (abs(there[1]),) * 2) for one in more):
            raise ContactError("the motion on the way is of another branch")
        rest = rest.knowing(*more)
        before, there = there, rest.on_the_way(cycles)
        amplitude = rest.amplitude if there is None else there[1]
        moved = abs(abs(before[1]) / abs(amplitude) - 1)
        if moved <= NARROW:
            break
    if there is None and rest.speed:
        raise ContactError("the bodies walk on, and where they are later is not found")
    return rest, there, moved


def _by_the_walk(space: StateSpace, rest: Rest) -> float:
    """Relative change of the vibration over a cycle that the first part of a walk makes."""
    first, *more = rest.looked
    other = more[0].vector if more else rest.vector
    to = more[0].at(first.along) if more else float(rest.offset @ first.along)
    way = to - first.at(first.along)
    return space.change(first.vector, other) * first.speed(first.along) / way if way > 0 else 0.0


def may_walk(steady: SteadyState, scheme: TimeScheme) -> bool:
    """Whether the bodies of a motion may walk: that of one that has not settled says little."""
    dimension = scheme.joint.model.dimension
    moves = abs(walk_of(steady, dimension)) > SLOW
    return moves and (not steady.converged or walks(_rate(steady, dimension)))


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

"""Where time integration alone says that a motion ends, as the truth about one that is shown.

A motion is marched until its amplitude no longer drifts: not within twice as long as it has been marched, nor
until the cycle after which motions of bodies that walk are shown. After as many, what hardly changes any more
is the motion that is meant.
"""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import suppress
from dataclasses import replace
from functools import partial
from typing import NamedTuple

import numpy as np

from microslip.analyses.prepared.joint import PreparedJoint
from microslip.analyses.reduced.response import Response
from microslip.analyses.reduced.sweep import CONVERGED
from microslip.analyses.time import offset
from microslip.analyses.time.scheme import State, TimeScheme, prestressed_state, time_scheme
from microslip.analyses.time.starts import end_of, mixed, placed
from microslip.analyses.time.steady import SteadyState, raised_state, steady_state
from microslip.analyses.time.watching import watched
from microslip.errors import MicroslipError

STEPS, CYCLES, TOLERANCE = 150, 400, 3e-6
"""Per cycle, with which motions are marched and sought; cycles of a search, and to what it goes on."""

RAISED = 30
"""Cycles over which the load is raised from rest."""

SETTLED = 1e-3
"""What an amplitude may still drift by, relative, and vary by in its last cycles, where it is a truth."""

PART = 100
"""Cycles between which the drift is taken."""

HORIZON = int(offset.HORIZON)
"""Cycles after which the motion of bodies that walk is shown."""

FINER, MOST_FINER = 1200, 1000
"""Steps per cycle with which it is then marched on, and for so many cycles at most."""

LASTS = 10
"""Times what the last `PART` cycles have changed that may be to come after `HORIZON`: more is no walk."""

ELSEWHERE = 0.05
"""A steady state from rest that is off by more may be that of another branch."""

ASIDE, CLOSER = 24, 3
"""A branch is followed from so many frequencies to the side, in steps of so many."""

ON_THE_WAY = 60
"""Cycles at most at each of them."""

PUSH = 0.01
"""Share of its own size that a motion is pushed off by that a search has found."""


class End(NamedTuple):
    """Where a motion is after it was marched.

    Attributes
    ----------
    least, most : float
        Sizes in its last cycles.
    settled : bool
    left : float
        Of one that has, by how much it may still be off, relative.
    """

    least: float
    most: float
    settled: bool
    left: float = 0.0

    def off(self, own: float) -> float:
        """Largest relative difference of a size to these."""
        return max(abs(own / self.least - 1), abs(own / self.most - 1))

    def beyond(self, size: float) -> float:
        """How far a size is beyond these, relative; zero in between."""
        return max(self.least / size - 1, size / self.most - 1, 0.0)

    @property
    def spread(self) -> float:
        """How far sizes in its last cycles are from their middle at most, relative."""
        return (self.most - self.least) / (self.most + self.least)

    def near(self, own: float) -> bool:
        """Whether a size is that of this motion, for all that is known."""
        return bool(self.off(own) <= ELSEWHERE)


def marched(
    joint: PreparedJoint, f: float, load: float, state: State | None, phase: float = 0.0
) -> End | None:
    """Where a motion ends, marched from a state at a phase of the load; None where a step does not solve.

    Without a state from rest, after the load was raised. Then it is marched on with more steps: what few have
    beat for good may repeat, and is the truth as well as it lies within that beat. Where it has settled with
    few and does not with more, and stays, it is the truth as well as that.
    """
    scheme, finer = _scheme(joint, f), _scheme(joint, f, FINER)
    try:
        state = raised_state(scheme, f, load, RAISED) if state is None else state
        end, state, cycles = to_its_end(scheme, load, state, phase, HORIZON)
    except MicroslipError:
        return None
    try:
        state = placed(end_of(state, phase, scheme, f), finer, f, load)
        better = to_its_end(finer, load, state, phase, MOST_FINER, cycles).end
    except MicroslipError:
        return end
    if not end.settled:
        return better._replace(left=better.left + end.beyond(better.least))
    if better.settled or not better.near(end.most):
        return better
    return end._replace(left=max(end.left, better.off(end.most)))


class Marched(NamedTuple):
    """Where a motion is after it was marched, its state then, and the cycles that it took."""

    end: End
    state: State
    cycles: int


def to_its_end(
    scheme: TimeScheme, load: float, state: State, phase: float, most: int, before: int = 0
) -> Marched:
    """Where a motion is once its amplitude no longer drifts, or after so many cycles.

    Parameters
    ----------
    scheme : TimeScheme
    load : float
    state : State
        At that phase of the load.
    phase : float
    most : int
        Cycles.
    before : int
        That it has been marched before.
    """
    last = np.inf
    for count in range(1, most // PART + 1):
        Q, states = watched(scheme, load, state, PART, phase)
        size, state = np.abs(Q), states[-1]
        drift = abs(size.mean() / last - 1)
        left = float(to_come(drift, count, before) + np.ptp(size) / size.mean())
        if left <= SETTLED:
            return Marched(End(float(size[-1]), float(size[-1]), True, left), state, count * PART)
        last = size.mean()
    return Marched(End(float(size.min()), float(size.max()), False), state, most)


def to_come(drift: float, count: int, before: int = 0) -> float:
    """What an amplitude may still change by, from what it does in `PART` cycles, after `count` times as many
    and what went before: twice as long again, or until `HORIZON`, whichever is more; then `LASTS` times it.
    """
    rest = (HORIZON - before) / PART - count
    return drift * (max(2 * count, rest) if rest > 0 else LASTS)


def elsewhere(joint: PreparedJoint, curve: Response, k: int) -> list[End]:
    """Other motions at a frequency: from rest with the velocity of that shown, followed, and swept to."""
    f, own = float(curve.frequency[k]), abs(curve.amplitude[k])

    def from_rest() -> End | None:
        steady = _sought(joint, curve, k, None, CYCLES)
        return pushed(joint, f, curve.load, steady)

    ways = (
        from_rest,
        *(partial(followed, joint, curve, k, side) for side in (1, -1)),
        *(partial(swept, joint, curve, k, side) for side in (1, -1)),
    )
    found: list[End] = []
    for way in ways:
        try:
            end = way()
        except MicroslipError:
            continue
        found += [end] if end else []
        if end and end.settled and end.near(own):
            break
    return found


def varies(joint: PreparedJoint, curve: Response, k: int) -> End | None:
    """Where a motion ends that is said to vary for good: from what is shown, or after the load was raised.

    The former with more steps, as how far motions vary depends on these.
    """
    f, own = float(curve.frequency[k]), abs(curve.amplitude[k])
    end = None
    with suppress(MicroslipError):
        end = pushed(joint, f, curve.load, _sought(joint, curve, k, None, CYCLES))
    return end if end is not None and end.near(own) else marched(joint, f, curve.load, None)


def pushed(joint: PreparedJoint, f: float, load: float, steady: SteadyState) -> End | None:
    """Where the motion beside a periodic one ends, marched with more steps, and larger by `PUSH` at first.

    From the steps that it has, and for longer, where it does not settle with more.
    """
    scheme = _scheme(joint, f, FINER)
    settings = {"tolerance": TOLERANCE, "max_cycles": CYCLES}
    try:
        finer = steady_state(scheme, f, load, start=steady.end, **settings)
        if finer.converged and abs(abs(finer.amplitude) / abs(steady.amplitude) - 1) <= ELSEWHERE:
            state = larger(scheme, finer)
            end = to_its_end(scheme, load, state, finer.phase, MOST_FINER).end
            if end.settled or not end.near(abs(finer.amplitude)):
                return end
    except MicroslipError:
        return None
    return marched(joint, f, load, larger(_scheme(joint, f), steady), steady.phase)


def larger(scheme: TimeScheme, steady: SteadyState) -> State:
    """The state of a motion a little larger than a periodic one: `PUSH` more of all that moves."""
    own, still = steady.end, prestressed_state(scheme)
    rest = replace(own, eta=still.eta, rate=0 * own.rate, r=still.r, v=still.v)
    mixture = mixed(((own, 1 + PUSH), (rest, -PUSH)))
    return placed(mixture, scheme, steady.frequency, steady.load)


def followed(joint: PreparedJoint, curve: Response, k: int, side: int) -> End | None:
    """Where a motion ends on the branch that is followed from one side of a frequency."""
    steady = None
    for j in _beside(curve, k, side, CLOSER):
        steady = _sought(joint, curve, j, steady, ON_THE_WAY)
    steady = _sought(joint, curve, k, steady, CYCLES)
    return pushed(joint, steady.frequency, curve.load, steady)


def swept(joint: PreparedJoint, curve: Response, k: int, side: int) -> End | None:
    """Where a motion ends that is marched from one side of a frequency, from one of the response to the next.

    Begun at the nearest where a motion is found that is near the one shown. At the last before the frequency
    bodies that walk come to rest, as where a branch ends depends on where they are.
    """
    way = _beside(curve, k, side, 1)
    steady, way = next(_near(joint, curve, way), (None, []))
    if steady is None:
        return None
    start, phase, load = steady.end, steady.phase, curve.load
    for j in way:
        f = float(curve.frequency[j])
        scheme = _scheme(joint, f)
        most = HORIZON if j == way[-1] else PART
        state = to_its_end(scheme, load, placed(start, scheme, f, load), phase, most).state
        start = end_of(state, phase, scheme, f)
    f = float(curve.frequency[k])
    return marched(joint, f, load, placed(start, _scheme(joint, f), f, load), phase)


def _near(
    joint: PreparedJoint, curve: Response, way: list[int]
) -> Iterator[tuple[SteadyState, list[int]]]:
    """Motions near the one shown, the last on the way first, and what is left of the way from each."""
    for i in reversed(range(len(way))):
        try:
            steady = _sought(joint, curve, way[i], None, CYCLES)
        except MicroslipError:
            continue
        if abs(abs(steady.amplitude) / abs(curve.amplitude[way[i]]) - 1) <= ELSEWHERE:
            yield steady, way[i:]


def _beside(curve: Response, k: int, side: int, step: int) -> list[int]:
    """Frequencies with an answer from one side up to one, in so many, by index."""
    path = [j for j in range(k + side * ASIDE, k, -side * step) if 0 <= j < len(curve.frequency)]
    return [j for j in path if curve.flag[j] == CONVERGED]


def _scheme(joint: PreparedJoint, f: float, steps: int = STEPS) -> TimeScheme:
    """Of a frequency, with so many steps per cycle."""
    return time_scheme(joint, 1 / (f * steps), frequency=f)


def _sought(
    joint: PreparedJoint, curve: Response, k: int, beside: SteadyState | None, cycles: int
) -> SteadyState:
    """A steady state with the velocity of what is shown, or from one beside it."""
    f = float(curve.frequency[k])
    return steady_state(
        _scheme(joint, f),
        f,
        curve.load,
        guess=complex(curve.amplitude[k]),
        start=None if beside is None else beside.end,
        tolerance=TOLERANCE,
        max_cycles=cycles,
    )


def judged(own: float, after: End | None, others: list[End]) -> dict:
    """What motions say of an amplitude that is shown.

    Parameters
    ----------
    own : float
    after : End or None
        Where the motion ends after the load was raised.
    others : list of End
        Where others do that were sought about the one shown, where the former is on another branch.
    """
    ends = [one for one in (after, *others) if one is not None]
    beside = [one for one in ends if one.near(own)]
    settled = [one for one in beside or ends if one.settled]
    if after is None or not settled:
        # what stays beside that shown, and does not settle, is its motion, and no truth
        off = min((one.off(own) for one in beside), default=None)
        return {"settled": False, "off": off}
    truth = min(settled, key=lambda one: one.off(own))
    return {
        "settled": True,
        "truth": truth.least,
        "error": truth.off(own),
        "left": truth.left,
        "branches": len(settled),
        "raised": after.near(own),
    }

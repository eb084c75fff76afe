"""Where a motion ends that creeps.

After the load was raised from rest the vibration repeats within a hundred cycles or two, but on the resonance
of many a joint it goes on to change, by a part in ten thousand a cycle or less, for thousands of them: pairs
at the verge of slip pass their tractions on, and bodies walk past each other until soft springs hold them. A
search for a fixed point ends somewhere on that way, elsewhere from every start. The motion itself hardly
depends on how the load was raised: amplitudes after ramps of 10, 16 and 30 cycles, marched, agree in their
fourth digit.

So it is marched, and where its drift is steady it leaps (projective integration; Gear & Kevrekidis, SIAM J.
Sci. Comput. 24 (2003) 1091):

    x(n + g) = x(n) + d exp(-c B/2) (1 - exp(-c g))/c,        d = (<x>_2 - <x>_1)/STEP,

with the mean states of two windows of a block of B cycles, tapered so that what oscillates about the drift
leaves no trace, and the rate c at which the drift decays from block to block. The first leap waits for two
blocks between which the drift has kept its direction and some of its size, so that what settles by itself is
left alone: a leap along a transient would stir another. After each the drift is held against what was to be
left of it. What the leap has missed is its length times the difference; where that is too much it is taken
back and a shorter one made, since friction keeps what a leap too long has done. What all of them have missed
is in the doubt.

What is left to come is no more than the drift would make in as many cycles again as have passed, where it
decays with a time no longer than that. A faster decay says nothing: the first transient may hide another.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import NamedTuple

import numpy as np

from microslip.analyses.time.deviations import StateSpace
from microslip.analyses.time.offset import (
    HORIZON,
    NARROW,
    QUIET,
    Looked,
    as_far,
    come_to_rest,
    elsewhere,
    walks,
)
from microslip.analyses.time.resting import IN_VAIN, at_phase_0, followed, searched
from microslip.analyses.time.scheme import (
    ContactMemory,
    State,
    TimeScheme,
    contact_memory,
)
from microslip.analyses.time.stability import settling_error, stability_of
from microslip.analyses.time.starts import end_of
from microslip.analyses.time.steady import steady_state
from microslip.analyses.time.watching import watched
from microslip.contact.pairs import tangential_vectors
from microslip.errors import MicroslipError
from microslip.pipeline.ringing import (
    BLOCKS,
    SAME_FOR,
    STEP,
    STILL,
    TAPER,
    WINDOW,
    goes_on,
    rung_out,
    stays,
    stray_of,
)
from microslip.pipeline.walk import DOUBTFUL
from microslip.pipeline.wandering import Block, wander_of
from microslip.typing import Array, Complex

LEAP, FARTHEST = 60.0, 1280.0
"""Cycles of the shortest leap and of the longest."""

AT_MOST = 0.02
"""Relative change of the amplitude that a leap may be expected to make."""

ALIKE, SETTLES = 0.7, 1.0
"""Cosine between two drifts above which there is a leap, and decay over a block, in logarithm, above which a
drift is left to settle by itself."""

OFF, SHORTER = 5e-4, 0.5
"""What a leap may miss of the amplitude, relative: its length times the difference between the drift after it
and what was to be left of that before. Above, it is taken back, and the next one has this share of that.
Friction does not forget where a leap too long has led: pairs that it has made slip stay there."""

SETTLING = 4
"""Last blocks without a leap between them: what the last leap stirred goes, then drifts are taken."""

WALKS_AFTER, WALKS_AGAIN = 3, 2
"""Blocks until it is sought where bodies that walk come to rest, and times as many until that is tried again.
"""

SOUGHT, KICK = 30, 1.01
"""Cycles at most of a search where bodies rest; where what it finds is not known to be stable, the motion is
marched from so many times its rates: what is not leaves."""

TRIES = 3
"""Blocks at most until what a move has stirred is gone."""

STAYS_FOR = 2 * SAME_FOR
"""Blocks in which what beats by more than a motion that is shown strays no less: a slow decay is uneven."""

LAST = 3
"""Blocks of which the largest drift counts: a drift that turns is none for an instant."""


class Walk(NamedTuple):
    """What is known of a walk.

    Attributes
    ----------
    offset : (d - 1,) array or None
        At which bodies have come to rest in motions beside.
    """

    offset: Array | None = None


class Crept(NamedTuple):
    """Where a motion ends.

    Attributes
    ----------
    amplitude : complex
        First harmonic of the modal coordinate: mean of the last window, or of what it wanders about.
    drift : float
        Relative change of its size per cycle.
    doubt : float
        By how much it may still change, and how far the last cycles stray from it, relative.
    state : State
        The last, at the phase of the first.
    cycles : int
        Marched.
    reached : float
        Cycles that these stand for, leaps among them.
    rest : (d - 1,) array or None
        Offset at which bodies that walked past each other have come to rest, or are by then.
    ahead : float
        Relative change of the amplitude until bodies do that have not by then: after
        `microslip.analyses.time.offset.HORIZON` cycles. nan where it is not found where they do, but where
        they are by then.
    around : float
        See `microslip.analyses.time.resting.Rested`.
    varies, rings : float
        How far cycles stray from the amplitude for good, relative, zero where that may end; and how far they
        do where bodies rest and that may.
    """

    amplitude: complex
    drift: float
    doubt: float
    state: State
    cycles: int
    reached: float
    rest: Array | None = None
    ahead: float = 0.0
    around: float = float("nan")
    varies: float = 0.0
    rings: float = 0.0


def crept(
    scheme: TimeScheme,
    load: float,
    state: State,
    blocks: int = BLOCKS,
    walk: Walk | None = None,
    sizes: tuple[float, float] = (0.0, 0.0),
) -> Crept:
    """March a motion, with leaps, to where it creeps no more.

    Parameters
    ----------
    scheme : TimeScheme
        At a frequency.
    load : float
        Amplitude of the driven port, under ``load sin(theta)``.
    state : State
        At phase 0.
    blocks : int
        Of cycles, at most.
    walk : Walk, optional
        Bodies that walk are brought to where they come to rest. That takes some hundred cycles.
    sizes : (float, float)
        Least and largest of the branch that matters; a motion that is on another after `LAST` blocks is left.

    Raises
    ------
    MicroslipError
        Where a step does not solve or the joint opens.
    """
    block, memory = WINDOW + STEP, contact_memory(scheme)
    space = StateSpace(scheme, 2 * np.pi * scheme.frequency)
    before: _Drift | None = None
    reached, leapt, missed, lost, look = 0.0, 0.0, 0.0, 0, WALKS_AFTER
    drifts, strays, means = list[float](), list[float](), list[Block]()
    for count in range(1, blocks + 1):
        Q, states = watched(scheme, load, state, block, memory=memory)
        seen, state = _looked(Q, states, space), states[-1]
        reached += block
        begin, end = TAPER @ Q[:WINDOW], seen.amplitude
        own = float(abs(end) / abs(begin) - 1) / STEP
        stray = stray_of(Q, float(abs(end)))
        drifts.append(abs(own))
        strays.append(stray)
        means.append(Block(reached, end, np.abs(Q[-STEP:])))
        left = max(drifts[-LAST:]) * reached + stray
        if (
            count == blocks
            or (count >= LAST and (left <= STILL or elsewhere(float(abs(end)), sizes)))
            or (stray > DOUBTFUL and stays(strays, STAYS_FOR))
        ):
            break
        if count >= look and walk is not None and walks(seen.rate):
            found = _walked(space, load, seen, state, memory, walk.offset, reached)
            if isinstance(found, Crept):
                return found._replace(cycles=found.cycles + count * block + lost)
            lost += found
            look = WALKS_AGAIN * count
        if count >= blocks - SETTLING:
            continue
        now = _Drift(state, seen.way, space.measure(seen.way), own)
        off = leapt * abs(own - before.drift * before.kept(leapt + block)) if before else 0.0
        if before is not None and off > OFF:
            # the drift was another than it was to be: from where the leap began, shorter
            reached -= leapt + block
            now, leapt = before, SHORTER * leapt
            for kept in (drifts, strays, means):
                kept.pop()
        elif before is not None:
            missed += off
            now = now.after(before, leapt + block)
            leapt = _next_leap(leapt, now)
        before, state = now, now.state
        leapt = min(leapt, AT_MOST / max(abs(now.drift), 1e-300))
        leapt = leapt if leapt >= LEAP else 0.0
        if leapt:
            state = space.state(space.vector(state) + now.summed(leapt, block) * now.way, state)
            reached += leapt
            strays.clear()  # a leap stirs
    about = wander_of(means, max(2 * reached, HORIZON))
    varies, size, cycles = 0.0, complex(end), count * block + lost
    if goes_on(strays):
        varies, size = max(strays[-2:]), complex(np.mean([one.mean for one in means[-SAME_FOR:]]))
        left = max(left, varies) + float(abs(abs(end) / abs(size) - 1))
    if about is not None and about.doubt + about.strays < left:
        # what a beat that may end hides of a drift is not known to be none
        drift = about.drift if about.varies else max(about.drift, abs(own))
        left, size, own, varies = about.doubt + about.strays, about.amplitude, drift, about.varies
    return Crept(size, float(own), float(left + missed), state, cycles, reached, varies=varies)


def _walked(
    space: StateSpace,
    load: float,
    begin: Looked,
    state: State,
    memory: ContactMemory,
    offset: Array | None,
    reached: float,
) -> Crept | int:
    """Where bodies that walk come to rest; where they do not, the cycles spent on that.

    A motion is looked at by a search, and where that does not settle, or pairs do not move alike, marched.
    """
    block, scheme = WINDOW + STEP, space.scheme
    frequency = scheme.frequency
    spent, size, seen = 0, abs(begin.amplitude), [begin]
    last = latest = state
    quiet = QUIET * float(np.linalg.norm(begin.rate.mean(axis=0)))

    def look(vector: Array) -> Looked:
        nonlocal last, latest, size
        found, latest = motion_from(space.state(vector, last))
        seen.append(found)
        if not elsewhere(abs(found.amplitude), (size, size)):
            last, size = latest, abs(found.amplitude)
        return found

    def motion_from(start: State) -> tuple[Looked, State]:
        nonlocal spent
        quick = searched(space, frequency, load, start, memory)
        spent += IN_VAIN if quick is None else quick.cycles
        if quick is not None and quick.looked.uneven <= quiet:
            return quick.looked, quick.state
        start = watched(scheme, load, start, block, memory=memory)[1][-1]
        spent += block
        for _ in range(TRIES):
            Q, states = watched(scheme, load, start, block, memory=memory)
            spent, start = spent + block, states[-1]
            found = _looked(Q, states, space)
            if found.uneven <= quiet:
                break
        return found, start

    try:
        rest = come_to_rest(look, begin, offset) or as_far(seen)
        if rest is None:
            return spent
        rest, there, moved = followed(rest, look, max(HORIZON - reached, 0.0))
        one = None if there is None else look(there[0])
    except MicroslipError:
        return spent
    amplitude, start = rest.amplitude, space.state(rest.vector, last)
    ahead, apart, place = 0.0, rest.apart + moved, rest.offset
    if there is not None and one is not None:
        missed = abs(abs(one.amplitude) / abs(there[1]) - 1)
        if missed > DOUBTFUL:
            return spent
        ahead = abs(rest.amplitude) / abs(one.amplitude) - 1
        amplitude, start, apart = one.amplitude, latest, apart + missed
        if rest.speed:  # where they rest is not known
            ahead, place = np.nan, one.offset.mean(axis=0)
    size = abs(amplitude)
    settled, varies, rings = _stable(scheme, load, start, size, memory), 0.0, 0.0
    if settled is None:
        kicked = replace(start, rate=KICK * start.rate)
        amplitude, end, doubt, more, varies, rings = rung_out(
            scheme, load, kicked, memory, amplitude, np.inf
        )
    else:
        end, doubt, more = settled
    return Crept(
        amplitude,
        0.0,
        float(apart + doubt),
        end,
        spent + more,
        rest.cycles,
        place,
        ahead,
        rest.around(before=reached),
        varies,
        rings,
    )


def _stable(
    scheme: TimeScheme, load: float, state: State, size: float, memory: ContactMemory
) -> tuple[State, float, int] | None:
    """The steady state where bodies rest, if it is stable: its state, how well it is known, cycles."""
    frequency = scheme.frequency
    try:
        start = end_of(state, 0.0, scheme, frequency)
        steady = steady_state(
            scheme, frequency, load, start=start, max_cycles=SOUGHT, memory=memory
        )
        if not steady.converged:
            return None
        found = stability_of(scheme, steady, memory=memory)
    except MicroslipError:
        return None
    moved = abs(abs(steady.amplitude) / size - 1)
    if found.verdict != "stable" or moved > NARROW:
        return None
    doubt = settling_error(steady, found) + moved
    return at_phase_0(scheme, steady, memory), doubt, steady.cycles + found.cycles


def _looked(Q: Complex, states: list[State], space: StateSpace) -> Looked:
    """What a block of cycles says of a walk: means over its last window, and what they change by."""
    dimension = space.scheme.joint.model.dimension
    slip = np.array([tangential_vectors(one.v, dimension) for one in states])
    vectors = np.array([space.vector(one) for one in states])
    return Looked(
        offset=np.tensordot(TAPER, slip[STEP:], 1),
        rate=np.tensordot(TAPER, slip[STEP:] - slip[:WINDOW], 1) / STEP,
        amplitude=complex(TAPER @ Q[STEP:]),
        vector=TAPER @ vectors[STEP:],
        way=TAPER @ (vectors[STEP:] - vectors[:WINDOW]) / STEP,
    )


@dataclass(frozen=True)
class _Drift:
    """A drift of the state, where a leap may begin.

    Attributes
    ----------
    state : State
        The last of a block.
    way, measure : arrays
        Change of the state per cycle, in the middle of the block, and in the energy norm.
    drift : float
        Of the amplitude, relative, per cycle.
    alike : float
        Cosine between it and that before.
    rate : float
        At which it decays, per cycle; negative where it grows.
    """

    state: State
    way: Array
    measure: Array
    drift: float
    alike: float = -1.0
    rate: float = np.inf

    def after(self, before: _Drift, cycles: float) -> _Drift:
        """The same, with what it has kept of that so many cycles before."""
        along, size = float(self.measure @ before.measure), float(before.measure @ before.measure)
        alike = along / max(float(np.sqrt(size * (self.measure @ self.measure))), 1e-300)
        rate = -np.log(along / size) / cycles if along > 0 else np.inf
        return replace(self, alike=alike, rate=float(rate))

    def kept(self, cycles: float) -> float:
        """Share of it that is left after so many cycles."""
        return float(np.exp(-max(self.rate, 0.0) * cycles))

    def summed(self, cycles: float, block: int) -> float:
        """Sum over so many cycles after a block of what is left of it."""
        rate = max(self.rate, 1e-12)
        return self.kept(block / 2) * float(-np.expm1(-rate * cycles) / rate)


def _next_leap(leap: float, now: _Drift) -> float:
    """Length of the next leap; zero where the drift has turned, or settles by itself."""
    if now.alike > ALIKE and now.rate * (WINDOW + STEP) < SETTLES:
        return min(max(2 * leap, LEAP), FARTHEST)
    return 0.5 * leap if now.alike > 0 else 0.0

"""Where a motion ends that creeps.

After the load was raised from rest the vibration repeats within a hundred cycles or two, but on the resonance
of many a joint it goes on to change, by a part in ten thousand a cycle or less, for thousands of them: pairs
at the verge of slip pass their tractions on, and bodies walk past each other until soft springs hold them. A
search for a fixed point ends somewhere on that way, elsewhere from every start. The motion itself hardly
depends on how the load was raised: amplitudes after ramps of 10, 16 and 30 cycles, marched, agree in their
fourth digit.

So it is marched, and where its drift is steady it leaps (projective integration; Gear & Kevrekidis, SIAM J.
Sci. Comput. 24 (2003) 1091):

    x(n + g) = x(n) + g d,        d = (<x>_2 - <x>_1)/STEP,

with the mean states of two windows of a block of cycles, tapered so that what oscillates about the drift
leaves no trace. The first leap waits for two blocks between which the drift has kept its direction and most
of its size, so that what settles by itself is left alone: a leap along a transient that decays would stir
another. A leap is twice as long as that before it where the drift has kept both across that one, half as long
where it has kept its direction alone, and none where it has kept neither.

What is left to come is no more than the drift would make in as many cycles again as have passed, where it
decays with a time no longer than that. A faster decay says nothing: the first transient may hide another.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from typing import NamedTuple

import numpy as np

from microslip.analyses.prepared.joint import PreparedJoint
from microslip.analyses.time.deviations import StateSpace
from microslip.analyses.time.scheme import State, TimeScheme, contact_memory, time_scheme
from microslip.analyses.time.starts import end_of
from microslip.analyses.time.steady import raised_state
from microslip.errors import JointOpensError, MicroslipError
from microslip.numerics.execute import each, threads
from microslip.pipeline.walk import RAISED, RAISED_AGAIN, STEPS, Found, Lost, Target, watched
from microslip.typing import Array

WINDOW, STEP = 40, 20
"""Cycles of a window, and from one to the next: what repeats in 20 cycles or fewer leaves no trace."""

BLOCKS = 20
"""Blocks of cycles at most."""

LEAP, FARTHEST = 40.0, 1280.0
"""Cycles of the first leap and of the longest."""

AT_MOST = 0.02
"""Relative change of the amplitude that a leap may be expected to make."""

ALIKE, KEPT = 0.7, 0.3
"""Cosine between two drifts, and share of the first that the second has along it, above which leaps grow."""

LOST = 5.0
"""Times as large a drift as before a leap is one that the leap has made."""

SETTLING = 4
"""Last blocks without a leap between them: what the last leap stirred goes, then drifts are taken."""

STILL = 5e-4
"""Doubt of the amplitude at which a motion creeps no more."""

LAST = 3
"""Blocks of which the largest drift counts: a drift that turns is none for an instant."""


class Crept(NamedTuple):
    """Where a motion ends.

    Attributes
    ----------
    amplitude : complex
        First harmonic of the modal coordinate, of the last window.
    drift : float
        Relative change of its size per cycle.
    doubt : float
        By how much it may still change, and how far cycles of the last window stray from it, relative.
    state : State
        The last, at the phase of the first.
    cycles : int
        Marched.
    reached : float
        Cycles that these stand for, leaps among them.
    """

    amplitude: complex
    drift: float
    doubt: float
    state: State
    cycles: int
    reached: float


def crept(scheme: TimeScheme, load: float, state: State, blocks: int = BLOCKS) -> Crept:
    """March a motion, with leaps, to where it creeps no more.

    Parameters
    ----------
    scheme : TimeScheme
        With `microslip.pipeline.walk.STEPS` steps per cycle.
    load : float
        Amplitude of the driven port, under ``load sin(theta)``.
    state : State
        At phase 0.
    blocks : int
        Of cycles, at most.

    Raises
    ------
    MicroslipError
        Where a step does not solve or the joint opens.
    """
    block, memory = WINDOW + STEP, contact_memory(scheme)
    taper = np.hanning(WINDOW + 2)[1:-1]
    taper /= taper.sum()
    space = StateSpace(scheme, 2 * np.pi / (scheme.dt * STEPS))
    before: Array | None = None
    kept = state
    reached, leap, leapt = 0.0, 0.0, 0.0
    drifts: list[float] = []
    for count in range(1, blocks + 1):
        Q, states = watched(scheme, load, state, block, memory=memory)
        vectors, state = np.array([space.vector(one) for one in states]), states[-1]
        reached += block
        first, last = taper @ vectors[:WINDOW], taper @ vectors[STEP:]
        begin, end = taper @ Q[:WINDOW], taper @ Q[STEP:]
        drift = float(abs(end) / abs(begin) - 1) / STEP
        stray = float(np.abs(np.abs(Q[-STEP:]) / abs(end) - 1).max())
        drifts.append(abs(drift))
        doubt = max(drifts[-LAST:]) * reached + stray
        if count == blocks or (count >= LAST and doubt <= STILL):
            break
        if count >= blocks - SETTLING:
            continue
        way = (last - first) / STEP
        u = space.measure(way)
        if before is not None and leapt and np.linalg.norm(u) > LOST * np.linalg.norm(before):
            # the leap has gone astray: from where it began, marched on
            state, reached, leap, leapt, before = kept, reached - leapt - block, 0.0, 0.0, None
            drifts.pop()
            continue
        leap = 0.0 if before is None else _next_leap(leap, before, u)
        before, kept = u, state
        leapt = min(leap, AT_MOST / max(abs(drift), 1e-300))
        if leapt:
            state = space.state(vectors[-1] + leapt * way, state)
            reached += leapt
    return Crept(complex(end), drift, doubt, state, count * block, reached)


def _next_leap(leap: float, before: Array, u: Array) -> float:
    """Length of the next leap, from the drifts before and after the last; zero where none is due."""
    along, size = float(u @ before), float(before @ before)
    alike = along / max(float(np.sqrt(size * (u @ u))), 1e-300)
    if alike > ALIKE and along > KEPT * size:
        return min(max(2 * leap, LEAP), FARTHEST)
    return 0.5 * leap if alike > 0 and leap > LEAP else 0.0


def raised_and_marched(joint: PreparedJoint, targets: Sequence[Target]) -> Iterator[Found | Lost]:
    """Where motions end after the load was raised from rest, in the order of the targets.

    The first, third, ... of them after two ramps: what these differ by is the `scatter` of what is found.
    That of the others is not known (nan).
    """

    def work(task: tuple[Target, int]) -> Found | Lost:
        target, ramps = task
        try:
            return _after_ramps(joint, target, (RAISED, RAISED_AGAIN)[:ramps])
        except MicroslipError as error:
            return Lost(str(error), 0, opens=isinstance(error, JointOpensError))

    return each(work, [(one, 2 - i % 2) for i, one in enumerate(targets)], threads())


def _after_ramps(joint: PreparedJoint, target: Target, ramps: Sequence[int]) -> Found:
    f, load = target.frequency, target.load
    scheme = time_scheme(joint, 1 / (f * STEPS), frequency=f)
    ends = [crept(scheme, load, raised_state(scheme, f, load, ramp)) for ramp in ramps]
    spent = sum(one.cycles for one in ends) + sum(ramps)
    ends.sort(key=lambda end: end.doubt)
    one, scatter = ends[0], np.nan
    if len(ends) > 1:
        scatter = abs(abs(ends[1].amplitude) / abs(one.amplitude) - 1)
    return Found(
        one.amplitude,
        abs(one.drift),
        one.doubt,
        end_of(one.state, 0.0, scheme, f),
        spent,
        scatter=float(scatter),
        past=0.0,
    )

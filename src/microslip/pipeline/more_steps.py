"""Steady states sought on with more time steps, and whether motions stay beside them.

A search finds periodic motions whether they are stable or not, and that depends on the steps as well: where a
branch turns unstable, few and many steps disagree by multipliers of a tenth. So both are asked of the same
state, with `REFINEMENT` times its steps.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence

import numpy as np

from microslip.analyses.prepared.joint import PreparedJoint
from microslip.analyses.time.offset import HORIZON, TIMES
from microslip.analyses.time.scheme import State, contact_memory, time_scheme
from microslip.analyses.time.starts import placed
from microslip.analyses.time.staying import Stay, stay_of
from microslip.analyses.time.steady import RAISED, SteadyState, steady_state
from microslip.analyses.time.watching import LEAK, TURNS, known_mean, to_come, watched
from microslip.contact.pairs import mean_slip
from microslip.errors import MicroslipError
from microslip.numerics.execute import each, threads
from microslip.pipeline.targets import REFINEMENT, TOLERANCE, More, Stepped
from microslip.pipeline.walked import after_raising, counted_from, searched_from
from microslip.typing import Array, Complex

PATIENCE = 100
"""Cycles with `REFINEMENT` times the steps at most."""

BLOCK, BLOCKS, SAME = 100, 6, 0.1
"""Cycles and most blocks of them for which what varies for good, or does not settle where its bodies rest, is
marched with more steps, until it strays as far in one as in that before, to this share."""

SPAN, ALIKE = 50, 3e-4
"""Cycles between which what the steps do to a motion is compared where its bodies are on their way to rest,
for as many as it varies for at most; and what it may change by from one to the next where that is known."""

DECAYS = 4.0
"""Times that a walk may have fallen to a third of its speed after `HORIZON` cycles, where the motion on it is
shown: what has decayed more often is within a fiftieth of the way of where it rests."""

SURE = 2e-3
"""What a walk is not known by, relative, above which it is sought with more steps from its beginning."""

STEADY = 1e-4
"""What a motion strays by that repeats, relative."""

FARTHEST = 0.1
"""Where the amplitude changes by more, relative, the motion is not taken for the same one."""


def with_more_steps(joint: PreparedJoint, load: float, one: Stepped) -> More:
    """A steady state with `REFINEMENT` times the steps, and what motions do beside it.

    Where it does not settle with these, or elsewhere, its own steps say what motions do. Bodies that walk are
    not brought to rest again: with more steps they may be a little way from where they rest then. What does
    not settle and stays with its own is marched with more there: its mean over so many cycles is known then,
    and what it varies by. Where bodies are on the way a search, which moves them, is no measure: there both
    are marched.
    """
    more = More(None, 0)
    try:
        if one.varies:
            alone = _on_the_way if one.walks else _varying
            return alone(joint, load, one)
        more = _sought_on(joint, load, one)
        if not (one.walks and np.isfinite(more.strays)):
            return more
        marched = _on_the_way(joint, load, one)
        if marched.drifts > SURE:
            marched = _walked_anew(joint, load, one, marched)
    except MicroslipError:
        return more._replace(amplitude=None)
    strays, spent = max(more.strays, marched.strays), more.cycles + marched.cycles
    return marched._replace(strays=strays, varies=more.varies, cycles=spent)


def _sought_on(joint: PreparedJoint, load: float, one: Stepped) -> More:
    """A steady state with more steps by a search, and what motions do beside it; see `with_more_steps`."""
    amplitude, spent = None, 0
    try:
        found, stay = _settled(joint, load, one, REFINEMENT * one.steps)
        spent = REFINEMENT * found.cycles
        if stay is not None:
            amplitude, spent = found.amplitude, spent + REFINEMENT * stay.cycles
        unsettled = stay is None
        if stay is None or apart(one.amplitude, found.amplitude) > FARTHEST:
            found, stay = _settled(joint, load, one, one.steps)
            spent += found.cycles + (stay.cycles if stay else 0)
            more = _with_stay(amplitude, spent, stay)
            if unsettled and one.marched and not one.walks and np.isfinite(more.strays):
                more = _varying(joint, load, one)
                more = more._replace(cycles=more.cycles + spent)
            return more
    except MicroslipError:
        return More(amplitude, spent)
    return _with_stay(stay.amplitude if np.isfinite(stay.strays) else None, spent, stay)


def _with_stay(amplitude: complex | None, cycles: int, stay: Stay | None) -> More:
    """An amplitude with more steps, and what motions do beside it."""
    if stay is None:
        return More(amplitude, cycles)
    return More(amplitude, cycles, stay.strays, varies=stay.varies)


def apart(few: complex, more: complex) -> float:
    """Relative difference of the sizes of first harmonics with few steps and with more."""
    return abs(abs(more) / max(abs(few), 1e-300) - 1)


def _settled(
    joint: PreparedJoint, load: float, one: Stepped, steps: int
) -> tuple[SteadyState, Stay | None]:
    """A state with so many steps, and what motions do beside it where it settles."""
    f = one.frequency
    scheme = time_scheme(joint, 1 / (f * steps), frequency=f)
    memory = contact_memory(scheme)
    found = steady_state(
        scheme,
        f,
        load,
        start=one.state,
        tolerance=TOLERANCE,
        max_cycles=PATIENCE,
        memory=memory,
    )
    return found, stay_of(scheme, found, memory) if found.converged else None


def _varying(joint: PreparedJoint, load: float, one: Stepped) -> More:
    """What a motion that does not repeat does where it is marched with more steps."""
    f = one.frequency
    scheme = time_scheme(joint, 1 / (f * REFINEMENT * one.steps), frequency=f)
    state, before, spent = placed(one.state, scheme, f, load), np.inf, 0
    sizes = np.zeros(0)
    for _ in range(BLOCKS):
        Q, states = watched(scheme, load, state, BLOCK)
        state, size, spent = states[-1], np.abs(Q), spent + REFINEMENT * BLOCK
        sizes = np.append(sizes, size)
        own = float(size.mean())
        if apart(one.amplitude, own) > FARTHEST:
            return More(None, spent, strays=np.inf)
        mean, drifts = known_mean(sizes)
        strays, beats = (float(np.abs(size / about - 1).max()) for about in (mean, own))
        same = abs(before - beats) <= SAME * beats
        seen = _turns(sizes, mean) >= TURNS
        if (same and seen) or strays <= STEADY:
            break
        before = beats
    drifts = max(drifts, LEAK * beats if seen else abs(own / mean - 1))
    amplitude, cycles = mean * complex(np.exp(1j * np.angle(Q.mean()))), len(sizes)
    if strays <= STEADY:  # with more steps it repeats
        return More(amplitude, spent, drifts=strays, watched=cycles)
    if drifts > beats:  # it creeps: a beat has the same mean for long
        return More(amplitude, spent, strays, drifts + to_come(size) / mean, watched=cycles)
    return More(
        amplitude, spent, strays, drifts, strays if same else 0.0, cycles if same and seen else 0
    )


def _on_the_way(joint: PreparedJoint, load: float, one: Stepped) -> More:
    """What more steps make of a motion whose bodies are on their way to rest after `HORIZON` cycles.

    Marched from its state with its own steps and with more, so that what it has walked meanwhile is in both.
    Where bodies walk faster or slower with more steps, they are elsewhere after those cycles: what that
    changes the amplitude by is not known (`_at_another_speed`).
    """
    f, dimension = one.frequency, joint.model.dimension
    both = one.steps, REFINEMENT * one.steps
    schemes = [time_scheme(joint, 1 / (f * steps), frequency=f) for steps in both]
    ends = [placed(one.state, scheme, f, load) for scheme in schemes]
    places, means, spent = [_places(ends, dimension)], list[Complex](), 0
    for _ in range(BLOCKS * BLOCK // SPAN):
        seen = [watched(s, load, end, SPAN) for s, end in zip(schemes, ends, strict=True)]
        ends = [states[-1] for _, states in seen]
        means.append(np.array([Q.mean() for Q, _ in seen]))
        places.append(_places(ends, dimension))
        spent += (1 + REFINEMENT) * SPAN
        times = [complex(more / few) for few, more in means[-2:]]
        if apart(1.0, times[-1]) > FARTHEST:
            return More(None, spent, strays=np.inf)
        if len(times) > 1 and abs(times[1] - times[0]) <= ALIKE:
            break
    few, more = (places[-1] - places[-2]) / SPAN
    walked = float(np.linalg.norm(places[-1][0] - places[1][0]))
    # by few steps, as what more begin with has to die away
    changes = apart(means[0][0], means[-1][0]) / max(walked, 1e-300)
    drifts = abs(times[1] - times[0]) + _at_another_speed(few, more, changes, one.around)
    return More(one.amplitude * times[-1], spent, drifts=drifts)


def _at_another_speed(few: Array, more: Array, changes: float, around: float) -> float:
    """What the amplitude changes by, relative, as bodies walk at another speed with more steps.

    After n cycles they are taken to be where they would be after `r n`, r the ratio of the speeds: up to half
    of them more or less, what that changes is known. Otherwise it is what the amplitude changes by on the way
    that it goes on by, times how far they are apart.

    Parameters
    ----------
    few, more : (d - 1,) arrays
        By how much bodies move on in a cycle after `HORIZON`, m.
    changes : float
        Relative change of the amplitude as they do, 1/m.
    around : float
        See `microslip.analyses.time.resting.Rested`.

    Examples
    --------
    >>> few = np.array([1.0])
    >>> round(_at_another_speed(few, 0.9 * few, 1.0, 2e-3), 5)
    0.0002
    >>> round(_at_another_speed(few, 0.9 * few, 1e-6, float("nan")), 6)
    0.000492
    """
    differ = float(np.linalg.norm(more - few))
    size = float(np.linalg.norm(few))
    if np.isfinite(around) and differ <= (1 - TIMES[0]) * size:
        return differ / max(size, 1e-300) * around
    return changes * differ * _farther(few, more)


def _farther(few: Array, more: Array) -> float:
    """Times the difference of two walks per cycle that bodies are apart for it after `HORIZON` cycles.

    As many as there are, where a walk goes on as it is. One that decays, ``exp(-c n)``, was faster before:
    at a share r of it bodies are behind by ``(exp((1 - r) c n) - 1)/((1 - r) c n)`` times as much.

    Examples
    --------
    >>> round(_farther(np.array([1.0]), np.array([1.2])) / HORIZON, 2)
    1.0
    >>> round(_farther(np.array([1.0]), np.array([0.6])) / HORIZON, 2)
    2.47
    """
    share = float(np.clip(more @ few / max(float(few @ few), 1e-300), 0.0, 1.0))
    exponent = max((1 - share) * DECAYS, 1e-9)
    return HORIZON * float(np.expm1(exponent)) / exponent


def _walked_anew(joint: PreparedJoint, load: float, one: Stepped, marched: More) -> More:
    """Where bodies are with more steps from the beginning: the load raised from rest, if that leads there.

    Else, or where it is not found from there, what the walk with fewer steps is counted from.
    """
    f, spent = one.frequency, marched.cycles
    scheme = time_scheme(joint, 1 / (f * REFINEMENT * one.steps), frequency=f)
    begins = [(RAISED, lambda: after_raising(scheme, load))]
    if (start := one.began) is not None:
        begins += [(0, lambda: searched_from(scheme, load, placed(start, scheme, f, load)))]
    for cycles, begin in begins:
        try:
            began, steady = begin()
            spent += REFINEMENT * (cycles + steady.cycles)
            there = counted_from(scheme, began, steady, abs(one.amplitude))
        except MicroslipError:
            continue
        if there is None or apart(one.amplitude, there.steady.amplitude) > FARTHEST:
            continue
        spent += REFINEMENT * there.cycles
        amplitude = there.steady.amplitude
        return marched._replace(amplitude=amplitude, drifts=there.apart, cycles=spent)
    return marched._replace(cycles=spent)


def _places(ends: Sequence[State], dimension: int) -> Array:
    """Where bodies stand past each other in states, rows."""
    return np.array([mean_slip(end.v, dimension) for end in ends])


def _turns(sizes: Array, mean: float) -> float:
    """How often the last two thirds of what beats about a mean have gone round."""
    return np.count_nonzero(np.diff(np.sign(sizes[len(sizes) // 3 :] - mean))) / 2


def more_steps(
    joint: PreparedJoint, load: float, states: Mapping[int, Stepped]
) -> Iterator[tuple[int, More]]:
    """Steady states with more steps, by index of their frequency, as they are found."""
    marks = sorted(states)
    found = each(lambda k: with_more_steps(joint, load, states[k]), marks, threads())
    return zip(marks, found, strict=True)

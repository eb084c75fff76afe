"""Steady states sought on with more time steps, and whether motions stay beside them.

A search finds periodic motions whether they are stable or not, and that depends on the steps as well: where a
branch turns unstable, few and many steps disagree by multipliers of a tenth. So both are asked of the same
state, with `REFINEMENT` times its steps.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping

import numpy as np

from microslip.analyses.prepared.joint import PreparedJoint
from microslip.analyses.time.scheme import contact_memory, time_scheme
from microslip.analyses.time.starts import placed
from microslip.analyses.time.staying import Stay, stay_of
from microslip.analyses.time.steady import SteadyState, steady_state
from microslip.analyses.time.watching import LEAK, TURNS, known_mean, to_come, watched
from microslip.errors import MicroslipError
from microslip.numerics.execute import each, threads
from microslip.pipeline.targets import REFINEMENT, TOLERANCE, More, Stepped
from microslip.typing import Array

PATIENCE = 100
"""Cycles with `REFINEMENT` times the steps at most."""

BLOCK, BLOCKS, SAME = 100, 6, 0.1
"""Cycles and most blocks of them for which what varies for good, or does not settle where its bodies rest, is
marched with more steps, until it strays as far in one as in that before, to this share."""

STEADY = 1e-4
"""What a motion strays by that repeats, relative."""

FARTHEST = 0.1
"""Where the amplitude changes by more, relative, the motion is not taken for the same one."""


def with_more_steps(joint: PreparedJoint, load: float, one: Stepped) -> More:
    """A steady state with `REFINEMENT` times the steps, and what motions do beside it.

    Where it does not settle with these, or elsewhere, its own steps say what motions do. Bodies that walk are
    not brought to rest again: with more steps they may be a little way from where they rest then. What does
    not settle and stays with its own is marched with more there: its mean over so many cycles is known then,
    and what it varies by.
    """
    amplitude, spent = None, 0
    try:
        if one.varies:
            return _varying(joint, load, one)
        found, stay = _settled(joint, load, one, REFINEMENT * one.steps)
        spent = REFINEMENT * found.cycles
        if stay is not None:
            amplitude, spent = found.amplitude, spent + REFINEMENT * stay.cycles
        unsettled = stay is None
        if stay is None or apart(one.amplitude, found.amplitude) > FARTHEST:
            found, stay = _settled(joint, load, one, one.steps)
            spent += found.cycles + (stay.cycles if stay else 0)
            more = _with_stay(amplitude, spent, stay)
            if unsettled and one.marched and np.isfinite(more.strays):
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
    amplitude = mean * complex(np.exp(1j * np.angle(Q.mean())))
    if strays <= STEADY:  # with more steps it repeats
        return More(amplitude, spent, drifts=strays)
    if drifts > beats:  # it creeps: a beat has the same mean for long
        return More(amplitude, spent, strays, drifts + to_come(size) / mean)
    return More(amplitude, spent, strays, drifts, strays if same else 0.0)


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

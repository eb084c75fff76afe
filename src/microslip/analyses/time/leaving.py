"""Where a motion goes that leaves an unstable periodic one.

Newton's method finds periodic motions whether they are stable or not. No real motion stays on one
with a Floquet multiplier outside the unit circle: pushed a little along its direction it leaves,
toward smaller or larger vibrations. It is marched off the periodic one, and where it goes a steady
state is sought again.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from microslip.analyses.time.deviations import StateSpace
from microslip.analyses.time.floquet import Multipliers
from microslip.analyses.time.scheme import State, TimeScheme
from microslip.analyses.time.stability import stability_of
from microslip.analyses.time.starts import end_of
from microslip.analyses.time.steady import SteadyState, steady_state

PUSH = 0.02
"""Push over the size of the vibration."""

AWAY, SOUGHT = 150, 100
"""Cycles marched off the periodic motion, and cycles at most of the search after them."""


@dataclass(frozen=True)
class Left:
    """What a motion does that has left an unstable periodic one.

    Attributes
    ----------
    steady : SteadyState
        Where it was when the search ended.
    stability : Multipliers or None
        Of the periodic motion that it went to; None where that is none, or unstable as well.
    cycles : int
        Spent.
    """

    steady: SteadyState
    stability: Multipliers | None
    cycles: int


def leave(scheme: TimeScheme, steady: SteadyState, found: Multipliers, *, tolerance: float) -> Left:
    """Follow the motion off an unstable periodic one: first to smaller vibrations, then to larger ones.

    Parameters
    ----------
    scheme : TimeScheme
        The one `steady` was found with.
    steady : SteadyState
    found : Multipliers
        Of it, with the direction of the largest.
    tolerance : float
        As for `steady_state`.
    """
    cycles = 0
    for state in pushed(scheme, steady, found, PUSH):
        away = steady_state(
            scheme,
            steady.frequency,
            steady.load,
            accelerate=False,
            tolerance=tolerance,
            max_cycles=AWAY,
            start=end_of(state, steady.phase, scheme, steady.frequency),
        )
        other = steady_state(
            scheme,
            steady.frequency,
            steady.load,
            tolerance=tolerance,
            max_cycles=SOUGHT,
            start=away.end,
            halves=False,
        )
        cycles += away.cycles + other.cycles
        if other.converged:
            stability = stability_of(scheme, other)
            cycles += stability.cycles
            if stability.verdict != "unstable":
                return Left(other, stability, cycles)
    return Left(away, None, cycles)


def pushed(
    scheme: TimeScheme, steady: SteadyState, found: Multipliers, share: float
) -> tuple[State, State]:
    """States off a periodic motion along its largest multiplier, toward smaller vibrations and toward larger.

    Parameters
    ----------
    scheme, steady, found
        As for `leave`.
    share : float
        Push over the size of the vibration.
    """
    space = StateSpace(scheme, 2 * np.pi * steady.frequency)
    x = space.vector(steady.cycle.state)
    vibration = space.vibration(x - space.rest)
    along = space.vibration(found.direction)
    push = share * np.linalg.norm(vibration) / np.linalg.norm(along) * found.direction
    if along @ vibration > 0:
        push = -push
    smaller, larger = (space.state(x + way, steady.cycle.state) for way in (push, -push))
    return smaller, larger

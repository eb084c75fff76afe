"""Motions whose size rings or beats: how far cycles stray from their mean, and whether that will go.

Weakly damped modes ring for hundreds of cycles once they have been stirred, and a vibration that is no
transient beats for good. Both are seen in blocks of cycles: a mean over a window, and what strays from it.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from microslip.analyses.time.scheme import ContactMemory, State, TimeScheme
from microslip.analyses.time.watching import watched
from microslip.typing import Complex

WINDOW, STEP = 40, 20
"""Cycles of a window, and from one to the next: what repeats in 20 cycles or fewer leaves no trace."""

TAPER = np.hanning(WINDOW + 2)[1:-1]
TAPER /= TAPER.sum()
"""Weights of the mean over a window."""

BLOCKS = 30
"""Blocks of cycles at most."""

STILL = 5e-4
"""What is left to come of the amplitude at which a motion creeps no more."""

RINGS = 0.9
"""What is left of a vibration that decays, after `SAME_FOR` blocks; what keeps more is there to stay."""

GROWS = 1.25
"""What strays by more times as much after `SAME_FOR` blocks may be on its way to another motion."""

SAME_FOR = 4
"""Blocks of which one must stray less, where a vibration decays."""


class Rung(NamedTuple):
    """Where bodies rest, once what moving them there has stirred is gone.

    Attributes
    ----------
    amplitude : complex
        As given; of a motion that goes on to vary, its mean over the last blocks.
    state : State
    doubt : float
        How far cycles of the last two blocks stray from their means, these from the amplitude, and that from
        the one given beyond what it varies by, relative.
    cycles : int
        Spent.
    varies, rings : float
        The first of these where it goes on, and where it may not; else zero.
    """

    amplitude: complex
    state: State
    doubt: float
    cycles: int
    varies: float
    rings: float


def rung_out(
    scheme: TimeScheme,
    load: float,
    state: State,
    memory: ContactMemory,
    amplitude: complex,
    stray: float,
) -> Rung:
    """Marched on where bodies rest, until what moving them there has stirred is gone.

    Weakly damped modes ring on for longer than it takes to see where the bodies walk. What does not decay is
    no transient, but how the motion is.

    Parameters
    ----------
    scheme, load, state, memory
        The motion where the bodies rest.
    amplitude : complex
        Mean over a window.
    stray : float
        How far cycles stray from it, relative.
    """
    block, spent, means = WINDOW + STEP, 0, list[complex]()
    strays = [stray]
    while max(strays[-2:]) > STILL and not stays(strays) and spent < BLOCKS * block:
        Q, states = watched(scheme, load, state, block, memory=memory)
        state, spent = states[-1], spent + block
        means.append(complex(TAPER @ Q[STEP:]))
        strays.append(stray_of(Q, abs(means[-1])))
    strayed, last, fell = max(strays[-2:]), means[-1:], 0.0
    varies, rings = (strayed, 0.0) if goes_on(strays) else (0.0, strayed)
    if varies:
        last = means[-SAME_FOR:]
        mean = complex(np.mean(last))
        # a mean farther from where it began than it varies by may be that of another motion
        fell, amplitude = max(abs(abs(mean) / abs(amplitude) - 1) - varies, 0.0), mean
    moved = max((abs(abs(one) / abs(amplitude) - 1) for one in last), default=0.0)
    return Rung(amplitude, state, strayed + moved + fell, spent, varies, rings)


def stays(strays: Sequence[float], blocks: int = SAME_FOR) -> bool:
    """Whether cycles stray no less than so many blocks before.

    A vibration that beats while it decays strays more in one block than in that before, but not in all.

    Examples
    --------
    >>> stays([0.3, 0.2, 0.15, 0.16, 0.15, 0.16, 0.15])
    True
    >>> stays([0.3, 0.26, 0.22, 0.24, 0.16, 0.17, 0.12]), stays([0.15, 0.16, 0.15])
    (False, False)
    """
    if len(strays) <= blocks:
        return False
    return min(strays[-blocks:]) > RINGS * strays[-blocks - 1]


def goes_on(strays: Sequence[float]) -> bool:
    """Whether they stray no more either, so that this is how the motion is.

    Examples
    --------
    >>> goes_on([0.3, 0.2, 0.15, 0.16, 0.15, 0.16, 0.15]), goes_on([0.05, 0.06, 0.075, 0.095, 0.1])
    (True, False)
    """
    return stays(strays) and max(strays[-SAME_FOR:]) <= GROWS * strays[-SAME_FOR - 1]


def stray_of(Q: Complex, size: float) -> float:
    """How far the last cycles stray from a size, relative."""
    return float(np.abs(np.abs(Q[-STEP:]) / size - 1).max())

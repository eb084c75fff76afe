"""Whether motions stay beside a periodic one.

Newton's method finds periodic motions whether they are stable or not. Where a Floquet multiplier lies outside
the unit circle (`stability`) the motion is pushed off along its direction and marched: it leaves for good, or
comes to vary about the periodic one, by so little sometimes that this may stand for it.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from microslip.analyses.time.leaving import PUSH, pushed
from microslip.analyses.time.scheme import ContactMemory, TimeScheme
from microslip.analyses.time.stability import stability_of
from microslip.analyses.time.steady import SteadyState
from microslip.analyses.time.watching import watched
from microslip.errors import MicroslipError
from microslip.typing import Complex

BLOCK, PART = 20, 40
"""Cycles after which it is looked at, and those at the end that tell where the motion is, and whether it is
farther off than in as many before."""

LEAST, MOST = 100, 300
"""Cycles marched after the push, and at most where it is ever farther off."""

LEAVES = 0.1
"""Relative change of the amplitude from which on it has left."""

GROWS, FALLEN = 1.1, 0.5
"""Times that it is farther off than in the part before where it is on its way; share of the farthest that it
has been off below which it no longer is."""

OPEN = 0.05
"""What is stated at least of a motion that is still on its way then: it may leave in thousands of cycles, or
come to beat by some per cent."""


class Stay(NamedTuple):
    """What motions do beside a periodic one.

    Attributes
    ----------
    amplitude : complex
        First harmonic: of the periodic motion, or of what varies about an unstable one, its mean size with
        the phase of its mean.
    strays : float
        How far the size strays from that, and that from what it was before, relative; zero of a stable
        motion, infinite where motions leave.
    cycles : int
        Spent.
    varies : float
        The former where it was seen to go on: neither farther from cycle to cycle nor less far than before.
    """

    amplitude: complex
    strays: float
    cycles: int
    varies: float = 0.0


def stay_of(scheme: TimeScheme, steady: SteadyState, memory: ContactMemory | None = None) -> Stay:
    """What motions do beside a periodic one.

    Parameters
    ----------
    scheme : TimeScheme
        The one `steady` was found with.
    steady : SteadyState
    memory : ContactMemory, optional
        As for `steady_state`.

    Raises
    ------
    MicroslipError
        Where the steady state did not converge.
    """
    found = stability_of(scheme, steady, memory=memory)
    if found.verdict != "unstable":
        return Stay(steady.amplitude, 0.0, found.cycles)
    own, state = steady.amplitude, pushed(scheme, steady, found, PUSH)[0]
    Q = np.zeros(0, complex)
    while len(Q) < LEAST or (len(Q) < MOST and _grows(Q, own)):
        try:
            more, states = watched(scheme, steady.load, state, BLOCK, steady.phase, memory)
        except MicroslipError:  # it is not known to stay
            return Stay(own, np.inf, found.cycles + len(Q))
        state, Q = states[-1], np.append(Q, more)
        if np.abs(np.abs(more) / abs(own) - 1).max() > LEAVES:
            return Stay(own, np.inf, found.cycles + len(Q))
    cycles, last = found.cycles + len(Q), Q[-PART:]
    if found.largest**PART <= GROWS and not _fallen(Q, own):
        # too slow to tell: it may be on its way
        return Stay(own, 2 * float(np.abs(np.abs(last) / abs(own) - 1).max()), cycles)
    size = float(np.abs(last).mean())
    mean = size * complex(np.exp(1j * np.angle(last.mean())))
    strays = float(np.abs(np.abs(last) / size - 1).max())
    if _grows(Q, own):
        return Stay(mean, max(strays, OPEN), cycles)
    # a mean of so many cycles is one of the motion as far as that before is the same
    moved = abs(float(np.abs(Q[-2 * PART : -PART]).mean()) / size - 1)
    return Stay(mean, strays + moved, cycles, 0.0 if _fallen(Q, own) else strays)


def _grows(Q: Complex, own: complex) -> bool:
    """Whether a motion is farther off than in the part before, by its first harmonics."""
    off = np.abs(Q / own - 1)
    return bool(off[-PART:].max() > GROWS * off[-2 * PART : -PART].max()) and not _fallen(Q, own)


def _fallen(Q: Complex, own: complex) -> bool:
    """Whether a motion is much less far off than it has been."""
    off = np.abs(Q / own - 1)
    return bool(off[-PART:].max() <= FALLEN * off.max())

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
from microslip.typing import Complex

BLOCK, PART = 20, 40
"""Cycles after which it is looked at, and those at the end that tell where the motion is, and whether it is
farther off than ever before."""

LEAST, MOST = 100, 300
"""Cycles marched after the push, and at most where it is ever farther off."""

LEAVES = 0.1
"""Relative change of the amplitude from which on it has left."""

GROWS, OPEN = 1.1, 0.05
"""Times that it is farther off than ever before, from which on nothing says where that will end: its size is
known no better than to this."""


class Stay(NamedTuple):
    """What motions do beside a periodic one.

    Attributes
    ----------
    amplitude : complex
        First harmonic: of the periodic motion, or of what varies about an unstable one, its mean size with
        the phase of its mean.
    strays : float
        How far the size strays from that, relative; zero of a stable motion, infinite where motions leave.
    cycles : int
        Spent.
    """

    amplitude: complex
    strays: float
    cycles: int


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
        Where the steady state did not converge, or a step of the motion beside it has no solution.
    """
    found = stability_of(scheme, steady, memory=memory)
    if found.verdict != "unstable":
        return Stay(steady.amplitude, 0.0, found.cycles)
    own, state = steady.amplitude, pushed(scheme, steady, found, PUSH)[0]
    Q = np.zeros(0, complex)
    while len(Q) < LEAST or (len(Q) < MOST and _grows(Q, own)):
        more, states = watched(scheme, steady.load, state, BLOCK, steady.phase, memory)
        state, Q = states[-1], np.append(Q, more)
        if np.abs(np.abs(more) / abs(own) - 1).max() > LEAVES:
            return Stay(own, np.inf, found.cycles + len(Q))
    last = Q[-PART:]
    size = float(np.abs(last).mean())
    strays = float(np.abs(np.abs(last) / size - 1).max())
    mean = size * complex(np.exp(1j * np.angle(last.mean())))
    return Stay(mean, max(strays, OPEN) if _grows(Q, own) else strays, found.cycles + len(Q))


def _grows(Q: Complex, own: complex) -> bool:
    """Whether a motion is farther off than ever before, by its first harmonics."""
    off = np.abs(Q / own - 1)
    return bool(off[-PART:].max() > GROWS * off[:-PART].max())

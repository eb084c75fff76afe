"""Whether motions stay beside a periodic one.

Newton's method finds periodic motions whether they are stable or not. Where a Floquet multiplier lies outside
the unit circle (`stability`) the motion is pushed off along its direction and marched: it leaves for good, or
comes to vary about the periodic one, by so little sometimes that this may stand for it.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from microslip.analyses.time.floquet import Multipliers
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

PUSHES = (PUSH, PUSH / 3, PUSH / 9)
"""Shares of the size of the vibration by which a motion is pushed off, one after the other."""

FALLS = 0.97
"""Times that a motion is as far off as it was after the first block, at most, where it falls back."""

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

    One that falls back tells no more than that what stays is not as far off: it is pushed by less then.

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
    own, cycles, outer = steady.amplitude, found.cycles, np.inf
    if found.verdict != "unstable":
        return Stay(own, 0.0, cycles)
    for share in PUSHES:
        try:
            Q = _marched(scheme, steady, found, share, memory)
        except MicroslipError:  # it is not known to stay
            return Stay(own, np.inf, cycles)
        cycles += len(Q)
        stay = _seen(Q, own, found)._replace(cycles=cycles)
        if not np.isfinite(stay.strays):
            return stay
        times = _times_off(Q, own, found)
        if times >= FALLS:
            break
        outer = min(outer, _off(Q[-_half_turn(found) :], own))
    # what grows comes as far as others fall back to, at most
    grows = times > 1 / FALLS and np.isfinite(outer)
    return Stay(own, outer, cycles) if grows or stay.strays > outer else stay


def _marched(
    scheme: TimeScheme,
    steady: SteadyState,
    found: Multipliers,
    share: float,
    memory: ContactMemory | None,
) -> Complex:
    """First harmonics of a motion pushed off, until it has left, or what becomes of it is seen."""
    state, own, Q = pushed(scheme, steady, found, share)[0], steady.amplitude, np.zeros(0, complex)
    least = max(LEAST, BLOCK + 2 * _half_turn(found))
    while len(Q) < least or (len(Q) < MOST and _is_open(Q, own, found)):
        more, states = watched(scheme, steady.load, state, BLOCK, steady.phase, memory)
        state, Q = states[-1], np.append(Q, more)
        if _off(more, own) > LEAVES:
            break
    return Q


def _is_open(Q: Complex, own: complex, found: Multipliers) -> bool:
    """Whether a motion is ever farther off, or changes so slowly that it is not seen which way."""
    slow = found.largest**PART <= GROWS
    return _grows(Q, own) or (slow and FALLS <= _times_off(Q, own, found) <= 1 / FALLS)


def _seen(Q: Complex, own: complex, found: Multipliers) -> Stay:
    """What was seen of a motion beside a periodic one, whose first harmonic is its own."""
    if _off(Q[-BLOCK:], own) > LEAVES:
        return Stay(own, np.inf, len(Q))
    last = Q[-PART:]
    if found.largest**PART <= GROWS and not _fallen(Q, own):
        # too slow to tell: it may be on its way
        return Stay(own, 2 * _off(last, own), len(Q))
    size = float(np.abs(last).mean())
    mean = size * complex(np.exp(1j * np.angle(last.mean())))
    strays = _off(last, size)
    if _grows(Q, own):
        return Stay(mean, max(strays, OPEN), len(Q))
    # a mean of so many cycles is one of the motion as far as that before is the same
    moved = abs(float(np.abs(Q[-2 * PART : -PART]).mean()) / size - 1)
    return Stay(mean, strays + moved, len(Q), 0.0 if _fallen(Q, own) else strays)


def _off(Q: Complex, own: complex) -> float:
    """How far the size strays from that of a motion, at most, relative."""
    return float(np.abs(np.abs(Q) / abs(own) - 1).max())


def _times_off(Q: Complex, own: complex, found: Multipliers) -> float:
    """Times that a motion is as far off as it was after the first block, over half a turn each."""
    part, off = _half_turn(found), np.abs(Q / own - 1)
    return float(off[-part:].max() / off[BLOCK : BLOCK + part].max())


def _half_turn(found: Multipliers) -> int:
    """Cycles of half a turn about the periodic motion; at least `PART`, and not over half of the most."""
    vibrations = found.values[found.vibration]
    turn = abs(float(np.angle(vibrations[np.argmax(np.abs(vibrations))])))
    return int(np.clip(np.pi / max(turn, 1e-9), PART, (MOST - BLOCK) // 2))


def _grows(Q: Complex, own: complex) -> bool:
    """Whether a motion is farther off than in the part before, by its first harmonics."""
    off = np.abs(Q / own - 1)
    return bool(off[-PART:].max() > GROWS * off[-2 * PART : -PART].max()) and not _fallen(Q, own)


def _fallen(Q: Complex, own: complex) -> bool:
    """Whether a motion is much less far off than it has been."""
    off = np.abs(Q / own - 1)
    return bool(off[-PART:].max() <= FALLEN * off.max())

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
from microslip.analyses.time.scheme import ContactMemory, State, TimeScheme
from microslip.analyses.time.stability import stability_of
from microslip.analyses.time.steady import SteadyState
from microslip.analyses.time.watching import LEAK, known_mean, watched
from microslip.errors import MicroslipError
from microslip.typing import Array, Complex

BLOCK, PART, SETTLES = 20, 40, 60
"""Cycles after which it is looked at; those at least that tell where the motion is, and whether it is farther
off than in as many before; and those after which what else the push stirs has died away."""

LEAST, MOST, SLOWLY = 100, 1000, 300
"""Cycles marched after the push where less than a turn is seen of it, and at most where it is ever farther
off: with a multiplier of 1.004 a thousandth takes so many to become some per cent. And at most where it
changes too slowly to tell, unless three parts are more."""

TURN, LONGEST = 1.25, 190
"""Turns about the periodic motion that tell where a motion is: with its size that takes more cycles or fewer;
and the most cycles."""

PUSHES = (PUSH, PUSH / 3, PUSH / 9)
"""Shares of the size of the vibration by which a motion is pushed off, one after the other."""

SMALL = 1e-3
"""Where motions stray by less they are not pushed again."""

FALLS, RISES = 0.97, 0.05
"""Times that a motion is as far off at the end as at first, at most, where it falls back; and by how much
those rise where it is pushed by less. What falls alike from everywhere is another motion that dies away."""

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
        How far the size strays from that, at most, and that from what it was before, relative; zero of a
        stable motion, infinite where motions leave.
    cycles : int
        Spent.
    varies : float
        How far the size strays from that where it was seen to go on: neither farther from cycle to cycle nor
        less far than before; else zero.
    """

    amplitude: complex
    strays: float
    cycles: int
    varies: float = 0.0


class _Turn(NamedTuple):
    """How motions turn about a periodic one: the cycles that tell where one is, whether it turns in these,
    and whether what it grows by in them is too little to tell."""

    part: int
    whole: bool
    slow: bool


class _March(NamedTuple):
    """A motion pushed off: first harmonics, what was seen of it, how far its size is off in the end, and the
    times that it is as far off then as it was at first."""

    Q: Complex
    stay: Stay
    off: float
    times: float


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
    own, cycles, marches = steady.amplitude, found.cycles, list[_March]()
    if found.verdict != "unstable":
        return Stay(own, 0.0, cycles)
    turn = _turn_of(found)
    for share in PUSHES:
        state = pushed(scheme, steady, found, share)[0]
        try:
            marches.append(_marched(scheme, steady, state, turn, memory))
        except MicroslipError:
            break
        one = marches[-1]
        cycles += len(one.Q)
        if not np.isfinite(one.stay.strays):
            return Stay(own, np.inf, cycles)
        if not turn.whole or marches[0].stay.strays <= SMALL or one.times >= FALLS:
            break
    if not marches:  # it is not known to stay
        return Stay(own, np.inf, cycles)
    return _of_all(marches, own, turn.slow)._replace(cycles=cycles)


def _of_all(marches: list[_March], own: complex, slow: bool) -> Stay:
    """What motions do that were pushed by less and less."""
    last, times = marches[-1], [one.times for one in marches]
    falls = [
        i for i, t in enumerate(times) if t < FALLS and max(times[i + 1 :], default=0) >= t + RISES
    ]
    if not falls:
        return marches[0].stay
    if not slow and FALLS <= last.times <= 1 / FALLS:
        return last.stay
    # what grows comes as far as the others fall back to, at most
    return Stay(own, max(marches[falls[-1]].off, last.off), 0)


def _marched(
    scheme: TimeScheme,
    steady: SteadyState,
    state: State,
    turn: _Turn,
    memory: ContactMemory | None,
) -> _March:
    """A motion pushed off to a state, until it has left, or what becomes of it is seen."""
    own, Q, off = steady.amplitude, np.zeros(0, complex), np.zeros(0)
    # three parts tell whether it is farther off ever faster, or ever slower
    least = SETTLES + 3 * turn.part if turn.whole else LEAST
    most = MOST if turn.whole and not turn.slow else SLOWLY
    while len(Q) < least or (len(Q) < most and _is_open(off, turn)):
        more, states = watched(scheme, steady.load, state, BLOCK, steady.phase, memory)
        state, Q = states[-1], np.append(Q, more)
        if _off(more, own) > LEAVES:
            return _March(Q, Stay(own, np.inf, len(Q)), np.inf, np.inf)
        off = np.abs(Q / own - 1)
    part = min(turn.part, len(Q) // 2)
    times = _times_off(off, part) if turn.whole else np.inf
    # of less than a turn, or so slowly, it is not seen whether it is on its way
    unseen = not turn.whole or (turn.slow and not _fallen(off, part))
    last = _off(Q[-part:], own)
    stay = Stay(own, 2 * last, len(Q)) if unseen else _seen(Q, off, part)
    return _March(Q, stay, last, times)


def _turn_of(found: Multipliers) -> _Turn:
    """How motions turn about a periodic one, by its largest multiplier of a vibration."""
    vibrations = found.values[found.vibration]
    angle = abs(float(np.angle(vibrations[np.argmax(np.abs(vibrations))])))
    # what does not turn is seen in any
    wanted = max(PART, int(np.ceil(TURN * 2 * np.pi / angle))) if angle else PART
    part = min(wanted, LONGEST)
    return _Turn(part, wanted <= LONGEST, found.largest**part <= GROWS)


def _is_open(off: Array, turn: _Turn) -> bool:
    """Whether a motion is ever farther off, or changes so slowly that it is not seen which way."""
    slow = turn.slow and turn.whole
    return _grows(off, turn.part) or (slow and FALLS <= _times_off(off, turn.part) <= 1 / FALLS)


def _seen(Q: Complex, off: Array, part: int) -> Stay:
    """What was seen of a motion, by its first harmonics, and how far these are off the periodic one's."""
    last, fallen = Q[-part:], _fallen(off, part)
    size, moved = known_mean(np.abs(Q[-3 * part :]))
    end = float(np.abs(last).mean())
    varies = _off(last, end)
    if moved > varies:  # it goes from one size to another, and does not beat about a mean
        size, moved = end, abs(float(np.abs(Q[-2 * part : -part]).mean()) / end - 1)
    else:
        moved = max(moved, LEAK * varies)
    mean = size * complex(np.exp(1j * np.angle(last.mean())))
    strays = _off(last, size)
    if _grows(off, part):
        return Stay(mean, max(strays, OPEN), len(Q))
    return Stay(
        mean, strays + moved + _to_come(off, part), len(Q), 0.0 if fallen else min(varies, strays)
    )


def _off(Q: Complex, own: complex) -> float:
    """How far the size strays from that of a motion, at most, relative."""
    return float(np.abs(np.abs(Q) / abs(own) - 1).max())


def _times_off(off: Array, part: int) -> float:
    """Times that a motion is as far off at the end as it was once what else the push stirs had settled."""
    return float(off[-part:].max() / max(off[SETTLES : SETTLES + part].max(), 1e-300))


def _grows(off: Array, part: int) -> bool:
    """Whether a motion is farther off than in the part before, or gets there ever faster."""
    earlier, before, last = _parts(off, part)
    hastens = 0 < before - earlier < last - before
    return (last > GROWS * before or hastens) and not _fallen(off, part)


def _to_come(off: Array, part: int) -> float:
    """How much farther off a motion will be that gets there ever slower, as a geometric series, relative.

    No more than it is already: what beats is farther off now and then.
    """
    earlier, before, last = _parts(off, part)
    gone, more = before - earlier, last - before
    return min(more**2 / (gone - more), last) if 0 < more < gone else 0.0


def _parts(off: Array, part: int) -> tuple[float, float, float]:
    """How far off a motion is at most in each of the last three parts; infinite where there is none."""
    earlier = float(off[-3 * part : -2 * part].max()) if len(off) >= 3 * part else np.inf
    return earlier, float(off[-2 * part : -part].max(initial=0.0)), float(off[-part:].max())


def _fallen(off: Array, part: int) -> bool:
    """Whether a motion is much less far off than it has been."""
    return bool(off[-part:].max() <= FALLEN * off.max())

"""What a short search by time integration ends in, and how well that is known.

From rest with the velocity of the motion that is expected, in `CYCLES` cycles at most. What has settled then
is sought on until it is at rest, as it may creep by some thousandths, a part in a hundred thousand a cycle;
where its bodies walk past each other, to where they come to rest. What is still open may be marched for some
hundred.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from microslip.analyses.harmonic.points import WALKS
from microslip.analyses.prepared.joint import PreparedJoint
from microslip.analyses.time.offset import BRANCH
from microslip.analyses.time.readings import opening_of
from microslip.analyses.time.resting import WalksOnError, at_phase_0
from microslip.analyses.time.scheme import TimeScheme, time_scheme
from microslip.analyses.time.starts import Start, end_of
from microslip.analyses.time.steady import (
    RAISED,
    SteadyState,
    raised_state,
    steady_state,
    walk_of,
)
from microslip.analyses.time.watching import watched
from microslip.contact.pairs import mean_slip
from microslip.errors import MicroslipError
from microslip.numerics.fourier import harmonic, without_drift
from microslip.pipeline.creep import Walk, crept
from microslip.pipeline.targets import STEPS, TOLERANCE, known_rest
from microslip.pipeline.walk import DOUBTFUL, LONGEST, lasting
from microslip.pipeline.walked import rested_soon
from microslip.typing import Complex

CYCLES = 30
"""Cycles at most."""

WATCHED = 12
"""Cycles over which a motion that still changes is looked at."""

LASTS = 10.0
"""Cycles that transients are taken to last at least."""

SLOWEST = 0.99
"""Multiplier of the slowest transient, at most, that a drift is taken to go on with."""

SURE = 2e-3
"""Doubt of an amplitude below which a motion is not looked at any longer."""

OPEN, PATIENCE = 5e-3, 8
"""Doubt of an amplitude above which its motion is marched, and blocks of cycles at most: where a motion
creeps a search stops on its way."""

AT_REST, ON = 3e-7, 90
"""Change over a cycle to which what has settled is sought on, and cycles of that at most."""


class BriefMotion(NamedTuple):
    """What a short search by time integration ends in.

    Attributes
    ----------
    amplitude : complex
        First harmonic of the modal coordinate.
    change : float
        Of the state over the last cycle.
    doubt : float
        Relative error of the amplitude that is left; above `DOUBTFUL` the motion is not steady.
    opens : bool
        Whether at some instant no pair touches.
    output : (p,) complex array
        First harmonics of the outputs of all ports.
    end : Start or None
        Of the motion.
    settled : bool
        Whether that repeats.
    crept : float
        By how much the amplitude has changed as a motion that has settled was sought on, and did not come to
        rest, relative; nan of others.
    walk : float
        By how much the bodies move past each other in a cycle, over the largest range of a slip.
    walked, lasts, moved : float
        Of bodies that have come to rest, or are on the way after `offset.HORIZON` cycles, how far they walk
        until they are at rest, m, in how many cycles, about, and by how much what they have walked has
        changed the amplitude, relative.
    """

    amplitude: complex
    change: float
    doubt: float
    opens: bool = False
    output: Complex = np.zeros(0, complex)
    end: Start | None = None
    settled: bool = False
    crept: float = np.nan
    walk: float = 0.0
    walked: float = 0.0
    lasts: float = 0.0
    moved: float = 0.0


def brief_motion(
    joint: PreparedJoint, load: float, frequency: float, guess: complex, steps: int = STEPS
) -> BriefMotion:
    """The motion from rest with the velocity of a guess; where it still changes, its mean over cycles.

    Parameters
    ----------
    joint : PreparedJoint
    load, frequency : float
        Amplitude of the load, N/m or N m/m, and Hz.
    guess : complex
        First harmonic of the modal coordinate that is expected.
    steps : int
        Per cycle.

    Raises
    ------
    MicroslipError
        Where a time step has no solution, or the joint opens.
    """
    scheme = time_scheme(joint, 1 / (frequency * steps), frequency=frequency)
    found = steady_state(
        scheme, frequency, load, guess=guess, tolerance=TOLERANCE, max_cycles=CYCLES
    )
    if opening_of(found.cycle, joint.model.position):
        return BriefMotion(0j, np.inf, np.inf, True)
    # where it has not settled, the search need not have met what is slow
    least = 0.0 if found.converged else SLOWEST
    slowest = float(np.abs(found.multipliers).max(initial=least))
    left = found.change * lasting(slowest, LASTS)
    output, walk = _outputs(found), abs(walk_of(found, joint.model.dimension))
    if left <= SURE:
        end, done = found.end, found.converged
        return BriefMotion(found.amplitude, found.change, left, False, output, end, done, walk=walk)
    Q, _ = watched(scheme, load, found.cycle.state, WATCHED, found.phase)
    size, mean = np.abs(Q), complex(np.mean(Q))
    first, second = np.split(size, 2)
    kept = min(slowest, SLOWEST) ** (WATCHED // 2)
    to_come = abs(second.mean() - first.mean()) * kept / (1 - kept)
    doubt = float(np.ptp(size) + to_come) / max(abs(mean), 1e-300)
    scaled = output * (mean / found.amplitude)
    # what is slow, or grows, need not show in so few cycles: whether motions stay beside it is asked of
    # all that repeats
    done = found.converged and doubt <= SURE
    return BriefMotion(mean, found.change, doubt, False, scaled, found.end, done, walk=walk)


def patient_motion(
    joint: PreparedJoint, load: float, frequency: float, guess: complex, steps: int = STEPS
) -> BriefMotion:
    """As `brief_motion`, sought on; what that leaves open is marched, with leaps, after the load was raised.

    For `PATIENCE` blocks of cycles, where the search has not settled, as a small change may go on for long,
    or what it ends with is known no better than to `OPEN`. Where that is a motion of the branch of the
    search, or else of the guess, it is the answer: known no better than its drift would make in `LONGEST`
    cycles, nor than it differs from what was found.

    Parameters
    ----------
    joint, load, frequency, guess, steps
        As there.

    Raises
    ------
    MicroslipError
        As there.
    """
    found = brief_motion(joint, load, frequency, guess, steps)
    if found.opens:
        return found
    scheme = time_scheme(joint, 1 / (frequency * steps), frequency=frequency)
    if found.doubt <= OPEN and found.change <= TOLERANCE:
        on = _sought_on(scheme, frequency, load, found)
        if on is not None:
            return _at_rest(scheme, frequency, load, on)
        found = found._replace(doubt=max(found.doubt, OPEN), settled=False)
    try:
        begin = raised_state(scheme, frequency, load, RAISED)
        end = crept(scheme, load, begin, PATIENCE, Walk() if found.walk > WALKS else None)
    except MicroslipError:
        return found
    known = found.doubt <= DOUBTFUL
    ratio = abs(end.amplitude) / max(abs(found.amplitude if known else guess), 1e-300)
    if abs(np.log(max(ratio, 1e-300))) > BRANCH:
        return found
    apart = abs(1 / ratio - 1) if known else 0.0
    start = end_of(end.state, 0.0, scheme, frequency)
    drift = abs(end.drift)
    own = max(end.doubt, LONGEST * drift)
    doubt = max(own, apart)
    marched = BriefMotion(end.amplitude, drift, doubt, end=start, walk=found.walk)
    if end.rest is None:
        return marched
    # where they are after `offset.HORIZON` cycles: as much again may be to come
    if known_rest(end.rest, end.ahead) is None:
        return marched._replace(doubt=own + apart, moved=apart)
    # what it differs by from what was found is the walk
    far = float(np.linalg.norm(end.rest - mean_slip(begin.v, joint.model.dimension)))
    return marched._replace(doubt=own, walk=0.0, walked=far, lasts=end.reached, moved=apart)


def _sought_on(
    scheme: TimeScheme, frequency: float, load: float, found: BriefMotion
) -> BriefMotion | None:
    """A motion that has settled, at rest or after `ON` cycles; None where it is no longer itself."""
    if found.change <= AT_REST or not found.settled:
        return found
    try:
        end = steady_state(
            scheme, frequency, load, start=found.end, tolerance=AT_REST, max_cycles=ON
        )
    except MicroslipError:
        return None
    ratio = abs(end.amplitude) / abs(found.amplitude)
    left = abs(np.log(max(ratio, 1e-300))) > BRANCH
    if left or end.change > TOLERANCE or opening_of(end.cycle, scheme.joint.model.position):
        return None
    slowest = float(np.abs(end.multipliers).max(initial=0.0))
    crept = np.nan if end.converged else abs(ratio - 1)
    doubt = end.change * lasting(slowest, LASTS)
    own = _outputs(end), end.end, True, crept, abs(walk_of(end, scheme.joint.model.dimension))
    return BriefMotion(end.amplitude, end.change, doubt, False, *own)


def _at_rest(scheme: TimeScheme, frequency: float, load: float, found: BriefMotion) -> BriefMotion:
    """The same where bodies that walk have come to rest, or are after `offset.HORIZON` cycles.

    Where that is not found it has not settled, and is open: it may fall from its branch on the way.
    """
    if not found.settled or found.walk <= WALKS or found.end is None:
        return found
    try:
        steady = steady_state(
            scheme, frequency, load, start=found.end, tolerance=TOLERANCE, max_cycles=CYCLES
        )
        there = rested_soon(scheme, steady, found.end)
    except WalksOnError:
        return found._replace(doubt=max(found.doubt, OPEN), settled=False)
    except MicroslipError:
        return found
    if there is None:
        return found
    now = there.steady
    slowest = float(np.abs(now.multipliers).max(initial=0.0))
    left = max(there.apart, now.change * lasting(slowest, LASTS))
    moved = abs(abs(now.amplitude) / abs(found.amplitude) - 1)
    if there.offset is None:  # as much again may be to come
        left += moved
    return found._replace(
        amplitude=now.amplitude,
        change=now.change,
        doubt=left,
        output=_outputs(now),
        end=end_of(at_phase_0(scheme, now), 0.0, scheme, frequency),
        walk=abs(walk_of(now, scheme.joint.model.dimension)),
        walked=there.walked,
        lasts=there.lasts,
        moved=moved,
    )


def _outputs(found: SteadyState) -> Complex:
    """First harmonics of the outputs of all ports."""
    theta = found.phase + np.linspace(0, 2 * np.pi, len(found.cycle.output))
    return np.asarray(harmonic(without_drift(found.cycle.output, theta), theta), dtype=complex)

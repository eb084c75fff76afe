"""Motions of the full joint at resonance, each from those under smaller loads.

A motion begins from the line through the two before it, with the amplitude that their contact forces lead to
expect under its load, at a frequency a little above the resonance expected. One cycle tells the contact
force there: where it asks for another load or frequency, the motion begins again with what was learned.
From there on its amplitude is kept (`microslip.pipeline.kept`), and Newton's method goes on with the
derivative of the period map that the motions before have left, corrected by every cycle; deviations are
marched where that does not bring it closer. Two to six cycles, and the contact force stays as it is. The load
is then that which the amplitude takes, near the one that was asked for. All tractions come from smaller
loads, the first motion's from rest: the past that is meant where none is given.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from microslip.analyses.prepared.joint import PreparedJoint
from microslip.analyses.reduced.two_mode import TwoModeModel
from microslip.analyses.time.deviations import Derivative
from microslip.analyses.time.readings import opening_of
from microslip.analyses.time.search import Search
from microslip.errors import JointOpensError
from microslip.pipeline.kept import End, KeptMotion
from microslip.typing import Complex

CLOSE, SETTLED = 2e-3, 5e-3
"""Change of the vibration over a cycle, and that of kappa from the cycle before over what resists the motion,
below which kappa is taken."""

CYCLES, RENEWED = 12, 6
"""Cycles at most, and after how many deviations are marched."""

TRIALS, NEAR, FAR = 3, 0.1, 0.4
"""Beginnings at most; the logarithm of the load over that asked for, and the detuning, that need no other."""

ABOVE = 0.2
"""Detuning that is aimed at: where the joint softens, on the side of its resonance that has one answer."""

GUESSES = 60
"""Iterations of what is expected: an amplitude and its contact force."""

UNDAMPED = 1e-4
"""Loss over ``omega_st²`` that a joint without damping is taken to have where a motion is guessed."""

LOWEST = 0.05
"""Least ``(omega / omega_st)²`` that is expected."""

BEYOND, LEAST = 3.0, 0.3
"""How far the line through two contact forces is trusted, in their distance, and the least share of the
loss of the larger one that is expected."""


@dataclass(frozen=True)
class Followed:
    """A motion and what it says of the contact force.

    Attributes
    ----------
    load, omega : float
    amplitude, kappa : complex
        ``A = Q + c M`` against the load, and the contact force over ``omega_st² A``.
    doubt : float
        Twice the change of kappa from one cycle to the next.
    output : (p,) complex array
        First harmonics of the outputs of all ports.
    end : End
    derivative : Derivative
        Of the period map with the amplitude kept.
    """

    load: float
    omega: float
    amplitude: complex
    kappa: complex
    doubt: float
    output: Complex
    end: End
    derivative: Derivative


def followed(
    joint: PreparedJoint, model: TwoModeModel, load: float, past: Sequence[Followed]
) -> Followed | None:
    """The motion near resonance under about a load; None where none settles within `CYCLES`.

    Parameters
    ----------
    joint : PreparedJoint
    model : TwoModeModel
        Its `microslip.analyses.reduced.two_mode.stuck_model`.
    load : float
    past : sequence of Followed
        Motions under smaller loads, ascending.

    Raises
    ------
    MicroslipError
        Where a time step has no solution, or the joint opens.
    """
    told = [(abs(one.amplitude), one.kappa) for one in past]
    ends = [one.end for one in past]
    for _ in range(TRIALS):
        omega, A = expected(model, load, told)
        motion = KeptMotion(joint, model, omega, load, A)
        state = motion.begun(ends)
        cycle = motion.march(state)
        A, kappa = motion.reading(state, cycle)
        Z = motion.resists(kappa)
        off = abs(np.log(abs(motion.keeping(A, kappa)) / load))
        if off < NEAR and abs(Z.real) < FAR * abs(Z.imag):
            break
        told.append((abs(A), kappa))
    known = past[-1].derivative if past else None
    search = Search(motion.space, True, near=False, known=known)
    for count in range(CYCLES):
        before = kappa
        A, kappa = motion.reading(state, cycle)
        cycle = motion.kept(state, cycle)
        change, moved = motion.change(state, cycle), abs(kappa - before)
        if count and change <= CLOSE and moved <= SETTLED * abs(motion.resists(kappa)):
            opens = opening_of(cycle, joint.model.position)
            if opens:
                raise JointOpensError(opens)
            return Followed(
                load=motion.load,
                omega=omega,
                amplitude=A,
                kappa=kappa,
                doubt=2 * moved,
                output=motion.outputs(cycle),
                end=motion.end(A, cycle),
                derivative=search.derivative,
            )
        if count % RENEWED == RENEWED - 1:
            search.renew()
        state = search.next(state, cycle, change)
        motion.drive(motion.keeping(A, kappa))
        cycle = motion.march(state, search.tangents)
    return None


def expected(
    model: TwoModeModel, load: float, told: Sequence[tuple[float, complex]]
) -> tuple[float, complex]:
    """Frequency a little above resonance under a load, rad/s, and A that is expected there.

    Parameters
    ----------
    model : TwoModeModel
    load : float
    told : sequence of (float, complex)
        ``|A|`` and kappa that are known.
    """
    c, square = float(model.offset[0]), model.omega**2
    omega, size, A = model.omega, max((x for x, _ in told), default=0.0), 0j
    for _ in range(GUESSES):
        kappa = between(told, size)
        resists = complex(model.linear_stiffness(omega)) + square * kappa
        loss = max(resists.imag, UNDAMPED * square)
        softened = square * (1 + kappa.real) + ABOVE * loss
        omega = float(np.sqrt(max(softened, LOWEST * square)))
        D = complex(model.linear_stiffness(omega))
        A = (model.force[0] + D * c) * load / complex((D + square * kappa).real, loss)
        size = float(np.sqrt(size * abs(A))) if size else abs(A)
    return omega, complex(A)


def between(told: Sequence[tuple[float, complex]], size: float) -> complex:
    """Contact force at an amplitude: on lines in its logarithm, the last one as far as `BEYOND`.

    Parameters
    ----------
    told : sequence of (float, complex)
        Amplitudes and contact forces.
    size : float

    Examples
    --------
    >>> between([(1.0, 0.1j), (100.0, -0.2 + 0.3j)], 10.0)
    (-0.1+0.2j)
    >>> between([], 1.0)
    0j
    """
    points = sorted(told, key=lambda one: one[0])
    if len(points) < 2:
        return points[0][1] if points else 0j
    x = np.log([one[0] for one in points])
    k = int(np.clip(np.searchsorted(x, np.log(size)), 1, len(x) - 1))
    (_, one), (_, two) = points[k - 1 : k + 1]
    wide = x[k] - x[k - 1]
    t = float(np.clip((np.log(size) - x[k - 1]) / wide, 0.0, BEYOND)) if wide > 0 else 1.0
    found = one + t * (two - one)
    return complex(found.real, max(found.imag, LEAST * two.imag))

"""From few harmonics to many where joints bounce: by way of contact laws with rounded corners.

With many harmonics thousands of samples have a contact state of their own, and Newton's method stalls among
them from whatever start. With rounded laws (`contact/aft_rounded.py`) there are no states: the equations are
smooth, and each reaction times the gap that it stands against has one product kappa all cycle,

    r_n (r_n - x_n) = kappa eps_n,

whatever the augmentation eps. As kappa rises from zero an answer of the exact laws goes over into one that
hardly knows of its contact states, and few harmonics determine; the answers with few and with many harmonics
are then next to each other, and Newton's method gets from one to the other. From there kappa is taken back to
zero with many harmonics. Both ways are branches over kappa, followed through folds: the central path of
interior-point methods (`aft_rounded.py`), whose other end is the answer.

The parameter is ``p = log10 sqrt(kappa / kappa_1)``, with ``kappa_1`` the square of the force scale over the
mean augmentation of the answer that is rounded.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from microslip.analyses.harmonic.equations import evaluate
from microslip.analyses.harmonic.operator import LinearOperator, linear_operator
from microslip.analyses.harmonic.paths import CONTROL, FrequencyPath
from microslip.analyses.harmonic.points import HarmonicPoint, distance
from microslip.analyses.harmonic.problem import HarmonicProblem
from microslip.analyses.harmonic.starts import first_step, start_from_unknowns
from microslip.brief import Brief
from microslip.numerics.continuation import (
    BranchPoint,
    ContinuationError,
    first_point,
    trace,
    turned,
)
from microslip.typing import Array

SHARP, ROUNDEST = -3.0, 2.0
"""Parameters p between which branches are followed; laws are exact to Newton's method at the first."""

BEYOND = 10.0
"""Parameter beyond which a step of Newton's method has gone astray."""

CHANGED = 0.05
"""Change of the amplitude by rounding at which other harmonics are taken."""

DECADE = 0.1
"""Length of a step that changes all reactions by the largest of the prestress, in decades of delta."""

STEPS = replace(
    CONTROL, first=0.2, smallest=3e-3, largest=0.7, max_iterations=8, tolerance=1e-2, max_points=30
)
"""Along a branch, which is left for Newton's method at its end: what is between need not be accurate."""

PROBE = 1e-4
"""Step in p of the difference that is the derivative by it."""


@dataclass(frozen=True, repr=False)
class RoundedAnswer(Brief):
    """A response with rounded contact laws.

    Attributes
    ----------
    problem : HarmonicProblem
    w, v : (n,), (d p, c) arrays
        Unknowns, and relative displacements.
    p : float
        How far it is rounded.
    unit : float
        Product of force and displacement that p is relative to, kappa_1.
    """

    problem: HarmonicProblem
    w: Array
    v: Array
    p: float
    unit: float


def rounded(path: FrequencyPath, point: HarmonicPoint) -> RoundedAnswer:
    """An answer with its contact laws rounded until its amplitude has changed by `CHANGED`.

    Parameters
    ----------
    path : FrequencyPath
        Of the problem of the answer.
    point : HarmonicPoint

    Raises
    ------
    ContinuationError
        Where its branch does not lead so far.
    """
    problem = point.problem
    way = RoundedPath(path, point.frequency, problem.force_scale**2 / problem.spring)

    def enough(reached: BranchPoint) -> bool:
        return distance(way.amplitude(reached.u), point.amplitude) >= CHANGED

    start = first_point(way, point.w, SHARP, STEPS)
    branch = trace(way, start, (SHARP - 1, ROUNDEST), STEPS, enough)
    if branch.ended != "stopped":
        raise ContinuationError(
            f"rounded contact laws do not change the amplitude by {CHANGED:g} at {point.frequency:.6g} Hz"
            f" ({branch.ended})"
        )
    end = branch.points[-1]
    return RoundedAnswer(problem, end.u, way.at(end.u, end.p).point.v, end.p, way.unit)


def sharpened(path: FrequencyPath, known: RoundedAnswer, frequency: float) -> Array:
    """Unknowns next to a response of the path's equations, from a rounded one with other harmonics.

    Parameters
    ----------
    path : FrequencyPath
        Its bodies stand where those of the rounded response do.
    known : RoundedAnswer
    frequency : float
        Hz.

    Raises
    ------
    ContinuationError
        Where the branch does not lead there.
    """
    way = RoundedPath(path, frequency, known.unit)
    rounding = way.rounding(known.p)
    start = start_from_unknowns(path.problem, known.problem, known.w, known.v, rounding)
    w = first_step(path, start, frequency, rounding)
    at = turned(first_point(way, w, known.p, STEPS))
    branch = trace(way, at, (SHARP, known.p + 1), STEPS)
    end = branch.points[-1]
    if end.p != SHARP:
        raise ContinuationError(
            f"no way from rounded contact laws to a response at {frequency:.6g} Hz: as far as"
            f" {10**end.p:.2g} of the force scale ({branch.ended})"
        )
    return end.u


class RoundedPath:
    """Equations over how far contact laws are rounded (`continuation.Problem`).

    Parameters
    ----------
    path : FrequencyPath
    frequency : float
        Hz.
    unit : float
        kappa_1.
    """

    parameter_scale = 1.0

    def __init__(self, path: FrequencyPath, frequency: float, unit: float) -> None:
        self.load, self.solver, self.unit = path.load, path.solver, unit
        self.weight = DECADE**2 * path.weight
        self.operator = linear_operator(path.problem, 2 * np.pi * frequency)

    def rounding(self, p: float) -> Array:
        """Delta of every component, (p, 2), N (per metre of width in the plane)."""
        stiffness = self.operator.problem.stiffness
        return 10**p * np.sqrt(self.unit * stiffness).reshape(-1, self.operator.problem.dimension)

    def at(self, w: Array, p: float) -> RoundedAt:
        """Equations rounded so far."""
        if not p <= BEYOND:
            raise ContinuationError(
                f"contact laws rounded by 1e{p:.3g} of the force scale: no laws"
            )
        return RoundedAt(self, w, p)

    def amplitude(self, w: Array) -> complex:
        """First harmonic of the coordinate."""
        problem = self.operator.problem
        output = self.operator.outputs(*problem.split(w), self.load)
        return complex(output[1, problem.model.port(problem.coordinate)])


class RoundedAt:
    """Equations at one point, scaled, with their derivative (`continuation.Linearised`).

    Parameters
    ----------
    way : RoundedPath
    w : (n,) array
    p : float
    """

    def __init__(self, way: RoundedPath, w: Array, p: float) -> None:
        self.way, self.w, self.p = way, w, p
        self.operator: LinearOperator = way.operator
        self.scale = self.operator.problem.force_scale
        self.point = evaluate(self.operator, way.load, w, rounding=way.rounding(p))
        self.F = self.point.F / self.scale

    def solve(self, right: Array, tolerance: float, guess: Array | None = None) -> Array:
        """Solve with the derivative by the unknowns."""
        return self.way.solver.linear_solve(
            self.operator, self.point.cycle, right * self.scale, tolerance, guess
        )

    def by_parameter(self) -> Array:
        """Derivative of the residual by p."""
        return (self.way.at(self.w, self.p + PROBE).F - self.F) / PROBE

"""From a start whose contact states are known to a response, step by step.

A start (`starts.py`) has reactions ``r_0`` and augmented forces ``x_0`` that nearly belong together: its
contact law is missed by ``e = r_0 - C(x_0)``, its linear side by ``d = x_0 - x(r_0)``. Where Newton's method
does not get from it to a response, since too many states change at once, both are taken away by and by,

    r - C(x(r) + (1 - s) d) - (1 - s) e = 0,        s = 0 .. 1.

At ``s = 0`` the start is a solution: that of the joint with displacements ``d / eps`` imposed on its pairs.
The branch through it is followed over s, through folds, until ``s = 1``, where it is a response of the joint
as it is (a homotopy: E. L. Allgower & K. Georg, Introduction to Numerical Continuation Methods, SIAM 2003).
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from microslip.analyses.harmonic.equations import Evaluation, evaluate, offset_derivative
from microslip.analyses.harmonic.linear import HarmonicSolver
from microslip.analyses.harmonic.operator import LinearOperator, linear_operator
from microslip.analyses.harmonic.paths import CONTROL, FrequencyPath
from microslip.analyses.harmonic.starts import Start
from microslip.numerics.continuation import ContinuationError, first_point, trace
from microslip.typing import Array

STEPS = replace(CONTROL, first=0.05, smallest=1e-5, tolerance=1e-6, max_points=80)
"""Along the way, which is left for Newton's method at its end."""

BACK = -0.1
"""Share beyond the start at which a branch that has turned round is given up."""


def approached(path: FrequencyPath, start: Start, frequency: float) -> Array:
    """Unknowns next to a response of the path's equations, on the branch from a start to it.

    Parameters
    ----------
    path : FrequencyPath
        Of the problem of the start.
    start : Start
    frequency : float
        Hz.

    Raises
    ------
    ContinuationError
        Where the branch does not lead there.
    """
    way = Approach(path, start, frequency)
    branch = trace(way, first_point(way, start.w, 0.0, STEPS), (BACK, 1.0), STEPS)
    end = branch.points[-1]
    if end.p != 1.0:
        raise ContinuationError(
            f"no way from the start to a response at {frequency:.6g} Hz: {100 * end.p:.3g} % of it "
            f"({branch.ended})"
        )
    return end.u


class Approach:
    """Equations over the share s of the way (`continuation.Problem`).

    Parameters
    ----------
    path : FrequencyPath
        Of the problem of the start.
    start : Start
    frequency : float
        Hz.
    """

    parameter_scale = 1.0

    def __init__(self, path: FrequencyPath, start: Start, frequency: float) -> None:
        self.load, self.solver, self.weight = path.load, path.solver, path.weight
        self.operator = linear_operator(path.problem, 2 * np.pi * frequency)
        u, _ = path.problem.split(start.w)
        v = evaluate(self.operator, path.load, start.w).v
        self.offset = start.x - u - path.problem.stiffness[:, None] * v
        self.rest = evaluate(self.operator, path.load, start.w, self.offset).F

    def at(self, w: Array, share: float) -> ApproachedAt:
        """Equations at a share."""
        point = evaluate(self.operator, self.load, w, (1 - share) * self.offset)
        return ApproachedAt(self, point, share)


class ApproachedAt:
    """Equations at one point, scaled, with their derivative (`continuation.Linearised`).

    Parameters
    ----------
    way : Approach
    point : Evaluation
        With the offset that is left.
    share : float
        Of the way.
    """

    def __init__(self, way: Approach, point: Evaluation, share: float) -> None:
        self.operator: LinearOperator = way.operator
        self.solver: HarmonicSolver = way.solver
        self.point, self.way = point, way
        self.scale = way.operator.problem.force_scale
        self.F = (point.F - (1 - share) * way.rest) / self.scale

    def solve(self, right: Array, tolerance: float, guess: Array | None = None) -> Array:
        """Solve with the derivative by the unknowns."""
        return self.solver.linear_solve(
            self.operator, self.point.cycle, right * self.scale, tolerance, guess
        )

    def by_parameter(self) -> Array:
        """Derivative of the residual by the share."""
        change = offset_derivative(self.operator.problem, self.point, self.way.offset)
        return (self.way.rest - change) / self.scale

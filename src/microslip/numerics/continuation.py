"""Continuation of solution branches of ``F(u, p) = 0``: predictor, pseudo-arclength, step control.

Nothing here knows what u and p are. A `Problem` evaluates ``F`` at a point and solves linear systems with
its derivative; it also says how long a step in u and in p is, through the inner product

    <x, y> = sum(weight x_u y_u) + x_p y_p / parameter_scale²

A step goes along the unit tangent t, bent as the branch has bent since the point before,

    x_predicted = x + L t + L²/2 (t - t_before) / L_before,

where that is a small turn; then Newton's method corrects in the hyperplane across t,

    J a = -F,  J b = -F_p,   dp = -<t, x - x_predicted + (a, 0)> / <t, (b, 1)>,   du = a + dp b,

two solves with the same derivative ("block elimination"), so that a fold, where p turns round, is
nothing special. Along a branch ``b`` changes little and dp is small: the last one is the guess of the
next, and it is solved for as well as the step needs it. Derivatives may jump (friction, contact): tangents
are only used to predict and to tell directions. A corner sharper than a right angle in this metric has no
point ahead of it; the branch turns there (`steps.around_corner`).
E. L. Allgower & K. Georg, Introduction to Numerical Continuation Methods (SIAM 2003).
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np

from microslip.brief import Brief
from microslip.numerics.newton import (
    ContinuationError,
    Linearised,
    Problem,
    StepControl,
    inner,
    newton,
    size,
    unit_tangent,
)
from microslip.numerics.steps import (
    BranchPoint,
    advance,
    around_corner,
    goes_back,
    step_onto,
    step_within,
)
from microslip.typing import Array

__all__ = [
    "Branch",
    "BranchPoint",
    "ContinuationError",
    "Linearised",
    "Problem",
    "StepControl",
    "advance",
    "crossings",
    "first_point",
    "fold",
    "inner",
    "load_branch",
    "locate",
    "save_branch",
    "solve_at",
    "trace",
    "turned",
]


@dataclass(frozen=True, repr=False)
class Branch(Brief):
    """Points in the order in which they were found.

    Attributes
    ----------
    points : tuple of BranchPoint
    ended : str
        Why the branch ends: ``"range"``, ``"points"``, ``"stopped"`` or ``"failed: ..."``.
    """

    points: tuple[BranchPoint, ...]
    ended: str

    @property
    def parameters(self) -> Array:
        """p of every point."""
        return np.array([point.p for point in self.points])

    @property
    def failed(self) -> bool:
        """Whether the branch ends where no further point was found."""
        return self.ended.startswith("failed")

    @property
    def folds(self) -> list[int]:
        """Indices i of points with a fold between i and i + 1."""
        direction = np.sign([point.tangent_p for point in self.points])
        return [int(i) for i in np.flatnonzero(direction[1:] * direction[:-1] < 0)]


def solve_at(
    problem: Problem, u: Array, p: float, control: StepControl
) -> tuple[Array, Linearised, int]:
    """Newton's method at fixed p: solution, its linearisation, Newton steps.

    Raises
    ------
    ContinuationError
    """
    x, _, equations, iterations, _ = newton(problem, u, p, control, None)
    return x, equations, iterations


def first_point(
    problem: Problem, u: Array, p: float, control: StepControl, direction: float = 1.0
) -> BranchPoint:
    """Solve at fixed p from the guess u; the branch goes towards larger p, or smaller.

    Raises
    ------
    ContinuationError
    """
    x, _, equations, iterations, _ = newton(problem, u, p, control, None)
    t_u, t_p = unit_tangent(problem, equations, np.zeros_like(x), direction, None)
    return BranchPoint(x, p, t_u, t_p, control.first, iterations, size(equations))


def turned(point: BranchPoint) -> BranchPoint:
    """The same point on its branch in the other direction."""
    return replace(point, tangent_u=-point.tangent_u, tangent_p=-point.tangent_p)


def trace(
    problem: Problem,
    start: BranchPoint,
    bounds: tuple[float, float],
    control: StepControl | None = None,
    observe: Callable[[BranchPoint], bool] | None = None,
    stops: Sequence[float] | Array = (),
    before: BranchPoint | None = None,
) -> Branch:
    """Follow a branch from a point until p leaves its bounds.

    The last point of a branch that reaches a bound lies on it. A failed step is halved; when it
    gets too small the branch so far is returned and says so.

    Parameters
    ----------
    problem : Problem
    start : BranchPoint
        From `first_point`, or the last point of a saved branch.
    bounds : (float, float)
        Least and greatest p.
    control : StepControl, optional
    observe : callable, optional
        Called with every new point; the branch stops where it returns True.
    stops : sequence of float, optional
        Values of p on which steps that would pass one of them end, where the branch is not steep.
    before : BranchPoint, optional
        The point before the start, where an earlier branch goes on: with it, step by step as it would have.
    """
    control = control or StepControl()
    points = [start]
    ahead = np.unique(np.asarray(stops, dtype=float))
    step, trusted = min(start.step, control.largest), True
    corner, reason = 0, ""
    while len(points) < control.max_points:
        here = points[-1]
        try:
            back = before if trusted else None
            there = step_onto(problem, back, here, step, ahead, control)
            there = there or step_within(problem, back, here, step, bounds, control)
        except ContinuationError as error:
            step, trusted = 0.5 * step, False
            if step >= control.smallest:
                continue
            around = around_corner(problem, here, control)
            if around is None or not bounds[0] < around[1].p < bounds[1]:
                return Branch(tuple(points), f"failed: {error}")
            here, there = around
            points[-1], step = here, here.step
            corner, reason = len(points), str(error)
        before, trusted = here, True
        step = min(control.largest, step * _growth(there.iterations, control))
        if corner and goes_back(problem, points, there):
            return Branch(tuple(points[:corner]), f"failed: {reason}")
        points.append(replace(there, step=step))
        stop = observe is not None and observe(points[-1])
        if there.p in bounds:
            return Branch(tuple(points), "range")
        if stop:
            return Branch(tuple(points), "stopped")
    return Branch(tuple(points), "points")


def locate(
    problem: Problem,
    a: BranchPoint,
    b: BranchPoint,
    event: Callable[[BranchPoint], float],
    control: StepControl | None = None,
    tolerance: float = 1e-4,
) -> BranchPoint:
    """The point between two neighbours at which `event` changes sign.

    Bracketing (Illinois variant of regula falsi) on the length of the step from `a`: an event that
    jumps is located like one that passes through zero.

    Parameters
    ----------
    tolerance : float
        Bracket, relative to the distance of the two points.

    Raises
    ------
    ContinuationError
        Where the event has the same sign at both points.
    """
    control = control or StepControl()
    low, high = 0.0, inner(problem, b.u - a.u, b.p - a.p, a.tangent_u, a.tangent_p)
    f_low, f_high = event(a), event(b)
    if f_low * f_high > 0:
        raise ContinuationError("the event has the same sign at both points: nothing to locate")
    width = tolerance * high
    found, side = (a, 0) if abs(f_low) < abs(f_high) else (b, 0)
    while high - low > width:
        share = f_low / (f_low - f_high) if f_low != f_high else 0.5
        middle = low + min(max(share, 0.02), 0.98) * (high - low)
        found = advance(problem, a, middle, control)
        f = event(found)
        if f == 0:
            break
        if f * f_high > 0:
            high, f_high = middle, f
            f_low, side = (0.5 * f_low if side < 0 else f_low), -1
        else:
            low, f_low = middle, f
            f_high, side = (0.5 * f_high if side > 0 else f_high), 1
    return found


def fold(
    problem: Problem, branch: Branch, index: int, control: StepControl | None = None
) -> BranchPoint:
    """The fold between points `index` and `index + 1`."""
    a, b = branch.points[index : index + 2]
    return locate(problem, a, b, lambda point: point.tangent_p, control)


def save_branch(path: str | Path, branch: Branch) -> None:
    """Write a branch to a compressed numpy file."""
    points = branch.points
    np.savez_compressed(
        path,
        u=np.array([point.u for point in points]),
        p=branch.parameters,
        tangent_u=np.array([point.tangent_u for point in points]),
        tangent_p=np.array([point.tangent_p for point in points]),
        step=np.array([point.step for point in points]),
        iterations=np.array([point.iterations for point in points]),
        error=np.array([point.error for point in points]),
        ended=np.array(branch.ended),
    )


def load_branch(path: str | Path) -> Branch:
    """Read a branch; go on from ``branch.points[-1]``, with ``branch.points[-2]`` before it.

    Raises
    ------
    ContinuationError
        Where the file is not a saved branch.
    """
    names = ("u", "p", "tangent_u", "tangent_p", "step", "iterations", "error")
    try:
        with np.load(path) as file:
            columns = [file[name] for name in names]
            ended = str(file["ended"])
    except (OSError, KeyError, ValueError) as error:
        raise ContinuationError(f"{path} does not hold a saved branch: {error}") from error
    points = [
        BranchPoint(u, float(p), t_u, float(t_p), float(step), int(iterations), float(size))
        for u, p, t_u, t_p, step, iterations, size in zip(*columns, strict=True)
    ]
    return Branch(tuple(points), ended)


def crossings(points: Sequence[BranchPoint], p: float) -> list[tuple[Array, int]]:
    """Interpolated unknowns wherever a branch passes p, and the index of the point before."""
    found = []
    for i in range(len(points) - 1):
        a, b = points[i], points[i + 1]
        if (a.p <= p < b.p) or (b.p < p <= a.p) or (i == len(points) - 2 and b.p == p):
            share = (p - a.p) / (b.p - a.p) if b.p != a.p else 0.0
            found.append((a.u + share * (b.u - a.u), i))
    return found


def _growth(iterations: int, control: StepControl) -> float:
    return float(np.clip(control.good_iterations / max(iterations, 1), 0.5, 1.5))

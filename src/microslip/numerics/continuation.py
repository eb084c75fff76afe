"""Continuation of solution branches of ``F(u, p) = 0``: predictor, pseudo-arclength, step control.

Nothing here knows what u and p are. A `Problem` evaluates ``F`` at a point and solves linear systems with
its derivative; it also says how long a step in u and in p is, through the inner product

    <x, y> = sum(weight x_u y_u) + x_p y_p / parameter_scale²

A step goes along the unit tangent, then Newton's method corrects in the hyperplane across it,

    J a = -F,  J b = -F_p,   dp = -<t, x - x_predicted + (a, 0)> / <t, (b, 1)>,   du = a + dp b,

two solves with the same derivative ("block elimination"), so that a fold, where p turns round, is
nothing special. Derivatives may jump (friction, contact): tangents are only used to predict and to tell
directions. A corner sharper than a right angle in this metric has no point ahead of it, and ends a branch.
E. L. Allgower & K. Georg, Introduction to Numerical Continuation Methods (SIAM 2003).
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Protocol

import numpy as np

from microslip.brief import Brief
from microslip.errors import MicroslipError
from microslip.typing import Array


class ContinuationError(MicroslipError):
    """A point of a branch was not found."""


class Linearised(Protocol):
    """``F`` and its derivative at one point."""

    @property
    def F(self) -> Array:
        """Residual, (n,), in units in which the tolerance means something."""

    def solve(self, right: Array, tolerance: float) -> Array:
        """Solve ``J z = right`` to a relative residual; raises `ContinuationError`."""

    def by_parameter(self) -> Array:
        """``F_p``, (n,)."""


class Problem(Protocol):
    """Equations ``F(u, p) = 0`` with a metric."""

    @property
    def weight(self) -> Array:
        """Weight of each unknown in the inner product, (n,)."""

    @property
    def parameter_scale(self) -> float:
        """Change of p that counts as a step of length one."""

    def at(self, u: Array, p: float) -> Linearised:
        """Evaluate; raises `ContinuationError` where p has no meaning."""


@dataclass(frozen=True)
class StepControl:
    """How far to step, and when a point counts as found.

    Attributes
    ----------
    first, smallest, largest : float
        Length of a step.
    good_iterations : int
        Newton steps at which the length stays as it is; more shrink it, fewer let it grow.
    max_iterations : int
        Newton steps until a step is given up and halved.
    tolerance : float
        Largest entry of F at a point.
    max_points : int
    """

    first: float = 0.05
    smallest: float = 1e-5
    largest: float = 1.0
    good_iterations: int = 5
    max_iterations: int = 15
    tolerance: float = 1e-8
    max_points: int = 500


@dataclass(frozen=True, repr=False)
class BranchPoint(Brief):
    """A solution with the direction in which its branch goes on.

    Attributes
    ----------
    u : (n,) array
    p : float
    tangent_u : (n,) array
    tangent_p : float
        Unit tangent; ``tangent_p`` changes sign at a fold.
    step : float
        Length of the step to try next.
    iterations : int
        Newton steps it took.
    error : float
        Largest entry of F.
    """

    u: Array
    p: float
    tangent_u: Array
    tangent_p: float
    step: float
    iterations: int
    error: float


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


def inner(problem: Problem, u1: Array, p1: float, u2: Array, p2: float) -> float:
    """Inner product that lengths and angles are measured with."""
    return float(u1 @ (problem.weight * u2)) + p1 * p2 / problem.parameter_scale**2


def solve_at(
    problem: Problem, u: Array, p: float, control: StepControl
) -> tuple[Array, Linearised, int]:
    """Newton's method at fixed p: solution, its linearisation, Newton steps.

    Raises
    ------
    ContinuationError
    """
    x, _, equations, iterations = _newton(problem, u, p, control, None)
    return x, equations, iterations


def first_point(
    problem: Problem, u: Array, p: float, control: StepControl, direction: float = 1.0
) -> BranchPoint:
    """Solve at fixed p from the guess u; the branch goes towards larger p, or smaller.

    Raises
    ------
    ContinuationError
    """
    x, _, equations, iterations = _newton(problem, u, p, control, None)
    t_u, t_p = _tangent(problem, equations, np.zeros_like(x), direction)
    return BranchPoint(x, p, t_u, t_p, control.first, iterations, _size(equations))


def turned(point: BranchPoint) -> BranchPoint:
    """The same point on its branch in the other direction."""
    return replace(point, tangent_u=-point.tangent_u, tangent_p=-point.tangent_p)


def advance(
    problem: Problem, point: BranchPoint, length: float, control: StepControl
) -> BranchPoint:
    """The point of the branch a step of given length along the tangent.

    Raises
    ------
    ContinuationError
        Where Newton's method does not get there, or turns back.
    """
    u = point.u + length * point.tangent_u
    p = point.p + length * point.tangent_p
    across = (point.tangent_u, point.tangent_p)
    x, p, equations, iterations = _newton(problem, u, p, control, across)
    t_u, t_p = _tangent(problem, equations, *across)
    return BranchPoint(x, p, t_u, t_p, point.step, iterations, _size(equations))


def trace(
    problem: Problem,
    start: BranchPoint,
    bounds: tuple[float, float],
    control: StepControl | None = None,
    observe: Callable[[BranchPoint], bool] | None = None,
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
    """
    control = control or StepControl()
    points = [start]
    step = min(start.step, control.largest)
    while len(points) < control.max_points:
        here = points[-1]
        try:
            there = _within(problem, here, step, bounds, control)
        except ContinuationError as error:
            step *= 0.5
            if step < control.smallest:
                return Branch(tuple(points), f"failed: {error}")
            continue
        step = min(control.largest, step * _growth(there.iterations, control))
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
    """Read a branch; go on from ``branch.points[-1]``.

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


def _within(
    problem: Problem,
    here: BranchPoint,
    step: float,
    bounds: tuple[float, float],
    control: StepControl,
) -> BranchPoint:
    """Next point; a step across a bound ends on it."""
    there = advance(problem, here, step, control)
    low, high = bounds
    if low < there.p < high:
        return there
    bound = low if there.p <= low else high
    share = (bound - here.p) / (there.p - here.p)
    u = here.u + share * (there.u - here.u)
    x, p, equations, iterations = _newton(problem, u, bound, control, None)
    t_u, t_p = _tangent(problem, equations, there.tangent_u, there.tangent_p)
    return BranchPoint(x, p, t_u, t_p, there.step, iterations, _size(equations))


def _growth(iterations: int, control: StepControl) -> float:
    return float(np.clip(control.good_iterations / max(iterations, 1), 0.5, 1.5))


def _size(equations: Linearised) -> float:
    return float(np.abs(equations.F).max())


TANGENT_ACCURACY = 1e-6
STEP_ACCURACY = 1e-3


def _tangent(
    problem: Problem, equations: Linearised, old_u: Array, old_p: float
) -> tuple[Array, float]:
    """Unit tangent, on the side of the old one."""
    b = equations.solve(-equations.by_parameter(), TANGENT_ACCURACY)
    length = np.sqrt(inner(problem, b, 1.0, b, 1.0))
    side = np.sign(inner(problem, b, 1.0, old_u, old_p)) or 1.0
    return side * b / length, float(side / length)


def _newton(
    problem: Problem,
    u: Array,
    p: float,
    control: StepControl,
    across: tuple[Array, float] | None,
) -> tuple[Array, float, Linearised, int]:
    """Newton's method at fixed p, or in the hyperplane through (u, p) across a direction.

    Of the steps 1, 1/2, 1/4 ... the first that makes the residual smaller is taken.
    """
    equations = problem.at(u, p)
    for iteration in range(control.max_iterations + 1):
        error = _size(equations)
        if not np.isfinite(error):
            break
        if error <= control.tolerance:
            return u, p, equations, iteration
        if iteration == control.max_iterations:
            break
        du = equations.solve(-equations.F, STEP_ACCURACY)
        dp = 0.0
        if across is not None:
            b = equations.solve(-equations.by_parameter(), STEP_ACCURACY)
            dp = -inner(problem, du, 0.0, *across) / inner(problem, b, 1.0, *across)
            du = du + dp * b
        before = float(np.linalg.norm(equations.F))
        length = 1.0
        for _ in range(6):
            trial = problem.at(u + length * du, p + length * dp)
            if np.linalg.norm(trial.F) < (1 - 0.1 * length) * before:
                break
            length *= 0.5
        else:
            length *= 2.0
        u, p, equations = u + length * du, p + length * dp, trial
    raise ContinuationError(
        f"no point near p = {p:.6g}: residual {error:.1e} after {iteration} Newton steps"
    )

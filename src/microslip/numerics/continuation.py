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
point ahead of it, and ends a branch.
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


def advance(
    problem: Problem,
    point: BranchPoint,
    length: float,
    control: StepControl,
    before: BranchPoint | None = None,
) -> BranchPoint:
    """The point of the branch a step of given length along the tangent.

    With the point before it, the tangent is taken to turn on as it has turned from there.

    Raises
    ------
    ContinuationError
        Where Newton's method does not get there, or turns back.
    """
    u = point.u + length * point.tangent_u
    p = point.p + length * point.tangent_p
    across = (point.tangent_u, point.tangent_p)
    if before is not None:
        bend_u, bend_p = _bend(problem, before, point, length)
        u, p = u + bend_u, p + bend_p
    x, p, equations, iterations, b = newton(problem, u, p, control, across)
    t_u, t_p = unit_tangent(problem, equations, *across, b)
    return BranchPoint(x, p, t_u, t_p, point.step, iterations, size(equations))


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
    while len(points) < control.max_points:
        here = points[-1]
        try:
            back = before if trusted else None
            there = _onto(problem, back, here, step, ahead, control)
            there = there or _within(problem, back, here, step, bounds, control)
        except ContinuationError as error:
            step, trusted = 0.5 * step, False
            if step < control.smallest:
                return Branch(tuple(points), f"failed: {error}")
            continue
        before, trusted = here, True
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


def _within(
    problem: Problem,
    before: BranchPoint | None,
    here: BranchPoint,
    step: float,
    bounds: tuple[float, float],
    control: StepControl,
) -> BranchPoint:
    """Next point; a step across a bound ends on it."""
    there = advance(problem, here, step, control, before)
    low, high = bounds
    if low < there.p < high:
        return there
    bound = low if there.p <= low else high
    way = there.u - here.u, there.p - here.p
    if inner(problem, *way, *way) > (FAR * step) ** 2 and way[1] * here.tangent_p < 0:
        raise ContinuationError(f"no point ahead of p = {here.p:.6g}: the step ended behind it")
    share = (bound - here.p) / (there.p - here.p)
    u = here.u + share * (there.u - here.u)
    return _land(problem, there, u, bound, control)


BENT = 1.0
"""Angle of a step beyond which its predictor is straight, rad: a corner, or a tight fold."""


def _bend(
    problem: Problem, before: BranchPoint, here: BranchPoint, length: float
) -> tuple[Array | float, float]:
    """How far a step leaves its tangent where that turns on as it has turned from the point before."""
    turn, turn_p = here.tangent_u - before.tangent_u, here.tangent_p - before.tangent_p
    way = inner(problem, here.u - before.u, here.p - before.p, here.tangent_u, here.tangent_p)
    angle = np.sqrt(inner(problem, turn, turn_p, turn, turn_p))
    if not (way > 0 and angle * length <= BENT * way):
        return 0.0, 0.0
    share = 0.5 * length**2 / way
    return share * turn, share * turn_p


def _bend_at(problem: Problem, before: BranchPoint, here: BranchPoint, p: float) -> Array | float:
    """The same of u over p, at a given p."""
    if before.tangent_p * here.tangent_p <= 0 or (p - here.p) * (here.p - before.p) <= 0:
        return 0.0
    slope = here.tangent_u / here.tangent_p
    turn = 0.5 * (slope - before.tangent_u / before.tangent_p)
    share = (p - here.p) / (here.p - before.p)
    size = inner(problem, slope, 0.0, slope, 0.0)
    if share**2 * inner(problem, turn, 0.0, turn, 0.0) > (0.5 * BENT) ** 2 * size:
        return 0.0
    return (p - here.p) * share * turn


STEEP = 0.3
"""Share of a step in p, squared, below which a branch is too steep to be solved at given p."""

FAR = 2.0
"""A step out of the range, against its tangent, that is so much longer than its length has jumped."""

ASIDE = 0.5
"""A point at given p is on another branch where it is so much farther away than predicted."""


def _onto(
    problem: Problem,
    before: BranchPoint | None,
    here: BranchPoint,
    step: float,
    stops: Array,
    control: StepControl,
) -> BranchPoint | None:
    """The point on the first stop that a step would pass; None where there is none, or not found."""
    end = here.p + step * here.tangent_p
    between = stops[(stops > min(here.p, end)) & (stops < max(here.p, end))]
    if len(between) == 0 or (here.tangent_p / problem.parameter_scale) ** 2 < STEEP:
        return None
    p = float(between[np.argmin(np.abs(between - here.p))])
    length = (p - here.p) / here.tangent_p
    straight = here.u + length * here.tangent_u
    bend = 0.0 if before is None else _bend_at(problem, before, here, p)
    try:
        there = _land(problem, here, straight + bend, p, control)
    except ContinuationError:
        return None
    aside = there.u - straight
    turns = inner(problem, there.tangent_u, there.tangent_p, here.tangent_u, here.tangent_p)
    if inner(problem, aside, 0.0, aside, 0.0) > (ASIDE * length) ** 2 or turns <= 0:
        return None
    return there


def _land(
    problem: Problem, beside: BranchPoint, u: Array, p: float, control: StepControl
) -> BranchPoint:
    """The point at a given p, in the direction of a point beside it."""
    x, _, equations, iterations, _ = newton(problem, u, p, control, None)
    guess = beside.tangent_u / beside.tangent_p if beside.tangent_p else None
    t_u, t_p = unit_tangent(problem, equations, beside.tangent_u, beside.tangent_p, guess)
    return BranchPoint(x, p, t_u, t_p, beside.step, iterations, size(equations))


def _growth(iterations: int, control: StepControl) -> float:
    return float(np.clip(control.good_iterations / max(iterations, 1), 0.5, 1.5))

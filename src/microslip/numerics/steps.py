"""Steps along a solution branch: along its tangent, onto a value of p, across a bound, around a corner.

Where a derivative jumps (friction, contact) a branch has a corner. One that is sharper than a right angle in
the metric of `newton.Problem` has no point ahead of it: in the hyperplane there Newton's method goes to and
fro between the equations on both sides. The branch goes on all the same, along the tangent t_2 of the
equations beyond, which are those a little ahead of the corner: not on the side where ``<t, t_2> > 0``, on
which there is no point, but on the other.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from itertools import pairwise

import numpy as np

from microslip.brief import Brief
from microslip.numerics.newton import (
    ContinuationError,
    Problem,
    StepControl,
    inner,
    newton,
    size,
    unit_tangent,
)
from microslip.typing import Array


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


def step_within(
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


def step_onto(
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


PROBES = (4.0, 32.0, 256.0, 2048.0)
"""Smallest steps ahead at which the equations beyond a corner are looked for."""

SAME = 1e-3
"""Angle between two tangents up to which there is no corner, rad."""

SHORTER, ASTRAY = 0.25, 0.5
"""Factor by which a step beyond a corner is shortened where it does not succeed. It may leave its tangent by
an angle of so much, rad, and by so many times the angle between it and the way back."""


def around_corner(
    problem: Problem, here: BranchPoint, control: StepControl
) -> tuple[BranchPoint, BranchPoint] | None:
    """The corner that a branch has come to, with the direction in which it goes on, and the next point there.

    None where the equations ahead are the same, or there is no point either.
    """
    for probe in PROBES:
        ahead = probe * control.smallest
        try:
            beyond = problem.at(here.u + ahead * here.tangent_u, here.p + ahead * here.tangent_p)
            t_u, t_p = unit_tangent(problem, beyond, here.tangent_u, here.tangent_p, None)
        except ContinuationError:
            continue
        if _angle(problem, (t_u, t_p), (here.tangent_u, here.tangent_p)) < SAME:
            continue
        length = control.first
        while length >= control.smallest:
            corner = replace(here, tangent_u=-t_u, tangent_p=-t_p, step=length)
            there = _beyond(problem, here, corner, control)
            if there is not None:
                return corner, there
            length *= SHORTER
    return None


def _beyond(
    problem: Problem, here: BranchPoint, corner: BranchPoint, control: StepControl
) -> BranchPoint | None:
    """The next point beyond a corner; None where there is none, or it is one of the branch that led to it."""
    try:
        there = advance(problem, corner, corner.step, control)
    except ContinuationError:
        return None
    way = there.u - here.u, there.p - here.p
    astray = _angle(problem, way, (corner.tangent_u, corner.tangent_p))
    back = _angle(problem, way, (-here.tangent_u, -here.tangent_p))
    return there if astray < ASTRAY * min(1.0, back) else None


def goes_back(problem: Problem, points: Sequence[BranchPoint], there: BranchPoint) -> bool:
    """Whether a branch that has turned a corner goes back along points before, all but the last two."""
    ahead = there.tangent_u, there.tangent_p
    for a, b in pairwise(points[:-2]):
        way = b.u - a.u, b.p - a.p
        square = inner(problem, *way, *way)
        share = inner(problem, there.u - a.u, there.p - a.p, *way) / square
        if not 0 <= share <= 1:
            continue
        off = there.u - a.u - share * way[0], there.p - a.p - share * way[1]
        # as far as a way that bends between the two is off a straight one
        bent = SAME + _angle(problem, (a.tangent_u, a.tangent_p), (b.tangent_u, b.tangent_p))
        if inner(problem, *off, *off) > (0.25 * bent) ** 2 * square:
            continue
        if _angle(problem, ahead, (-way[0], -way[1])) <= bent:
            return True
    return False


def _angle(problem: Problem, one: tuple[Array, float], other: tuple[Array, float]) -> float:
    """Between two directions, rad, small ones to rounding of their own."""

    def unit(way: tuple[Array, float]) -> tuple[Array, float]:
        size = float(np.sqrt(inner(problem, *way, *way)))
        return way[0] / size, way[1] / size

    (a_u, a_p), (b_u, b_p) = unit(one), unit(other)
    apart = a_u - b_u, a_p - b_p
    return 2 * float(np.arcsin(min(0.5 * np.sqrt(inner(problem, *apart, *apart)), 1.0)))

"""The whole branch through a point that lies inside the range of p, also where it is closed."""

from __future__ import annotations

from collections.abc import Callable

from microslip.numerics.continuation import Branch, BranchPoint, trace, turned
from microslip.numerics.newton import Problem, StepControl, inner

BACK = 2.0
"""A branch has come back where it is nearer to its start than so many of its steps."""


def trace_through(
    problem: Problem,
    start: BranchPoint,
    bounds: tuple[float, float],
    control: StepControl,
    observe: Callable[[BranchPoint], bool] | None = None,
) -> tuple[Branch, int]:
    """Follow a branch from a point in both directions, or once round where it is closed.

    Returns the branch, in the direction of the start's tangent, and the place of the start on it. A
    closed branch ends, ``"closed"``, where it has come back to its start.

    Parameters
    ----------
    problem, start, bounds, control, observe
        As of `microslip.numerics.continuation.trace`.
    """
    last, closed = start, False

    def look(point: BranchPoint) -> bool:
        nonlocal last, closed
        passed = last is not start and (last.p - start.p) * (point.p - start.p) <= 0
        last, closed = point, passed and _has_come_back(problem, point, start)
        return closed or (observe is not None and observe(point))

    ahead = trace(problem, start, bounds, control, look)
    if closed:
        return Branch(ahead.points, "closed"), 0
    if ahead.ended == "stopped":
        return ahead, 0
    behind = trace(problem, turned(start), bounds, control, observe)
    back = tuple(turned(point) for point in behind.points[:0:-1])
    ended = ahead.ended if ahead.ended != "range" else behind.ended
    return Branch((*back, *ahead.points), ended), len(back)


def _has_come_back(problem: Problem, point: BranchPoint, start: BranchPoint) -> bool:
    """Whether a branch is at its start again, in the direction in which it left."""
    away = point.u - start.u
    distance = inner(problem, away, point.p - start.p, away, point.p - start.p)
    along = inner(problem, point.tangent_u, point.tangent_p, start.tangent_u, start.tangent_p)
    return along > 0 and distance <= (BACK * point.step) ** 2

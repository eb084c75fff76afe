"""Whole branches through a point inside the range: closed ones, and such that leave it."""

from __future__ import annotations

import numpy as np
import pytest
from test_continuation import Circle, Duffing

from microslip.numerics.continuation import StepControl, first_point
from microslip.numerics.through import trace_through

CONTROL = StepControl(first=0.02, largest=0.2, tolerance=1e-11)


def test_closed_branch_once_round():
    """A circle that the range contains: every angle once, both folds, back at the start."""
    problem = Circle()
    start = first_point(problem, np.array([0.9]), 0.3, CONTROL)
    branch, place = trace_through(problem, start, (-2.0, 2.0), CONTROL)
    assert branch.ended == "closed"
    assert place == 0
    angle = np.unwrap([np.arctan2(point.u[0], point.p) for point in branch.points])
    turn = np.ptp(angle)
    print(f"{len(branch.points)} points, {np.degrees(turn):.1f} degrees")
    assert 2 * np.pi - 0.4 < turn < 2 * np.pi + 0.4
    assert (np.sign(np.diff(angle)) == np.sign(angle[1] - angle[0])).all()
    assert len(branch.folds) == 2


def test_open_branch_both_ways():
    """From the middle of Duffing's response to both ends of the range, in one direction."""
    problem = Duffing()
    start = first_point(problem, np.zeros(2), 0.8, CONTROL)
    branch, place = trace_through(problem, start, (0.5, 3.0), CONTROL)
    assert branch.ended == "range"
    assert branch.points[place] is start
    assert branch.points[0].p == 0.5
    assert branch.points[-1].p == 3.0
    assert branch.points[0].tangent_p > 0
    for point in branch.points[:: len(branch.points) // 7]:
        size = np.hypot(*point.u)
        assert point.p**2 == pytest.approx(
            min(problem.frequencies(size), key=lambda w: abs(w - point.p**2)), rel=1e-6
        )


def test_stops_where_it_is_told():
    problem = Circle()
    start = first_point(problem, np.array([0.9]), 0.3, CONTROL)
    branch, place = trace_through(problem, start, (-2.0, 2.0), CONTROL, lambda point: point.p > 0.5)
    assert branch.ended == "stopped"
    assert place == 0

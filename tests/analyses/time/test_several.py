"""Steady states from several starts: which are found, and which are one."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from microslip.analyses.time.point import Request
from microslip.analyses.time.points import solve_request
from microslip.analyses.time.several import SAME, coexisting_states, distinct
from microslip.errors import Failure

STEPS = 150
FOLD = 7.28e-4
"""Moment over P L under which the response has three states between 170.4 and 171 Hz."""


def request(reference, frequency, ratio, guess=0j, **options):
    return Request(0.8, frequency, ratio * reference.moment, None, guess, STEPS, **options)


@pytest.fixture(scope="module")
def point(small_reference):
    frequency = small_reference.joint.mode.sliding_frequency + 3
    return solve_request(small_reference.joint, request(small_reference, frequency, 1e-4))


def changed(point, factor, **options):
    steady = replace(point.steady, amplitude=factor * point.steady.amplitude)
    return replace(point, steady=steady, **options)


def test_states_that_agree_are_one(point):
    """Up to a thousandth, and up to what both leave open; phase counts as size does."""
    near, far = changed(point, 1 + 0.9 * SAME, pasts=("rest",)), changed(point, 1 + 2 * SAME)
    first = replace(point, error=0.0)
    (one,) = distinct([first, replace(near, error=0.0)])
    assert one.steady is first.steady
    assert one.pasts == (*first.pasts, "rest")
    assert len(distinct([first, replace(far, error=0.0)])) == 2
    assert len(distinct([first, replace(far, error=1.1 * SAME)])) == 1
    assert len(distinct([first, replace(changed(point, np.exp(0.01j)), error=0.0)])) == 2


def test_states_in_other_steps_are_one_by_what_these_leave_open(point):
    """Of two that were sought on that is what their last steps have changed, not all that was changed."""
    few = replace(point, error=0.0, steps_error=np.nan)
    more = changed(few, 1.01, steps=4 * STEPS, steps_error=0.015, steps_change=0.015)
    most = replace(few, steps=16 * STEPS, steps_error=1e-4, steps_change=0.03)
    other = changed(more, 1.025 / 1.01)
    assert len(distinct([more, most])) == 1
    assert len(distinct([other, most])) == 2
    assert len(distinct([changed(few, 1.029), most])) == 1
    assert len(distinct([changed(few, 1.04), most])) == 2


def test_a_failure_stands_where_nothing_is_settled(point):
    failure = Failure("time", "here", "no")
    unsettled = replace(point, steady=replace(point.steady, converged=False))
    assert distinct([failure, point]) == [point]
    assert distinct([failure, unsettled]) == [failure]
    assert distinct([unsettled, failure]) == [unsettled]


def test_unstable_ones_come_last(point):
    """Where nothing is settled, after the motion that left them; beside a settled one they are the same."""
    unsettled = replace(point, steady=replace(point.steady, converged=False))
    growing = replace(
        point.stability, values=1.1 * point.stability.values / point.stability.largest
    )
    unstable = changed(point, 2.0, stability=growing)
    assert unstable.verdict == "unstable"
    left = replace(unsettled, left=unstable)
    assert distinct([left]) == [left, unstable]
    assert [p.verdict for p in distinct([unstable, point])] == ["stable", "unstable"]
    assert distinct([replace(point, stability=growing), point]) == [point]


def test_both_branches_of_a_fold(small_reference):
    """From rest the lower branch, from a large guess the upper one; from above whence it came."""
    guess = 0.13 * np.exp(-2.4j)
    asked = [request(small_reference, f, FOLD, guess) for f in (170.5, 170.75)]
    found = list(coexisting_states(small_reference.joint, asked, ("raised", "reduced", "above")))
    for states in found:
        stable = [p for p in states if p.verdict == "stable"]
        lower, upper = states[0], max(stable, key=lambda p: abs(p.steady.amplitude))
        print([(abs(p.steady.amplitude), p.verdict, p.pasts) for p in states])
        assert lower.pasts[0] == "raised"
        assert "reduced" in upper.pasts
        assert lower.verdict == "stable"
        assert abs(upper.steady.amplitude) > 5 * abs(lower.steady.amplitude)
    # only the lower frequency has one above it, whose state from rest is on the lower branch
    assert any("above" in p.pasts for p in found[0])
    assert not any("above" in p.pasts for p in found[1])


def test_one_start_is_one_answer(small_reference, point):
    frequency = point.steady.frequency
    asked = [request(small_reference, frequency, 1e-4)]
    ((raised,),) = coexisting_states(small_reference.joint, asked)
    assert raised.pasts == ("raised",)
    assert raised.steady.phase == 0
    # other pasts are other tractions, to a ten-thousandth or so
    assert raised.steady.amplitude == pytest.approx(point.steady.amplitude, rel=SAME)

"""More harmonics by way of neighbours on the branch."""

from __future__ import annotations

import numpy as np
import pytest

from microslip.analyses.harmonic.adaptive import Adaptive, Ladder
from microslip.analyses.harmonic.alongside import Place, followed
from microslip.analyses.harmonic.paths import CONTROL, FrequencyPath
from microslip.analyses.harmonic.points import distance
from microslip.analyses.harmonic.problem import harmonic_problem
from microslip.analyses.harmonic.raising import follow_frequency, raise_load
from microslip.numerics.continuation import (
    Branch,
    BranchPoint,
    ContinuationError,
    crossings,
    solve_at,
)

FREQUENCY = 174.0
LOAD = 2.4e-4
"""Moment over P L: pairs that stick, slip and separate."""


def branch_of(parameters):
    """Points at given frequencies; the rest of them does not matter."""
    nothing = np.zeros(1)
    return Branch(tuple(BranchPoint(nothing, p, nothing, 1.0, 0.1, 1, 0.0) for p in parameters), "")


@pytest.mark.parametrize(
    ("parameters", "index", "frequency", "expected"),
    [
        (range(20), 9, 9.5, [6.0, 13.0, 2.0, 17.0, 0.0, 19.0]),
        ([1, 2, 3, 4, 3.5, 3, 2, 1], 2, 3.8, [1.0, 4.0]),
        ([1, 2, 3, 4, 3.5, 3, 2, 1], 3, 3.8, [4.0, 1.0]),
        ([1, 2, 3], 1, 2.0, [1.0, 3.0]),
    ],
)
def test_neighbours_are_farther_and_farther_away_up_to_a_fold(
    parameters, index, frequency, expected
):
    place = Place(None, branch_of([float(p) for p in parameters]), index, frequency)
    assert [point.p for point in place.neighbours()] == expected


def test_a_branch_that_is_followed_leads_to_the_answer_there(small_reference):
    """That of Newton's method from the load raised at the other frequency."""
    load = LOAD * small_reference.moment
    problem = harmonic_problem(small_reference.joint, harmonics=9)
    path = FrequencyPath(problem, load)
    here, there = (raise_load(problem, f, load)[0] for f in (186.0, 184.0))
    w, _, _ = solve_at(path, followed(path, here, 186.0, 184.0), 184.0, CONTROL)
    cut = np.prod(problem.shape)
    assert np.abs(w - there)[:cut].max() < 1e-6 * problem.force_scale


def test_a_branch_that_turns_round_before_says_where(small_reference):
    """The lower branch of the reference joint, which folds at 172.7 Hz (`test_harmonic.py`)."""
    load = 3 * LOAD * small_reference.moment
    problem = harmonic_problem(small_reference.joint)
    path = FrequencyPath(problem, load)
    w, _ = raise_load(problem, 170.0, load)
    with pytest.raises(ContinuationError, match="turns round at 17"):
        followed(path, w, 170.0, 176.0)


def test_where_newton_finds_none_the_branch_does(small_reference, monkeypatch):
    """The same response as from the frequency itself, within what both say they are off by."""
    load = LOAD * small_reference.moment
    problem = harmonic_problem(small_reference.joint)
    path, branch = follow_frequency(problem, load, (190.0, 170.0))
    [(guess, index)] = crossings(branch.points, FREQUENCY)
    ladder = Ladder(path, CONTROL, Adaptive(tolerance=1e-9, most=13))
    few = ladder.least(problem, guess, FREQUENCY)
    plain = ladder.grown(few)
    monkeypatch.setattr(Ladder, "_next", lambda *_: None)
    assert ladder.grown(few).harmonics == few.harmonics
    found = ladder.grown(few, Place(path, branch, index, FREQUENCY))
    assert found.harmonics == plain.harmonics == 13
    assert found.residual <= 1e-8
    assert distance(found.amplitude, plain.amplitude) <= found.error + plain.error

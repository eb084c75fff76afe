"""By way of rounded contact laws: back to the same answer, and to those that Newton's method finds."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from test_spatial_harmonic import block, solved

from microslip.analyses.harmonic import rounded as rounded_module
from microslip.analyses.harmonic.adaptive import Adaptive, Ladder
from microslip.analyses.harmonic.answers import Answers
from microslip.analyses.harmonic.over_time import OverTime
from microslip.analyses.harmonic.paths import ACCEPTED, CONTROL, FrequencyPath
from microslip.analyses.harmonic.points import distance
from microslip.analyses.harmonic.problem import harmonic_problem, softened, with_harmonics
from microslip.analyses.harmonic.response import frequency_response
from microslip.analyses.harmonic.rounded import CHANGED, SHARP, RoundedPath, sharpened
from microslip.analyses.harmonic.starts import start_from_point
from microslip.numerics.continuation import ContinuationError

FREQUENCY, LOAD = 174.0, 2.4e-4
"""Hz, and moment over P L: pairs that stick, slip and separate."""


@pytest.fixture(scope="module")
def load(small_reference):
    return LOAD * small_reference.moment


@pytest.fixture(scope="module")
def few(small_reference, load):
    """An answer with five harmonics."""
    problem = harmonic_problem(small_reference.joint, harmonics=5)
    return frequency_response(problem, load, [160.0, FREQUENCY]).points[-1]


@pytest.fixture(scope="module")
def answers(few, load):
    return Answers(FrequencyPath(few.problem, load), CONTROL)


@pytest.fixture(scope="module")
def known(answers, few):
    return answers.rounded(few)


def test_rounding_changes_the_amplitude_as_far_as_asked(answers, few, known):
    way = RoundedPath(answers.path(few.problem), few.frequency, known.unit)
    assert distance(way.amplitude(known.w), few.amplitude) >= CHANGED
    assert known.p > SHARP


def test_derivative_over_the_rounding_by_differences(answers, few, known):
    way, step = RoundedPath(answers.path(few.problem), few.frequency, known.unit), 1e-5
    ahead, behind = (way.at(known.w, known.p + side * step).F for side in (1, -1))
    slope = (ahead - behind) / (2 * step)
    size = np.abs(slope).max()
    assert way.at(known.w, known.p).by_parameter() == pytest.approx(slope, abs=1e-3 * size)


def test_there_and_back_is_the_same_answer(answers, few, known):
    found = answers.from_rounded(few.problem, known, few.frequency, 0.0)
    assert found.residual <= ACCEPTED
    assert found.amplitude == pytest.approx(few.amplitude, rel=1e-7)
    assert found.r == pytest.approx(few.r, abs=1e-6 * few.problem.force_scale)


@pytest.mark.parametrize("factor", [1.0, 0.1])
def test_more_harmonics_are_those_of_newtons_method(load, answers, few, known, factor):
    """With an augmentation of their own, on which the rounding does not depend."""
    new = softened(with_harmonics(few.problem, 13), factor)
    newton = Answers(FrequencyPath(new, load), CONTROL).from_start(
        start_from_point(new, few), few.frequency, 0.0
    )
    found = answers.from_rounded(new, known, few.frequency, 0.0)
    assert distance(few.amplitude, newton.amplitude) > 1e-4
    assert found.amplitude == pytest.approx(newton.amplitude, rel=1e-7)


def test_levels_without_newtons_method_are_found(small_reference, few, load, monkeypatch):
    """With no start from which it gets there: as near to the motion over time as it states."""
    for way in ("_next", "_alongside", "_by_modes", "_next_by_steps", "_leap"):
        monkeypatch.setattr(Ladder, way, lambda *_: None)
    over_time = OverTime(small_reference.joint, load)
    path = FrequencyPath(few.problem, load)
    ladder = Ladder(path, CONTROL, Adaptive(tolerance=1e-4, most=17), over_time)
    found = ladder.grown(few)
    beside = over_time.beside(few)
    assert beside is not None
    before, after = (distance(each.amplitude, beside.steady.amplitude) for each in (few, found))
    print(f"H = {found.harmonics}: {after:.1e}, stated {found.error:.1e}, five {before:.1e}")
    assert found.harmonics == 17
    assert found.residual <= ACCEPTED
    assert after < before
    assert after <= found.error


def test_a_way_that_does_not_arrive_says_how_far_it_got(answers, few, known, monkeypatch):
    monkeypatch.setattr(rounded_module, "STEPS", replace(rounded_module.STEPS, max_points=2))
    path = answers.path(with_harmonics(few.problem, 9))
    with pytest.raises(ContinuationError, match="of the force scale"):
        sharpened(path, known, few.frequency)


def test_spatial_pairs_are_not_rounded():
    point = solved(block(), 0.22, 1.5, 3)
    answers = Answers(FrequencyPath(point.problem, 1.5), CONTROL)
    with pytest.raises(ContinuationError, match="spatial pairs"):
        answers.rounded(point)

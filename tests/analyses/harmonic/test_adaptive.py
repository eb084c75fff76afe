"""Harmonics by an estimated error, starts whose contact states are known, branches from time integration."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from microslip.analyses.harmonic.adaptive import Adaptive, Ladder
from microslip.analyses.harmonic.levels import estimated_error, more_harmonics
from microslip.analyses.harmonic.over_time import OverTime, state_from_point
from microslip.analyses.harmonic.paths import CONTROL, FrequencyPath
from microslip.analyses.harmonic.points import describe, distance
from microslip.analyses.harmonic.problem import (
    harmonic_problem,
    padded,
    softened,
    with_harmonics,
)
from microslip.analyses.harmonic.raising import raise_load
from microslip.analyses.harmonic.response import frequency_response
from microslip.analyses.harmonic.starts import (
    first_step,
    start_from_cycle,
    start_from_point,
)
from microslip.analyses.time.scheme import time_scheme
from microslip.analyses.time.steady import steady_state
from microslip.numerics.continuation import StepControl, solve_at

FREQUENCY = 174.0
LOAD = 2.4e-4
"""Moment over P L: pairs that stick, slip and separate."""


@pytest.fixture(scope="module")
def load(small_reference):
    return LOAD * small_reference.moment


@pytest.fixture(scope="module")
def few(small_reference, load):
    """The response with five harmonics, from the raised load."""
    problem = harmonic_problem(small_reference.joint)
    path = FrequencyPath(problem, load)
    w, _ = raise_load(problem, FREQUENCY, load)
    return describe(path.at(w, FREQUENCY), 0, 0.0)


@pytest.fixture(scope="module")
def steady(small_reference, load):
    scheme = time_scheme(small_reference.joint, 1 / (FREQUENCY * 300), frequency=FREQUENCY)
    found = steady_state(scheme, FREQUENCY, load)
    assert found.converged
    return found


def test_a_cycle_over_time_leads_to_the_same_response(few, steady, load):
    """In a few steps of Newton's method, the first of which is nearly the last."""
    start = start_from_cycle(few.problem, steady)
    assert np.abs(start.problem.held - few.problem.held).max() > 0  # where its pairs stick
    start = replace(start, problem=replace(start.problem, held=few.problem.held))
    path = FrequencyPath(start.problem, load)
    w = first_step(path, start, FREQUENCY)
    guessed, stepped = (np.abs(path.at(each, FREQUENCY).F).max() for each in (start.w, w))
    _, equations, iterations = solve_at(path, w, FREQUENCY, CONTROL)
    point = describe(equations, iterations, 0.0)
    print(f"residual {guessed:.1e}, after the first step {stepped:.1e}, {iterations} more")
    assert stepped < 0.1 * guessed
    assert iterations <= 6
    assert point.amplitude == pytest.approx(few.amplitude, rel=1e-7)


def test_more_harmonics_from_known_states(few, load):
    """Nearer to the answer than the old unknowns padded with zeros."""
    more = with_harmonics(few.problem, 13)
    path = FrequencyPath(more, load)
    start = start_from_point(more, few)
    w = first_step(path, start, FREQUENCY)
    solution, _, _ = solve_at(path, w, FREQUENCY, CONTROL)
    zeros = padded(few.problem, more, few.w)
    near, far = (np.linalg.norm(each - solution) for each in (w, zeros))
    print(f"{near / far:.2e} of the distance")
    assert near < 0.3 * far


def test_a_response_is_a_steady_state_over_time(small_reference, few, load):
    """Integrated from its state: hardly a transient, next to one from rest; no step is dissipative."""
    ladder = Ladder(FrequencyPath(few.problem, load), CONTROL, Adaptive(tolerance=1e-3))
    point = ladder.solve(few.problem, few.w, FREQUENCY)
    scheme = time_scheme(small_reference.joint, 1 / (FREQUENCY * 300), frequency=FREQUENCY)
    found = steady_state(scheme, FREQUENCY, load, start=state_from_point(scheme, point))
    rest = steady_state(scheme, FREQUENCY, load)
    print(f"first change {found.history[0]:.1e}, from rest {rest.history[0]:.1e}")
    assert found.converged
    assert found.history[0] < 0.02 * rest.history[0]
    assert found.cycles < rest.cycles
    error = abs(point.amplitude / found.amplitude - 1)
    print(f"H = {point.harmonics}: {error:.1e}, stated {point.error:.1e}")
    assert error < 3e-3


def test_a_motion_found_again_is_not_climbed_from_again(small_reference, few, load, monkeypatch):
    over_time = OverTime(small_reference.joint, load)
    ladder = Ladder(FrequencyPath(few.problem, load), CONTROL, Adaptive(1e-6, most=9), over_time)
    grown = ladder.grown(few)
    motion = over_time.beside(few)
    assert motion is not None

    def climbed(*_):
        raise AssertionError

    monkeypatch.setattr(Ladder, "_one_by_one", climbed)
    _, found = ladder.solve_from_cycle(motion.steady)
    assert found is grown
    scaled = replace(motion.steady, amplitude=1.01 * motion.steady.amplitude)
    assert not motion.same_as(replace(motion, steady=scaled))
    assert not motion.same_as(replace(motion, steady=replace(motion.steady, frequency=1.0)))


def test_estimate_of_powers():
    """Errors that fall like any power from 1.5 on are below the estimate; and the tail counts."""
    levels = [5]
    while levels[-1] < 60:
        levels.append(more_harmonics(levels[-1]))
    for power in (1.5, 2.0, 3.0):
        answers = [(H, 1 + (0.03 + 0.01j) * H**-power) for H in levels]
        for count in range(2, len(levels)):
            error = distance(answers[count - 1][1], 1.0)
            estimate = estimated_error(answers[:count])
            assert 0.99 * error <= estimate <= 10 * error
    assert np.isnan(estimated_error(answers[:1], 0.5))
    assert estimated_error(answers, 0.5) == 0.05


@pytest.mark.validate
def test_estimate_against_many_harmonics(small_reference):
    """At least 95 % of estimates are above the difference from 41 harmonics; two loads, both flanks."""
    joint = small_reference.joint
    held, total = 0, 0
    for scale in (0.5, 2.0):
        load = scale * LOAD * small_reference.moment
        problem = harmonic_problem(joint)
        for frequency in (168.0, 172.0, 186.0):
            w, _ = raise_load(problem, frequency, load)
            ladder = Ladder(FrequencyPath(problem, load), CONTROL, Adaptive(tolerance=1e-9))
            point = ladder.solve(problem, w, frequency)
            assert point.harmonics == 41
            for H in (5, 9, 13, 17, 21):
                one = Ladder(FrequencyPath(problem, load), CONTROL, Adaptive(1e-9, most=H))
                answer = one.solve(problem, w, frequency)
                if H > 5:
                    error = abs(answer.amplitude / point.amplitude - 1)
                    held += error <= answer.error
                    total += 1
    print(f"{held} of {total}")
    assert held >= 0.95 * total


def test_a_lost_branch_is_found_from_time_integration(small_reference, load):
    """What a branch of too few points does not reach, and the answer that a long one has there."""
    joint = small_reference.joint
    problem = harmonic_problem(joint, harmonics=3)
    short = StepControl(first=0.02, largest=0.1, max_points=25, tolerance=CONTROL.tolerance)
    wanted = [165.0, 165.5, 177.0, 189.0]
    whole = frequency_response(problem, 0.1 * load, wanted)
    found = frequency_response(
        problem, 0.1 * load, wanted, control=short, over_time=OverTime(joint, 0.1 * load)
    )
    assert not found.failures
    assert len(found.branches) == len(found.problems) == 3
    amplitudes = {point.frequency: point.amplitude for point in found.points}
    for point in whole.points:
        assert amplitudes[point.frequency] == pytest.approx(point.amplitude, rel=1e-6)


def test_softer_augmentation_of_a_pair_that_is_its_own_image(small_reference):
    """Its odd harmonics vanish whatever the augmentation: the unit of their equation goes with it."""
    problem = harmonic_problem(small_reference.joint)
    other = softened(problem, 0.3)
    own = np.flatnonzero(np.repeat(problem.image == problem.pairs, 2))
    assert len(own) == 2
    assert other.residual[1][own, own] == pytest.approx(1 / other.stiffness[own])
    assert (other.residual[0] == problem.residual[0]).all()
    assert softened(problem, 1.0) is problem
    assert (
        replace(other, residual=problem.residual, stiffness=problem.stiffness).size == problem.size
    )

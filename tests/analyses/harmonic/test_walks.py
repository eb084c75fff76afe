"""Responses of joints whose bodies walk past each other: where these stand, and what is said of it."""

from __future__ import annotations

import tomllib
from dataclasses import replace

import numpy as np
import pytest
from walking_joints import WEAKLY_DAMPED, better_held, marched_alone

import microslip
from microslip.analyses.harmonic.adaptive import Adaptive, Ladder
from microslip.analyses.harmonic.over_time import OWN, OverTime
from microslip.analyses.harmonic.paths import CONTROL, FrequencyPath
from microslip.analyses.harmonic.points import describe, distance
from microslip.analyses.harmonic.problem import harmonic_problem
from microslip.analyses.harmonic.raising import raise_load
from microslip.analyses.harmonic.starts import start_from_cycle, start_from_point
from microslip.analyses.time import resting
from microslip.analyses.time.scheme import time_scheme
from microslip.analyses.time.steady import raised_state, steady_state
from microslip.contact.pairs import mean_slip, tangential, tangential_vectors
from microslip.pipeline.targets import STEPS

FREQUENCY, LOAD = 466.48, 2.3224


@pytest.fixture(scope="module")
def ladder():
    """From five harmonics on, beside time integration."""
    joint = microslip.prepare(microslip.parse_joint(tomllib.loads(WEAKLY_DAMPED)))
    path = FrequencyPath(harmonic_problem(joint), LOAD)
    return Ladder(path, CONTROL, Adaptive(), OverTime(joint, LOAD))


@pytest.fixture(scope="module")
def clamped(ladder):
    """The response that walks from where the clamp has put the bodies."""
    w, _ = raise_load(ladder.base.problem, FREQUENCY, LOAD)
    return ladder.least(ladder.base.problem, w, FREQUENCY)


@pytest.fixture(scope="module")
def grown(ladder, clamped):
    return ladder.grown(clamped)


@pytest.fixture(scope="module")
def alone():
    """Sizes over 4000 cycles marched alone from rest, and the mean offset of the bodies at their ends."""
    return marched_alone(WEAKLY_DAMPED, FREQUENCY, LOAD)


def test_harmonics_are_grown_where_marching_alone_leads(grown, clamped, alone):
    size, offset = alone
    here = size[-40:].mean()
    assert clamped.walks
    assert not clamped.problem.offset.any()
    assert abs(abs(clamped.amplitude) / here - 1) > 0.01, "the walk tells"
    assert abs(abs(grown.amplitude) / here - 1) <= grown.error + 1e-3
    assert grown.error <= Adaptive().tolerance
    assert grown.walked == pytest.approx(abs(offset[-1]), rel=0.02)


def test_the_walk_is_that_of_a_march(grown, clamped, alone):
    """The speeds at both of its ends, by the means of a hundred cycles."""
    _, offset = alone
    early, late = ((offset[b] - offset[a]) / 100 for a, b in ((100, 200), (-101, -1)))
    assert clamped.walk == pytest.approx(early, rel=0.1)
    assert grown.walk == pytest.approx(late, rel=0.1)


def test_standing_elsewhere_is_an_error(ladder, clamped, grown):
    """Also where an amplitude is right by chance."""
    beside = ladder.over_time.beside(clamped)
    assert beside.walked == pytest.approx(grown.walked, rel=0.1)
    assert beside.elsewhere(grown) <= OWN < 0.01 < beside.elsewhere(clamped)
    right = replace(clamped, amplitude=beside.steady.amplitude)
    assert beside.error_of(right) > 0.01
    assert beside.error_of(clamped) >= distance(clamped.amplitude, grown.amplitude)


def test_bodies_stand_as_they_did_with_other_harmonics(ladder, grown):
    """In starts from the response, and in its state over time."""
    start = start_from_point(harmonic_problem(ladder.over_time.joint, harmonics=9), grown)
    np.testing.assert_array_equal(start.problem.offset, grown.problem.offset)
    path = FrequencyPath(start.problem, LOAD)
    again = describe(path.at(start.w, FREQUENCY), 0, 0.0)
    assert again.walked == pytest.approx(grown.walked, rel=1e-3)
    beside = ladder.over_time.beside(grown)
    from_cycle = start_from_cycle(ladder.base.problem, beside.steady)
    mean = tangential_vectors(beside.steady.cycle.v[:-1].mean(axis=0), 2).mean()
    start = ladder.base.problem.prestress.solution.v
    place = from_cycle.problem.rigid_spread @ from_cycle.problem.offset
    assert tangential_vectors(place, 2).mean() == pytest.approx(
        mean - tangential_vectors(start, 2).mean(), rel=0.05
    )


def test_pairs_that_never_slip_stick_where_the_bodies_have_taken_them(ladder, clamped):
    """As far on as the mean slip of the cycle that a start is made of."""
    steady = ladder.over_time.beside(clamped).steady
    start = start_from_cycle(ladder.base.problem, steady).problem
    clamp = ladder.base.problem.prestress.solution.v
    moved = mean_slip(steady.cycle.v[:-1].mean(axis=0) - clamp, 2)
    assert abs(moved[0]) > 1e-4
    way = start.held[:, 0] - tangential(clamp)[start.pairs]
    np.testing.assert_allclose(way, moved[0], rtol=0.05)


def test_pairs_that_stick_all_through_a_cycle_are_held_there(small_reference):
    """Those of a small load: where they are at any time of the cycle."""
    joint, load = small_reference.joint, 1e-4 * small_reference.moment
    scheme = time_scheme(joint, 1 / (182.0 * STEPS), frequency=182.0)
    raised = raised_state(scheme, 182.0, load, 10)
    steady = steady_state(scheme, 182.0, load, start=raised, tolerance=1e-7)
    problem = start_from_cycle(harmonic_problem(joint), steady).problem
    slip = tangential(steady.cycle.v)[:, problem.pairs]
    still = np.ptp(slip, axis=0) <= 1e-9 * np.abs(slip).max()
    assert 0 < still.sum() < len(still)
    np.testing.assert_allclose(
        problem.held[still, 0], slip[7, still], atol=1e-9 * np.abs(slip).max()
    )


def test_outputs_count_from_where_the_clamp_has_put_the_bodies(grown, clamped):
    """Their means differ by what the bodies have moved on, also those of the ports."""
    moved = np.abs(grown.output[0] - clamped.output[0]).max()
    assert moved > 1e-6
    assert np.abs(clamped.output[0]).max() < 0.1 * moved


def test_where_no_motion_stays_beside_a_walk_its_error_is_not_known(ladder, clamped, monkeypatch):
    """Levels alone would state less than the walk changes."""
    monkeypatch.setattr(OverTime, "beside", lambda *_: None)
    assert np.isnan(ladder.grown(clamped).error)
    levels = Ladder(ladder.base, CONTROL, Adaptive()).grown(clamped)
    assert levels.error < 0.01


@pytest.mark.validate
@pytest.mark.parametrize("times", [8.0, 12.0])
def test_it_is_where_marching_alone_leads_though_the_walk_keeps_searches_from_settling(times):
    """A better held joint changes faster; what searches have moved its bodies by counts as walked."""
    described = better_held(times)
    joint = microslip.prepare(microslip.parse_joint(tomllib.loads(described)))
    path = FrequencyPath(harmonic_problem(joint), LOAD)
    w, _ = raise_load(path.problem, FREQUENCY, LOAD)
    ladder = Ladder(path, CONTROL, Adaptive(), OverTime(joint, LOAD))
    grown = ladder.grown(ladder.least(path.problem, w, FREQUENCY))
    size, offset = marched_alone(described, FREQUENCY, LOAD)
    here = size[-40:].mean()
    assert abs(here / size[200] - 1) > 0.05, "the walk tells"
    assert abs(abs(grown.amplitude) / here - 1) <= grown.error + 1e-3
    assert grown.error <= Adaptive().tolerance
    assert grown.walked == pytest.approx(abs(offset[-1]), rel=0.02)


def test_a_walk_whose_end_is_not_found_states_no_error(ladder, clamped, monkeypatch):
    monkeypatch.setattr(resting, "come_to_rest", lambda *_, **__: None)
    assert ladder.over_time.beside(clamped) is None
    assert np.isnan(ladder.grown(clamped).error)


def test_asking_again_keeps_how_far_the_motion_has_walked(small_reference):
    joint, load = small_reference.joint, 1e-4 * small_reference.moment
    path = FrequencyPath(harmonic_problem(joint), load)
    w, _ = raise_load(path.problem, 182.0, load)
    point = Ladder(path, CONTROL, None).least(path.problem, w, 182.0)
    over_time = OverTime(joint, load)
    known = replace(over_time.beside(point), walked=1e-6, changed=0.01)
    again = over_time.again(point, known)
    assert again.steady is not known.steady
    assert (again.walked, again.changed) == (1e-6, 0.01)

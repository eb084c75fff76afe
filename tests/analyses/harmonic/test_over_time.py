"""Time integration beside a response: what an amplitude is off by, and where there is none."""

from __future__ import annotations

from dataclasses import replace
from itertools import pairwise

import numpy as np
import pytest

from microslip.analyses.harmonic import over_time as over_time_module
from microslip.analyses.harmonic.adaptive import UNMEASURED, Adaptive, Ladder
from microslip.analyses.harmonic.over_time import OverTime, own_error, state_from_point
from microslip.analyses.harmonic.paths import CONTROL, FrequencyPath
from microslip.analyses.harmonic.points import describe, distance
from microslip.analyses.harmonic.problem import harmonic_problem, state_equations
from microslip.analyses.harmonic.raising import raise_load
from microslip.analyses.harmonic.response import frequency_response
from microslip.analyses.time.scheme import time_scheme
from microslip.analyses.time.steady import steady_state
from microslip.numerics.continuation import solve_at

LOAD = 2.4e-4
"""Moment over P L: pairs that stick, slip and separate."""


def settled(joint, frequency, load, steps):
    scheme = time_scheme(joint, 1 / (frequency * steps), frequency=frequency)
    found = steady_state(scheme, frequency, load, tolerance=1e-6)
    assert found.converged
    return found


def test_measured_errors_hold(small_reference):
    """Against time integration from rest with other steps; few harmonics suffice where that says so."""
    joint, load = small_reference.joint, LOAD * small_reference.moment
    problem = harmonic_problem(joint)
    for frequency in (170.0, 174.0, 184.0):
        w, _ = raise_load(problem, frequency, load)
        ladder = Ladder(
            FrequencyPath(problem, load), CONTROL, Adaptive(tolerance=2e-3), OverTime(joint, load)
        )
        point = ladder.solve(problem, w, frequency)
        truth = settled(joint, frequency, load, 1000)
        error = abs(abs(point.amplitude) / abs(truth.amplitude) - 1)
        print(f"{frequency} Hz, H = {point.harmonics}: {error:.1e}, stated {point.error:.1e}")
        assert error <= point.error <= 2e-3


def test_own_error_of_time_integration(small_reference):
    """What is made of the difference from half as many steps is above the difference from the limit."""
    joint, load = small_reference.joint, LOAD * small_reference.moment
    amplitudes = [settled(joint, 174.0, load, steps).amplitude for steps in (150, 300, 600, 2400)]
    limit = amplitudes[-1]
    changes = [np.inf]
    for coarse, fine in pairwise(amplitudes[:3]):
        changes.append(distance(fine, coarse))
        assert distance(fine, limit) <= own_error(changes)


@pytest.mark.parametrize("order", [1, 2, 3])
def test_own_error_of_powers(order):
    """Of any order from the first on; amplitudes that differ by a tenth are each other's unit to a tenth."""
    amplitudes = [1 + 0.1 * 2.0 ** (-order * k) for k in range(4)]
    changes = [np.inf]
    for coarse, fine in pairwise(amplitudes):
        changes.append(distance(fine, coarse))
        assert abs(fine - 1) / fine <= 1.1 * own_error(changes)


def test_a_motion_that_leaves_is_no_measure(small_reference):
    """From a state that is not a solution at all: far from the motion that it settles in."""
    joint, load = small_reference.joint, LOAD * small_reference.moment
    problem = harmonic_problem(joint)
    path = FrequencyPath(problem, load)
    w, _ = raise_load(problem, 174.0, load)
    _, equations, _ = solve_at(path, w, 174.0, CONTROL)
    point = describe(equations, 0, 0.0)
    over_time = OverTime(joint, load)
    assert over_time.beside(point) is not None
    assert over_time.beside(replace(point, amplitude=1.5 * point.amplitude)) is None


def few_harmonics(joint, load, frequency):
    """The response with five harmonics, and the ladder from it."""
    problem = harmonic_problem(joint)
    path = FrequencyPath(problem, load)
    w, _ = raise_load(problem, frequency, load)
    return describe(path.at(w, frequency), 0, 0.0), path


def test_a_slow_motion_has_more_cycles(small_reference, monkeypatch):
    """One that is near but not settled when the first cycles are over is that from rest in the end."""
    joint, load = small_reference.joint, LOAD * small_reference.moment
    point, _ = few_harmonics(joint, load, 174.0)
    truth = settled(joint, 174.0, load, 1000)
    monkeypatch.setattr(over_time_module, "CYCLES_BESIDE", 1)
    found = OverTime(joint, load).beside(point)
    assert found is not None
    assert distance(found.steady.amplitude, truth.amplitude) <= found.own + 1e-4
    monkeypatch.setattr(over_time_module, "CYCLES_MORE", 0)
    assert OverTime(joint, load).beside(point) is None


def test_a_stated_error_holds_beside_the_motion_from_its_own_state(small_reference):
    """Not only beside that from the state with the fewest harmonics."""
    joint, load = small_reference.joint, LOAD * small_reference.moment
    point, path = few_harmonics(joint, load, 170.0)
    over_time = OverTime(joint, load)
    grown = Ladder(path, CONTROL, Adaptive(tolerance=2e-3), over_time).grown(point)
    assert grown.harmonics > point.harmonics
    steps = 500
    scheme = time_scheme(joint, 1 / (170.0 * steps), frequency=170.0)
    own = steady_state(scheme, 170.0, load, start=state_from_point(scheme, grown))
    assert own.converged
    assert distance(grown.amplitude, own.amplitude) <= grown.error <= 2e-3


def test_a_measure_that_is_too_kind_is_put_right(small_reference, monkeypatch):
    """Were the first motion that of nine harmonics, these would seem perfect; their own state says no."""
    joint, load = small_reference.joint, LOAD * small_reference.moment
    point, path = few_harmonics(joint, load, 170.0)
    nine = Ladder(path, CONTROL, Adaptive(1e-9, most=9)).grown(point)
    truth = settled(joint, 170.0, load, 1000)
    off = distance(nine.amplitude, truth.amplitude)
    right = OverTime(joint, load).beside(point)
    kind = replace(right, steady=replace(right.steady, amplitude=nine.amplitude), own=0.1 * off)
    monkeypatch.setattr(OverTime, "beside", lambda *_: kind)
    found = Ladder(path, CONTROL, Adaptive(0.5 * off), OverTime(joint, load)).grown(point)
    print(f"nine harmonics are off by {off:.1e}; {found.harmonics} state {found.error:.1e}")
    assert found.harmonics > 9
    assert distance(found.amplitude, truth.amplitude) <= found.error + right.own


def test_own_error_where_other_tractions_lock_in(small_reference, monkeypatch):
    """By half as many steps from the finer motion, where a change from coarse ones says more than that.

    Above the difference from four times the steps that stay with it, below what the change says.
    """
    joint, load = small_reference.joint, LOAD * small_reference.moment
    point, _ = few_harmonics(joint, load, 174.0)
    monkeypatch.setattr(over_time_module, "FEWEST", 300)
    monkeypatch.setattr(over_time_module, "MOST_STEPS", 600)
    settles = OverTime._settled

    def locked_in(self, frequency, near, steps, start, more):
        """The first motion is one of another amplitude, as if it had locked in other tractions."""
        found, lingers = settles(self, frequency, near, steps, start, more)
        monkeypatch.setattr(OverTime, "_settled", settles)
        return replace(found, amplitude=1.01 * found.amplitude), lingers

    monkeypatch.setattr(OverTime, "_settled", locked_in)
    found = OverTime(joint, load).beside(point)
    scheme = time_scheme(joint, 1 / (174.0 * 2400), frequency=174.0)
    fine = steady_state(scheme, 174.0, load, start=found.steady.end, tolerance=1e-6)
    off = distance(found.steady.amplitude, fine.amplitude)
    print(f"off by {off:.1e}, stated {found.own:.1e}")
    assert off <= found.own < own_error([np.inf, 0.01])


def test_what_another_past_makes_of_a_motion_is_in_the_stated_error(small_reference, monkeypatch):
    """Half as many steps from the response's own state, as if they had locked in other tractions."""
    joint, load = small_reference.joint, LOAD * small_reference.moment
    point, _ = few_harmonics(joint, load, 174.0)
    over_time = OverTime(joint, load)
    known = over_time.again(point, over_time.beside(point))
    without = known.error_of(point)
    # as they are, these differ by what twice the steps change: no more than what is known already
    assert over_time.with_pasts(point, known).error_of(point) == pytest.approx(without)
    settles = OverTime._settled

    def locked_in(self, frequency, near, steps, start, more):
        found, lingers = settles(self, frequency, near, steps, start, more)
        if steps < known.steady.steps:
            found = replace(found, amplitude=1.004 * found.amplitude)
        return found, lingers

    monkeypatch.setattr(OverTime, "_settled", locked_in)
    scattered = over_time.with_pasts(point, known)
    assert scattered.error_of(point) - without + known.own == pytest.approx(0.004, abs=known.own)
    assert not scattered.tells(1.003 * known.steady.amplitude)


def test_what_other_pasts_make_of_all_motions_leaves_no_answer_good_enough(
    small_reference, monkeypatch
):
    """Where it is more than the tolerance: the ladder says so, and does not look for what cannot be told."""
    joint, load = small_reference.joint, LOAD * small_reference.moment
    point, path = few_harmonics(joint, load, 170.0)
    monkeypatch.setattr(OverTime, "with_pasts", lambda _, point, known: replace(known, pasts=0.004))
    ladder = Ladder(path, CONTROL, Adaptive(2e-3), OverTime(joint, load))
    found = ladder.grown(point)
    monkeypatch.undo()
    usual = Ladder(path, CONTROL, Adaptive(2e-3), OverTime(joint, load)).grown(point)
    assert usual.error <= 2e-3 < 0.004 <= found.error <= 0.006
    assert found.harmonics <= UNMEASURED


def test_answers_are_asked_to_be_better_than_allowed(small_reference):
    """One that states a little less than the tolerance is grown from."""
    joint, load = small_reference.joint, LOAD * small_reference.moment
    point, path = few_harmonics(joint, load, 170.0)
    one = Ladder(path, CONTROL, Adaptive(1.0), OverTime(joint, load)).grown(point)
    for share, grows in ((1.05, True), (1.3, False)):
        ladder = Ladder(path, CONTROL, Adaptive(share * one.error), OverTime(joint, load))
        found = ladder.grown(point)
        assert (found.harmonics > one.harmonics) == grows
        assert found.error <= share * one.error


def test_many_harmonics_stand_beside_the_motion_from_their_own_state(small_reference, monkeypatch):
    """Where that of few has other tractions locked in, and no answer is near it."""
    joint, load = small_reference.joint, LOAD * small_reference.moment
    point, path = few_harmonics(joint, load, 170.0)
    right = OverTime(joint, load).beside(point)
    elsewhere = replace(right.steady, amplitude=1.02 * right.steady.amplitude)
    monkeypatch.setattr(OverTime, "beside", lambda *_: replace(right, steady=elsewhere))
    found = Ladder(path, CONTROL, Adaptive(2e-3, most=21), OverTime(joint, load)).grown(point)
    truth = settled(joint, 170.0, load, 1000)
    off = distance(found.amplitude, truth.amplitude)
    print(f"{found.harmonics} harmonics are off by {off:.1e}, stated {found.error:.1e}")
    assert off <= found.error <= 2e-3


def test_motions_are_looked_for_beside_the_most_harmonics_too(small_reference, monkeypatch):
    """Where few harmonics are too far off for one; then the best of all answers is the response."""
    joint, load = small_reference.joint, LOAD * small_reference.moment
    point, path = few_harmonics(joint, load, 170.0)
    beside, asked, motions = OverTime.beside, [], []

    def near_only(self, answer):
        asked.append(answer.harmonics)
        motions.append(beside(self, answer) if answer.harmonics > 13 else None)
        return motions[-1]

    monkeypatch.setattr(OverTime, "beside", near_only)
    found = Ladder(path, CONTROL, Adaptive(1e-9, most=21), OverTime(joint, load)).grown(point)
    assert asked == [5, 13, 21]
    monkeypatch.undo()
    truth = settled(joint, 170.0, load, 1000)
    assert distance(found.amplitude, truth.amplitude) <= found.error <= 2e-3
    for most in (5, 9, 13, 17, 21):
        answer = Ladder(path, CONTROL, Adaptive(1e-9, most=most)).grown(point)
        assert answer.harmonics == most
        off = distance(answer.amplitude, truth.amplitude)
        print(f"{most} harmonics are off by {off:.1e}; {found.harmonics} state {found.error:.1e}")
        assert found.error <= off + 2 * motions[-1].own


def test_many_harmonics_only_where_their_error_is_measured(small_reference):
    """Without time integration an estimate is not worth more than `UNMEASURED`."""
    joint, load = small_reference.joint, 0.1 * LOAD * small_reference.moment
    point, path = few_harmonics(joint, load, 174.0)
    assert Ladder(path, CONTROL, Adaptive(tolerance=1e-12)).grown(point).harmonics == UNMEASURED


def test_another_unit_of_time_takes_the_same_steps(small_reference):
    """Everything vibrates twice as fast with a quarter of the mass: as many points, the same reactions."""
    joint, load = small_reference.joint, LOAD * small_reference.moment
    model, start = joint.model, joint.prestress
    alpha, beta = model.rayleigh
    light = replace(
        model,
        omega=2 * model.omega,
        mode_v=2 * model.mode_v,
        port_modes=2 * model.port_modes,
        rayleigh=(2 * alpha, beta / 2),
    )
    problem = harmonic_problem(joint, harmonics=3)
    other = state_equations(
        light,
        replace(start, solution=replace(start.solution, q=start.solution.q / 2)),
        joint.law,
        problem.port,
        problem.coordinate,
        harmonics=3,
    )
    one = frequency_response(problem, load, [165.0, 170.0, 180.0])
    two = frequency_response(other, load, [330.0, 340.0, 360.0])
    assert [len(b.points) for b in one.branches] == [len(b.points) for b in two.branches]
    for a, b in zip(one.points, two.points, strict=True):
        assert b.amplitude == pytest.approx(a.amplitude, rel=1e-7)

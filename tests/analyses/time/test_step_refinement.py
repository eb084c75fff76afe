"""Steady states sought on with more steps, against the same motions with many more."""

import tomllib
from dataclasses import replace

import numpy as np
import pytest
from conftest import FRICTION
from walking_joints import better_held

import microslip
from microslip.analyses.time import step_refinement
from microslip.analyses.time.deviations import StateSpace
from microslip.analyses.time.point import Request
from microslip.analyses.time.points import solve_request
from microslip.analyses.time.scheme import time_scheme
from microslip.analyses.time.several import SAME, distinct
from microslip.analyses.time.steady import linearised_state, steady_state
from microslip.analyses.time.step_refinement import REFINEMENT, with_finer_steps
from microslip.errors import ContactError
from microslip.pipeline.prepare import assemble
from microslip.pipeline.time import STEPS_ERROR, stepping

FEW, MANY = 150, 9600
LEFT_OPEN = 3e-5
"""What searches to 1e-5 leave open, of the first harmonic."""


def request_of(reference, frequency, ratio, steps=FEW, refinement=REFINEMENT):
    return Request(
        float("nan"),
        frequency,
        ratio * reference.moment,
        FRICTION,
        0j,
        steps,
        past="raised",
        refinement=refinement,
    )


def limit(joint, request, found):
    """First harmonic of the motion that was found, with so many steps that they no longer matter."""
    scheme = time_scheme(joint, 1 / (request.frequency * MANY), frequency=request.frequency)
    options = {"start": found.steady.end, "tolerance": 2e-6}
    steady = steady_state(scheme, request.frequency, request.load, **options)
    assert steady.converged
    return steady.amplitude


@pytest.mark.parametrize(("above", "ratio"), [(5.5, 1e-4), (3.0, 1.5e-4), (0.5, 3e-4)])
def test_what_is_left_of_the_error_of_the_steps_is_at_most_what_is_said(
    small_reference, above, ratio
):
    joint = small_reference.joint
    request = request_of(small_reference, joint.mode.sliding_frequency + above, ratio)
    coarse = solve_request(joint, replace(request, refinement=1))
    found = solve_request(joint, request)
    assert np.isnan(coarse.steps_error)
    assert found.settled
    assert found.steps == REFINEMENT * FEW
    true = limit(joint, request, found)
    before = abs(coarse.steady.amplitude / true - 1)
    left = abs(found.steady.amplitude / true - 1)
    print(
        f"{before:.1e} with {FEW} steps, {left:.1e} with {found.steps}, {found.steps_error:.1e} said"
    )
    assert left < 0.5 * before
    assert left < found.steps_error + LEFT_OPEN


def test_linear_motions_have_no_error_of_the_steps(small_reference):
    """Where everything sticks: poles and the dynamic stiffness at the load are matched."""
    joint = small_reference.joint
    request = request_of(small_reference, joint.mode.stuck_frequency - 2, 1e-8)
    found = solve_request(joint, request)
    assert found.settled
    assert found.steps_error < LEFT_OPEN


def test_samples_are_those_asked_for_and_the_search_is_counted(small_reference):
    joint = small_reference.joint
    request = request_of(small_reference, joint.mode.sliding_frequency + 2, 1.5e-4)
    coarse = solve_request(joint, replace(request, refinement=1))
    found = solve_request(joint, request)
    assert len(found.steady.cycle.time) == FEW + 1
    assert found.steady.cycles > coarse.steady.cycles
    assert found.steady.seconds > 0
    assert found.verdict == coarse.verdict == "stable"
    assert 0 < found.error < 1e-3


def test_a_search_that_knows_the_derivative_ends_in_the_same_state(small_reference, monkeypatch):
    """And marches no deviations, which is most of the cost of one that does not."""
    joint, load = small_reference.joint, 1.5e-4 * small_reference.moment
    frequency = joint.mode.sliding_frequency + 2
    coarse = time_scheme(joint, 1 / (frequency * FEW), frequency=frequency)
    begin, known = linearised_state(coarse, frequency, load)
    fine = time_scheme(joint, 1 / (frequency * 4 * FEW), frequency=frequency)
    options = {"start": begin.end, "halves": begin.halved}
    plain = steady_state(fine, frequency, load, **options)

    def marched(*_):
        pytest.fail("deviations are marched")

    monkeypatch.setattr(StateSpace, "deviations", marched)
    found, _ = linearised_state(fine, frequency, load, known=known, **options)
    assert found.converged
    assert found.amplitude == pytest.approx(plain.amplitude, rel=LEFT_OPEN)


def test_a_wrong_derivative_is_left_for_deviations(small_reference):
    """One of quite another motion, and with its sign turned: the search comes to the same end."""
    joint, moment = small_reference.joint, small_reference.moment
    frequency = joint.mode.sliding_frequency + 2
    scheme = time_scheme(joint, 1 / (frequency * FEW), frequency=frequency)
    begin, known = linearised_state(scheme, frequency, 1.5e-4 * moment)
    known.images = -known.images
    load = 2e-4 * moment
    plain = steady_state(scheme, frequency, load, start=begin.end)
    found, _ = linearised_state(
        scheme, frequency, load, start=begin.end, known=known, halves=begin.halved
    )
    assert found.converged
    assert found.amplitude == pytest.approx(plain.amplitude, rel=1e-4)


def test_a_walking_joint_keeps_its_place():
    """A dozen cycles with finer steps move bodies on by no hundredth of what 4000 cycles have."""
    joint = microslip.prepare(microslip.parse_joint(tomllib.loads(better_held(8.0))))
    request = Request(1.0, 466.48, 2.3224, None, 0j, past="raised", refinement=REFINEMENT)
    coarse = solve_request(joint, replace(request, refinement=1))
    found = solve_request(joint, request)
    assert coarse.walked > 0
    assert found.walked == coarse.walked
    moved = np.median(found.steady.cycle.v[0, 1::2] - coarse.steady.cycle.v[0, 1::2])
    assert abs(moved) < 0.01 * abs(coarse.walked)
    assert np.isfinite(found.steps_error)


def test_where_finer_steps_do_not_settle_their_error_is_not_known(small_reference, monkeypatch):
    joint = small_reference.joint
    request = request_of(small_reference, joint.mode.sliding_frequency + 2, 1.5e-4)
    coarse = solve_request(joint, replace(request, refinement=1))
    monkeypatch.setattr(step_refinement, "PATIENCE", 1)
    found = solve_request(joint, request)
    assert found.steps == FEW
    assert np.isnan(found.steps_error)
    assert found.steady.amplitude == coarse.steady.amplitude
    (caution,) = stepping([found], FEW)
    assert f"with more than {FEW} per cycle none settles within" in caution.reason
    assert caution.remedy == f"take steps = {2 * FEW} or more"
    assert caution.where == f"{request.frequency:.6g} Hz"

    def unsolved(*_, **__):
        raise ContactError("contact not solved")

    monkeypatch.setattr(step_refinement, "linearised_state", unsolved)
    assert np.isnan(with_finer_steps(joint, request, coarse).steps_error)


def calls_of(monkeypatch, failing):
    """Steps per cycle that motions are sought on with; where these are given, that fails."""
    truly = step_refinement.linearised_state
    tried = []

    def sought(scheme, frequency, *arguments, **options):
        steps = round(1 / (frequency * scheme.dt))
        tried.append(steps)
        if steps in failing:
            raise ContactError(f"contact not solved in {steps}")
        return truly(scheme, frequency, *arguments, **options)

    monkeypatch.setattr(step_refinement, "linearised_state", sought)
    return tried


def test_steps_that_change_a_motion_are_multiplied_again(small_reference, monkeypatch):
    """What is said is what the last have changed, less than the first have."""
    joint = small_reference.joint
    request = request_of(small_reference, joint.mode.sliding_frequency + 0.5, 3e-4, steps=40)
    coarse = solve_request(joint, replace(request, refinement=1))
    monkeypatch.setattr(step_refinement, "LITTLE", 1.0)
    once = with_finer_steps(joint, request, coarse)
    monkeypatch.undo()
    tried = calls_of(monkeypatch, ())
    found = with_finer_steps(joint, request, coarse)
    assert once.steps == 320
    assert once.steps_error > step_refinement.LITTLE
    assert tried == [320, 640]
    assert found.steps == 640
    assert len(found.steady.cycle.time) == 41
    assert found.steady.cycles > once.steady.cycles
    true = limit(joint, request, found)
    errors = [abs(one.steady.amplitude / true - 1) for one in (coarse, once, found)]
    print(", ".join(f"{e:.1e}" for e in errors), f"{found.steps_error:.1e} said")
    assert errors[2] < 0.5 * errors[1]
    assert errors[1] < errors[0]
    assert errors[2] < found.steps_error + LEFT_OPEN
    before = coarse.steady.amplitude
    moved = abs(found.steady.amplitude - before) / abs(found.steady.amplitude)
    assert found.steps_change == pytest.approx(moved)


def test_where_one_number_of_steps_fails_another_may_not(small_reference, monkeypatch):
    joint = small_reference.joint
    request = request_of(small_reference, joint.mode.sliding_frequency + 0.5, 3e-4, steps=40)
    coarse = solve_request(joint, replace(request, refinement=1))
    tried = calls_of(monkeypatch, (320,))
    found = with_finer_steps(joint, request, coarse)
    assert tried == [320, 640, 1280]
    assert found.steps == 1280
    assert found.unrefined == ""
    assert found.steps_error < found.steps_change
    monkeypatch.undo()
    tried = calls_of(monkeypatch, (640,))
    kept = with_finer_steps(joint, request, coarse)
    assert tried == [320, 640]
    assert kept.steps == 320
    assert kept.steps_error > step_refinement.LITTLE
    monkeypatch.undo()
    tried = calls_of(monkeypatch, (320, 640))
    left = with_finer_steps(joint, request, coarse)
    assert tried == [320, 640]
    assert left.steady.cycle is coarse.steady.cycle
    assert left.unrefined == "contact not solved in 320"


def test_there_are_thirty_two_times_the_steps_at_most(small_reference, monkeypatch):
    """Also where the search has needed more than those asked for; then twice as many tell."""
    joint = small_reference.joint
    request = request_of(small_reference, joint.mode.sliding_frequency + 0.5, 3e-4, steps=40)
    monkeypatch.setattr(step_refinement, "LITTLE", 0.0)
    monkeypatch.setattr(step_refinement, "OPEN", 0.0)
    for needed, expected in ((160, [320, 640, 1280]), (640, [1280]), (1280, [2560])):
        found = solve_request(joint, replace(request, steps=needed, refinement=1))
        tried = calls_of(monkeypatch, ())
        with_finer_steps(joint, request, found)
        assert tried == expected


def test_steps_that_matter_are_named(small_reference):
    """Twenty to a cycle and up to 160, of Newmark's method: the caution names the worst and a remedy."""
    joint = small_reference.joint
    frequencies = joint.mode.sliding_frequency + np.array([1.0, 4.0])
    asked = [request_of(small_reference, f, 1.5e-4, steps=20, refinement=2) for f in frequencies]
    points = [solve_request(joint, replace(request, matched=False)) for request in asked]
    errors = [point.steps_error for point in points]
    assert max(errors) > STEPS_ERROR
    (caution,) = stepping(points, 20)
    assert caution.where == f"{frequencies[int(np.argmax(errors))]:.6g} Hz"
    assert f"{100 * max(errors):.2g} %" in caution.reason
    assert caution.remedy == "take steps = 40 or more"


def test_a_motion_that_more_steps_move_far_is_judged_again(small_reference, monkeypatch):
    """Its stability is that of the motion with more steps; one that is not stable is not put in its place."""
    joint = small_reference.joint
    request = request_of(small_reference, joint.mode.sliding_frequency + 2, 1.5e-4)
    coarse = solve_request(joint, replace(request, refinement=1))
    monkeypatch.setattr(step_refinement, "FARTHER", 0.0)
    found = with_finer_steps(joint, request, coarse)
    assert found.stability is not coarse.stability
    assert found.stability.largest == pytest.approx(coarse.stability.largest, rel=0.02)
    truly = step_refinement.stability_of

    def unstable(*arguments, **options):
        found = truly(*arguments, **options)
        return replace(
            found, values=found.values * 1.5 / found.largest, residual=0 * found.residual
        )

    monkeypatch.setattr(step_refinement, "stability_of", unstable)
    left = with_finer_steps(joint, request, coarse)
    assert left.steps == FEW
    assert np.isnan(left.steps_error)
    assert left.unrefined == "the one beside it is unstable"


def test_what_opens_the_joint_with_more_steps_is_not_put_in_its_place(small_reference, monkeypatch):
    joint = small_reference.joint
    request = request_of(small_reference, joint.mode.sliding_frequency + 2, 1.5e-4)
    coarse = solve_request(joint, replace(request, refinement=1))
    monkeypatch.setattr(step_refinement, "opening_of", lambda *_: "it opens")
    left = with_finer_steps(joint, request, coarse)
    assert left.steady.cycle is coarse.steady.cycle
    assert "opens the joint" in stepping_reason(left)


def stepping_reason(point):
    (caution,) = stepping([point], FEW)
    return caution.reason


LIGHT = 2e-10
"""Damping over stiffness, s: transients last for 100,000 cycles."""


def test_lightly_damped_motions_are_settled_as_closely_as_before():
    """A linear joint at its resonance: more steps change nothing, but a search to 1e-5 leaves 1e-3 open.

    Under a tenth of this load the motion is so small beside the preload that rounding keeps one of eight from
    settling, whatever the order of the sums.
    """
    described = microslip.reference_joint(pairs=31)
    damping = described.damping.model_copy(update={"beta": LIGHT})
    assembly = assemble(described.model_copy(update={"damping": damping}))
    joint, moment = assembly.prepared, assembly.moment_unit
    frequency = joint.mode.stuck_frequency - 0.02
    request = Request(1.0, frequency, 1e-7 * moment, None, 0j, past="raised", refinement=REFINEMENT)
    coarse = solve_request(joint, replace(request, refinement=1))
    found = solve_request(joint, request)
    print(f"{coarse.error:.1e} and {found.error:.1e}, {found.steps_error:.1e} of the steps")
    assert coarse.settled
    assert coarse.error < 1e-3
    assert np.isfinite(found.steps_error)
    assert found.error < 1e-3
    apart = abs(found.steady.amplitude / coarse.steady.amplitude - 1)
    assert apart < 1e-3


def test_what_is_open_of_the_place_stays_open():
    """What more steps settle more closely is not where bodies that walk have come to."""
    joint = microslip.prepare(microslip.parse_joint(tomllib.loads(better_held(8.0))))
    request = Request(1.0, 466.48, 2.3224, None, 0j, past="raised", refinement=REFINEMENT)
    coarse = solve_request(joint, replace(request, refinement=1))
    found = with_finer_steps(joint, request, coarse)
    assert coarse.place_error > 0
    assert found.steps > coarse.steps
    assert found.error >= coarse.place_error


def test_one_state_in_other_steps_is_not_two(small_reference):
    joint = small_reference.joint
    request = request_of(small_reference, joint.mode.sliding_frequency + 2, 1.5e-4, steps=20)
    coarse = solve_request(joint, replace(request, refinement=1))
    found = solve_request(joint, request)
    apart = abs(found.steady.amplitude / coarse.steady.amplitude - 1)
    assert apart > SAME
    assert len(distinct([found, coarse])) == 1
    assert len(distinct([replace(found, steps=coarse.steps), coarse])) == 2, "by its steps alone"


def test_motions_found_with_more_steps_are_sought_on_with_twice_these(small_reference):
    joint = small_reference.joint
    request = request_of(small_reference, joint.mode.sliding_frequency + 2, 1.5e-4)
    finer = solve_request(joint, replace(request, steps=4 * FEW, refinement=1))
    found = with_finer_steps(joint, request, finer)
    assert found.steps == 8 * FEW
    assert len(found.steady.cycle.time) == FEW + 1
    true = limit(joint, request, found)
    assert abs(found.steady.amplitude / true - 1) < found.steps_error + LEFT_OPEN


FAR = """
[beams]
length = "0.0952676 m"
thickness = "0.00716073 m"
overlap_half_length = "0.0142544 m"
[material]
youngs_modulus = "7e+10 Pa"
poissons_ratio = 0.3854
density = "2700 kg/m^3"
[contact]
friction = 0.28587
pairs = 41
[clamp]
force = "341084 N/m"
half_length = "0.0120187 m"
[support]
horizontal_spring = "4480.76 N/m/m"
[damping]
beta = "2.7485e-06 s"
[load]
moment_over_clamp_force_length = [0.00801593]
"""
"""Joint 8 of population 83: its bodies walk farther than they are long."""


def test_bodies_that_have_walked_far_are_solved_as_well_as_others():
    """A place of a decimetre rounds the slip of a fine step by 1e-9 of the unit of its contact.

    Residuals are those of slips, which know nothing of the place.
    """
    assembly = assemble(microslip.parse_joint(tomllib.loads(FAR)))
    joint, frequency = assembly.prepared, 600.33
    load = 0.00801593 * assembly.moment_unit
    point = solve_request(joint, Request(1.0, frequency, load, None, 0j, past="raised"))
    assert point.settled
    assert np.abs(point.steady.cycle.v).max() > 0.05
    scheme = time_scheme(joint, 1 / (frequency * MANY), frequency=frequency)
    finer = steady_state(scheme, frequency, load, start=point.steady.end)
    print(f"residual {finer.cycle.residual.max():.1e}")
    assert finer.converged
    assert finer.cycle.residual.max() < 1e-11

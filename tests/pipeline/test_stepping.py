"""What the steps of the motions do that a response is held to."""

import tomllib

import numpy as np
import pytest
from conftest import description
from walking_joints import WEAKLY_DAMPED

import microslip
from microslip.analyses.time.scheme import time_scheme
from microslip.analyses.time.steady import steady_state
from microslip.pipeline import stepping
from microslip.pipeline.stepping import ACCURACY, Stepped, step_error, step_errors
from microslip.pipeline.walk import STEPS
from microslip.results.dataset import dataset
from microslip.results.summary import summary

MANY = 2400


@pytest.fixture(scope="module")
def motions(small_reference):
    """Under one load at five frequencies: as a response has them, and with many more steps."""
    joint, load = small_reference.joint, 1.5e-4 * small_reference.moment
    found, limits = {}, {}
    for k, frequency in enumerate(joint.mode.sliding_frequency + np.array([-2.0, 0, 2, 3, 5])):
        coarse, fine = (
            time_scheme(joint, 1 / (frequency * steps), frequency=frequency)
            for steps in (STEPS, MANY)
        )
        steady = steady_state(coarse, frequency, load)
        found[10 * k] = Stepped(frequency, steady.amplitude, steady.end)
        finer = steady_state(fine, frequency, load, start=steady.end, tolerance=2e-6)
        limits[10 * k] = abs(finer.amplitude)
    return load, found, limits


def test_errors_of_the_steps_are_at_most_what_is_said(small_reference, motions):
    load, found, limits = motions
    for k, one in found.items():
        true = abs(abs(one.amplitude) / limits[k] - 1)
        said = step_error(small_reference.joint, load, one)
        print(f"{one.frequency:.1f} Hz: {true:.1e}, {said:.1e} said")
        assert true <= said + 3e-5
        assert said <= 3 * true + 3e-5


def test_between_two_the_larger_counts(small_reference, motions):
    load, found, _ = motions
    joint = small_reference.joint
    each = {k: step_error(joint, load, one) for k, one in found.items()}
    errors = step_errors(joint, load, found, 45)
    for k, error in each.items():
        assert errors[k] == pytest.approx(error, rel=1e-9)
    assert errors[15] == pytest.approx(max(each[10], each[20]), rel=1e-9)
    assert errors[44] == pytest.approx(each[40], rel=1e-9)


def test_what_does_not_settle_is_not_known(small_reference, motions, monkeypatch):
    load, found, _ = motions
    monkeypatch.setattr(stepping, "PATIENCE", 1)
    assert (step_errors(small_reference.joint, load, found, 45) == ACCURACY).all()
    assert (step_errors(small_reference.joint, load, {}, 3) == ACCURACY).all()


def test_few_of_many_are_looked_at_and_the_largest_is_one(monkeypatch):
    looked = []
    monkeypatch.setattr(stepping, "step_error", lambda joint, load, one: looked.append(one) or 0.1)
    many = {3 * k: Stepped(1.0 + k, 1.0 + (k == 11), None) for k in range(40)}
    errors = step_errors(None, 1.0, many, 120)
    assert len(looked) == stepping.LOOKS
    assert many[33] in looked
    assert {one.frequency for one in looked} >= {1.0, 40.0}
    assert (errors == 0.1).all()


def test_the_bound_of_a_response_has_the_error_of_its_steps(monkeypatch):
    """With steps that err by a per cent no frequency is known to a per cent."""
    document = tomllib.loads(WEAKLY_DAMPED)
    document["analysis"] = {"response": {"from": 440.0, "to": 480.0, "count": 9, "method": "auto"}}
    joint = microslip.parse_joint(document)
    known = microslip.run(joint).responses[0]
    monkeypatch.setattr("microslip.pipeline.auto.step_errors", lambda *_: np.full(9, 0.02))
    worse = microslip.run(joint).responses[0]
    assert (known.error_indicator <= 0.01).any()
    assert (worse.error_indicator > 0.02).all()


@pytest.mark.parametrize("refined", [True, False])
def test_a_joint_file_says_whether_points_are_sought_on(refined):
    document = {
        **description(21, 30),
        "load": {"moment": [20]},
        "analysis": {
            "time": {"frequencies": [165], "steps": 60, "step_refinement": refined},
        },
    }
    run = microslip.run(microslip.parse_joint(document))
    (point,) = run.time_domain
    (row,) = summary(run)["time_domain"]
    group = dataset(run)["time_domain"]
    assert point.steps == row["steps_per_cycle"] == (240 if refined else 60)
    assert len(point.steady.cycle.time) == group.sizes["step"] == 61
    assert np.isfinite(point.steps_error) == refined
    assert group["steps_error"].values == pytest.approx(point.steps_error, nan_ok=True)
    assert not any("time steps" in caution.reason for caution in run.cautions)

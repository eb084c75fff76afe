"""What the steps of the motions do that a response is held to."""

import tomllib

import numpy as np
import pytest
from conftest import description
from walking_joints import WEAKLY_DAMPED

import microslip
from microslip.analyses.time.scheme import time_scheme
from microslip.analyses.time.steady import steady_state
from microslip.pipeline import more_steps
from microslip.pipeline.stepping import (
    ACCURACY,
    More,
    Refined,
    Stepped,
    Stepping,
    refined,
)
from microslip.pipeline.targets import REFINEMENT, STEPS
from microslip.results.dataset import dataset
from microslip.results.summary import summary

MANY = 2400
LEFT_OPEN = 3e-5
"""What searches to 1e-5 leave open."""


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
        found[10 * k] = Stepped(frequency, steady.amplitude, steady.end, STEPS)
        finer = steady_state(fine, frequency, load, start=steady.end, tolerance=2e-6)
        limits[10 * k] = abs(finer.amplitude)
    return load, found, limits


def with_more(joint, load, states):
    """What states become with more steps."""
    known = Stepping()
    known.seek_on(joint, load, states)
    return known


@pytest.fixture(scope="module")
def sought_on(small_reference, motions):
    load, found, _ = motions
    return refined(found, with_more(small_reference.joint, load, found), [45], 60)


def test_errors_of_the_steps_are_at_most_what_is_said(motions, sought_on):
    _, found, limits = motions
    for k, one in found.items():
        before = abs(abs(one.amplitude) / limits[k] - 1)
        left = abs(abs(sought_on.amplitude[k]) / limits[k] - 1)
        print(f"{one.frequency:.1f} Hz: {before:.1e}, {left:.1e}, {sought_on.error[k]:.1e} said")
        assert left <= sought_on.error[k] + LEFT_OPEN
        assert before <= REFINEMENT * sought_on.error[k] + LEFT_OPEN
        assert sought_on.error[k] <= before + LEFT_OPEN


def test_between_two_the_larger_counts_and_others_keep_the_error_of_before(sought_on):
    error = sought_on.error
    assert error[15] == max(error[10], error[20])
    assert error[5] == max(error[0], error[10])
    assert error[45] == pytest.approx(REFINEMENT * error[40])
    assert (error[41:] == error[45]).all()


def test_what_does_not_settle_is_not_known(small_reference, motions, monkeypatch):
    load, found, _ = motions
    monkeypatch.setattr("microslip.pipeline.more_steps.PATIENCE", 1)
    none = refined(found, with_more(small_reference.joint, load, found), [], 45)
    assert none.amplitude == {}
    assert (none.error == ACCURACY).all()
    assert (refined({}, Stepping(), [], 3).error == ACCURACY).all()


def unsettled(monkeypatch, joint, load, one):
    """What a motion at rest becomes that does not settle with more steps."""
    monkeypatch.setattr("microslip.pipeline.more_steps.PATIENCE", 1)
    return more_steps.with_more_steps(joint, load, one._replace(marched=True))


def test_what_does_not_settle_at_rest_is_known_from_where_it_is_marched(
    small_reference, motions, monkeypatch
):
    """Its mean with 600 steps, which is a quarter as far from the limit as that with 150, or less."""
    joint, (load, found, limits) = small_reference.joint, motions
    for k, one in found.items():
        more = unsettled(monkeypatch, joint, load, one)
        before = abs(limits[k] / abs(one.amplitude) - 1)
        assert abs(more.amplitude) == pytest.approx(limits[k], rel=before / REFINEMENT + 1e-4)
        assert more.cycles > 400
        assert 0 < more.drifts < 1e-3


def test_what_goes_elsewhere_when_it_is_marched_does_not_stay(
    small_reference, motions, monkeypatch
):
    """An eighth larger than the motion that its state belongs to."""
    joint, (load, found, _) = small_reference.joint, motions
    one = found[20]
    more = unsettled(monkeypatch, joint, load, one._replace(amplitude=1.125 * one.amplitude))
    assert more.amplitude is None
    assert more.strays == np.inf


def test_another_motion_is_not_taken_for_the_same(monkeypatch):
    """A fifth larger: kept as it was, known no better than that."""
    states = {k: Stepped(1.0 + k, 1.0 + 0j, None, STEPS) for k in range(3)}
    sizes = {1.0: 1.001, 2.0: 1.2, 3.0: None}
    monkeypatch.setattr(
        "microslip.pipeline.more_steps.with_more_steps",
        lambda joint, load, one: More(sizes[one.frequency], 12),
    )
    found = refined(states, with_more(None, 1.0, states), [], 3)
    assert found.amplitude == {0: 1.001}
    assert found.error == pytest.approx([1e-3 / 3, 0.2 * 4 / 3, 0.2 * 4 / 3])


def test_states_of_few_steps_are_no_better_known_for_others_of_more_beside_them():
    """Of three that have been sought anew with four times the steps one was off by a twentieth before; those
    are known well with more still, and what has few steps has the error of few."""
    steps = {0: 4 * STEPS, 5: STEPS, 10: 4 * STEPS, 15: 4 * STEPS}
    states = {k: Stepped(1.0, 1.0 + 0j, None, n) for k, n in steps.items()}
    found = {0: 1.0001, 5: None, 10: 1.0001, 15: None}
    known = Stepping(sought_on=found, off={0: 0.05, 10: 0.02, 15: 0.04})
    error = refined(states, known, [20], 21).error
    assert error[0] == pytest.approx(1e-4 / 3)
    assert error[5] == 0.05
    assert (error[1:5] == 0.05).all()
    assert error[15] == pytest.approx(0.04 / REFINEMENT)
    assert error[20] == 0.04


def test_the_mean_of_what_beats_with_more_steps_has_the_error_of_more_steps():
    """Two neighbours that four times the steps move by a hundredth, and between them two motions that beat:
    of one the mean with more steps is known, the other is as few steps have it."""
    states = {k: Stepped(1.0, 1.0 + 0j, None, STEPS) for k in (0, 5, 10, 15)}
    sought_on = {0: 1.01, 5: 1.008, 10: None, 15: 1.01}
    known = Stepping(sought_on=sought_on, strays={5: 0.02, 10: 0.02})
    found = refined(states, known, [], 16)
    assert found.amplitude[5] == 1.008
    before = 0.01 * REFINEMENT / (REFINEMENT - 1)
    assert found.error[[0, 5, 15]] == pytest.approx(before / REFINEMENT)
    assert found.error[10] == pytest.approx(before)


def test_what_falls_with_more_steps_says_nothing_of_those_beside_it():
    """The last of a branch is a tenth as large with four times the steps; the next beats, and has the error
    of the one beyond."""
    states = {k: Stepped(1.0, 1.0 + 0j, None, STEPS) for k in (0, 5, 10)}
    known = Stepping(sought_on={0: 0.1, 5: 1.002, 10: 1.003}, strays={5: 0.01})
    error = refined(states, known, [], 11).error
    assert error[0] == pytest.approx(0.9 * REFINEMENT / (REFINEMENT - 1))
    assert error[[5, 10]] == pytest.approx(0.003 / (REFINEMENT - 1))


def test_where_no_state_settles_with_more_steps_the_error_is_that_of_the_first():
    states = {k: Stepped(1.0, 1.0 + 0j, None, STEPS) for k in range(4)}
    first = {0: 1.03, 1: 1.001, 2: None, 3: 1.2}
    known = Stepping(sought_on=first).anew(states)
    left = known.unknown
    assert left == pytest.approx(0.01)  # the last is another motion
    states = {k: one._replace(steps=4 * STEPS) for k, one in states.items()}
    assert known.steps == 4 * STEPS
    assert known.sought_on == {}
    known.sought_on.update(dict.fromkeys(states))
    none = refined(states, known, [], 6)
    assert (none.error == left).all()
    assert known.anew(states).unknown == ACCURACY


@pytest.fixture(scope="module")
def response():
    """Of a weakly damped joint, some of whose motions settle; with the steady states it is held to."""
    document = tomllib.loads(WEAKLY_DAMPED)
    document["analysis"] = {"response": {"from": 440.0, "to": 480.0, "count": 3, "method": "auto"}}
    return microslip.parse_joint(document)


@pytest.mark.validate
def test_a_response_has_the_amplitudes_of_more_steps_and_their_error(response, monkeypatch):
    known = microslip.run(response).responses[0]
    monkeypatch.setattr("microslip.pipeline.stepping.refined", moved)
    worse = microslip.run(response).responses[0]
    assert (known.error_indicator <= 0.01).any()
    assert (worse.error_indicator > 0.02).all()
    ends = [0, -1]
    ratio = np.abs(worse.amplitude[ends]) / np.abs(known.amplitude[ends])
    assert ratio == pytest.approx(1.05, rel=2e-3)


def moved(states, known, others, count):
    """Amplitudes a twentieth larger, known to a fiftieth."""
    amplitude = {k: 1.05 * one.amplitude for k, one in states.items()}
    return Refined(amplitude, np.full(count, 0.02))


@pytest.mark.parametrize("refinement", [True, False])
def test_a_joint_file_says_whether_points_are_sought_on(refinement):
    document = {
        **description(21, 30),
        "load": {"moment": [20]},
        "analysis": {
            "time": {"frequencies": [165], "steps": 60, "step_refinement": refinement},
        },
    }
    run = microslip.run(microslip.parse_joint(document))
    (point,) = run.time_domain
    (row,) = summary(run)["time_domain"]
    group = dataset(run)["time_domain"]
    assert point.steps == row["steps_per_cycle"] == (480 if refinement else 60)
    assert len(point.steady.cycle.time) == group.sizes["step"] == 61
    assert np.isfinite(point.steps_error) == refinement
    assert group["steps_error"].values == pytest.approx(point.steps_error, nan_ok=True)
    assert not any("time steps" in caution.reason for caution in run.cautions)


def test_ends_that_are_marched_leave_or_are_off_by_what_is_seen(monkeypatch):
    """With twice as many steps still, whatever they have; what fails tells nothing."""
    asked, becomes = (
        {},
        {
            0: More(1.1 + 0j, 9, strays=0.05, varies=0.04),
            1: More(None, 9, strays=np.inf),
            2: More(1.0005 + 0j, 9),
            3: More(None, 9),
        },
    )

    def more(joint, load, states):
        asked.update(states)
        yield from ((k, becomes[k]) for k in states)

    monkeypatch.setattr("microslip.pipeline.stepping.more_steps", more)
    known = Stepping()
    for k in becomes:
        known.keep(k, More(1.0 + 0j, 0))
    steps = {0: STEPS, 1: 4 * STEPS, 2: STEPS, 3: STEPS}
    states = {k: Stepped(1.0, 0.9 + 0j, None, n) for k, n in steps.items()}
    assert known.march_ends(None, 1.0, states) == {1}
    assert {one.steps for one in asked.values()} == {2 * STEPS}
    assert all(one.varies for one in asked.values())
    assert known.sought_on == {0: 1.0, 1: None, 2: 1.0, 3: 1.0}
    assert known.strays == pytest.approx({0: 0.15, 1: np.inf, 2: 0.0, 3: 0.0})
    assert known.varies == {0: 0.04, 1: 0.0, 2: 0.0, 3: 0.0}

"""Method "corrected" of the forced response: against time integration elsewhere, linear algebra, scaling."""

import re

import numpy as np
import pytest
from coupled_joint import coupled_document

import microslip
from microslip.analyses.harmonic.operator import linear_operator
from microslip.analyses.harmonic.problem import harmonic_problem
from microslip.analyses.reduced.sweep import CONVERGED
from microslip.analyses.time.scheme import time_scheme
from microslip.analyses.time.steady import steady_state, walk_of
from microslip.errors import InputError
from microslip.numerics.fourier import to_complex, to_real
from microslip.pipeline import corrected as method
from microslip.pipeline.stepping import More
from microslip.pipeline.targets import STEPS
from microslip.results.response import response_datasets

FILE = coupled_document(21)


def corrected(moment, force=4e5, **response):
    file = {
        **FILE,
        "clamp": {"force": f"{force:g} N/m", "half_length": "40 mm"},
        "load": {"moment": [f"{m:g} N*m/m" for m in np.atleast_1d(moment)]},
    }
    analysis = {"response": {"method": "corrected", "count": 61, **response}}
    analysis["reduced"] = {"amplitudes": 16, "steps": 100}
    return microslip.run(microslip.parse_joint({**file, "analysis": analysis}))


def unmoved(joint, load, states):
    """States that more steps do not change."""
    return ((k, More(one.amplitude, 16)) for k, one in states.items())


@pytest.fixture(scope="module")
def done():
    return corrected(30.0, corrections=12)


def test_a_curve_through_no_more_steady_states_than_asked_for(done):
    (curve,) = done.responses
    assert curve.variant == "corrected"
    assert 7 <= len(curve.anchors) <= 12
    assert (curve.flag == CONVERGED).mean() > 0.95
    near = [int(np.argmin(np.abs(curve.frequency - one.frequency))) for one in curve.anchors]
    found = np.abs([one.amplitude for one in curve.anchors])
    np.testing.assert_allclose(np.abs(curve.amplitude[near]), found, rtol=1e-9)


def test_the_stated_error_holds_against_time_integration(done):
    """At frequencies that were not sought, with other steps, from rest under the whole load."""
    (curve,) = done.responses
    known = np.array([one.frequency for one in curve.anchors])
    free = np.flatnonzero(np.abs(curve.frequency[:, None] - known).min(axis=1) > 1e-9)
    held = []
    for k in free[np.linspace(0, len(free) - 1, 8).astype(int)]:
        f = float(curve.frequency[k])
        scheme = time_scheme(done.prepared, 1 / (240 * f), frequency=f)
        truth = steady_state(scheme, f, curve.load)
        error = abs(abs(curve.amplitude[k]) / abs(truth.amplitude) - 1)
        held.append(error <= curve.error_indicator[k])
    assert np.mean(held) >= 7 / 8


def test_under_a_small_load_it_is_the_stuck_joint():
    """Linear algebra with the pairs that touch held together."""
    done = corrected(1e-4, corrections=14)
    (curve,) = done.responses
    joint, rows = done.prepared, done.prestress.bonded(2)
    problem = harmonic_problem(joint, harmonics=1, half_turn=False)
    for k in range(0, len(curve.frequency), 20):
        operator = linear_operator(problem, 2 * np.pi * curve.frequency[k])
        free = to_complex(operator.per_load() * curve.load)[1]
        r = np.zeros((2, len(free)), complex)
        r[1, rows] = np.linalg.solve(operator.dense(1)[np.ix_(rows, rows)], free[rows])
        q = problem.split(problem.rest())[1]
        Q = operator.outputs(to_real(r), q, curve.load)[1, joint.model.port(joint.coordinate)]
        assert abs(curve.amplitude[k]) == pytest.approx(abs(Q), rel=method.ACCURACY)


def test_amplitudes_scale_with_clamp_force_and_load_together(done):
    """So do steady states at the same frequency; beside the fold rounding decides whether there is one."""
    (curve,), (other,) = done.responses, corrected(90.0, force=1.2e6, corrections=12).responses
    pairs = [
        (one, twin)
        for one in curve.anchors
        for twin in other.anchors
        if one.frequency == pytest.approx(twin.frequency, rel=1e-9)
    ]
    assert len(pairs) >= 0.75 * len(curve.anchors)
    for one, twin in pairs:
        # within what starts lock in, as states of several starts are told apart
        assert abs(twin.amplitude) == pytest.approx(3 * abs(one.amplitude), rel=1e-3)
    at = np.linspace(0, len(curve.frequency) - 1, 40).astype(int)
    size = np.interp(curve.frequency[at], other.frequency, np.abs(other.amplitude))
    told = curve.error_indicator[at] + np.interp(
        curve.frequency[at], other.frequency, other.error_indicator
    )
    assert (np.abs(size / np.abs(3 * curve.amplitude[at]) - 1) <= told).mean() > 0.9


def test_beside_a_motion_that_is_not_steady_the_bound_says_so(done, monkeypatch):
    (curve,) = done.responses
    middle, true = curve.peak_frequency, method.patient_motion

    def wandering(joint, load, frequency, guess, steps):
        found = true(joint, load, frequency, guess, steps)
        return found._replace(doubt=0.2) if abs(frequency - middle) < 0.02 else found

    monkeypatch.setattr(method, "patient_motion", wandering)
    again = corrected(30.0, corrections=12)
    (other,) = again.responses
    beside = np.abs(other.frequency - middle) < 0.02
    assert beside.any()
    assert (other.error_indicator[beside] >= 0.2).all()
    assert any("not steady" in one.reason for one in again.cautions)


def test_what_is_open_beside_a_motion_that_is_not_steady_is_not_bounded(done, monkeypatch):
    """It may come to do the same; where it is known again, it is, whatever lies beside it."""
    true, peak = method.patient_motion, done.responses[0].peak_frequency

    def wandering(joint, load, frequency, guess, steps):
        found = true(joint, load, frequency, guess, steps)
        if frequency < peak - 2.0:
            return found._replace(doubt=0.2, settled=False)
        open_ = found._replace(doubt=max(found.doubt, 0.02), change=1e-2, settled=False)
        return open_ if frequency < peak - 1.0 else found

    monkeypatch.setattr(method, "patient_motion", wandering)
    monkeypatch.setattr("microslip.pipeline.stepping.more_steps", unmoved)
    (curve,) = corrected(30.0, corrections=60, count=121).responses
    from_peak = curve.frequency - peak
    open_ = [one.frequency - peak for one in curve.anchors if -2.0 <= one.frequency - peak < -1.0]
    assert open_
    assert not (curve.error_indicator[(from_peak >= -2.0) & (from_peak <= max(open_))] <= 1).any()
    assert (curve.error_indicator[from_peak > 1.0] <= 0.05).all()


def test_what_lingers_past_the_end_of_a_branch_is_not_claimed(done, monkeypatch):
    """Motions that still change, next to a jump: their amplitude hardly does, and yet they fall."""
    true, end = method.patient_motion, done.responses[0].peak_frequency - 2.0

    def fallen(joint, load, frequency, guess, steps):
        found = true(joint, load, frequency, guess, steps)
        if frequency < end:
            return found._replace(amplitude=found.amplitude / 5)
        changing = found._replace(change=1e-2, doubt=1e-3, settled=False)
        return changing if frequency < end + 1.5 else found

    monkeypatch.setattr(method, "patient_motion", fallen)
    monkeypatch.setattr("microslip.pipeline.stepping.more_steps", unmoved)
    (curve,) = corrected(30.0, corrections=60, count=121).responses
    up = curve.frequency - end
    lingering = [one.frequency - end for one in curve.anchors if 0 <= one.frequency - end < 1.5]
    assert len(lingering) > 1
    assert not (curve.error_indicator[(up >= 0) & (up < max(lingering))] <= 1).any()
    assert (curve.error_indicator[up > 4.0] <= 0.05).all()


def test_between_states_that_more_steps_have_moved_others_are_sought(done, monkeypatch):
    """With more steps a piece of the response is larger; what is known is not sought on again."""
    peak, sought_on = done.responses[0].peak_frequency, {}

    def noted(joint, load, states):
        sought_on.update(states)
        return unmoved(joint, load, states)

    monkeypatch.setattr("microslip.pipeline.stepping.more_steps", noted)
    (plain,) = corrected(30.0, corrections=60, error=0.02, count=121).responses
    before = len(sought_on)
    sought_on.clear()

    def moved(joint, load, states):
        assert not set(states) & set(sought_on)
        sought_on.update(states)
        for k, one in states.items():
            size = 1 + 0.018 * np.exp(-(((one.frequency - peak) / 1.0) ** 2))
            yield k, More(size * one.amplitude, 16)

    monkeypatch.setattr("microslip.pipeline.stepping.more_steps", moved)
    (curve,) = corrected(30.0, corrections=60, error=0.02, count=121).responses
    new = np.setdiff1d(*([one.frequency for one in c.anchors] for c in (curve, plain)))
    print(f"{before} and {len(new)} more: {new - peak}")
    assert 0 < len(new) < before
    seen = {one.frequency for one in sought_on.values()}
    assert seen.intersection(new)
    # those that are known by watching them alone are not sought on
    assert seen <= {one.frequency for one in curve.anchors}
    assert (np.abs(new - peak) < 5.0).all()


def test_what_motions_leave_is_not_steady_and_how_far_they_stray_is_the_error(done, monkeypatch):
    """Above its peak motions leave the periodic one; farther above they beat about it."""
    peak, beating = done.responses[0].peak_frequency, []

    def more(joint, load, states):
        for k, one in states.items():
            up = one.frequency - peak
            strays = np.inf if 0.5 < up < 2.5 else 0.03 if 2.5 < up < 5.0 else 0.0
            beating.extend([one.frequency] if strays == 0.03 else [])
            yield k, More(one.amplitude if strays < 1 else None, 16, strays)

    monkeypatch.setattr("microslip.pipeline.stepping.more_steps", more)
    run = corrected(30.0, corrections=40, count=121)
    (curve,) = run.responses
    up = np.array([one.frequency for one in curve.anchors]) - peak
    assert not ((up > 0.5) & (up < 2.5)).any()
    assert beating
    assert (np.interp(beating, curve.frequency, curve.error_indicator) >= 0.03).all()
    assert any("not steady" in one.reason for one in run.cautions)


def test_what_does_not_settle_with_more_steps_is_known_no_better_than_it_drifts_then(
    done, monkeypatch
):
    peak, drifting = done.responses[0].peak_frequency, []

    def more(joint, load, states):
        assert all(one.marched for one in states.values())
        for k, one in states.items():
            drifts = 0.03 if 0.5 < one.frequency - peak < 2.5 else 0.0
            drifting.extend([one.frequency] if drifts else [])
            yield k, More(None if drifts else one.amplitude, 16, drifts=drifts)

    monkeypatch.setattr("microslip.pipeline.stepping.more_steps", more)
    (curve,) = corrected(30.0, corrections=40, count=121).responses
    assert drifting
    assert (np.interp(drifting, curve.frequency, curve.error_indicator) >= 0.03).all()


def test_where_the_first_show_that_the_steps_err_all_have_more(done, monkeypatch):
    """Few steps put all of the response off by a twentieth, four times as many by an eightieth."""
    true, asked = method.patient_motion, []

    def erring(joint, load, frequency, guess, steps):
        asked.append(steps)
        found = true(joint, load, frequency, guess)
        return found._replace(amplitude=found.amplitude * (1 - 0.05 * STEPS / steps))

    def more(joint, load, states):
        for k, one in states.items():
            few, many = (1 - 0.05 * STEPS / steps for steps in (one.steps, 4 * one.steps))
            yield k, More(one.amplitude * many / few, 16)

    monkeypatch.setattr(method, "patient_motion", erring)
    monkeypatch.setattr("microslip.pipeline.stepping.more_steps", more)
    (curve,) = corrected(30.0, corrections=16).responses
    first = asked.count(STEPS)
    assert set(asked[:first]) == {STEPS}
    assert set(asked[first:]) == {4 * STEPS}
    (plain,) = done.responses
    size = np.interp(curve.frequency, plain.frequency, np.abs(plain.amplitude))
    off = np.abs(np.abs(curve.amplitude) / size - 1)
    told = curve.error_indicator + np.interp(
        curve.frequency, plain.frequency, plain.error_indicator
    )
    assert (off <= told).mean() > 0.9


def test_results_carry_the_steady_states_and_no_past(done):
    anchors = response_datasets(done)["anchors"]
    assert anchors.sizes["anchor"] == len(done.responses[0].anchors)
    assert np.isnan(anchors["past_difference"]).all()


def test_it_needs_the_refined_model():
    with pytest.raises(InputError, match=r"analysis\.response\.method.*add it to variants"):
        corrected(90.0, variants=["consistent"])


def test_fewer_than_the_first_is_said():
    with pytest.raises(InputError, match=r"analysis\.response\.corrections"):
        corrected(90.0, corrections=3)


def test_bodies_that_walk_are_said(done):
    """As many as a march of its own sees walk; joints whose bodies stay are not told of."""
    assert not any("walk past" in str(one) for one in done.cautions)
    moved = corrected(60.0, corrections=12)
    (curve,) = moved.responses
    said = " ".join(str(one) for one in moved.cautions if "past each other" in str(one))
    rested = re.search(r"walk past each other at (\d+) of the frequencies", said)
    on = re.search(r"walk on past each other at (\d+) of", said)
    count = 0
    for one in curve.anchors:
        scheme = time_scheme(moved.prepared, 1 / (150 * one.frequency), frequency=one.frequency)
        found = steady_state(scheme, one.frequency, curve.load, guess=one.amplitude, tolerance=1e-5)
        count += abs(walk_of(found, 2)) > 1e-4
    assert count > 0
    assert sum(int(match[1]) for match in (rested, on) if match) == count


def test_bodies_that_walk_on_are_said_and_what_others_have_moved_by_is_their_doubt(
    done, monkeypatch
):
    true, peak = method.patient_motion, done.responses[0].peak_frequency

    def walking(joint, load, frequency, guess, steps):
        found = true(joint, load, frequency, guess, steps)
        if frequency < peak:
            return found._replace(walked=1e-6, lasts=300.0, moved=0.02)
        return found._replace(walk=0.003) if frequency > peak + 1.0 else found

    monkeypatch.setattr(method, "patient_motion", walking)
    run = corrected(30.0, corrections=16)
    (curve,) = run.responses
    at = np.array([one.frequency for one in curve.anchors])
    error = np.interp(at, curve.frequency, curve.error_indicator)
    assert (error[at > peak + 1.0] >= 0.02).all()
    assert (error[at < peak] < 0.02).any()
    said = [str(one) for one in run.cautions if "walk" in str(one)]
    assert f"walk past each other at {(at < peak).sum()} of the frequencies" in said[0]
    assert "in about 3e+02 cycles; the response is where they come to rest" in said[0]
    count = (at > peak + 1.0).sum()
    assert (
        f"walk on past each other at {count} of {len(at)} steady states, by up to 0.003" in said[1]
    )

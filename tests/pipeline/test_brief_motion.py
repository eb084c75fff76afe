"""Short searches by time integration: how far what has settled goes on until it is at rest."""

from dataclasses import replace

import numpy as np
import pytest

import microslip
from microslip.analyses.time.scheme import time_scheme
from microslip.analyses.time.steady import steady_state
from microslip.pipeline import brief_motion as method
from microslip.pipeline.brief_motion import AT_REST, BriefMotion, brief_motion, patient_motion
from microslip.pipeline.corrected import WIDER, _Table

FREQUENCY, LOAD, GUESS = 182.0, 30.0, 3e-3 + 0j


@pytest.fixture(scope="module")
def joint():
    return microslip.prepare(microslip.reference_joint(pairs=21))


def test_what_comes_to_rest_is_the_steady_state(joint):
    """That of a search from elsewhere, until nothing changes."""
    found = patient_motion(joint, LOAD, FREQUENCY, GUESS)
    scheme = time_scheme(joint, 1 / (150 * FREQUENCY), frequency=FREQUENCY)
    truth = steady_state(scheme, FREQUENCY, LOAD, guess=0.5 * GUESS, tolerance=1e-9)
    assert truth.converged
    assert found.settled
    assert found.change <= AT_REST
    assert np.isnan(found.crept)
    assert abs(found.amplitude / truth.amplitude - 1) < 1e-4
    output = found.output[joint.model.port(joint.coordinate)]
    assert output == pytest.approx(found.amplitude, rel=1e-4)


@pytest.mark.parametrize("slowest", [0.9999, 1.001, -1.2])
def test_what_repeats_has_settled_whatever_is_slow_about_it(joint, monkeypatch, slowest):
    """Whether motions stay beside it is asked of that alone."""
    true = method.steady_state

    def slow(*args, **settings):
        found = true(*args, **settings)
        return replace(found, multipliers=np.array([slowest]))

    monkeypatch.setattr(method, "SURE", 1e-6)
    monkeypatch.setattr(method, "steady_state", slow)
    monkeypatch.setattr(method, "watched", lambda *args: (np.full(12, GUESS), []))
    assert method.LASTS * method.TOLERANCE > method.SURE
    found = brief_motion(joint, LOAD, FREQUENCY, GUESS)
    assert found.settled
    assert found.amplitude == GUESS  # it was looked at for longer


def test_how_far_goes_what_does_not_come_to_rest_is_said(joint, monkeypatch):
    brief = brief_motion(joint, LOAD, FREQUENCY, GUESS)
    true = method.steady_state

    def creeping(scheme, frequency, load, **settings):
        found = true(scheme, frequency, load, **settings)
        if settings.get("start") is None:
            return found
        return replace(found, amplitude=1.004 * brief.amplitude, change=5e-6, converged=False)

    monkeypatch.setattr(method, "AT_REST", 0.0)
    monkeypatch.setattr(method, "steady_state", creeping)
    found = patient_motion(joint, LOAD, FREQUENCY, GUESS)
    assert found.crept == pytest.approx(0.004, rel=1e-6)
    assert found.amplitude == pytest.approx(1.004 * brief.amplitude)
    assert found.settled


def test_what_leaves_its_branch_as_it_is_sought_on_is_marched_and_has_not_settled(
    joint, monkeypatch
):
    brief = brief_motion(joint, LOAD, FREQUENCY, GUESS)
    true = method.steady_state

    def leaving(scheme, frequency, load, **settings):
        found = true(scheme, frequency, load, **settings)
        return found if settings.get("start") is None else replace(found, amplitude=1e-6 + 0j)

    monkeypatch.setattr(method, "AT_REST", 0.0)
    monkeypatch.setattr(method, "steady_state", leaving)
    found = patient_motion(joint, LOAD, FREQUENCY, GUESS)
    assert not found.settled
    assert abs(abs(found.amplitude) / abs(brief.amplitude) - 1) <= found.doubt


def test_states_are_known_no_better_than_those_next_to_them_creep():
    anchor = microslip.analyses.reduced.anchors.Anchor(100.0, 1.0 + 0j, 0j, 1e-6, doubt=1e-4)
    crept = {3: 0.001, 5: np.nan, 8: 0.003, 9: 0.0, 12: 0.0005}
    motions = {k: BriefMotion(1.0 + 0j, 1e-6, 1e-4, crept=far) for k, far in crept.items()}
    table = _Table(None, 1.0, anchors=dict.fromkeys(crept, anchor), motions=motions)
    added = {k: one.doubt - 1e-4 for k, one in table.doubted().items()}
    expected = {3: 0.003, 5: 0.0, 8: 0.003, 9: 0.003, 12: 0.0005}
    assert added == pytest.approx({k: WIDER * e for k, e in expected.items()})

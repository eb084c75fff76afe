"""Where a motion ends after the load was raised: marched with leaps, against searches and marching alone."""

import numpy as np
import pytest

import microslip
from microslip.analyses.time.scheme import time_scheme
from microslip.analyses.time.steady import raised_state, steady_state
from microslip.errors import ContactError
from microslip.pipeline import creep
from microslip.pipeline.creep import crept, raised_and_marched
from microslip.pipeline.walk import STEPS, Found, Lost, Target, watched

LOAD, FREQUENCY = 40.0, 182.0


@pytest.fixture(scope="module")
def scheme():
    joint = microslip.prepare(microslip.reference_joint(pairs=11))
    return time_scheme(joint, 1 / (FREQUENCY * STEPS), frequency=FREQUENCY)


@pytest.fixture(scope="module")
def raised(scheme):
    return raised_state(scheme, FREQUENCY, LOAD, 10)


def test_it_ends_where_a_search_does_where_nothing_creeps(scheme, raised):
    found = crept(scheme, LOAD, raised)
    other = steady_state(scheme, FREQUENCY, LOAD, start=raised, tolerance=1e-7)
    assert other.converged
    assert abs(found.amplitude) == pytest.approx(abs(other.amplitude), rel=found.doubt + 1e-4)
    assert found.doubt <= creep.STILL


def test_it_ends_where_marching_alone_does(scheme, raised):
    """The doubt is what is left, whatever the leaps."""
    found = crept(scheme, LOAD, raised, blocks=4)
    Q, _ = watched(scheme, LOAD, raised, 800)
    assert abs(abs(found.amplitude) / abs(Q[-1]) - 1) <= found.doubt + 1e-6


def test_the_state_is_one_of_the_motion(scheme, raised):
    found = crept(scheme, LOAD, raised)
    Q, _ = watched(scheme, LOAD, found.state, 5)
    np.testing.assert_allclose(np.abs(Q), abs(found.amplitude), rtol=found.doubt + 1e-6)


def test_leaps_grow_while_the_drift_stays_and_end_where_it_turns():
    drift = np.array([1.0, 0.5])
    assert creep._next_leap(0.0, drift, 0.8 * drift) == creep.LEAP
    assert creep._next_leap(0.0, drift, 0.1 * drift) == 0.0, "it settles by itself"
    grown = creep._next_leap(100.0, drift, 0.8 * drift)
    assert grown == 200.0
    assert creep._next_leap(creep.FARTHEST, drift, drift) == creep.FARTHEST
    assert creep._next_leap(200.0, drift, 0.1 * drift) == 100.0
    assert creep._next_leap(200.0, drift, -drift) == 0.0


def test_two_ramps_tell_how_well_an_end_is_known(scheme):
    target = Target(3, FREQUENCY, LOAD, 0j)
    found, other = raised_and_marched(scheme.joint, [target, target])
    assert isinstance(found, Found)
    assert 0 <= found.scatter < 1e-3
    assert isinstance(other, Found)
    assert np.isnan(other.scatter)


def test_what_does_not_solve_is_said(scheme, monkeypatch):
    def unsolved(*arguments, **settings):
        raise ContactError("contact not solved at t = 1 s")

    monkeypatch.setattr(creep, "raised_state", unsolved)
    (found,) = raised_and_marched(scheme.joint, [Target(3, FREQUENCY, LOAD, 0j)])
    assert isinstance(found, Lost)
    assert "not solved" in found.reason

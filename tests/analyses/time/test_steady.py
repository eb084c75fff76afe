"""Steady states: acceleration against plain marching, and independence of the start."""

from __future__ import annotations

import numpy as np
import pytest

from microslip.analyses.time.scheme import march, time_scheme
from microslip.analyses.time.steady import steady_state
from microslip.contact.pairs import tangential

STEPS = 150
LOADS = {"stick": 1e-5, "mixed": 1e-4, "slip": 4e-4}
"""Moment over P L, 3 Hz above the sliding frequency."""
TOLERANCE = {"stick": 1e-6, "mixed": 1e-6, "slip": 1e-5}
"""A widely slipping joint walks and must not be asked for more: see `test_joint_walks`."""
AGREEMENT = {"stick": 1e-4, "mixed": 1e-4, "slip": 3e-4}
MARCHED = {"stick": 2800, "mixed": 400, "slip": 400}
"""Cycles of plain marching from rest until transients are below 1e-4."""


@pytest.fixture(scope="module", params=LOADS)
def case(request, small_reference):
    """Name, scheme and the accelerated steady state from rest."""
    name = request.param
    frequency = small_reference.joint.mode.sliding_frequency + 3.0
    scheme = time_scheme(small_reference.joint, 1 / (frequency * STEPS))
    load = LOADS[name] * small_reference.moment
    found = steady_state(scheme, frequency, load, tolerance=TOLERANCE[name])
    assert found.converged
    return name, scheme, found


def differences(one, other):
    """Of the complex amplitude and of the dissipated energy, relative."""
    amplitude = abs(one.amplitude - other.amplitude) / abs(other.amplitude)
    return amplitude, abs(one.cycle.dissipated / other.cycle.dissipated - 1)


def test_accelerated_and_marched_agree(case):
    name, scheme, fast = case
    slow = steady_state(
        scheme, fast.frequency, fast.load, accelerate=False, tolerance=0, max_cycles=MARCHED[name]
    )
    amplitude, dissipated = differences(fast, slow)
    shares = [float(np.mean(fast.cycle.status == k)) for k in (1, 2, 3, 4)]
    reach = int(np.argmax(slow.history < 1e-5)) + 1
    print(
        f"{name}: amplitude {amplitude:.1e}, dissipation {dissipated:.1e}; cycles {fast.cycles}, "
        f"marched to 1e-5 in {reach}; stick, forward, backward, open {np.round(shares, 2)}"
    )
    assert max(amplitude, dissipated) < AGREEMENT[name]
    assert fast.cycles < 0.25 * reach


def test_start_matters_by_what_it_locks_in_only(case):
    """Starts far off (amplitude, phase) against rest: a thousandth, and it is there to stay.

    Coulomb friction has more than one steady state: pairs that stick all the time keep whatever
    traction the transient left in them. Marching on does not bring the answers together.
    """
    name, scheme, fast = case
    for factor in (1.3, np.exp(0.7j), np.exp(-2.5j)):
        start = factor * abs(fast.amplitude) * np.exp(1j * np.angle(fast.amplitude))
        other = steady_state(
            scheme, fast.frequency, fast.load, guess=start, tolerance=TOLERANCE[name]
        )
        assert other.converged
        assert other.phase == pytest.approx(-np.angle(start))
        amplitude, dissipated = differences(other, fast)
        print(f"{name}, start {factor:.2f}: {amplitude:.1e}, {dissipated:.1e}, {other.cycles}")
        assert amplitude < 5e-4
        assert dissipated < 2e-3
        wave = fast.load * np.sin(other.phase + 2 * np.pi * np.arange(STEPS + 1) / STEPS)
        state = other.cycle.state
        for _ in range(100):
            later = march(scheme, state, wave)
            state = later.state
        assert later.dissipated == pytest.approx(other.cycle.dissipated, rel=AGREEMENT[name])


def test_steady_state_starts_itself(case):
    name, scheme, fast = case
    again = steady_state(
        scheme, fast.frequency, fast.load, start=fast.cycle.state, tolerance=TOLERANCE[name]
    )
    assert again.converged
    assert again.cycles <= 3
    assert max(differences(again, fast)) < AGREEMENT[name]


def test_joint_walks(case):
    """At wide slip the bodies creep past each other, the same distance every cycle; else they stay.

    Only the soft horizontal springs at the far ends oppose it, so that the state never repeats.
    """
    name, scheme, fast = case
    wave = fast.load * np.sin(2 * np.pi * np.arange(STEPS + 1) / STEPS)
    steady = steady_state(
        scheme, fast.frequency, fast.load, accelerate=False, tolerance=0, max_cycles=400
    )
    state, offsets = steady.cycle.state, []
    for _ in range(20):
        state = march(scheme, state, wave).state
        offsets.append(tangential(state.v).mean())
    steps = np.diff(offsets)
    swing = np.ptp(tangential(fast.cycle.v), axis=0).mean()
    print(f"{name}: walks {steps.mean():.2e} m per cycle, {steps.mean() / swing:.1e} of its slip")
    if name == "slip":
        assert steps == pytest.approx(np.full(19, steps.mean()), rel=0.05)
        assert 1e-4 < abs(steps.mean()) / swing < 1e-1
    else:
        assert np.abs(steps).max() < 2e-3 * swing
        assert abs(steps.mean()) < 5e-4 * swing


def test_load_of_opposite_sign_mirrors(case):
    """M -> -M is a half turn of the joint: amplitude turns by pi, dissipation stays."""
    name, scheme, fast = case
    turned = steady_state(scheme, fast.frequency, -fast.load, tolerance=TOLERANCE[name])
    assert -turned.amplitude == pytest.approx(fast.amplitude, rel=1e-3)
    mirrored = turned.cycle.friction_work[::-1]
    assert mirrored.sum() == pytest.approx(fast.cycle.dissipated, rel=1e-3)
    assert mirrored == pytest.approx(fast.cycle.friction_work, abs=0.01 * mirrored.max())


def test_not_converged_is_said(case):
    _, scheme, fast = case
    short = steady_state(scheme, fast.frequency, fast.load, max_cycles=3)
    assert not short.converged
    assert short.change > 1e-4
    assert short.cycles == 4


def test_search_does_not_run_off_with_the_walk(small_reference):
    """1 Hz above the sliding frequency, where the walk is largest: same answer as 800 cycles."""
    frequency = small_reference.joint.mode.sliding_frequency + 1.0
    scheme = time_scheme(small_reference.joint, 1 / (frequency * STEPS))
    load = 4e-4 * small_reference.moment
    fast = steady_state(scheme, frequency, load)
    slow = steady_state(scheme, frequency, load, accelerate=False, tolerance=0, max_cycles=800)
    offset = tangential(fast.cycle.state.v).mean()
    print(f"walked: {differences(fast, slow)}, mean offset {offset:.1e} m")
    assert max(differences(fast, slow)) < 2e-3
    assert abs(offset) < 1e-2

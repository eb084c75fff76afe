"""Damping of the part without inertia over three points in time, against its transfer function."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from microslip.analyses.time.poles import lags
from microslip.analyses.time.scheme import time_scheme
from microslip.analyses.time.steady import steady_state

TAU, FREQUENCY = 2e-5, 200.0


def transfer(d, theta):
    """D at a phase per step, ``z = exp(-i theta)``."""
    return np.polynomial.Polynomial(d)(np.exp(-1j * np.asarray(theta)))


@pytest.mark.parametrize("steps", [8, 20, 150])
def test_no_error_at_the_load(steps):
    dt, omega = 1 / (FREQUENCY * steps), 2 * np.pi * FREQUENCY
    found = transfer(lags(TAU, dt, FREQUENCY), omega * dt)
    assert found == pytest.approx(1j * omega * TAU, rel=1e-12)


@pytest.mark.parametrize("frequency", [0.0, FREQUENCY])
def test_second_order_at_other_harmonics(frequency):
    """Halving the step quarters the error at three times the frequency of the load."""
    other = 3 * 2 * np.pi * FREQUENCY
    errors = []
    for steps in (400, 800, 1600):
        dt = 1 / (FREQUENCY * steps)
        errors.append(abs(transfer(lags(TAU, dt, frequency), other * dt) - 1j * other * TAU))
    ratio = np.array(errors[:-1]) / errors[1:]
    print(ratio)
    assert (ratio > 3.7).all()


@pytest.mark.parametrize("tau", [2e-7, TAU])
@pytest.mark.parametrize("frequency", [0.0, FREQUENCY])
def test_takes_energy_whatever_moves(tau, frequency):
    """The part gives ``sin theta Im D`` of energy away per step; at the load that of its damping."""
    dt = 1 / (FREQUENCY * 150)
    theta = np.linspace(1e-3, np.pi, 500)
    taken = np.sin(theta) * transfer(lags(tau, dt, frequency), theta).imag
    assert (taken >= -1e-12).all()


def test_a_stuck_joint_has_no_error_of_the_step(small_reference):
    """Where all pairs stick a periodic motion is linear: strongly damped, 40 steps say what 320 do."""
    joint = small_reference.joint
    model = replace(joint.model.truncated(8), rayleigh=(0.0, 2e-5))
    mode = replace(joint.mode, sliding=joint.mode.sliding[:8], stuck=joint.mode.stuck[:8])
    joint, f = replace(joint, model=model, mode=mode), joint.mode.sliding_frequency
    found = [
        steady_state(
            time_scheme(joint, 1 / (f * steps), frequency=f), f, 1e-6, tolerance=1e-9
        ).amplitude
        for steps in (40, 320)
    ]
    print(f"{abs(found[0] / found[1] - 1):.1e}")
    assert found[0] == pytest.approx(found[1], rel=1e-6)

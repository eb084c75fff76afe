"""Every degree of freedom marched, against the reduced model and against its own energy."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from conftest import CLAMP, FRICTION, build_reference

from microslip.analyses.prepared.joint import prepare_joint
from microslip.analyses.time.scheme import march, prestressed_state, time_scheme
from microslip.analyses.time.unreduced import full_scheme, march_full, prestressed_full_state
from microslip.contact.law import contact_law
from microslip.errors import ModelError
from microslip.numerics.fourier import harmonic

STEPS, CYCLES = 150, 4
POINTS = ((1e-4, 1.5e-3), (3e-4, 8e-3), (1e-3, 3e-2))
"""Moment over P L and the amplitude to start with: mostly stick, mixed, mostly slip and open."""


@pytest.fixture(scope="module")
def few():
    """25 pairs; 120 modes, so that it can be truncated anywhere."""
    return build_reference(25, modes=120)


def scheme_of(few, steps=STEPS):
    dt = 1 / (frequency(few) * steps)
    sliding = few.structure.mass @ few.states.sliding
    return full_scheme(few.structure, few.joint, dt, alpha=0.0, outputs={"sliding": sliding})


def frequency(few):
    return few.states.sliding_omega / (2 * np.pi) + 1.0


def reduced(few, modes, load, amplitude):
    model, mode = few.model.truncated(modes), few.joint.mode
    mode = replace(mode, sliding=mode.sliding[:modes], stuck=mode.stuck[:modes])
    joint = prepare_joint(model, few.joint.law, few.start.preload, "moment", mode)
    scheme = time_scheme(joint, 1 / (frequency(few) * STEPS), matched=False)
    state = prestressed_state(scheme, amplitude, few.states.sliding_omega)
    result = march(scheme, state, load)
    return result, result.output[:, model.port("sliding")]


@pytest.fixture(scope="module", params=POINTS, ids=["stick", "mixed", "slip"])
def compared(request, few):
    """Errors of the reduced model by number of modes: amplitude, dissipation, whole history."""
    level, amplitude = request.param
    theta = 2 * np.pi * np.arange(CYCLES * STEPS + 1) / STEPS
    load = level * few.moment * np.sin(theta)
    scheme = scheme_of(few)
    passing = few.states.sliding * amplitude * few.states.sliding_omega
    state = prestressed_full_state(scheme, passing)
    full = march_full(scheme, load, state)
    truth = full.output["sliding"]
    last = slice(-STEPS - 1, None)
    Q = harmonic(truth[last], theta[last])
    errors = {}
    for modes in (6, 8, 20, 80):
        result, y = reduced(few, modes, load, amplitude)
        q = harmonic(y[last], theta[last])
        errors[modes] = (
            abs(abs(q) / abs(Q) - 1),
            abs(result.dissipated / full.dissipated - 1),
            np.abs(y - truth).max() / abs(Q),
        )
        print(f"M/PL {level}, {modes} modes: " + " ".join(f"{e:.1e}" for e in errors[modes]))
    return errors, full


def test_reduced_model_agrees(compared):
    """The project's tolerance is 0.3 %. The full mesh keeps the whole push of pairs that open."""
    errors, full = compared
    assert full.residual.max() < 1e-8
    for modes in (20, 80):
        assert max(errors[modes]) < 3e-3


def test_agreement_improves_with_modes(compared):
    errors = np.array([compared[0][k][2] for k in (6, 8, 20, 80)])
    assert (errors[1:] < 0.2 * errors[0]).all()


def test_energy_balances(few):
    """Kinetic + strain energy less the clamp's potential changes by works in and out.

    The scheme itself damps; what it takes is bounded and never negative.
    """
    s = few.structure
    steps = 600
    scheme = scheme_of(few, steps=steps)
    state = prestressed_full_state(scheme)
    load = 3e-4 * few.moment * np.sin(2 * np.pi * np.arange(2 * steps + 1) / steps)
    result = march_full(scheme, load, state)

    def energy(z):
        strain = 0.5 * z.x @ (s.stiffness @ z.x) - CLAMP * (s.loads["clamp"] @ z.x)
        return strain + 0.5 * z.rate @ (s.mass @ z.rate)

    gain = energy(result.state) - energy(state)
    lost = result.external - gain - result.dissipated - result.damping - result.normal_work
    print(f"work {result.external:.4g}, friction {result.dissipated:.4g}, missing {lost:.1e}")
    assert abs(lost) < 1e-3 * abs(result.external)


def test_prestressed_state_is_in_equilibrium(few):
    scheme = scheme_of(few)
    s, r = few.structure, few.start.solution.r
    state = prestressed_full_state(scheme)
    unbalanced = s.loads["clamp"] * CLAMP - s.interface.relative.T @ r - s.stiffness @ state.x
    assert np.abs(unbalanced).max() < 1e-8 * r.max()
    compression = np.abs(few.start.solution.v).max()
    assert s.interface.relative @ state.x == pytest.approx(
        few.start.solution.v, abs=1e-6 * compression
    )
    result = march_full(scheme, np.zeros(20), state)
    assert result.r == pytest.approx(np.tile(r, (20, 1)), abs=1e-6 * r.max())
    assert result.status[-1].tolist() == result.status[0].tolist()


def test_marching_may_be_interrupted(few):
    scheme = scheme_of(few)
    load = 1e-3 * few.moment * np.sin(2 * np.pi * np.arange(41) / STEPS)
    whole = march_full(scheme, load)
    first = march_full(scheme, load[:21])
    second = march_full(scheme, load[20:], first.state)
    assert second.r[-1] == pytest.approx(whole.r[-1], abs=1e-8 * whole.r.max())
    assert first.dissipated + second.dissipated == pytest.approx(whole.dissipated, rel=1e-6)


def test_refuses_what_it_cannot_march(few):
    with pytest.raises(ModelError, match="must be positive"):
        full_scheme(few.structure, few.joint, 0.0)
    with pytest.raises(ModelError, match="no load 'torque'; this structure has clamp, moment"):
        full_scheme(few.structure, few.joint, 1e-4, port="torque")
    elastic = contact_law(25, FRICTION, np.full(50, 1e-12))
    with pytest.raises(ModelError, match="rigid contact"):
        full_scheme(few.structure, replace(few.joint, law=elastic), 1e-4)
    other = build_reference(21, modes=20)
    scheme = full_scheme(other.structure, other.joint, 1e-4)
    moved = full_scheme(other.structure, other.joint.with_preload({"clamp": 2 * CLAMP}), 1e-4)
    assert prestressed_full_state(moved).x == pytest.approx(
        2 * prestressed_full_state(scheme).x, rel=1e-6, abs=1e-14
    )

"""Modal contact force in time: against equilibrium, energy and quasi-static cycles."""

from __future__ import annotations

import numpy as np
import pytest

from microslip.backbone import equivalent_table
from microslip.modal_force import (
    dynamic_equivalent,
    dynamic_modal_force,
    friction_modal_force,
    friction_table,
    phases,
    step_operators,
)
from microslip.states import linear_states
from microslip.statics import quasi_static_cycle
from microslip.timedomain import Request, solve_request


@pytest.fixture(scope="module")
def states(small_reference):
    pairs = np.flatnonzero(small_reference.start.touching)
    return linear_states(small_reference.structure, pairs, "moment")


def steady(reference, states, offset, moment, friction=0.25, steps=150):
    """Steady vibration at an offset (Hz) from the sliding frequency."""
    request = Request(
        rho=1.0,
        frequency=states.sliding_frequency + offset,
        load=moment * reference.moment,
        friction=friction,
        guess=0.0,
        steps=steps,
        tolerance=1e-7,
    )
    return solve_request(reference.model, reference.start, None, request).steady


@pytest.mark.parametrize("alpha", [0.0, 0.05, 0.2])
def test_operators_tend_to_derivatives_in_second_order(alpha):
    omega = 7.0
    errors = []
    for dt in (2e-3, 1e-3):
        velocity, acceleration = step_operators(omega * dt, dt, alpha)
        errors.append((abs(velocity / (1j * omega) - 1), abs(acceleration / -(omega**2) - 1)))
    for coarse, fine in np.array(errors).T:
        assert 3.5 < coarse / fine < 4.5


def test_operators_solve_a_linear_oscillator_marched_in_time():
    """Steady state of the scheme itself, marched until the transient is gone."""
    from microslip.transient import ALPHA, scheme_constants

    gamma, beta, a1 = scheme_constants(ALPHA)
    w, c, omega, steps = 3.0, 0.4, 2.5, 40
    dt = 2 * np.pi / omega / steps
    x = v = a = f_old = 0.0
    samples = []
    for k in range(1, 60 * steps + 1):
        f = np.sin(omega * k * dt)
        xp = x + dt * v + dt**2 * (0.5 - beta) * a
        vp = v + dt * (1 - gamma) * a
        rest = a1 * (f - c * vp - w**2 * xp) + ALPHA * (f_old - c * v - w**2 * x)
        a = rest / (1 + a1 * (gamma * dt * c + beta * dt**2 * w**2))
        x, v, f_old = xp + beta * dt**2 * a, vp + gamma * dt * a, f
        samples.append(x)
    theta = 2 * np.pi * np.arange(1, steps + 1) / steps
    X = 2j / steps * np.exp(-1j * theta) @ samples[-steps:]
    velocity, acceleration = step_operators(omega * dt, dt)
    assert (w**2 + c * velocity + acceleration) * X == pytest.approx(1.0, abs=1e-9)


def test_no_force_without_friction(small_reference, states):
    """The frictionless joint under a small load is the sliding state: nothing beyond it."""
    found = steady(small_reference, states, -3.0, 1e-7, friction=0.0)
    Q, F = dynamic_modal_force(found, small_reference.model, states, "moment", (1,))
    assert abs(F[0]) < 1e-4 * states.sliding_omega**2 * abs(Q[0])


def test_stuck_joint_has_the_stiffness_of_its_linear_modes(small_reference, states):
    """At vanishing amplitude everything sticks; at resonance of the stuck mode x = Phi_st q."""
    offset = states.stuck_frequency - states.sliding_frequency - 0.5
    found = steady(small_reference, states, offset, 1e-8)
    kappa = dynamic_equivalent(found, small_reference.model, states)
    expected = (states.stuck_omega / states.sliding_omega) ** 2 - 1
    assert kappa.real == pytest.approx(expected, rel=0.01)
    assert abs(kappa.imag) < 0.01 * expected


def test_work_of_the_force_is_the_friction_work(small_reference, states):
    found = steady(small_reference, states, 3.0, 4e-4)
    orders = range(1, 8)
    Q, F = dynamic_modal_force(found, small_reference.model, states, "moment", orders)
    work = np.pi * np.sum(np.arange(1, 8) * (F * Q.conj()).imag)
    # The rest is friction's work on the other modes.
    assert work == pytest.approx(found.cycle.dissipated, rel=0.03)


def test_phases_start_at_the_phase_of_the_load(small_reference, states):
    found = steady(small_reference, states, 3.0, 4e-4)
    load = found.load * np.sin(phases(found))
    np.testing.assert_allclose(load, found.cycle.load, atol=1e-9 * found.load)


def test_friction_alone_differs_from_the_whole_force_by_pressure_only(small_reference, states):
    """While no pair opens or closes the sliding mode has no normal motion for pressure to work on."""
    reference = small_reference
    cycle = quasi_static_cycle(
        reference.model,
        reference.flexibility,
        reference.start,
        "sliding",
        1e-6 * reference.moment * states.load_on_sliding["moment"],
        0.25,
        steps=60,
    )
    table = equivalent_table([cycle], reference.model, states, reference.start.clamp, "mode")
    alone = friction_table(
        table, [cycle], reference.model, reference.structure.interface, states
    )
    assert alone.k_eq[0] == pytest.approx(table.k_eq[0], rel=1e-4)


def test_friction_force_is_linear_in_the_reactions(small_reference, states):
    interface = small_reference.structure.interface
    r = np.random.default_rng(1).normal(size=(3, 2 * interface.pairs))
    pushed = r.copy()
    pushed[:, ::2] += 5.0
    one = friction_modal_force(r, interface, states)
    np.testing.assert_allclose(friction_modal_force(pushed, interface, states), one, rtol=1e-13)
    np.testing.assert_allclose(friction_modal_force(2 * r, interface, states), 2 * one, rtol=1e-13)

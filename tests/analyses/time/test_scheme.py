"""Time integration against closed forms, a direct linear solution and energy balances."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
import scipy.sparse.linalg as spla
from conftest import CLAMP, FRICTION, RAYLEIGH

from microslip.analyses.prepared.joint import prepare_joint
from microslip.analyses.prepared.prestress import opening_load
from microslip.analyses.time import scheme as transient
from microslip.analyses.time.scheme import (
    march,
    prestressed_state,
    time_scheme,
)
from microslip.analyses.time.steady import steady_state
from microslip.contact.law import contact_law
from microslip.contact.pairs import SEPARATED
from microslip.errors import ContactError, MicroslipError
from microslip.model.joint import JointModel
from microslip.model.modes import bonding
from microslip.numerics.fourier import harmonic

SMALL = 3e-5
"""Amplitude of the sliding mode that opens and closes no pair of the small joint."""


def oscillator(omega, dt, damping=0.0, **options):
    """One mode that the only contact pair does not see."""
    model = JointModel(
        position=np.zeros(1),
        area=np.ones(1),
        dimension=2,
        omega=np.array([omega]),
        equilibrium_modes=0,
        mode_v=np.zeros((2, 1)),
        residual=np.eye(2),
        ports=("clamp", "moment", "sliding"),
        port_modes=np.array([[0.0, 1.0, 1.0]]),
        port_v=np.array([[1.0, 0.0, 0.0], [0.0, 0.0, 0.0]]),
        port_port=np.zeros((3, 3)),
        rayleigh=(damping, 0.0),
    )
    joint = prepare_joint(model, contact_law(1, 0.3), {"clamp": 1.0}, "moment")
    return time_scheme(joint, dt, **options)


def energy(model, state, clamp, load, column):
    """Kinetic and strain energy less the potential of the clamp, from the state alone.

    The residual part is that of a linear elastic body under the forces on it: half the product of
    forces and their displacements, where those of contact are the elastic share of the reactions:
    what is dashpot in them stores nothing.
    """
    a = np.zeros(len(model.ports))
    a[model.port("clamp")] = clamp
    a[column] = load
    strain = 0.5 * np.sum((model.omega * state.eta) ** 2)
    elastic = np.linalg.solve(model.residual, model.port_v @ a - state.residual_v)
    residual = 0.5 * (
        a @ model.port_port @ a
        - 2 * elastic @ model.port_v @ a
        + elastic @ model.residual @ elastic
    )
    c = model.port("clamp")
    y = model.port_modes[:, c] @ state.eta + model.port_port[c] @ a - model.port_v[:, c] @ elastic
    return 0.5 * np.sum(state.rate**2) + strain + residual - clamp * y


# Linear oscillator


@pytest.mark.parametrize("damping", [0.0, 60.0, 2000.0, 3600.0])
@pytest.mark.parametrize("steps", [3.5, 20, 150])
def test_free_vibration_is_that_of_the_true_poles(damping, steps):
    """exp(lambda t) at every step, however long it is; also close to and beyond critical damping."""
    omega = 1234.5
    dt = 2 * np.pi / omega / steps
    scheme = oscillator(omega, dt, damping)
    x = march(scheme, prestressed_state(scheme, 1.0, omega), np.zeros(201)).output[:, 2]
    root = np.sqrt(complex(damping**2 / 4 - omega**2))
    t = dt * np.arange(201)
    free = np.exp((-damping / 2 + root) * t), np.exp((-damping / 2 - root) * t)
    basis = np.column_stack([free[0] + free[1], (free[0] - free[1]) / root]).real
    fit = np.linalg.lstsq(basis, x, rcond=None)[0]
    assert x == pytest.approx(basis @ fit, abs=1e-9 * np.abs(x).max())


def test_modes_beyond_the_reach_of_the_step_are_static():
    """Fewer than three steps in a period: the output follows the load."""
    omega = 1234.5
    load = np.sin(0.1 * np.arange(50))
    scheme = oscillator(omega, 2 * np.pi / omega / 2.9)
    assert len(scheme.joint.model.omega) == 0
    x = march(scheme, prestressed_state(scheme), load).output[:, 2]
    assert x == pytest.approx(load / omega**2, rel=1e-12)


def test_newmark_lengthens_the_period():
    """Poles not matched: tan(omega_numerical dt / 2) = omega dt / 2 of the trapezoidal rule."""
    omega, steps = 1234.5, 20
    dt = 2 * np.pi / omega / steps
    scheme = oscillator(omega, dt, matched=False)
    x = march(scheme, prestressed_state(scheme, 1.0, omega), np.zeros(201)).output[:, 2]
    slow = 2 * np.arctan(omega * dt / 2)
    n = np.arange(201)
    basis = np.column_stack([np.cos(slow * n), np.sin(slow * n)])
    fit = np.linalg.lstsq(basis, x, rcond=None)[0]
    assert x == pytest.approx(basis @ fit, abs=1e-9 * np.abs(x).max())


@pytest.mark.parametrize("ratio", [0.3, 0.97, 1.0, 1.6])
def test_linear_steady_state_has_no_error_of_the_step(ratio):
    """1/(omega² - Omega² + i c Omega) with twelve steps per cycle of the load."""
    omega, damping, steps = 1234.5, 10.0, 12
    drive = ratio * omega
    frequency = drive / (2 * np.pi)
    scheme = oscillator(omega, 1 / (frequency * steps), damping, frequency=frequency)
    exact = 1 / (omega**2 - drive**2 + 1j * drive * damping)
    found = steady_state(scheme, frequency, 1.0, tolerance=1e-10)
    x = harmonic(found.cycle.output[:, 2], 2 * np.pi * np.arange(steps + 1) / steps)
    error = abs(x - exact) / abs(exact)
    print(f"{error:.1e} after {found.cycles} cycles")
    assert error < 1e-8


def test_second_order():
    """Damped oscillator under a sine from rest against its closed form; halving dt quarters."""
    omega, damping, drive = 100.0, 3.0, 80.0
    end = 0.3
    errors = []
    for steps in (200, 400, 800):
        dt = end / steps
        scheme = oscillator(omega, dt, damping)
        t = dt * np.arange(steps + 1)
        x = march(scheme, prestressed_state(scheme), np.sin(drive * t)).output[:, 2]
        root = np.sqrt(omega**2 - damping**2 / 4)
        gain = 1 / (omega**2 - drive**2 + 1j * damping * drive)
        forced = np.imag(gain * np.exp(1j * drive * t))
        x0, v0 = -np.imag(gain), -drive * np.real(gain)
        free = np.exp(-damping * t / 2) * (
            x0 * np.cos(root * t) + (v0 + damping * x0 / 2) / root * np.sin(root * t)
        )
        errors.append(np.abs(x - forced - free).max() / np.abs(gain))
    ratio = np.array(errors[:-1]) / errors[1:]
    print(f"errors {errors}, ratios {ratio}")
    assert ratio == pytest.approx([4, 4], rel=0.03)


# Joint without friction: linear


def quiet(joint, friction=0.0, steps=150, frequency=None):
    frequency = frequency or joint.mode.sliding_frequency
    return time_scheme(joint.with_friction(friction), 1 / (frequency * steps))


def test_frictionless_response_is_the_direct_solution(small_reference):
    """(-w² M + (1 + i w beta) K) x = F on the full mesh, prestressed pairs bonded normally."""
    joint, s = small_reference.joint, small_reference.structure
    basis = bonding(s.interface.relative, joint.prestress.bonded(1))
    stiffness, mass = basis.T @ s.stiffness @ basis, basis.T @ s.mass @ basis
    force = basis.T @ s.loads["moment"]
    measure = basis.T @ (s.mass @ small_reference.states.sliding)
    steps = 300
    for shift in (-5.0, -0.3, 0.0, 0.3, 5.0):
        frequency = joint.mode.sliding_frequency + shift
        w = 2 * np.pi * frequency
        dynamic = (-(w**2) * mass + (1 + 1j * w * RAYLEIGH[1]) * stiffness).tocsc()
        direct = measure @ spla.spsolve(dynamic, force.astype(complex))
        load = SMALL / abs(direct)
        scheme = time_scheme(joint.with_friction(0.0), 1 / (frequency * steps), frequency=frequency)
        found = steady_state(scheme, frequency, load, tolerance=1e-6)
        assert found.converged
        separated = found.cycle.status == SEPARATED
        assert (separated == ~joint.prestress.touching).all()
        error = abs(found.amplitude / load - direct) / abs(direct)
        gap = abs(abs(found.amplitude) / load / abs(direct) - 1)
        print(f"{shift:+} Hz: complex {error:.1e}, amplitude {gap:.1e}, cycles {found.cycles}")
        assert gap < 1e-3
        assert error < 1e-3


def test_free_vibration_keeps_its_energy(small_reference):
    """No friction, no damping: 1,000 cycles."""
    model = replace(small_reference.model, rayleigh=(0.0, 0.0))
    joint = small_reference.joint.with_model(model)
    steps = 40
    scheme = quiet(joint, steps=steps)
    start = prestressed_state(scheme, SMALL, joint.mode.sliding_omega)
    model = scheme.joint.model

    def vibration_energy(state):
        """Of the deviation from prestress: the bonds of a contact that stays do no work."""
        eta, r = state.eta - start.eta, state.r - start.r
        kinetic = 0.5 * np.sum(state.rate**2)
        return kinetic + 0.5 * np.sum((model.omega * eta) ** 2) + 0.5 * r @ model.residual @ r

    state, first, worst = start, vibration_energy(start), 0.0
    for _ in range(50):
        result = march(scheme, state, np.zeros(20 * steps + 1))
        state = result.state
        worst = max(worst, abs(vibration_energy(state) - first) / first)
    print(f"energy change {worst:.1e}, friction {result.dissipated:.1e}")
    assert worst < 1e-6


# Joint with friction


def test_energy_is_never_made(small_reference):
    """Large moment near opening, suddenly applied: energy stays below its start plus the work.

    Work of the load from load and output by the trapezoidal
    rule, energy from the state.
    """
    joint = small_reference.joint
    model = joint.model
    column = model.port("moment")
    limit = opening_load(model, joint.prestress, "moment")
    for friction in (0.0, 0.25, 1.0):
        for steps in (60, 400):
            scheme = quiet(joint, friction, steps)
            state = prestressed_state(scheme)
            level = 0.3 * limit
            rest = energy(scheme.joint.model, state, CLAMP, 0.0, column)
            work, worst, top, opened = 0.0, -np.inf, 0.0, 0
            loads = level * (np.arange(20 * steps + 1) > 0)
            for k in range(0, len(loads) - 1, 5):
                part = march(scheme, state, loads[k : k + 6])
                y = part.output[:, column]
                work += np.sum(0.5 * (part.load[1:] + part.load[:-1]) * np.diff(y))
                state = part.state
                stored = energy(scheme.joint.model, state, CLAMP, loads[k + 5], column) - rest
                worst = max(worst, stored - work)
                top = max(top, abs(stored))
                opened = max(opened, int((state.status == SEPARATED).sum()))
            print(
                f"mu {friction}, {steps} steps: worst excess {worst / top:.1e} of {top:.3g} J/m, "
                f"open pairs up to {opened} of {model.pairs}"
            )
            assert worst <= 1e-6 * top


def bounced(joint, clamp, share, friction, steps, cycles, *, free):
    """Worst excess of energy over what load and friction leave, relative; changes of contact.

    Free: a moment raised slowly to `share` of the one that opens the joint, then let go. Else a
    sine of that amplitude at 0.4 of the sliding frequency, from rest. Energy from the state alone,
    booked 30 times per cycle.
    """
    model = joint.model
    column = model.port("moment")
    joint = joint.with_preload({"clamp": clamp}).with_friction(friction)
    level = share * opening_load(model, joint.prestress, "moment")
    scheme = time_scheme(joint, 2 * np.pi / (joint.mode.sliding_omega * steps))
    model = scheme.joint.model
    time = np.arange(cycles * steps + 1) / steps
    if free:
        raised = np.arange(10 * steps + 1) / (10 * steps)
        loads = np.append(0.5 * level * (1 - np.cos(np.pi * raised)), 0 * time)
    else:
        loads = level * np.sin(2 * np.pi * 0.4 * time)
    state = prestressed_state(scheme)
    rest = energy(model, state, clamp, 0.0, column)
    work = friction_work = top = 0.0
    excess, changes = [], 0
    stride = steps // 30
    for k in range(0, len(loads) - 1, stride):
        part = march(scheme, state, loads[k : k + stride + 1], keep=True)
        y = part.output[:, column]
        work += np.sum(0.5 * (part.load[1:] + part.load[:-1]) * np.diff(y))
        friction_work += part.dissipated
        state = part.state
        stored = energy(model, state, clamp, part.load[-1], column) - rest
        excess.append(stored + max(friction_work, 0.0) - work)
        top = max(top, abs(stored))
        changes += int(np.abs(np.diff(part.status == SEPARATED, axis=0)).sum())
    return max(excess) / top, changes


SHARES = (0.3, 0.6, 0.95)


@pytest.mark.parametrize("free", [True, False], ids=["let go", "driven"])
@pytest.mark.parametrize("share", SHARES)
def test_bouncing_tips_make_no_energy(small_reference, share, free):
    """Light clamp; up to 50 of 51 pairs bounce: energy + friction work stay below external work."""
    for friction, steps in ((0.0, 150), (0.25, 60), (0.25, 150), (1.0, 400)):
        worst, changes = bounced(small_reference.joint, 1e4, share, friction, steps, 8, free=free)
        print(f"mu {friction}, {steps} steps: excess {worst:.1e}, {changes} changes of contact")
        assert worst <= 1e-9
        assert changes > 400


@pytest.mark.validate
@pytest.mark.parametrize("free", [True, False], ids=["let go", "driven"])
@pytest.mark.parametrize("share", SHARES)
def test_bouncing_for_long(reference, share, free, finding):
    """201 pairs, 2400 steps, coarse and fine, all frictions."""
    for friction in (0.0, 0.25, 1.0):
        for steps, cycles in ((60, 40), (150, 16)):
            worst, changes = bounced(
                reference.joint, 1e4, share, friction, steps, cycles, free=free
            )
            print(f"mu {friction}, {steps} steps: excess {worst:.1e}, {changes} changes")
            finding("energy that a bouncing joint gains, 2400 steps", worst, at_most=1e-9)


@pytest.mark.parametrize("load", [1e-5, 1e-4, 3e-4])
def test_energy_of_a_steady_cycle_balances(small_reference, load):
    """Work of the load = friction + damping of the modes and of the residual part + scheme.

    To 1e-7: what the prestress stores is moved between modes and residual part by the smallest drift.
    """
    frequency = small_reference.joint.mode.sliding_frequency + 1.0
    amplitude = load * small_reference.moment
    scheme = quiet(small_reference.joint, FRICTION, 300, frequency)
    found = steady_state(scheme, frequency, amplitude, tolerance=1e-7)
    assert found.converged
    c = found.cycle
    lost = c.dissipated + c.modal_damping + c.residual_damping + c.normal_work
    theta = 2 * np.pi * np.arange(301) / 300
    y = harmonic(c.output[:, scheme.joint.model.port("moment")], theta)
    print(
        f"M/PL {load}: external {c.external:.6g}, friction {c.dissipated / c.external:.5f}, modal "
        f"{c.modal_damping / c.external:.5f}, residual {c.residual_damping / c.external:.1e}, normal "
        f"{c.normal_work / c.external:.1e}, missing {1 - lost / c.external:.1e}, change "
        f"{found.change:.1e}, cycles {found.cycles}"
    )
    assert lost == pytest.approx(c.external, rel=2e-3)
    assert c.external == pytest.approx(-np.pi * amplitude * y.imag, rel=2e-3)


def test_refuses_what_it_cannot_march(small_reference, monkeypatch):
    scheme = quiet(small_reference.joint)
    with pytest.raises(MicroslipError, match="not finite at step 1"):
        march(scheme, prestressed_state(scheme), np.array([0.0, np.nan, 0.0]))
    monkeypatch.setattr(transient, "CERTIFICATE", -1.0)
    with pytest.raises(ContactError, match=r"at t = 7\.\d+ s \(step"):
        march(scheme, prestressed_state(scheme), np.zeros(3), start_time=7.0)
    with pytest.raises(MicroslipError, match="must be positive"):
        time_scheme(small_reference.joint, 0.0)

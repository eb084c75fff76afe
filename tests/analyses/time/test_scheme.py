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
    amplification,
    march,
    period_error,
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


def oscillator(omega, dt, alpha, damping=0.0):
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
    return time_scheme(joint, dt, alpha=alpha)


def energy(model, state, clamp, load, column):
    """Kinetic and strain energy less the potential of the clamp, from the state alone.

    The residual part is that of a linear elastic body under the forces on it: half the product of
    forces (ports, reactions) and their displacements.
    """
    a = np.zeros(len(model.ports))
    a[model.port("clamp")] = clamp
    a[column] = load
    strain = 0.5 * np.sum((model.omega * state.eta) ** 2)
    residual = 0.5 * (
        a @ model.port_port @ a
        - 2 * state.r @ model.port_v @ a
        + state.r @ model.residual @ state.r
    )
    c = model.port("clamp")
    y = model.port_modes[:, c] @ state.eta + model.port_port[c] @ a - model.port_v[:, c] @ state.r
    return 0.5 * np.sum(state.rate**2) + strain + residual - clamp * y


# Linear oscillator


@pytest.mark.parametrize("alpha", [0.0, 0.05, 0.3])
@pytest.mark.parametrize("steps", [20, 150])
def test_period_error_is_the_one_measured(alpha, steps):
    """Zero crossings of a marched free vibration, with omega far from any scale of the code."""
    omega = 1234.5
    dt = 2 * np.pi / omega / steps
    scheme = oscillator(omega, dt, alpha)
    cycles = 200 if steps == 20 else 60
    x = march(scheme, prestressed_state(scheme, 1.0, omega), np.zeros(cycles * steps + 1)).output[
        :, 2
    ]
    n = np.arange(len(x))
    early, late = x[: len(x) // 2], x[len(x) // 2 :]
    rho = (np.linalg.norm(late[: len(early)]) / np.linalg.norm(early)) ** (1 / len(early))
    wave = x / rho**n
    up = np.flatnonzero((wave[:-1] < 0) & (wave[1:] >= 0))
    crossing = up + wave[up] / (wave[up] - wave[up + 1])
    period = (crossing[-1] - crossing[0]) / (len(crossing) - 1)
    assert period / steps - 1 == pytest.approx(period_error(omega * dt, alpha), rel=2e-3)
    if alpha == 0.0:
        assert period_error(omega * dt, 0.0) == pytest.approx((omega * dt) ** 2 / 12, rel=0.02)


def test_period_error_of_the_trapezoidal_rule():
    """alpha = 0: tan(omega_numerical dt / 2) = omega dt / 2."""
    for w in (0.01, 0.1, 1.0, 3.0):
        assert period_error(w, 0.0) == pytest.approx(w / (2 * np.arctan(w / 2)) - 1, rel=1e-6)


@pytest.mark.parametrize("alpha", [0.0, 0.05])
def test_second_order(alpha):
    """Damped oscillator under a sine from rest against its closed form; halving dt quarters."""
    omega, damping, drive = 100.0, 3.0, 80.0
    end = 0.3
    errors = []
    for steps in (200, 400, 800):
        dt = end / steps
        scheme = oscillator(omega, dt, alpha, damping)
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
    print(f"alpha {alpha}: errors {errors}, ratios {ratio}")
    assert ratio == pytest.approx([4, 4], rel=0.03)


def test_numerical_damping_is_at_high_frequency_only():
    """Spectral radius: third order at low frequency, (1 - alpha)/(1 + alpha) at infinity."""

    def damping_ratio(w):
        values = np.linalg.eigvals(amplification(w, 0.05))
        value = values[np.argmax(np.abs(values.imag))]
        return -np.log(abs(value)) / abs(np.angle(value))

    low = np.array([damping_ratio(2 * np.pi / n) for n in (75, 150, 300)])
    print(f"damping ratio at 75, 150, 300 steps per cycle: {low}")
    assert low[1] < 0.01 * 3.9e-4
    assert low[:-1] / low[1:] == pytest.approx([8, 8], rel=0.05)
    radius = np.abs(np.linalg.eigvals(amplification(1e6, 0.05))).max()
    assert radius == pytest.approx((1 - 0.05) / (1 + 0.05), rel=1e-3)
    for alpha in (0.0, 0.05, 1 / 3):
        for w in np.geomspace(1e-3, 1e6, 60):
            assert np.abs(np.linalg.eigvals(amplification(w, alpha))).max() <= 1 + 1e-7


# Joint without friction: linear


def quiet(joint, friction=0.0, steps=150, frequency=None, **options):
    frequency = frequency or joint.mode.sliding_frequency
    return time_scheme(joint.with_friction(friction), 1 / (frequency * steps), **options)


def test_frictionless_response_is_the_direct_solution(small_reference):
    """(-w² M + (1 + i w beta) K) x = F on the full mesh, prestressed pairs bonded normally."""
    joint, s = small_reference.joint, small_reference.structure
    basis = bonding(s.interface.relative, joint.prestress.bonded(1))
    stiffness, mass = basis.T @ s.stiffness @ basis, basis.T @ s.mass @ basis
    force = basis.T @ s.loads["moment"]
    measure = basis.T @ (s.mass @ small_reference.states.sliding)
    steps = 300
    stretch = 1 + period_error(2 * np.pi / steps)
    for shift in (-5.0, -0.3, 0.0, 0.3, 5.0):
        frequency = joint.mode.sliding_frequency + shift
        w = 2 * np.pi * frequency
        dynamic = (-(w**2) * mass + (1 + 1j * w * RAYLEIGH[1]) * stiffness).tocsc()
        direct = measure @ spla.spsolve(dynamic, force.astype(complex))
        load = SMALL / abs(direct)
        scheme = quiet(joint, steps=steps, frequency=frequency / stretch)
        found = steady_state(scheme, frequency / stretch, load, tolerance=1e-6)
        assert found.converged
        separated = found.cycle.status == SEPARATED
        assert (separated == ~joint.prestress.touching).all()
        error = abs(found.amplitude / load - direct) / abs(direct)
        gap = abs(abs(found.amplitude) / load / abs(direct) - 1)
        print(f"{shift:+} Hz: complex {error:.1e}, amplitude {gap:.1e}, cycles {found.cycles}")
        assert gap < 1e-3
        assert error < 1e-3


def test_free_vibration_keeps_its_energy(small_reference):
    """No friction, no damping, no numerical damping: 1,000 cycles."""
    model = replace(small_reference.model, rayleigh=(0.0, 0.0))
    joint = small_reference.joint.with_model(model)
    steps = 40
    scheme = quiet(joint, steps=steps, alpha=0.0)
    start = prestressed_state(scheme, SMALL, joint.mode.sliding_omega)

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
            rest = energy(model, state, CLAMP, 0.0, column)
            work, worst, top, opened = 0.0, -np.inf, 0.0, 0
            loads = level * (np.arange(20 * steps + 1) > 0)
            for k in range(0, len(loads) - 1, 5):
                part = march(scheme, state, loads[k : k + 6])
                y = part.output[:, column]
                work += np.sum(0.5 * (part.load[1:] + part.load[:-1]) * np.diff(y))
                state = part.state
                stored = energy(model, state, CLAMP, loads[k + 5], column) - rest
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
def test_bouncing_for_long(reference, share, free):
    """201 pairs, 40 cycles, all steps and frictions."""
    for friction in (0.0, 0.25, 1.0):
        for steps in (60, 150):
            worst, changes = bounced(reference.joint, 1e4, share, friction, steps, 40, free=free)
            print(f"mu {friction}, {steps} steps: excess {worst:.1e}, {changes} changes")
            assert worst <= 1e-9


@pytest.mark.parametrize("load", [1e-5, 1e-4, 3e-4])
def test_energy_of_a_steady_cycle_balances(small_reference, load):
    """Work of the load = friction + damping of the modes and of the residual part + scheme."""
    frequency = small_reference.joint.mode.sliding_frequency + 1.0
    amplitude = load * small_reference.moment
    scheme = quiet(small_reference.joint, FRICTION, 300, frequency)
    found = steady_state(scheme, frequency, amplitude)
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

"""Backbones against closed forms, linear limits, scaling, each other and the forced response."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from conftest import FRICTION, times

from microslip.analyses.backbone import extended_motion
from microslip.analyses.backbone.cycles import (
    CycleControl,
    prescribed_backbone,
    quasi_static_backbone,
)
from microslip.analyses.backbone.extended_motion import harmonic_backbone
from microslip.analyses.backbone.points import amplitude_scale, geometric, material_damping
from microslip.analyses.harmonic.paths import LoadPath
from microslip.analyses.harmonic.points import describe
from microslip.analyses.harmonic.problem import harmonic_problem
from microslip.analyses.harmonic.raising import raise_load
from microslip.analyses.prepared.joint import prepare_joint
from microslip.analyses.prepared.joint_modes import joint_modes, pick_mode
from microslip.contact.law import contact_law
from microslip.contact.pairs import normal_rows, tangential_rows
from microslip.errors import MicroslipError, ModelError
from microslip.model.joint import JointModel, bonded_modes
from microslip.model.modes import linear_modes
from microslip.numerics.continuation import ContinuationError, first_point

FINE = CycleControl(steps=2000, cycles=3, closure=1e-9)
CLAMP = 100.0
SPRING = 4e5
"""Sliding stiffness of the single mass, N/m."""


@pytest.fixture(scope="module")
def modes(small_reference):
    joint = small_reference.joint
    return joint_modes(joint.model, joint.prestress, joint.law)


def sliders(stiffness, limit, idle=False):
    """A mass of one kilogram on a spring, and on Jenkins elements in parallel.

    Reaction of element i: stiffness[i] up to limit[i], which shares out the clamp force.
    """
    m = len(stiffness)
    n, t = normal_rows(), tangential_rows()
    soft = np.full(m, 1e-9)
    residual = np.zeros((2 * m, 2 * m))
    residual[n, n] = np.diag(soft)
    residual[t, t] = np.diag(1 / stiffness)
    port_v = np.zeros((2 * m, 2))
    port_v[n, 0] = soft * limit / limit.sum()
    psi = np.zeros((2 * m, 2 if idle else 1))
    psi[t, 0] = 1.0
    count = psi.shape[1]
    return JointModel(
        position=np.arange(float(m)),
        area=np.ones(m),
        dimension=2,
        omega=np.sqrt(SPRING) * np.array([1.0, 3.0][:count]),
        equilibrium_modes=0,
        mode_v=psi,
        residual=residual,
        ports=("clamp", "moment"),
        port_modes=np.zeros((count, 2)),
        port_v=port_v,
        port_port=np.zeros((2, 2)),
        rayleigh=(0.2, 1e-6),
    )


def pressed(model):
    """The sliders prepared, and their modes."""
    joint = prepare_joint(model, contact_law(model.pairs, FRICTION), {"clamp": CLAMP}, "moment")
    return joint, joint_modes(model, joint.prestress, joint.law)


def material(omega):
    return (0.2 + 1e-6 * omega**2) / (2 * omega)


@pytest.fixture(scope="module")
def jenkins():
    """One element: k_t = 0.2 of the spring, slipping beyond 25 N."""
    joint, modes = pressed(sliders(np.array([0.2 * SPRING]), np.ones(1)))
    return joint, modes[0]


SLIP = FRICTION * CLAMP / (0.2 * SPRING)
"""Amplitude at which the Jenkins element begins to slip."""
TOLERANCE = {"prescribed": (1e-4, 2e-3), "harmonic": (1e-3, 1e-2)}
"""Of frequency and damping ratio: 2000 steps per cycle, or 128 samples."""
REACH = SLIP * np.array([0.5, 1.2, 2.0, 5.0, 20.0])


def test_quasi_static_jenkins(jenkins):
    """Secant ``k + f/a`` and loop ``4 f (a - a_slip)``."""
    joint, mode = jenkins
    load = SPRING * REACH + np.minimum(0.2 * SPRING * REACH, FRICTION * CLAMP)
    found, failures = quasi_static_backbone(joint, mode, load / mode.sliding_omega**2, control=FINE)
    assert failures == []
    assert found.amplitude == pytest.approx(REACH, rel=1e-9)
    omega = np.sqrt(load / REACH)
    assert 2 * np.pi * found.frequency == pytest.approx(omega, rel=1e-9)
    loop = 4 * FRICTION * CLAMP * np.maximum(REACH - SLIP, 0)
    zeta = loop / (2 * np.pi * omega**2 * REACH**2) + material(omega)
    assert found.damping_ratio == pytest.approx(zeta, rel=2e-3)


def jenkins_harmonics(a):
    """First-harmonic stiffness and loss of the element over its own stiffness."""
    ratio = np.minimum(SLIP / a, 1.0)
    angle = np.arccos(1 - 2 * ratio)
    stiffness = (angle - 0.5 * np.sin(2 * angle)) / np.pi
    return stiffness, np.sin(angle) ** 2 / np.pi


@pytest.mark.parametrize("method", ["prescribed", "harmonic"])
def test_nonlinear_mode_of_a_jenkins_element(jenkins, method):
    """``omega² = k + k_t s(a)``, and the loss of one harmonic: sin(q) prescribed, or H = 1."""
    joint, mode = jenkins
    if method == "prescribed":
        found, failures = prescribed_backbone(joint, mode, REACH, control=FINE)
    else:
        found, failures = harmonic_backbone(joint, mode, REACH, harmonics=1)
    assert failures == []
    # the spring that prescribes q yields by k_t over a hundred times k
    assert found.amplitude == pytest.approx(REACH, rel=0.2 / 99)
    s, g = jenkins_harmonics(found.amplitude)
    omega = np.sqrt(SPRING * (1 + 0.2 * s))
    zeta = 0.2 * SPRING * g / (2 * omega**2) + material(omega)
    assert 2 * np.pi * found.frequency == pytest.approx(omega, rel=TOLERANCE[method][0])
    assert found.damping_ratio == pytest.approx(zeta, rel=TOLERANCE[method][1])


def test_quasi_static_iwan():
    """Sliders that yield evenly up to ``x_m``: ``F = k (x - x²/(2 x_m))``, ``2 k a³/(3 x_m)``."""
    count = 200
    yields = (np.arange(count) + 0.5) / count
    k = 0.2 * SPRING
    joint, modes = pressed(sliders(np.full(count, k / count), yields))
    mode = modes[0]
    last = 2 * FRICTION * CLAMP / k
    a = last * np.array([0.1, 0.3, 0.6, 0.95])
    load = SPRING * a + k * (a - a**2 / (2 * last))
    found, failures = quasi_static_backbone(
        joint,
        mode,
        load / mode.sliding_omega**2,
        control=CycleControl(steps=400, cycles=3),
    )
    assert failures == []
    omega = np.sqrt(load / a)
    assert 2 * np.pi * found.frequency == pytest.approx(omega, rel=1e-5)
    zeta = k * a / (3 * np.pi * last * omega**2) + material(omega)
    assert found.damping_ratio == pytest.approx(zeta, rel=5e-3)


@pytest.mark.parametrize("number", [1, 2, 3, 4])
def test_small_amplitudes_are_the_stuck_mode(small_reference, modes, number):
    """Both forms of the nonlinear mode, and the modes of the finite elements themselves."""
    joint, mode = small_reference.joint, pick_mode(modes, number)
    size = [1e-5 * amplitude_scale(joint, mode)]
    zeta = material_damping(joint.model, mode.stuck_omega)
    for method in (prescribed_backbone, harmonic_backbone):
        found, failures = method(joint, mode, size)
        assert failures == []
        assert found.frequency[0] == pytest.approx(mode.stuck_frequency, rel=1e-7)
        assert found.damping_ratio[0] == pytest.approx(zeta, rel=1e-5)
    elements = linear_modes(small_reference.structure, joint.prestress.bonded(2), 8).frequency
    assert np.abs(elements / mode.stuck_frequency - 1).min() < 1e-5


@pytest.mark.parametrize("number", [1, 2, 3])
def test_quasi_static_limit_lacks_the_inertia_of_the_other_modes(small_reference, modes, number):
    """``omega² = 1 / sum (c_n/omega_n)²`` over the stuck modes: off by the change of shape."""
    joint, mode = small_reference.joint, pick_mode(modes, number)
    omega, shapes = bonded_modes(joint.model, joint.prestress.bonded(2))
    expected = 1 / np.sqrt(np.sum((mode.sliding @ shapes) ** 2 / omega**2))
    size = [1e-5 * amplitude_scale(joint, mode)]
    found, _ = quasi_static_backbone(joint, mode, size)
    assert 2 * np.pi * found.frequency[0] == pytest.approx(expected, rel=1e-7)
    assert abs(expected / mode.stuck_omega - 1) > 1e-4


def test_amplitude_over_clamp_alone_matters(small_reference, modes):
    joint, mode = small_reference.joint, modes[0]
    tripled = replace(joint, prestress=times(joint.prestress, 3))
    a = np.array([1e-3, 2e-2])
    for method in (quasi_static_backbone, prescribed_backbone):
        one, _ = method(joint, mode, a)
        three, _ = method(tripled, mode, 3 * a)
        assert three.amplitude == pytest.approx(3 * one.amplitude, rel=1e-6)
        assert three.frequency == pytest.approx(one.frequency, rel=1e-7)
        assert three.damping_ratio == pytest.approx(one.damping_ratio, rel=1e-5)
        assert three.scale == pytest.approx(3 * one.scale, rel=1e-9)


@pytest.mark.parametrize(
    ("number", "fraction", "frequency", "damping"),
    [
        (1, 0.003, 1e-4, 0.03),
        pytest.param(1, 0.15, 4e-4, 0.03, marks=pytest.mark.validate),
        (2, 0.003, 1e-5, 0.01),
        pytest.param(2, 0.15, 4e-4, 0.03, marks=pytest.mark.validate),
        (3, 0.003, 1e-4, 0.02),
    ],
)
def test_prescribed_motion_against_harmonic_balance(
    small_reference, modes, number, fraction, frequency, damping, finding
):
    """Two routes to the nonlinear mode; higher harmonics and the mean tell them apart."""
    joint, mode = small_reference.joint, pick_mode(modes, number)
    sizes = fraction * amplitude_scale(joint, mode) * np.array([0.25, 1.0])
    cycles, failures = prescribed_backbone(joint, mode, sizes)
    balance, more = harmonic_backbone(joint, mode, sizes, harmonics=5)
    assert failures == more == []
    assert max(p.residual for p in (*cycles.points, *balance.points)) < 1e-8
    for name, allowed in (("frequency", frequency), ("damping_ratio", damping)):
        off = abs(getattr(cycles, name)[-1] / getattr(balance, name)[-1] - 1)
        what = f"{name.replace('_', ' ')} of mode {number}, prescribed against harmonic balance"
        finding(what, off, at_most=allowed)


def test_a_branch_that_does_not_start_from_rest_starts_from_the_outer_iteration(
    small_reference, modes, monkeypatch
):
    """With all unknowns at once, or frequency and damping by turns: the same first motion and branch."""
    joint, mode = small_reference.joint, modes[0]
    sizes = amplitude_scale(joint, mode) * np.array([0.003, 0.01])
    expected, _ = harmonic_backbone(joint, mode, sizes, harmonics=3)
    from_rest = []

    def refusing(path, u, p, control, *direction):
        if not from_rest:
            from_rest.append(u)
            raise ContinuationError("no point near")
        return first_point(path, u, p, control, *direction)

    monkeypatch.setattr(extended_motion, "first_point", refusing)
    found, failures = harmonic_backbone(joint, mode, sizes, harmonics=3)
    assert from_rest
    assert failures == []
    assert found.frequency == pytest.approx(expected.frequency, rel=1e-7)
    assert found.damping_ratio == pytest.approx(expected.damping_ratio, rel=1e-5)


def test_motions_of_the_joint_as_a_whole_change_no_backbone(small_reference):
    """Rigid motions of a joint that nothing holds, which move its pairs by rounding alone."""
    joint, more = small_reference.joint, 3
    model = joint.model
    rounding = 1e-14 * np.random.default_rng(1).uniform(-1, 1, (len(model.mode_v), more))
    size = np.abs(model.mode_v).max()
    free = replace(
        model,
        omega=np.concatenate([np.full(more, 0.1), model.omega]),
        equilibrium_modes=model.equilibrium_modes + more,
        mode_v=np.hstack([size * rounding, model.mode_v]),
        port_modes=np.pad(model.port_modes, ((more, 0), (0, 0))),
        supports=np.pad(model.supports, (more, 0))
        + np.diag([0.01] * more + [0] * len(model.omega)),
        bodies=replace(model.bodies, modes=np.pad(model.bodies.modes, ((more, 0), (0, 0)))),
        image=None,
    )
    preload = joint.prestress.preload
    loose = prepare_joint(free, joint.law, preload, joint.drive)
    found = []
    for each in (joint, loose):
        mode = joint_modes(each.model, each.prestress, each.law)[0]
        sizes = amplitude_scale(joint, joint_modes(model, joint.prestress, joint.law)[0])
        found.append(prescribed_backbone(each, mode, sizes * np.array([1e-5, 1e-2])))
    (expected, _), (points, failures) = found
    assert failures == []
    assert points.frequency == pytest.approx(expected.frequency, rel=1e-7)
    assert points.damping_ratio == pytest.approx(expected.damping_ratio, rel=1e-5)


def test_quasi_static_against_the_nonlinear_mode(small_reference, modes):
    """The first mode: its stuck and sliding shapes agree to 1e-4, so inertia hardly matters."""
    joint, mode = small_reference.joint, modes[0]
    sizes = amplitude_scale(joint, mode) * geometric(1e-3, 0.3, 12)
    static, _ = quasi_static_backbone(joint, mode, sizes)
    dynamic, _ = prescribed_backbone(joint, mode, static.amplitude)
    assert static.frequency == pytest.approx(dynamic.frequency, rel=2e-3)
    assert static.damping_ratio == pytest.approx(dynamic.damping_ratio, rel=0.1)


def test_forced_response_passes_through_the_backbone(small_reference, modes):
    """Under the moment that makes up for the damping, the joint answers a quarter cycle late."""
    joint, mode = small_reference.joint, modes[0]
    model = joint.model
    size = 0.05 * amplitude_scale(joint, mode)
    found, _ = prescribed_backbone(joint, mode, [size])
    point = found.points[0]
    push = abs(mode.sliding @ model.port_modes[:, model.port("moment")])
    load = 2 * point.damping_ratio * point.omega**2 * point.amplitude / push
    problem = harmonic_problem(joint, harmonics=5)
    frequency = point.omega / (2 * np.pi)
    w, _ = raise_load(problem, frequency, load)
    answer = describe(LoadPath(problem, frequency, load).at(w, load), 0, 0.0)
    lag = abs(np.degrees(answer.phase))
    assert abs(answer.amplitude) == pytest.approx(point.amplitude, rel=0.03)
    assert lag == pytest.approx(90, abs=3)


def test_partners_are_close_and_ordered(small_reference, modes):
    assert [mode.number for mode in modes] == list(range(1, len(modes) + 1))
    states = small_reference.states
    assert (np.diff([mode.sliding_omega for mode in modes]) > 0).all()
    assert modes[0].sliding_omega == pytest.approx(states.sliding_omega, rel=1e-5)
    assert modes[0].stuck_omega == pytest.approx(states.stuck_omega, rel=1e-5)
    assert min(mode.assurance for mode in modes[:5]) > 0.9


def test_a_mode_that_does_not_exist_is_named(modes):
    with pytest.raises(ModelError, match=f"no mode 500.* has {len(modes)} modes"):
        pick_mode(modes, 500)


def test_a_mode_that_leaves_the_interface_alone():
    joint, modes = pressed(sliders(np.array([0.2 * SPRING]), np.ones(1), idle=True))
    mode = modes[1]
    assert amplitude_scale(joint, mode) == np.inf
    found, failures = prescribed_backbone(joint, mode, [1.0])
    assert failures == []
    assert not found.interface_matters
    assert 2 * np.pi * found.frequency[0] == pytest.approx(mode.sliding_omega, rel=1e-9)
    assert found.damping_ratio[0] == pytest.approx(material(mode.sliding_omega), rel=1e-9)


def test_amplitudes_that_open_the_joint_are_named(small_reference, modes):
    joint, mode = small_reference.joint, modes[0]
    scale = amplitude_scale(joint, mode)
    found, failures = quasi_static_backbone(joint, mode, [0.1 * scale, 1.1 * scale])
    assert len(found.points) == 1
    assert len(failures) == 1
    assert failures[0].stage == "backbone"
    assert "mode 1" in failures[0].where
    assert "opens the joint" in failures[0].reason


@pytest.mark.parametrize("limits", [(0.0, 1.0, 5), (1.0, 1.0, 5), (0.1, 1.0, 1), (0.1, np.inf, 5)])
def test_bad_amplitudes_are_refused(limits):
    with pytest.raises(MicroslipError, match="amplitudes"):
        geometric(*limits)

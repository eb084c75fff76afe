"""Damping that couples the modes: closed forms, and what it says where it is alpha M + beta K after all."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
import scipy.linalg as sl
from conftest import build_reference
from spatial_twin import spatial_joint

from microslip.analyses.backbone.cycles import (
    CycleControl,
    prescribed_backbone,
    quasi_static_backbone,
)
from microslip.analyses.backbone.extended_motion import harmonic_backbone
from microslip.analyses.backbone.points import amplitude_scale
from microslip.analyses.harmonic.hill import hill_exponents
from microslip.analyses.harmonic.over_time import state_from_point
from microslip.analyses.harmonic.paths import LoadPath
from microslip.analyses.harmonic.points import describe
from microslip.analyses.harmonic.problem import harmonic_problem
from microslip.analyses.harmonic.raising import raise_load
from microslip.analyses.prepared.joint_modes import joint_modes
from microslip.analyses.reduced.outputs import response_motion
from microslip.analyses.reduced.refined import refined_table
from microslip.analyses.reduced.resonance import linear_resonance, resonance_of
from microslip.analyses.reduced.response import forced_response
from microslip.analyses.reduced.surface import load_surface
from microslip.analyses.reduced.trust import error_indicator
from microslip.analyses.reduced.two_mode import VARIANTS, two_mode_model
from microslip.analyses.statics.held import hold_mode
from microslip.analyses.time.coupled import matched_matrices
from microslip.analyses.time.energy import mechanical_energy, reaction_energy
from microslip.analyses.time.floquet import floquet_multipliers
from microslip.analyses.time.readings import equivalent_of
from microslip.analyses.time.scheme import march, prestressed_state, time_scheme
from microslip.analyses.time.steady import steady_state
from microslip.model.joint import bonded_modes

ALPHA = 25.0


@pytest.fixture(scope="module")
def planar():
    """The reference joint with few pairs, damped by mass too."""
    joint = build_reference(21, modes=24).joint
    return replace(joint, model=replace(joint.model, rayleigh=(ALPHA, 2e-6)))


@pytest.fixture(scope="module")
def spatial(planar):
    return spatial_joint(planar, 0.6)


@pytest.fixture(params=["planar", "spatial"])
def joint(request):
    return request.getfixturevalue(request.param)


def by_all_modes(joint):
    """The same damping with alpha as that of all modes of the stuck joint, ``P diag(alpha) P^T``."""
    _, shapes = bonded_modes(joint.model, joint.prestress.bonded(joint.model.dimension))
    D = ALPHA * shapes @ shapes.T
    assert np.abs(D - ALPHA * np.eye(len(D))).max() > 0
    model = replace(joint.model, rayleigh=(0.0, joint.model.rayleigh[1]), damping=D)
    return replace(joint, model=model)


def not_in_proportion(joint, seed=5, size=40.0):
    """Every pair of modes coupled, positive."""
    k = len(joint.model.omega)
    half = np.random.default_rng(seed).standard_normal((k, 6))
    return replace(joint, model=replace(joint.model, damping=size * half @ half.T))


def loads(joint, share):
    return share * joint.prestress.force * 0.2515


def periodic(joint, frequency, load, harmonics):
    """The response by harmonic balance."""
    problem = harmonic_problem(joint, harmonics=harmonics)
    w, _ = raise_load(problem, frequency, load)
    return describe(LoadPath(problem, frequency, load).at(w, load), 0, 0.0)


def test_the_step_has_the_poles_of_the_true_motion():
    """Against the matrix exponential, a mode without stiffness nearly and two close ones among them."""
    rng = np.random.default_rng(1)
    omega = np.array([1e-3, 5.0, 5.2, 30.0, 100.0])
    half = rng.standard_normal((5, 3))
    C, K, none = half @ half.T, np.diag(omega**2), np.zeros((5, 5))
    for dt in (1e-3, 0.02):
        M, D = matched_matrices(omega, C, dt)
        rates = np.block([[none, np.eye(5)], [-np.linalg.solve(M, K), -np.linalg.solve(M, D)]])
        rule = np.linalg.solve(np.eye(10) - dt / 2 * rates, np.eye(10) + dt / 2 * rates)
        true = sl.expm(dt * np.block([[none, np.eye(5)], [-K, -C]]))
        for n in range(1, 11):
            # all eigenvalues, by the traces of powers
            ours, theirs = (np.trace(np.linalg.matrix_power(A, n)) for A in (rule, true))
            assert ours == pytest.approx(theirs, abs=1e-12)
        np.testing.assert_allclose(M, M.T)
        np.testing.assert_allclose(D, D.T)


def test_in_proportion_it_is_alpha_and_beta_in_time(joint):
    """Both ways of a step, the reactions of a slipping joint, its energies and small deviations."""
    other = by_all_modes(joint)
    load = loads(joint, 0.02) * np.sin(2 * np.pi * np.arange(81) / 40)
    for frequency in (None, 175.0):
        marches = []
        for each in (joint, other):
            scheme = time_scheme(each, 1 / (40 * 175.0), frequency=frequency)
            marches.append(march(scheme, prestressed_state(scheme), load, keep=True))
        one, two = marches
        assert one.dissipated > 0
        np.testing.assert_allclose(two.r, one.r, atol=1e-9 * np.abs(one.r).max())
        for name in ("modal_damping", "residual_damping", "external", "dissipated"):
            assert getattr(two, name) == pytest.approx(getattr(one, name), rel=1e-9)


def test_in_proportion_it_is_alpha_and_beta_by_harmonics(joint):
    points = []
    for each in (joint, by_all_modes(joint)):
        points.append(periodic(each, 172.0, loads(joint, 0.01), 2))
    one, two = points
    assert one.dissipated > 0
    assert two.amplitude == pytest.approx(one.amplitude, rel=1e-10)
    assert two.material_work == pytest.approx(one.material_work, rel=1e-9)
    if joint.model.dimension == 2:
        exponents = [hill_exponents(p.problem, p.frequency, p.load, p.w).exponents for p in points]
        np.testing.assert_allclose(exponents[1], exponents[0], rtol=1e-6)


def test_a_step_takes_no_energy_but_by_damping_and_contact(joint):
    """A blow that makes the joint slip and opens no pair, nothing driving it: a balance to rounding."""
    joint = not_in_proportion(joint)
    joint = replace(joint, model=replace(joint.model, rayleigh=(ALPHA, 0.0)))
    scheme = time_scheme(joint, 1 / (60 * 175.0))
    start = prestressed_state(scheme, 1e-4, joint.mode.stuck_omega)
    found = march(scheme, start, np.zeros(121))
    assert found.dissipated > 0
    given = [mechanical_energy(scheme, state, 0.0) for state in (start, found.state)]
    lost = found.dissipated + found.modal_damping + found.residual_damping + found.normal_work
    # without stiffness damping what reactions store in the part without inertia is all of the latter
    stored = [reaction_energy(scheme, state, 0.0) for state in (start, found.state)]
    lost -= stored[1] - stored[0]
    print(f"lost {lost / (given[0] - given[1]) - 1:.1e} more than given")
    assert found.modal_damping > 0.1 * lost
    assert lost == pytest.approx(given[0] - given[1], rel=1e-8)


@pytest.fixture(scope="module")
def stuck(planar):
    """A joint that sticks, its modes (Hz), poles, and harmonic answers by the sum over them, coupled."""
    joint, kept = not_in_proportion(planar.with_friction(50.0), size=4.0), 10
    mode = replace(joint.mode, sliding=joint.mode.sliding[:kept], stuck=joint.mode.stuck[:kept])
    model = replace(joint.model, rayleigh=(ALPHA, 0.0)).truncated(kept)
    joint = replace(joint, model=model, mode=mode)
    bonded, port = joint.prestress.bonded(2), model.port(joint.drive)
    omega, shapes = bonded_modes(model, bonded)
    C, none = shapes.T @ model.damping_matrix() @ shapes, np.zeros((len(omega), len(omega)))
    assert np.abs(C - np.diag(np.diag(C))).max() > 0.3 * np.diag(C).min()
    poles = np.linalg.eigvals(np.block([[none, np.eye(len(omega))], [-np.diag(omega**2), -C]]))
    held = np.linalg.solve(model.residual[np.ix_(bonded, bonded)], model.port_v[bonded, port])
    drive = shapes.T @ (model.port_modes[:, port] - model.mode_v[bonded].T @ held)
    own = shapes.T @ model.port_modes[:, model.port("sliding")]

    def answer(frequency):
        w = 2 * np.pi * frequency
        return own @ np.linalg.solve(np.diag(omega**2 - w**2) + 1j * w * C, drive)

    return joint, poles, answer


def test_disturbances_of_a_stuck_joint_are_its_complex_modes(stuck):
    """``s = lambda - i h omega``: bodies that swing on their supports among them, the mean an unknown."""
    joint, poles, answer = stuck
    frequency, load = joint.mode.stuck_frequency - 0.4, loads(joint, 1e-7)
    point = periodic(joint, frequency, load, 2)
    assert point.amplitude == pytest.approx(load * answer(frequency), rel=1e-3)
    exponents = hill_exponents(point.problem, frequency, load, point.w).exponents
    turn = 2j * np.pi * frequency
    every = np.concatenate([poles - h * turn for h in range(-2, 3)])
    assert len(exponents) == 4
    for exponent in exponents:
        assert np.abs(every - exponent).min() < 1e-4 * abs(exponent)


def test_a_stuck_joint_in_time_has_its_complex_modes(stuck):
    """Steady states without error of the step, decays with what contact leaves of second order."""
    joint, poles, answer = stuck
    frequency, load = joint.mode.stuck_frequency - 0.4, loads(joint, 1e-7)
    # steps that all modes can be followed with: others have beta alone
    scheme = time_scheme(joint, 1 / (150 * frequency), frequency=frequency)
    assert len(scheme.joint.model.omega) == len(joint.model.omega)
    steady = steady_state(scheme, frequency, load, tolerance=1e-8)
    print(f"steady state off by {abs(steady.amplitude / (load * answer(frequency)) - 1):.1e}")
    assert steady.amplitude == pytest.approx(load * answer(frequency), rel=1e-5)
    errors = []
    for steps in (150, 300):
        scheme = time_scheme(joint, 1 / (steps * frequency))
        found = floquet_multipliers(scheme, steady_state(scheme, frequency, load), count=4)
        pole = poles[np.argmin(np.abs(poles - 1j * joint.mode.stuck_omega))]
        errors.append(np.abs(found.values - np.exp(pole / frequency)).min())
    print(f"multiplier of the mode off by {errors[0]:.1e} and {errors[1]:.1e}")
    assert errors[1] < min(1e-3, errors[0] / 3)


def test_harmonics_and_time_meet_on_a_slipping_joint(joint):
    """Amplitude, loss and balance of energy; damping of every pair of modes."""
    joint = not_in_proportion(joint, size=8.0)
    frequency, load = 172.0, loads(joint, 0.004)
    point = periodic(joint, frequency, load, 7)
    assert point.dissipated > 0
    lost = point.dissipated + point.material_work
    assert lost == pytest.approx(point.external_work, rel=1e-3)
    scheme = time_scheme(joint, 1 / (150 * frequency), frequency=frequency)
    steady = steady_state(
        scheme, frequency, load, start=state_from_point(scheme, point), tolerance=1e-6
    )
    cycle = steady.cycle
    assert abs(steady.amplitude / point.amplitude - 1) < 3e-3
    assert cycle.dissipated == pytest.approx(point.dissipated, rel=1e-2)
    material = cycle.modal_damping + cycle.residual_damping
    assert material == pytest.approx(point.material_work, rel=1e-2)
    assert cycle.external == pytest.approx(cycle.dissipated + material, rel=1e-3)
    if joint.model.dimension == 3:
        return
    # the slowest vibration; faster ones feel that Hill's method freezes the memory of friction
    found = floquet_multipliers(scheme, steady, count=2)
    slowest = found.values[found.vibration][0]
    multipliers = hill_exponents(point.problem, frequency, load, point.w, count=6).multipliers
    near = multipliers[np.argmin(np.abs(multipliers - slowest))]
    print(f"multiplier {slowest:.5f}, {near:.5f} by Hill's method")
    assert abs(near - slowest) < 1e-3 * abs(slowest)


def test_in_proportion_it_is_alpha_and_beta_in_backbones_and_reduced_models(joint):
    other, found = by_all_modes(joint), []
    mode = joint.principal()
    sizes = np.array([0.02, 0.3]) * amplitude_scale(joint, mode)
    for each in (joint, other):
        own = joint_modes(each.model, each.prestress, each.law)[0]
        control = CycleControl(steps=40, cycles=2)
        backbones = [
            quasi_static_backbone(each, own, sizes, control=control),
            prescribed_backbone(each, own, sizes, control=control),
            harmonic_backbone(each, own, sizes[:1], harmonics=3),
        ]
        assert not any(failures for _, failures in backbones)
        ratios = np.concatenate([backbone.damping_ratio for backbone, _ in backbones])
        held = hold_mode(each, 0.5 * (mode.sliding_omega + mode.stuck_omega), upper=2)
        table, _ = refined_table(held, sizes[0], sizes[1], 5, steps=40, cycles=2)
        amplitudes = []
        frequency = np.array([120.0, 165.0, 180.0])
        for variant in VARIANTS:
            model = two_mode_model(each, variant, 1e-9)
            if variant == "refined":
                load = 0.1 * sizes[1] * mode.sliding_omega**2 / abs(model.force[0])
                response = forced_response(model, table, frequency, load)
                surface = load_surface(model, table, frequency)
                amplitudes += [surface.stiffness[300], surface.stiffness[-1]]
                amplitudes += [error_indicator(replace(response, variant="refined"), model, table)]
                amplitudes += [resonance_of(model, table).width]
                amplitudes += [response_motion(response, model, table, each).ravel()]
            else:
                response = forced_response(model, None, frequency, 1.0)
            amplitudes += [response.amplitude, linear_resonance(model)]
        kappa = equivalent_of(1e-3 + 1e-3j, 170.0, 1.0, each)
        found.append((ratios, *amplitudes, np.array([kappa.k_eq, kappa.gamma_eq])))
    assert joint.model.rayleigh[0] / (2 * mode.stuck_omega) > 1e-3
    for one, two in zip(*found, strict=True):
        size = np.abs(one)[np.isfinite(one)].max()
        np.testing.assert_allclose(two, one, rtol=1e-8, atol=1e-10 * size)


@pytest.mark.validate
def test_backbones_have_the_damping_of_the_shape(planar, finding):
    """Three methods; without slip that of the stuck mode itself, else what it adds to friction's."""
    joint, coupled = planar, not_in_proportion(planar, seed=10, size=4.0)
    mode, D = joint_modes(joint.model, joint.prestress, joint.law)[0], coupled.model.damping
    sizes = np.array([1e-4, 0.3]) * amplitude_scale(joint, mode)
    stuck, sliding = mode.stuck @ D @ mode.stuck, mode.sliding @ D @ mode.sliding
    assert abs(stuck / sliding - 1) > 0.05

    def added(method, **settings):
        with_it, without = (
            method(each, mode, sizes, **settings)[0].damping_ratio for each in (coupled, joint)
        )
        return with_it - without

    by_harmonics = added(harmonic_backbone, harmonics=3)
    # complex modes of the stuck joint: of second order in the damping
    assert by_harmonics[0] == pytest.approx(stuck / (2 * mode.stuck_omega), rel=2e-3)
    for method in (quasi_static_backbone, prescribed_backbone):
        found = added(method, control=CycleControl(steps=40, cycles=3))
        off = np.abs(found / by_harmonics - 1).max()
        finding("damping added by coupled modes, by cycles against harmonics", off, at_most=0.01)

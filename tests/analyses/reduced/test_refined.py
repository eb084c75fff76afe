"""Refined model against the linear stuck joint, scaling laws, a Newton step and the time domain."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from conftest import FRICTION, times
from scipy.stats import spearmanr

from microslip.analyses.reduced.refined import load_offset, missed, refined_table
from microslip.analyses.reduced.response import forced_response
from microslip.analyses.reduced.sweep import CONVERGED
from microslip.analyses.reduced.trust import error_indicator
from microslip.analyses.reduced.two_mode import two_mode_model
from microslip.analyses.statics.held import hold_mode
from microslip.analyses.statics.prescribed import prescribed_cycle
from microslip.analyses.time.scheme import time_scheme
from microslip.analyses.time.steady import steady_state
from microslip.errors import MicroslipError
from microslip.model.joint import bonded_modes
from microslip.numerics.fourier import harmonic

BAND = np.linspace(165, 190, 501)


def held_joint(joint, omega=None, upper=0):
    mode = joint.principal()
    middle = 0.5 * (mode.sliding_omega + mode.stuck_omega)
    return hold_mode(joint, middle if omega is None else omega, upper=upper)


@pytest.fixture(scope="module")
def refined(small_reference):
    """Model and table of the small joint."""
    joint = small_reference.joint
    held = held_joint(joint, upper=2)
    table, failures = refined_table(held, 2e-6, 0.05, 28, steps=200, knots=5)
    assert failures == []
    return two_mode_model(joint, "refined", load_offset(held, 1e-6)), table


def stuck_receptance(reference, omega, damped=True):
    """Response of the sliding coordinate of the stuck joint model to a unit moment, solved as one.

    Material damping: every elastic part, the bond included, has the loss of the stiffness.
    """
    m = reference.model
    bonded = reference.start.bonded(2)
    psi, W = m.mode_v[bonded], m.residual[np.ix_(bonded, bonded)]
    moment, sliding = m.port("moment"), m.port("sliding")
    loss = 1 + 1j * omega * m.rayleigh[1] * damped
    # Loads: the bond's reaction r makes psi eta + (v_res a - W r) / loss vanish.
    k = len(m.omega)
    A = np.zeros((k + len(bonded), k + len(bonded)), complex)
    A[:k, :k] = np.diag(m.omega**2 * loss - omega**2)
    A[:k, k:] = psi.T
    A[k:, :k] = psi
    A[k:, k:] = -W / loss
    b = np.concatenate([m.port_modes[:, moment], -m.port_v[bonded, moment] / loss])
    x = np.linalg.solve(A, b)
    eta, r = x[:k], x[k:]
    direct = m.port_port[moment, sliding] - m.port_v[bonded, sliding] @ r
    return m.port_modes[:, sliding] @ eta + direct / loss


def test_small_amplitude_is_the_stuck_mode(small_reference):
    """With inertia at the stuck frequency the held mode resonates exactly there.

    ``omega_sl² (1 + k_eq) = omega_st²`` holds only if all other modes have their inertia.
    """
    states, joint = small_reference.states, small_reference.joint
    stuck, _ = bonded_modes(joint.model, joint.prestress.bonded(2))
    stuck = stuck[np.argmin(np.abs(stuck - states.stuck_omega))]
    held = held_joint(joint, omega=float(stuck))
    cycle = prescribed_cycle(held, 1e-8, steps=40, cycles=2)
    k = (cycle.force / cycle.q).real / states.sliding_omega**2
    resonance = np.sqrt(1 + k) * states.sliding_omega
    static = prescribed_cycle(held_joint(joint, omega=0.0), 1e-8, steps=40)
    k_static = (static.force / static.q).real / states.sliding_omega**2
    without = np.sqrt(1 + k_static) * states.sliding_omega
    # Rigid sliding keeps its static stiffness; it is a hundredth of what inertia is worth.
    assert without - stuck > 5e-5 * stuck
    assert abs(resonance - stuck) < 0.02 * (without - stuck)


def test_small_amplitude_response_is_the_stuck_joint(small_reference, refined):
    """At every frequency of the band, the moment's own bending of the interface included."""
    model, table = refined
    frequency = np.linspace(165, 182, 18)
    load = 1e-3
    response = forced_response(model, table, frequency, load)
    exact = np.array([stuck_receptance(small_reference, 2 * np.pi * f) for f in frequency])
    assert np.abs(response.amplitude / load / exact - 1).max() < 1e-3
    without = forced_response(replace(model, offset=np.zeros(2)), table, frequency, load)
    assert np.abs(without.amplitude / load / exact - 1).max() > 2e-2


def test_prescribed_motion_is_a_sine(small_reference):
    cycle = prescribed_cycle(held_joint(small_reference.joint), 5e-3, steps=100)
    assert abs(cycle.q) == pytest.approx(5e-3, rel=1e-3)
    assert abs(np.angle(cycle.q)) < 1e-3
    assert cycle.residual < 1e-8


def test_dissipation_is_the_work_of_the_force(small_reference):
    """``Delta E = pi |Q|² omega_sl² gamma_eq``: friction work against the force on the mode."""
    cycle = prescribed_cycle(held_joint(small_reference.joint), 5e-3, steps=400, cycles=6)
    work = np.pi * (np.conj(cycle.q) * cycle.force).imag
    assert cycle.dissipated == pytest.approx(work, rel=2e-3)


def test_amplitude_over_clamp_alone_matters(small_reference):
    joint = small_reference.joint
    tripled = replace(joint, prestress=times(joint.prestress, 3))
    one = prescribed_cycle(held_joint(joint), 4e-3, steps=100)
    three = prescribed_cycle(held_joint(tripled), 12e-3, steps=100)
    assert three.force == pytest.approx(3 * one.force, rel=1e-7)
    assert three.dissipated == pytest.approx(9 * one.dissipated, rel=1e-7)


def test_upper_modes_are_those_of_the_sliding_joint(small_reference):
    model, states = small_reference.model, small_reference.states
    omegas, shapes = bonded_modes(model, small_reference.start.bonded(1))
    g = model.port_modes[:, model.port("sliding")]
    own = int(np.argmax(np.abs(shapes.T @ g)))
    assert omegas[own] == pytest.approx(states.sliding_omega, rel=1e-5)
    assert abs(shapes[:, own] @ g) == pytest.approx(1, abs=1e-5)


def test_half_turn_symmetry_selects_harmonics(small_reference):
    """The antisymmetric mode answers even harmonics only, the symmetric one odd ones."""
    held = held_joint(small_reference.joint, upper=2)
    cycle = prescribed_cycle(held, 6e-3, steps=200, cycles=6, harmonics=8)
    first, second = np.abs(cycle.upper)
    assert first[0::2].max() < 1e-3 * first[1::2].max()
    assert second[1::2].max() < 1e-3 * second[0::2].max()


def test_indicator_finds_a_known_error(small_reference, refined):
    """An answer that is 0.1 % off is said to be 0.1 % off, whatever the direction."""
    model, table = refined
    load = 4e-4 * small_reference.moment * FRICTION
    exact = forced_response(model, table, BAND[::50], load)
    assert (exact.flag == CONVERGED).all()
    for direction in (1, 1j, -1, -1j):
        wrong = replace(exact, variant="other", amplitude=exact.amplitude * (1 + 1e-3 * direction))
        assert error_indicator(wrong, model, table) == pytest.approx(1e-3, rel=0.1)


def test_indicator_outside_the_table_is_infinite(refined):
    model, table = refined
    response = forced_response(model, table, BAND[::50], 1.0)
    beyond = replace(response, amplitude=np.full(len(response.amplitude), 10.0 + 0j))
    assert np.isinf(error_indicator(beyond, model, table)).all()


def test_interpolation_error_is_estimated():
    """Leaving a point of a smooth curve out overestimates what halving the spacing leaves."""
    x = np.linspace(0, 3, 25)
    error = missed(x, np.sin(x) + 1j * np.cos(2 * x))
    assert error.max() < 1e-3
    assert missed(x, x + 0j).max() < 1e-12


@pytest.mark.parametrize("limits", [(0.0, 1e-2, 8), (1e-2, 1e-3, 8), (1e-4, 1e-2, 3)])
def test_bad_tables_are_refused(small_reference, limits):
    with pytest.raises(MicroslipError, match="amplitudes"):
        refined_table(held_joint(small_reference.joint), *limits)


def test_other_tables_have_no_indicator(refined):
    model, table = refined
    response = forced_response(model, table, BAND[::100], 1.0)
    with pytest.raises(MicroslipError, match="refined"):
        error_indicator(response, model, replace(table, uncertainty=None))


def time_domain(reference, frequency, load, guess, steps):
    """First harmonic of the sliding coordinate."""
    scheme = time_scheme(reference.joint, 1 / (frequency * steps), frequency=frequency)
    steady = steady_state(scheme, frequency, load, guess=guess)
    assert steady.converged
    theta = steady.phase + 2 * np.pi * np.arange(steps + 1) / steps
    q = steady.cycle.output[:, reference.model.port("sliding")]
    return complex(harmonic(q, theta))


def test_time_domain_agrees(small_reference, refined):
    """Untuned, on both flanks and near the peak; 1 % asked for."""
    model, table = refined
    load = 6e-4 * small_reference.moment * 0.4
    response = forced_response(model, table, BAND, load)
    assert (response.flag == CONVERGED).all()
    peak = response.peak
    for i in (peak - 120, peak - 4, peak + 4, peak + 60):
        truth = time_domain(small_reference, BAND[i], load, response.amplitude[i], 300)
        assert abs(response.amplitude[i]) == pytest.approx(abs(truth), rel=1e-2)


@pytest.mark.validate
@pytest.mark.parametrize("rho", [1.6, 2.4, 3.2, 5.0])
def test_refined_within_one_per_cent(reference, rho, finding):
    """Reference joint, the paper's loads: 1 % everywhere, 0.3 % at a peak that is no edge of a fold."""
    held = held_joint(reference.joint, upper=2)
    table, _ = refined_table(held, 3e-6, 0.12)
    model = two_mode_model(reference.joint, "refined", load_offset(held, 1e-6))
    load = 2.33e-3 * FRICTION * reference.moment / rho
    response = forced_response(model, table, BAND, load)
    peak = response.peak
    chosen = np.unique(np.r_[np.arange(20, 501, 40), peak])
    truth = np.array(
        [time_domain(reference, BAND[i], load, response.amplitude[i], 300) for i in chosen]
    )
    error = np.abs(np.abs(response.amplitude[chosen]) / np.abs(truth) - 1)
    what = f"refined model of the reference joint against time integration, rho = {rho}"
    finding(what, error.max(), at_most=1e-2)
    size = np.abs(response.amplitude)
    if size[peak] <= 1.5 * size[peak - 2]:  # no jump within 0.1 Hz
        finding(f"{what}, at the peak", float(error[chosen == peak][0]), at_most=3e-3)
    # Cruder models of the same joint, judged by the refined one: the indicator ranks their errors.
    crude = [
        (replace(model, offset=np.zeros(2)), table),
        (model, replace(table, upper=None)),
    ]
    errors, indicators = [], []
    for cruder in crude:
        other = forced_response(*cruder, BAND, load, variant="cruder")
        errors.append(np.abs(other.amplitude[chosen] / truth - 1))
        indicators.append(error_indicator(other, model, table)[chosen])
    ranks = spearmanr(np.concatenate(errors), np.concatenate(indicators))[0]
    finding("rank correlation of error and indicator, cruder models", ranks, at_least=0.8)

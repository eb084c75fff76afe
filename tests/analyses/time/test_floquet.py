"""Floquet multipliers against modes of linear joints and against the decay that is marched."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from conftest import FRICTION

from microslip.analyses.prepared.joint_modes import walking_modes
from microslip.analyses.time.floquet import DeviationNorm, floquet_multipliers
from microslip.analyses.time.scheme import march, prestressed_state, time_scheme
from microslip.analyses.time.steady import steady_state
from microslip.errors import MicroslipError

STEPS = 150
TINY = 1e-8
"""Moment over P L at which no contact changes."""


def frequency_of(reference, shift=1.0):
    return reference.states.sliding_omega / (2 * np.pi) + shift


def found(
    reference, ratio, *, friction=FRICTION, steps=STEPS, shift=1.0, tolerance=1e-5, model=None
):
    """Scheme and steady state under an end moment over P L."""
    frequency = frequency_of(reference, shift)
    joint = reference.joint.with_model(model or reference.model).with_friction(friction)
    scheme = time_scheme(joint, 1 / (frequency * steps))
    steady = steady_state(scheme, frequency, ratio * reference.moment, tolerance=tolerance)
    assert steady.converged
    return scheme, steady


def upper(values):
    """Of each conjugate pair the one with positive imaginary part; real ones too."""
    return values[values.imag >= 0]


def multipliers_of_modes(model, bonded, frequency, count):
    """Those of the linear joint with components of v bonded, largest modulus first.

    ``exp(lambda T)``, lambda the pole of a mode with damping ``alpha + beta omega²``.
    """
    psi = model.mode_v[bonded]
    stiffness = np.diag(model.omega**2) + psi.T @ np.linalg.solve(
        model.residual[np.ix_(bonded, bonded)], psi
    )
    squared = np.linalg.eigvalsh(0.5 * (stiffness + stiffness.T))[:count]
    alpha, beta = model.rayleigh
    damping = 0.5 * (alpha + beta * squared)
    poles = -damping + 1j * np.sqrt(squared - damping**2)
    exact = np.exp(poles / frequency)
    return np.where(exact.imag < 0, exact.conj(), exact)


def nearest(values, target):
    return values[np.argmin(np.abs(values - target))]


@pytest.mark.parametrize(
    ("friction", "directions"), [(0.0, 1), (10.0, 2)], ids=["sliding", "stuck"]
)
def test_linear_joint_has_the_multipliers_of_its_modes(small_reference, friction, directions):
    """Two modes below 1 kHz and the translation; what is left falls with the step."""
    reference = small_reference
    errors = []
    for steps in (150, 600):
        scheme, steady = found(reference, TINY, friction=friction, steps=steps, tolerance=1e-7)
        bonded = reference.start.bonded(directions)
        exact = multipliers_of_modes(reference.model, bonded, steady.frequency, 4)
        m = floquet_multipliers(scheme, steady, count=6, max_cycles=25)
        values = upper(m.values[m.residual < 1e-3])
        vibration = exact[2:] if directions == 1 else exact[1:3]
        errors.append([abs(nearest(values, z) - z) for z in vibration])
        translation = nearest(values, exact[0])
        print(f"{steps} steps: vibration {errors[-1]}, translation {abs(translation - exact[0])}")
        assert m.verdict == "stable"
        assert translation == pytest.approx(exact[0], abs=1e-4)
        assert m.largest == pytest.approx(np.abs(vibration).max(), abs=2e-4)
    assert errors[0][0] < 1e-4
    assert errors[0][1] < 1e-3
    assert errors[1][1] < 0.5 * errors[0][1]


def test_negative_damping_is_unstable(small_reference):
    """The search still finds the periodic motion; its multiplier leaves the circle as it must."""
    reference = small_reference
    model = replace(reference.model, rayleigh=(-20.0, reference.model.rayleigh[1]))
    scheme, steady = found(reference, TINY, friction=0.0, tolerance=1e-7, model=model)
    exact = multipliers_of_modes(model, reference.start.bonded(1), steady.frequency, 3)[2]
    m = floquet_multipliers(scheme, steady)
    assert abs(exact) > 1.05
    assert m.verdict == "unstable"
    assert m.largest == pytest.approx(abs(exact), rel=1e-3)


@pytest.fixture(scope="module", params=[1e-5, 1e-4, 2e-4, 4e-4], ids="M/PL={:g}".format)
def rubbing(request, small_reference):
    scheme, steady = found(small_reference, request.param)
    return scheme, steady, floquet_multipliers(scheme, steady)


def test_decay_is_that_of_the_multiplier(rubbing):
    """Two motions from close by, both marched: their distance falls by |mu| per cycle.

    Slowest pair of multipliers that the sliding coordinate sees, over 40 cycles; the ratio of a
    real and slowly turning sequence is read from a fit ``d_k = 2 s d_{k-1} - p d_{k-2}`` with
    ``p = |mu|²``.
    """
    scheme, steady, m = rubbing
    model = scheme.joint.model
    one = steady.cycle.state
    sliding = model.port_modes[:, model.port("sliding")]
    kick = 1e-3 * abs(steady.amplitude) * 2 * np.pi * steady.frequency
    other = replace(one, rate=one.rate + kick * sliding)
    wave, distance = steady.cycle.load, []
    for _ in range(60):
        one, other = march(scheme, one, wave).state, march(scheme, other, wave).state
        distance.append(sliding @ (other.rate - one.rate))
    d = np.array(distance[10:])
    _, p = np.linalg.lstsq(np.column_stack([d[1:-1], -d[:-2]]), d[2:], rcond=None)[0]
    seen = m.values[m.vibration & (m.residual < 1e-2)]
    moduli = np.abs(seen[(np.abs(seen) > 0.9) & (np.abs(np.angle(seen)) < 0.8)])
    print(f"decay {np.sqrt(p):.4f}, multipliers {np.abs(seen).round(4)}")
    assert np.sqrt(p) == pytest.approx(moduli.max(), abs=0.02)


def test_refined_multipliers_are_those_of_the_map(rubbing):
    """Another first deviation gives the same ones; a steady state that was marched to decays."""
    scheme, steady, m = rubbing
    # At the largest load the residual of an estimate may reach the unit circle: undecided.
    assert m.verdict != "unstable"
    assert m.largest < 1
    assert m.cycles <= 30
    again = floquet_multipliers(scheme, steady, seed=1)
    print(f"{again.largest:.4f}, {m.largest:.4f}, {again.cycles} cycles")
    assert again.verdict != "unstable"
    assert again.largest == pytest.approx(m.largest, abs=0.02)


def test_by_product_is_near(rubbing):
    """What the search has learned of the map: the largest modulus roughly, for nothing."""
    _, steady, m = rubbing
    print(f"{np.abs(steady.multipliers[0]):.4f}, refined {m.largest:.4f}")
    assert abs(steady.multipliers[0]) == pytest.approx(m.largest, abs=0.2)


def test_walking_modes_touch_no_normal_gap(small_reference):
    """The two soft sideways modes of the reference joint: springs of 1e5 N/m on each beam."""
    model = small_reference.model
    moving = walking_modes(model)
    assert moving.sum() == 2
    g = small_reference.geometry
    mass = 2000.0 * g.length * g.thickness
    assert model.omega[moving] == pytest.approx(np.full(2, np.sqrt(1e5 / mass)), rel=1e-3)


def test_unsettled_state_is_refused(small_reference):
    frequency = frequency_of(small_reference)
    scheme = time_scheme(small_reference.joint, 1 / (frequency * STEPS))
    early = steady_state(scheme, frequency, 1e-4 * small_reference.moment, max_cycles=3)
    with pytest.raises(MicroslipError, match=r"not converged \(last change"):
        floquet_multipliers(scheme, early)


def test_norm_is_twice_the_energy_of_stiff_modes(small_reference):
    """A deviation of one stiff mode, and of reactions alone."""
    scheme, _ = found(small_reference, TINY)
    model = scheme.joint.model
    norm = DeviationNorm(scheme, 1.0)
    rest = prestressed_state(scheme)
    zero = replace(rest, eta=0 * rest.eta, rate=0 * rest.rate, r=0 * rest.r)
    k = 7
    unit = np.eye(len(model.omega))[k]
    assert norm.size(replace(zero, eta=2 * unit)) == pytest.approx(2 * model.omega[k])
    assert norm.size(replace(zero, rate=3 * unit)) == pytest.approx(3)
    r = rest.r
    assert norm.size(replace(zero, r=r)) ** 2 == pytest.approx(r @ model.residual @ r)

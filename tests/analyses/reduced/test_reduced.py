"""Reduced model against the direct linear response, a closed-form oscillator and its own equation."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
import scipy.sparse.linalg as spla
from conftest import RAYLEIGH
from scipy.interpolate import PchipInterpolator
from scipy.optimize import brentq

from microslip.analyses.reduced.response import (
    all_amplitudes,
    forced_response,
    greatest_damping_load,
)
from microslip.analyses.reduced.table import EquivalentTable, equivalent_table, modal_quantities
from microslip.analyses.reduced.two_mode import two_mode_model
from microslip.analyses.statics.cycle import quasi_static_cycle
from microslip.contact.pairs import normal_components
from microslip.errors import MicroslipError
from microslip.model.modes import bonding


@pytest.fixture(scope="module")
def cycles(reference):
    """Mode-driven cycles from nearly stuck to mostly slipping."""
    return [
        quasi_static_cycle(reference.joint, "sliding", load, steps=100, max_cycles=4)
        for load in np.geomspace(300, 60000, 6)
    ]


def jenkins_table(omega, ratio=0.12, slip=1e-3):
    """Describing function of a spring ``ratio omega²`` in series with a slider that slips at `slip`.

    Closed form: with ``cos(theta) = 1 - 2 slip / a``,
    k = ratio (theta - sin(2 theta) / 2) / pi, gamma = 4 ratio slip (a - slip) / (pi a²).
    """
    a = np.geomspace(slip * 1.0001, 300 * slip, 4000)
    theta = np.arccos(1 - 2 * slip / a)
    k = ratio * (theta - np.sin(2 * theta) / 2) / np.pi
    gamma = 4 * ratio * slip * (a - slip) / (np.pi * a**2)
    zero = np.zeros_like(a)
    return EquivalentTable("mode", 1.0, omega, a, a, k, gamma, zero.astype(complex), zero, zero)


def jenkins(a, ratio=0.12, slip=1e-3):
    if a <= slip:
        return complex(ratio)
    theta = np.arccos(1 - 2 * slip / a)
    return complex(
        ratio * (theta - np.sin(2 * theta) / 2) / np.pi,
        4 * ratio * slip * (a - slip) / (np.pi * a**2),
    )


def test_frictionless_response_is_that_of_the_full_mesh(reference):
    """Direct solution of (-w² M + (1 + i w beta) K) x = F on every degree of freedom."""
    s, states = reference.structure, reference.states
    basis = bonding(s.interface.relative, normal_components(states.pairs))
    stiffness, mass = basis.T @ s.stiffness @ basis, basis.T @ s.mass @ basis
    load = basis.T @ s.loads["moment"]
    measure = basis.T @ (s.mass @ states.sliding)
    resonance = states.sliding_omega / (2 * np.pi)
    frequency = resonance + np.array([-5.0, -0.3, -0.05, 0.0, 0.05, 0.3, 5.0])
    direct = []
    for f in frequency:
        w = 2 * np.pi * f
        dynamic = (-(w**2) * mass + (1 + 1j * w * RAYLEIGH[1]) * stiffness).tocsc()
        direct.append(measure @ spla.spsolve(dynamic, load.astype(complex)))
    for variant in ("printed", "consistent"):
        model = two_mode_model(reference.joint, variant)
        response = forced_response(model, None, frequency, 1.0)
        assert response.amplitude == pytest.approx(np.array(direct), rel=5e-3)


def test_jenkins_oscillator(reference):
    """One-mode fixed point against bisection on the closed-form describing function."""
    omega = reference.states.sliding_omega
    model = two_mode_model(reference.joint, "consistent")
    table = jenkins_table(omega)
    frequency = np.linspace(0.97, 1.07, 81) * omega / (2 * np.pi)
    load = 0.05 * 0.12 * 8e-3 * omega**2 / abs(model.force[0])
    response = forced_response(model, table, frequency, load)
    assert (response.flag == 0).all()
    checked = 0
    for f, q in zip(frequency, response.amplitude, strict=True):
        w = 2 * np.pi * f

        def gap(a, w=w):
            z = omega**2 * (1 + jenkins(a)) - w**2 + 1j * w * RAYLEIGH[1] * omega**2
            return load * abs(model.force[0]) / abs(z) - a

        grid = np.geomspace(1e-6, 0.3, 2000)
        signs = np.sign([gap(a) for a in grid])
        roots = [brentq(gap, grid[i], grid[i + 1]) for i in np.flatnonzero(np.diff(signs))]
        assert min(abs(abs(q) - root) for root in roots) < 1e-4 * abs(q)
        if len(roots) == 1:
            found = all_amplitudes(model, table, f, load, points=3000)
            if roots[0] > 1.001e-3:
                assert found == pytest.approx(roots, rel=1e-4)
                checked += 1
    assert checked > 20


def test_answers_satisfy_their_equation(reference, cycles):
    """Every converged point solves the two-coordinate equation with the table at its amplitude."""
    table = equivalent_table(cycles, reference.joint, "mode")
    model = two_mode_model(reference.joint, "consistent")
    response = forced_response(model, table, np.linspace(165, 190, 101), 40.0)
    good = response.flag == 0
    assert good.sum() > 90
    a = np.abs(response.amplitude[good])
    inside = (a > table.amplitude[0]) & (a < table.amplitude[-1])
    assert inside.sum() > 50
    x = np.log(table.amplitude)
    k = PchipInterpolator(x, table.k_eq)(np.log(a[inside]))
    g = PchipInterpolator(x, table.gamma_eq)(np.log(a[inside]))
    w = 2 * np.pi * response.frequency[good][inside]
    w2 = reference.states.sliding_omega**2
    z = w2 * (1 + k + 1j * g) - w**2 + 1j * w * RAYLEIGH[1] * w2
    q = response.amplitude[good][inside]
    assert z * q == pytest.approx(np.full(len(q), 40.0 * model.force[0]), rel=1e-7)


def test_response_scales_with_clamp_and_load(reference, cycles):
    table = equivalent_table(cycles, reference.joint, "mode")
    model = two_mode_model(reference.joint, "consistent")
    frequency = np.linspace(165, 190, 51)
    one = forced_response(model, table, frequency, 40.0)
    ten = forced_response(model, table, frequency, 400.0, preload=10 * table.preload)
    assert ten.amplitude == pytest.approx(10 * one.amplitude, rel=1e-8)


def test_constant_table_is_a_linear_oscillator(reference):
    omega = reference.states.sliding_omega
    a = np.array([1e-9, 1e3])
    table = EquivalentTable(
        "mode", 1.0, omega, a, a, np.full(2, 0.05), np.full(2, 0.01), np.zeros(2, complex), a, a
    )
    frequency = np.linspace(165, 190, 11)
    w = 2 * np.pi * frequency
    work = reference.structure.loads["moment"] @ reference.states.sliding
    expected = work / (omega**2 * (1.05 + 0.01j + 1j * w * RAYLEIGH[1]) - w**2)
    model = two_mode_model(reference.joint, "consistent")
    response = forced_response(model, table, frequency, 1.0)
    assert response.amplitude == pytest.approx(expected, rel=1e-9)
    assert response.contraction == pytest.approx(np.zeros(11), abs=1e-9)


def test_lowest_gain_is_where_a_search_finds_it(reference):
    """Greatest damping of the Jenkins oscillator by brute force over the load."""
    omega = reference.states.sliding_omega
    table = jenkins_table(omega)
    model = two_mode_model(reference.joint, "consistent")
    frequency = np.linspace(0.97, 1.07, 801) * omega / (2 * np.pi)
    scale = 0.12 * 1e-3 * omega**2 / abs(model.force[0])
    best = greatest_damping_load(model, table, frequency, (0.05 * scale, 50 * scale))
    loads = np.geomspace(0.5, 2, 41) * best
    gains = [forced_response(model, table, frequency, f).peak_amplitude / f for f in loads]
    assert loads[int(np.argmin(gains))] == pytest.approx(best, rel=0.05)


def test_points_above_the_table_are_marked(reference):
    table = jenkins_table(reference.states.sliding_omega)
    short = replace(
        table,
        **{
            name: getattr(table, name)[:1000]
            for name in ("load", "amplitude", "k_eq", "gamma_eq", "cross", "dissipated", "stored")
        },
    )
    model = two_mode_model(reference.joint, "consistent")
    frequency = np.linspace(170, 180, 101)
    response = forced_response(model, short, frequency, 1e4)
    above = np.abs(response.amplitude) > short.amplitude[-1]
    assert above.any()
    assert (response.flag[above] == 2).all()
    assert set(response.frequency[above]) <= set(response.unconverged)


def test_modal_contact_force_is_the_work_of_the_reactions(reference, cycles):
    """f = Phi_sl^T F - omega² q equals the reactions' projection plus the opened bonds' share."""
    s, start, states = reference.structure, reference.start, reference.states
    shape = states.sliding
    held = normal_components(states.pairs)
    bond_force = s.stiffness @ shape - states.sliding_omega**2 * (s.mass @ shape)
    relative = s.interface.relative
    bonds = np.linalg.lstsq(relative[held].T.toarray(), bond_force, rcond=None)[0]
    assert relative[held].T @ bonds == pytest.approx(
        bond_force, abs=1e-6 * np.abs(bond_force).max()
    )
    projected = relative @ shape
    for cycle in cycles:
        _, f = modal_quantities(cycle, reference.joint)
        contact = (cycle.r - start.solution.r) @ projected
        opened = (cycle.v - start.solution.v)[:, held] @ bonds
        assert f == pytest.approx(contact + opened, abs=1e-5 * np.abs(f).max())


def test_unknown_variant_is_refused(reference):
    with pytest.raises(MicroslipError, match="printed, consistent"):
        two_mode_model(reference.joint, "other")

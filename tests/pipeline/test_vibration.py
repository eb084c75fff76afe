"""Periodic motions of the whole structure, against what the analyses know of them."""

from __future__ import annotations

import numpy as np
import pytest
from conftest import description
from mesh_files import plates_document

from microslip.analyses.harmonic.problem import harmonic_problem
from microslip.analyses.harmonic.response import frequency_response
from microslip.analyses.time.point import TimePoint
from microslip.analyses.time.readings import phases
from microslip.analyses.time.scheme import time_scheme
from microslip.analyses.time.steady import steady_state
from microslip.contact.pairs import SEPARATED, SLIP, STICK
from microslip.describe.reading import parse_joint
from microslip.pipeline.motion import periodic_motion, prestressed_shape
from microslip.pipeline.prepare import assemble
from microslip.pipeline.vibration import balanced_vibration, steady_vibration


def spatial(folder):
    return assemble(parse_joint(plates_document(folder), "mesh", folder)), "tip", 20.0, 154.0


def planar(folder):
    """A lap joint on weak springs: its rigid motions are unknowns of statics."""
    return assemble(parse_joint(description(41, 30, analysis={}))), "moment", 20.0, 176.0


def whole(assembly, motion, port, theta):
    """Displacements from the unloaded structure, and what they are of the pairs and of the output."""
    u = periodic_motion(assembly, motion, theta)
    seen = (assembly.structure.interface.relative @ u.T).T
    return u, seen, (u - prestressed_shape(assembly)) @ assembly.structure.loads[port]


@pytest.mark.parametrize("made", [spatial, planar])
def test_motion_of_harmonic_balance_is_that_of_the_finite_elements(made, tmp_path):
    """``B u = v`` and ``P^T u = y`` at every phase, and the equation of motion in the modes that are kept."""
    assembly, port, load, frequency = made(tmp_path)
    problem = harmonic_problem(assembly.prepared, harmonics=5)
    response = frequency_response(problem, load, (frequency - 0.5, frequency))
    point = max(response.points, key=lambda p: p.frequency)
    assert {STICK, SEPARATED} < set(np.unique(point.status))
    vibration = balanced_vibration(assembly, point)
    theta = 2 * np.pi * np.arange(0, point.problem.table.samples, 4) / point.problem.table.samples
    u, seen, output = whole(assembly, vibration.motion, port, theta)
    v = (point.v @ point.problem.table.basis).T[::4]
    moved = np.abs(v - assembly.prestress.solution.v).max()
    off = seen - v
    # a mean on weak springs is known to rounding of the whole displacement, not of what vibrates
    assert np.abs(off.mean(0)).max() < 1e-6 * np.abs(v).max()
    assert np.abs(off - off.mean(0)).max() < 1e-6 * moved
    Y = point.output[:, assembly.model.port(port)]
    y = Y[0].real + (np.exp(1j * np.outer(theta, np.arange(1, len(Y)))) @ Y[1:]).imag
    assert output == pytest.approx(y, abs=1e-9 * np.abs(y).max())
    structure, (alpha, beta) = assembly.structure, assembly.model.rayleigh
    M, K, B = structure.mass, structure.stiffness, structure.interface.relative
    shapes = assembly.reducer.modes.shapes
    U, omega = np.fft.rfft(u, axis=0) / len(theta), 2 * np.pi * point.frequency
    R = np.fft.rfft((point.r @ point.problem.table.basis).T[::4], axis=0) / len(theta)
    for h in range(1, 6):
        push = -B.T @ R[h] - (0.5j * load * structure.loads[port] if h == 1 else 0)
        Ku, Mu = K @ U[h], M @ U[h]
        left = Ku - (h * omega) ** 2 * Mu + 1j * h * omega * (alpha * Mu + beta * Ku)
        assert np.abs(shapes.T @ (left - push)).max() < 1e-6 * np.abs(shapes.T @ Ku).max()


@pytest.mark.parametrize("made", [spatial, planar])
def test_motion_in_time_is_that_of_the_finite_elements_as_steps_go_to_zero(made, tmp_path):
    assembly, port, load, frequency = made(tmp_path)
    errors, start = [], None
    for steps in (200, 800):
        scheme = time_scheme(assembly.prepared, 1 / (frequency * steps), frequency=frequency)
        steady = steady_state(scheme, frequency, load, start=start, tolerance=1e-6)
        start = steady.end
        assert steady.converged
        vibration = steady_vibration(assembly, TimePoint(np.nan, 0.3, steady))
        some = slice(None, None, steps // 40)
        theta, cycle = phases(steady)[some], steady.cycle
        _, seen, output = whole(assembly, vibration.motion, port, theta)
        moved = np.abs(cycle.v - assembly.prestress.solution.v).max()
        errors.append(np.abs(seen - cycle.v[some]).max() / moved)
        y = cycle.output[some, assembly.model.port(port)]
        assert output == pytest.approx(y, abs=1e-3 * np.abs(y).max())
    assert {STICK, SLIP, SEPARATED} <= set(np.unique(cycle.status))
    assert errors[1] < 0.5 * errors[0] < 0.05


def test_turns_of_a_vibration_are_where_its_coordinate_turns(tmp_path):
    """Below resonance with the load, which is largest at pi/2."""
    assembly, _, load, _ = planar(tmp_path)
    problem = harmonic_problem(assembly.prepared, harmonics=3)
    response = frequency_response(problem, 0.1 * load, (99.0, 100.0))
    largest, other = balanced_vibration(assembly, response.points[0]).turns()
    assert largest == pytest.approx(0.5 * np.pi, abs=0.02)
    assert other == pytest.approx(1.5 * np.pi, abs=0.02)

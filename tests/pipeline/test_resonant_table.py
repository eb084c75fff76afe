"""Tables at resonances of the full joint, against linear modes and motions at other loads and steps."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from mesh_files import matching_document

from microslip import reference_joint
from microslip.analyses.prepared.direct import stuck_oscillator
from microslip.analyses.reduced.outputs import response_motion
from microslip.analyses.reduced.response import forced_response
from microslip.analyses.reduced.two_mode import stuck_model
from microslip.analyses.statics.held import hold_port, resting
from microslip.analyses.statics.prescribed import prescribed_cycle
from microslip.analyses.time.scheme import time_scheme
from microslip.analyses.time.steady import steady_state
from microslip.describe.reading import parse_joint
from microslip.errors import ContactError
from microslip.numerics.fourier import harmonic
from microslip.pipeline.followed import followed
from microslip.pipeline.kept import KeptMotion
from microslip.pipeline.prepare import assemble
from microslip.pipeline.reduced import takes_resonances
from microslip.pipeline.resonant import resonant_table, steps_of, sticking_load

LOAD = 2000.0


@pytest.fixture(scope="module")
def assembly(tmp_path_factory):
    """Plates in space, bolted aslant."""
    folder = tmp_path_factory.mktemp("aslant")
    described = matching_document(folder) | {
        "damping": {"beta": "20 us"},
        "analysis": {"response": {"count": 31}},
        "load": {"force": [LOAD]},
    }
    return assemble(parse_joint(described, "plates", folder))


@pytest.fixture(scope="module")
def tabulated(assembly):
    """Model and table for loads up to twice the one that is tested."""
    joint = assembly.prepared
    model = stuck_model(joint)
    loads = steps_of([2 * LOAD], sticking_load(joint, model))
    table, failures = resonant_table(joint, model, loads)
    assert not failures
    assert LOAD not in loads
    return model, table


def settled(joint, load, frequency, guess):
    scheme = time_scheme(joint, 1 / (250 * frequency), frequency=frequency)
    found = steady_state(scheme, frequency, load, guess=guess, tolerance=1e-5, max_cycles=60)
    assert found.converged
    return found


@pytest.mark.parametrize("port", ["sliding", "stuck"])
def test_a_held_mode_of_the_structure_sticks_where_the_joint_model_does(assembly, port):
    """In the limit of small amplitude ``omega_h² + F/Q = omega²`` at the frequency of the stuck mode."""
    joint = assembly.prepared
    own = stuck_oscillator(joint)[0]
    held = hold_port(joint, port, own, own, static=resting(joint, assembly.mode))
    cycle = prescribed_cycle(held, 1e-9, steps=20, cycles=2)
    found = np.sqrt(own**2 + (cycle.force / cycle.q).real)
    assert found == pytest.approx(own, rel=1e-6)


def test_where_it_sticks_the_model_is_the_linear_joint(assembly):
    joint, model = assembly.prepared, stuck_model(assembly.prepared)
    load = 1e-3 * sticking_load(joint, model)
    for f in np.array([0.97, 1.0, 1.02]) * model.omega / (2 * np.pi):
        D, c = complex(model.linear_stiffness(2 * np.pi * f)), model.offset[0]
        expected = (model.force[0] + D * c) * load / D - c * load
        found = settled(joint, load, f, expected).amplitude
        assert abs(expected / found - 1) < 5e-3


def test_a_transient_tells_the_contact_force(assembly):
    """Where the joint sticks there is none, though the motion has half of its amplitude and grows."""
    joint, model = assembly.prepared, stuck_model(assembly.prepared)
    load, omega = 1e-3 * sticking_load(joint, model), model.omega
    D, c = complex(model.linear_stiffness(omega)), float(model.offset[0])
    motion = KeptMotion(joint, model, omega, load, 0.5 * (model.force[0] + D * c) * load / D)
    first = motion.march(motion.begun([])).state
    A, kappa = motion.reading(first, motion.march(first))
    resists = abs(motion.resists(0j))
    as_if_steady = abs((model.force[0] + D * c) * load / A - D) / model.omega**2
    assert as_if_steady > 0.5 * resists
    assert abs(kappa) < 5e-3 * resists


def test_a_followed_motion_is_the_linear_one_where_the_joint_sticks(assembly):
    joint, model = assembly.prepared, stuck_model(assembly.prepared)
    one = followed(joint, model, 1e-3 * sticking_load(joint, model), [])
    assert one is not None
    D = complex(model.linear_stiffness(one.omega))
    expected = (model.force[0] + D * model.offset[0]) * one.load / D
    assert abs(one.amplitude / expected - 1) < 5e-3


def test_a_followed_motion_is_steady(assembly, tabulated):
    """Amplitude and phase against the search for a steady state from rest, under a load that slips."""
    joint, (model, _) = assembly.prepared, tabulated
    past = []
    for load in steps_of([LOAD], sticking_load(joint, model)):
        one = followed(joint, model, load, past)
        assert one is not None
        past.append(one)
    last = past[-1]
    Q = last.amplitude - model.offset[0] * last.load
    found = settled(joint, last.load, last.omega / (2 * np.pi), Q)
    assert abs(Q / found.amplitude - 1) < 0.02


def test_a_load_that_the_table_was_not_made_for(assembly, tabulated):
    """Peak and half power against time integration with other steps; outputs at the peak."""
    model, table = tabulated
    joint = assembly.prepared
    near = table.k_eq[np.argmin(np.abs(table.load - LOAD))]
    middle = model.omega * np.sqrt(1 + near) / (2 * np.pi)
    f = middle * np.linspace(0.93, 1.05, 241)
    curve = forced_response(model, table, f, LOAD, variant="refined", downward=True)
    assert (curve.flag == 0).all()
    assert not curve.peak_at_edge
    size, peak = np.abs(curve.amplitude), curve.peak
    beside = peak + int(np.argmax(size[peak:] < np.sqrt(0.5) * size[peak]))
    for k, within in ((peak, 0.01), (beside, 0.03)):
        found = settled(joint, LOAD, float(f[k]), complex(curve.amplitude[k]))
        assert abs(size[k] / abs(found.amplitude) - 1) < within
        if k == peak:
            assert found.cycle.dissipated > 0
            one = replace(curve, frequency=f[k : k + 1], amplitude=curve.amplitude[k : k + 1])
            motion = response_motion(one, model, table, joint)[0]
            theta = found.phase + np.linspace(0, 2 * np.pi, len(found.cycle.output))
            drive = joint.model.port(joint.drive)
            true = harmonic(found.cycle.output[:, drive], theta)
            assert abs(abs(motion[drive]) / abs(true) - 1) < 0.02


def test_a_lap_joint_in_the_plane_takes_prescribed_cycles():
    """It is its own image under a half turn, and its sliding mode is like the stuck one."""
    assert not takes_resonances(assemble(reference_joint(pairs=11)))


def test_too_few_motions_are_said(assembly):
    joint, model = assembly.prepared, stuck_model(assembly.prepared)
    low = sticking_load(joint, model)
    with pytest.raises(ContactError, match="too few for a table"):
        resonant_table(joint, model, [low, 2 * low])

"""Motion over time: independence of the blocks, energies, starts and ends."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from conftest import FRICTION

from microslip.analyses.prepared.joint import prepare_joint
from microslip.analyses.statics.cycle import quasi_static_cycle
from microslip.analyses.time import history as module
from microslip.analyses.time.decay import dwell_response
from microslip.analyses.time.history import (
    Recording,
    field_steps,
    nearest_pairs,
    run_history,
    static_state,
)
from microslip.analyses.time.scheme import march, prestressed_state, time_scheme
from microslip.analyses.time.signals import stepped_sine
from microslip.analyses.time.steady import steady_state
from microslip.contact.law import contact_law
from microslip.contact.pairs import normal, tangential, tangential_rows
from microslip.errors import ContactError

STEPS = 150


def scheme_of(joint, steps=STEPS, **options):
    """Steps per cycle of the sliding mode."""
    return time_scheme(joint, 2 * np.pi / joint.mode.sliding_omega / steps, **options)


def recording(scheme, steps, cycle=STEPS, samples=20):
    return Recording(
        name="one",
        kind="sine",
        drive="moment",
        watched=nearest_pairs(scheme.joint.model.position, [0.025, -0.01]),
        kept=field_steps(steps, scheme.dt, samples, None, None),
        cycle_steps=cycle,
    )


def sine(reference, cycles, ratio, steps=STEPS):
    n = np.arange(round(cycles * steps) + 1)
    return ratio * reference.moment * np.sin(2 * np.pi * n / steps)


@pytest.fixture(scope="module")
def driven(small_reference):
    """Twelve and a half cycles in blocks, and in one go."""
    scheme = scheme_of(small_reference.joint)
    load = sine(small_reference, 12.5, 4e-4)
    start = prestressed_state(scheme)
    history = run_history(scheme, start, load, recording(scheme, len(load) - 1))
    return scheme, history, march(scheme, start, load, keep=True)


def test_blocks_do_not_show(driven):
    """Cut into cycles or not: the same motion, up to what the solver leaves open."""
    scheme, history, whole = driven
    assert history.complete
    assert history.failure == ""
    size = np.abs(whole.output).max(axis=0)
    assert np.abs(history.output - whole.output).max(axis=0) == pytest.approx(0 * size, abs=1e-8)
    rest = scheme.joint.prestress.solution.v
    for k, pair in enumerate(history.watched):
        slip = tangential(whole.v)[:, pair] - tangential(rest)[pair]
        assert history.slip[:, k] == pytest.approx(slip, abs=1e-6 * np.abs(slip).max())
        assert history.gap[:, k] == pytest.approx(-normal(whole.v)[:, pair], abs=1e-12)
    assert (history.status == whole.status[history.kept]).mean() > 0.999
    assert history.r == pytest.approx(whole.r[history.kept], abs=1e-6 * np.abs(whole.r).max())
    assert history.energies.friction[-1] == pytest.approx(whole.dissipated, rel=1e-6)
    assert history.friction_work.sum() == pytest.approx(whole.dissipated, rel=1e-6)
    assert history.energies.external[-1] == pytest.approx(whole.external, rel=1e-6)
    assert history.energies.modal_damping[-1] == pytest.approx(whole.modal_damping, rel=1e-6)


def test_what_is_kept_covers_the_history(driven):
    _, history, whole = driven
    n = len(whole.load) - 1
    assert history.kept[[0, -1]].tolist() == [0, n]
    assert len(history.kept) == len(history.status) == len(history.r) == 20
    assert history.energies.time == pytest.approx(history.dt * np.r_[np.arange(0, n, STEPS), n])


def test_an_empty_choice_of_instants(small_reference):
    scheme = scheme_of(small_reference.joint)
    history = run_history(
        scheme,
        prestressed_state(scheme),
        sine(small_reference, 1, 1e-4),
        recording(scheme, STEPS, samples=0),
    )
    assert history.status.shape == (0, small_reference.model.pairs)
    assert field_steps(1000, 1e-3, 5, 0.2, 0.6).tolist() == [200, 300, 400, 500, 600]


def test_losses_only_grow(small_reference):
    """Free decay: friction, both dampings and the scheme take, and nothing gives back."""
    scheme = scheme_of(small_reference.joint)
    start = prestressed_state(scheme, 2e-3, small_reference.states.sliding_omega)
    load = np.zeros(20 * STEPS + 1)
    history = run_history(scheme, start, load, recording(scheme, len(load) - 1))
    e = history.energies
    top = -e.mechanical.min()
    for losses in (e.friction, e.modal_damping, e.residual_damping, e.scheme):
        assert np.diff(losses).min() > -1e-5 * top
    assert (e.external == 0).all()
    assert (np.diff(e.mechanical) < 0).all()
    lost = (e.friction + e.modal_damping + e.residual_damping)[-1]
    print(f"scheme {e.scheme[-1] / top:.1e}, normal {e.normal[-1] / top:.1e} of {top:.3g} J/m")
    assert lost == pytest.approx(top, rel=0.02)


def test_balance_closes(small_reference):
    """The trapezoidal rule takes nothing of its own, whatever the step."""
    left = []
    for steps in (100, 200, 400):
        scheme = scheme_of(small_reference.joint, steps)
        load = sine(small_reference, 6, 4e-4, steps)
        history = run_history(
            scheme, prestressed_state(scheme), load, recording(scheme, len(load) - 1, steps)
        )
        e = history.energies
        left.append(abs(e.scheme[-1] + e.normal[-1]) / e.external[-1])
    print(f"missing over work of the load: {left}")
    assert max(left) < 2e-3


def test_energy_of_the_motion_is_the_work_of_a_lossless_joint(small_reference):
    """Without friction and damping the load's work is all in the motion."""
    model = replace(small_reference.model, rayleigh=(0.0, 0.0))
    joint = small_reference.joint.with_model(model).with_friction(0.0)
    scheme = scheme_of(joint, 400)
    load = sine(small_reference, 5, 1e-6, 400)
    history = run_history(
        scheme, prestressed_state(scheme), load, recording(scheme, len(load) - 1, 400)
    )
    e = history.energies
    assert e.mechanical[1:] == pytest.approx(e.external[1:], rel=1e-3)


# -- starts ------------------------------------------------------------------------------------


def test_static_start_is_the_quasi_static_answer_and_stays(small_reference):
    joint = small_reference.joint
    scheme = scheme_of(joint)
    load = 4e-3 * small_reference.moment
    state = static_state(scheme, load)
    held = march(scheme, state, np.full(2 * STEPS, load))
    q = held.output[:, joint.model.port("sliding")]
    rise = quasi_static_cycle(joint, "moment", load, max_cycles=1)
    assert held.output[0] == pytest.approx(rise.output[75], rel=1e-8)
    assert np.ptp(q) < 1e-9 * abs(q[0])
    assert held.dissipated < 1e-9 * load * abs(held.output[0, joint.model.port("moment")])


def test_static_start_of_an_elastic_contact_stays(small_reference):
    model = small_reference.model
    springs = np.zeros(2 * model.pairs)
    springs[tangential_rows()] = 1 / (1e13 * model.area)
    law = contact_law(model.pairs, FRICTION, springs)
    rigid = small_reference.joint
    joint = prepare_joint(model, law, rigid.prestress.preload, "moment", rigid.mode)
    scheme = scheme_of(joint)
    load = 2e-3 * small_reference.moment
    state = static_state(scheme, load)
    q = march(scheme, state, np.full(STEPS, load)).output[:, joint.model.port("sliding")]
    assert np.ptp(q) < 1e-8 * abs(q[0])


def test_decay_of_the_mode_starts_with_its_velocity(small_reference):
    scheme = scheme_of(small_reference.joint, 600)
    omega, amplitude = small_reference.states.sliding_omega, 1e-4
    state = prestressed_state(scheme, amplitude, omega)
    q = march(scheme, state, np.zeros(3)).output[:, scheme.joint.model.port("sliding")]
    assert q[0] == pytest.approx(0, abs=1e-12)
    assert (q[2] - q[0]) / (2 * scheme.dt) == pytest.approx(amplitude * omega, rel=0.02)


# -- ends --------------------------------------------------------------------------------------


def test_a_stopped_history_is_kept(small_reference):
    scheme = scheme_of(small_reference.joint)
    load = sine(small_reference, 10, 1e-4)
    seen = []
    history = run_history(
        scheme,
        prestressed_state(scheme),
        load,
        recording(scheme, len(load) - 1),
        advance=lambda: seen.append(1),
        stopped=lambda: len(seen) == 3,
    )
    assert not history.complete
    assert history.failure == ""
    assert len(history.time) == len(history.load) == len(history.output) == 3 * STEPS + 1
    assert history.steps == 10 * STEPS
    assert history.kept.max() <= 3 * STEPS
    assert len(history.kept) == len(history.r) == len(history.status)
    assert len(history.energies.time) == 4


def test_a_joint_that_opens_ends_its_history(small_reference):
    scheme = scheme_of(small_reference.joint)
    load = sine(small_reference, 20, 0.1)
    history = run_history(scheme, prestressed_state(scheme), load, recording(scheme, len(load) - 1))
    assert not history.complete
    assert "the joint opens at t = " in history.failure
    assert "the last pair to separate is" in history.failure
    time = float(history.failure.split("t = ")[1].split(" s")[0])
    assert history.time[-1] - STEPS * history.dt <= time <= history.time[-1]


def test_a_step_that_does_not_solve_names_its_cycle(small_reference, monkeypatch):
    """Three good cycles, then an error: they are kept and the message says where."""
    calls = []

    def failing(*args, **kwargs):
        calls.append(1)
        if len(calls) == 5:
            raise ContactError("contact not solved")
        return march(*args, **kwargs)

    monkeypatch.setattr(module, "march", failing)
    scheme = scheme_of(small_reference.joint)
    load = sine(small_reference, 10, 1e-4)
    history = run_history(scheme, prestressed_state(scheme), load, recording(scheme, len(load) - 1))
    start = 3 * STEPS * scheme.dt
    assert history.failure == f"in the cycle that starts at t = {start:.6g} s: contact not solved"
    assert history.time[-1] == pytest.approx(start)


def test_stepped_sine_reaches_the_steady_state(small_reference):
    """Second method: the periodic orbit. 70 cycles leave exp(-pi 70 gamma), gamma 0.02: 1 %."""
    joint = small_reference.joint
    frequency = joint.mode.sliding_frequency + 5.0
    dt = 1 / (frequency * STEPS)
    scheme = time_scheme(joint, dt)
    load = 3e-4 * small_reference.moment
    _, wave = stepped_sine(load, [frequency - 2, frequency], 70, dt)
    history = run_history(scheme, prestressed_state(scheme), wave, recording(scheme, len(wave) - 1))
    q = history.output[:, joint.model.port("sliding")]
    found = dwell_response(history.time, q, [frequency - 2, frequency], 70)[1]
    steady = steady_state(scheme, frequency, load).amplitude
    print(f"dwell {found:.6g}, steady {steady:.6g}, {abs(found - steady) / abs(steady):.1e}")
    assert abs(found - steady) < 0.01 * abs(steady)

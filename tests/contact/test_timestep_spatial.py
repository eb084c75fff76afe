"""Time steps with spatial contact: a planar joint turned in its plane, energies, a slider by hand."""

from __future__ import annotations

import numpy as np
import pytest
from spatial_twin import lift, spatial_joint

from microslip.analyses.time.scheme import march, prestressed_state, time_scheme
from microslip.contact.pairs import SEPARATED, SLIP, STICK, at_rest, slip_history
from microslip.contact.problem import contact_problem
from microslip.contact.spatial_tableau import memory
from microslip.contact.tangent import Tangents
from microslip.contact.timestep import (
    EXTERNAL,
    FRICTION,
    MODAL,
    NORMAL,
    Motion,
    Records,
    StepConstants,
    step_through,
)


def step(constants, flexibilities, friction, force, motion, load):
    """March with spatial contact over all steps of a load, everything kept."""
    m, N, n = len(friction), len(motion.v), len(load)
    none = np.zeros((N, 0))
    problems = tuple(
        contact_problem(W, none, np.zeros(0), friction, force, 1e-12) for W in flexibilities
    )
    records = Records(
        output=np.zeros((n, constants.out_load.shape[1])),
        works=np.zeros(5),
        friction_work=np.zeros(m),
        r=np.zeros((n, N)),
        v=np.zeros((n, N)),
        status=np.zeros((n, m), np.int8),
        iterations=np.zeros(n, np.int64),
        residual=np.zeros(n),
        dissipative=np.zeros(n, np.bool_),
    )
    kernel = constants
    records.output[0] = (
        kernel.out_load[0]
        + kernel.out_load[1] * load[0]
        + kernel.out_modes.T @ motion.eta
        - kernel.out_v @ motion.r
    )
    records.r[0], records.v[0], records.status[0] = motion.r, motion.v, motion.status
    memories = memory(m, 0), memory(m, 0)
    k = len(motion.eta)
    none_moves = Tangents(*(np.zeros((0, size)) for size in (k, k, k, N, N, N, N)))
    failed = step_through(problems, memories, constants, load, motion, records, none_moves)
    assert failed == -1
    assert records.residual.max() <= 1e-9
    return records


@pytest.mark.parametrize("share", [0.5, 2.0])
def test_march_is_that_of_the_planar_joint(small_reference, share):
    """From rest under a moment that makes much slip, and one that throws the joint open."""
    joint = small_reference.joint
    angle, dt, n = 0.7, 4e-5, 200
    load = share * 0.001 * small_reference.moment * np.sin(np.linspace(0, 8 * np.pi, n))
    flat = time_scheme(joint, dt)
    one = march(flat, prestressed_state(flat), load, keep=True)
    spatial = time_scheme(spatial_joint(joint, angle), dt)
    state = prestressed_state(spatial)
    motion = Motion(
        **{name: getattr(state, name).copy() for name in Motion._fields if name != "vt_old"},
        vt_old=slip_history(state.v, 3),
    )
    force = np.full(len(motion.status), joint.prestress.largest_reaction)
    found = step(
        spatial.kernel, (spatial.W, spatial.W_dissipative), joint.law.friction, force, motion, load
    )
    E = lift(len(force), angle)
    assert np.abs(found.r - one.r @ E.T).max() <= 1e-8 * np.abs(one.r).max()
    assert (
        np.abs(found.output - found.output[0] - one.output).max() <= 1e-9 * np.abs(one.output).max()
    )
    assert found.works[FRICTION] == pytest.approx(one.friction_work.sum(), rel=1e-7)
    assert found.works[NORMAL] == pytest.approx(one.normal_work, rel=1e-6, abs=1e-9)
    assert np.array_equal(found.dissipative, one.dissipative)
    assert (found.status == SLIP).any()
    if share > 1:
        opens = (found.status == SEPARATED) & (found.status[0] != SEPARATED)
        assert opens.any()


def block(seed, pairs=4, modes=6):
    """Modes that move pairs both ways, pressed together by a constant force on all of them."""
    rng = np.random.default_rng(seed)
    psi = rng.standard_normal((modes, 3 * pairs))
    A = rng.standard_normal((3 * pairs, 3 * pairs))
    residual = A @ A.T / (3 * pairs) * 0.05 + 0.02 * np.eye(3 * pairs)
    omega = np.sort(rng.uniform(1, 6, modes))
    return rng, psi, residual, omega


def test_energy_of_pairs_that_slip_both_ways_balances():
    """Kinetic, strain and residual energy change by the works of load, friction and dashpots, to rounding.

    Pressed by constant forces, whose potential counts, and driven on the modes, which have slip turn.
    """
    pairs, modes, dt, n = 4, 6, 0.02, 400
    _, psi, residual, omega = block(3)
    h, c = np.full(modes, dt), np.full(modes, 0.02)
    pressed = np.zeros(3 * pairs)
    pressed[::3] = 3.0
    drive = np.ones(modes)
    nothing = np.zeros(3 * pairs)
    constants = StepConstants(
        psi_t=psi,
        omega=omega,
        mode_step=h,
        mode_damping=c,
        mode_gain=np.ones(modes),
        lags=np.zeros(3),
        drive_modes=drive,
        drive_v=nothing,
        constant_modes=psi @ pressed,
        constant_v=residual @ pressed,
        out_modes=drive[:, None].copy(),
        out_v=np.zeros((1, 3 * pairs)),
        out_load=np.zeros((2, 1)),
        drive=0,
    )
    per_force = 0.25 * dt**2 / (1 + 0.5 * dt * c + 0.25 * (dt * omega) ** 2)
    modal = (psi.T * per_force) @ psi
    eta = np.zeros(modes)
    motion = Motion(
        eta=eta,
        rate=np.zeros(modes),
        acceleration=np.zeros(modes),
        residual_v=nothing.copy(),
        residual_before=nothing.copy(),
        r=pressed.copy(),
        v=nothing.copy(),
        taken=np.zeros(1),
        vt_old=np.zeros((pairs, 2)),
        status=at_rest(np.ones(pairs, bool)),
    )
    friction = np.linspace(0.2, 0.5, pairs)
    load = 4 * np.sin(1.3 * dt * np.arange(n))
    before = 0.5 * pressed @ residual @ pressed
    found = step(
        constants,
        (residual + modal, residual + 2 * modal),
        friction,
        np.full(pairs, 3.0),
        motion,
        load,
    )
    slips = found.status == SLIP
    assert slips.any()
    assert (found.status == STICK).any()
    turns = np.diff(found.v.reshape(n, pairs, 3)[..., 1:], axis=0)
    across = turns[1:, :, 0] * turns[:-1, :, 1] - turns[1:, :, 1] * turns[:-1, :, 0]
    assert np.abs(across[slips[1:-1]]).max() > 0
    energy = 0.5 * motion.rate @ motion.rate + 0.5 * (omega * motion.eta) @ (omega * motion.eta)
    stored = energy + 0.5 * motion.r @ residual @ motion.r - before - pressed @ psi.T @ motion.eta
    works = found.works
    assert not found.dissipative.any()
    assert not (found.status == SEPARATED).any()
    balance = works[EXTERNAL] - works[FRICTION] - works[NORMAL] - works[MODAL]
    assert stored == pytest.approx(balance, abs=1e-9 * works[EXTERNAL])
    assert works[FRICTION] > 0

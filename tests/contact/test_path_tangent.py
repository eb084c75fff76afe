"""Derivatives of load paths against differences of two paths."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from random_spatial import random_flexibility, turned
from spatial_twin import spatial_joint

from microslip.analyses.statics.cycle_tangent import upper_answers
from microslip.analyses.statics.held import hold_mode
from microslip.analyses.statics.prescribed import (
    at_rest,
    prescribed_cycle,
    prescribed_path,
    solver_at,
)
from microslip.contact.pairs import STICK, tangential, tangential_vectors
from microslip.contact.path import follow_path
from microslip.contact.path_tangent import path_tangent
from microslip.contact.solver import ContactSolver
from microslip.model.flexibility import Flexibility


@pytest.fixture(scope="module")
def held(small_reference):
    joint = small_reference.joint
    return hold_mode(joint, 1.03 * joint.principal().sliding_omega, upper=4)


def followed(held, path):
    solver, vt_old = solver_at(held, at_rest(held))
    record = follow_path(solver, held.flexibility, path, vt_old, where=str, remedy="")
    return solver, record


@pytest.mark.parametrize("size", [2e-5, 3e-4, 2e-3])
def test_derivatives_are_limits_of_differences(held, size):
    """Small and wide slip, and opening; two ports in two directions at once."""
    rng = np.random.default_rng(1)
    theta, path = prescribed_path(held, size, 60)
    # from rest: from where q passes through zero
    zero = int(np.argmin(np.abs(theta)))
    path = np.concatenate([path[zero:], path[1 : zero + 1]])
    solver, record = followed(held, path)
    assert len(np.unique(record.status)) > 1
    changes = np.zeros((61, 2, path.shape[1]))
    for k, port in enumerate(["upper 1", held.drive]):
        column = held.model.port(port)
        changes[1:, k, column] = rng.standard_normal(60)
    tangent = path_tangent(solver, held.flexibility, record, changes)
    for k in range(2):
        step = 1e-5 * np.abs(record.r).max() / np.abs(tangent.r[:, k]).max()
        _, moved = followed(held, path + step * changes[:, k])
        assert np.array_equal(moved.status, record.status)
        for name in ("r", "q"):
            before = getattr(record, name)
            wanted = (getattr(moved, name) - before) / step
            rounding = 1e-11 * np.abs(before).max() / step
            found = getattr(tangent, name)[:, k]
            assert np.abs(found - wanted).max() <= 1e-5 * np.abs(wanted).max() + rounding
        slip = (tangential(moved.v)[-1] - tangential(record.v)[-1]) / step
        assert np.abs(tangent.vt[k] - slip).max() <= 1e-5 * np.abs(slip).max()


def test_answers_to_upper_loads_are_limits_of_cycles(held):
    """Two cycles with a small load against the derivative; the load's third harmonic of the next mode."""
    steps, mode, order = 104, 0, 3
    size = 5e-4
    kept = {"steps": steps, "cycles": 20, "closure": 1e-11, "harmonics": order}
    base = prescribed_cycle(held, size, **kept)
    answers = upper_answers(held, base, [(mode, order)], steps=steps, closure=1e-9)
    load = 1e-6 * size * held.upper_omega[mode] ** 2
    for k, unit in enumerate((1.0, 1j)):
        moved = prescribed_cycle(
            held, size, upper={(mode, order): load * unit}, start=base.state, **kept
        )
        motion = (moved.upper[mode, order - 1] - base.upper[mode, order - 1]) / load
        force = (moved.force / moved.q * base.q - base.force) / load
        assert answers.motion[0, k] == pytest.approx(motion, rel=1e-4)
        assert answers.force[0, k] == pytest.approx(force, rel=1e-2, abs=1e-4)


# -- in space --------------------------------------------------------------------------------------


def random_path(rng, pairs, steps):
    """Pairs under pressure that are dragged round in curves, each its own; two bodies on soft springs."""
    n = 3 * pairs
    W = random_flexibility(rng, pairs)
    theta = 2 * np.pi * np.arange(steps + 1) / steps
    path = np.zeros((steps + 1, n + 2))
    for j in range(n):
        waves = rng.standard_normal((2, 3)) / [1.0, 2.0, 3.0]
        orders = np.outer(theta, [1, 2, 3])
        path[:, j] = (np.sin(orders) @ waves[0] + np.cos(orders) @ waves[1]) * 1e-9
    path[:, 0:n:3] = 1e-9 * (1.0 + 0.5 * path[:, 0:n:3] / 1e-9)
    path[:, n:] = 0.2 * np.sin(theta[:, None] + [0.0, 1.0])
    R = rng.standard_normal((n, 2))
    flexibility = Flexibility(
        W=W,
        R=R,
        stiffness=np.array([1e8, 2e8]),
        loads_v=np.hstack([np.eye(n), np.zeros((n, 2))]),
        loads_q=np.hstack([np.zeros((2, n)), np.eye(2)]),
        loads_loads=np.zeros((n + 2, n + 2)),
    )
    return flexibility, path


def along(flexibility, path):
    """A path from rest at its first row, all pairs sticking there."""
    pairs = len(flexibility.W) // 3
    solver = ContactSolver(flexibility, 0.4, np.ones(pairs), np.full(pairs, STICK, np.int8))
    vt_old = np.zeros((pairs, 2))
    start = np.vstack([path[:1], path[:1]])
    follow_path(solver, flexibility, start, vt_old, where=str, remedy="")
    record = follow_path(solver, flexibility, path, vt_old, where=str, remedy="")
    return solver, record


@pytest.mark.parametrize("seed", range(6))
def test_derivatives_in_space_are_limits_of_differences(seed):
    """Slip that turns, opening and closing; both sides."""
    rng = np.random.default_rng(seed)
    flexibility, path = random_path(rng, 6, 60)
    solver, record = along(flexibility, path)
    assert len(np.unique(record.status)) == 3
    changes = np.zeros((len(path), 2, path.shape[1]))
    changes[1:] = rng.standard_normal((len(path) - 1, 2, path.shape[1]))
    changes[..., :-2] *= 1e-9
    tangent = path_tangent(solver, flexibility, record, changes)
    for k in range(2):
        step = 1e-6
        _, ahead = along(flexibility, path + step * changes[:, k])
        _, behind = along(flexibility, path - step * changes[:, k])
        for other in (ahead, behind):
            assert np.array_equal(other.status, record.status)
        for name in ("r", "q"):
            wanted = (getattr(ahead, name) - getattr(behind, name)) / (2 * step)
            found = getattr(tangent, name)[:, k]
            assert np.abs(found - wanted).max() <= 1e-7 * np.abs(wanted).max()
        slip = tangential_vectors(ahead.v - behind.v)[-1].ravel() / (2 * step)
        assert np.abs(tangent.vt[k] - slip).max() <= 1e-7 * np.abs(slip).max()


def test_turning_the_tangents_turns_the_derivatives():
    rng = np.random.default_rng(20)
    flexibility, path = random_path(rng, 6, 60)
    changes = np.zeros((len(path), 1, path.shape[1]))
    changes[1:, 0, :-2] = 1e-9 * rng.standard_normal((len(path) - 1, path.shape[1] - 2))
    Q = turned(6, rng.uniform(0, 6, 6))
    other = replace(
        flexibility,
        W=Q @ flexibility.W @ Q.T,
        R=Q @ flexibility.R,
        loads_v=Q @ flexibility.loads_v,
    )
    one, two = (
        path_tangent(solver, f, record, changes).r[:, 0]
        for f in (flexibility, other)
        for solver, record in [along(f, path)]
    )
    assert np.abs(two - one @ Q.T).max() <= 1e-7 * np.abs(one).max()


def test_a_planar_joint_in_space_has_its_answers(held, small_reference):
    """The same joint with a third direction that nothing drives."""
    joint = small_reference.joint
    angle, steps, size = 0.7, 60, 5e-4
    twin = spatial_joint(joint, angle)
    aside = hold_mode(twin, 1.03 * twin.principal().sliding_omega, upper=4)
    loads = [(0, 3), (1, 3), (1, 2)]
    kept = {"steps": steps, "cycles": 20, "closure": 1e-11, "harmonics": 3}
    flat = upper_answers(
        held, prescribed_cycle(held, size, **kept), loads, steps=steps, closure=1e-9
    )
    base = prescribed_cycle(aside, size, **kept)
    lifted = upper_answers(aside, base, loads, steps=steps, closure=1e-9)
    # what couples by symmetry alone is zero, up to rounding; modes may have the other sign
    assert np.abs(flat.force).max() > 1e-4
    assert np.abs(flat.motion - lifted.motion).max() <= 1e-8 * np.abs(flat.motion).max()
    assert (
        np.abs(np.abs(flat.force) - np.abs(lifted.force)).max() <= 1e-8 * np.abs(flat.force).max()
    )

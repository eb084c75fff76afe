"""Derivatives of load paths against differences of two paths."""

from __future__ import annotations

import numpy as np
import pytest

from microslip.analyses.statics.cycle_tangent import upper_answers
from microslip.analyses.statics.held import hold_mode
from microslip.analyses.statics.prescribed import (
    at_rest,
    prescribed_cycle,
    prescribed_path,
    solver_at,
)
from microslip.contact.pairs import tangential
from microslip.contact.path import follow_path
from microslip.contact.path_tangent import path_tangent


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
    _, path = prescribed_path(held, size, 60)
    solver, record = followed(held, path)
    assert len(np.unique(record.status)) > 1
    changes = np.zeros((61, 2, path.shape[1]))
    for k, port in enumerate(["upper 1", held.drive]):
        column = held.model.port(port)
        changes[1:, k, column] = rng.standard_normal(60)
    tangent = path_tangent(solver, held.flexibility, record.status, changes)
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

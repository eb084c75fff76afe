"""Load paths against a Jenkins element, whose hysteresis loop is a parallelogram."""

from __future__ import annotations

import sys

import numpy as np
import pytest
from conftest import ROOT

from microslip.contact import path as module
from microslip.contact.pairs import BACKWARD, FORWARD, STICK, normal, tangential
from microslip.contact.path import follow_path
from microslip.contact.solver import ContactSolver
from microslip.errors import ContactError
from microslip.model.flexibility import Flexibility

sys.path.insert(0, str(ROOT / "benchmarks" / "population"))

from contact_problems import problems

MU, STIFFNESS = 0.25, 2.0
CLAMP = np.array([8.0, 16.0])
"""Friction limits 2 and 4: the springs yield at tangential displacements of 1 and 2."""


def jenkins() -> tuple[ContactSolver, Flexibility]:
    """Two uncoupled pairs, pressed by CLAMP; port 0 clamps, port 1 moves both sideways."""
    W = np.diag(np.full(4, 1 / STIFFNESS))
    loads = np.zeros((4, 2))
    normal(loads.T)[0] = CLAMP / STIFFNESS
    tangential(loads.T)[1] = 1.0
    none = np.zeros((4, 0))
    flexibility = Flexibility(W, none, np.zeros(0), loads, np.zeros((0, 2)), np.zeros((2, 2)))
    solver = ContactSolver(flexibility, MU, CLAMP, np.full(2, STICK, np.int8))
    reaction = np.zeros(4)
    normal(reaction)[:] = CLAMP
    solver.start_from(reaction, np.zeros(0), np.zeros(4))
    return solver, flexibility


def sideways(displacement: list[float]) -> np.ndarray:
    return np.column_stack([np.ones(len(displacement)), displacement])


def follow(solver, flexibility, path, vt_old):
    def where(step):
        return f"at {path[step, 1]:g} m"

    return follow_path(solver, flexibility, path, vt_old, where=where, remedy="pull less")


def test_hysteresis_loop_is_the_parallelogram():
    solver, flexibility = jenkins()
    vt_old = np.zeros(2)
    follow(solver, flexibility, sideways([0.0, 1, 2, 3]), vt_old)
    np.testing.assert_allclose(tangential(solver.r), MU * CLAMP)
    np.testing.assert_array_equal(solver.status, FORWARD)
    cycle = follow(
        solver, flexibility, sideways([3.0, 2, 1, 0, -1, -2, -3, -2, -1, 0, 1, 2, 3]), vt_old
    )
    limit = MU * CLAMP
    np.testing.assert_allclose(cycle.friction_work, 4 * limit * (3 - limit / STIFFNESS), rtol=1e-12)
    np.testing.assert_array_equal(cycle.status[6], BACKWARD)
    np.testing.assert_allclose(tangential(cycle.r)[6], -limit)
    np.testing.assert_allclose(normal(cycle.r), np.tile(CLAMP, (13, 1)))
    np.testing.assert_allclose(cycle.r[-1], cycle.r[0], atol=1e-12)
    assert abs(cycle.normal_work) < 1e-12
    np.testing.assert_array_equal(vt_old, tangential(cycle.v)[-1])


def test_record_starts_with_the_state_at_entry():
    solver, flexibility = jenkins()
    before = solver.r.copy()
    record = follow(solver, flexibility, sideways([0.0, 0.5]), np.zeros(2))
    np.testing.assert_array_equal(record.r[0], before)
    np.testing.assert_array_equal(record.status[0], STICK)
    np.testing.assert_array_equal(record.r[1], solver.r)
    np.testing.assert_allclose(tangential(record.r)[1], 0.5 * STIFFNESS)


def test_a_step_without_proof_says_where_and_what_to_try(monkeypatch):
    solver, flexibility = jenkins()
    monkeypatch.setattr(module, "CERTIFICATE", -1.0)
    with pytest.raises(ContactError, match=r"at step 0 of 1 at 0 m: residual .*; pull less"):
        follow(solver, flexibility, sideways([0.0, 0.5]), np.zeros(2))


def test_a_motion_held_by_nothing_is_named():
    """A coordinate that slides both pairs, frictionless and without support, has no equilibrium."""
    _, f = jenkins()
    R = np.zeros((4, 1))
    tangential(R.T)[:] = 1.0
    free = Flexibility(f.W, R, np.zeros(1), f.loads_v, np.zeros((1, 2)), f.loads_loads)
    with pytest.raises(ContactError, match="held by neither contact, friction nor support"):
        ContactSolver(free, 0.0, CLAMP, np.full(2, FORWARD, np.int8))


def test_a_path_goes_on_where_the_active_set_cycles():
    """Jumps of load with friction of 1.6: the last resort follows where halved steps do not help."""
    W, mu, loads = list(problems(1, 9))[8]
    n = len(W)
    none = np.zeros((n, 0))
    flexibility = Flexibility(W, none, np.zeros(0), np.eye(n), np.zeros((0, n)), np.zeros((n, n)))
    solver = ContactSolver(flexibility, mu, np.ones(n // 2), np.full(n // 2, STICK, np.int8))
    vt_old = np.zeros(n // 2)
    path = np.vstack([np.zeros(n), loads])
    found = follow_path(solver, flexibility, path, vt_old, where=lambda step: "", remedy="")
    assert found.residual.max() <= 1e-9
    assert found.fallbacks.steps == len(loads)
    assert found.fallbacks.lemke > 0
    assert found.fallbacks == solver.fallbacks

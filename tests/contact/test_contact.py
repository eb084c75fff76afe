"""The contact solver on random problems, judged by the contact laws written out again."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st
from random_contact import plain, random_flexibility, unique_friction, violation

from microslip.contact.pairs import (
    BACKWARD,
    FORWARD,
    SEPARATED,
    STICK,
    normal,
    normal_rows,
    tangential,
    tangential_rows,
)
from microslip.contact.solver import ContactSolver
from microslip.errors import ContactError
from microslip.model.flexibility import with_compliance

SETTINGS = settings(
    max_examples=150, deadline=None, derandomize=True, suppress_health_check=[HealthCheck.too_slow]
)


problems = {
    "seed": st.integers(0, 2**32 - 1),
    "pairs": st.integers(1, 12),
    "mu": st.floats(0, 1),
}


def random_problem(seed, pairs):
    rng = np.random.default_rng(seed)
    W = random_flexibility(rng, pairs)
    force = np.full(pairs, 100.0)
    v_free = 1e-7 * rng.standard_normal(2 * pairs)
    vt_old = 1e-8 * rng.standard_normal(pairs)
    return rng, W, force, v_free, vt_old


@SETTINGS
@given(**problems)
def test_solution_obeys_the_contact_laws(seed, pairs, mu):
    rng, W, force, v_free, vt_old = random_problem(seed, pairs)
    friction = mu * rng.uniform(0, 1, pairs)
    status = rng.integers(1, 5, pairs).astype(np.int8)
    solution = ContactSolver(plain(W), friction, force, status).solve(v_free, np.zeros(0), vt_old)
    assert violation(W, v_free, friction, vt_old, solution.r, force) <= 1e-8
    assert np.allclose(solution.v, v_free - W @ solution.r, rtol=0, atol=1e-8 * 1e-7)


@SETTINGS
@given(**problems)
def test_equilibrium_coordinates_are_in_balance(seed, pairs, mu):
    """Free motions held by contact (approach, shift) and a weak spring on both."""
    rng, W, force, v_free, vt_old = random_problem(seed, pairs)
    R = np.zeros((2 * pairs, 2))
    R[normal_rows(), 0] = 1.0
    R[tangential_rows(), 1] = 1.0
    stiffness = np.array([0.0, 1e5])
    f_q = np.array([100.0 * pairs, 20.0 * rng.standard_normal() * pairs])
    friction = np.full(pairs, mu)
    solver = ContactSolver(plain(W, R, stiffness), friction, force, np.ones(pairs, np.int8))
    s = solver.solve(v_free, f_q, vt_old)
    found = violation(W, v_free, friction, vt_old, s.r, force, R, s.q, stiffness, f_q)
    assert found <= 1e-8
    assert normal(s.r).sum() == pytest.approx(f_q[0], rel=1e-8)


@SETTINGS
@given(seed=st.integers(0, 2**32 - 1), pairs=st.integers(1, 12))
def test_frictionless_solution_is_the_minimum_of_energy(seed, pairs):
    """mu = 0: r_n minimises r W r/2 - v_free r over r >= 0 (projected gradient, from scratch)."""
    _, W, force, v_free, _ = random_problem(seed, pairs)
    solution = ContactSolver(plain(W), 0.0, force, np.ones(pairs, np.int8)).solve(
        v_free, np.zeros(0), np.zeros(pairs)
    )
    N, b = W[normal_rows(), normal_rows()], normal(v_free)
    step = 1 / np.linalg.eigvalsh(N).max()
    r = np.zeros(pairs)
    for _ in range(4000):
        r = np.maximum(0, r + step * (b - N @ r))
    assert np.abs(normal(solution.r) - r).max() <= 1e-7 * force[0]
    assert np.all(tangential(solution.r) == 0)


@SETTINGS
@given(seed=st.integers(0, 2**32 - 1), pairs=st.integers(1, 12))
def test_warm_and_cold_start_agree_where_the_solution_is_unique(seed, pairs):
    rng, W, force, v_free, vt_old = random_problem(seed, pairs)
    mu = 0.9 * unique_friction(W)
    cold = ContactSolver(plain(W), mu, force, np.ones(pairs, np.int8))
    expected = cold.solve(v_free, np.zeros(0), vt_old)
    warm = ContactSolver(plain(W), mu, force, rng.integers(1, 5, pairs).astype(np.int8))
    for _ in range(5):
        other = 1e-7 * rng.standard_normal(2 * pairs)
        warm.solve(other, np.zeros(0), 1e-8 * rng.standard_normal(pairs))
    again = warm.solve(v_free, np.zeros(0), vt_old)
    assert np.abs(again.r - expected.r).max() <= 1e-7 * force[0]


@SETTINGS
@given(**problems, scale=st.floats(1e-6, 1e6))
def test_solution_scales_with_the_load(seed, pairs, mu, scale):
    _, W, force, v_free, vt_old = random_problem(seed, pairs)
    start = np.ones(pairs, np.int8)
    one = ContactSolver(plain(W), mu, force, start).solve(v_free, np.zeros(0), vt_old)
    other = ContactSolver(plain(W), mu, scale * force, start).solve(
        scale * v_free, np.zeros(0), scale * vt_old
    )
    assert np.array_equal(one.status, other.status)
    assert np.abs(other.r - scale * one.r).max() <= 1e-10 * scale * force[0]


@SETTINGS
@given(**problems)
def test_reversing_the_tangential_axis_mirrors_the_solution(seed, pairs, mu):
    """v_t -> -v_t everywhere: r_t changes sign, forward and backward change places."""
    _, W, force, v_free, vt_old = random_problem(seed, pairs)
    flip = np.tile([1.0, -1.0], pairs)
    start = np.ones(pairs, np.int8)
    one = ContactSolver(plain(W), mu, force, start).solve(v_free, np.zeros(0), vt_old)
    other = ContactSolver(plain(W * np.outer(flip, flip)), mu, force, start).solve(
        flip * v_free, np.zeros(0), -vt_old
    )
    assert np.abs(other.r - flip * one.r).max() <= 1e-10 * force[0]


def test_pressed_pair_by_hand():
    """One pair: v_n = 0 gives r_n = 2; the pull of 3 exceeds mu r_n = 1 and slips 2 W."""
    solver = ContactSolver(plain(np.eye(2)), 0.5, np.ones(1), np.ones(1, np.int8))
    s = solver.solve(np.array([2.0, 3.0]), np.zeros(0), np.zeros(1))
    assert s.r == pytest.approx([2.0, 1.0])
    assert s.v == pytest.approx([0.0, 2.0])
    assert s.status[0] == FORWARD
    s = solver.solve(np.array([2.0, 2.5]), np.zeros(0), np.array([2.0]))
    assert s.r == pytest.approx([2.0, 0.5])
    assert s.status[0] == STICK
    s = solver.solve(np.array([2.0, 0.0]), np.zeros(0), np.array([2.0]))
    assert s.r == pytest.approx([2.0, -1.0])
    assert s.status[0] == BACKWARD
    s = solver.solve(np.array([-1.0, 5.0]), np.zeros(0), np.array([0.0]))
    assert s.r == pytest.approx([0.0, 0.0])
    assert s.status[0] == SEPARATED


def test_compliance_is_a_spring_in_series():
    W = with_compliance(plain(np.diag([1.0, 2.0])), np.array([0.5, 3.0])).W
    assert np.array_equal(W, np.diag([1.5, 5.0]))


@pytest.mark.parametrize("friction", [-0.1, np.nan, np.inf])
def test_impossible_friction_is_refused(friction):
    with pytest.raises(ContactError, match="friction"):
        ContactSolver(plain(np.eye(2)), friction, np.ones(1), np.ones(1, np.int8))


def test_wrong_size_is_refused():
    with pytest.raises(ContactError, match="rows"):
        ContactSolver(plain(np.eye(4)), 0.1, np.ones(1), np.ones(1, np.int8))

"""The spatial contact solver on random problems, judged by the contact laws written out again."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st
from random_contact import plain
from random_spatial import random_flexibility, turned, violation

from microslip.contact.pairs import (
    SEPARATED,
    SLIP,
    STICK,
    by_pair,
    normal,
    slip_history,
    tangential_vectors,
)
from microslip.contact.path import follow_path
from microslip.contact.problem import Contact, Given, contact_problem
from microslip.contact.solver import ContactSolver
from microslip.contact.spatial_newton import ACCEPTED
from microslip.contact.spatial_problem import natural_residual
from microslip.contact.spatial_rescue import (
    extragradient,
    facets,
    load_in_parts,
    other_scales,
    proximal,
)
from microslip.contact.spatial_tableau import keep, memory, restart
from microslip.errors import ContactError
from microslip.model.flexibility import Flexibility, with_compliance

SETTINGS = settings(
    max_examples=100, deadline=None, derandomize=True, suppress_health_check=[HealthCheck.too_slow]
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
    v_free = 1e-7 * rng.standard_normal(3 * pairs)
    vt_old = 1e-8 * rng.standard_normal((pairs, 2))
    return rng, W, force, v_free, vt_old


@SETTINGS
@given(**problems)
def test_solution_obeys_the_contact_laws(seed, pairs, mu):
    rng, W, force, v_free, vt_old = random_problem(seed, pairs)
    friction = mu * rng.uniform(0, 1, pairs)
    status = rng.choice([STICK, SLIP, SEPARATED], pairs).astype(np.int8)
    solution = ContactSolver(plain(W), friction, force, status).solve(v_free, np.zeros(0), vt_old)
    assert violation(W, v_free, friction, vt_old, solution.r, force) <= 1e-8
    assert np.allclose(solution.v, v_free - W @ solution.r, rtol=0, atol=1e-8 * 1e-7)
    assert solution.residual <= 1e-9


@SETTINGS
@given(**problems)
def test_equilibrium_coordinates_are_in_balance(seed, pairs, mu):
    """Free motions held by contact (approach, two shifts) and a weak spring on the shifts."""
    rng, W, force, v_free, vt_old = random_problem(seed, pairs)
    R = np.tile(np.eye(3), (pairs, 1))
    stiffness = np.array([0.0, 1e5, 1e5])
    f_q = np.r_[100.0, 20.0 * rng.standard_normal(2)] * pairs
    friction = np.full(pairs, mu)
    solver = ContactSolver(plain(W, R, stiffness), friction, force, np.ones(pairs, np.int8))
    s = solver.solve(v_free, f_q, vt_old)
    found = violation(W, v_free, friction, vt_old, s.r, force, R, s.q, stiffness, f_q)
    assert found <= 1e-8
    assert normal(s.r, 3).sum() == pytest.approx(f_q[0], rel=1e-8)


@SETTINGS
@given(**problems)
def test_turning_the_tangential_axes_of_every_pair_turns_the_solution(seed, pairs, mu):
    """v -> Q v with a rotation of its own about each pair's normal: r -> Q r, along a path."""
    rng, W, force, v_free, _ = random_problem(seed, pairs)
    Q = turned(pairs, rng.uniform(0, 2 * np.pi, pairs))
    start = np.ones(pairs, np.int8)
    one = ContactSolver(plain(W), mu, force, start)
    other = ContactSolver(plain(Q @ W @ Q.T), mu, force, start)
    old, turned_old = np.zeros((pairs, 2)), np.zeros((pairs, 2))
    for _ in range(4):
        a = one.solve(v_free, np.zeros(0), old)
        b = other.solve(Q @ v_free, np.zeros(0), turned_old)
        assert np.abs(b.r - Q @ a.r).max() <= 1e-8 * force[0]
        assert np.array_equal(a.status, b.status)
        old, turned_old = slip_history(a.v, 3), slip_history(b.v, 3)
        v_free = v_free + 3e-8 * rng.standard_normal(3 * pairs)


@SETTINGS
@given(seed=st.integers(0, 2**32 - 1), pairs=st.integers(1, 12), mu=st.floats(0, 0.4))
def test_in_one_direction_it_is_the_planar_solution(seed, pairs, mu):
    """A second tangential direction that nothing couples or drives carries nothing.

    The planar solver is another method: its solution is given to the laws of both, and compared where
    friction is weak enough for one solution.
    """
    rng = np.random.default_rng(seed)
    n = 2 * pairs
    Q, _ = np.linalg.qr(rng.standard_normal((n, n)))
    W = 1e-9 * (Q * rng.uniform(0.3, 1.0, n)) @ Q.T
    W = 0.5 * (W + W.T)
    mu *= 0.3  # the contraction bound of the Tresca map
    rows = np.delete(np.arange(3 * pairs), np.arange(pairs) * 3 + 2)
    spatial = 1e-9 * np.eye(3 * pairs)
    spatial[np.ix_(rows, rows)] = W
    force = np.full(pairs, 100.0)
    start = np.ones(pairs, np.int8)
    flat = ContactSolver(plain(W), mu, force, start)
    round_ = ContactSolver(plain(spatial), mu, force, start)
    old, old_3 = np.zeros(pairs), np.zeros((pairs, 2))
    v_free = 1e-7 * rng.standard_normal(n)
    for _ in range(6):
        a = flat.solve(v_free, np.zeros(0), old)
        given_3 = np.zeros(3 * pairs)
        given_3[rows] = v_free
        b = round_.solve(given_3, np.zeros(0), old_3)
        assert np.abs(b.r[rows] - a.r).max() <= 1e-9 * force[0]
        assert not tangential_vectors(b.r)[:, 1].any()
        old, old_3 = slip_history(a.v, 2), slip_history(b.v, 3)
        v_free = v_free + 5e-8 * rng.standard_normal(n)


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
    assert np.abs(other.r - scale * one.r).max() <= 1e-9 * scale * force[0]


def test_pressed_pair_by_hand():
    """One pair: v_n = 0 gives r_n = 2; a pull of (3, 4) exceeds mu r_n = 1 and slips along itself."""
    solver = ContactSolver(plain(np.eye(3)), 0.5, np.ones(1), np.ones(1, np.int8))
    s = solver.solve(np.array([2.0, 3.0, 4.0]), np.zeros(0), np.zeros((1, 2)))
    assert s.r == pytest.approx([2.0, 0.6, 0.8])
    assert s.v == pytest.approx([0.0, 2.4, 3.2])
    assert s.status[0] == SLIP
    s = solver.solve(np.array([2.0, 3.0, 3.5]), np.zeros(0), np.array([[2.4, 3.2]]))
    assert s.r == pytest.approx([2.0, 0.6, 0.3])
    assert s.status[0] == STICK
    s = solver.solve(np.array([-1.0, 5.0, 5.0]), np.zeros(0), np.zeros((1, 2)))
    assert s.r == pytest.approx([0.0, 0.0, 0.0])
    assert s.status[0] == SEPARATED


def test_behind_a_compliance_a_pair_is_a_spring_and_a_slider():
    """Exact contact on W + c: a slider on a spring of stiffness 1/c in series with W."""
    flexibility = with_compliance(plain(np.eye(3)), np.array([1.0, 3.0, 3.0]))
    solver = ContactSolver(flexibility, 0.5, np.ones(1), np.ones(1, np.int8))
    s = solver.solve(np.array([4.0, 0.8, 0.0]), np.zeros(0), np.zeros((1, 2)))
    assert s.r == pytest.approx([2.0, 0.2, 0.0])
    s = solver.solve(np.array([4.0, 0.0, -8.0]), np.zeros(0), np.zeros((1, 2)))
    assert s.r == pytest.approx([2.0, 0.0, -1.0])
    assert s.v == pytest.approx([0.0, 0.0, -4.0])


def hard_problem(seed):
    """A jump from one load to quite another, friction 0.8, W of condition 1e3."""
    rng = np.random.default_rng(seed)
    m = 15
    A = rng.normal(size=(3 * m, 3 * m))
    W = A @ A.T / (3 * m) + 1e-2 * np.eye(3 * m)
    problem = contact_problem(
        W, np.zeros((3 * m, 0)), np.zeros(0), np.full(m, 0.8), np.ones(m), 1e-12
    )
    kept = memory(m, 0)
    contact = Contact(np.full(m, STICK, np.int8), np.zeros(3 * m), np.zeros(0), np.zeros(3 * m))
    base = np.zeros(3 * m)
    base[::3] = W[::3, ::3].sum(1)
    restart(problem, kept, contact.status)
    keep(kept, Given(np.zeros(3 * m), np.zeros(0), np.zeros((m, 2))), contact)
    load = Given(base + rng.normal(size=3 * m), np.zeros(0), 0.1 * rng.normal(size=(m, 2)))
    return problem, kept, load, contact


@pytest.mark.parametrize("way", [other_scales, load_in_parts, extragradient, proximal, facets])
@pytest.mark.parametrize("seed", range(5))
def test_every_way_behind_newtons_method_solves_by_itself(way, seed):
    problem, kept, load, contact = hard_problem(seed)
    _, residual = way.py_func(
        problem, kept, load, contact
    )  # compiled it is a part of `other_starts`
    assert residual <= ACCEPTED
    found = violation(
        problem.W, load.v_free, problem.friction, load.vt_old, contact.r, problem.force
    )
    assert found <= 1e-8


def test_the_residual_knows_a_wrong_answer():
    """Half the reaction lets the pair penetrate by half the load; traction across the slip is none."""
    problem = contact_problem(
        np.eye(3), np.zeros((3, 0)), np.zeros(0), np.array([0.3]), np.ones(1), 1e-12
    )

    def residual(r):
        v = np.array([1.0, 4.0, 0.0]) - r
        contact = Contact(np.ones(1, np.int8), r, np.zeros(0), v)
        return natural_residual(problem, Given(v + r, np.zeros(0), np.zeros((1, 2))), contact)

    assert residual(np.array([1.0, 0.3, 0.0])) == 0
    assert residual(np.array([0.5, 0.15, 0.0])) == pytest.approx(0.5)
    assert residual(np.array([1.0, 0.0, 0.3])) > 0.3


def test_rank_deficient_flexibility_is_named():
    rng = np.random.default_rng(1)
    A = rng.normal(size=(12, 7))
    with pytest.raises(ContactError, match="rank 7 with 12 components"):
        ContactSolver(plain(A @ A.T), 0.3, np.ones(4), np.ones(4, np.int8))


def test_a_body_pulled_away_has_no_solution_and_the_error_says_so():
    R = np.tile(np.eye(3), (4, 1))
    solver = ContactSolver(plain(np.eye(12), R, np.zeros(3)), 0.3, np.ones(4), np.ones(4, np.int8))
    with pytest.raises(ContactError, match="there is no solution: the load does work"):
        solver.solve(np.zeros(12), np.array([-1.0, 0.0, 0.0]), np.zeros((4, 2)))
    with pytest.raises(ContactError, match="opens the joint or slides it apart"):
        solver.solve(np.zeros(12), np.array([4.0, 1.0, 1.0]), np.zeros((4, 2)))


def test_a_flexibility_of_another_size_is_refused():
    with pytest.raises(ContactError, match="2 planar pairs need 4 rows, spatial ones 6"):
        ContactSolver(plain(np.eye(5)), 0.3, np.ones(2), np.ones(2, np.int8))


@SETTINGS
@given(seed=st.integers(0, 2**32 - 1), pairs=st.integers(1, 8), mu=st.floats(0.05, 1))
def test_friction_gives_no_energy_and_a_closed_cycle_balances(seed, pairs, mu):
    """r_t . slip >= 0 in every step; round a closed cycle the load's work is what friction takes."""
    rng, W, force, _, _ = random_problem(seed, pairs)
    loads = np.zeros((3 * pairs, 3))
    normal(loads.T, 3)[0] = 1e-7 * rng.uniform(0.5, 1.5, pairs)
    loads[:, 1:] = 5e-8 * rng.standard_normal((3 * pairs, 2))
    flexibility = Flexibility(
        W, np.zeros((3 * pairs, 0)), np.zeros(0), loads, np.zeros((0, 3)), np.zeros((3, 3))
    )
    solver = ContactSolver(flexibility, mu, force, np.ones(pairs, np.int8))
    theta = np.linspace(0, 2 * np.pi, 41)
    cycle = np.column_stack([np.ones(41), np.sin(theta), 1 - np.cos(2 * theta)])
    vt_old = np.zeros((pairs, 2))
    start = solver.solve(loads @ cycle[0], np.zeros(0), vt_old)
    vt_old = slip_history(start.v, 3)
    for _ in range(30):
        record = follow_path(solver, flexibility, cycle, vt_old, where=str, remedy="smaller steps")
        slip = np.diff(by_pair(record.v, 3)[..., 1:], axis=0)
        spent = (by_pair(record.r, 3)[1:, :, 1:] * slip).sum(axis=2)
        size = 1e-9 * force[0] ** 2
        assert spent.min() >= -1e-12 * size
        if np.abs(record.r[-1] - record.r[0]).max() <= 1e-11 * force[0]:
            break
    output = -record.r @ loads
    done = 0.5 * (cycle[1:] + cycle[:-1]) * np.diff(output, axis=0)
    taken = record.friction_work.sum() + record.normal_work
    closed = np.abs(record.r[-1] - record.r[0]).max() <= 1e-9 * force[0]
    if closed:
        assert done.sum() == pytest.approx(taken, abs=1e-9 * size)

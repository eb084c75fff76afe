"""Lemke's method on planar contact against enumeration of all states, and against the active set."""

from __future__ import annotations

from itertools import product

import numpy as np
import pytest
from random_contact import plain, random_flexibility, unique_friction, violation

from microslip.contact import planar
from microslip.contact.active_set import LEMKE, NOT_SOLVED
from microslip.contact.lemke import RAY, SOLUTION, complementarity_form, lemke
from microslip.contact.pairs import (
    FORWARD,
    SEPARATED,
    STICK,
    normal,
    normal_rows,
    tangential,
    tangential_rows,
)
from microslip.contact.problem import Given
from microslip.contact.solver import ContactSolver
from microslip.errors import ContactError
from microslip.model.flexibility import with_compliance

NOTHING = np.zeros(0)


def last_resort(flexibility, friction, force, v_free, f_q, vt_old):
    """Solver after Lemke's method alone, the rule by which it ended, and the residual."""
    pairs = len(force)
    solver = ContactSolver(flexibility, friction, force, np.full(pairs, STICK, np.int8))
    given = Given(v_free, f_q, vt_old)
    _, residual, rule = planar.last_resort(solver.problem, solver.memory, given, solver.contact)
    return solver, rule, residual


def enumerated(W, v_free, friction, vt_old):
    """Reactions of all solutions, by trying every combination of states."""
    pairs = len(friction)
    found = []
    for states in product((STICK, FORWARD, -FORWARD, SEPARATED), repeat=pairs):
        A, b = np.eye(2 * pairs), np.zeros(2 * pairs)
        for i, state in enumerate(states):
            n, t = 2 * i, 2 * i + 1
            if state == SEPARATED:
                continue
            A[n], b[n] = W[n], v_free[n]
            if state == STICK:
                A[t], b[t] = W[t], v_free[t] - vt_old[i]
            else:
                A[t, n] = -np.sign(state) * friction[i]
        r = np.linalg.solve(A, b)
        v = v_free - W @ r
        slip = tangential(v) - vt_old
        good = normal(r).min() >= -1e-9 and normal(v).max() <= 1e-9
        good = good and np.all(np.abs(tangential(r)) <= friction * normal(r) + 1e-9)
        against = -slip * np.sign(tangential(r)) * (normal(r) > 1e-9)
        if good and against.max() <= 1e-9:
            found.append(r)
    return found


@pytest.mark.parametrize("pairs", [1, 2, 3])
def test_it_finds_one_of_the_solutions_that_enumeration_finds(pairs):
    """Unit-sized problems, friction to 3."""
    for seed in range(150):
        rng = np.random.default_rng([pairs, seed])
        W = 1e9 * random_flexibility(rng, pairs)
        v_free, vt_old = rng.standard_normal(2 * pairs), 0.1 * rng.standard_normal(pairs)
        friction = rng.uniform(0, 3, pairs)
        all_of_them = enumerated(W, v_free, friction, vt_old)
        assert all_of_them
        force = np.ones(pairs)
        solver, rule, residual = last_resort(plain(W), friction, force, v_free, NOTHING, vt_old)
        assert rule == LEMKE
        assert residual <= 1e-9
        assert min(np.abs(solver.r - r).max() for r in all_of_them) <= 1e-7


def test_it_agrees_with_the_active_set_where_the_solution_is_unique():
    for seed in range(60):
        rng = np.random.default_rng(seed)
        pairs = int(rng.integers(1, 30))
        W = random_flexibility(rng, pairs)
        v_free, vt_old = 1e-7 * rng.standard_normal(2 * pairs), 1e-8 * rng.standard_normal(pairs)
        mu, force = 0.9 * unique_friction(W), np.full(pairs, 100.0)
        solver, rule, _ = last_resort(plain(W), mu, force, v_free, NOTHING, vt_old)
        other = ContactSolver(plain(W), mu, force, np.ones(pairs, np.int8))
        expected = other.solve(v_free, NOTHING, vt_old)
        assert rule == LEMKE
        assert np.abs(solver.r - expected.r).max() <= 1e-7 * force[0]


@pytest.mark.parametrize("friction", [0.0, 0.3, 1.0, 2.0, 10.0, 100.0])
@pytest.mark.parametrize("springs", [None, np.array([0.0, 1e5]), np.array([1e3, 1e-3])])
@pytest.mark.parametrize("compliant", [False, True])
def test_it_solves_whatever_the_friction(friction, springs, compliant):
    """With and without coordinates of equilibrium, pressed by 1 to 3 times the typical force."""
    for seed in range(15):
        rng = np.random.default_rng([seed, int(10 * friction)])
        pairs = int(rng.integers(2, 40))
        flexibility = plain(random_flexibility(rng, pairs))
        v_free, vt_old = 1e-7 * rng.standard_normal(2 * pairs), 1e-8 * rng.standard_normal(pairs)
        force, f_q = np.full(pairs, 100.0), NOTHING
        if springs is not None:
            R = np.zeros((2 * pairs, 2))
            R[normal_rows(), 0] = 1.0
            R[tangential_rows(), 1] = 1.0
            f_q = 100.0 * pairs * np.array([rng.uniform(1, 3), 0.2 * friction * rng.uniform(-1, 1)])
            flexibility = plain(flexibility.W, R, springs)
            if springs[1] == 0:
                f_q[1] = 0.0
        if compliant:
            flexibility = with_compliance(flexibility, 1e-10 * rng.uniform(0, 5, 2 * pairs))
        solver, rule, _ = last_resort(flexibility, friction, force, v_free, f_q, vt_old)
        assert rule == LEMKE
        balance = () if springs is None else (R, solver.q, springs, f_q)
        found = violation(flexibility.W, v_free, friction, vt_old, solver.r, force, *balance)
        assert found <= 1e-8


def free_to_open():
    """Three pairs on one body that nothing but the load holds in the normal direction."""
    R = np.zeros((6, 1))
    R[normal_rows(), 0] = 1.0
    return plain(np.eye(6) + 0.1, R, np.zeros(1))


def test_a_load_that_opens_the_joint_has_no_solution_and_says_so():
    force, v_free, vt_old = np.ones(3), np.zeros(6), np.zeros(3)
    _, rule, residual = last_resort(free_to_open(), 0.3, force, v_free, np.array([3.0]), vt_old)
    assert rule == LEMKE
    assert residual <= 1e-12
    solver, rule, _ = last_resort(free_to_open(), 0.3, force, v_free, np.array([-3.0]), vt_old)
    assert rule == NOT_SOLVED
    M, b = complementarity_form(solver.problem, Given(v_free, np.array([-3.0]), vt_old))
    outcome, z, _ = lemke(M, b, np.ones(len(b)), 100, 1e-12)
    assert outcome == RAY
    # the certificate: a direction of the homogeneous problem on which the right side is negative
    assert (z >= 0).all()
    assert (M @ z).min() >= -1e-12
    assert abs(z @ M @ z) <= 1e-12
    assert b @ z < 0
    solver = ContactSolver(free_to_open(), 0.3, force, np.ones(3, np.int8))
    with pytest.raises(ContactError, match=r"no solution: the load does work .* opens the joint"):
        solver.solve(v_free, np.array([-3.0]), vt_old)
    assert solver.fallbacks.unsolved == 1
    again = solver.solve(v_free, np.array([3.0]), vt_old)
    assert again.residual <= 1e-9


def test_a_motion_that_friction_alone_holds_is_not_said_to_have_no_solution():
    """Stuck it has one: friction can carry 0.3 per pair, asked for 0.1."""
    R = np.zeros((4, 1))
    R[tangential_rows(), 0] = 1.0
    flexibility = plain(np.eye(4), R, np.zeros(1))
    v_free, vt_old, force = np.array([1.0, 0.0, 1.0, 0.0]), np.zeros(2), np.ones(2)
    for push, solvable in ((0.2, True), (0.8, False)):
        solver = ContactSolver(flexibility, 0.3, force, np.ones(2, np.int8))
        if solvable:
            solution = solver.solve(v_free, np.array([push]), vt_old)
            assert tangential(solution.r) == pytest.approx(push / 2)
        else:
            with pytest.raises(ContactError, match="friction alone holds"):
                solver.solve(v_free, np.array([push]), vt_old)


def test_a_body_without_a_load_stays_where_it_just_touches():
    """Lifted, it could be anywhere above; no state of separation settles where, touching does."""
    R = np.array([[0.0], [0.0], [1.0], [0.0]])
    solver = ContactSolver(plain(np.eye(4), R, np.zeros(1)), 0.3, np.ones(2), np.ones(2, np.int8))
    solution = solver.solve(np.array([1.0, 0.0, -1.0, 0.0]), np.zeros(1), np.zeros(2))
    assert solution.residual <= 1e-12
    assert normal(solution.r) == pytest.approx([1.0, 0.0])


def test_a_negative_stiffness_has_no_last_resort_and_says_so():
    """A body with more inertia than support slides: with friction saturated nothing holds it."""
    R = np.zeros((4, 1))
    R[tangential_rows(), 0] = 1.0
    flexibility = plain(np.eye(4), R, np.array([-1.0]))
    v_free, vt_old, force = np.array([1.0, 0.0, 1.0, 0.0]), np.zeros(2), np.ones(2)
    _, rule, _ = last_resort(flexibility, 0.3, force, v_free, np.array([0.1]), vt_old)
    assert rule == NOT_SOLVED


@pytest.mark.parametrize("rank", [3, 7])
def test_a_singular_flexibility_is_named(rank):
    rng = np.random.default_rng(rank)
    A = rng.standard_normal((8, rank))
    with pytest.raises(ContactError, match=f"singular, of rank {rank} with 8 components"):
        ContactSolver(plain(A @ A.T), 0.3, np.ones(4), np.ones(4, np.int8))


def test_two_equations_by_hand():
    """``w = M z + b`` with M = [[2, 1], [1, 2]], b = (-5, -6): z = (4/3, 7/3)."""
    M = np.array([[2.0, 1.0], [1.0, 2.0]])
    outcome, z, pivots = lemke(M, np.array([-5.0, -6.0]), np.ones(2), 20, 1e-12)
    assert outcome == SOLUTION
    assert pivots >= 2
    assert z == pytest.approx([4 / 3, 7 / 3], rel=1e-12)


def test_ties_do_not_make_it_cycle():
    """Pairs all alike, friction at its limit: every ratio is a tie."""
    for pairs in (2, 5, 20):
        W = np.eye(2 * pairs)
        v_free = np.tile([2.0, 1.0], pairs)
        solver, rule, residual = last_resort(
            plain(W), 0.5, np.ones(pairs), v_free, NOTHING, np.zeros(pairs)
        )
        assert rule == LEMKE
        assert residual <= 1e-12
        assert normal(solver.r) == pytest.approx(2.0)
        assert tangential(solver.r) == pytest.approx(1.0)

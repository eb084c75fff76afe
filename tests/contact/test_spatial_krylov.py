"""Many slipping pairs: iterations against elimination, and the contact laws written out again."""

from __future__ import annotations

import numpy as np
import pytest
from random_contact import plain
from random_spatial import random_flexibility, violation

from microslip.contact.pairs import SEPARATED, SLIP, STICK, slip_history
from microslip.contact.problem import contact_problem
from microslip.contact.solver import TOLERANCE, ContactSolver
from microslip.contact.spatial_krylov import MANY, correct
from microslip.contact.spatial_system import law_errors, solve_directly, unknowns
from microslip.contact.spatial_tableau import memory, restart


def slipping_states(seed, pairs, coordinates=2):
    """A problem whose tableau is that of other states than those asked for, slip among them all."""
    rng = np.random.default_rng(seed)
    W = random_flexibility(rng, pairs)
    R = rng.standard_normal((3 * pairs, coordinates))
    friction = rng.uniform(0, 1, pairs)
    problem = contact_problem(W, R, np.full(coordinates, 1e8), friction, np.ones(pairs), TOLERANCE)
    kept = memory(pairs, coordinates)
    before, after = rng.choice([STICK, SLIP, SEPARATED], (2, pairs)).astype(np.int8)
    restart(problem, kept, before)
    angle = rng.uniform(0, 2 * np.pi, pairs)
    kept.direction[:] = np.column_stack([np.cos(angle), np.sin(angle)])
    kept.resistance[:] = 10.0 ** rng.uniform(-2, 2, pairs) / problem.mean
    F = np.empty(3 * pairs, np.int64)
    return rng, problem, kept, after, F[: unknowns(kept.held, after, F)]


@pytest.mark.parametrize("seed", range(4))
def test_iterations_end_where_elimination_does(seed):
    rng, problem, kept, status, F = slipping_states(seed, 40)
    c = rng.standard_normal(len(kept.held))
    x, g = np.empty_like(c), np.empty_like(c)
    assert solve_directly(problem, kept, status, c, F, x, g)
    # from anywhere on x = c - D g
    y, h = c.copy(), np.zeros_like(c)
    h[:] = rng.standard_normal(len(c))
    y -= h @ kept.transposed
    room = np.empty((len(F), len(F)), np.float32)
    for _ in range(5):
        assert correct(problem, kept, status, F, y, h, room)
    assert np.abs(h - g).max() <= 1e-9 * np.abs(g).max()
    assert np.abs(y - x).max() <= 1e-9 * np.abs(c).max()
    assert np.abs(y + h @ kept.transposed - c).max() <= 1e-12 * np.abs(kept.transposed).max() * 40


@pytest.mark.parametrize("seed", range(4))
def test_errors_of_the_laws_are_those_of_the_states(seed):
    """Slip: x_t = mu x_n d + k (I - d d^T) g_t of a held pair; a free one has x and g the other way round."""
    rng, problem, kept, status, F = slipping_states(seed, 12)
    x, g = rng.standard_normal((2, len(kept.held)))
    found = np.empty(len(F))
    law_errors(problem, kept, status, F, x, g, found)
    expected = []
    for pair in sorted(set(F // 3)):
        rows, d = 3 * pair + np.arange(3), kept.direction[pair]
        stays = kept.held[3 * pair]
        r, v = (x[rows], g[rows]) if stays else (g[rows], x[rows])
        k = problem.mean * kept.resistance[pair]
        lacks = r[1:] - problem.friction[pair] * r[0] * d - k * (v[1:] - d * (d @ v[1:]))
        if status[pair] == SEPARATED:
            expected += list(r)
        elif status[pair] == STICK:
            expected += list(v)
        else:
            expected += list(lacks) if stays else [v[0], *(-lacks / (1 + k))]
    assert found == pytest.approx(np.array(expected), rel=1e-12, abs=1e-12)


def test_gross_slip_of_many_pairs_obeys_the_contact_laws():
    rng = np.random.default_rng(7)
    pairs = MANY // 2 + 20
    W, force = random_flexibility(rng, pairs), np.full(pairs, 100.0)
    press = 1e-7 * np.tile([1.0, 0.0, 0.0], pairs)
    friction = rng.uniform(0.1, 0.5, pairs)
    solver = ContactSolver(plain(W), friction, force, np.ones(pairs, np.int8))
    old, most = np.zeros((pairs, 2)), 0
    for angle in np.linspace(0, 1.2, 6):
        pull = 4e-7 * angle * np.tile([0.0, np.cos(angle), np.sin(angle)], pairs)
        v_free = press + pull + 2e-8 * rng.standard_normal(3 * pairs)
        found = solver.solve(v_free, np.zeros(0), old)
        assert violation(W, v_free, friction, old, found.r, force) <= 1e-8
        most = max(most, int((found.status == SLIP).sum()))
        old = slip_history(found.v, 3)
    assert 2 * most >= MANY
    assert solver.fallbacks.hard == 0


def test_what_is_not_a_number_is_not_corrected():
    rng, problem, kept, status, F = slipping_states(1, 12)
    x, g = rng.standard_normal((2, len(kept.held)))
    x[F[0]] = np.nan
    room = np.empty((len(F), len(F)), np.float32)
    assert not correct(problem, kept, status, F, x, g, room)

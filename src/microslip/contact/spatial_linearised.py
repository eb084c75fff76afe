"""Compiled linearisation of spatial contact: changes of a solution, its contact states as they are.

As `linearised.py`, with the round cone of `spatial.py`. A pair that slips by s in the direction ``d = s/|s|``
has ``r_t = mu r_n d``, whose direction turns with the slip,

    dr_t = mu d dr_n + k (I - d d^T) (dv_t - dv_t_old),    k = mu r_n / |s|

which is the equation that Newton's method solves at the solution (`spatial_newton.py`): its direction
and its resistance k to slip across it are in the memory.
"""

from __future__ import annotations

import numpy as np

from microslip.contact.compiled import jit
from microslip.contact.pairs import SEPARATED, SLIP, STICK
from microslip.contact.spatial_newton import SHORTEST
from microslip.contact.spatial_problem import own_stiffness
from microslip.contact.spatial_system import coupling, right_side, unknowns
from microslip.contact.spatial_tableau import follow, pending
from microslip.contact.tableau import answer, exchange

KEPT = 24
"""Components that the contact of pairs may differ in before the tableau follows."""


@jit
def recall(problem, memory, status, r, slip):
    """Make the memory fit for a solution of before, see `linearised.recall`.

    Friction is along the slip: its direction is that of the reactions, its resistance to a turn their size
    over that of the slip.
    """
    follow(problem, memory, status)
    n = memory.held.shape[0]
    J = np.empty(n, np.int64)
    k = pending(memory.held, status, J)
    if k > KEPT and not exchange(memory, J[:k], np.zeros(n)):
        raise np.linalg.LinAlgError("Matrix is singular to machine precision.")
    for i in range(status.shape[0]):
        if status[i] != SLIP:
            continue
        t = 3 * i + 1
        size = np.sqrt(r[t] ** 2 + r[t + 1] ** 2)
        if size == 0.0:
            # without friction no direction is another
            memory.direction[i, 0], memory.direction[i, 1] = 1.0, 0.0
            memory.resistance[i] = 0.0
            continue
        _, rho = own_stiffness(problem.diagonal, i)
        moved = np.sqrt(slip[t] ** 2 + slip[t + 1] ** 2)
        memory.direction[i, 0] = r[t] / size
        memory.direction[i, 1] = r[t + 1] / size
        memory.resistance[i] = size / max(moved, SHORTEST * size / rho)


@jit
def solve_states(problem, memory, status, w, weights, x, r):
    """Changes of reactions and displacements for given states; see `linearised.solve_states`."""
    answer(memory, w, weights, x)
    with_states(problem, memory, status, x, r)


@jit
def with_states(problem, memory, status, x, r):
    """The same from unknowns x of the tableau's own states; see `linearised.with_states`."""
    F = np.empty(memory.held.shape[0], np.int64)
    k = unknowns(memory.held, status, F)
    g = np.zeros(x.shape)
    if k > 0:
        F = F[:k]
        At = np.empty((k, k))
        y = np.empty((x.shape[0], k))
        coupling(problem, memory, status, F, At)
        for a in range(x.shape[0]):
            right_side(problem, memory, status, x[a], F, y[a])
        solved = np.ascontiguousarray(np.linalg.solve(At.T, np.ascontiguousarray(y.T)).T)
        rows = np.empty((k, x.shape[1]))
        for b in range(k):
            rows[b] = memory.transposed[F[b]]
            g[:, F[b]] = solved[:, b]
        x -= np.dot(solved, rows)
    _scatter(problem, memory.held, status, x, g, r)


@jit
def _scatter(problem, held, status, x, g, r):
    """Reactions, and in place of the unknowns gaps and slips, of given states."""
    inverse = 1.0 / problem.mean
    for a in range(x.shape[0]):
        for i in range(status.shape[0]):
            touching = status[i] != SEPARATED
            for j in range(3 * i, 3 * i + 3):
                force, moved = (x[a, j], g[a, j]) if held[j] else (g[a, j], x[a, j])
                r[a, j] = force * inverse if touching else 0.0
                still = touching and (j == 3 * i or status[i] == STICK)
                x[a, j] = 0.0 if still else moved


@jit
def gaps(problem, memory, status, opened, w, weights, x):
    """Normal displacements of the pairs that are open in this step; see `linearised.gaps`."""
    solve_states(problem, memory, status, w, weights, x, weights)
    found = np.empty((x.shape[0], opened.shape[0]))
    for b in range(opened.shape[0]):
        found[:, b] = x[:, opened[b]]
    return found

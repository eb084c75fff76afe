"""Compiled linearisation of planar contact: changes of a solution, its contact states as they are.

With its states given, the equations of `planar.py` are linear. A pair that is separated keeps ``dr = 0``,
one that sticks ``dv_n = 0`` and ``dv_t`` as it was, one that slips ``dv_n = 0`` and ``dr_t = s mu dr_n``, and

    dv = dw + R dq - W dr,    K_q dq + R^T dr = df_q

with dw counted from the tangential displacements at which the pairs stick. The tableau of the last solution
(`tableau.py`) has this solved but for the components in which its states differ,

    dx = dc - D dg,    dc = D_h dw_h + dw_f

(h what it holds, f what is free); many changes are taken at once.
"""

from __future__ import annotations

import numpy as np

from microslip.contact.compiled import jit
from microslip.contact.pairs import SEPARATED, STICK
from microslip.contact.tableau import answer, exchange, follow, pending

KEPT = 16
"""Components that states may differ in before the tableau follows."""


@jit
def recall(problem, memory, status, r, slip):
    """Make the tableau fit for a solution of before: its states, reactions and slips of its step."""
    follow(problem, memory, status)
    n = memory.held.shape[0]
    J = np.empty(n, np.int64)
    k = pending(memory.held, status, J)
    if k > KEPT and not exchange(memory, J[:k], np.zeros(n)):
        raise np.linalg.LinAlgError("Matrix is singular to machine precision.")


@jit
def solve_states(problem, memory, status, w, weights, x, r):
    """Changes of reactions and displacements for given states.

    Parameters
    ----------
    w : (p, 2 m) array
        Changes of the free displacement, the tangential ones from where the pairs stick.
    weights : (p, 2 m + e) array
        As `answer` takes them; may be `r`.
    x : (p, 2 m + e) array
        Written: gaps and slips, then unknowns q.
    r : (p, 2 m) array
        Written: reactions.
    """
    answer(memory, w, weights, x)
    with_states(problem, memory, status, x, r)


@jit
def with_states(problem, memory, status, x, r):
    """The same from unknowns x of the tableau's own states, as `answer` leaves them."""
    J = np.empty(memory.held.shape[0], np.int64)
    k = pending(memory.held, status, J)
    if k > 0:
        _try_states(memory, J[:k], x)
    _scatter(problem, memory.sign, status, x, r)


@jit
def _try_states(memory, J, x):
    """Unknowns of states that differ from the tableau's in the components J."""
    k = J.shape[0]
    rows = np.empty((k, x.shape[1]))
    C = np.empty((k, k))
    y = np.empty((k, x.shape[0]))
    for b in range(k):
        rows[b] = memory.transposed[J[b]]
        y[b] = x[:, J[b]]
        for a in range(k):
            C[a, b] = rows[b, J[a]]
    solved = np.ascontiguousarray(np.linalg.solve(C, y).T)
    x -= np.dot(solved, rows)
    for b in range(k):
        x[:, J[b]] = solved[:, b]


@jit
def _scatter(problem, sign, status, x, r):
    """Reactions, and in place of the unknowns gaps and slips, of given states."""
    mu, inverse = problem.friction, 1.0 / problem.mean
    for a in range(x.shape[0]):
        for i in range(status.shape[0]):
            n, t = 2 * i, 2 * i + 1
            if status[i] == SEPARATED:
                r[a, n], r[a, t] = 0.0, 0.0
                continue
            r[a, n] = x[a, n] * inverse
            r[a, t] = sign[i] * mu[i] * r[a, n]
            x[a, n] = 0.0
            if status[i] == STICK:
                r[a, t] += x[a, t] * inverse
                x[a, t] = 0.0


@jit
def gaps(problem, memory, status, opened, w, weights, x):
    """Normal displacements, rows for rows, of pairs that are open in this step, of those components alone.

    `opened` are their places among all components; the rest as `solve_states` takes it.
    """
    Dt, held = memory.transposed, memory.held
    N = Dt.shape[0]
    J = np.empty(N, np.int64)
    k = pending(held, status, J)
    count = opened.shape[0]
    rows = np.empty((count + k, N))
    for b in range(count + k):
        i = opened[b] if b < count else J[b - count]
        for j in range(N):
            rows[b, j] = Dt[j, i]
    found = np.dot(weights, rows.T)
    for a in range(found.shape[0]):
        for b in range(count + k):
            i = opened[b] if b < count else J[b - count]
            if not held[i]:
                found[a, b] += w[a, i]
    if k == 0:
        return found
    C = np.empty((k, k))
    for a in range(k):
        for b in range(k):
            C[a, b] = Dt[J[b], J[a]]
    y = np.linalg.solve(C, np.ascontiguousarray(found[:, count:].T))
    for b in range(count):
        for c in range(k):
            # a gap that is pending is the unknown itself
            if J[c] == opened[b]:
                found[:, b] = y[c]
                break
        else:
            for c in range(k):
                found[:, b] -= Dt[J[c], opened[b]] * y[c]
    return found

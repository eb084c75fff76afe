"""Compiled semismooth Newton method for three-dimensional contact, the equations of `spatial.py`.

The laws of a pair are the equations of the natural map (Alart & Curnier, Comput. Methods Appl. Mech. Engrg.
92 (1991) 353), with scales rho of the pair's own stiffness,

    r_n = max(0, p),  p = r_n + rho_n v_n;     r_t = P_b(y),  y = r_t + rho_t (v_t - v_t_old),  b = mu p

with P_b the projection on the disc of radius b. Where each pair stands tells which of them are active, and
their linearisation has a form without a residual, as a primal-dual active set (Hüeber, Stadler &
Wohlmuth, SIAM J. Sci. Comput. 30 (2008) 572),

    separated  p <= 0         r = 0
    sticking   |y| <= b       v_n = 0,  v_t = v_t_old
    slipping   |y| > b        v_n = 0,  r_t = mu r_n d + k (I - d d^T)(v_t - v_t_old)

with the direction ``d = y/|y|`` and the resistance to slip across it ``k = b rho_t / (|y| - b)``, which is
friction over slip at a solution. Solved with the tableau (`spatial_tableau.py`), a sticking pair has
no unknown, a slipping one two; the new state is read off the solution, until the natural map is
exact to rounding. Then v is computed from W itself, and what is left is corrected.
"""

from __future__ import annotations

import numpy as np

from microslip.contact.compiled import jit
from microslip.contact.pairs import SEPARATED, SLIP, STICK
from microslip.contact.problem import relative_displacement
from microslip.contact.spatial_problem import certify, off_cone, own_stiffness
from microslip.contact.spatial_tableau import keep, make, pending
from microslip.contact.tableau import LARGE, MADE, add_rows, exchange, solve_small

ACCEPTED = 1e-10
"""Natural-map residual, computed from W, with which a solution is accepted."""

PROVISIONAL = 1e-11
"""Residual of the tableau's solution below which W is asked."""

NEARLY = 1e-8
"""Residual of the tableau's solution below which W is asked where it does not fall any more."""

MOST = 40
"""Iterations of one attempt."""

SHORTEST = 1e-13
"""Slip over the displacement that friction alone would make, below which it is none."""

MAX_KEPT = 8
"""Pairs whose contact may differ from the tableau's before it follows an accepted solution."""


@jit
def _start(problem, memory, given, contact, c, g, x):
    """Unknowns x and the others g from r, q and the v that belongs to them; c = x + D g."""
    R, stiffness, scale, mean = problem.R, problem.stiffness, problem.scale, problem.mean
    held, f_q, vt_old = memory.held, given.f_q, given.vt_old
    r, q, v = contact.r, contact.q, contact.v
    N, nr = R.shape
    for i in range(vt_old.shape[0]):
        for a in range(3):
            j = 3 * i + a
            force = mean * r[j]
            moved = v[j] if a == 0 else v[j] - vt_old[i, a - 1]
            x[j], g[j] = (force, moved) if held[j] else (moved, force)
    for a in range(nr):
        e = f_q[a] - stiffness[a] * q[a]
        for j in range(N):
            e -= R[j, a] * r[j]
        x[N + a] = q[a] * mean / scale[a]
        g[N + a] = scale[a] * e
    c[:] = x
    add_rows(memory.transposed, g, c)


@jit
def _scatter(problem, held, vt_old, x, g, contact):
    """Reactions, coordinates and displacements from the unknowns."""
    scale, mean = problem.scale, problem.mean
    r, q, v = contact.r, contact.q, contact.v
    N = r.shape[0]
    for i in range(vt_old.shape[0]):
        for a in range(3):
            j = 3 * i + a
            force, moved = (x[j], g[j]) if held[j] else (g[j], x[j])
            r[j] = force / mean
            v[j] = moved if a == 0 else moved + vt_old[i, a - 1]
    for a in range(q.shape[0]):
        q[a] = x[N + a] * scale[a] / mean


@jit
def read_states(problem, memory, vt_old, contact, stretch):
    """States, directions and resistances of what the laws make of r and v; returns the residual.

    The scale rho of every pair is `stretch` times its own stiffness.
    """
    W, mu, force = problem.W, problem.friction, problem.force
    status, r, v = contact.status, contact.r, contact.v
    direction, resistance = memory.direction, memory.resistance
    worst = 0.0
    for i in range(status.shape[0]):
        n = 3 * i
        rho_n, rho_t = own_stiffness(W, i)
        s1, s2 = v[n + 1] - vt_old[i, 0], v[n + 2] - vt_old[i, 1]
        y1, y2 = r[n + 1] + rho_t * s1, r[n + 2] + rho_t * s2
        e = off_cone(r[n], r[n + 1], r[n + 2], r[n] + rho_n * v[n], y1, y2, mu[i]) / force[i]
        if not e < np.inf:
            return np.inf
        worst = max(worst, e)
        rho_n *= stretch
        rho_t *= stretch
        y1, y2 = r[n + 1] + rho_t * s1, r[n + 2] + rho_t * s2
        size = np.sqrt(y1 * y1 + y2 * y2)
        pressed = r[n] + rho_n * v[n]
        bound = mu[i] * pressed
        if pressed <= 0.0:
            status[i] = SEPARATED
        elif mu[i] == 0.0:
            status[i] = SLIP
            direction[i, 0], direction[i, 1] = 1.0, 0.0
            resistance[i] = 0.0
        elif size <= bound:
            status[i] = STICK
        else:
            status[i] = SLIP
            direction[i, 0], direction[i, 1] = y1 / size, y2 / size
            resistance[i] = bound * rho_t / max(size - bound, SHORTEST * size)
    return worst


@jit
def unknowns(held, status, F):
    """Components of g that are unknown, into F; returns how many."""
    k = 0
    for i in range(status.shape[0]):
        n = 3 * i
        if held[n] != (status[i] != SEPARATED):
            F[k], F[k + 1], F[k + 2] = n, n + 1, n + 2
            k += 3
        elif held[n] and status[i] == SLIP:
            F[k], F[k + 1] = n + 1, n + 2
            k += 2
    return k


@jit
def coupling(problem, memory, status, F, A):
    """Matrix of the laws of the pairs with unknowns, ``A g_F = y``, with ``x_F = c_F - D_FF g_F``."""
    mu, mean = problem.friction, problem.mean
    Dt, held = memory.transposed, memory.held
    direction, resistance = memory.direction, memory.resistance
    k = F.shape[0]
    for b in range(k):
        row = Dt[F[b]]
        for a in range(k):
            A[a, b] = row[F[a]]
    a = 0
    while a < k:
        i = F[a] // 3
        if status[i] != SLIP:
            a += 1
            continue
        d1, d2 = direction[i, 0], direction[i, 1]
        k1 = mean * resistance[i]
        if held[3 * i]:
            # mu r_n d has r_n among the x: its row of D, minus mu d times
            t = a
            for b in range(k):
                normal = Dt[F[b], 3 * i]
                A[t, b] -= mu[i] * d1 * normal
                A[t + 1, b] -= mu[i] * d2 * normal
            A[t, t] += k1 * d2 * d2
            A[t, t + 1] -= k1 * d1 * d2
            A[t + 1, t] -= k1 * d1 * d2
            A[t + 1, t + 1] += k1 * d1 * d1
            a += 2
            continue
        # a free pair: g are its reactions, g_t - mu d g_n = k (I - d d^T) x_t, over 1 + k
        t = a + 1
        inverse = 1.0 / (1.0 + k1)
        k1 *= inverse
        for b in range(k):
            across = d1 * A[t + 1, b] - d2 * A[t, b]
            A[t, b] = -k1 * d2 * across
            A[t + 1, b] = k1 * d1 * across
        A[t, t] += inverse
        A[t + 1, t + 1] += inverse
        A[t, a] -= inverse * mu[i] * d1
        A[t + 1, a] -= inverse * mu[i] * d2
        a += 3


@jit
def right_side(problem, memory, status, c, F, y):
    """Right side of the equations of `coupling` for one c."""
    mu, held, direction = problem.friction, memory.held, memory.direction
    k = F.shape[0]
    for a in range(k):
        y[a] = c[F[a]]
    a = 0
    while a < k:
        i = F[a] // 3
        if status[i] != SLIP:
            a += 1
            continue
        d1, d2 = direction[i, 0], direction[i, 1]
        if held[3 * i]:
            y[a] -= mu[i] * d1 * c[3 * i]
            y[a + 1] -= mu[i] * d2 * c[3 * i]
            a += 2
            continue
        k1 = problem.mean * memory.resistance[i]
        across = k1 / (1.0 + k1) * (d1 * y[a + 2] - d2 * y[a + 1])
        y[a + 1] = -d2 * across
        y[a + 2] = d1 * across
        a += 3


@jit
def _solve_states(problem, memory, status, c, F, x, g):
    """Unknowns of given states into x and g. False where their system is singular."""
    k = F.shape[0]
    x[:] = c
    g[:] = 0.0
    if k == 0:
        return True
    A = np.empty((k, k))
    y = np.empty((k, 1))
    coupling(problem, memory, status, F, A)
    right_side(problem, memory, status, c, F, y[:, 0])
    if k < LARGE:
        if not solve_small(A, y):
            return False
    else:
        try:
            y = np.linalg.solve(A, y)
        except Exception:
            return False
    minus = np.zeros(g.shape[0])
    for a in range(k):
        g[F[a]] = y[a, 0]
        minus[F[a]] = -y[a, 0]
    add_rows(memory.transposed, minus, x)
    _obey(problem, memory, status, F, x, g)
    return True


@jit
def _obey(problem, memory, status, F, x, g):
    """What the states say of a solution exactly, where long slips would leave rounding."""
    mu, mean, held = problem.friction, problem.mean, memory.held
    for a in range(F.shape[0]):
        j = F[a]
        i, part = j // 3, j % 3
        if held[j] != (status[i] != SEPARATED) and (status[i] != SLIP or part == 0):
            x[j] = 0.0
        elif status[i] == SLIP and part > 0:
            force, moved = (x, g) if held[j] else (g, x)
            d1, d2 = memory.direction[i, 0], memory.direction[i, 1]
            across = mean * memory.resistance[i] * (d1 * moved[3 * i + 2] - d2 * moved[3 * i + 1])
            if part == 1:
                force[j] = mu[i] * force[3 * i] * d1 - across * d2
            else:
                force[j] = mu[i] * force[3 * i] * d2 + across * d1


@jit
def newton(problem, memory, given, contact, limit, stretch, known):
    """Newton iterations on one problem, from the r, q and v in `contact`.

    With `known`, v belongs to r and q and the states in `contact`, with the directions of the memory, are
    tried first; else both are read off r and q.
    Returns ``(iterations, residual)``; accepted where that is at most `ACCEPTED`.
    """
    R, vt_old = problem.R, given.vt_old
    held, flags = memory.held, memory.flags
    status = contact.status
    size = R.shape[0] + R.shape[1]
    c, g, x = np.empty(size), np.empty(size), np.empty(size)
    J = np.empty(size, np.int64)
    solved_for = status.copy()
    if not (flags[MADE] or make(problem, memory, status)):
        return 0, np.inf
    if not known:
        relative_displacement(contact.v, given.v_free, problem.W, R, contact.r, contact.q)
        read_states(problem, memory, vt_old, contact, stretch)
    _start(problem, memory, given, contact, c, g, x)
    best = np.inf
    last = np.inf
    fresh = False
    for iteration in range(1, limit + 1):
        for i in range(status.shape[0]):
            if (
                status[i] == SLIP
                and memory.direction[i, 0] == 0.0
                and memory.direction[i, 1] == 0.0
            ):
                status[i] = STICK
        k = unknowns(held, status, J)
        if not _solve_states(problem, memory, status, c, J[:k], x, g):
            return iteration, np.inf
        _scatter(problem, held, vt_old, x, g, contact)
        solved_for[:] = status
        residual = read_states(problem, memory, vt_old, contact, stretch)
        if not residual < np.inf:
            return iteration, np.inf
        stalled = residual <= NEARLY and residual > 0.3 * last
        last = residual
        if residual > PROVISIONAL and not stalled:
            continue
        # the states that were solved for, not those on the edge of them
        status[:] = solved_for
        residual = certify(problem, given, contact)
        if residual <= PROVISIONAL or (residual <= ACCEPTED and residual > 0.3 * best):
            k = pending(held, status, J)
            if k > 3 * MAX_KEPT:
                flags[MADE] = exchange(memory, J[:k], c)
            keep(memory, given, contact)
            return iteration, residual
        if residual > 0.3 * best:
            if fresh or not make(problem, memory, status):
                return iteration, np.inf
            fresh = True
        best = min(best, residual)
        _start(problem, memory, given, contact, c, g, x)
    return limit, np.inf

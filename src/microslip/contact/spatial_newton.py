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
exact to rounding. Then v is computed from W itself, and what is left is corrected. Many unknowns are
corrected by iterations in every step of Newton's (`spatial_krylov.py`), few are eliminated.
"""

from __future__ import annotations

import numpy as np

from microslip.contact.compiled import jit
from microslip.contact.pairs import SEPARATED, SLIP, STICK
from microslip.contact.problem import relative_displacement
from microslip.contact.spatial_krylov import MANY, correct
from microslip.contact.spatial_problem import certify, off_cone, own_stiffness
from microslip.contact.spatial_system import obey, solve_directly, unknowns
from microslip.contact.spatial_tableau import keep, make, pending
from microslip.contact.tableau import MADE, add_rows, exchange

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

PATIENCE = 12
"""Of them, those after which linear systems are eliminated, however many unknowns they have."""

MAX_KEPT = 8
"""Pairs whose contact may differ from the tableau's before it follows an accepted solution."""


@jit
def _start(problem, memory, given, contact, g, x):
    """Unknowns x and the others g from r, q and the v that belongs to them."""
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
    own, mu, force = problem.diagonal, problem.friction, problem.force
    status, r, v = contact.status, contact.r, contact.v
    direction, resistance = memory.direction, memory.resistance
    worst = 0.0
    for i in range(status.shape[0]):
        n = 3 * i
        rho_n, rho_t = own_stiffness(own, i)
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
def newton_anew(problem, memory, given, contact, limit, stretch):
    """As `newton`, from the r and q in `contact`: v and the states are read off these."""
    if not (memory.flags[MADE] or make(problem, memory, contact.status)):
        return 0, np.inf
    relative_displacement(problem, given.v_free, contact.r, contact.q, contact.v)
    read_states(problem, memory, given.vt_old, contact, stretch)
    return newton(problem, memory, given, contact, limit, stretch)


@jit
def newton(problem, memory, given, contact, limit, stretch):
    """Newton iterations on one problem, from the r, q and v in `contact`, which belong together.

    The states in `contact`, with the directions of the memory, are tried first.
    Returns ``(iterations, residual)``; accepted where that is at most `ACCEPTED`.
    """
    R, vt_old = problem.R, given.vt_old
    held, flags = memory.held, memory.flags
    status = contact.status
    size = R.shape[0] + R.shape[1]
    c, g, x = np.zeros(size), np.empty(size), np.empty(size)
    J = np.empty(size, np.int64)
    solved_for = status.copy()
    # one for all iterations: to be given memory takes longer than to fill it
    room = np.empty(0, np.float32)
    if not (flags[MADE] or make(problem, memory, status)):
        return 0, np.inf
    _start(problem, memory, given, contact, g, x)
    best = np.inf
    last = np.inf
    fresh = False
    summed = False
    eliminate = False
    for iteration in range(1, limit + 1):
        _stick_without_direction(memory, status)
        k = unknowns(held, status, J)
        eliminate = eliminate or iteration > PATIENCE
        corrected = False
        if k >= MANY and not eliminate:
            if room.shape[0] < k * k:
                room = np.empty(k * k + k * k // 2, np.float32)
            At = room[: k * k].reshape((k, k))
            corrected = correct(problem, memory, status, J[:k], x, g, At)
            eliminate = not corrected
        if not corrected:
            if not summed:
                c[:] = x
                add_rows(memory.transposed, g, c)
                summed = True
            if not solve_directly(problem, memory, status, c, J[:k], x, g):
                return iteration, np.inf
        _scatter(problem, held, vt_old, x, g, contact)
        solved_for[:] = status
        residual = read_states(problem, memory, vt_old, contact, stretch)
        if not residual < np.inf:
            return iteration, np.inf
        stalled = residual <= NEARLY and residual > 0.3 * last
        last = residual
        if residual > PROVISIONAL:
            if not stalled:
                continue
            if corrected:
                eliminate = True
                continue
        # the states that were solved for, not those on the edge of them
        status[:] = solved_for
        if corrected:
            obey(problem, memory, status, J[:k], x, g)
            _scatter(problem, held, vt_old, x, g, contact)
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
        _start(problem, memory, given, contact, g, x)
        summed = False
        eliminate = True
    return limit, np.inf


@jit
def _stick_without_direction(memory, status):
    """A pair that is said to slip, nobody knows where to, sticks until its motion is known."""
    for i in range(status.shape[0]):
        if status[i] == SLIP and memory.direction[i, 0] == 0.0 and memory.direction[i, 1] == 0.0:
            status[i] = STICK

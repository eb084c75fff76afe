"""Compiled active-set search for the states of planar contact, the equations of `planar.py`.

Each pair is separated, sticking, slipping forward (``v_t`` grows, ``r_t = mu r_n``) or
backward. For given states the problem is linear; its solution is kept as a tableau (`tableau.py`)
from step to step. The last solution is corrected by what it leaves unbalanced under the new load
(one product with the tableau). Then states are tried: pairs whose inequality is violated change
state, at the price of a few columns of the tableau, until none is; only that solution is checked
against the original matrices (one product with W) and corrected until it is exact to rounding. The
tableau itself follows once enough states have changed.

When the same set of states comes back (cycling), only the worst violated pair changes; when that
cycles too, only the first in order (Murty's least-index rule, finite for P-matrices, which friction
does not give). A solution is accepted only with its natural-map residual.

Reference: Hüeber, Stadler & Wohlmuth, SIAM J. Sci. Comput. 30 (2008) 572 (primal-dual active set
for friction); Murty, Linear Algebra Appl. 7 (1974) 65.
"""

from __future__ import annotations

import numpy as np

from microslip.contact.compiled import jit
from microslip.contact.pairs import BACKWARD, FORWARD, SEPARATED, STICK
from microslip.contact.problem import natural_residual, relative_displacement, unbalance
from microslip.contact.tableau import (
    MADE,
    WARM,
    add_rows,
    exchange,
    make,
    pending,
    renew_images,
    solve_small,
    turn,
)

ACCEPTED = 1e-9
"""Natural-map residual below which a solution with no violated pair is accepted."""

EXACT, LEFT = 5.0, 2.0
"""Times the tolerance: a solution is exact whose equations are off by so much, and so much of what the last
was off by is left to the next where modes move all pairs."""

PROVISIONAL = 1e-11
"""Inequalities may be violated by this much before a solution is checked."""

MAX_FULL = 40
"""Iterations in which all violated pairs change."""

MAX_PENDING = 32
"""Components that states may differ in from the tableau while they are tried."""

MAX_KEPT = 24
"""Components that accepted states may differ in before the tableau follows."""

FULL, WORST, LEAST_INDEX, HALVED, LEMKE, NOT_SOLVED = 0, 1, 2, 3, 4, 5
"""How a problem was solved: rules of changing states, the load step halved, Lemke's method, not at all."""


@jit
def _judge(problem, vt_old, contact, slack, rule, wanted):
    """New states into `wanted`: how many differ, and the pair that may change alone."""
    own, mu, force = problem.diagonal, problem.friction, problem.force
    status, r, v = contact.status, contact.r, contact.v
    changes = 0
    worst = 0.0
    pair = -1
    for i in range(status.shape[0]):
        state = status[i]
        new = state
        size = 0.0
        if state == SEPARATED:
            e = v[2 * i] / (own[2 * i] * force[i])
            if e > slack:
                slip = v[2 * i + 1] - vt_old[i]
                new = STICK
                if abs(slip) > mu[i] * v[2 * i]:
                    new = FORWARD if slip > 0.0 else BACKWARD
                size = e
        else:
            e = -r[2 * i] / force[i]
            if e > slack:
                new = SEPARATED
                size = e
            elif state == STICK:
                over = (abs(r[2 * i + 1]) - mu[i] * r[2 * i]) / force[i]
                if over > slack:
                    new = FORWARD if r[2 * i + 1] > 0.0 else BACKWARD
                    size = over
            else:
                slip = (v[2 * i + 1] - vt_old[i]) / (own[2 * i + 1] * force[i])
                if state == BACKWARD:
                    slip = -slip
                if slip < -slack:
                    new = STICK
                    size = -slip
        wanted[i] = new
        if new != state:
            changes += 1
            if rule == LEAST_INDEX:
                if pair < 0:
                    pair = i
            elif size > worst:
                worst = size
                pair = i
    return changes, pair


@jit
def _start(problem, memory, given, contact, c, weights, small):
    """Unknowns of the tableau's states into c, from any r and q and the v that belongs to them."""
    R, stiffness, scale = problem.R, problem.stiffness, problem.scale
    mu, mean = problem.friction, problem.mean
    Dt, held, sign = memory.transposed, memory.held, memory.sign
    f_q, vt_old = given.f_q, given.vt_old
    r, q, v = contact.r, contact.q, contact.v
    N, nr = R.shape
    for i in range(mu.shape[0]):
        rn, rt = mean * r[2 * i], mean * r[2 * i + 1]
        rest = rt - sign[i] * mu[i] * rn
        if abs(rest) <= 1e-15 * abs(rt):
            rest = 0.0
        n, t = 2 * i, 2 * i + 1
        slip = v[t] - vt_old[i]
        c[n], weights[n] = (rn, v[n]) if held[n] else (v[n], rn)
        c[t], weights[t] = (rest, slip) if held[t] else (slip, rest)
    for a in range(nr):
        e = f_q[a] - stiffness[a] * q[a]
        for j in range(N):
            e -= R[j, a] * r[j]
        c[N + a] = q[a] * mean / scale[a]
        weights[N + a] = scale[a] * e
    if small and memory.shares.shape[0] > 0:
        _by_modes(problem, memory, c, weights)
    add_rows(Dt, weights, c)


@jit
def _by_modes(problem, memory, c, weights):
    """What the modes have of the weights, into c by their images; what is left is mostly nothing."""
    own, force, held, shares = problem.diagonal, problem.force, memory.held, memory.shares
    moved = np.zeros(memory.modes.shape[1])
    add_rows(memory.modes, shares, moved)
    add_rows(memory.images, shares, c)
    for i in range(moved.shape[0]):
        if held[i]:
            weights[i] -= moved[i]
            if abs(weights[i]) <= LEFT * problem.tolerance * own[i] * force[i // 2]:
                weights[i] = 0.0
        else:
            c[i] -= moved[i]


@jit
def _remainder(problem, memory, given, contact, c, weights):
    """What the equations of the states still lack, as unknowns of the tableau's states into c."""
    R, stiffness, scale = problem.R, problem.stiffness, problem.scale
    Dt, held = memory.transposed, memory.held
    f_q, vt_old = given.f_q, given.vt_old
    status, r, q, v = contact.status, contact.r, contact.q, contact.v
    N, nr = R.shape
    c[:] = 0.0
    weights[:] = 0.0
    for i in range(status.shape[0]):
        n, t = 2 * i, 2 * i + 1
        if status[i] != SEPARATED:
            if held[n]:
                weights[n] = v[n]
            else:
                c[n] = v[n]
        if status[i] == STICK:
            if held[t]:
                weights[t] = v[t] - vt_old[i]
            else:
                c[t] = v[t] - vt_old[i]
    for a in range(nr):
        e = f_q[a] - stiffness[a] * q[a]
        for j in range(N):
            e -= R[j, a] * r[j]
        weights[N + a] = scale[a] * e
    add_rows(Dt, weights, c)


@jit
def _try_states(problem, memory, status, J, c, x):
    """Unknowns of given states into x. False where their system is singular."""
    Dt = memory.transposed
    k = pending(memory.held, status, J)
    if k > MAX_PENDING:
        if not exchange(memory, J[:k], c):
            return False
        k = 0
    x[:] = c
    if k == 0:
        return True
    C = np.empty((k, k))
    y = np.empty((k, 1))
    for a in range(k):
        row = Dt[J[a]]
        y[a, 0] = c[J[a]]
        for b in range(k):
            C[b, a] = row[J[b]]
    if not solve_small(C, y):
        return False
    a = 0
    while a + 4 <= k:
        y0, y1, y2, y3 = y[a, 0], y[a + 1, 0], y[a + 2, 0], y[a + 3, 0]
        d0, d1, d2, d3 = Dt[J[a]], Dt[J[a + 1]], Dt[J[a + 2]], Dt[J[a + 3]]
        for i in range(x.shape[0]):
            x[i] -= y0 * d0[i] + y1 * d1[i] + y2 * d2[i] + y3 * d3[i]
        a += 4
    while a < k:
        y0 = y[a, 0]
        d0 = Dt[J[a]]
        for i in range(x.shape[0]):
            x[i] -= y0 * d0[i]
        a += 1
    for a in range(k):
        x[J[a]] = y[a, 0]
    return True


@jit
def _scatter(problem, sign, vt_old, x, contact):
    """Reactions, coordinates and displacements from the unknowns x of given states."""
    R, scale, mu, mean = problem.R, problem.scale, problem.friction, problem.mean
    status, r, q, v = contact.status, contact.r, contact.q, contact.v
    N, nr = R.shape
    inverse = 1.0 / mean
    for i in range(status.shape[0]):
        n, t = 2 * i, 2 * i + 1
        if status[i] == SEPARATED:
            r[n], r[t] = 0.0, 0.0
            v[n], v[t] = x[n], x[t] + vt_old[i]
        else:
            r[n] = x[n] * inverse
            v[n] = 0.0
            r[t] = sign[i] * mu[i] * r[n]
            if status[i] == STICK:
                r[t] += x[t] * inverse
                v[t] = vt_old[i]
            else:
                v[t] = x[t] + vt_old[i]
    for a in range(nr):
        q[a] = x[N + a] * scale[a] * inverse


@jit
def _align(problem, memory, status, wanted, J, c):
    """Give each pair that is about to slip the sign of its slip. False where that is singular."""
    held, sign = memory.held, memory.sign
    for i in range(wanted.shape[0]):
        if wanted[i] == FORWARD or wanted[i] == BACKWARD:
            new = 1.0 if wanted[i] == FORWARD else -1.0
            if new == sign[i]:
                continue
            slips = held[2 * i] and not held[2 * i + 1]
            # the other way in the tableau: bring that to the states reached since
            if slips and not exchange(memory, J[: pending(held, status, J)], c):
                return False
            turn(problem.friction, memory, i, new, c)
    return True


@jit
def search(problem, memory, given, contact):
    """Search the states of one contact problem from those in `contact`.

    `contact` holds the last solution on entry and the new one on return. The memory must belong to
    its states in the sense of `follow` or `restart`.
    Returns ``(iterations, residual, rule)``; `rule` tells how states were changed.
    """
    R, tolerance = problem.R, problem.tolerance
    held, sign, v_free_old, flags = memory.held, memory.sign, memory.v_free, memory.flags
    v_free, vt_old = given.v_free, given.vt_old
    status, r, q, v = contact.status, contact.r, contact.q, contact.v
    m = status.shape[0]
    size = R.shape[0] + R.shape[1]
    c = np.empty(size)
    x = np.empty(size)
    dc = np.empty(size)
    dx = np.empty(size)
    weights = np.empty(size)
    J = np.empty(size, np.int64)
    wanted = np.empty_like(status)
    limit = MAX_FULL + 12 * m + 40 * m
    seen = np.empty(limit + 1, np.uint64)
    since = 0
    rule = FULL
    refreshed = -1
    residual = np.inf
    if not (flags[MADE] or make(problem, memory, status)):
        return 0, np.inf, NOT_SOLVED
    small = flags[WARM]
    if small:
        for i in range(v.shape[0]):
            v[i] += v_free[i] - v_free_old[i]
    else:
        relative_displacement(problem, v_free, r, q, v)
    flags[WARM] = False
    _start(problem, memory, given, contact, c, weights, small)
    for iteration in range(limit):
        good = _try_states(problem, memory, status, J, c, x)
        changes, worst_pair = 0, -1
        if good:
            _scatter(problem, sign, vt_old, x, contact)
            changes, worst_pair = _judge(problem, vt_old, contact, PROVISIONAL, rule, wanted)
        error = 0.0
        if changes == 0 or rule > FULL:
            error = np.inf
            for attempt in range(5):
                previous = error
                relative_displacement(problem, v_free, r, q, v)
                error = unbalance(problem, given, contact)
                # from nothing, soft rigid motions are exact to rounding only once corrected
                exact = error <= EXACT * tolerance and (small or attempt > 0)
                if good and (exact or attempt == 4):
                    break
                stalled = not (good and (error <= EXACT * tolerance or error < 0.3 * previous))
                if stalled and good and error <= 0.1 * ACCEPTED:
                    break
                if stalled and refreshed != iteration:
                    if not make(problem, memory, status):
                        return iteration + 1, np.inf, NOT_SOLVED
                    refreshed = iteration
                    if not error < np.inf:
                        r[:] = 0.0
                        q[:] = 0.0
                        relative_displacement(problem, v_free, r, q, v)
                    _start(problem, memory, given, contact, c, weights, False)
                    good = _try_states(problem, memory, status, J, c, x)
                else:
                    if attempt == 0 and small:
                        renew_images(memory)
                    _remainder(problem, memory, given, contact, dc, weights)
                    good = _try_states(problem, memory, status, J, dc, dx)
                    c += dc
                    x += dx
                _scatter(problem, sign, vt_old, x, contact)
            if not good:
                return iteration + 1, np.inf, NOT_SOLVED
            slack = max(tolerance, 3.0 * error)
            changes, worst_pair = _judge(problem, vt_old, contact, slack, rule, wanted)
        if not error < np.inf:
            return iteration + 1, np.inf, NOT_SOLVED
        if changes == 0:
            residual = natural_residual(problem, given, contact)
            if residual <= ACCEPTED:
                k = pending(held, status, J)
                if k > MAX_KEPT:
                    exchange(memory, J[:k], c)
                v_free_old[:] = v_free
                flags[WARM] = True
                return iteration + 1, residual, rule
            if refreshed == iteration:
                return iteration + 1, residual, NOT_SOLVED
            if not make(problem, memory, status):
                return iteration + 1, residual, NOT_SOLVED
            refreshed = iteration + 1
            _start(problem, memory, given, contact, c, weights, False)
            continue
        code = np.uint64(1469598103934665603)
        for i in range(m):
            code = (code ^ np.uint64(status[i])) * np.uint64(1099511628211)
        for k in range(since, iteration):
            if seen[k] == code:
                since = iteration
                rule += 1
                break
        seen[iteration] = code
        if rule == FULL and iteration >= MAX_FULL:
            rule = WORST
            since = iteration
        if rule == WORST and iteration - since > 12 * m:
            rule = LEAST_INDEX
            since = iteration
        if rule > LEAST_INDEX:
            return iteration + 1, np.inf, NOT_SOLVED
        if rule > FULL and worst_pair >= 0:
            choice = wanted[worst_pair]
            wanted[:] = status
            wanted[worst_pair] = choice
        if not _align(problem, memory, status, wanted, J, c):
            status[:] = wanted
            if not make(problem, memory, status):
                return iteration + 1, np.inf, NOT_SOLVED
            relative_displacement(problem, v_free, r, q, v)
            _start(problem, memory, given, contact, c, weights, False)
        status[:] = wanted
    return limit, residual, NOT_SOLVED


@jit
def hold(problem, memory, given, contact):
    """Solve for the states in `contact` as they are, from nothing; returns the residual.

    Where it is small this is a solution, whichever side of a limit the states of its pairs are on.
    """
    R = problem.R
    status, r, q, v = contact.status, contact.r, contact.q, contact.v
    size = R.shape[0] + R.shape[1]
    c, x, weights = np.empty(size), np.empty(size), np.empty(size)
    dc, dx = np.empty(size), np.empty(size)
    J = np.empty(size, np.int64)
    if not make(problem, memory, status):
        return np.inf
    r[:] = 0.0
    q[:] = 0.0
    relative_displacement(problem, given.v_free, r, q, v)
    _start(problem, memory, given, contact, c, weights, False)
    residual = np.inf
    for attempt in range(4):
        if attempt == 0:
            good = _try_states(problem, memory, status, J, c, x)
        else:
            _remainder(problem, memory, given, contact, dc, weights)
            good = _try_states(problem, memory, status, J, dc, dx)
            x += dx
        if not good:
            return np.inf
        _scatter(problem, memory.sign, given.vt_old, x, contact)
        relative_displacement(problem, given.v_free, r, q, v)
        if not unbalance(problem, given, contact) < np.inf:
            return np.inf
        found = natural_residual(problem, given, contact)
        if attempt > 1 and found >= residual:
            break
        residual = found
    return found

"""Compiled friction of spatial pairs over a cycle; what it is for stands in `aft.py`.

With two tangential directions P_b is the projection on the disc of radius b: the cone is round.

Memory. The map Phi of r_t over a period is a chain of shifts and projections, none of which takes two
tractions further apart. A pair that opens forgets its traction at once. One that can stick all cycle does;
`aft_locked.py` says where. One that cannot slips in every cycle and forgets its traction by and by, the
more the further it goes: its periodic traction is found by cycles, and by Newton's method on
``Phi(z) = z``, two equations. A step of Newton's method is judged some cycles later: what it leaves along
the slip is gone after one of them, what is across stays.

Derivative. With ``J = (b/|y|)(I - d d^T)``, ``d = y/|y|``, where a pair slips, the identity where it
sticks and zero where it is open, the derivatives S of r_t obey along the cycle

    S[k] = J (S[k-1] + dx_t[k] - dx_t[k-1]) + mu d dr_n[k]

and close to ``S_0 = Phi' S_0 + T``, two equations for every column.

Reference: M. Krack & J. Gross, Harmonic Balance for Nonlinear Vibration Problems, Springer 2019.
"""

from __future__ import annotations

import numpy as np

from microslip.contact.aft_locked import lock, nearest_place
from microslip.contact.aft_normal import CHANGING, press
from microslip.contact.compiled import jit
from microslip.contact.pairs import SEPARATED, SLIP, STICK
from microslip.contact.samples import analyse, synthesise

SETTLED = 1e-13
"""Change of a traction over a cycle, relative to the largest limit of friction, that is none."""

MOST_CYCLES = 4000

PATIENCE = 20
"""Cycles that are gone round before Newton's method is tried."""

JUDGED = 3
"""Cycles after which a step of Newton's method must have brought the traction nearer to its place."""

FORGETS = 1e-12
"""Determinant of ``I - Phi'`` from which on it is tried."""

AT_LIMIT = 1.0 - 1e-13
"""Share of a traction within its limit up to which it slips; beyond, it is at the limit and sticks."""


@jit
def all_spatial_pairs(table, x, mu, held, drift, cycle):
    """Evaluate every pair into `cycle`; returns the first whose periodic traction was not found, or -1."""
    basis, projection = table.basis, table.projection
    r, kind, status = cycle.r, cycle.kind, cycle.status
    N, c = basis.shape[1], basis.shape[0]
    transposed = np.ascontiguousarray(basis.T)
    xn, bound = np.empty(N), np.empty(N)
    one, other, coefficients = np.empty(N), np.empty(N), np.empty(c)
    xt, traction = np.empty((N, 2)), np.empty((N, 2))
    factor, way = np.empty(N), np.empty((N, 2))
    before, place, edges = np.empty(2), np.empty(2), np.empty(2, np.int64)
    S = np.empty((2, 3 * c + 2))
    rows = np.empty((N, 2, 3 * c + 2))
    for i in range(x.shape[0]):
        state = status[i]
        closed = press(table, x, mu[i], i, cycle, xn, bound)
        if closed == 0:
            continue
        # x_t without its mean, which may be large where a body has gone far
        for a in range(2):
            coefficients[:] = x[i, 1 + a]
            before[a] = held[i, a] - coefficients[0]
            coefficients[0] = 0.0
            synthesise(basis, coefficients, one)
            xt[:, a] = one
        place[:] = before
        walks = drift[i, 0] != 0.0 or drift[i, 1] != 0.0
        if closed == N and not walks:
            count = nearest_place(xt, bound, before, place, edges)
            if count >= 0:
                lock(x, i, cycle, transposed, mu[i], xt, bound, before, place, edges, count)
                continue
        kind[i, 1:] = CHANGING
        z1, z2 = xt[N - 1, 0] - place[0], xt[N - 1, 1] - place[1]
        if walks:
            z1, z2 = _far_ahead(xt, bound, drift[i])
        if not periodic(xt, bound, drift[i], z1, z2, traction, state, factor, way):
            return i
        _closed_derivative(transposed, mu[i], state, factor, way, S, rows)
        _march(transposed, mu[i], state, factor, way, S, rows)
        _project(projection, rows, cycle.tn[i], cycle.tt[i], cycle.td[i])
        one[:], other[:] = traction[:, 0], traction[:, 1]
        analyse(projection, one, r[i, 1])
        analyse(projection, other, r[i, 2])
    return -1


@jit
def go_round(xt, bound, drift, z1, z2, traction, state, factor, way):
    """One cycle from the traction before its first sample, ``x_t`` counted from the last sample.

    Fills traction, states, and ``factor`` and ``way`` of J: ``b/|y|`` and d where it slips. Returns the
    traction at the end and how many samples slip or are open.
    """
    N = bound.shape[0]
    d1, d2 = drift[0] / N, drift[1] / N
    before1, before2 = xt[N - 1, 0], xt[N - 1, 1]
    moved = 0
    for k in range(N):
        y1 = z1 + xt[k, 0] - before1 + d1
        y2 = z2 + xt[k, 1] - before2 + d2
        before1, before2 = xt[k, 0], xt[k, 1]
        b = bound[k]
        size = np.sqrt(y1 * y1 + y2 * y2)
        share = b / size if size > b else 1.0
        z1, z2 = share * y1, share * y2
        if state[k] == SEPARATED:
            factor[k] = 0.0
            moved += 1
        elif share < AT_LIMIT:
            factor[k] = share
            way[k, 0], way[k, 1] = y1 / size, y2 / size
            state[k] = SLIP
            moved += 1
        else:
            factor[k] = 1.0
            state[k] = STICK
        traction[k, 0], traction[k, 1] = z1, z2
    return z1, z2, moved


@jit
def _slope(state, factor, way):
    """``Phi'`` of the cycle that was gone round last."""
    a, b, c, d = 1.0, 0.0, 0.0, 1.0
    for k in range(state.shape[0]):
        if state[k] == SEPARATED:
            return 0.0, 0.0, 0.0, 0.0
        if state[k] == SLIP:
            n1, n2, f = way[k, 0], way[k, 1], factor[k]
            one, other = n1 * a + n2 * c, n1 * b + n2 * d
            a, c = f * (a - n1 * one), f * (c - n2 * one)
            b, d = f * (b - n1 * other), f * (d - n2 * other)
    return a, b, c, d


@jit
def _far_ahead(xt, bound, drift):
    """A traction that the drift would take a pair to in many cycles, if it stuck."""
    size = np.hypot(drift[0], drift[1])
    far = 1e3 * (np.max(bound) + np.max(np.abs(xt)))
    return far * drift[0] / size, far * drift[1] / size


@jit
def periodic(xt, bound, drift, z1, z2, traction, state, factor, way):
    """Go round until the traction repeats, the last cycle in the arrays; whether it does.

    `z1` and `z2` are the traction before the first sample to begin with.
    """
    close = SETTLED * np.max(bound)
    w1, w2 = z1, z2
    best = np.inf
    since = 0
    for cycle in range(MOST_CYCLES):
        s1, s2 = z1, z2
        z1, z2, moved = go_round(xt, bound, drift, s1, s2, traction, state, factor, way)
        error = np.hypot(z1 - s1, z2 - s2)
        if moved == 0 or error <= close:
            return True
        if since > 0 and error >= best:
            since += 1
            if since > JUDGED:
                # Newton's step did not help: go on from where going round had led
                z1, z2 = w1, w2
                since = 0
            continue
        best = error
        w1, w2 = z1, z2
        since = 0
        if cycle >= PATIENCE:
            a, b, c, d = _slope(state, factor, way)
            m11, m12, m21, m22 = 1.0 - a, -b, -c, 1.0 - d
            det = m11 * m22 - m12 * m21
            if det > FORGETS:
                f1, f2 = z1 - s1, z2 - s2
                z1 = s1 + (m22 * f1 - m12 * f2) / det
                z2 = s2 + (m11 * f2 - m21 * f1) / det
                since = 1
    return False


@jit
def _march(basis, mu, state, factor, way, S, rows):
    """Derivatives S of the traction once round, in place; those at every sample into `rows`, (N, 2, .)."""
    N, c = basis.shape
    before = basis[N - 1]
    for k in range(N):
        now = basis[k]
        if state[k] == SEPARATED:
            S[:] = 0.0
            rows[k] = 0.0
            before = now
            continue
        for j in range(c):
            change = now[j] - before[j]
            S[0, c + j] += change
            S[1, 2 * c + j] += change
        S[0, 3 * c] += 1.0 / N
        S[1, 3 * c + 1] += 1.0 / N
        if state[k] == SLIP:
            n1, n2, f = way[k, 0], way[k, 1], factor[k]
            for j in range(3 * c + 2):
                along = n1 * S[0, j] + n2 * S[1, j]
                S[0, j] = f * (S[0, j] - n1 * along)
                S[1, j] = f * (S[1, j] - n2 * along)
            for j in range(c):
                S[0, j] += mu * n1 * now[j]
                S[1, j] += mu * n2 * now[j]
        rows[k] = S
        before = now


@jit
def _closed_derivative(basis, mu, state, factor, way, S, rows):
    """Derivatives before the first sample that close: ``S = Phi' S + T``."""
    a, b, c, d = _slope(state, factor, way)
    S[:] = 0.0
    _march(basis, mu, state, factor, way, S, rows)
    m11, m12, m21, m22 = 1.0 - a, -b, -c, 1.0 - d
    det = max(m11 * m22 - m12 * m21, FORGETS)
    for j in range(S.shape[1]):
        t1, t2 = S[0, j], S[1, j]
        S[0, j] = (m22 * t1 - m12 * t2) / det
        S[1, j] = (m11 * t2 - m21 * t1) / det


@jit
def _project(projection, rows, tn, tt, td):
    """Coefficients of the derivatives at all samples."""
    c, N = projection.shape
    flat = np.dot(projection, rows.reshape(N, rows.shape[1] * rows.shape[2]))
    width = rows.shape[2]
    for a in range(2):
        for h in range(c):
            line = flat[h, a * width : (a + 1) * width]
            tn[a, h] = line[:c]
            for b in range(2):
                tt[a, b, h] = line[(1 + b) * c : (2 + b) * c]
                td[a, b, h] = line[3 * c + b]

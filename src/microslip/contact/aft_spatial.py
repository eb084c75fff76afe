"""Compiled friction of spatial pairs over a cycle; what it is for stands in `aft.py`.

With two tangential directions P_b is the projection on the disc of radius b: the cone is round.

Memory. The map Phi of r_t over a period is a chain of shifts and projections, none of which takes two
tractions further apart. A pair that opens forgets its traction at once; one that slips forgets it by
and by, the more the further it goes. Its periodic traction is found by cycles from the state in which
it has stuck since the beginning (`held`), and by Newton's method on ``Phi(z) = z``, two equations.
One that never slips keeps ``r_t = x_t - held``; one that slips at first and then sticks for good keeps
what its slip has left.

Derivative. With ``J = (b/|y|)(I - d d^T)``, ``d = y/|y|``, where a pair slips, the identity where it
sticks and zero where it is open, the derivatives S of r_t obey along the cycle

    S[k] = J (S[k-1] + dx_t[k] - dx_t[k-1]) + mu d dr_n[k]

and close to ``S_0 = Phi' S_0 + T``, two equations for every column. Where a pair has come to rest,
``Phi' = I``, and S is carried along with the cycles that brought it there.

Reference: M. Krack & J. Gross, Harmonic Balance for Nonlinear Vibration Problems, Springer 2019.
"""

from __future__ import annotations

import numpy as np

from microslip.contact.aft_normal import CHANGING, press, stick
from microslip.contact.compiled import jit
from microslip.contact.pairs import SEPARATED, SLIP, STICK
from microslip.contact.samples import analyse, synthesise

SETTLED = 1e-13
"""Change of a traction over a cycle, relative to the largest limit of friction, that is none."""

MOST_CYCLES = 2000

PATIENCE, MOST_PATIENCE = 20, 400
"""Cycles that are gone round before Newton's method is tried, at first and again."""

FORGETS, HARDLY_FORGETS = 1e-4, 1e-12
"""Determinant of ``I - Phi'`` from which on it is."""

AT_LIMIT = 1.0 - 1e-13
"""Share of a traction within its limit up to which it slips; beyond, it is at the limit and sticks."""

RESTS, ROUND, UNSETTLED = 0, 1, 2
"""How a pair's periodic traction was found: it sticks in the end, it slips in every cycle, not at all."""


@jit
def all_spatial_pairs(table, x, mu, held, drift, cycle):
    """Evaluate every pair into `cycle`; returns the first whose periodic traction was not found, or -1."""
    basis, projection = table.basis, table.projection
    r, kind, status = cycle.r, cycle.kind, cycle.status
    N, c = basis.shape[1], basis.shape[0]
    transposed = np.ascontiguousarray(basis.T)
    xn, bound = np.empty(N), np.empty(N)
    one, other = np.empty(N), np.empty(N)
    xt, traction = np.empty((N, 2)), np.empty((N, 2))
    factor, way = np.empty(N), np.empty((N, 2))
    S = np.empty((2, 3 * c + 2))
    rows = np.empty((N, 2, 3 * c + 2))
    for i in range(x.shape[0]):
        state = status[i]
        if press(table, x, mu[i], i, cycle, xn, bound) == 0:
            continue
        synthesise(basis, x[i, 1], one)
        synthesise(basis, x[i, 2], other)
        xt[:, 0], xt[:, 1] = one, other
        cycles, end = periodic(xt, bound, held[i], drift[i], traction, state, factor, way)
        if end == UNSETTLED:
            return i
        if end == RESTS and cycles == 0:
            stick(x, held, i, cycle)
            continue
        kind[i, 1:] = CHANGING
        if end == ROUND:
            _closed_derivative(transposed, mu[i], state, factor, way, S, rows)
        else:
            _carried_derivative(
                transposed,
                mu[i],
                xt,
                bound,
                held[i],
                drift[i],
                min(cycles, MOST_PATIENCE),
                traction,
                state,
                factor,
                way,
                S,
                rows,
            )
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
def first_traction(xt, bound, held, drift):
    """Traction before the first sample of a pair that has stuck; with a drift, far ahead of it."""
    N = bound.shape[0]
    size = np.sqrt(drift[0] ** 2 + drift[1] ** 2)
    if size > 0.0:
        far = 1e3 * (np.max(bound) + np.max(np.abs(xt)))
        return far * drift[0] / size, far * drift[1] / size
    return xt[N - 1, 0] - held[0], xt[N - 1, 1] - held[1]


@jit
def periodic(xt, bound, held, drift, traction, state, factor, way):
    """Go round until the traction repeats: ``(cycles, end)``, the last cycle in the arrays.

    `cycles` is how many came before the one that repeats; 0 with `RESTS` for a pair that never slips.
    """
    cycles, end = _repeat(xt, bound, held, drift, traction, state, factor, way, PATIENCE, FORGETS)
    if end == ROUND:
        return cycles, end
    # where it ends by coming to rest, its whole way there counts
    return _repeat(
        xt, bound, held, drift, traction, state, factor, way, MOST_PATIENCE, HARDLY_FORGETS
    )


@jit
def _repeat(xt, bound, held, drift, traction, state, factor, way, patience, forgets):
    """As `periodic`, with Newton's method after so many cycles, of a slip that forgets so much."""
    close = SETTLED * np.max(bound)
    z1, z2 = first_traction(xt, bound, held, drift)
    w1, w2 = z1, z2
    best = np.inf
    jumped = False
    for cycle in range(MOST_CYCLES):
        s1, s2 = z1, z2
        z1, z2, moved = go_round(xt, bound, drift, s1, s2, traction, state, factor, way)
        if moved == 0:
            return cycle, RESTS
        error = np.sqrt((z1 - s1) ** 2 + (z2 - s2) ** 2)
        if error <= close:
            a, b, c, d = _slope(state, factor, way)
            goes_on = (1.0 - a) * (1.0 - d) - b * c > forgets
            return cycle, ROUND if goes_on else RESTS
        if jumped and error >= best:
            # Newton's step did not help: go on from where going round had led
            z1, z2 = w1, w2
            jumped = False
            continue
        best = error
        w1, w2 = z1, z2
        jumped = False
        if cycle >= patience:
            a, b, c, d = _slope(state, factor, way)
            m11, m12, m21, m22 = 1.0 - a, -b, -c, 1.0 - d
            det = m11 * m22 - m12 * m21
            if det > forgets:
                f1, f2 = z1 - s1, z2 - s2
                z1 = s1 + (m22 * f1 - m12 * f2) / det
                z2 = s2 + (m11 * f2 - m21 * f1) / det
                jumped = True
    return MOST_CYCLES, UNSETTLED


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
    det = m11 * m22 - m12 * m21
    for j in range(S.shape[1]):
        t1, t2 = S[0, j], S[1, j]
        S[0, j] = (m22 * t1 - m12 * t2) / det
        S[1, j] = (m11 * t2 - m21 * t1) / det


@jit
def _carried_derivative(
    basis, mu, xt, bound, held, drift, cycles, traction, state, factor, way, S, rows
):
    """Derivatives before the first sample, carried from the pair's first traction through `cycles`."""
    N, c = basis.shape
    S[:] = 0.0
    if drift[0] == 0.0 and drift[1] == 0.0:
        S[0, c : 2 * c] = basis[N - 1]
        S[1, 2 * c : 3 * c] = basis[N - 1]
    z1, z2 = first_traction(xt, bound, held, drift)
    for _ in range(cycles):
        z1, z2, _ = go_round(xt, bound, drift, z1, z2, traction, state, factor, way)
        _march(basis, mu, state, factor, way, S, rows)
    go_round(xt, bound, drift, z1, z2, traction, state, factor, way)


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

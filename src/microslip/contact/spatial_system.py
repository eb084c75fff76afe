"""Compiled linear system of given contact states, in the tableau of `spatial_tableau.py`.

Of ``x = c - D g`` the states leave few components F of g unknown: both tangential ones of a pair that is
held and slips, all three of one that is held and opens or free and closes. With the laws of
`spatial_newton.py` for these,

    x = c - D g,     e_F(x, g) = 0     become     A g_F = y,     x_F = c_F - D_FF g_F,

with A the part D_FF of the tableau but where a pair slips, ``A = D_tF - mu d D_nF + k (I - d d^T)``.
"""

from __future__ import annotations

import numpy as np

from microslip.contact.compiled import jit
from microslip.contact.pairs import SEPARATED, SLIP
from microslip.contact.tableau import LARGE, add_rows, solve_small


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
def _take(problem, memory, status, F, At):
    """Rows of ``D_FF - mu d D_nF``, transposed: what many unknowns spend their time on.

    mu r_n d of a held pair has r_n among the x: its row of D, times mu d, is taken off. Four rows of
    the tableau are read at a time, by indices without a sign, which need not be tested for one.
    """
    mu, Dt, held = problem.friction, memory.transposed, memory.held
    k = F.shape[0]
    # of every pair its normal component, the place of its tangential unknowns and mu d
    normal, place = np.empty(k, np.uint32), np.empty(k, np.uint32)
    share = np.zeros((k, 2))
    pairs = 0
    for a in range(k):
        i, part = F[a] // 3, F[a] % 3
        if part == 0:
            for b in range(k):
                At[b, a] = Dt[F[b], F[a]]
        elif part == 1:
            normal[pairs], place[pairs] = 3 * i, a
            if status[i] == SLIP and held[3 * i]:
                share[pairs, 0] = mu[i] * memory.direction[i, 0]
                share[pairs, 1] = mu[i] * memory.direction[i, 1]
            pairs += 1
    b = 0
    while b + 4 <= k:
        row0, row1, row2, row3 = Dt[F[b]], Dt[F[b + 1]], Dt[F[b + 2]], Dt[F[b + 3]]
        out0, out1, out2, out3 = At[b], At[b + 1], At[b + 2], At[b + 3]
        for p in range(pairs):
            n, t, s1, s2 = normal[p], place[p], share[p, 0], share[p, 1]
            out0[t], out0[t + 1] = row0[n + 1] - s1 * row0[n], row0[n + 2] - s2 * row0[n]
            out1[t], out1[t + 1] = row1[n + 1] - s1 * row1[n], row1[n + 2] - s2 * row1[n]
            out2[t], out2[t + 1] = row2[n + 1] - s1 * row2[n], row2[n + 2] - s2 * row2[n]
            out3[t], out3[t + 1] = row3[n + 1] - s1 * row3[n], row3[n + 2] - s2 * row3[n]
        b += 4
    while b < k:
        row, out = Dt[F[b]], At[b]
        for p in range(pairs):
            n, t = normal[p], place[p]
            out[t] = row[n + 1] - share[p, 0] * row[n]
            out[t + 1] = row[n + 2] - share[p, 1] * row[n]
        b += 1


@jit
def coupling(problem, memory, status, F, At):
    """Transposed matrix of the laws of the pairs with unknowns, ``A g_F = y``."""
    friction, mean, held = problem.friction, problem.mean, memory.held
    direction, resistance = memory.direction, memory.resistance
    k = F.shape[0]
    _take(problem, memory, status, F, At)
    a = 0
    while a < k:
        i = F[a] // 3
        if status[i] != SLIP:
            a += 1
            continue
        d1, d2 = direction[i, 0], direction[i, 1]
        k1 = mean * resistance[i]
        if held[3 * i]:
            t = a
            At[t, t] += k1 * d2 * d2
            At[t + 1, t] -= k1 * d1 * d2
            At[t, t + 1] -= k1 * d1 * d2
            At[t + 1, t + 1] += k1 * d1 * d1
            a += 2
            continue
        # a free pair: g are its reactions, g_t - mu d g_n = k (I - d d^T) x_t, over 1 + k
        t = a + 1
        inverse = 1.0 / (1.0 + k1)
        k1 *= inverse
        for b in range(k):
            across = d1 * At[b, t + 1] - d2 * At[b, t]
            At[b, t] = -k1 * d2 * across
            At[b, t + 1] = k1 * d1 * across
        At[t, t] += inverse
        At[t + 1, t + 1] += inverse
        At[a, t] -= inverse * friction[i] * d1
        At[a, t + 1] -= inverse * friction[i] * d2
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
def law_errors(problem, memory, status, F, x, g, e):
    """``e = y - A g_F`` of ``x = c - D g``: what the laws of the pairs with unknowns lack."""
    right_side(problem, memory, status, x, F, e)
    held, direction = memory.held, memory.direction
    a = 0
    while a < F.shape[0]:
        i = F[a] // 3
        if status[i] != SLIP:
            a += 1
            continue
        d1, d2 = direction[i, 0], direction[i, 1]
        k1 = problem.mean * memory.resistance[i]
        n = 3 * i
        if held[n]:
            across = k1 * (d1 * g[n + 2] - d2 * g[n + 1])
            e[a] += d2 * across
            e[a + 1] -= d1 * across
            a += 2
            continue
        inverse = 1.0 / (1.0 + k1)
        bound = problem.friction[i] * g[n]
        e[a + 1] -= inverse * (g[n + 1] - bound * d1)
        e[a + 2] -= inverse * (g[n + 2] - bound * d2)
        a += 3


@jit
def solve_directly(problem, memory, status, c, F, x, g):
    """Unknowns of given states into x and g, by elimination. False where their system is singular."""
    k = F.shape[0]
    x[:] = c
    g[:] = 0.0
    if k == 0:
        return True
    At = np.empty((k, k))
    y = np.empty((k, 1))
    coupling(problem, memory, status, F, At)
    right_side(problem, memory, status, c, F, y[:, 0])
    if k < LARGE:
        if not solve_small(At.T.copy(), y):
            return False
    else:
        try:
            y = np.linalg.solve(At.T, y)
        except Exception:
            return False
    minus = np.zeros(g.shape[0])
    for a in range(k):
        g[F[a]] = y[a, 0]
        minus[F[a]] = -y[a, 0]
    add_rows(memory.transposed, minus, x)
    obey(problem, memory, status, F, x, g)
    return True


@jit
def obey(problem, memory, status, F, x, g):
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

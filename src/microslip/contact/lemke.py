"""Lemke's method on planar contact: a solution wherever one is sure to exist, whatever the friction.

With ``r_t = r_+ - r_-`` and a slack beta of each pair, the equations of `planar.py` are a linear
complementarity problem ``w = M z + b``, ``w, z >= 0``, ``w z = 0`` (Stewart & Trinkle, Int. J. Numer.
Methods Eng. 39 (1996) 2673; Anitescu & Potra, Nonlinear Dyn. 14 (1997) 231),

    -v_n                    >= 0   against  r_n
    beta - (v_t - v_t_old)  >= 0   against  r_+
    beta + (v_t - v_t_old)  >= 0   against  r_-
    mu r_n - r_+ - r_-      >= 0   against  beta
    +-(K_q q + R^T r - f_q) >= 0   against  q_+ and q_-,   q = q_+ - q_-

for v of ``v = v_free + R q - W r``. R appears with both signs and drops out of

    z^T M z = r^T W r + q^T K_q q + sum mu beta r_n  >=  0:

with W positive definite and no negative K_q, M is copositive. Lemke's method with a covering vector
``d > 0`` and a lexicographic choice of ties then ends in a solution or on a ray ``z`` with
``M z >= 0``, ``z^T M z = 0`` and ``b z < 0`` (Cottle, Pang & Stone, The Linear Complementarity Problem,
theorem 4.4.13). Such a z has ``r = 0`` and ``K_q q = 0``, it opens pairs or slides them, and
``b z = -f_q^T q``: the load does work along a motion that neither contact nor support resists.
Without one there is a solution (Klarbring & Pang, SIAM J. Optim. 8 (1998) 381).

The method pivots on a full tableau of ``4 m + 2 e`` rows, some hundred times dearer than a warm
active set; what it is used for is the set of states that its solution has.
"""

from __future__ import annotations

import numpy as np

from microslip.contact.compiled import jit
from microslip.contact.pairs import BACKWARD, FORWARD, SEPARATED, STICK

SOLUTION, RAY, TOO_LONG = 0, 1, 2
"""How a search ends: a solution, a ray, or neither within the number of pivots allowed."""

TIE = 1e-12
"""Ratios that differ by less, relative to the largest entry of b, are taken for the same."""


@jit
def complementarity_form(problem, given):
    """M and b of a contact problem, rows as in the header: four for each pair, two for each q.

    Reactions are in units of displacement, as in `tableau.py`, and all displacements over
    that of the typical contact force.
    """
    W, R, stiffness, scale = problem.W, problem.R, problem.stiffness, problem.scale
    mu, mean = problem.friction, problem.mean
    v_free, f_q, vt_old = given.v_free, given.f_q, given.vt_old
    m = mu.shape[0]
    e = stiffness.shape[0]
    n = 4 * m + 2 * e
    M = np.zeros((n, n))
    b = np.zeros(n)
    unit = mean * np.mean(problem.force)
    for i in range(m):
        ni, ti = 2 * i, 2 * i + 1
        for j in range(m):
            nn, nt = W[ni, 2 * j] / mean, W[ni, 2 * j + 1] / mean
            tn, tt = W[ti, 2 * j] / mean, W[ti, 2 * j + 1] / mean
            M[4 * i, 4 * j], M[4 * i, 4 * j + 1], M[4 * i, 4 * j + 2] = nn, nt, -nt
            M[4 * i + 1, 4 * j], M[4 * i + 1, 4 * j + 1], M[4 * i + 1, 4 * j + 2] = tn, tt, -tt
            M[4 * i + 2, 4 * j], M[4 * i + 2, 4 * j + 1], M[4 * i + 2, 4 * j + 2] = -tn, -tt, tt
        M[4 * i + 1, 4 * i + 3] = 1.0
        M[4 * i + 2, 4 * i + 3] = 1.0
        M[4 * i + 3, 4 * i] = mu[i]
        M[4 * i + 3, 4 * i + 1] = -1.0
        M[4 * i + 3, 4 * i + 2] = -1.0
        b[4 * i] = -v_free[ni] / unit
        b[4 * i + 1] = (vt_old[i] - v_free[ti]) / unit
        b[4 * i + 2] = -b[4 * i + 1]
        for a in range(e):
            column = 4 * m + 2 * a
            xn, xt = R[ni, a] * scale[a] / mean, R[ti, a] * scale[a] / mean
            for side in range(2):
                s = 1.0 if side == 0 else -1.0
                M[4 * i, column + side] = -s * xn
                M[4 * i + 1, column + side] = -s * xt
                M[4 * i + 2, column + side] = s * xt
                M[column + side, 4 * i] = s * xn
                M[column + side, 4 * i + 1] = s * xt
                M[column + side, 4 * i + 2] = -s * xt
    for a in range(e):
        row = 4 * m + 2 * a
        k = scale[a] * stiffness[a] * scale[a] / mean
        M[row, row], M[row + 1, row + 1] = k, k
        M[row, row + 1], M[row + 1, row] = -k, -k
        b[row] = -scale[a] * f_q[a] / unit
        b[row + 1] = -b[row]
    return M, b


@jit
def _pivot(T, rhs, row, column):
    """Exchange the basic variable of a row with the one of a column."""
    p = 1.0 / T[row, column]
    pivot_row = T[row]
    pivot_row[column] = 1.0
    for j in range(T.shape[1]):
        pivot_row[j] *= p
    rhs[row] *= p
    y = rhs[row]
    for i in range(T.shape[0]):
        if i == row:
            continue
        line = T[i]
        x = line[column]
        if x != 0.0:
            line[column] = 0.0
            for j in range(T.shape[1]):
                line[j] -= x * pivot_row[j]
            rhs[i] -= x * y


@jit
def _least_ratio(T, rhs, column, basic, place, tie, smallest):
    """Row that leaves when a column enters, ties broken lexicographically; -1 on a ray.

    `place` has the column of every variable that is not basic. The covering variable, the last,
    leaves wherever it may.
    """
    n = T.shape[0]
    largest = 0.0
    for i in range(n):
        largest = max(largest, abs(T[i, column]))
    least = np.inf
    for i in range(n):
        if T[i, column] > smallest * largest:
            least = min(least, max(rhs[i], 0.0) / T[i, column])
    if least == np.inf:
        return -1
    tied = np.empty(n, np.int64)
    count = 0
    for i in range(n):
        if T[i, column] > smallest * largest:
            x = max(rhs[i], 0.0)
            if x <= least * T[i, column] + tie:
                if basic[i] == 2 * n:
                    return i
                tied[count] = i
                count += 1
    j = 0
    while count > 1 and j < n:
        # column j of the inverse of the basis: that of w_j, which is a unit vector where w_j is basic
        where = place[n + j]
        least = np.inf
        for k in range(count):
            i = tied[k]
            x = T[i, where] if where >= 0 else (1.0 if basic[i] == n + j else 0.0)
            least = min(least, x / T[i, column])
        kept = 0
        for k in range(count):
            i = tied[k]
            x = T[i, where] if where >= 0 else (1.0 if basic[i] == n + j else 0.0)
            if x / T[i, column] <= least + 1e-12 * (1.0 + abs(least)):
                tied[kept] = i
                kept += 1
        count = kept
        j += 1
    return tied[0]


@jit
def lemke(M, b, d, limit, smallest):
    """Solve ``w = M z + b``, ``w, z >= 0``, ``w z = 0`` from the covering vector d.

    Parameters
    ----------
    M : (n, n) array
    b, d : (n,) arrays
        ``d > 0``.
    limit : int
        Most pivots.
    smallest : float
        Smallest pivot over the largest entry of its column. Larger ones guard against rounding, smaller
        ones tell a soft support from none.

    Returns
    -------
    outcome : int
        `SOLUTION`, `RAY` or `TOO_LONG`.
    z : (n,) array
        The solution; on a ray its direction.
    pivots : int

    Examples
    --------
    >>> outcome, z, pivots = lemke(np.array([[2.0, 1.0], [1.0, 2.0]]), -np.ones(2), np.ones(2), 10, 1e-10)
    >>> outcome == SOLUTION, np.round(z, 12).tolist()
    (True, [0.333333333333, 0.333333333333])
    """
    n = b.shape[0]
    z = np.zeros(n)
    first = -1
    least = 0.0
    for i in range(n):
        x = b[i] / d[i]
        # the last of equals keeps the rows lexicographically positive
        if x < 0.0 and x <= least:
            least = x
            first = i
    if first < 0:
        return SOLUTION, z, 0
    tie = TIE * np.max(np.abs(b))
    T = np.empty((n, n + 1))
    T[:, :n] = -M
    T[:, n] = -d
    rhs = b.copy()
    # variables: z_j is j, w_j is n + j, the covering one 2 n
    basic = np.arange(n, 2 * n)
    place = np.full(2 * n + 1, -1)
    place[:n] = np.arange(n)
    place[2 * n] = n
    free = np.arange(n + 1)
    free[n] = 2 * n
    row, column = first, n
    for pivots in range(1, limit + 1):
        leaving, entering = basic[row], free[column]
        _pivot(T, rhs, row, column)
        basic[row], free[column] = entering, leaving
        place[entering], place[leaving] = -1, column
        if leaving == 2 * n:
            for i in range(n):
                if basic[i] < n:
                    z[basic[i]] = max(rhs[i], 0.0)
            return SOLUTION, z, pivots
        column = place[leaving - n if leaving >= n else leaving + n]
        row = _least_ratio(T, rhs, column, basic, place, tie, smallest)
        if row < 0:
            if free[column] < n:
                z[free[column]] = 1.0
            for i in range(n):
                if basic[i] < n:
                    z[basic[i]] = max(-T[i, column], 0.0)
            return RAY, z, pivots
    return TOO_LONG, z, limit


@jit
def states_of(z, status):
    """Contact states of a solution of the complementarity form, into `status`."""
    for i in range(status.shape[0]):
        pressed, forward, backward, slack = z[4 * i], z[4 * i + 1], z[4 * i + 2], z[4 * i + 3]
        if pressed <= 0.0:
            status[i] = SEPARATED
        elif slack <= 0.0 or (forward > 0.0 and backward > 0.0):
            status[i] = STICK
        elif forward >= backward:
            status[i] = FORWARD
        else:
            status[i] = BACKWARD

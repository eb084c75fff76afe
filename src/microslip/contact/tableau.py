"""Compiled tableau of a planar contact problem: what is unknown, by what is given.

With ``r_t = p_t + s mu r_n`` for a sign ``s`` of each pair, and ``p_n = r_n``, the equations of
`planar.py` read, for reactions p, coordinates q and displacements v (slip since the last step),

    M (p, q) + (v, 0) = w,     M = [[W, -R], [R^T, K_q]] P,     w = (v_free - (0, v_t_old), f_q)

and each component j of a pair has either ``v_j = 0`` and an unknown reaction (it is *held*: touching
in the normal direction, sticking in the tangential) or ``p_j = 0`` and an unknown displacement. q is
always held. Solved for the unknowns x, given the zeros g that need not be quite zero,

    x = c - D g

which is the tableau of principal pivoting: D holds, in one square array, the inverse of the held
part, and the gaps and slips it leaves. When the set J of components changes from held to free or
back, the new unknowns follow from the small system of J alone,

    g_J = D_JJ^-1 c_J,     x_i = c_i - D_iJ g_J

so states can be tried at the price of |J| columns. `exchange` brings J into the tableau by one
update of rank |J| (block pivot; Cottle, Pang & Stone, The Linear Complementarity Problem, 2.3).

Reactions are kept in units of displacement (times the mean of the diagonal of W) so that all
entries are comparable.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from microslip.contact.compiled import jit
from microslip.contact.pairs import BACKWARD, FORWARD, SEPARATED, STICK
from microslip.typing import Array, Mask

LARGE, LARGEST = 48, 160
"""Components exchanged at once from which on the library inverts, and multiplies, faster."""

WIDE, FEW = 160, 4
"""Components from which on, and modes times this up to which, less is multiplied where modes move all."""

SINGULAR = 1e-13
"""Smallest pivot over the largest entry of its row."""

WARM, MADE = 0, 1
"""Places in the flags of a memory: there is a last solution; the tableau is made."""


class Memory(NamedTuple):
    """What a solver keeps from one solution to the next, changed in place.

    Attributes
    ----------
    transposed : (n, n) array
        D of the tableau, transposed; n = 2 m + e.
    held : (n,) bool array
        Components held in the tableau.
    sign : (m,) array
        Sign s of each pair.
    v_free : (2 m,) array
        Of the last solution.
    flags : (2,) bool array
        At `WARM` and `MADE`.
    solved : (6,) int array
        Problems by how they were solved, numbered as in `active_set.py`.
    changes : (1,) int array
        How often D has become another otherwise than by `turn`.
    modes : (k, 2 m) array
        Orthonormal relative displacements that free displacements mostly change by from one problem to the
        next: modes of motion may cancel each other where pairs touch.
    turned : (k, k) array
        Shares of modes of motion, rows, in them.
    images : (k, n) array
        Unknowns of the tableau where these are given.
    shares : (k,) array
        Of them in the change since the last solution, set for each problem.
    """

    transposed: Array
    held: Mask
    sign: Array
    v_free: Array
    flags: Mask
    solved: NDArray[np.int64]
    changes: NDArray[np.int64]
    modes: Array
    turned: Array
    images: Array
    shares: Array


def memory(pairs: int, coordinates: int, modes: Array | None = None) -> Memory:
    """Arrays of a solver, not yet valid: `restart` fills them. Modes are followed where it pays."""
    given = np.zeros((0, 2 * pairs))
    if modes is not None and by_modes(*modes.shape):
        given = modes
    modes = np.ascontiguousarray(np.linalg.svd(given, full_matrices=False)[2])
    n = 2 * pairs + coordinates
    return Memory(
        transposed=np.zeros((n, n)),
        held=np.zeros(n, np.bool_),
        sign=np.ones(pairs),
        v_free=np.zeros(2 * pairs),
        flags=np.zeros(2, np.bool_),
        solved=np.zeros(6, np.int64),
        changes=np.zeros(1, np.int64),
        modes=modes,
        turned=np.ascontiguousarray(given @ modes.T),
        images=np.zeros((len(modes), n)),
        shares=np.zeros(len(modes)),
    )


@jit
def dimension_of(memory):
    """Components per pair."""
    return 2


@jit
def add_rows(M, weights, out):
    """``out += weights @ M``, zero weights skipped, four rows of M at a time."""
    n = out.shape[0]
    which = np.empty(weights.shape[0], np.int64)
    count = 0
    for j in range(weights.shape[0]):
        if weights[j] != 0.0:
            which[count] = j
            count += 1
    j = 0
    while j + 4 <= count:
        a, b, c, d = which[j], which[j + 1], which[j + 2], which[j + 3]
        xa, xb, xc, xd = weights[a], weights[b], weights[c], weights[d]
        ma, mb, mc, md = M[a], M[b], M[c], M[d]
        for i in range(n):
            out[i] += xa * ma[i] + xb * mb[i] + xc * mc[i] + xd * md[i]
        j += 4
    while j < count:
        x = weights[which[j]]
        row = M[which[j]]
        for i in range(n):
            out[i] += x * row[i]
        j += 1


@jit
def by_modes(modes, components):
    """Whether so few modes move so many components that it pays to know what is answered to each."""
    return components >= WIDE and FEW * modes < components


@jit
def follow_modes(memory, now, before):
    """Let the next problem differ from the last by so much of each mode."""
    np.dot(now - before, memory.turned, memory.shares)


@jit
def signs(memory):
    """Those of `turn`."""
    return memory.sign


@jit
def solve_small(C, X):
    """``X <- C^-1 X`` by elimination with row pivots; C is destroyed. False where it is singular."""
    k = C.shape[0]
    for a in range(k):
        p = a
        for b in range(a + 1, k):
            if abs(C[b, a]) > abs(C[p, a]):
                p = b
        size = 0.0
        for b in range(a, k):
            size = max(size, abs(C[p, b]))
        if not abs(C[p, a]) > SINGULAR * size:
            return False
        if p != a:
            for b in range(a, k):
                C[a, b], C[p, b] = C[p, b], C[a, b]
            for j in range(X.shape[1]):
                X[a, j], X[p, j] = X[p, j], X[a, j]
        inverse = 1.0 / C[a, a]
        for b in range(a + 1, k):
            f = C[b, a] * inverse
            if f != 0.0:
                for j in range(a + 1, k):
                    C[b, j] -= f * C[a, j]
                for j in range(X.shape[1]):
                    X[b, j] -= f * X[a, j]
    for a in range(k - 1, -1, -1):
        for b in range(a + 1, k):
            f = C[a, b]
            for j in range(X.shape[1]):
                X[a, j] -= f * X[b, j]
        inverse = 1.0 / C[a, a]
        for j in range(X.shape[1]):
            X[a, j] *= inverse
    return True


@jit
def _subtract_product(M, X, Y):
    """``M -= X @ Y`` in place, for few rows of Y, by blocks of four by four that stay in registers.

    As many as a multiple of four: others are padded with zeros, which is as fast as fewer.
    """
    n, k = X.shape
    rows = n - n % 4
    for i in range(0, rows, 4):
        m0, m1, m2, m3 = M[i], M[i + 1], M[i + 2], M[i + 3]
        for b in range(0, k, 4):
            y0, y1, y2, y3 = Y[b], Y[b + 1], Y[b + 2], Y[b + 3]
            a00, a01, a02, a03 = X[i, b], X[i, b + 1], X[i, b + 2], X[i, b + 3]
            a10, a11, a12, a13 = X[i + 1, b], X[i + 1, b + 1], X[i + 1, b + 2], X[i + 1, b + 3]
            a20, a21, a22, a23 = X[i + 2, b], X[i + 2, b + 1], X[i + 2, b + 2], X[i + 2, b + 3]
            a30, a31, a32, a33 = X[i + 3, b], X[i + 3, b + 1], X[i + 3, b + 2], X[i + 3, b + 3]
            for j in range(M.shape[1]):
                x0, x1, x2, x3 = y0[j], y1[j], y2[j], y3[j]
                m0[j] -= a00 * x0 + a01 * x1 + a02 * x2 + a03 * x3
                m1[j] -= a10 * x0 + a11 * x1 + a12 * x2 + a13 * x3
                m2[j] -= a20 * x0 + a21 * x1 + a22 * x2 + a23 * x3
                m3[j] -= a30 * x0 + a31 * x1 + a32 * x2 + a33 * x3
    for i in range(rows, n):
        add_rows(Y, -X[i], M[i])


@jit
def pending(held, status, J):
    """Components whose state is not the tableau's, into J; returns how many."""
    k = 0
    for i in range(status.shape[0]):
        if held[2 * i] != (status[i] != SEPARATED):
            J[k] = 2 * i
            k += 1
        if held[2 * i + 1] != (status[i] == STICK):
            J[k] = 2 * i + 1
            k += 1
    return k


@jit
def _exchange_images(images, J, inverse, cols):
    """As `exchange` does to c; padded with zeros as there."""
    k = J.shape[0]
    given = np.zeros((images.shape[0], cols.shape[0]))
    for a in range(images.shape[0]):
        for b in range(k):
            for e in range(k):
                given[a, b] += inverse[b, e] * images[a, J[e]]
    _subtract_product(images, given, cols)
    for a in range(images.shape[0]):
        for b in range(k):
            images[a, J[b]] = given[a, b]


@jit
def answer(memory, w, weights, x):
    """Unknowns x = c, rows for rows, of the tableau's own states, all else zero.

    `weights` are the columns of w that the tableau holds, and behind them the loads on q.
    """
    held = memory.held
    np.dot(weights, memory.transposed, x)
    for a in range(w.shape[0]):
        for i in range(w.shape[1]):
            if not held[i]:
                x[a, i] += w[a, i]


@jit
def renew_images(memory):
    """Make the images afresh from the tableau."""
    weights = np.zeros(memory.images.shape)
    for i in range(memory.modes.shape[1]):
        if memory.held[i]:
            weights[:, i] = memory.modes[:, i]
    answer(memory, memory.modes, weights, memory.images)


@jit
def exchange(memory, J, c):
    """Exchange held and free for the components J, in the tableau and in c. False if singular."""
    Dt, held = memory.transposed, memory.held
    n = Dt.shape[0]
    k = J.shape[0]
    if k == 0:
        return True
    memory.changes[0] += 1
    width = k + -k % 4
    cols = np.zeros((width, n))
    rows = np.zeros((n, width))
    C = np.empty((k, k))
    y = np.empty((k, 1))
    for b in range(k):
        cols[b] = Dt[J[b]]
        y[b, 0] = c[J[b]]
    for i in range(n):
        row = Dt[i]
        for b in range(k):
            rows[i, b] = row[J[b]]
    for a in range(k):
        for b in range(k):
            C[b, a] = rows[J[a], b]
    for a in range(k):
        rows[J[a]] = 0.0
        rows[J[a], a] = 1.0
    inverse, padded = np.eye(k), np.zeros((width, width))
    if k >= LARGE:
        try:
            inverse[:] = np.linalg.inv(C)
        except Exception:
            return False
    elif not solve_small(C, inverse):
        return False
    y = np.dot(inverse, y)
    padded[:k, :k] = inverse.T
    rows = np.dot(rows, padded)
    if memory.images.shape[0] > 0:
        _exchange_images(memory.images, J, inverse, cols)
    for b in range(k):
        Dt[J[b]] = 0.0
        y0 = y[b, 0]
        for i in range(n):
            c[i] -= y0 * cols[b, i]
    if k >= LARGEST:
        Dt -= np.dot(rows, cols)
    else:
        _subtract_product(Dt, rows, cols)
    for i in range(n):
        row = Dt[i]
        for b in range(k):
            row[J[b]] = rows[i, b]
    for b in range(k):
        c[J[b]] = y[b, 0]
        held[J[b]] = not held[J[b]]
    return True


@jit
def make(problem, memory, status):
    """Make the tableau afresh for given states. False where their system is singular."""
    W, R, stiffness, scale = problem.W, problem.R, problem.stiffness, problem.scale
    mu, mean = problem.friction, problem.mean
    Dt, held, sign, flags = memory.transposed, memory.held, memory.sign, memory.flags
    N, nr = R.shape
    for i in range(status.shape[0]):
        if status[i] == FORWARD:
            sign[i] = 1.0
        elif status[i] == BACKWARD:
            sign[i] = -1.0
    for j in range(N):
        share = sign[j // 2] * mu[j // 2] if j % 2 == 0 else 0.0
        for i in range(N):
            Dt[j, i] = (W[j, i] + (share * W[j + 1, i] if j % 2 == 0 else 0.0)) / mean
        for a in range(nr):
            x = R[j, a] + (share * R[j + 1, a] if j % 2 == 0 else 0.0)
            Dt[j, N + a] = scale[a] * x / mean
            Dt[N + a, j] = -scale[a] * R[j, a] / mean
    for a in range(nr):
        for i in range(nr):
            Dt[N + a, N + i] = 0.0
        Dt[N + a, N + a] = scale[a] * stiffness[a] * scale[a] / mean
    held[:] = False
    flags[:] = False
    memory.changes[0] += 1
    memory.images[:, :N] = memory.modes
    memory.images[:, N:] = 0.0
    J = np.empty(N + nr, np.int64)
    k = pending(held, status, J)
    for a in range(nr):
        J[k] = N + a
        k += 1
    flags[MADE] = exchange(memory, J[:k], np.zeros(N + nr))
    return flags[MADE]


@jit
def restart(problem, memory, status):
    """Make the tableau afresh for given states; raises numpy's error where that is singular."""
    if not make(problem, memory, status):
        raise np.linalg.LinAlgError("Matrix is singular to machine precision.")


@jit
def turn(mu, memory, pair, sign_new, c):
    """Give a pair the other sign, where it is sticking or separated in the tableau."""
    Dt, held, sign = memory.transposed, memory.held, memory.sign
    n, t = 2 * pair, 2 * pair + 1
    change = (sign_new - sign[pair]) * mu[pair]
    sign[pair] = sign_new
    if held[n]:
        for i in range(Dt.shape[0]):
            Dt[i, t] -= change * Dt[i, n]
        for a in range(memory.images.shape[0]):
            memory.images[a, t] -= change * memory.images[a, n]
        c[t] -= change * c[n]
    else:
        for i in range(Dt.shape[0]):
            Dt[n, i] += change * Dt[t, i]


@jit
def permute(memory, rows, pairs):
    """Let every component, and every pair, take the place of another; modes stay what they are."""
    Dt, held, v_free, sign = memory.transposed, memory.held, memory.v_free, memory.sign
    before, held_before = Dt.copy(), held.copy()
    v_before, sign_before = v_free.copy(), sign.copy()
    for i in range(rows.shape[0]):
        own, row = Dt[i], before[rows[i]]
        for j in range(rows.shape[0]):
            own[j] = row[rows[j]]
        held[i] = held_before[rows[i]]
        v_free[i] = v_before[rows[i]]
    for i in range(pairs.shape[0]):
        sign[i] = sign_before[pairs[i]]
    memory.changes[0] += 1
    renew_images(memory)


@jit
def follow(problem, memory, status):
    """Make the tableau fit for other states than those it was left with, afresh where it has to."""
    mu = problem.friction
    held, sign, flags = memory.held, memory.sign, memory.flags
    flags[WARM] = False
    J = np.empty(held.shape[0], np.int64)
    nothing = np.zeros(held.shape[0])
    if not flags[MADE] or pending(held, status, J) > status.shape[0] // 2:
        restart(problem, memory, status)
        return
    for i in range(status.shape[0]):
        if status[i] == FORWARD or status[i] == BACKWARD:
            new = 1.0 if status[i] == FORWARD else -1.0
            if new != sign[i]:
                if held[2 * i] and not held[2 * i + 1]:
                    restart(problem, memory, status)
                    return
                turn(mu, memory, i, new, nothing)

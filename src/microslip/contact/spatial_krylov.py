"""Compiled iterative solution of the linear system of many slipping pairs (`spatial_system.py`).

Eliminating k unknowns takes k^3 operations; a product with their matrix takes k^2, and few of them are
needed: slip is held by the stiffness of an elastic body and, across its direction, by friction over slip,
and the blocks of the pairs alone precondition both. Newton's method corrects what is left of every system in
the next, whose errors ``e`` are computed in double precision,

    A dg = e(x, g),     g += dg,     x -= D dg,

so that dg itself may be of few digits: GMRES (Saad & Schultz, SIAM J. Sci. Stat. Comput. 7 (1986) 856) in
single precision, preconditioned on the right.
"""

from __future__ import annotations

import numpy as np

from microslip.contact.compiled import jit
from microslip.contact.spatial_system import coupling, law_errors
from microslip.contact.tableau import add_rows, solve_small

MANY = 200
"""Unknowns from which on iterations are faster than elimination."""

MOST_PRODUCTS = 60
"""Iterations of GMRES; a system that asks for more is eliminated."""

LINEAR = 1e-4
"""Error of a linear solution, over that of its start."""


@jit
def correct(problem, memory, status, F, x, g, At):
    """Correct x and g towards given states, ``x + D g`` as it is. False where that does not converge.

    `At` is a (k, k) float32 array to work in.
    """
    _leave(memory, F, x, g)
    k = F.shape[0]
    e = np.empty(k)
    law_errors(problem, memory, status, F, x, g, e)
    size = np.linalg.norm(e)
    if not size < np.inf:
        return False
    if size == 0.0:
        return True
    coupling(problem, memory, status, F, At)
    first = _first_of_pairs(F)
    inverse = np.zeros((k, 3), np.float32)
    if not _own_inverse(At, first, inverse):
        return False
    start = np.empty(k, np.float32)
    for a in range(k):
        start[a] = e[a] / size
    change = np.empty(k, np.float32)
    if not _gmres(At, first, inverse, start, change):
        return False
    minus = np.zeros(g.shape[0])
    for a in range(k):
        step = size * change[a]
        g[F[a]] += step
        minus[F[a]] = -step
    add_rows(memory.transposed, minus, x)
    return True


@jit
def _leave(memory, F, x, g):
    """Take the g that are not unknown to zero."""
    left = g.copy()
    for a in range(F.shape[0]):
        left[F[a]] = 0.0
    for j in range(g.shape[0]):
        if left[j] != 0.0:
            g[j] = 0.0
    add_rows(memory.transposed, left, x)


@jit
def _first_of_pairs(F):
    """Places of the first unknown of every pair, and one past the last."""
    first = np.empty(F.shape[0] + 1, np.int64)
    pairs = 0
    last = -1
    for a in range(F.shape[0]):
        i = F[a] // 3
        if i != last:
            first[pairs] = a
            pairs += 1
            last = i
    first[pairs] = F.shape[0]
    return first[: pairs + 1]


@jit
def _own_inverse(At, first, inverse):
    """Inverse of the block of every pair, row by row. False where one is singular."""
    for p in range(first.shape[0] - 1):
        a = first[p]
        size = first[p + 1] - a
        block = np.empty((size, size))
        unit = np.eye(size)
        for i in range(size):
            for j in range(size):
                block[i, j] = At[a + j, a + i]
        if not solve_small(block, unit):
            return False
        for i in range(size):
            for j in range(size):
                inverse[a + i, j] = unit[i, j]
    return True


@jit
def _precondition(first, inverse, v, out):
    for p in range(first.shape[0] - 1):
        a, end = first[p], first[p + 1]
        for i in range(a, end):
            s = np.float32(0.0)
            for j in range(end - a):
                s += inverse[i, j] * v[a + j]
            out[i] = s


@jit
def _gmres(At, first, inverse, start, change):
    """``A change = start`` to `LINEAR`, for a start of size 1. False where it does not converge."""
    k = start.shape[0]
    most = min(MOST_PRODUCTS, k)
    basis = np.empty((most + 1, k), np.float32)
    basis[0] = start
    H = np.zeros((most + 1, most))
    turned = np.zeros((most, 2))
    rest = np.zeros(most + 1)
    rest[0] = 1.0
    z = np.empty(k, np.float32)
    for n in range(most):
        _precondition(first, inverse, basis[n], z)
        w = np.dot(z, At)
        before = basis[: n + 1]
        # twice, as rounding takes the first one's orthogonality
        for _ in range(2):
            part = np.dot(before, w)
            w -= np.dot(part, before)
            for i in range(n + 1):
                H[i, n] += part[i]
        norm = np.sqrt(np.float64(np.dot(w, w)))
        for i in range(n):
            p, q = H[i, n], H[i + 1, n]
            H[i, n] = turned[i, 0] * p + turned[i, 1] * q
            H[i + 1, n] = turned[i, 0] * q - turned[i, 1] * p
        length = np.sqrt(H[n, n] ** 2 + norm**2)
        if not 0.0 < length < np.inf:
            return False
        c, s = H[n, n] / length, norm / length
        turned[n, 0], turned[n, 1] = c, s
        H[n, n] = length
        rest[n + 1] = -s * rest[n]
        rest[n] *= c
        if abs(rest[n + 1]) <= LINEAR:
            _combine(H, rest, basis, n + 1, z)
            _precondition(first, inverse, z, change)
            return True
        scale = np.float32(1.0 / norm)
        for a in range(k):
            basis[n + 1, a] = scale * w[a]
    return False


@jit
def _combine(H, rest, basis, count, out):
    """The combination of the basis that leaves least."""
    y = np.empty(count)
    for i in range(count - 1, -1, -1):
        s = rest[i]
        for j in range(i + 1, count):
            s -= H[i, j] * y[j]
        y[i] = s / H[i, i]
    out[:] = 0.0
    for i in range(count):
        weight = np.float32(y[i])
        for a in range(out.shape[0]):
            out[a] += weight * basis[i, a]

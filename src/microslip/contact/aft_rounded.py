"""Compiled contact laws of planar pairs over a cycle with rounded corners.

With the rounded positive part (Chen & Harker, Kanzow, Smale)

    s(x) = (x + sqrt(x² + 4 delta²)) / 2,        s(x) (s(x) - x) = delta²

the projections of `aft.py` become

    r_n[k] = s(x_n[k])
    r_t[k] = s(y + b) - s(y - b) - b,    y = r_t[k-1] + x_t[k] - x_t[k-1],    b = mu r_n[k],

with ``delta / sqrt(N)`` in the second, as what N samples ease of a traction in a cycle adds up to N delta²
over its distance from the limit. A reaction and the gap that it stands against have the product
``delta²/eps`` all cycle: the central path of interior-point methods (M. Kojima, N. Megiddo, T. Noma &
A. Yoshise, A Unified Approach to Interior Point Algorithms for Linear Complementarity Problems, Springer
1991). With delta large contact hardly changes over the cycle; as it vanishes the laws are exact.

The recursion of friction is run twice from the place where a pair has stuck; a pair that is clipped forgets
that. Bodies that walk have no such place: their laws are not rounded.

Derivatives of what is within `NEARLY` of always or never touching, or always sticking, are those of the
linear laws: Newton's method does not notice, and such components are eliminated.
"""

from __future__ import annotations

import numpy as np

from microslip.contact.aft_normal import CHANGING, LINEAR, OPEN
from microslip.contact.compiled import inlined_jit, jit
from microslip.contact.pairs import SEPARATED, STICK
from microslip.contact.samples import analyse, synthesise

NEARLY = 1e-3
"""Share of a derivative that is left out where contact is nearly linear."""


@jit
def all_rounded_pairs(table, x, mu, held, rounding, cycle):
    """Evaluate every planar pair into `cycle`, with delta of each component, (m, 2), in `rounding`."""
    basis, projection = table.basis, table.projection
    N, c = basis.shape[1], x.shape[2]
    transposed = np.ascontiguousarray(basis.T)
    xn, xt, traction = np.empty(N), np.empty(N), np.empty(N)
    reaction, share = np.empty(N), np.empty(N)
    weighted = np.empty((c, N))
    by_normal, by_tangential = np.empty((N, c)), np.empty((N, c))
    for i in range(x.shape[0]):
        synthesise(basis, x[i, 0], xn)
        synthesise(basis, x[i, 1], xt)
        for k in range(N):
            reaction[k], share[k] = _positive(xn[k], rounding[i, 0])
            cycle.status[i, k] = STICK if xn[k] > 0.0 else SEPARATED
        analyse(projection, reaction, cycle.r[i, 0])
        cycle.kind[i, 0] = _normal_derivative(projection, transposed, share, weighted, cycle.nn[i])
        if mu[i] == 0.0:
            cycle.kind[i, 1] = OPEN
            cycle.r[i, 1] = 0.0
            continue
        memory = _friction(
            transposed,
            xt,
            reaction,
            share,
            (mu[i], rounding[i, 1] / np.sqrt(N), held[i, 0]),
            traction,
            by_normal,
            by_tangential,
        )
        analyse(projection, traction, cycle.r[i, 1])
        if cycle.kind[i, 0] == OPEN:
            cycle.kind[i, 1] = OPEN
        elif memory > 1.0 - NEARLY:
            cycle.kind[i, 1] = LINEAR
            for j in range(c):
                cycle.tt[i, 0, 0, j, j] = 1.0
        else:
            cycle.kind[i, 1] = CHANGING
            cycle.tn[i, 0] = np.dot(projection, by_normal)
            cycle.tt[i, 0, 0] = np.dot(projection, by_tangential)


@inlined_jit
def _positive(x, delta):
    """Rounded positive part and its derivative."""
    root = np.sqrt(x * x + 4.0 * delta * delta)
    value = 0.5 * (x + root) if x > 0.0 else 2.0 * delta * delta / (root - x)
    return value, 0.5 * (1.0 + x / root)


@jit
def _normal_derivative(projection, transposed, share, weighted, nn):
    """Derivative of a normal reaction, and its kind."""
    c, N = projection.shape
    nn[:] = 0.0
    if share.max() < NEARLY:
        return OPEN
    if share.min() > 1.0 - NEARLY:
        for j in range(c):
            nn[j, j] = 1.0
        return LINEAR
    for j in range(c):
        for k in range(N):
            weighted[j, k] = projection[j, k] * share[k]
    nn[:] = np.dot(weighted, transposed)
    return CHANGING


@jit
def _friction(transposed, xt, reaction, share, pair, traction, by_normal, by_tangential):
    """Traction of a pair and its derivatives at every sample; the share of its start that is remembered.

    `pair` is its friction, delta and `held`.
    """
    mu, delta, held = pair
    N, c = transposed.shape
    value, memory = xt[N - 1] - held, 1.0
    along_n, along_t = np.zeros(c), transposed[N - 1].copy()
    for sweep in range(2):
        for k in range(N):
            before = k - 1 if k > 0 else N - 1
            b = mu * reaction[k]
            y = value + xt[k] - xt[before]
            upper, to_upper = _positive(y + b, delta)
            lower, to_lower = _positive(y - b, delta)
            value = upper - lower - b
            kept = to_upper - to_lower
            pressed = (to_upper + to_lower - 1.0) * mu * share[k]
            memory *= kept
            for j in range(c):
                along_t[j] = kept * (along_t[j] + transposed[k, j] - transposed[before, j])
                along_n[j] = kept * along_n[j] + pressed * transposed[k, j]
            if sweep == 1:
                traction[k] = value
                by_normal[k] = along_n
                by_tangential[k] = along_t
    return memory

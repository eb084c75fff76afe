"""Compiled products with the matrices of contact problems, which take most of the time of a step.

They are bound by what is read: a tableau or a flexibility of two hundred pairs is 1.3 MB.
"""

from __future__ import annotations

import numpy as np

from microslip.contact.compiled import jit


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
def add_symmetric(M, x, out):
    """``out += M @ x`` for a symmetric M, of which only the lower triangle is read.

    Eight rows at a time, each entry used twice. Where most of x is zero whole rows are skipped instead.
    """
    n = x.shape[0]
    zeros = 0
    for i in range(n):
        if x[i] == 0.0:
            zeros += 1
    if 2 * zeros > n:
        add_rows(M, x, out)
        return
    whole = n - n % 8
    for i in range(0, whole, 8):
        a, b, c, d = M[i], M[i + 1], M[i + 2], M[i + 3]
        e, f, g, h = M[i + 4], M[i + 5], M[i + 6], M[i + 7]
        xa, xb, xc, xd = x[i], x[i + 1], x[i + 2], x[i + 3]
        xe, xf, xg, xh = x[i + 4], x[i + 5], x[i + 6], x[i + 7]
        sa, sb, sc, sd = 0.0, 0.0, 0.0, 0.0
        se, sf, sg, sh = 0.0, 0.0, 0.0, 0.0
        for j in range(i):
            y = x[j]
            out[j] += (xa * a[j] + xb * b[j] + xc * c[j] + xd * d[j]) + (
                xe * e[j] + xf * f[j] + xg * g[j] + xh * h[j]
            )
            sa += a[j] * y
            sb += b[j] * y
            sc += c[j] * y
            sd += d[j] * y
            se += e[j] * y
            sf += f[j] * y
            sg += g[j] * y
            sh += h[j] * y
        for p in range(i, i + 8):
            s = 0.0
            for q in range(i, i + 8):
                s += (M[p, q] if q <= p else M[q, p]) * x[q]
            out[p] += s
        out[i] += sa
        out[i + 1] += sb
        out[i + 2] += sc
        out[i + 3] += sd
        out[i + 4] += se
        out[i + 5] += sf
        out[i + 6] += sg
        out[i + 7] += sh
    for i in range(whole, n):
        row = M[i]
        s = 0.0
        for j in range(i):
            out[j] += x[i] * row[j]
            s += row[j] * x[j]
        out[i] += s + row[i] * x[i]

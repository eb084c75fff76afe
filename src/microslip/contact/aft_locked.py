"""Compiled friction of a spatial pair that sticks all cycle: the traction that it may have locked in.

A pair that never slips has ``r_t[k] = x_t[k] - h`` with a constant h, the ``eps_t v_t`` at which it
sticks. That is within the cone at every sample where

    |x_t[k] - h| <= b[k],    k = 0 .. N - 1,

so h lies in the common part of N discs. Friction leaves open where. Here it is the h nearest to `held`,
where the pair has stuck from the beginning: `held` itself where that is within all discs, else a point on
the edge of one disc or the corner of two. In the plane, where discs are intervals, that is what one cycle
of clips leaves. Where the discs have nothing in common the pair slips in every cycle.

The nearest point is found by adding one disc at a time, always the one that is missed by most: the new
point is on its edge, alone or with one of the discs before it (an LP-type problem of dimension two:
M. Sharir & E. Welzl, STACS 1992).
"""

from __future__ import annotations

import numpy as np

from microslip.contact.aft_normal import CHANGING, stick
from microslip.contact.compiled import jit

WITHIN = 1e-12
"""Share of the largest limit of friction by which a disc may be missed."""

FLATTEST = 1e-9
"""Sine of the corner of two discs from which on its derivative grows no more."""

MOST_CHANGES = 200


@jit
def nearest_place(xt, bound, held, place, edges):
    """The place nearest to `held` within all discs, into `place`, and the discs on whose edge it is.

    Returns how many those are, 0 to 2, or -1 where the discs have nothing in common.
    """
    N = bound.shape[0]
    slack = WITHIN * np.max(bound)
    place[:] = held
    count = 0
    for _ in range(MOST_CHANGES):
        worst, k = slack, -1
        for n in range(N):
            gap = np.hypot(xt[n, 0] - place[0], xt[n, 1] - place[1]) - bound[n]
            if gap > worst:
                worst, k = gap, n
        if k < 0:
            return count
        count = _with_disc(xt, bound, held, place, edges, count, k, 0.5 * slack)
        if count < 0:
            return -1
    return -1


@jit
def _with_disc(xt, bound, held, place, edges, count, k, slack):
    """Nearest place on the edge of disc k within it and the discs before; returns how many edges, or -1."""
    closest, partner = np.inf, -1
    best0, best1 = 0.0, 0.0
    away0, away1 = held[0] - xt[k, 0], held[1] - xt[k, 1]
    far = np.hypot(away0, away1)
    if far > 0.0:
        one = xt[k, 0] + bound[k] * away0 / far
        other = xt[k, 1] + bound[k] * away1 / far
        if _inside(xt, bound, edges, count, one, other, slack):
            closest = far - bound[k]
            best0, best1 = one, other
    if closest == np.inf:
        for e in range(count):
            i = edges[e]
            apart0, apart1 = xt[i, 0] - xt[k, 0], xt[i, 1] - xt[k, 1]
            D = np.hypot(apart0, apart1)
            if D == 0.0:
                continue
            along = (D * D + bound[k] ** 2 - bound[i] ** 2) / (2.0 * D)
            square = bound[k] ** 2 - along * along
            if square < 0.0:
                continue
            across = np.sqrt(square)
            for side in (-1.0, 1.0):
                one = xt[k, 0] + (along * apart0 - side * across * apart1) / D
                other = xt[k, 1] + (along * apart1 + side * across * apart0) / D
                distance = np.hypot(one - held[0], other - held[1])
                if distance < closest and _inside(xt, bound, edges, count, one, other, slack):
                    closest, partner = distance, i
                    best0, best1 = one, other
    if closest == np.inf:
        return -1
    place[0], place[1] = best0, best1
    edges[0] = k
    if partner < 0:
        return 1
    edges[1] = partner
    return 2


@jit
def _inside(xt, bound, edges, count, one, other, slack):
    """Whether a point is within the first `count` of the discs `edges`."""
    for e in range(count):
        n = edges[e]
        if np.hypot(xt[n, 0] - one, xt[n, 1] - other) > bound[n] + slack:
            return False
    return True


@jit
def lock(x, i, cycle, transposed, mu, xt, bound, held, place, edges, count):
    """Tractions of pair i, which sticks at `place`, and their derivatives.

    Places are counted from the mean of ``x_t``. With d the directions of the traction at the edges,

        one edge:    dh = dx_t - mu d dx_n - (b / |x_t - held|) (I - d d^T) dx_t
        a corner:    d · dh = d · dx_t - mu dx_n    at both
    """
    stick(x, held, i, cycle)
    for a in range(2):
        cycle.r[i, 1 + a, 0] = -place[a]
    if count == 0:
        return
    cycle.kind[i, 1:] = CHANGING
    D, back = np.empty((2, 2)), np.empty((2, 2))
    for e in range(count):
        for a in range(2):
            D[e, a] = (xt[edges[e], a] - place[a]) / bound[edges[e]]
    if count == 2:
        det = D[0, 0] * D[1, 1] - D[0, 1] * D[1, 0]
        det = max(det, FLATTEST) if det > 0.0 else min(det, -FLATTEST)
        back[0, 0], back[0, 1] = D[1, 1] / det, -D[0, 1] / det
        back[1, 0], back[1, 1] = -D[1, 0] / det, D[0, 0] / det
    for e in range(count):
        k = edges[e]
        share = bound[k] / np.hypot(xt[k, 0] - held[0], xt[k, 1] - held[1])
        for a in range(2):
            pull = D[0, a] if count == 1 else back[a, e]
            for j in range(x.shape[2]):
                cycle.tn[i, a, 0, j] += mu * pull * transposed[k, j]
            for b in range(2):
                slope = pull * D[e, b]
                if count == 1:
                    slope = (1.0 - share) * (1.0 if a == b else 0.0) + share * slope
                for j in range(x.shape[2]):
                    cycle.tt[i, a, b, 0, j] -= slope * transposed[k, j]

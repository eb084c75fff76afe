"""Compiled friction of planar pairs over a cycle; what it is for stands in `aft.py`.

With one tangential direction the projection is a clip,

    r_t[k] = clip(r_t[k-1] + x_t[k] - x_t[k-1],  -mu r_n[k], +mu r_n[k]).

Memory. One step is a shift followed by a clip, so the map over a whole period is a single clip, and
applying it twice is the same as once: *one* cycle erases the start, exactly. A second cycle is counted
from the last clipped sample, the *anchor*, whose traction is known. A pair that is never clipped sticks
for good; it keeps ``v_t`` at the value `held` that it has had from the beginning, ``r_t = x_t - held``.

Derivative. Over a run of sticking samples ``dr_t[k] = dx_t[k] - dx_t[a] + dr_t[a]`` with ``a`` the last
sample before the run, over a run of slip ``dr_t = ±mu dx_n``. Products of sines and cosines are sines and
cosines of sums and differences, and their sum over a run is the difference of two rows of a table
(`samples.SampleTable.sums`): the Jacobian costs per run, not per sample.
"""

from __future__ import annotations

import numpy as np

from microslip.contact.aft_normal import CHANGING, press, stick
from microslip.contact.compiled import jit
from microslip.contact.pairs import BACKWARD, FORWARD, SEPARATED, STICK
from microslip.contact.samples import add_run, analyse, synthesise


@jit
def all_planar_pairs(table, x, mu, held, drift, cycle):
    """Evaluate every pair into `cycle`, whose derivatives of friction are zero; always -1."""
    basis, projection, sums = table.basis, table.projection, table.sums
    r, tn, tt, td = cycle.r, cycle.tn, cycle.tt, cycle.td
    kind, status = cycle.kind, cycle.status
    N = basis.shape[1]
    xn, xt, bound, traction = np.empty(N), np.empty(N), np.empty(N), np.empty(N)
    since = np.empty(N)
    transposed = np.ascontiguousarray(basis.T)
    for i in range(x.shape[0]):
        state = status[i]
        closed = press(table, x, mu[i], i, cycle, xn, bound)
        if closed == 0:
            continue
        synthesise(basis, x[i, 1], xt)
        step = drift[i, 0] / N
        start = xt[0] - held[i, 0]
        if step != 0.0:
            start = np.inf if step > 0.0 else -np.inf
        anchor, side = _forget(xt, bound, start, step)
        if anchor < 0 and closed < N:
            anchor = 0
            while state[anchor] != SEPARATED:
                anchor += 1
        if anchor < 0:
            stick(x, held[i], i, cycle)
            continue
        kind[i, 1] = CHANGING
        _friction(xt, bound, anchor, side, step, traction, state)
        analyse(projection, traction, r[i, 1])
        friction_derivative(transposed, sums, mu[i], state, anchor, tn[i, 0], tt[i, 0, 0])
        steps_since_slip(state, anchor, since)
        analyse(projection, since, td[i, 0, 0])
    return -1


@jit
def _forget(xt, bound, start, step):
    """One cycle from the traction `start`: the last clipped sample and its side, or (-1, 0)."""
    N = xt.shape[0]
    anchor = -1
    side = 0.0
    traction = start
    before = xt[0]
    for k in range(N):
        traction += xt[k] - before + step
        before = xt[k]
        b = bound[k]
        if traction > b:
            traction = b
            anchor = k
            side = 1.0
        elif traction < -b:
            traction = -b
            anchor = k
            side = -1.0
    return anchor, side


@jit
def _friction(xt, bound, anchor, side, step, traction, state):
    """Periodic traction from the anchor round to itself; `state` knows who is separated."""
    N = xt.shape[0]
    value = side * bound[anchor]
    traction[anchor] = value
    if state[anchor] != SEPARATED:
        state[anchor] = FORWARD if side > 0.0 else BACKWARD
    before = xt[anchor]
    for j in range(1, N):
        k = anchor + j
        if k >= N:
            k -= N
        value += xt[k] - before + step
        before = xt[k]
        b = bound[k]
        if value > b:
            value = b
            if state[k] != SEPARATED:
                state[k] = FORWARD
        elif value < -b:
            value = -b
            if state[k] != SEPARATED:
                state[k] = BACKWARD
        traction[k] = value


@jit
def friction_derivative(basis, sums, mu, state, anchor, tn, tt):
    """Sum the derivative over runs of equal state, from the anchor round to itself."""
    N = state.shape[0]
    c = tt.shape[0]
    first = anchor
    before = anchor
    slope = 0.0
    done = 0
    while done < N:
        last = first + 1
        while last < N and last - first + done < N and state[last] == state[first]:
            last += 1
        kind = state[first]
        if kind == STICK:
            add_run(tt, sums, first, last, N, 1.0)
            origin = basis[before]
            for i in range(c):
                kind_i, h = (0, i // 2) if i % 2 == 0 else (1, (i + 1) // 2)
                weight = (sums[last, kind_i, h] - sums[first, kind_i, h]) * (2.0 if i else 1.0) / N
                for j in range(c):
                    tt[i, j] -= weight * origin[j]
                    tn[i, j] += slope * weight * origin[j]
        else:
            slope = 0.0
            if kind != SEPARATED:
                slope = mu if kind == FORWARD else -mu
                add_run(tn, sums, first, last, N, slope)
            before = last - 1
        done += last - first
        first = last if last < N else 0


@jit
def steps_since_slip(state, anchor, since):
    """Sticking samples since the last that did not stick, as a share of the cycle."""
    N = state.shape[0]
    count = 0
    for j in range(N):
        k = anchor + j
        if k >= N:
            k -= N
        count = count + 1 if state[k] == STICK else 0
        since[k] = count / N

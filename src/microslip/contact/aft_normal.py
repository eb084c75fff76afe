"""Compiled normal contact of a pair over a cycle, and its friction where it only sticks.

What `aft_planar.py` and `aft_spatial.py` have in common; what it is for stands in `aft.py`.
"""

from __future__ import annotations

from microslip.contact.compiled import jit
from microslip.contact.pairs import FORWARD, SEPARATED, STICK
from microslip.contact.samples import add_run, analyse, synthesise

OPEN, LINEAR, CHANGING = 0, 1, 2
"""Kinds of a component over the cycle: its reaction is zero throughout; its reaction is the augmented
force throughout (touching, sticking); anything else."""


@jit
def press(table, x, mu, i, cycle, xn, bound):
    """Normal reactions of pair i into `cycle`, and the limits of its friction at every sample.

    Returns how many samples are closed, or 0 where the pair has no friction; then all of it is said.
    """
    r, kind, state = cycle.r, cycle.kind, cycle.status[i]
    N = xn.shape[0]
    synthesise(table.basis, x[i, 0], xn)
    closed = _normal(xn, table.sums, cycle.nn[i], state, bound)
    kind[i, 0] = LINEAR if closed == N else (OPEN if closed == 0 else CHANGING)
    analyse(table.projection, bound, r[i, 0])
    if closed == N:
        r[i, 0] = x[i, 0]
    if closed == 0 or mu == 0.0:
        kind[i, 1:] = OPEN
        r[i, 1:] = 0.0
        for k in range(N):
            if state[k] != SEPARATED:
                state[k] = FORWARD
        return 0
    for k in range(N):
        bound[k] *= mu
    return closed


@jit
def stick(x, place, i, cycle):
    """Tractions of pair i, which never slips from its `place`: ``r_t = x_t - place``."""
    for a in range(place.shape[0]):
        cycle.kind[i, 1 + a] = LINEAR
        cycle.r[i, 1 + a] = x[i, 1 + a]
        cycle.r[i, 1 + a, 0] -= place[a]
        for j in range(x.shape[2]):
            cycle.tt[i, a, a, j, j] = 1.0


@jit
def _normal(xn, sums, nn, state, reaction):
    """Positive part of the normal force; returns how many samples are closed."""
    N = xn.shape[0]
    closed = 0
    for k in range(N):
        touching = xn[k] > 0.0
        reaction[k] = xn[k] if touching else 0.0
        state[k] = STICK if touching else SEPARATED
        closed += touching
    normal_derivative(sums, nn, state, closed)
    return closed


@jit
def normal_derivative(sums, nn, state, closed):
    """Derivative of a normal reaction that is the augmented force at the `closed` samples that touch."""
    N = state.shape[0]
    nn[:] = 0.0
    if closed == N:
        for j in range(nn.shape[0]):
            nn[j, j] = 1.0
    elif closed > 0:
        first = 0
        while first < N:
            touching = state[first] != SEPARATED
            last = first + 1
            while last < N and (state[last] != SEPARATED) == touching:
                last += 1
            if touching:
                add_run(nn, sums, first, last, N, 1.0)
            first = last

"""Compiled: how the contact problem of a time step differs from the last one, in a few shapes.

From one step to the next the free displacement changes by what the modes and the load are about to do, and by
the lag of the residual part s (`timestep.py`), which follows what has just moved,

    dv_free = sum_j (dp_j + (d_1 deta_j + d_2 deta_j,-1)/d_0) psi_j + drive dA/d_0 - (d_1 dv + d_2 dv_-1)/d_0

with p the modes at the end of a step without its reactions, since ``ds = dv - sum_j psi_j deta_j``. dv is
that of the pairs that have slipped or opened: few of these does the tableau hold. Its answers
to the shapes psi and drive are kept, and follow each exchange as its solution does; so a new solution begins
with a sum of these and a few columns, instead of a product with the whole tableau.

The certificate knows nothing of it: it is taken from the whole free displacement. What rounding has left at
pairs that touch is corrected once it is a tenth of the tolerance, with a product with the whole tableau.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from microslip.contact.compiled import jit
from microslip.contact.pairs import SEPARATED, STICK
from microslip.contact.products import add_rows
from microslip.contact.tableau import ANSWERED, LOOSE, STEERED
from microslip.typing import Array

SETTLED = 3
"""Steps of a march after which what has moved before is known: it may begin anywhere."""


class Steering(NamedTuple):
    """What the last steps of a march have done, changed in place.

    Attributes
    ----------
    predicted : (k,) array
        Modes at the end of the step that was solved last, without its reactions.
    turned, turned_before : (k,) arrays
        Changes deta of the modes over the last step and the one before.
    moved, moved_before : (2 m,) arrays
        Changes dv of the relative displacements.
    gap : (m,) array
        Of the pairs that are open.
    steps : (1,) int array
        Taken so far.
    """

    predicted: Array
    turned: Array
    turned_before: Array
    moved: Array
    moved_before: Array
    gap: Array
    steps: NDArray[np.int64]


@jit
def steering(modes, pairs, dimension):
    """At the begin of a march."""
    n = dimension * pairs
    return Steering(
        np.zeros(modes),
        np.zeros(modes),
        np.zeros(modes),
        np.zeros(n),
        np.zeros(n),
        np.zeros(pairs),
        np.zeros(1, np.int64),
    )


@jit
def steer(memory, lags, known, predicted, raised, again):
    """Tell the solver by how much the next problem differs from its last one.

    `raised` is the change of the load; `again` says that it is the same step with other modes.
    """
    shares, k = memory.shares, predicted.shape[0]
    if shares.shape[0] == k + 1 and known.steps[0] >= SETTLED:
        d0, d1, d2 = 1.0 + lags[0], lags[1], lags[2]
        memory.moved[:] = 0.0
        for j in range(k):
            shares[j] = predicted[j] - known.predicted[j]
        shares[k] = 0.0
        if not again:
            for j in range(k):
                shares[j] += (d1 * known.turned[j] + d2 * known.turned_before[j]) / d0
            shares[k] = raised / d0
            for i in range(memory.moved.shape[0]):
                memory.moved[i] = -(d1 * known.moved[i] + d2 * known.moved_before[i]) / d0
        memory.flags[STEERED] = True
    known.predicted[:] = predicted


@jit
def learn(memory, known, status, slip, before, now):
    """Learn from a step that was taken: displacements from where pairs stick, modes before and now."""
    if memory.shares.shape[0] != now.shape[0] + 1:
        return
    for j in range(now.shape[0]):
        known.turned_before[j] = known.turned[j]
        known.turned[j] = now[j] - before[j]
    for i in range(status.shape[0]):
        n, t = 2 * i, 2 * i + 1
        known.moved_before[n], known.moved_before[t] = known.moved[n], known.moved[t]
        gap = slip[n] if status[i] == SEPARATED else 0.0
        known.moved[n] = gap - known.gap[i]
        known.moved[t] = 0.0 if status[i] == STICK else slip[t]
        known.gap[i] = gap
    known.steps[0] += 1


@jit
def not_steered(memory, lags, known, predicted, raised, again):
    """Spatial problems are solved from the whole change."""


@jit
def not_learned(memory, known, status, slip, before, now):
    """Spatial problems are solved from the whole change."""


@jit
def steered(problem, memory, contact, c, weights):
    """Unknowns of the tableau's states into c, from the last solution and the change that was told.

    Slips are counted from where pairs stick: none but where a step is solved again. Gaps of pairs that touch
    are rounding, and left, until the last solution was loose.
    """
    mu, mean = problem.friction, problem.mean
    Dt, held, sign, moved = memory.transposed, memory.held, memory.sign, memory.moved
    status, r, v = contact.status, contact.r, contact.v
    loose = memory.flags[LOOSE]
    if not memory.flags[ANSWERED]:
        answer_shapes(memory)
    for i in range(mu.shape[0]):
        n, t = 2 * i, 2 * i + 1
        rn, rt = mean * r[n], mean * r[t]
        rest = rt - sign[i] * mu[i] * rn
        if abs(rest) <= 1e-15 * abs(rt):
            rest = 0.0
        gap = moved[n] + (v[n] if loose or status[i] == SEPARATED else 0.0)
        slip = moved[t] + (0.0 if status[i] == STICK else v[t])
        c[n], weights[n] = (rn, gap) if held[n] else (gap, rn)
        c[t], weights[t] = (rest, slip) if held[t] else (slip, rest)
    add_rows(Dt, weights, c)
    add_rows(memory.answers, memory.shares, c)


@jit
def answer_shapes(memory):
    """Answers of the tableau to the shapes, afresh."""
    shapes, held = memory.shapes, memory.held
    weights = shapes.copy()
    for j in range(shapes.shape[1]):
        if not held[j]:
            weights[:, j] = 0.0
    memory.answers[:] = np.dot(weights, memory.transposed)
    for j in range(shapes.shape[1]):
        if not held[j]:
            memory.answers[:, j] += shapes[:, j]
    memory.flags[ANSWERED] = True

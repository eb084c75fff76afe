"""Compiled tableau of a three-dimensional contact problem: the stiffness of the pairs that touch.

The equations of `spatial.py`, with ``M = [[W, -R], [R^T, K_q]]``, the displacements v counted from
those at which the pairs stick, and ``w`` what they would be without reactions,

    M (r, q) + (v, 0) = (w, f_q),

are kept solved for the reactions of the pairs that are *held* (those that touch, all three
components, and always q) and for the displacements of the others. With x these unknowns and g what is
left, the displacements of the held pairs and the reactions of the others,

    x = c - D g,

the principal pivotal transform of M: D holds the stiffness ``W_hh^-1`` of the held pairs with q
condensed, and the gaps that it leaves. A held pair that sticks and a free one that is open have ``g = 0``
and cost nothing. Slip has two unknowns, a held pair that opens and a free one that closes three each, until
`exchange` of `tableau.py` brings them into the tableau.

Reactions are in units of displacement, times the mean of the diagonal of W.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from microslip.contact.compiled import jit
from microslip.contact.pairs import SEPARATED, SLIP
from microslip.contact.tableau import MADE, WARM, exchange
from microslip.typing import Array, Mask, Status

RULES = 8
"""Ways in which a problem may have been solved, numbered in `spatial.py`."""


class Memory(NamedTuple):
    """What a spatial solver keeps from one solution to the next, changed in place.

    Attributes
    ----------
    transposed : (n, n) array
        D of the tableau, transposed; n = 3 m + e.
    held : (n,) bool array
        Components held in the tableau, all three of a pair or none.
    v_free, f_q : (3 m,) and (e,) arrays
        Of the last solution.
    r, q, v, status : arrays
        The last solution.
    direction : (m, 2) array
        Of the slip of each pair, unit vectors; zero where it is not known.
    resistance : (m,) array
        Force over slip across that direction, as the last linearisation had it, N/m.
    flags : (2,) bool array
        At `WARM` and `MADE` of `tableau.py`.
    solved : (8,) int array
        Problems by how they were solved, numbered as in `spatial.py`.
    changes : (1,) int array
        How often D has become another.
    images : (0, n) array
        As in `tableau.py`, of no modes.
    """

    transposed: Array
    held: Mask
    v_free: Array
    f_q: Array
    r: Array
    q: Array
    v: Array
    status: Status
    direction: Array
    resistance: Array
    flags: Mask
    solved: NDArray[np.int64]
    changes: NDArray[np.int64]
    images: Array


def memory(pairs: int, coordinates: int, modes: Array | None = None) -> Memory:
    """Arrays of a spatial solver, not yet valid: `restart` fills them. No modes are followed in space."""
    n = 3 * pairs + coordinates
    return Memory(
        transposed=np.zeros((n, n)),
        held=np.zeros(n, np.bool_),
        v_free=np.zeros(3 * pairs),
        f_q=np.zeros(coordinates),
        r=np.zeros(3 * pairs),
        q=np.zeros(coordinates),
        v=np.zeros(3 * pairs),
        status=np.full(pairs, SEPARATED, np.int8),
        direction=np.zeros((pairs, 2)),
        resistance=np.zeros(pairs),
        flags=np.zeros(2, np.bool_),
        solved=np.zeros(RULES, np.int64),
        changes=np.zeros(1, np.int64),
        images=np.zeros((0, n)),
    )


@jit
def dimension_of(memory):
    """Components per pair."""
    return 3


@jit
def follow_modes(memory, now, before):
    """No modes are followed in space."""


@jit
def signs(memory):
    """Slip in space has directions instead."""
    return memory.resistance[:0]


@jit
def pending(held, status, J):
    """Components of the pairs that touch or not other than in the tableau, into J; returns how many."""
    k = 0
    for i in range(status.shape[0]):
        if held[3 * i] != (status[i] != SEPARATED):
            for a in range(3):
                J[k] = 3 * i + a
                k += 1
    return k


@jit
def make(problem, memory, status):
    """Make the tableau afresh for given states. False where what touches does not hold the bodies."""
    W, R, stiffness, scale = problem.W, problem.R, problem.stiffness, problem.scale
    mean = problem.mean
    Dt, held, flags = memory.transposed, memory.held, memory.flags
    N, nr = R.shape
    for j in range(N):
        for i in range(N):
            Dt[j, i] = W[j, i] / mean
        for a in range(nr):
            Dt[j, N + a] = scale[a] * R[j, a] / mean
            Dt[N + a, j] = -scale[a] * R[j, a] / mean
    for a in range(nr):
        for i in range(nr):
            Dt[N + a, N + i] = 0.0
        Dt[N + a, N + a] = scale[a] * stiffness[a] * scale[a] / mean
    held[:] = False
    flags[:] = False
    memory.changes[0] += 1
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
def follow(problem, memory, status):
    """Make the memory fit for other states than those it was left with; the tableau follows by itself."""
    memory.flags[WARM] = False
    if not memory.flags[MADE]:
        restart(problem, memory, status)


@jit
def keep(memory, given, contact):
    """Take over a solution: the next problem starts from it."""
    memory.v_free[:] = given.v_free
    memory.f_q[:] = given.f_q
    memory.r[:] = contact.r
    memory.q[:] = contact.q
    memory.v[:] = contact.v
    memory.status[:] = contact.status
    memory.flags[WARM] = True


@jit
def forget_slip(memory, status):
    """States without a direction of slip: what slips is taken to stick until its motion is known."""
    for i in range(status.shape[0]):
        if status[i] != SLIP:
            memory.direction[i, 0] = 0.0
            memory.direction[i, 1] = 0.0
            memory.resistance[i] = 0.0

"""Compiled: what a tableau answers to deviations that follow a few modes, without multiplying by all of it.

From one step to the next, components that stay held move with the modes and with nothing else,

    w_h = Psi_h z + b_h

with shares z of each deviation in the modes, and b as it was before. So as long as the tableau stays the same

    D_h w_h = (D_h Psi_h) z + D_h b_h + D_J (w - Psi z - b)_J

where the last term has the components J that have changed, few at a time. Nothing rests on why few have:
what differs is looked for, and where much does, b becomes what w has beside the modes.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from microslip.contact.by_dimension import signs
from microslip.contact.compiled import jit
from microslip.contact.tableau import answer, by_modes
from microslip.typing import Array

ALIKE = 1e-13
"""Difference, over the displacements of all modes, that is rounding."""

MOST = 32
"""Components of which more are not multiplied one by one."""


class Answered(NamedTuple):
    """What was answered before, of p deviations, k modes and N components, changed in place.

    Attributes
    ----------
    to_modes : (k, N) array
        Answer to ``Psi_h``.
    most : (k,) array
        Largest displacement of each mode.
    rest, kept, to_kept : (p, N) arrays
        ``w_h - Psi_h z``, b, and its answer.
    signs : (m,) array
        Of the pairs, which the answers have.
    changes : (1,) int array
        Those of the memory that the answers are of; -1 before any.
    """

    to_modes: Array
    most: Array
    rest: Array
    kept: Array
    to_kept: Array
    signs: Array
    changes: NDArray[np.int64]


@jit
def nothing_answered(deviations, psi_t):
    """Arrays for so many deviations."""
    p, (k, N) = deviations, psi_t.shape
    if p == 0 or not by_modes(k, N):
        p, k, N = 0, 0, 0
    most = np.zeros(k)
    for j in range(k):
        most[j] = np.abs(psi_t[j]).max()
    return Answered(
        np.empty((k, N)),
        most,
        np.empty((p, N)),
        np.empty((p, N)),
        np.empty((p, N)),
        np.empty(N),
        np.full(1, -1),
    )


@jit
def _changed(held, rest, kept, size, J):
    """Components of which some deviation has another rest, into J; returns how many."""
    p, N = rest.shape
    differs = np.zeros(N, np.bool_)
    for a in range(p):
        slack = ALIKE * size[a]
        for i in range(N):
            differs[i] |= not abs(rest[a, i] - kept[a, i]) <= slack
    count = 0
    for i in range(N):
        if differs[i] and held[i]:
            J[count] = i
            count += 1
    return count


@jit
def _turn(memory, friction, known):
    """Let answers have the signs that pairs have been given since, as `tableau.turn` does."""
    now = signs(memory)
    for i in range(now.shape[0]):
        if now[i] == known.signs[i]:
            continue
        n, t = 2 * i, 2 * i + 1
        change = (now[i] - known.signs[i]) * friction[i]
        known.signs[i] = now[i]
        if memory.held[n]:
            for j in range(known.to_modes.shape[0]):
                known.to_modes[j, t] -= change * known.to_modes[j, n]
            for a in range(known.to_kept.shape[0]):
                known.to_kept[a, t] -= change * known.to_kept[a, n]


@jit
def answer_by_modes(memory, friction, psi_t, shares, w, weights, known, x):
    """As `tableau.answer`, from what was answered before; `shares` are z, rows for rows."""
    Dt, held = memory.transposed, memory.held
    to_modes, rest, kept, to_kept = known.to_modes, known.rest, known.kept, known.to_kept
    p, N = rest.shape
    if p == 0:
        answer(memory, w, weights, x)
        return
    np.dot(shares, psi_t, rest)
    size = np.dot(np.abs(shares), known.most)
    for a in range(p):
        for i in range(N):
            rest[a, i] = weights[a, i] - rest[a, i] if held[i] else 0.0
    J = np.empty(N, np.int64)
    count = N
    if known.changes[0] == memory.changes[0]:
        _turn(memory, friction, known)
        count = _changed(held, rest, kept, size, J)
    else:
        modes = np.zeros_like(to_modes)
        for i in range(N):
            if held[i]:
                modes[:, i] = psi_t[:, i]
        np.dot(modes, Dt, to_modes)
        now = signs(memory)
        known.signs[: now.shape[0]] = now
        known.changes[0] = memory.changes[0]
    if count > MOST:
        kept[:] = rest
        np.dot(kept, Dt, to_kept)
        count = 0
    np.dot(shares, to_modes, x)
    if count > 0:
        some, rows = np.empty((p, count)), np.empty((count, N))
        for b in range(count):
            rows[b] = Dt[J[b]]
            for a in range(p):
                some[a, b] = rest[a, J[b]] - kept[a, J[b]]
        x += np.dot(some, rows)
    for a in range(p):
        for i in range(N):
            x[a, i] += to_kept[a, i]
            if not held[i]:
                x[a, i] += w[a, i]

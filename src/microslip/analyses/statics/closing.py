"""Marching cycles until they close: whole ones, or halves of a joint that is its own image."""

from __future__ import annotations

from collections.abc import Callable
from typing import NamedTuple

import numpy as np

from microslip.analyses.statics.half_turn import HalfTurn
from microslip.contact.path import FRICTION, PathRecord
from microslip.typing import Array

RAMP = 10
"""Load steps from one cycle's start to another's."""

ROUNDING = 1e-10
"""Change of a reaction, over the largest at prestress, that is none."""

WALKS = 0.2
"""Share of its size by which the change from one half cycle to the next may vary in a walk."""


class ClosedCycle(NamedTuple):
    """The last cycle marched.

    Attributes
    ----------
    r, q : (s + 1, 2 m) and (s + 1, e) arrays
    dissipated : float
        Friction work, J per metre of width.
    residual : float
    change : float
        Largest change of a reaction per cycle, N per metre of width.
    turned : bool
        Whether the solver stands at the image of the end of the cycle.
    """

    r: Array
    q: Array
    dissipated: float
    residual: float
    change: float
    turned: bool


class Closure(NamedTuple):
    """When a cycle counts as closed.

    Attributes
    ----------
    share : float
        Change of a reaction per cycle, over what reactions vary by in it: small amplitudes move little.
    largest : float
        Reaction at prestress, N per metre of width, that stands for it where they vary by more.
    """

    share: float
    largest: float

    def closes(self, change: float, record: PathRecord) -> bool:
        """Whether a change is small beside what happened along a path."""
        varies = float(np.ptp(record.r, axis=0).max())
        limit = max(self.share * min(varies, self.largest), ROUNDING * self.largest)
        return change <= limit


def whole_cycle(
    march: Callable[[Array], PathRecord], path: Array, cycles: int, closure: Closure
) -> ClosedCycle:
    """March cycles until no reaction changes between them."""
    change, last = np.inf, None
    for _ in range(cycles):
        record = march(path)
        change = np.inf if last is None else float(np.abs(record.r - last).max())
        if closure.closes(change, record):
            break
        last = record.r
    work, residual = float(record.work[1:, :, FRICTION].sum()), float(record.residual.max())
    return ClosedCycle(record.r, record.q, work, residual, change, False)


def cycle_by_halves(
    turn: HalfTurn,
    march: Callable[[Array], PathRecord],
    path: Array,
    cycles: int,
    closure: Closure,
) -> ClosedCycle:
    """March half cycles until one ends in the image of its start, or changes as the one before did.

    What a half cycle does follows from where it starts, so that its ends say whether it closes; a change
    per half is half a change per cycle. A change that is the image of the one before it is a walk:
    further cycles would only walk on. The last of so many cycles begins with their last half but one.
    """
    half = len(path) // 2
    parts = path[: half + 1], path[half:]
    change, drift = np.inf, None
    for count in range(2 * cycles - 1):
        record = march(parts[count % 2])
        image = record.r[:, turn.rows]
        moved = record.r[-1] - image[0]
        change = 2 * float(np.abs(moved).max())
        walks = drift is not None and np.abs(moved - drift).max() <= WALKS * np.abs(moved).max()
        if closure.closes(change, record) or (walks and count > 1):
            break
        drift = moved[turn.rows]
    here, there = (record.r, record.q), (image, record.q @ turn.q.T)
    first, second = (here, there) if count % 2 == 0 else (there, here)
    return ClosedCycle(
        np.concatenate([first[0][:-1], second[0]]),
        np.concatenate([first[1][:-1], second[1]]),
        2 * float(record.work[1:, :, FRICTION].sum()),
        float(record.residual.max()),
        change,
        count % 2 == 0,
    )


def ramp(before: Array, after: Array) -> Array:
    """A straight path from one load to another, (RAMP + 1, p)."""
    return np.asarray(before + np.linspace(0, 1, RAMP + 1)[:, None] * (after - before))

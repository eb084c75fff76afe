"""Search for the fixed point of the period map: Newton's method, combinations of states, marching.

One cycle is marched together with small deviations of all soft modes and of the last changes of state,
which costs two to three cycles, and the search steps to the fixed point of the map so linearised
(`microslip.analyses.time.deviations`); what further cycles show corrects it. Deviations are marched
again where that no longer brings the motion closer.

Deviations are exact for the contact states as they are. Where pairs switch close to the fixed point
the map has no derivative, and steps lead nowhere. Then the last states are combined so that their
combined change is least (Anderson; Walker & Ni, SIAM J. Numer. Anal. 49 (2011) 1715); where that
stalls too, the motion is marched for a while, and it all begins again.
"""

from __future__ import annotations

import numpy as np

from microslip.analyses.time.deviations import Derivative, StateSpace
from microslip.analyses.time.scheme import March, State
from microslip.contact.tangent import Tangents
from microslip.typing import Array

SLOW = 0.4
"""Factor per cycle that the change must fall by, or deviations are marched again,"""

CLOSE, PATIENCE = 1e-3, 8
"""after so many cycles where the change is below this, at once where it is not."""

OTHERS = 4
"""Last changes over a cycle that are marched with the modes: tractions are in them."""

FARTHEST, NEAREST = 1.0, 0.2
"""Limits of the longest step over the size of the vibration: it is halved where a step has made the
change larger, and doubled where that has fallen to less than half."""

DEPTH = 10
"""States that are combined."""

LARGEST = 1e4
"""Largest share of a state in a combination."""

NEWTON, COMBINED, MARCHED = 0, 1, 2
"""Ways to the next cycle's start."""

CYCLES = (15, 40, 20)
"""Passages without a smaller change after which each way gives up; of marching, all, and twice as many each
time: what no extrapolation finds the motion itself comes close to."""

SMALLER = 0.7
"""A change below this share of the smallest so far is a smaller one."""


class Search:
    """Where the next cycle starts, and what is marched with it.

    Parameters
    ----------
    space : StateSpace
    accelerate : bool
        False marches.
    near : bool
        Whether it starts from a motion with its contact states, not from a guess of them: then no
        cycle is marched before the first deviations.
    known : Derivative, optional
        Of a motion close by, to begin with. Where the search is near as well, deviations are marched only if
        that brings it no closer.
    share : float
        Of a period that the map spans: a half, where a half turn makes it the next one.
    first : int
        Times that the map is marched before the first deviations, where it is not near; where there are
        more than one nothing else has come closer, and twice as many are marched when that is so again.
    """

    def __init__(
        self,
        space: StateSpace,
        accelerate: bool,
        near: bool,
        known: Derivative | None = None,
        share: float = 1.0,
        first: int = 1,
    ) -> None:
        self.space, self.accelerate, self.share = space, accelerate, share
        self.derivative = Derivative(space)
        self.plain: State | None = None
        self.way, self.left = (NEWTON, 0) if near or not accelerate else (MARCHED, first)
        self.marched = max(CYCLES[MARCHED], 2 * first if first > 1 else 0)
        self.best, self.waited = np.inf, 0
        self.reach, self.change = FARTHEST, np.inf
        self.nearest: State | None = None
        self.asked = False
        self._forget()
        if known is not None:
            self.derivative = known.of(space)
        self.trusted = near and known is not None
        self._prepare()

    def _forget(self) -> None:
        """Whatever was learned from states before."""
        self.derivative = Derivative(self.space)
        self.last: tuple[Array, Array] | None = None
        self.changes: list[Array] = []
        self.images: list[Array] = []
        self.renewed, self.age = np.inf, 0

    def _prepare(self) -> None:
        """Deviations to march with the next cycle, or none."""
        self.tangents: Tangents | None = None
        self.others = self.changes[-OTHERS:]
        wanted = self.asked or not self.derivative.known or self._slow()
        if self.accelerate and self.way == NEWTON and wanted:
            self.asked = False
            self.tangents = self.space.deviations(self.others)

    def renew(self) -> None:
        """Have deviations marched with the next cycle."""
        self.asked = True

    def again(self) -> State:
        """The last image of the period map, after a start whose cycle does not solve."""
        state, self.plain = self.plain, None
        assert state is not None
        self._forget()
        self.way, self.left = MARCHED, 1
        self._prepare()
        return state

    def next(self, before: State, cycle: March, change: float) -> State:
        """Start of the next cycle, after one from `before`."""
        after = self.plain = cycle.state
        if not self.accelerate:
            return after
        x, y = self.space.vector(before), self.space.vector(after)
        self._learn(x, y, cycle.tangents, change)
        if change < SMALLER * self.best:
            self.best, self.waited, self.nearest = change, 0, after
        self.waited += 1
        if self._turn():
            after = self.plain = self.nearest or after
            self._forget()
            self._prepare()
            return after
        if change > self.change:
            self.reach = max(0.5 * self.reach, NEAREST)
        elif change < 0.5 * self.change:
            self.reach = min(2 * self.reach, FARTHEST)
        self.change = change
        self._prepare()
        if self.way == NEWTON and self.derivative.known:
            longest = self.reach * float(np.linalg.norm(self.space.vibration(y - self.space.rest)))
            return self.space.state(y + self.derivative.correction(y - x, longest), after)
        if self.way == COMBINED:
            return self.space.state(y + self._combination(y), after)
        return after

    def _learn(self, x: Array, y: Array, marched: Tangents, change: float) -> None:
        """From a cycle that took x to y."""
        if self.tangents is not None:
            self.derivative.renew(marched, self.others)
            self.renewed, self.age = change, 0
        elif self.derivative.known and self.last is not None:
            self.derivative.correct(x - self.last[0], y - self.last[1])
            self.age += 1
        elif self.trusted:
            self.renewed, self.age = change, 0
        self.trusted = False
        self.last = (x, y)
        self.images = [*self.images, y][-DEPTH:]
        self.changes = [*self.changes, y - x][-DEPTH:]

    def _turn(self) -> bool:
        """Whether another way begins."""
        if self.way == MARCHED:
            self.left -= 1
            if self.left > 0:
                return False
            self.way, self.waited, self.best = NEWTON, 0, np.inf
            return False
        if self.waited <= CYCLES[self.way]:
            return False
        self.way = self.way + 1
        self.waited = 0
        if self.way == MARCHED:
            self.left, self.marched = self.marched, 2 * self.marched
        return True

    def _slow(self) -> bool:
        if self.age == 0 or (self.change < CLOSE and self.share * self.age < PATIENCE):
            return False
        return bool(self.change > self.renewed * SLOW ** (self.share * self.age))

    def _combination(self, y: Array) -> Array:
        """From the last image to the combination of the images whose combined change is least."""
        if len(self.changes) < 2:
            return np.zeros_like(y)
        changes = self.space.vibration(np.array(self.changes))
        shares = np.linalg.lstsq((changes[-1] - changes[:-1]).T, changes[-1], rcond=1e-8)[0]
        if np.abs(shares).max() > LARGEST:
            self.images, self.changes = self.images[-1:], self.changes[-1:]
            return np.zeros_like(y)
        return np.asarray(shares @ (np.array(self.images[:-1]) - y))

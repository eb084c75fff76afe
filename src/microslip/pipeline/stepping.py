"""What the time steps do to the steady states that a response is held to, and these without most of it.

Contact that changes its state inside a step makes errors that no formula tells; four times the steps do.
The states of a response that have settled are sought on with these, and the search goes on where they leave
it unsure. Where the first few show that the steps err by more than is wanted of the response, the search
begins anew with four times as many. Between frequencies the larger of two errors counts.
"""

from __future__ import annotations

from collections.abc import Container, Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field, replace
from typing import Any, NamedTuple

import numpy as np

from microslip.analyses.prepared.joint import PreparedJoint
from microslip.analyses.reduced.anchors import Anchor, anchor_at
from microslip.analyses.reduced.surface import LoadSurface
from microslip.pipeline.more_steps import FARTHEST, apart, more_steps
from microslip.pipeline.targets import REFINEMENT, STEPS, More, Stepped
from microslip.typing import Array

ACCURACY = 1e-3
"""Relative error of the amplitude that the steps are taken to make where that is not known."""

BEFORE = REFINEMENT / (REFINEMENT - 1)
"""Times what more steps change an amplitude by: its error with the fewer at most, where errors fall no faster
than with the number of steps."""


BEYOND = 2
"""Times `Stepping.more` steps with which the last motions of a branch are marched, where it ends."""

BY_INDEX = ("sought_on", "strays", "drifts", "varies", "watched", "off")
"""What is known of each state, by index of its frequency."""


class Refined(NamedTuple):
    """Steady states sought on, by index of their frequency.

    Attributes
    ----------
    amplitude : mapping of int to complex
        With more steps, where that is the same motion.
    error : (n,) array
        Relative error of the amplitudes that the steps make, at every frequency of the response.
    """

    amplitude: Mapping[int, complex]
    error: Array


def taken(states: Mapping[int, Stepped], found: Mapping[int, complex | None]) -> dict[int, complex]:
    """First harmonics with more steps, where these have settled and are the same motion."""
    amplitudes = {k: found.get(k) for k in states}
    return {
        k: Q for k, Q in amplitudes.items() if Q is not None and _changed(states[k], Q) <= FARTHEST
    }


def _changed(one: Stepped, Q: complex) -> float:
    """By how much the amplitude of a state has changed, relative."""
    return apart(one.amplitude, Q)


@dataclass
class Stepping:
    """What more steps do to the states of a response, by index of their frequency, as it becomes known.

    Attributes
    ----------
    steps : int
        Per cycle, of the states with the fewest.
    unknown : float
        The error of the amplitude where nothing is known.
    sought_on : dict of int to (complex or None)
        First harmonics with more steps; None where they do not settle.
    strays : dict of int to float
        How far motions stray from unstable ones of these states, relative; infinite where they leave.
    drifts : dict of int to float
        How far the means of those may drift that are marched with more steps and stay, relative.
    varies : dict of int to float
        How far the size of motions beside those varies for good, relative.
    watched : dict of int to int
        See `microslip.pipeline.targets.More`.
    off : dict of int to float
        What states with the fewest steps that have been replaced have turned out to be off by, relative.
    cycles : int
        Spent, of the fewest steps.
    """

    steps: int = STEPS
    unknown: float = ACCURACY
    sought_on: dict[int, complex | None] = field(default_factory=dict)
    strays: dict[int, float] = field(default_factory=dict)
    drifts: dict[int, float] = field(default_factory=dict)
    varies: dict[int, float] = field(default_factory=dict)
    watched: dict[int, int] = field(default_factory=dict)
    off: dict[int, float] = field(default_factory=dict)
    cycles: int = 0

    @property
    def more(self) -> int:
        """`REFINEMENT` times as many."""
        return REFINEMENT * self.steps

    def seek_on(self, joint: PreparedJoint, load: float, states: Mapping[int, Stepped]) -> None:
        """Seek those states on with more steps that are not yet."""
        new = {k: one for k, one in states.items() if k not in self.sought_on}
        for k, more in self._asked(joint, load, new):
            self.keep(k, more)

    def march_on(
        self, joint: PreparedJoint, load: float, states: Mapping[int, Stepped]
    ) -> set[int]:
        """March states with more steps, whether they have settled or not; of which of them that has told."""
        moving, told = {k: one._replace(varies=True) for k, one in states.items()}, set[int]()
        for k, more in self._asked(joint, load, moving):
            if more.amplitude is not None or not np.isfinite(more.strays):
                if not more.watched:  # what it will come to was seen no better than before
                    more = more._replace(strays=max(more.strays, self.strays.get(k, 0.0)))
                self.keep(k, more)
                told.add(k)
        return told

    def march_ends(
        self, joint: PreparedJoint, load: float, states: Mapping[int, Stepped]
    ) -> set[int]:
        """March states with `BEYOND` times `more` steps; those that leave then.

        What stays is what it was with fewer, and strays from that by as much as it is off.
        """
        steps, left = BEYOND * self.steps, set[int]()
        finer = {k: one._replace(steps=steps, varies=True) for k, one in states.items()}
        for k, more in self._asked(joint, load, finer):
            own = self.sought_on.get(k) or states[k].amplitude
            off = 0.0 if more.amplitude is None else apart(own, more.amplitude) + more.strays
            if not np.isfinite(more.strays):
                self.keep(k, more)
                left.add(k)
            elif off > ACCURACY:
                self.strays[k] = max(self.strays.get(k, 0.0), off)
                self.varies[k] = max(self.varies.get(k, 0.0), more.varies)
        return left

    def _asked(
        self, joint: PreparedJoint, load: float, states: Mapping[int, Stepped]
    ) -> Iterator[tuple[int, More]]:
        """What states become with more steps, one after the other, and what each has cost."""
        for k, more in more_steps(joint, load, states):
            self.cycles += more.cycles * (states[k].steps // self.steps)
            yield k, more

    def keep(self, k: int, more: More) -> None:
        """What a state has become with more steps."""
        self.sought_on[k] = more.amplitude
        self.strays[k], self.drifts[k], self.varies[k] = more.strays, more.drifts, more.varies
        self.watched[k] = more.watched

    def forget(self, k: int) -> None:
        """That a state was sought on."""
        self.sought_on.pop(k, None)
        for known in (self.strays, self.drifts, self.varies, self.watched):
            known.pop(k, None)

    def err_by_more(self, states: Mapping[int, Stepped], wanted: float) -> bool:
        """Whether the steps put a state off by more than is wanted of the response, relative.

        States between which a search looks for more are no better known then than what it is to find.
        """
        return any(change > wanted for change in self._changes(states).values())

    def staying(self, states: Iterable[int]) -> set[int]:
        """Which of these were marched with more steps, and stay."""
        return {k for k in states if self.drifts.get(k)}

    def copied(self) -> Stepping:
        """With what it knows of each state in mappings of its own."""
        own: dict[str, Any] = {name: dict(getattr(self, name)) for name in BY_INDEX}
        return replace(self, **own)

    def anew(self, states: Mapping[int, Stepped]) -> Stepping:
        """Of a search begun anew with more steps: the largest error that states with these have alone."""
        left = [change / (REFINEMENT - 1) for change in self._changes(states).values()]
        return Stepping(self.more, max([ACCURACY, *left]), cycles=self.cycles // REFINEMENT)

    def _changes(self, states: Mapping[int, Stepped]) -> dict[int, float]:
        """What more steps change the amplitudes of states by that are the same motion, and a steady one."""
        known = taken(states, self.sought_on).items()
        return {k: _changed(states[k], Q) for k, Q in known if not self.strays.get(k)}

    def replaced(self, k: int, few: complex, more: complex) -> None:
        """Learn what a state with the fewest steps was off by, from the first harmonic instead of it."""
        self.off[k] = BEFORE * apart(few, more)


def refined(
    states: Mapping[int, Stepped], known: Stepping, others: Sequence[int], count: int
) -> Refined:
    """Steady states with more steps, and what is left of the error of the steps at every frequency.

    Where errors fall no faster than with the number of steps, k times as many that change an amplitude by d
    leave d/(k - 1), and there was d k/(k - 1) before. The latter counts, the larger to either side of those
    with as many steps, for states that are not sought on or do not settle; with k times as many, that over k,
    as of a motion that beats and whose mean is that with more steps.

    Parameters
    ----------
    states : mapping of int to Stepped
        Settled, by index of their frequency.
    known : Stepping
        What they have become with more steps.
    others : sequence of int
        Frequencies of other steady states of the response, with the fewest steps.
    count : int
        Frequencies of the response.
    """
    amplitude = taken(states, known.sought_on)
    # what beats about an unstable motion says nothing of the steps
    steady = [k for k in states if not known.strays.get(k)]
    settled = {k: Q for k in steady if (Q := known.sought_on.get(k)) is not None}
    before = {k: BEFORE * _changed(states[k], Q) for k, Q in settled.items()}
    left = {k: before[k] / REFINEMENT if k in amplitude else before[k] for k in before}
    finer = {k for k, one in states.items() if one.steps > known.steps}
    same = {k: e for k, e in before.items() if k in amplitude}
    few, more = _few_and_more(known.off, before, finer)
    beside_few, beside_more, beside_same = (
        _larger_beside(one, count, known.unknown)
        # what becomes another motion says nothing of the steps of those that do not
        for one in (few, more, _few_and_more(known.off, same, finer)[1])
    )
    for k in {*states, *others} - set(left):
        beside = beside_same if k in amplitude else beside_more if k in finer else beside_few
        left[k] = float(beside[k])
    return Refined(amplitude, _larger_beside(left, count, known.unknown))


def _few_and_more(
    off: Mapping[int, float], before: Mapping[int, float], finer: Container[int]
) -> tuple[dict[int, float], dict[int, float]]:
    """Errors of states with the fewest steps, and of states with more: known of some, of others a share."""
    few = {**off, **{k: e for k, e in before.items() if k not in finer}}
    more = {k: e / REFINEMENT for k, e in few.items()}
    return few, more | {k: e for k, e in before.items() if k in finer}


def refined_anchors(
    surface: LoadSurface,
    load: float,
    anchors: Mapping[int, Anchor],
    states: Mapping[int, Stepped],
    known: Stepping,
) -> tuple[dict[int, Anchor], Array]:
    """Anchors, those that have settled with more steps, and the error of the steps at every frequency.

    Parameters
    ----------
    surface : LoadSurface
        At the frequencies of the response.
    load : float
    anchors : mapping of int to Anchor
        By index of their frequency.
    states, known
        Those that have settled, and what they have become with more steps; see `refined`.
    """
    others = [k for k in anchors if k not in states]
    better = refined(states, known, others, len(surface.frequency))
    kept = dict(anchors)
    for k, Q in better.amplitude.items():
        old = anchors[k]
        anchor = anchor_at(surface, old.frequency, load, Q, old.change, old.doubt, old.past)
        kept[k] = replace(anchor, scatter=old.scatter, varies=old.varies)
    return kept, better.error


def _larger_beside(values: Mapping[int, float], count: int, unknown: float) -> Array:
    """At every index the larger of the values to either side; its own where it has one."""
    if not values:
        return np.full(count, unknown)
    known = np.array(sorted(values))
    y = np.array([values[int(k)] for k in known])
    every, last = np.arange(count), len(known) - 1
    right = np.clip(np.searchsorted(known, every), 0, last)
    left = np.clip(np.searchsorted(known, every, side="right") - 1, 0, last)
    return np.asarray(np.maximum(y[left], y[right]))

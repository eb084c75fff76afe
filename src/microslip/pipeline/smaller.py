"""Smaller motions that repeat, where the larger of several does not.

A response shows the larger of several motions. Where that varies from cycle to cycle for good, or motions
leave it, no amplitude is the answer as well as is asked for. Another motion may repeat there: the one that
raising the load from rest leads to, as it does for a point over time. Where that is another branch it is
shown instead. It is sought in a search of its own, which does not follow larger motions; with more steps
where with few the load leads to one that is left with more.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from itertools import pairwise
from typing import NamedTuple, TypeGuard

import numpy as np

from microslip.analyses.prepared.joint import PreparedJoint
from microslip.analyses.reduced.surface import Contours
from microslip.analyses.time.offset import BRANCH
from microslip.pipeline.choosing import AT_A_TIME, may_be_apart, target_at, to_march_on
from microslip.pipeline.doubts import variation
from microslip.pipeline.marched import raised_and_marched
from microslip.pipeline.neighbours import around
from microslip.pipeline.search import Search
from microslip.pipeline.stepping import Stepping
from microslip.pipeline.targets import REFINEMENT, Found, Lost, Target
from microslip.pipeline.walk import sought
from microslip.typing import Array, Indices, Mask

SHARE = 0.25
"""Of what a search may cost, what this may on top."""

WIDE = 8
"""Frequencies between two from which on the load is raised at three of them."""

UNKNOWN = "no smaller motion is known as well as is wanted"
"""Why there is none."""

BETWEEN = "between a smaller motion and a larger one, which does not repeat"
"""Why there is none where these meet."""


class Outgrown(NamedTuple):
    """Frequencies where a smaller motion is shown, as larger ones do not repeat.

    Attributes
    ----------
    low, high : float
        The first and the last of them, Hz.
    times : float
        How large the larger ones are at most, over that shown; nan where none of them has a size.
    """

    low: float
    high: float
    times: float

    def holds(self, frequency: Array) -> Mask:
        """Which of some frequencies, Hz, are among them."""
        return (self.low <= frequency) & (frequency <= self.high)


def with_smaller(
    joint: PreparedJoint,
    search: Search,
    guess: Contours,
    wanted: float,
    advance: Callable[[int], None],
) -> tuple[Search, tuple[Outgrown, ...]]:
    """What is known, with smaller motions that repeat where larger ones do not.

    Parameters
    ----------
    joint : PreparedJoint
    search : Search
        Of the larger motions; it stays as it is.
    guess : Contours
        Of the refined model.
    wanted : float
        Relative error.
    advance : callable
        Told how many points have been sought.
    """
    shown, told, sought_here = search, list[Outgrown](), list[Search]()

    def spent() -> bool:
        count = sum(low.count for low in sought_here)
        seconds = max((low.seconds for low in sought_here), default=0.0)
        return count >= SHARE * search.points or seconds >= SHARE * search.may_take

    def begun(ends: tuple[int, int], sizes: Array, steps: int) -> Search:
        unknown = search.stepping.unknown
        low = Search(search.surface, search.base, search.points, Stepping(steps, unknown))
        sought_here.append(low)
        for k in _seeds(*ends):
            # what motions leave with more steps says that the steps matter there
            if low.anchors or low.lost or spent():
                break
            _begin(joint, low, k, sizes, wanted)
        return low

    done = set[tuple[int, int]]()
    # a larger motion beside a smaller one may turn out to be left
    while todo := [ends for ends in stretches(shown, wanted) if ends not in done]:
        for ends in todo:
            done.add(ends)
            sizes = _sizes_that_vary(shown, *ends, wanted)
            low = begun(ends, sizes, search.steps)
            if low.lost and REFINEMENT * low.seconds < SHARE * search.may_take:
                low = begun(ends, sizes, search.stepping.more)
            if not low.anchors:
                continue
            while not spent() and (picks := _unknown(low, *ends, wanted)):
                _learn(joint, low, picks, sizes, guess, wanted)
                advance(len(picks))
            for run in _runs(low, *ends, wanted):
                instead = _instead(joint, shown, low, run, ends)
                if _known(instead, wanted) > _known(shown, wanted):
                    shown = instead
                    told.append(_outgrown(search, low, run))
    count = sum(low.count for low in sought_here)
    cycles, marched = (
        sum(getattr(low, name) * (low.steps // search.steps) for low in sought_here)
        for name in ("cycles", "marched")
    )
    shown = replace(
        shown.copied(),
        count=shown.count + count,
        spent=shown.spent + cycles,
        marched=shown.marched + marched,
        opens=shown.opens or any(low.opens for low in sought_here),
    )
    return shown, tuple(sorted(told))


def stretches(search: Search, wanted: float) -> list[tuple[int, int]]:
    """Pairs of indices between which motions vary for good by more than is wanted, or are left; widest first.

    Those next to them at which the motion is steady, and known as well as is wanted, and not the only one
    that is between others; before the first and after the last frequency where there is none.
    """
    error, moving = search.held().error, _varying(search, wanted)
    moving |= {k for k, one in search.lost.items() if one.left}
    steady = {k for k in set(search.anchors) - moving if error[k] <= wanted}
    marks = [-1, *search.marks, len(error)]
    sure = {-1, len(error), *steady}
    alone = {k for a, k, b in zip(marks, marks[1:], marks[2:], strict=False) if not sure & {a, b}}
    ends = np.array(sorted(sure - alone))
    after = np.searchsorted(ends, sorted(moving))
    found = [(int(ends[i - 1]), int(ends[i])) for i in dict.fromkeys(after.tolist())]
    return sorted(found, key=lambda one: one[0] - one[1])


def _varying(search: Search, wanted: float) -> set[int]:
    """Where what is shown varies for good by more than is wanted."""
    return {k for k, one in search.doubted().items() if one.varies > wanted}


def _seeds(left: int, right: int) -> list[int]:
    """Where the load is raised between two: raising it may lead to a smaller motion over a part alone."""
    parts = (0.5, 0.25, 0.75) if right - left > WIDE else (0.5,)
    return [left + round(part * (right - left)) for part in parts]


def _sizes_that_vary(search: Search, left: int, right: int, wanted: float) -> Array:
    """Of motions between two that vary for good by more than is wanted."""
    varying = [k for k in _varying(search, wanted) if left < k < right]
    return np.array([abs(search.anchors[k].amplitude) for k in varying])


def _begin(joint: PreparedJoint, low: Search, k: int, sizes: Array, wanted: float) -> None:
    """Learn of what raising the load at a frequency leads to, if that repeats and is none that varies.

    What leaves its branch with more steps is lost.
    """
    base = low.base
    target = Target(k, float(base.frequency[k]), base.load, 0j, steps=low.steps)
    (answer,) = raised_and_marched(joint, [target])
    low.marched += answer.cycles
    if _is_other(answer, sizes, wanted):
        low.keep(target, replace(answer, cycles=0))
        low.ended.add(k)
        low.refine(joint)


def _is_other(answer: Found | Lost, sizes: Array, wanted: float) -> TypeGuard[Found]:
    """Whether a motion is known as well as is wanted, and none of those that vary, by their sizes."""
    if isinstance(answer, Lost) or not answer.doubt <= wanted:
        return False
    return bool((np.abs(np.log(abs(answer.amplitude) / sizes)) > BRANCH).all())


def _unknown(low: Search, left: int, right: int, wanted: float) -> list[int]:
    """What to seek next between two: the first and the last, then the middles where most is not known."""
    marks = [k for k in low.marks if left < k < right]
    if beside := [k for k in dict.fromkeys((left + 1, right - 1)) if k not in marks]:
        return beside
    doubtful, weighed = ~(low.held().error <= wanted), list[tuple[int, int]]()
    widest = may_be_apart(low)
    for one, other in pairwise(marks):
        count = int(doubtful[one + 1 : other].sum())
        if (count or other - one > widest) and not low.lost.keys() >= {one, other}:
            weighed.append((count, (one + other) // 2))
    return [k for _, k in sorted(weighed, reverse=True)[:AT_A_TIME]]


def _learn(
    joint: PreparedJoint,
    low: Search,
    picks: list[int],
    sizes: Array,
    guess: Contours,
    wanted: float,
) -> None:
    """Seek motions from rest, and on with more steps."""
    now = low.held()
    targets = [target_at(low, k, guess, now, tuple(around(low.found, k))) for k in picks]
    for target, answer in zip(targets, sought(joint, targets), strict=True):
        if _is_other(answer, sizes, wanted):
            low.keep(target, answer)
        else:
            low.keep(target, Lost(UNKNOWN, answer.cycles, opens=answer.opens))
    low.refine(joint)


def _runs(low: Search, left: int, right: int, wanted: float) -> list[Indices]:
    """Frequencies next to each other between two at which smaller motions are known, from the first steady
    state to the last."""
    inside = np.arange(left + 1, right)
    known = inside[low.held().error[inside] <= wanted]
    runs = np.split(known, np.flatnonzero(np.diff(known) > 1) + 1)
    marks = [run[np.isin(run, list(low.anchors))] for run in runs]
    return [np.arange(one[0], one[-1] + 1) for one in marks if len(one)]


def _instead(
    joint: PreparedJoint, shown: Search, low: Search, run: Indices, ends: tuple[int, int]
) -> Search:
    """What is known with smaller motions at some frequencies, and whether larger ones beside these stay.

    Others are known no better than they were beside what varies.
    """
    new = shown.copied()
    new.put_back(set(run.tolist()), low)
    if low.steps > new.steps:
        new.finer |= low.anchors.keys() & run.tolist()
    for k in (run[0] - 1, run[-1] + 1):  # no branch goes on from one to the other
        if ends[0] < k < ends[1] and k not in new.anchors:
            new.lost.setdefault(int(k), Lost(BETWEEN, 0))
    before, now = shown.doubted(), new.doubted()
    for k in set(before) & set(now) - set(run.tolist()):
        if now[k].doubt < before[k].doubt:
            _doubt(new, k, before[k].doubt)
    new.take_refined()
    while moving := to_march_on(new):
        new.march_on(joint, moving)
    return new


def _doubt(search: Search, k: int, doubt: float) -> None:
    """Have a steady state known no better than that."""
    found, anchor = search.found[k], search.anchors[k]
    beside = doubt - variation(search.stepping, k, found) + found.varies
    search.found[k] = replace(found, doubt=max(found.doubt, beside))
    search.anchors[k] = replace(anchor, doubt=max(anchor.doubt, doubt))


def _known(search: Search, wanted: float) -> int:
    """Frequencies at which the response is known as well as is wanted."""
    return int((search.held().error <= wanted).sum())


def _outgrown(search: Search, low: Search, run: Indices) -> Outgrown:
    """How large larger motions are, over those shown at some frequencies."""
    f, small = search.base.frequency, {k: one for k, one in low.anchors.items() if k in run}
    larger = [k for k in search.anchors if k in run]
    nearest = {k: min(small, key=lambda j: abs(j - k)) for k in larger}
    times = [abs(search.anchors[k].amplitude) / abs(small[nearest[k]].amplitude) for k in larger]
    return Outgrown(float(f[run[0]]), float(f[run[-1]]), max(times, default=np.nan))

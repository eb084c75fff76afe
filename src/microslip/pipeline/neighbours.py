"""What lies next to what among steady states along a response: neighbours, and the larger sides of jumps."""

from __future__ import annotations

from bisect import bisect_left
from collections.abc import Collection, Container, Iterable, Iterator, Mapping
from itertools import pairwise

import numpy as np

from microslip.analyses.reduced.anchors import JUMP, Anchor, step_of
from microslip.analyses.time.offset import BRANCH
from microslip.typing import Array


def around(marks: Iterable[int], k: int) -> list[int]:
    """The marks next to an index, below it, and at it or above.

    Examples
    --------
    >>> around([3, 7, 5], 6), around([3, 7, 5], 5), around([3, 7, 5], 8), around([], 2)
    ([5, 7], [3, 5], [7], [])
    """
    ordered = sorted(marks)
    i = bisect_left(ordered, k)
    return ordered[max(i - 1, 0) : i + 1]


def far_between(marks: Iterable[int], most: float) -> list[int]:
    """Indices between marks that lie more than so many apart.

    Examples
    --------
    >>> far_between([8, 0, 3], 4), far_between([0, 3], 3)
    ([4, 5, 6, 7], [])
    """
    return [k for a, b in pairwise(sorted(marks)) if b - a > most for k in range(a + 1, b)]


def within_a_branch(anchors: Mapping[int, Anchor], lost: Iterable[int], k: int) -> bool:
    """Whether next to an index there are anchors on both sides, of one branch, and nothing that was lost."""
    beside = [anchors[j] for j in around({*anchors, *lost}, k) if j in anchors]
    return len(beside) == 2 and step_of(*beside) <= BRANCH


def leaving(
    anchors: Mapping[int, Anchor],
    error: Array,
    settled: Container[int],
    staying: Container[int] = (),
) -> list[int]:
    """Where motions may be on their way out, by index of the frequency.

    Past the end of a branch a motion lingers near where its states were, and falls to another branch after
    any number of cycles. So what has not settled is not known next to a jump, nor beyond up to the first that
    has, and neither is what lies between such states. Where motions have stayed for many cycles the first of
    them may linger still; the next that has as well does not.

    Parameters
    ----------
    anchors : mapping of int to Anchor
        Steady states, by index of the frequency.
    error : (n,) array
        Bound between them. Sizes jump from one to the next where these are neighbours, or where nothing
        bounds what lies between.
    settled : container of int
        Those that have settled.
    staying : container of int
        Those that have not, but have stayed.
    """
    found = set[int]()
    for way, outward in larger_sides(anchors, error):
        end = len(error) if way > 0 else -1
        stay = [k for k in outward if k in staying][1:2]
        first = next((k for k in outward if k in settled or k in stay), end)
        found.update(range(outward[0], first, way))
    return sorted(found)


def beside_unsteady(
    anchors: Mapping[int, Anchor], lost: Collection[int], known: Container[int]
) -> list[int]:
    """Where motions may be on their way to what is not steady, by index of the frequency.

    A motion that is still open beside one that is not steady at all may be the beginning of the same: it may
    wander for thousands of cycles, and then fall to another branch. So it is not known, nor what lies before
    the first that is.

    Parameters
    ----------
    anchors : mapping of int to Anchor
        States, by index of the frequency.
    lost : collection of int
        Where the motion is not steady.
    known : container of int
        Those that are not open.

    Examples
    --------
    >>> beside_unsteady(dict.fromkeys([2, 5, 7, 9]), [0], [7])
    [0, 1, 2, 3, 4, 5, 6]
    >>> beside_unsteady(dict.fromkeys([2, 5, 7, 9]), [0, 4], [2, 7, 9])
    [4, 5, 6]
    """
    found = set[int]()
    marks = sorted({*anchors, *lost})
    for way in (1, -1):
        reached = False
        for one, following in pairwise(marks[::way]):
            reached = one in lost or (reached and one not in known)
            both = (one, following)
            unknown = [k for k in both if k in anchors and k not in known]
            if reached and unknown:
                found.update(range(one, following, way), unknown)
    return sorted(found)


def larger_sides(
    anchors: Mapping[int, Anchor], error: Array, within: int = 1
) -> Iterator[tuple[int, list[int]]]:
    """The larger motions beside every jump, from it outward, and which way that is, 1 or -1.

    Parameters
    ----------
    anchors, error
        See `leaving`.
    within : int
        Frequencies from one to the next at most where something bounds what lies between; of more than one
        those alone whose sizes are of other branches.
    """
    marks = sorted(anchors)
    for i, (left, right) in enumerate(pairwise(marks)):
        apart = step_of(anchors[left], anchors[right])
        if right > left + 1 and np.isfinite(error[left + 1 : right]).all():
            jumps = right <= left + within and apart > BRANCH
        else:
            jumps = apart > JUMP
        if not jumps:
            continue
        rises = abs(anchors[right].amplitude) > abs(anchors[left].amplitude)
        yield (1, marks[i + 1 :]) if rises else (-1, marks[i::-1])

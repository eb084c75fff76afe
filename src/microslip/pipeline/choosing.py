"""Which steady states a response needs next: where it is least known, and what has to be marched.

The order in which `microslip.pipeline.auto` takes these is told there.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import replace
from itertools import pairwise, takewhile

import numpy as np

from microslip.analyses.reduced.anchors import JUMP, branches, step_of
from microslip.analyses.reduced.surface import Contours
from microslip.analyses.reduced.through_anchors import Held
from microslip.analyses.time.starts import Start
from microslip.analyses.time.staying import OPEN
from microslip.describe.requests import MARCHED_EACH
from microslip.pipeline.more_steps import STEADY
from microslip.pipeline.neighbours import around, far_between, larger_sides
from microslip.pipeline.search import Search
from microslip.pipeline.targets import STEPS, TOLERANCE, Target, known_rest
from microslip.typing import Array

FIRST = (0.0, -1.2, 1.2)
"""Detunings of the first anchors: the resonance, below and above half power. Then come the ends."""

LONG_AT_A_TIME = 2
"""Steady states sought at once with more steps from the beginning, or marched in the end: each takes long."""

AT_A_TIME = 4
"""Steady states sought at a time."""

BESIDE_LOST, BETWEEN_LOST = 0.5, 0.1
"""What frequencies count for beside one whose motion is not steady enough, and between two such."""

ALIKE = 0.25
"""Between two states whose sizes differ by less, in logarithm, the search starts from a mixture."""

GAP, UNSEEN = 1 / 16, 0.25
"""Share of the frequencies without a steady state among them that is not left so, whatever the bound says: a
resonance of an upper mode may hide there. They count for so much of those whose bound is too wide."""

NEXT, ENDS = 3, 8
"""Frequencies from one steady state to the next between which a jump is where a branch ends; and how many
such ends are marched at most."""

WALKING = 4
"""Motions that have not settled of which two are marched at once, before others are sought: how far they go
on is how well the others are known, and between motions that are no better known none is sought.
"""


def first(search: Search, guess: Contours) -> list[Target]:
    """Where the refined model has its resonance and half power, and the ends of the band."""
    u, chosen = guess.detuning, [0, len(search.base.frequency) - 1]
    if len(u):
        near = [int(np.argmin(np.abs(np.clip(t, u.min(), u.max()) - u))) for t in FIRST]
        chosen = [int(guess.point[j]) for j in near] + chosen
    now = search.held()
    return [target_at(search, k, guess, now) for k in dict.fromkeys(chosen)]


def ends(search: Search, guess: Contours) -> list[Target]:
    """The ends of the band, where they have not been sought."""
    now, marks = search.held(), search.marks
    chosen = [k for k in (0, len(search.base.frequency) - 1) if k not in marks]
    return [target_at(search, k, guess, now) for k in chosen]


def least_known(search: Search, guess: Contours, wanted: float, beside: Array) -> list[Target]:
    """Jumps to be followed, then the middles of the stretches where most is not known.

    The error of what is shown is that of the amplitude, and what the first output has `beside` it.
    """
    now, targets = search.held(), beside_larger(search, guess)
    marks, doubtful = search.marks, ~(now.of_mean + beside <= wanted)
    doubtful[marks] = False
    blurred = search.blurred(wanted)
    weighed, widest = list[tuple[float, int, int, int]](), may_be_apart(search)
    for left, right in pairwise(marks):
        unknown = int(doubtful[left + 1 : right].sum())
        gone = sum(k in search.lost or k in blurred for k in (left, right))
        if gone == 2 and right - left <= widest:  # what cannot be settled is marched
            continue
        weight = (1.0, BESIDE_LOST, BETWEEN_LOST)[gone]
        if unknown or right - left > widest:
            wanting = max(unknown, UNSEEN * (right - left))
            weighed.append((weight * wanting, (left + right) // 2, left, right))
    targets += _middles(search, guess, now, weighed)
    return _at_once(search, targets)


def beside_larger(search: Search, guess: Contours) -> list[Target]:
    """Motions with larger ones next to them, each once from each of these: as many as may be sought."""
    chosen = dict[int, int]()
    for k, beside in sorted(_jumps(search), key=lambda pair: -_size_in(search)(pair[1])):
        if beside not in search.origins.get(k, ()):
            chosen.setdefault(k, beside)
    if not chosen:
        return []
    now = search.held()
    # the larger first: what they become is what others start from
    targets = [
        replace(target_at(search, k, guess, now, (beside,)), cold=False)
        for k, beside in chosen.items()
        if beside not in chosen
    ]
    return _at_once(search, targets)


def anew(search: Search, guess: Contours, wanted: float) -> list[Target]:
    """Steady states that more steps leave unsure, and what was passed over where it is so, to be sought with
    these from the beginning; each once.

    What has settled with fewer need not lie where a search with more finds what it has become.
    """
    now, refined, targets = search.held(), search.refined, list[Target]()
    open_ = {*search.marks, *search.passed} - search.anew - search.unstable
    unsure = [k for k in open_ if not now.of_mean[k] <= wanted]
    # last what more steps alone do not make sure
    others = now.of_mean - search.accuracy
    unsure.sort(key=lambda k: (not others[k] <= wanted, -now.of_mean[k], k))
    for k in unsure[:LONG_AT_A_TIME]:
        beside = tuple(around(refined - {k}, k))
        anew = replace(target_at(search, k, guess, now, beside), steps=search.stepping.more)
        targets.append(anew)
    return targets[: max(search.points - search.count, 0)]


def between_refined(search: Search, guess: Contours, wanted: float) -> list[Target]:
    """The middles of the stretches between states with more steps, or known as well, where most is not known.

    Where what is there has been passed over, the middle of either half. Not between two that are themselves
    not known as well as is wanted, whatever those beside them are.
    """
    now, refined = search.held(), search.refined
    unsure, doubtful, weighed = vague(search, now, wanted), ~(now.of_mean <= wanted), []
    for left, right in pairwise(search.marks):
        unknown, middle = int(doubtful[left + 1 : right].sum()), (left + right) // 2
        ends = (left, right)
        sure = not unsure.issuperset(ends)
        sure = sure and all(k in refined or not doubtful[k] for k in ends)
        within = (middle, (left + middle) // 2, (middle + right) // 2)
        one = next((k for k in within if k not in {*ends, *search.passed}), None)
        if unknown and sure and one is not None:
            weighed.append((unknown, one, left, right))
    targets = _middles(search, guess, now, weighed)
    return _at_once(search, targets)


def vague(search: Search, now: Held, wanted: float) -> set[int]:
    """Steady states that would not be known as well as is wanted even if those next to them were."""
    known, found = search.doubted(), set[int]()
    for k, one in search.alone().items():
        others = (known[k].doubt - known[k].varies) - (one.doubt - one.varies)
        if not now.of_mean[k] - others <= wanted:
            found.add(k)
    return found


def _middles(
    search: Search, guess: Contours, now: Held, weighed: Sequence[tuple[float, int, int, int]]
) -> list[Target]:
    """Targets in the middle of stretches, from their weights, middles and ends; the heaviest first."""
    heaviest = sorted(weighed, reverse=True)
    return [target_at(search, k, guess, now, (left, right)) for _, k, left, right in heaviest]


def _at_once(search: Search, targets: list[Target]) -> list[Target]:
    """The first of some targets, as many as may be sought at a time."""
    return targets[: max(min(AT_A_TIME, search.points - search.count), 0)]


def to_march_on(search: Search) -> list[int]:
    """Motions beside jumps to be marched with more steps next, by index, each once.

    The larger ones, where none is known to stay. From the jump outward: two that stay next to each other are
    enough. Where one has left, what is between it and what stays is halved.
    """
    error, marks, chosen = search.through_anchors().error, sorted(search.anchors), list[int]()
    unknown, staying = set(search.leaving(error)), search.stepping.staying(search.settled)
    for way, outward in larger_sides(search.anchors, error):
        branch = next(run for run in branches(search.anchors, ()) if outward[0] in run)
        beside = list(takewhile(unknown.intersection(branch).__contains__, outward))
        if not beside:
            continue
        low, high = sorted((marks[marks.index(beside[0]) - way], beside[-1]))
        left = [k for k, one in search.lost.items() if one.left and low < k < high]
        beyond = [k for k in beside if all((k - j) * way > 0 for j in left)]
        stays = next((i for i, k in enumerate(beyond) if k in staying), len(beyond))
        before, after = (
            [k for k in some if k not in search.passed and k not in staying]
            for some in (beyond[:stays], beyond[stays + 1 :])
        )
        if before:
            halved = left or stays < len(beyond)
            chosen.append(before[len(before) // 2 if halved else 0])
        else:
            chosen += after[:1]
    return list(dict.fromkeys(chosen))[: max(search.points - search.count, 0)]


def unended(search: Search, wanted: float) -> list[Target]:
    """Motions to be marched to their end next, each once: where what one will come to is not known otherwise.

    It has not settled; or it has, and is as unsure as others have moved; or it was still on its way where it
    was pushed off what is unstable; or varies about that, and more steps do not find the former.
    """
    known, own, strays = search.alone(), search.anchors, search.stepping.strays
    sought_on = search.stepping.sought_on
    unsure = vague(search, search.held(), wanted) - search.tried - search.ended
    open_ = [
        k
        for k in unsure
        if own[k].change > TOLERANCE
        or known[k].doubt > own[k].doubt
        or strays.get(k, 0.0) - known[k].varies >= OPEN
        or (strays.get(k, 0.0) > STEADY and sought_on.get(k) is None)
    ]
    open_.sort(key=lambda k: (-known[k].doubt, k))
    return [_marched_target(search, k) for k in open_[:LONG_AT_A_TIME]]


def to_watch(search: Search, wanted: float) -> list[int]:
    """Settled motions to be marched with more steps next, by index, each once: they do not settle with these.

    Not unstable ones, which grow from where they are too slowly to see.
    """
    now, stepping = search.held(), search.stepping
    open_ = [
        k
        for k in vague(search, now, wanted) - search.passed - (search.tried - search.ended)
        if search.anchors[k].change <= TOLERANCE
        and stepping.sought_on.get(k) is None
        and stepping.strays.get(k, 0.0) <= STEADY
    ]
    open_.sort(key=lambda k: (-now.of_mean[k], k))
    return open_[:LONG_AT_A_TIME]


def ends_to_march(search: Search, wanted: float) -> list[int]:
    """The last motions of branches that end, by index, each once: where they are known as well as is wanted.

    Few steps may have a branch go on where more do not; not where there were more from the beginning.
    """
    if search.steps > STEPS:
        return []
    error = search.held().error
    sides = larger_sides(search.anchors, error, NEXT)
    last = {outward[0] for _, outward in sides if error[outward[0]] <= wanted} - search.firm
    return sorted(last)[: max(ENDS - len(search.firm), 0)]


def between_far(search: Search, guess: Contours) -> list[Target]:
    """The middles between steady states too far apart, the farthest first: as many as may be sought."""
    now, widest = search.held(), may_be_apart(search)
    apart = [(right - left, left, right) for left, right in pairwise(search.marks)]
    far = [(width, (a + b) // 2, a, b) for width, a, b in apart if width > widest]
    return _at_once(search, _middles(search, guess, now, far))


def unfilled(search: Search) -> list[int]:
    """What lies between steady states too far apart, by index: all may be spent before they are closer."""
    return far_between(search.marks, may_be_apart(search))


def may_be_apart(search: Search) -> float:
    """How many frequencies two steady states may be apart at most."""
    return max(GAP * len(search.base.frequency), 1)


def to_march(search: Search, wanted: float) -> list[Target]:
    """Steady states that are not known well, far from those marched so far, then what is flagged between.

    Not unstable ones, nor between these.
    """
    slow = search.seconds - search.following >= 2 * search.may_take
    if slow or search.marched >= MARCHED_EACH * search.points or search.count >= search.points:
        return []
    now, marched = search.held(), sorted(search.tried)
    unstable = search.unstable
    left = sorted((search.blurred(wanted) | set(search.lost)) - search.tried - unstable)
    chosen = [k for k in _may_leave(search, now) if not now.of_mean[k] <= wanted][:AT_A_TIME]
    left = [k for k in left if k not in chosen]
    while left and len(chosen) < AT_A_TIME:
        known = np.array([*marched, *chosen, *sorted(set(search.anchors) - set(left))])
        gaps = [int(np.abs(known - k).min()) if len(known) else k for k in left]
        chosen.append(left.pop(int(np.argmax(gaps))))
    if not chosen:
        doubtful = now.of_mean > wanted
        doubtful[[*search.marks, *search.tried]] = False
        weighed = sorted(
            (int(doubtful[left + 1 : right].sum()), (left + right) // 2)
            for left, right in pairwise(sorted({*search.marks, *search.tried}))
            if not {left, right} <= unstable
        )
        chosen = [k for count, k in weighed[::-1] if count][:AT_A_TIME]
    return [_marched_target(search, k) for k in chosen]


def walking(search: Search) -> list[Target]:
    """Some motions that have not settled, as soon as there are so many: how far they go on tells of all."""
    found = [k for k, one in search.anchors.items() if one.change > TOLERANCE]
    if len(found) < WALKING:
        return []
    found.sort()
    return [_marched_target(search, found[(2 * i + 1) * len(found) // 4]) for i in range(2)]


def _may_leave(search: Search, now: Held) -> list[int]:
    """The middle of those motions beside each jump that may be leaving: halves what is left of them."""
    found: list[int] = []
    for _, outward in larger_sides(search.anchors, now.error):
        settled = (j in search.tried or search.anchors[j].change <= TOLERANCE for j in outward)
        count = next((n for n, is_so in enumerate(settled) if is_so), len(outward))
        found += [outward[count // 2]] if count else []
    return list(dict.fromkeys(found))


def _marched_target(search: Search, k: int) -> Target:
    """A motion to be marched, from where it is known and where others beside it have come to rest.

    Where it is not known, from those beside it: raising the load may lead to another branch. Where it did at
    both of them it is not raised again.
    """
    f, load = search.base.frequency, search.base.load
    beside = (k,) if k in search.found else tuple(around(search.found, k))
    begin, starts, _ = from_beside(search, k, beside)
    sizes = [abs(search.found[j].amplitude) for j in beside] or [0.0]
    own = all(search.found[j].own and j not in search.fell for j in beside)
    raised = not (starts and own)
    return Target(
        k,
        float(f[k]),
        load,
        _from_rest(search, k) if k in search.found else begin,
        starts,
        cold=raised,
        expected=min(sizes),
        most=max(sizes),
        offset=_rest_at(search, k),
        steps=search.steps,
    )


def _from_rest(search: Search, k: int) -> complex:
    """Amplitude with which a motion that is known begins at rest: where its bodies walk, which is counted."""
    found = search.found[k]
    return found.amplitude if found.rest is not None else 0j


def _rest_at(search: Search, k: int) -> Array | None:
    """Offset at which bodies may come to rest at a frequency, from where they have beside it."""
    known = {j: known_rest(one.rest, one.ahead) for j, one in search.found.items()}
    rests = {j: rest for j, rest in known.items() if rest is not None}
    beside = around(rests, k)
    if not beside:
        return None
    share = (k - beside[0]) / (beside[-1] - beside[0]) if len(beside) > 1 else 0.0
    return (1 - share) * rests[beside[0]] + share * rests[beside[-1]]


def _jumps(search: Search) -> list[tuple[int, int]]:
    """Pairs of neighbouring frequencies whose sizes jump: the smaller and the larger, by index.

    Half a jump is more than a branch mostly changes by from one frequency to the next.
    """
    size = {k: abs(one.amplitude) for k, one in search.anchors.items()}
    pairs = [(k, j) for k in size for j in (k - 1, k + 1) if j in size]
    return [(k, j) for k, j in pairs if np.log(size[j] / size[k]) > JUMP / 2]


def target_at(
    search: Search, k: int, guess: Contours, now: Held, beside: tuple[int, ...] = ()
) -> Target:
    """A steady state to seek at a frequency, from what is known beside it.

    From both sides where they are alike, else from the larger: that follows a branch to its end.
    """
    base = search.base
    own = guess.amplitude[guess.point == k]
    begin, starts, expected = from_beside(search, k, beside)
    if not starts:
        begin = complex(own[-1]) if len(own) else 0j
    if now.error[k] < ALIKE:
        begin = complex(now.amplitude[k])
        expected = abs(begin)
    return Target(
        k,
        float(base.frequency[k]),
        base.load,
        begin,
        starts,
        max((j for j in beside if j in search.found), key=_size_in(search), default=-1),
        expected=expected,
        steps=search.steps,
    )


def from_beside(
    search: Search, k: int, beside: tuple[int, ...]
) -> tuple[complex, tuple[tuple[tuple[Start, float], ...], ...], float]:
    """Amplitude, starts and least size of a motion from those beside it, none or the larger first."""
    known = sorted((j for j in beside if j in search.found), key=_size_in(search), reverse=True)
    if not known:
        return 0j, (), 0.0
    main = search.found[known[0]]
    if len(known) == 2 and step_of(*(search.anchors[j] for j in known)) < ALIKE:
        other, share = search.found[known[1]], abs(k - known[1]) / abs(known[0] - known[1])
        begin = share * main.amplitude + (1 - share) * other.amplitude
        return begin, (((main.state, share), (other.state, 1 - share)),), abs(other.amplitude)
    return main.amplitude, (((main.state, 1.0),),), abs(main.amplitude)


def _size_in(search: Search) -> Callable[[int], float]:
    """What tells the size of a motion that was found."""
    return lambda k: abs(search.found[k].amplitude)

"""The refined model put right by time integration where it is not sure of itself.

Steady states of the full joint are found where the response under a load is least known: first at its
resonance, half-power points and ends, from the answers of the refined model, then in the middle of the
stretches of frequencies whose bound (`analyses.reduced.anchors`) is above what the file asks for, each
started from the states to either side. At the finest every frequency is one. Where the size jumps between two
frequencies, the smaller is sought again from the larger: a branch is followed to its end, and the jump lies
where that is. The search ends when the bound holds everywhere, or with what it may cost.

Where the first of them show that their time steps err by more than is asked for, all of it begins anew with
four times as many. In the end what has settled is sought on with four times the steps, further ones are
sought where that leaves the response unsure, and what stays unsure itself is sought anew with these.
"""

from __future__ import annotations

import threading
from collections.abc import Callable, Sequence
from dataclasses import replace
from itertools import pairwise
from typing import NamedTuple

import numpy as np

from microslip.analyses.reduced.anchors import JUMP, Held, step_of
from microslip.analyses.reduced.response import Response, held_to
from microslip.analyses.reduced.surface import (
    Contours,
    contours,
    largest,
    load_surface,
)
from microslip.analyses.reduced.sweep import CONVERGED
from microslip.analyses.time.starts import Start
from microslip.analyses.time.step_refinement import REFINEMENT
from microslip.describe.requests import (
    MARCHED_EACH,
    ResponseAnalysis,
)
from microslip.pipeline.band import Curve
from microslip.pipeline.marched import raised_and_marched
from microslip.pipeline.prepare import Assembly
from microslip.pipeline.search import Search, around, larger_sides
from microslip.pipeline.targets import STEPS, Found, Lost, Target
from microslip.pipeline.walk import TOLERANCE, sought, what_it_is
from microslip.typing import Array

FIRST = (0.0, -1.2, 1.2)
"""Detunings of the first anchors: the resonance, below and above half power. Then come the ends."""

ANEW_AT_A_TIME = 2
"""Steady states sought at once with more steps from the beginning: each takes long."""

AT_A_TIME = 4
"""Steady states sought at a time."""

BESIDE_LOST, BETWEEN_LOST = 0.5, 0.1
"""What frequencies count for beside one whose motion is not steady enough, and between two such."""

ALIKE = 0.25
"""Between two states whose sizes differ by less, in logarithm, the search starts from a mixture."""

GAP, UNSEEN = 1 / 16, 0.25
"""Share of the frequencies without a steady state among them that is not left so, whatever the bound says: a
resonance of an upper mode may hide there. They count for so much of those whose bound is too wide."""

WALKING = 4
"""Motions that have not settled of which two are marched at once, before others are sought: how far they go
on is how well the others are known, and between motions that are no better known none is sought.
"""

SAID = 2
"""Of so many motions that are not steady it is said what they are."""


class Anchored(NamedTuple):
    """A response held to steady states.

    Attributes
    ----------
    response : Response
    lost : tuple of str
        Where none was found, and why.
    opens : bool
        Whether that opens the joint.
    spent : str
        When the search ended, in words.
    walks : tuple of (float, float)
        Of bodies that have come to rest, how far they have walked past each other, m, and in how many cycles;
        a pair for each steady state.
    walks_on : tuple of (float, float)
        Of bodies that have not come to rest in the motion that is shown, by how much the amplitude changes
        until they do, relative, and in how many cycles; a pair for each steady state.
    """

    response: Response
    lost: tuple[str, ...]
    opens: bool
    spent: str
    walks: tuple[tuple[float, float], ...] = ()
    walks_on: tuple[tuple[float, float], ...] = ()


def anchored_response(
    assembly: Assembly,
    settings: ResponseAnalysis,
    case: Curve,
    base: Response,
    stop: threading.Event,
    advance: Callable[[int], None],
) -> Anchored:
    """A response of the refined model held to steady states.

    Parameters
    ----------
    assembly : Assembly
    settings : ResponseAnalysis
    case : Curve
        The refined model under a load.
    base : Response
        What it says, at the frequencies wanted.
    stop : Event
        Set on Ctrl-C, which ends the search; what is known then is returned.
    advance : callable
        Told how many points have been sought.
    """
    assert case.table is not None
    surface = load_surface(case.model, case.table, base.frequency, base.load)
    first = search = Search(surface, base, settings.points)
    guess = largest(contours(surface, base.load))
    try:
        advance(_learn(assembly, search, _first(search, guess)))
        # what that costs has to leave some for the rest
        may = REFINEMENT * max(search.count / search.points, search.seconds / search.may_take) < 1
        if may and search.steps_tell(assembly.prepared, settings.error):
            first, search = search, search.begun_anew()
            advance(_learn(assembly, search, _first(search, guess)))
        while not search.over:
            picks = _least_known(search, guess, settings.error)
            if not picks:
                break
            advance(_learn(assembly, search, picks))
            if not search.tried and (ends := _walking(search)):
                advance(_march(assembly, search, ends, settings.error))
        while ends := _to_march(search, settings.error):
            advance(_march(assembly, search, ends, settings.error))
        search.refine(assembly.prepared)
        # with more steps there may be more to see than there was with fewer
        while not search.over:
            if picks := _between_refined(search, guess, settings.error):
                search.keep_refined(assembly.prepared, _answers(assembly, picks))
            elif picks := _anew(search, guess, settings.error):
                search.keep_anew(assembly.prepared, _answers(assembly, picks))
            else:
                break
            advance(len(picks))
    except KeyboardInterrupt:
        stop.set()
        search = max(first, search, key=lambda one: len(one.anchors))
        search.take_refined()
    cycles = f"{search.cycles + search.marched} cycles"
    if search.steps != STEPS:
        cycles += f" of {search.steps} steps"
    spent = f"{search.count} steady states, {cycles} and {search.seconds:.0f} s"
    said = _said(assembly, search, stop)
    return Anchored(_response(search), said, search.opens, spent, search.walks, search.walks_on)


def _learn(assembly: Assembly, search: Search, targets: list[Target]) -> int:
    """Steady states at targets; how many were sought."""
    for target, answer in zip(targets, sought(assembly.prepared, targets), strict=True):
        search.keep(target, answer)
    return len(targets)


def _answers(assembly: Assembly, targets: list[Target]) -> list[tuple[Target, Found | Lost]]:
    """Steady states at targets, each with its own."""
    return list(zip(targets, sought(assembly.prepared, targets), strict=True))


def _march(assembly: Assembly, search: Search, targets: list[Target], wanted: float) -> int:
    """Where the motions at targets end; how many were marched."""
    ended = raised_and_marched(assembly.prepared, targets)
    for target, answer in zip(targets, ended, strict=True):
        search.keep_end(target, answer)
    search.forget_between(wanted)
    return len(targets)


def _first(search: Search, guess: Contours) -> list[Target]:
    """Where the refined model has its resonance and half power, and the ends of the band."""
    u, chosen = guess.detuning, [0, len(search.base.frequency) - 1]
    if len(u):
        near = [int(np.argmin(np.abs(np.clip(t, u.min(), u.max()) - u))) for t in FIRST]
        chosen = [int(guess.point[j]) for j in near] + chosen
    now = search.held()
    return [_target(search, k, guess, now) for k in dict.fromkeys(chosen)]


def _least_known(search: Search, guess: Contours, wanted: float) -> list[Target]:
    """Jumps to be followed, then the middles of the stretches where most is not known."""
    now = search.held()
    targets = [
        replace(_target(search, k, guess, now, (beside,)), cold=False)
        for k, beside in _jumps(search)
        if beside not in search.origins.get(k, ())
    ]
    marks, doubtful = search.marks, now.error > wanted
    doubtful[marks] = False
    blurred = search.blurred(wanted)
    weighed, widest = [], max(GAP * len(doubtful), 1)
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
    return targets[: min(AT_A_TIME, search.points - search.count)]


def _anew(search: Search, guess: Contours, wanted: float) -> list[Target]:
    """Steady states that more steps leave unsure, and what was passed over where it is so, to be sought with
    these from the beginning; each once.

    What has settled with fewer need not lie where a search with more finds what it has become.
    """
    now, refined, targets = search.held(), search.refined, list[Target]()
    unsure = [
        k for k in {*search.marks, *search.passed} - search.anew if not now.error[k] <= wanted
    ]
    # last what more steps alone do not make sure
    others = now.error - search.accuracy
    unsure.sort(key=lambda k: (not others[k] <= wanted, -now.error[k], k))
    for k in unsure[:ANEW_AT_A_TIME]:
        beside = tuple(around(refined - {k}, k))
        anew = replace(_target(search, k, guess, now, beside), steps=search.stepping.more)
        targets.append(anew)
    return targets[: search.points - search.count]


def _between_refined(search: Search, guess: Contours, wanted: float) -> list[Target]:
    """The middles of the stretches between states with more steps, or known as well, where most is not known.

    Not between two that are themselves not known as well as is wanted.
    """
    now, refined = search.held(), search.refined
    doubtful, weighed = ~(now.error <= wanted), []
    for left, right in pairwise(search.marks):
        unknown, middle = int(doubtful[left + 1 : right].sum()), (left + right) // 2
        ends = (left, right)
        sure = not all(doubtful[k] for k in ends)
        sure = sure and all(k in refined or not doubtful[k] for k in ends)
        if unknown and sure and middle not in search.passed:
            weighed.append((unknown, middle, left, right))
    targets = _middles(search, guess, now, weighed)
    return targets[: min(AT_A_TIME, search.points - search.count)]


def _middles(
    search: Search, guess: Contours, now: Held, weighed: Sequence[tuple[float, int, int, int]]
) -> list[Target]:
    """Targets in the middle of stretches, from their weights, middles and ends; the heaviest first."""
    heaviest = sorted(weighed, reverse=True)
    return [_target(search, k, guess, now, (left, right)) for _, k, left, right in heaviest]


def _to_march(search: Search, wanted: float) -> list[Target]:
    """Steady states that are not known well, far from those marched so far, then what is flagged between."""
    slow = search.seconds >= 2 * search.may_take
    if slow or search.marched >= MARCHED_EACH * search.points or search.count >= search.points:
        return []
    now, marched = search.held(), sorted(search.tried)
    left = sorted((search.blurred(wanted) | set(search.lost)) - search.tried)
    chosen = [k for k in _may_leave(search, now) if not now.error[k] <= wanted][:AT_A_TIME]
    left = [k for k in left if k not in chosen]
    while left and len(chosen) < AT_A_TIME:
        known = np.array([*marched, *chosen, *sorted(set(search.anchors) - set(left))])
        gaps = [int(np.abs(known - k).min()) if len(known) else k for k in left]
        chosen.append(left.pop(int(np.argmax(gaps))))
    if not chosen:
        doubtful = now.error > wanted
        doubtful[[*search.marks, *search.tried]] = False
        weighed = sorted(
            (int(doubtful[left + 1 : right].sum()), (left + right) // 2)
            for left, right in pairwise(sorted({*search.marks, *search.tried}))
        )
        chosen = [k for count, k in weighed[::-1] if count][:AT_A_TIME]
    return [_marched_target(search, k) for k in chosen]


def _walking(search: Search) -> list[Target]:
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
    begin, starts, _ = _from_beside(search, k, beside)
    sizes = [abs(search.found[j].amplitude) for j in beside] or [0.0]
    own = all(search.found[j].own and j not in search.fell for j in beside)
    raised = not (starts and own)
    return Target(
        k,
        float(f[k]),
        load,
        0j if k in search.found else begin,
        starts,
        cold=raised,
        expected=min(sizes),
        most=max(sizes),
        offset=_rest_at(search, k),
        steps=search.steps,
    )


def _rest_at(search: Search, k: int) -> Array | None:
    """Offset at which bodies may come to rest at a frequency, from where they have beside it."""
    rests = {j: one.rest for j, one in search.found.items() if one.rest is not None}
    beside = around(rests, k)
    if not beside:
        return None
    share = (k - beside[0]) / (beside[-1] - beside[0]) if len(beside) > 1 else 0.0
    return (1 - share) * rests[beside[0]] + share * rests[beside[-1]]


def _jumps(search: Search) -> list[tuple[int, int]]:
    """Pairs of neighbouring frequencies whose sizes jump: the smaller and the larger, by index."""
    pairs = []
    for k in search.anchors:
        if k + 1 in search.anchors and step_of(search.anchors[k], search.anchors[k + 1]) > JUMP:
            pair = k, k + 1
            pairs.append(
                pair
                if abs(search.anchors[k].amplitude) < abs(search.anchors[k + 1].amplitude)
                else pair[::-1]
            )
    return pairs


def _target(
    search: Search, k: int, guess: Contours, now: Held, beside: tuple[int, ...] = ()
) -> Target:
    """A steady state to seek at a frequency, from what is known beside it.

    From both sides where they are alike, else from the larger: that follows a branch to its end.
    """
    base = search.base
    own = guess.amplitude[guess.point == k]
    from_beside, starts, expected = _from_beside(search, k, beside)
    begin = from_beside if starts else complex(own[-1]) if len(own) else 0j
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


def _from_beside(
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


def _response(search: Search) -> Response:
    base, now = search.base, search.held()
    response = held_to(base, "auto", now, search.doubted())
    marks = np.array(sorted(search.anchors), dtype=int)
    if not len(marks):
        return response
    below = np.array([search.found[k].fell or k in search.fell for k in marks])
    middle = 0.5 * (marks[1:] + marks[:-1])
    beside = below[np.searchsorted(middle, np.arange(len(base.frequency)))]
    fell = (response.flag == CONVERGED) & beside
    return replace(response, outgrown=fell if fell.any() else None)


def _said(assembly: Assembly, search: Search, stop: threading.Event) -> tuple[str, ...]:
    """Where no steady state was found, and of the first what the motion is."""
    said: list[str] = []
    for k in sorted(search.lost):
        answer, frequency = search.lost[k], float(search.base.frequency[k])
        reason = answer.reason
        if answer.steady is not None and len(said) < SAID and not stop.is_set():
            reason += f": {what_it_is(assembly.prepared, frequency, answer.steady, search.steps)}"
        said.append(f"{frequency:.6g} Hz: {reason}")
    return tuple(said)


def other_pasts(response: Response, wanted: float) -> Array:
    """Frequencies, Hz, that are sure, and where another past leads to an amplitude that differs by more."""
    doubtful = unsure(response, wanted)
    found = [one.frequency for one in response.anchors if one.past > wanted]
    return np.setdiff1d(found, doubtful)


def unsure(response: Response, wanted: float) -> Array:
    """Frequencies, Hz, whose stated error is above what is wanted."""
    assert response.error_indicator is not None
    answered = response.flag == CONVERGED
    return response.frequency[answered & ~(response.error_indicator <= wanted)]

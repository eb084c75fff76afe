"""Steady states that coexist: one search from each of several pasts, and those that differ.

Friction and opening make more than one periodic motion of a joint under one load: branches of a
fold, and tractions that pairs which never slip keep from the past. Which of them a search ends in
hangs on where it starts:

| past | start |
|---|---|
| raised | rest, the load raised over ten cycles: the past that is meant where none is given |
| rest | rest, the whole load at once |
| reduced | prestress, and the velocity of the reduced model's answer |
| below | the steady state at the next frequency below, come from still lower ones |
| above | the steady state at the next frequency above, come from still higher ones |

Two answers are one state where their first harmonics agree within `SAME` of the larger one and what
both leave open (`TimePoint.error`, and between two numbers of steps what these have changed). An unstable
one that is so close to a settled one is not told apart from it: a pair on the verge of slip makes two of
one.
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from dataclasses import replace
from itertools import pairwise

import numpy as np

from microslip.analyses.prepared.joint import PreparedJoint
from microslip.analyses.time.point import Request, TimePoint
from microslip.analyses.time.points import solve_request, steady_states
from microslip.errors import Failure, MicroslipError
from microslip.numerics.execute import Executor, each, threads

SAME = 1e-3
"""Difference of first harmonics, over the larger one, up to which two states are one."""

Answer = TimePoint | Failure

NEIGHBOURS = ("below", "above")
"""Pasts that are other frequencies."""


def coexisting_states(
    joint: PreparedJoint,
    requests: Sequence[Request],
    pasts: Sequence[str] = ("raised",),
    executor: Executor | None = None,
) -> Iterator[list[Answer]]:
    """The distinct steady states of every request, in the order of the requests.

    Of the states of a request the first is that of the first past; unstable ones that a search has met stand
    behind the others. Where no search settles, the answer of the first past.

    Parameters
    ----------
    joint : PreparedJoint
    requests : sequence of Request
        Neighbours are those of the same load and friction.
    pasts : sequence of str
        Of the table above, one of them no neighbour.
    executor : Executor, optional
        Where they are computed; threads by default.
    """
    own = [past for past in pasts if past not in NEIGHBOURS]
    asked = [replace(request, past=past) for request in requests for past in own]
    found = steady_states(joint, asked, executor)
    groups = ([next(found) for _ in own] for _ in requests)
    ways = [past for past in pasts if past in NEIGHBOURS]
    if ways:
        known = list(groups)
        chains = [(way, chain) for way in ways for chain in _chains(requests, way)]

        def work(task: tuple[str, list[int]]) -> dict[int, Answer]:
            return _along(joint, requests, known, *task)

        further = list(each(work, chains, executor or threads()))
        groups = (
            [*answers, *(answer[k] for answer in further if k in answer)]
            for k, answers in enumerate(known)
        )
    yield from (distinct(answers) for answers in groups)


def _chains(requests: Sequence[Request], way: str) -> list[list[int]]:
    """Requests of one load and friction along their frequencies, by their numbers."""
    loads: dict[tuple[float, float | None], list[int]] = {}
    for k, request in enumerate(requests):
        loads.setdefault((request.load, request.friction), []).append(k)
    return [
        sorted(chain, key=lambda k: requests[k].frequency, reverse=way == "above")
        for chain in loads.values()
    ]


def _along(
    joint: PreparedJoint,
    requests: Sequence[Request],
    known: Sequence[Sequence[Answer]],
    way: str,
    chain: Sequence[int],
) -> dict[int, Answer]:
    """Steady states from that of the frequency before, all along a chain but at its begin."""
    found: dict[int, Answer] = {}
    for before, k in pairwise(chain):
        candidates = [found[before]] if before in found else []
        candidates += known[before]
        settled = (p for p in candidates if isinstance(p, TimePoint) and p.settled)
        start = next((point.steady.end for point in settled), None)
        if start is None:
            continue
        request = replace(requests[k], start=start, past=way)
        try:
            found[k] = solve_request(joint, request)
        except MicroslipError as error:
            found[k] = Failure("time", request.place, str(error))
    return found


def distinct(answers: Sequence[Answer]) -> list[Answer]:
    """The steady states among answers to one request, each once, with all pasts that lead to it.

    Unstable ones last. The first answer, where none is settled.
    """
    points = [point for point in answers if isinstance(point, TimePoint)]
    points += [point.left for point in points if point.left is not None]
    states: list[TimePoint] = []
    for point in [p for p in points if p.settled] + [p for p in points if p.verdict == "unstable"]:
        for k, other in enumerate(states):
            if _one(point, other):
                pasts = [past for past in point.pasts if past not in other.pasts]
                states[k] = replace(other, pasts=(*other.pasts, *pasts))
                break
        else:
            states.append(point)
    if any(point.settled for point in states):
        return list(states)
    return [*answers[:1], *states]


def _one(point: TimePoint, other: TimePoint) -> bool:
    """Whether two states are one."""
    a, b = point.steady.amplitude, other.steady.amplitude
    apart = SAME * max(abs(a), abs(b))
    left_open = [abs(a) * point.error, abs(b) * other.error]
    if point.steps != other.steps:
        left_open.append(max(abs(a), abs(b)) * _stepped(point, other))
    apart += sum(x for x in left_open if np.isfinite(x))
    return bool(abs(a - b) <= apart)


def _stepped(point: TimePoint, other: TimePoint) -> float:
    """By how much one state differs in two numbers of steps, relative."""
    fewer, more = sorted((point, other), key=lambda one: one.steps)
    known = math.isfinite(fewer.steps_error)
    return fewer.steps_error + more.steps_error if known else more.steps_change

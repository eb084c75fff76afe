"""Many steady states by time integration, spread over threads.

Pairs that stick all the time keep what the past has locked into them, so that a steady state is one of a
past. The past that is meant where none is given, here and by the other methods, is *rest, the load raised
slowly*: prestress, from which quasi-static cycles load as well, and then more and more of the load.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from contextlib import suppress
from dataclasses import replace

import numpy as np

from microslip.analyses.prepared.joint import PreparedJoint
from microslip.analyses.time.classify import LONGEST, LOOKED, motion_of
from microslip.analyses.time.deviations import Derivative
from microslip.analyses.time.leaving import leave
from microslip.analyses.time.point import Request, TimePoint
from microslip.analyses.time.readings import opening_of, phases
from microslip.analyses.time.resting import Rested, WalksOnError, rested
from microslip.analyses.time.scheme import (
    ContactMemory,
    State,
    TimeScheme,
    contact_memory,
    march,
    prestressed_state,
    time_scheme,
)
from microslip.analyses.time.stability import closer, settling_error, stability_of
from microslip.analyses.time.starts import Start, end_of, placed
from microslip.analyses.time.steady import (
    CONFIRMED,
    RAISED,
    SteadyState,
    linearised_state,
    raised_state,
    steady_state,
    thinned,
)
from microslip.analyses.time.step_refinement import with_finer_steps
from microslip.analyses.time.walking_on import marched_on
from microslip.errors import ContactError, Failure, JointOpensError, MicroslipError
from microslip.numerics.execute import Executor, each, threads

MORE, FEW = (4, 8), 80
"""So many times the steps, and cycles at most with them, where a motion does not settle or is unstable."""

AGAIN, UNSURE = 160, ("slowly attracting", "quasi-periodic", "irregular")
"""Cycles of a second search, from where a motion has come to that was looked at, if it is of these kinds:
one that lingers beside the end of a branch may look like any of them."""

OPENING_CYCLES = 50
"""So many cycles from the start are searched for the moment at which a joint first opens."""


def _refuse_open(scheme: TimeScheme, steady: SteadyState, request: Request) -> None:
    """Raise `JointOpensError` where no pair touches at some step of the steady cycle.

    A joint that has fallen apart is open all the time; the same start is then marched again up to
    where it first opens.
    """
    position = scheme.joint.model.position
    reason = opening_of(steady.cycle, position)
    if not reason:
        return
    start = _begin(scheme, request)
    if isinstance(start, Start):
        state = placed(start, scheme, steady.frequency, steady.load)
    else:
        state = start or prestressed_state(scheme, abs(request.guess), 2 * np.pi * steady.frequency)
    wave = steady.load * np.sin(phases(steady))
    for cycle in range(OPENING_CYCLES):
        part = march(scheme, state, wave, keep=True)
        first = opening_of(part, position, cycle / steady.frequency)
        if first:
            raise JointOpensError(first)
        state = part.state
    raise JointOpensError(reason)


def solve_request(joint: PreparedJoint, request: Request) -> TimePoint:
    """Steady state of one request, in this process.

    Raises
    ------
    ContactError
        Where a step does not solve; `JointOpensError` where no pair touches.
    """
    if request.friction is not None:
        joint = joint.with_friction(request.friction)
    point, known = _answer(joint, request)
    return with_finer_steps(joint, request, point, known) if point.settled else point


def _answer(joint: PreparedJoint, request: Request) -> tuple[TimePoint, Derivative | None]:
    """Steady state with the steps asked for, or more where these shake it, and what its search knows."""
    point, known = _searched(joint, request)
    sought = point.steady.converged or request.patient
    if not point.settled and sought and request.finer and request.accelerate:
        for factor in MORE:
            more = _with_more_steps(joint, request, point, factor)
            if more is not None:
                return more
    if point.settled:
        return point, known
    scheme = _scheme(joint, request)
    if point.verdict == "unstable":
        point = _left(scheme, request, point)
    if request.classify and not point.settled:
        motion = motion_of(scheme, point.steady, tolerance=CONFIRMED * request.tolerance)
        point = replace(point, motion=motion)
        if request.patient and motion.end is not None:
            if motion.kind == "periodic":
                point = _settled_meanwhile(scheme, request, point, motion.end)
            elif motion.kind in UNSURE:
                point = _settled_meanwhile(scheme, request, point, motion.end, AGAIN)
    return point, None


def _scheme(joint: PreparedJoint, request: Request) -> TimeScheme:
    return time_scheme(
        joint,
        1 / (request.frequency * request.steps),
        frequency=request.frequency,
        matched=request.matched,
    )


def _searched(
    joint: PreparedJoint, request: Request, marches: bool = True
) -> tuple[TimePoint, Derivative | None]:
    """What a search ends in, where that is periodic with stability and error; and what it knows."""
    scheme = _scheme(joint, request)
    memory = contact_memory(scheme)
    begin = _begin(scheme, request, memory)
    steady, learned = linearised_state(
        scheme,
        request.frequency,
        request.load,
        guess=request.guess,
        start=begin,
        accelerate=request.accelerate,
        tolerance=request.tolerance,
        max_cycles=request.max_cycles,
        memory=memory,
    )
    _refuse_open(scheme, steady, request)
    point = TimePoint(
        rho=request.rho,
        friction=float(np.median(joint.law.friction)),
        steady=steady,
        pasts=(request.past,),
        steps=request.steps,
    )
    apart = 0.0
    at_rest = _at_rest(scheme, request, steady, begin, memory, marches)
    if at_rest is not None:
        _refuse_open(scheme, at_rest.steady, request)
        there, apart = _spent(at_rest.steady, steady, at_rest.cycles), at_rest.apart
        point = replace(
            point,
            steady=there,
            walked=at_rest.walked,
            lasts=at_rest.lasts,
            ahead=at_rest.ahead,
        )
    if request.stability and point.steady.converged:
        point = _judged(scheme, request, point, memory)
        point = replace(point, error=point.error + apart, place_error=apart)
    # that of half a period tells nothing of a whole one
    return point, learned if point.steady.halved == steady.halved else None


def _at_rest(
    scheme: TimeScheme,
    request: Request,
    steady: SteadyState,
    begin: State | Start | None,
    memory: ContactMemory,
    marches: bool,
) -> Rested | None:
    """Where the bodies of a motion come to rest, if they walk and that is found; else where it leads."""
    if not request.accelerate:
        return None
    if begin is None:
        guess = request.guess
        state = prestressed_state(scheme, abs(guess), 2 * np.pi * request.frequency)
        begin = end_of(state, float(-np.angle(guess)), scheme, request.frequency)
    try:
        return rested(scheme, steady, request.tolerance, memory, begin)
    except WalksOnError:
        if steady.converged and marches:
            # the vibration repeats, but may fall from its branch on the way
            with suppress(ContactError):
                return marched_on(scheme, steady, request.tolerance, memory, begin)
    return None


def _with_more_steps(
    joint: PreparedJoint, request: Request, before: TimePoint, factor: int
) -> tuple[TimePoint, Derivative | None] | None:
    """The steady state with so many times the steps, sampled as with those asked for, or None.

    Steps that resolve contact badly may shake a motion that is stable. A walk is not marched again.
    """
    first = before.steady
    finer = replace(request, steps=factor * request.steps, start=first.end, max_cycles=FEW)
    try:
        point, known = _searched(joint, finer, marches=not before.lasts)
    except MicroslipError:
        return None
    if not point.settled:
        return None
    steady = replace(point.steady, cycle=thinned(point.steady.cycle, factor))
    return replace(point, steady=_spent(steady, first, steady.cycles)), known


def _settled_meanwhile(
    scheme: TimeScheme, request: Request, point: TimePoint, end: Start, again: int = 0
) -> TimePoint:
    """The steady state of a motion that has become periodic while it was looked at, if it is one.

    With `again`, one that comes closer is sought from there, for so many cycles.
    """
    steady = steady_state(
        scheme,
        request.frequency,
        request.load,
        start=end,
        accelerate=again > 0,
        tolerance=request.tolerance if again else CONFIRMED * request.tolerance,
        max_cycles=again or LONGEST,
    )
    if not steady.converged:
        return replace(point, steady=_spent(point.steady, steady, LOOKED + point.steady.cycles))
    _refuse_open(scheme, steady, request)
    found = replace(point, steady=_spent(steady, point.steady, LOOKED + steady.cycles), motion=None)
    if not (request.stability or again):
        return found
    judged = _judged(scheme, request, found, contact_memory(scheme))
    return judged if judged.settled else point


def _begin(
    scheme: TimeScheme, request: Request, memory: ContactMemory | None = None
) -> State | Start | None:
    """State that a request starts from; None for the guess."""
    if request.start is not None:
        return request.start
    if request.past == "raised":
        return raised_state(scheme, request.frequency, request.load, RAISED, memory)
    return prestressed_state(scheme) if request.past == "rest" else None


def _judged(
    scheme: TimeScheme, request: Request, point: TimePoint, memory: ContactMemory
) -> TimePoint:
    """A periodic motion with its stability and error, sought on where that is large."""
    found = stability_of(scheme, point.steady, memory=memory)
    error = settling_error(point.steady, found)
    steady, error = closer(scheme, point.steady, error, request.tolerance, memory)
    return replace(point, steady=steady, stability=found, error=error, place_error=0.0)


def _left(scheme: TimeScheme, request: Request, point: TimePoint) -> TimePoint:
    """What an unstable periodic motion is left for."""
    assert point.stability is not None
    left = leave(scheme, point.steady, point.stability, tolerance=request.tolerance)
    _refuse_open(scheme, left.steady, request)
    steady = _spent(left.steady, point.steady, left.cycles)
    if left.stability is None:
        steady = replace(steady, converged=False)
        return replace(point, steady=steady, stability=None, error=float("nan"), left=point)
    error = settling_error(left.steady, left.stability)
    known = replace(point, steady=steady, stability=left.stability, error=error, left=point)
    return replace(known, place_error=0.0)


def _spent(steady: SteadyState, before: SteadyState, cycles: int) -> SteadyState:
    """A steady state with what was spent before it."""
    return replace(steady, cycles=before.cycles + cycles, seconds=before.seconds + steady.seconds)


def steady_states(
    joint: PreparedJoint, requests: Sequence[Request], executor: Executor | None = None
) -> Iterator[TimePoint | Failure]:
    """Answers in the order of the requests; a failure says why a point has none.

    Parameters
    ----------
    joint : PreparedJoint
    requests : sequence of Request
    executor : Executor, optional
        Where they are computed; threads by default.
    """

    def work(request: Request) -> TimePoint | Failure:
        try:
            return solve_request(joint, request)
        except MicroslipError as error:
            return Failure("time", request.place, str(error))

    return each(work, requests, executor or threads())

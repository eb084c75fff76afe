"""Steady states sought on with more steps: what the steps of time integration do to them.

Errors of the steps do not go with the square of their number: contact changes its state inside a step, and
neighbouring numbers of steps err by as much in either sign. But they fall with more steps; and a motion that
has settled is mostly settled again after three or four cycles with k times as many. By how much that has
changed the first harmonic Q,

    |Q_k - Q| / |Q_k|

is more than what is left of the error as long as k times the steps halve it. Mostly they make it a
tenth.
"""

from __future__ import annotations

import time as clock
from dataclasses import replace

import numpy as np

from microslip.analyses.prepared.joint import PreparedJoint
from microslip.analyses.time.deviations import Derivative
from microslip.analyses.time.point import Request, TimePoint
from microslip.analyses.time.readings import opening_of
from microslip.analyses.time.scheme import contact_memory, time_scheme
from microslip.analyses.time.stability import SURE, closer, settling_error, stability_of
from microslip.analyses.time.steady import SteadyState, linearised_state, thinned
from microslip.errors import MicroslipError

REFINEMENT, AGAIN, ROUNDS = 8, 2, 2
"""So many times the steps, and where these matter so many times as many, as often at most."""

LITTLE, USUAL = 1e-3, 150
"""They do where the first harmonic changes by more, relative. Who asks for k times the usual steps asks for a
k²-th of that,"""

OPEN = 10.0
"""but for no less than so many times the tolerance of the search."""

PATIENCE = 80
"""Cycles with more steps at most."""

LOOSER = 3.0
"""It is not taken in place of one that is settled so much better, where it is not settled well."""

FARTHER = 1e-2
"""Where the first harmonic changes by more, relative, its stability is found out again."""


def with_finer_steps(
    joint: PreparedJoint, request: Request, point: TimePoint, known: Derivative | None = None
) -> TimePoint:
    """A settled point with ``request.refinement`` times the steps, and what they have changed.

    Where that is more than `LITTLE`, or nothing settles with these, with `AGAIN` times as many, and so on
    while these settle, `ROUNDS` times. As it was, and its error not known, where neither of the first two
    settles.

    Parameters
    ----------
    joint : PreparedJoint
        With the friction of the request.
    request : Request
    point : TimePoint
    known : Derivative, optional
        Of the period map at the point, as its search knows it.
    """
    if request.refinement == 1:
        return point
    began = clock.perf_counter()
    steps = point.steps * max(request.refinement * request.steps // point.steps, AGAIN)
    most = AGAIN**ROUNDS * request.refinement * request.steps
    little = max(LITTLE * min(USUAL / request.steps, 1.0) ** 2, OPEN * request.tolerance)
    found, reasons = point, list[str]()
    while not found.steps_error <= little and steps <= max(most, AGAIN * point.steps):
        try:
            found, known = _sought_on(joint, request, point, found, steps, known, bool(reasons))
        except (MicroslipError, np.linalg.LinAlgError) as reason:
            reasons.append(str(reason))
            if found.steps > point.steps or len(reasons) > 1:
                break
        steps *= AGAIN
    seconds = point.steady.seconds + clock.perf_counter() - began
    found = replace(found, steady=replace(found.steady, seconds=seconds))
    if found.steps == point.steps:
        return replace(found, unrefined=reasons[0])
    return replace(found, steps_change=_apart(point.steady, found.steady))


def _apart(before: SteadyState, later: SteadyState) -> float:
    """Relative change of the first harmonic."""
    return abs(later.amplitude - before.amplitude) / max(abs(later.amplitude), 1e-300)


def _sought_on(
    joint: PreparedJoint,
    request: Request,
    point: TimePoint,
    last: TimePoint,
    steps: int,
    known: Derivative | None,
    doubted: bool,
) -> tuple[TimePoint, Derivative | None]:
    """The point beside the last one with so many steps, and what is known of the derivative there.

    It is held against the one that the first search has found, `point`; where its stability is `doubted` that
    is found out whatever has changed.

    Raises
    ------
    MicroslipError
        Where there is none that is as good: says why.
    """
    frequency, first, before = request.frequency, point.steady, last.steady
    tolerance = request.tolerance
    dt = 1 / (frequency * steps)
    scheme = time_scheme(joint, dt, frequency=frequency, matched=request.matched)
    memory = contact_memory(scheme)
    later, known = linearised_state(
        scheme,
        frequency,
        request.load,
        start=before.end,
        tolerance=tolerance,
        max_cycles=PATIENCE,
        memory=memory,
        halves=before.halved,
        known=known,
    )
    if opening_of(later.cycle, joint.model.position):
        raise MicroslipError("the motion opens the joint")
    if not later.converged:
        raise MicroslipError(f"none settles within {later.cycles} cycles")
    stability, error, halved = point.stability, point.error, later.halved
    if stability is not None:
        settling = point.error - point.place_error
        error = settling * later.change / max(first.change, 1e-300)
        if doubted or _apart(first, later) > FARTHER:
            stability = stability_of(scheme, later, memory=memory)
            error = settling_error(later, stability)
            if stability.verdict == "unstable":
                raise MicroslipError("the one beside it is unstable")
        later, error = closer(scheme, later, error, tolerance, memory)
        if error > max(SURE * tolerance, LOOSER * settling):
            raise MicroslipError("none settles as closely")
        error += point.place_error
    finer = replace(
        later,
        cycle=thinned(later.cycle, steps // request.steps),
        cycles=before.cycles + later.cycles,
    )
    found = replace(
        point,
        steady=finer,
        stability=stability,
        error=error,
        steps=steps,
        steps_error=_apart(before, finer),
    )
    return found, known if later.halved == halved else None

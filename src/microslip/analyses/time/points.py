"""Many steady states by time integration, spread over threads."""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from dataclasses import dataclass

import numpy as np

from microslip.analyses.prepared.joint import PreparedJoint
from microslip.analyses.time.classify import Motion, motion_of
from microslip.analyses.time.floquet import Multipliers, floquet_multipliers
from microslip.analyses.time.readings import opening_of, phases
from microslip.analyses.time.scheme import (
    TimeScheme,
    march,
    prestressed_state,
    time_scheme,
)
from microslip.analyses.time.starts import Start, placed
from microslip.analyses.time.steady import CONFIRMED, SteadyState, steady_state
from microslip.errors import Failure, JointOpensError, MicroslipError
from microslip.numerics.execute import Executor, each, threads


@dataclass(frozen=True)
class Request:
    """One steady state to find.

    Attributes
    ----------
    rho : float
        A label; nan where the load was not given by it.
    friction : float or None
        Coefficient of friction of all pairs; None leaves them the joint's own.
    frequency, load : float
        Hz, amplitude of the driving load.
    guess : complex
        First harmonic of the modal coordinate to start from.
    steps, max_cycles : int
    tolerance : float
    accelerate : bool
    stability : bool
        Refine the Floquet multipliers of a converged point; a few dozen cycles more.
    matched : bool
        Matched poles; False for the error of the steps that Newmark's method has.
    classify : bool
        Say what a motion is that is not periodic; some hundred cycles more.
    said : str
        The load in messages; its number where left out.
    start : Start, optional
        The end of another steady state (`SteadyState.end`) to start from instead of the guess.
    """

    rho: float
    frequency: float
    load: float
    friction: float | None
    guess: complex
    steps: int = 150
    tolerance: float = 1e-5
    max_cycles: int = 400
    accelerate: bool = True
    stability: bool = False
    matched: bool = True
    classify: bool = True
    said: str = ""
    start: Start | None = None

    @property
    def place(self) -> str:
        """Load and frequency, in messages."""
        load = (
            f"rho = {self.rho:g}"
            if math.isfinite(self.rho)
            else self.said or f"load {self.load:.4g}"
        )
        return f"{load}, {self.frequency:g} Hz"


@dataclass(frozen=True)
class TimePoint:
    """A steady state with the request it answers.

    Attributes
    ----------
    rho, friction : float
        `friction` is the median of the pairs'.
    steady : SteadyState
    stability : Multipliers or None
        Where asked for and converged.
    motion : Motion or None
        What it is, where the search ended without a periodic motion.
    """

    rho: float
    friction: float
    steady: SteadyState
    stability: Multipliers | None = None
    motion: Motion | None = None


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
    omega = 2 * np.pi * steady.frequency
    state = (
        prestressed_state(scheme, abs(request.guess), omega)
        if request.start is None
        else placed(request.start, scheme, steady.frequency, steady.load)
    )
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
    scheme = time_scheme(
        joint,
        1 / (request.frequency * request.steps),
        frequency=request.frequency,
        matched=request.matched,
    )
    steady = steady_state(
        scheme,
        request.frequency,
        request.load,
        guess=request.guess,
        start=request.start,
        accelerate=request.accelerate,
        tolerance=request.tolerance,
        max_cycles=request.max_cycles,
    )
    _refuse_open(scheme, steady, request)
    refine = request.stability and steady.converged
    unknown = request.classify and not steady.converged
    return TimePoint(
        rho=request.rho,
        friction=float(np.median(joint.law.friction)),
        steady=steady,
        stability=floquet_multipliers(scheme, steady) if refine else None,
        motion=motion_of(scheme, steady, tolerance=CONFIRMED * request.tolerance)
        if unknown
        else None,
    )


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

"""Many steady states by time integration, spread over threads."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from microslip.errors import MicroslipError
from microslip.model import JointModel
from microslip.statics import Prestress
from microslip.steady import SteadyState, steady_state
from microslip.threads import in_threads
from microslip.transient import check_closed, period_error, time_scheme

Array = NDArray[np.float64]


@dataclass(frozen=True)
class Request:
    """One steady state to find.

    Attributes
    ----------
    rho, friction : float
        Labels; `friction` is also used.
    frequency, load : float
        Hz, amplitude of the end moment.
    guess : complex
        First harmonic of the sliding coordinate to start from.
    steps, max_cycles : int
    tolerance : float
    accelerate : bool
    """

    rho: float
    frequency: float
    load: float
    friction: float
    guess: complex
    steps: int = 150
    tolerance: float = 1e-5
    max_cycles: int = 400
    accelerate: bool = True


@dataclass(frozen=True)
class TimePoint:
    """A steady state with the request it answers.

    Attributes
    ----------
    rho, friction : float
    steady : SteadyState
    corrected_frequency : float
        Frequency at which a scheme without period error has this answer, Hz.
    """

    rho: float
    friction: float
    steady: SteadyState
    corrected_frequency: float


def solve_request(
    model: JointModel, prestress: Prestress, compliance: Array | None, request: Request
) -> TimePoint:
    """Steady state of one request, in this process.

    Raises
    ------
    ContactError
        Where a step does not solve; `JointOpensError` where no pair touches.
    """
    scheme = time_scheme(
        model,
        prestress,
        request.friction,
        1 / (request.frequency * request.steps),
        compliance=compliance,
    )
    steady = steady_state(
        scheme,
        request.frequency,
        request.load,
        guess=request.guess,
        accelerate=request.accelerate,
        tolerance=request.tolerance,
        max_cycles=request.max_cycles,
    )
    check_closed(steady.cycle)
    stretch = 1 + period_error(2 * np.pi / request.steps, scheme.alpha)
    return TimePoint(request.rho, request.friction, steady, request.frequency * stretch)


def steady_states(
    model: JointModel,
    prestress: Prestress,
    requests: Sequence[Request],
    compliance: Array | None = None,
    threads: int = 2,
) -> Iterator[TimePoint | str]:
    """Answers in the order of the requests; a text says why a point failed.

    Parameters
    ----------
    model : JointModel
    prestress : Prestress
    requests : sequence of Request
    compliance : (d m,) array, optional
        Contact compliance of an elastic contact.
    threads : int
    """

    def work(request: Request) -> TimePoint | str:
        try:
            return solve_request(model, prestress, compliance, request)
        except MicroslipError as error:
            return f"time domain, rho = {request.rho:g}, {request.frequency:g} Hz: {error}"

    return in_threads(work, requests, threads)

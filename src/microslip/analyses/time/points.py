"""Many steady states by time integration, spread over threads, and what is read off them."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from microslip.analyses.statics.cycle import Prestress
from microslip.analyses.statics.linear_states import LinearStates
from microslip.analyses.time.floquet import Multipliers, floquet_multipliers
from microslip.analyses.time.scheme import (
    March,
    TimeScheme,
    march,
    period_error,
    prestressed_state,
    time_scheme,
)
from microslip.analyses.time.steady import SteadyState, steady_state
from microslip.contact.pairs import SEPARATED
from microslip.errors import JointOpensError, MicroslipError
from microslip.model.joint import JointModel
from microslip.numerics.execute import in_threads
from microslip.numerics.fourier import harmonic
from microslip.typing import Array


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
    stability : bool
        Refine the Floquet multipliers of a converged point; a few dozen cycles more.
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
    stability: bool = False


@dataclass(frozen=True)
class TimePoint:
    """A steady state with the request it answers.

    Attributes
    ----------
    rho, friction : float
    steady : SteadyState
    corrected_frequency : float
        Frequency at which a scheme without period error has this answer, Hz.
    stability : Multipliers or None
        Where asked for and converged.
    """

    rho: float
    friction: float
    steady: SteadyState
    corrected_frequency: float
    stability: Multipliers | None = None


@dataclass(frozen=True)
class Equivalent:
    """Contact force on the sliding mode as stiffness and damping, from a steady state.

    Attributes
    ----------
    k_eq, gamma_eq : float
        Divided by omega_sl².
    stored : float
        Energy stored by the contact, ``|Q|² k_eq omega_sl² / 2`` as in the tables, J per
        metre of width.
    loop : float
        ``pi |Q|² gamma_eq omega_sl²``: area of the loop of the force over the sliding coordinate.
    """

    k_eq: float
    gamma_eq: float
    stored: float
    loop: float


def phases(steady: SteadyState) -> Array:
    """Phase of the load at every sample of the cycle, rad."""
    steps = len(steady.cycle.time) - 1
    return np.asarray(steady.phase + 2 * np.pi * np.arange(steps + 1) / steps, dtype=float)


def equivalent(point: TimePoint, model: JointModel, states: LinearStates) -> Equivalent:
    """Equivalent stiffness and damping of a steady state, at the corrected frequency.

    There the integrated modes have the inertia that they would have in continuous time.
    """
    steady = point.steady
    return equivalent_of(steady.amplitude, point.corrected_frequency, steady.load, model, states)


def equivalent_of(
    Q: complex, frequency: float, load: float, model: JointModel, states: LinearStates
) -> Equivalent:
    """Equivalent stiffness and damping from the first harmonic of the sliding coordinate.

    The equation of motion of the sliding coordinate, with the linear part of the sliding state,

        q'' + c q' + omega_sl² q + f = f_M M(t),     c = alpha + beta omega_sl²

    defines the modal contact force ``f = Phi_sl^T F_c``. Its first harmonic is

        F_1 = f_M M - (omega_sl² - omega² + i omega c) Q_1
        k_eq + i gamma_eq = F_1 / (omega_sl² Q_1)

    Parameters
    ----------
    Q : complex
        Q_1, against the sine of the load.
    frequency, load : float
        Hz, and amplitude M of the end moment.
    """
    omega2 = states.sliding_omega**2
    linear = _sliding_stiffness(2 * np.pi * frequency, model, states)
    push = states.load_on_sliding["moment"] * load
    kappa = (push - linear * Q) / (omega2 * Q)
    return Equivalent(
        k_eq=float(kappa.real),
        gamma_eq=float(kappa.imag),
        stored=float(0.5 * abs(Q) ** 2 * kappa.real * omega2),
        loop=float(np.pi * abs(Q) ** 2 * kappa.imag * omega2),
    )


def _sliding_stiffness(omega: float, model: JointModel, states: LinearStates) -> complex:
    """Dynamic stiffness of the sliding coordinate without contact force."""
    alpha, beta = model.rayleigh
    omega2 = states.sliding_omega**2
    return omega2 - omega**2 + 1j * omega * (alpha + beta * omega2)


def modal_force(point: TimePoint, model: JointModel, states: LinearStates, harmonics: int) -> Array:
    """Modal contact force f at every sample of the steady cycle, from harmonics of q.

    The equation of `equivalent` harmonic by harmonic, each at its frequency corrected for the
    period error; high harmonics of q carry the noise of single steps and are left out.

    Returns
    -------
    (s + 1,) array
        As q counted from prestress, mean included.
    """
    steady = point.steady
    theta = phases(steady)
    steps = len(theta) - 1
    q = steady.cycle.output[:, model.port("sliding")]
    Q = harmonics_of(q, theta, harmonics)
    push = states.load_on_sliding["moment"]
    force = push * steady.load * np.sin(theta) - states.sliding_omega**2 * Q[0].real
    for h in range(1, harmonics + 1):
        stretch = 1 + period_error(2 * np.pi * h / steps)
        omega = 2 * np.pi * steady.frequency * h * stretch
        linear = _sliding_stiffness(omega, model, states)
        force = force - np.imag(linear * Q[h] * np.exp(1j * h * theta))
    return np.asarray(force, dtype=float)


def harmonics_of(y: Array, theta: Array, count: int) -> NDArray[np.complex128]:
    """Mean (as a real number) and harmonics 1 to `count` of samples over one cycle.

    Parameters
    ----------
    y : (s + 1, ...) array
    theta : (s + 1,) array
        From `phases`.
    count : int

    Returns
    -------
    (count + 1, ...) complex array
        ``y = mean + sum_h Im(Y_h e^{i h theta})``.
    """
    mean = y[:-1].mean(axis=0).astype(complex)
    return np.stack([mean, *(harmonic(y, theta, h) for h in range(1, count + 1))])


def opening_of(part: March, position: Array, start: float = 0.0) -> str:
    """Where and when a joint opens, as a message; empty where some pair touches all the time.

    Parameters
    ----------
    part : March
        Histories kept.
    position : (m,) array
        Of the pairs, m.
    start : float
        Time at the first sample, s.
    """
    touching = part.status != SEPARATED
    open_all = ~touching.any(axis=1)
    if not open_all.any():
        return ""
    i = int(np.argmax(open_all))
    when = f"the joint opens at t = {start + part.time[i]:.6g} s under load {part.load[i]:.4g}"
    advice = "lower the load or raise the clamp force"
    if i == 0:
        return f"{when}: no pair touches; {advice}"
    force = np.where(touching[i - 1], part.r[i - 1, ::2], -np.inf)
    k = int(np.argmax(force))
    return (
        f"{when}: the last pair to separate is {k} at x = {position[k]:.4g} m, which carried "
        f"{force[k]:.4g} N/m one step before; {advice}"
    )


OPENING_CYCLES = 50
"""So many cycles from the start are searched for the moment at which a joint first opens."""


def _refuse_open(scheme: TimeScheme, steady: SteadyState, request: Request) -> None:
    """Raise `JointOpensError` where no pair touches at some step of the steady cycle.

    A joint that has fallen apart is open all the time; the same start is then marched again up to
    where it first opens.
    """
    position = scheme.model.position
    reason = opening_of(steady.cycle, position)
    if not reason:
        return
    omega = 2 * np.pi * steady.frequency
    state = prestressed_state(scheme, abs(request.guess), omega)
    wave = steady.load * np.sin(phases(steady))
    for cycle in range(OPENING_CYCLES):
        part = march(scheme, state, wave, keep=True)
        first = opening_of(part, position, cycle / steady.frequency)
        if first:
            raise JointOpensError(first)
        state = part.state
    raise JointOpensError(reason)


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
    _refuse_open(scheme, steady, request)
    stretch = 1 + period_error(2 * np.pi / request.steps, scheme.alpha)
    refine = request.stability and steady.converged
    return TimePoint(
        rho=request.rho,
        friction=request.friction,
        steady=steady,
        corrected_frequency=request.frequency * stretch,
        stability=floquet_multipliers(scheme, steady) if refine else None,
    )


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

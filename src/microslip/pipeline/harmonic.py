"""The harmonic-balance responses that a joint file asks for: loads in threads, kept when interrupted."""

from __future__ import annotations

from concurrent.futures import Future, ThreadPoolExecutor, wait
from dataclasses import dataclass, replace
from threading import Event, Lock
from typing import TYPE_CHECKING

import numpy as np

from microslip.analyses.harmonic.equations import (
    Array,
    Complex,
    HarmonicProblem,
    harmonic_problem,
    with_harmonics,
)
from microslip.analyses.harmonic.hill import HillExponents, hill_exponents
from microslip.analyses.harmonic.response import (
    Adaptive,
    HarmonicPoint,
    HarmonicResponse,
    frequency_response,
    sliding_amplitudes,
)
from microslip.analyses.reduced.response import forced_response
from microslip.analyses.reduced.two_mode import two_mode_model
from microslip.analyses.statics.cycle import opening_load
from microslip.errors import MicroslipError
from microslip.numerics.execute import workers

if TYPE_CHECKING:
    from collections.abc import Sequence

    from microslip.describe.requests import HarmonicAnalysis
    from microslip.pipeline.progress import Progress
    from microslip.pipeline.run import JointAssembly

GENTLE = 3e-4
"""Peak of the joint without friction over the amplitude whose inertia opens the joint."""


@dataclass(frozen=True)
class HarmonicRun:
    """Responses under one load.

    Attributes
    ----------
    rho, friction, load : float
        ``rho = C mu P L / M`` (nan or inf where it has no value), and M, N m per metre of width.
    response : HarmonicResponse
    curves : tuple of ((n,) array, (n,) complex array)
        Frequency, Hz, and sliding amplitude along each branch as it was followed: with the harmonics
        that it was followed with, and held by the supports where the joint walks.
    stability : tuple of (HillExponents or None)
        Of every point; None where it was not asked for or not found.
    """

    rho: float
    friction: float
    load: float
    response: HarmonicResponse
    curves: tuple[tuple[Array, Complex], ...]
    stability: tuple[HillExponents | None, ...]

    @property
    def points(self) -> tuple[HarmonicPoint, ...]:
        """In order along the branches."""
        return self.response.points


def loads_of_file(assembly: JointAssembly) -> list[tuple[float, float]]:
    """Pairs (rho, end moment) where no forced response calibrates rho.

    The joint without friction, rho = 0, gets a moment under which its peak in the band stays small.
    """
    joint, a = assembly.joint, assembly
    load = joint.load
    assert load is not None
    strength = joint.contact.friction * a.moment_unit
    if load.rho is None:
        return [(strength / m, m) for m in joint.load_moments()]
    scale = load.rho_scale or 0.0
    return [(r, scale * strength / r if r > 0 else gentle_moment(a)) for r in load.rho]


def gentle_moment(a: JointAssembly) -> float:
    """End moment under which the joint without friction hardly opens and closes, N m/m."""
    settings = a.joint.analysis.harmonic
    assert settings is not None
    rayleigh = (a.joint.damping.alpha, a.joint.damping.beta)
    linear = two_mode_model(a.states, "moment", rayleigh, "consistent")
    peak = forced_response(linear, None, np.asarray(settings.band()), 1.0).peak_amplitude
    opening = opening_load(a.model, a.flexibility, a.prestress, "sliding")
    return float(GENTLE * opening / a.states.sliding_omega**2 / peak)


def run_harmonic_loads(
    a: JointAssembly,
    settings: HarmonicAnalysis,
    loads: Sequence[tuple[float, float]],
    runs: list[HarmonicRun],
    failures: list[str],
    progress: Progress,
) -> None:
    """Responses under all loads into `runs` and `failures`, in the order of the loads.

    On Ctrl-C each load stops at its next point and is kept as far as it is.
    """
    progress.start("harmonic balance", 2 * len(loads) * len(settings.band()))
    halt = Event()

    def one(load: tuple[float, float]) -> HarmonicRun | str:
        try:
            return _one_load(a, settings, load, _Meter(settings.band(), progress), halt)
        except MicroslipError as error:
            return str(error)

    pool = ThreadPoolExecutor(workers())
    pending = [pool.submit(one, load) for load in loads]
    try:
        wait(pending)
    finally:
        halt.set()
        pool.shutdown(wait=True, cancel_futures=True)
        for (rho, _), future in zip(loads, pending, strict=True):
            _collect(rho, future, runs, failures)
    progress.finish()


def _collect(
    rho: float, future: Future[HarmonicRun | str], runs: list[HarmonicRun], failures: list[str]
) -> None:
    label = f"harmonic balance, rho = {rho:.4g}"
    if future.cancelled():
        failures.append(f"{label}: interrupted before it began")
        return
    outcome = future.result()
    if isinstance(outcome, str):
        failures.append(f"{label}: {outcome}")
        return
    runs.append(outcome)
    failures += [f"{label}: {text}" for text in outcome.response.failures]


def _one_load(
    a: JointAssembly,
    settings: HarmonicAnalysis,
    load: tuple[float, float],
    meter: _Meter,
    halt: Event,
) -> HarmonicRun:
    """Branches, points and stability under one load."""
    rho, moment = load
    friction = 0.0 if rho == 0 else a.joint.contact.friction
    problem = harmonic_problem(
        a.model,
        a.prestress,
        friction,
        harmonics=settings.branch_harmonics,
        samples=settings.samples,
        compliance=a.compliance,
    )
    adaptive = None
    if settings.harmonics == "adaptive":
        adaptive = Adaptive(tolerance=settings.tolerance, most=settings.most)
    response = frequency_response(
        problem,
        moment,
        settings.band(),
        adaptive=adaptive,
        observe=meter.reached,
        solved=meter.solved,
        stop=halt.is_set,
    )
    stability: list[HillExponents | None] = []
    failures = list(response.failures)
    for point in response.points:
        try:
            wanted = settings.stability and not halt.is_set()
            stability.append(exponents_of(problem, point) if wanted else None)
        except MicroslipError as error:
            stability.append(None)
            failures.append(str(error))
    meter.close()
    return HarmonicRun(
        rho=rho,
        friction=friction,
        load=moment,
        response=replace(response, failures=tuple(failures)),
        curves=tuple(
            (way.parameters, sliding_amplitudes(problem, moment, way)) for way in response.branches
        ),
        stability=tuple(stability),
    )


def exponents_of(problem: HarmonicProblem, point: HarmonicPoint) -> HillExponents:
    """Slow exponents of a point, from the equations it solves."""
    equations = with_harmonics(problem, point.harmonics)
    if point.walk:
        equations = replace(equations, walks=True)
    return hill_exponents(equations, point.frequency, point.load, point.w)


class _Meter:
    """Progress of one load: every frequency counts when the branch passes it, and when solved."""

    def __init__(self, band: Sequence[float], progress: Progress) -> None:
        self.band = np.asarray(band)
        self.progress = progress
        self.passed = self.done = 0

    def reached(self, frequency: float) -> None:
        """The branch has come to a frequency."""
        self._advance(int(np.searchsorted(self.band, frequency, side="right")))

    def solved(self, _: float) -> None:
        """The responses at a frequency are known."""
        self._advance(len(self.band))
        self.done += 1
        _tell(self.progress, 1)

    def close(self) -> None:
        """Nothing more will come."""
        self._advance(len(self.band))
        _tell(self.progress, len(self.band) - self.done)

    def _advance(self, passed: int) -> None:
        more = passed - self.passed
        if more > 0:
            self.passed = passed
            _tell(self.progress, more)


_TELLING = Lock()


def _tell(progress: Progress, count: int) -> None:
    """Loads run side by side and report to one bar."""
    if count > 0:
        with _TELLING:
            progress.advance(count)

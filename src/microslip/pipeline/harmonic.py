"""The harmonic-balance responses that a joint file asks for: load by load, kept when interrupted."""

from __future__ import annotations

import threading
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from microslip.analyses.harmonic.adaptive import Adaptive
from microslip.analyses.harmonic.hill import HillExponents, exponents_of
from microslip.analyses.harmonic.levels import TAIL_SHARE
from microslip.analyses.harmonic.over_time import OverTime
from microslip.analyses.harmonic.peaks import outputs_along
from microslip.analyses.harmonic.points import HarmonicPoint
from microslip.analyses.harmonic.problem import harmonic_problem
from microslip.analyses.harmonic.response import HarmonicResponse, frequency_response
from microslip.analyses.time.offset import HORIZON
from microslip.brief import Brief
from microslip.describe.requests import HarmonicAnalysis
from microslip.describe.units import readable
from microslip.errors import Caution, Failure, MicroslipError
from microslip.numerics.execute import NotBegun, gather, threads
from microslip.pipeline.loads import Load, loads_of_file
from microslip.pipeline.outcome import Outcome, value_of
from microslip.pipeline.prepare import Assembly
from microslip.pipeline.progress import Progress
from microslip.typing import Array, Complex


@dataclass(frozen=True, repr=False)
class HarmonicRun(Brief):
    """Responses under one load.

    Attributes
    ----------
    rho, friction, load : float
        ``rho = C mu P L / M`` (nan where the file does not give it), and the amplitude on the driven port:
        M, N m per metre of width.
    response : HarmonicResponse
    curves : tuple of ((n,) array, (n,) complex array)
        Frequency, Hz, and sliding amplitude along each branch as it was followed: with the harmonics
        that it was followed with, and held by the supports where the joint walks.
    stability : tuple of (HillExponents or None)
        Of every point; None where it was not asked for or not found.
    motions : tuple of (n, p) complex arrays
        First harmonics of the outputs of all ports along each branch.
    """

    rho: float
    friction: float
    load: float
    response: HarmonicResponse
    curves: tuple[tuple[Array, Complex], ...]
    stability: tuple[HillExponents | None, ...]
    motions: tuple[Complex, ...] = ()

    @property
    def points(self) -> tuple[HarmonicPoint, ...]:
        """In order along the branches."""
        return self.response.points


def run_harmonic(
    assembly: Assembly, done: Mapping[str, Outcome[Any]], progress: Progress
) -> Outcome[tuple[HarmonicRun, ...]]:
    """Responses under all loads, in their order: those of the forced response, else of the file.

    On Ctrl-C each load stops at its next point and is kept as far as it is.
    """
    settings = assembly.joint.analysis.harmonic
    assert settings is not None
    loads, stop = loads_to_follow(assembly, done), threading.Event()
    progress.start("harmonic balance", 2 * len(loads) * len(settings.band()))

    def one(load: Load) -> HarmonicRun | MicroslipError:
        try:
            return follow(assembly, settings, load, _Meter(settings.band(), progress), stop)
        except MicroslipError as error:
            return error

    found: list[HarmonicRun] = []
    failures: list[Failure] = []
    cautions: list[Caution] = []
    for load, outcome in zip(loads, gather(one, loads, threads(), stop), strict=True):
        place = str(load)
        if isinstance(outcome, NotBegun):
            failures.append(Failure("harmonic", place, "interrupted before it began"))
        elif isinstance(outcome, MicroslipError):
            failures.append(Failure("harmonic", place, str(outcome)))
        else:
            found.append(outcome)
            adaptive = settings.harmonics == "adaptive"
            cautions += () if adaptive else cut_off(place, outcome)
            cautions += walking(place, outcome, adaptive)
            failures += [_under(place, missed) for missed in outcome.response.failures]
    progress.finish()
    return Outcome(tuple(found), tuple(failures), stop.is_set(), cautions=tuple(cautions))


def cut_off(place: str, entry: HarmonicRun) -> tuple[Caution, ...]:
    """That a number of harmonics that was given leaves out more than a stated share, under one load.

    What adaptive points are off by is estimated, or measured, and stands beside them.
    """
    given = entry.points
    short = [p for p in given if TAIL_SHARE * p.tail > CUT_OFF]
    if not short:
        return ()
    worst = max(short, key=lambda p: p.tail)
    H = worst.problem.harmonics
    if H > TELLING:
        reason = (
            f"the last two of {H} harmonics hold {worst.tail:.0%} of the vibrating reactions, and more than "
            f"{CUT_OFF / TAIL_SHARE:.0%} at {len(short)} of {len(given)} points: amplitudes may be off by "
            f"{TAIL_SHARE * worst.tail:.1%} and more"
        )
    else:
        reason = f"with {H} harmonic{'s' * (H > 1)} nothing shows what is left out"
    where = f"{place}, {worst.frequency:.6g} Hz"
    return (Caution("harmonic", where, reason, 'take harmonics = "adaptive", or more of them'),)


def walking(place: str, entry: HarmonicRun, adaptive: bool) -> Iterator[Caution]:
    """Where the bodies are not where they were clamped, and where they walk on from where they stand."""
    points = entry.points
    there = [p for p in points if _brought_on(p) or (not p.walks and p.walked > p.slip)]
    if there:
        far = max(there, key=lambda p: p.walked)
        yield Caution(
            "harmonic",
            f"{place}, {far.frequency:.6g} Hz",
            f"the bodies walk past each other at {len(there)} of {len(points)} responses, here by "
            f"{readable(far.walked, 'm', 3)} until soft supports hold them, or for {HORIZON:.0f} cycles: the "
            "response is the one there",
            "stiffer supports hold them sooner",
        )
    left = [p for p in points if p.walks and not _brought_on(p)]
    if left:
        fast = max(left, key=lambda p: abs(p.walk))
        yield Caution(
            "harmonic",
            f"{place}, {fast.frequency:.6g} Hz",
            f"the bodies walk past each other at {len(left)} of {len(points)} responses, here by "
            f"{readable(abs(fast.walk), 'm', 3)} in each cycle; the response is the one where they stand, "
            "and changes as they move on",
            "stiffer supports hold them; [analysis.time] follows them to where they rest"
            if adaptive
            else 'harmonics = "adaptive" follows them to where they rest',
        )


def _brought_on(point: HarmonicPoint) -> bool:
    """Whether the bodies of a response stand where a motion over time beside it has come to."""
    return bool(point.problem.offset.any() and np.isfinite(point.error))


CUT_OFF = 0.01
"""Relative error of an amplitude, by a tenth of its tail as adaptive harmonics take it, that is said."""

TELLING = 2
"""Harmonics up to which the last two are all there are."""


def _under(place: str, failure: Failure) -> Failure:
    """A failure under one of several loads."""
    where = ", ".join(part for part in (place, failure.where) if part)
    return replace(failure, where=where)


def loads_to_follow(assembly: Assembly, done: Mapping[str, Outcome[Any]]) -> list[Load]:
    """Loads of the forced response, each once; where there is none, those of the file."""
    responses = value_of(done, "response")
    found = loads_of_file(assembly) if responses is None else responses.loads
    return list(dict.fromkeys(found or loads_of_file(assembly)))


def follow(
    assembly: Assembly, settings: HarmonicAnalysis, load: Load, meter: _Meter, stop: threading.Event
) -> HarmonicRun:
    """Branches, points and stability under one load, as far as they come until `stop` is set."""
    friction = 0.0 if load.rho == 0 else assembly.measures.friction
    joint = assembly.prepared if friction else assembly.prepared.with_friction(0.0)
    problem = harmonic_problem(
        joint,
        harmonics=settings.branch_harmonics,
        samples=settings.samples,
    )
    adaptive = None
    if settings.harmonics == "adaptive":
        adaptive = Adaptive(tolerance=settings.tolerance, most=settings.most)
    response = frequency_response(
        problem,
        load.amplitude,
        settings.band(),
        adaptive=adaptive,
        over_time=OverTime(joint, load.amplitude),
        observe=meter.reached,
        solved=meter.solved,
        stop=stop.is_set,
    )
    stability: list[HillExponents | None] = []
    failures = list(response.failures)
    for point in response.points:
        try:
            wanted = settings.stability and not stop.is_set()
            stability.append(exponents_of(point) if wanted else None)
        except MicroslipError as error:
            stability.append(None)
            where = f"stability at {point.frequency:.6g} Hz"
            failures.append(Failure("harmonic", where, str(error)))
    meter.close()
    motions = tuple(
        outputs_along(followed, load.amplitude, way)
        for followed, way in zip(response.problems, response.branches, strict=True)
    )
    coordinate = problem.model.port(problem.coordinate)
    return HarmonicRun(
        rho=load.rho,
        friction=friction,
        load=load.amplitude,
        response=replace(response, failures=tuple(failures)),
        curves=tuple(
            (way.parameters, motion[:, coordinate])
            for way, motion in zip(response.branches, motions, strict=True)
        ),
        stability=tuple(stability),
        motions=motions,
    )


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


_TELLING = threading.Lock()


def _tell(progress: Progress, count: int) -> None:
    """Loads run side by side and report to one bar."""
    if count > 0:
        with _TELLING:
            progress.advance(count)

"""Steady states by time integration at every load and frequency."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from typing import Any

import numpy as np

from microslip.analyses.harmonic.points import WALKS
from microslip.analyses.reduced.response import Response
from microslip.analyses.time.point import Request, TimePoint
from microslip.analyses.time.points import steady_states
from microslip.analyses.time.several import coexisting_states
from microslip.analyses.time.steady import drift_of, walk_of
from microslip.analyses.time.step_refinement import REFINEMENT
from microslip.describe.requests import TimeAnalysis
from microslip.describe.units import readable
from microslip.errors import Caution, Failure
from microslip.pipeline.loads import loads_of_file
from microslip.pipeline.outcome import Outcome, until_interrupted, value_of
from microslip.pipeline.prepare import Assembly
from microslip.pipeline.progress import Progress
from microslip.pipeline.response import STIFFER, Responses, on_the_way

STEPS_ERROR = 1e-2
"""Error of the steps, relative, from which on it is worth a word: the one that method "auto" keeps below."""


def run_time_domain(
    assembly: Assembly, done: Mapping[str, Outcome[Any]], progress: Progress
) -> Outcome[tuple[TimePoint, ...]]:
    """Steady states, by load and frequency, from every start that the file asks for."""
    settings = _settings(assembly)
    if assembly.joint.analysis.response is None:
        requests = requests_from_rest(assembly)
    else:
        responses: Responses | None = value_of(done, "response")
        curves = () if responses is None else responses.curves
        if not curves and "reduced" in settings.starts:
            return Outcome((), (Failure("time", "", "no forced response to start from"),))
        requests = requests_of(assembly, curves) if curves else requests_from_rest(assembly)
    found: list[TimePoint] = []
    failures: list[Failure] = []
    progress.start("time domain", len(requests))
    with until_interrupted() as stop:
        states = coexisting_states(assembly.prepared, requests, settings.starts)
        for request, answers in zip(requests, states, strict=True):
            for point, failure in (judged(request, answer) for answer in answers):
                found += [] if point is None else [point]
                failures += [] if failure is None else [failure]
            progress.advance()
        progress.finish()
    found.sort(key=lambda p: (np.nan_to_num(p.rho), p.steady.load, p.steady.frequency))
    cautions = list(walking(found, assembly.prepared.model.dimension))
    if settings.step_refinement:
        cautions += stepping(found, settings.steps)
    return Outcome(tuple(found), tuple(failures), stop.is_set(), cautions=tuple(cautions))


def walking(points: Sequence[TimePoint], dimension: int) -> Iterator[Caution]:
    """Where bodies have walked past each other until they came to rest, and where they go on."""
    settled = [p for p in points if p.settled]
    rested = [p for p in settled if p.lasts and not p.ahead]
    if rested:
        far = max(rested, key=lambda point: point.walked)
        yield Caution(
            "time",
            _place(far),
            f"the bodies walk past each other at {len(rested)} of {len(points)} points, here by "
            f"{readable(far.walked, 'm', 3)} in about {far.lasts:.2g} cycles, until soft supports hold them: "
            "the motion is the one where they come to rest",
            "stiffer supports hold them sooner; [[analysis.history]] marches the motion on the way",
        )
    ahead = [p for p in settled if p.ahead]
    if ahead:
        most = max(ahead, key=lambda point: np.nan_to_num(abs(point.ahead)))
        among = f"{len(ahead)} of {len(points)} points"
        reason = on_the_way(among, "here", most.ahead, most.lasts)
        yield Caution("time", _place(most), reason, STIFFER)
    other = [p for p in settled if not p.lasts]
    walks = [abs(walk_of(point.steady, dimension)) for point in other]
    if max(walks, default=0.0) > WALKS:
        worst = other[int(np.argmax(walks))]
        drift = readable(abs(drift_of(worst.steady, dimension)), "m", 3)
        yield Caution(
            "time",
            _place(worst),
            f"the bodies walk past each other at {sum(walk > WALKS for walk in walks)} of {len(points)} "
            f"points, here by {drift} in each cycle, and where they come to rest was not found: the "
            "vibration repeats, but moves on with them",
            "stiffer supports hold them; [[analysis.history]] marches the motion",
        )


def stepping(points: Sequence[TimePoint], steps: int) -> Iterator[Caution]:
    """Where the time steps matter, and where it is not known whether they do."""
    settled = [p for p in points if p.settled]
    off = [p for p in settled if p.steps_error > STEPS_ERROR]
    if off:
        worst = max(off, key=lambda point: point.steps_error)
        yield Caution(
            "time",
            _place(worst),
            f"time steps may put the motion off by more than {100 * STEPS_ERROR:g} % at {len(off)} of "
            f"{len(points)} points: here {worst.steps} per cycle have changed it by "
            f"{100 * worst.steps_error:.2g} %",
            f"take steps = {2 * steps} or more",
        )
    unknown = [p for p in settled if not np.isfinite(p.steps_error)]
    if unknown:
        first = unknown[0]
        yield Caution(
            "time",
            _place(first),
            f"what the time steps do to the motion is not known at {len(unknown)} of {len(points)} points: "
            f"with more than {first.steps} per cycle {first.unrefined or 'none was sought'}",
            f"take steps = {max(2 * steps, *(p.steps for p in unknown))} or more",
        )


def _place(point: TimePoint) -> str:
    return f"{point.steady.frequency:.6g} Hz"


def requests_of(assembly: Assembly, curves: Sequence[Response]) -> list[Request]:
    """What to find: every frequency under every load, from the best model that there is."""
    band = _settings(assembly).band()
    by_load = {r.load: r for r in curves if r.variant in ("refined", "corrected", "auto")}
    by_load = by_load or {r.load: r for r in curves if r.variant == "consistent"}
    by_load = by_load or {r.load: r for r in curves}
    requests = []
    for response in by_load.values():
        real = np.interp(band, response.frequency, response.amplitude.real)
        imag = np.interp(band, response.frequency, response.amplitude.imag)
        rough = response.friction > 0
        requests += [
            _request(assembly, response.rho, response.load, f, complex(guess), rough)
            for f, guess in zip(band, real + 1j * imag, strict=True)
        ]
    return requests


def requests_from_rest(assembly: Assembly) -> list[Request]:
    """What to find where there is no reduced model: the same, with loads raised from rest."""
    band, rough = _settings(assembly).band(), assembly.measures.friction > 0
    return [
        _request(assembly, load.rho, load.amplitude, f, 0j, rough)
        for load in loads_of_file(assembly)
        for f in band
    ]


def _settings(assembly: Assembly) -> TimeAnalysis:
    settings = assembly.joint.analysis.time
    assert settings is not None
    return settings


def _request(
    assembly: Assembly, rho: float, load: float, frequency: float, guess: complex, rough: bool
) -> Request:
    """One frequency under one load; `rough` where there is friction."""
    settings = _settings(assembly)
    return Request(
        rho=rho,
        frequency=frequency,
        load=load,
        friction=None if rough else 0.0,
        guess=guess,
        steps=settings.steps,
        tolerance=settings.tolerance,
        max_cycles=settings.max_cycles,
        accelerate=settings.search == "accelerated",
        refinement=REFINEMENT if settings.step_refinement else 1,
        said=assembly.joint.driven.load.named(load),
    )


def integrate(
    assembly: Assembly, requests: Sequence[Request]
) -> Iterator[tuple[TimePoint | None, Failure | None]]:
    """Answers in the order of the requests, in threads, and what is wrong with them.

    A point that is not steady is an answer and a failure.
    """
    found = steady_states(assembly.prepared, requests)
    for request, outcome in zip(requests, found, strict=True):
        yield judged(request, outcome)


def judged(
    request: Request, answer: TimePoint | Failure
) -> tuple[TimePoint | None, Failure | None]:
    """An answer to a request, if it is one, and what is wrong with it."""
    if isinstance(answer, Failure):
        return None, answer
    steady = answer.steady
    if steady.converged:
        return answer, None
    reason = f"not steady after {steady.cycles} cycles, last change {steady.change:.1e}"
    if answer.left is not None and answer.left.stability is not None:
        reason = (
            "the periodic motion that was found is unstable (Floquet multiplier of modulus "
            f"{answer.left.stability.largest:.4g}), and what leaves it does not settle"
        )
    if answer.motion is not None:
        reason = f"{reason}: {answer.motion.said}"
    return answer, Failure("time", request.place, reason)

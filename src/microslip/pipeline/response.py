"""Forced response of every variant of the reduced model under every load."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import partial
from threading import Event
from typing import Any

import numpy as np

from microslip.analyses.harmonic.points import WALKS
from microslip.analyses.reduced.response import Response, forced_response, swept_both_ways
from microslip.analyses.reduced.sweep import OUTSIDE
from microslip.analyses.reduced.trust import error_indicator
from microslip.analyses.reduced.two_mode import two_mode_model
from microslip.analyses.time.offset import HORIZON
from microslip.brief import Brief
from microslip.describe.requests import ResponseAnalysis
from microslip.describe.units import readable
from microslip.errors import Caution, Failure, MicroslipError
from microslip.pipeline.auto import Anchored, anchored_response, other_pasts, unsure, varying
from microslip.pipeline.band import MOVES_IN_TIME, Axis, Curve, axis_of
from microslip.pipeline.checked import checks, not_as_in_time
from microslip.pipeline.corrected import Corrected, corrected_response
from microslip.pipeline.loads import (
    Load,
    frictionless_response,
    loads_of_file,
    opening_amplitude,
)
from microslip.pipeline.outcome import Outcome, until_interrupted, value_of
from microslip.pipeline.outputs import Model, with_outputs
from microslip.pipeline.outputs_held import doubtful_outputs
from microslip.pipeline.prepare import Assembly
from microslip.pipeline.progress import Progress
from microslip.pipeline.reduced import tables_of
from microslip.pipeline.search import Search
from microslip.pipeline.unanswered import opening_of, response_failures, two_motions, with_opening
from microslip.typing import Array

STIFFER = "stiffer supports hold them"
"""Advice where bodies walk on past each other."""

TABLE_OF = {"printed": "load", "consistent": "mode", "refined": "prescribed"}
"""Drive of the table that each variant uses by default: the paper's, and the dynamic ones."""


@dataclass(frozen=True, repr=False)
class Responses(Brief):
    """Forced responses, and what they are compared with.

    Attributes
    ----------
    curves : tuple of Response
        Load by load, every variant.
    frictionless : Response or None
        The joint without friction under the first load, eq. (18).
    loads : tuple of Load
    axis : Axis or None
        Frequencies, and what they follow from.
    """

    curves: tuple[Response, ...] = ()
    frictionless: Response | None = None
    loads: tuple[Load, ...] = ()
    axis: Axis | None = None

    def __len__(self) -> int:
        return len(self.curves)


def run_responses(
    assembly: Assembly, done: Mapping[str, Outcome[Any]], progress: Progress
) -> Outcome[Responses]:
    """Responses under all loads; points without an answer and missing peaks are failures."""
    models = models_of(assembly, done)
    if not models:
        reason = "no table of equivalent stiffness and damping"
        return Outcome(Responses(), (Failure("response", "", reason),))
    found, cases, axis = Outcome(Responses()), list[Curve](), None
    with until_interrupted() as stop:
        try:
            loads = loads_of_file(assembly, tables_of(done))
            cases = [_case(assembly, models, name, load) for load in loads for name in models]
            axis, known = axis_of(assembly, cases), dict[int, Search]()
        except MicroslipError as error:
            return Outcome(Responses(), (Failure("response", "", str(error)),))

        def over(axis: Axis) -> Iterator[Outcome[Responses]]:
            return _over(assembly, models, cases, loads, axis, known, stop, progress)

        for more in over(axis):
            found = more  # Ctrl-C leaves that
        for _ in range(MOVES_IN_TIME):
            timed = [one for one in found.value.curves if one.anchors]
            if stop.is_set() or not any(axis.cut_off(timed)):
                break
            wider = axis.wider(timed)
            for more in over(wider):
                if len(more.value) == len(cases):  # else all of a narrower band is more
                    axis, found = wider, more
            if axis is not wider:
                break
    cautions = list(found.cautions)
    for case, curve in zip(cases, found.value.curves, strict=False):
        if axis is not None and curve.anchors and any(ends := axis.cut_off([curve])):
            cautions.append(_cut_off(case, curve, axis, low=ends[0]))
    interrupted = found.interrupted or stop.is_set()
    return replace(found, interrupted=interrupted, cautions=tuple(cautions))


def _over(
    assembly: Assembly,
    models: Mapping[str, Model],
    cases: Sequence[Curve],
    loads: tuple[Load, ...],
    axis: Axis,
    known: dict[int, Search],
    stop: Event,
    progress: Progress,
) -> Iterator[Outcome[Responses]]:
    """All curves over a band, as far as they are known, after each.

    `known` has what method "auto" knows of each over a part of the band, and knows of all of it afterwards.
    """
    settings = assembly.joint.analysis.response
    assert settings is not None
    found, failures, cautions = Responses(loads=loads, axis=axis), list[Failure](), list[Caution]()
    states = {"auto": settings.points, "corrected": settings.corrections}
    most = states.get(settings.method, 1)
    steps = [most if _corrigible(case) else 1 for case in cases]
    try:
        linear = frictionless_response(assembly, axis.frequency, loads[0].amplitude)
        found = replace(found, frictionless=linear)
        yield Outcome(found)
        progress.start("forced response" + (", wider band" if known else ""), sum(steps))
        for number, (case, share) in enumerate(zip(cases, steps, strict=True)):
            base = case.respond(axis.frequency)
            rest, opens = share, True
            if settings.method == "corrected" and _corrigible(case):
                corrected = corrected_response(
                    assembly, settings, case, base, stop, progress.advance
                )
                curve, opens = corrected.response, corrected.opens
                rest = max(share - len(curve.anchors) - len(corrected.unsteady), 0)
                cautions += _of_corrected(settings, case, corrected)
            elif settings.method == "auto" and _corrigible(case):
                auto, rest = _put_right(
                    assembly, settings, case, base, stop, share, progress, known.get(number)
                )
                curve, opens = auto.response, auto.opens
                known[number] = auto.search
                cautions += _cautions(settings, case, auto)
            else:
                curve = _judged(base, models)
                if _corrigible(case):
                    curve = replace(curve, checks=checks(assembly, curve, settings.checks, stop))
                    cautions += not_as_in_time(f"refined, {case.load}", curve)
            if not curve.outputs:
                curve = with_outputs(assembly, models, curve)
            place = f"{settings.method}, {case.load}"
            cautions += doubtful_outputs(curve, settings.error, place)
            curve = with_opening(assembly, curve, case) if opens else curve
            found = replace(found, curves=(*found.curves, curve))
            failures += response_failures(curve, case, axis)
            cautions += opening_of(assembly, curve, case)
            cautions += two_motions(curve, case)
            yield Outcome(found, tuple(failures), stop.is_set(), cautions=tuple(cautions))
            progress.advance(rest)
            if stop.is_set():
                break
        progress.finish()
    except MicroslipError as error:
        failures.append(Failure("response", "", str(error)))
        yield Outcome(found, tuple(failures), stop.is_set(), cautions=tuple(cautions))


def _corrigible(case: Curve) -> bool:
    """Whether a case is one of the refined model with friction."""
    return case.table is not None and case.table.uncertainty is not None


def _put_right(
    assembly: Assembly,
    settings: ResponseAnalysis,
    case: Curve,
    base: Response,
    stop: Event,
    points: int,
    progress: Progress,
    known: Search | None,
) -> tuple[Anchored, int]:
    """A response by method "auto", and how many points it did without."""
    sought = 0

    def advance(count: int) -> None:
        nonlocal sought
        sought += count
        progress.advance(count)

    found = anchored_response(assembly, settings, case, base, stop, advance, known)
    return found, max(points - sought, 0)


def _cautions(settings: ResponseAnalysis, case: Curve, auto: Anchored) -> list[Caution]:
    """Where the bound of a response is above what is asked for."""
    place, found = f"auto, {case.load}", []
    curve, lost = auto.response, auto.lost
    if lost:
        reason = f"no steady state found at {len(lost)} of the frequencies sought, first "
        found.append(
            Caution(
                "response",
                place,
                reason + lost[0],
                "the error beside them is not bounded; [analysis.time] says what the motion is",
            )
        )
    found += _smaller(place, auto)
    moving = varying(curve, settings.error)
    if len(moving):
        farthest = max(one.varies for one in curve.anchors)
        reason = (
            f"the amplitude varies from cycle to cycle, and for good, by up to {farthest:.2g} of its mean, "
            f"which is shown; the error is not below {settings.error:g} for that at {len(moving)} of "
            f"{len(curve.frequency)} frequencies, {moving.min():.6g} to {moving.max():.6g} Hz"
        )
        advice = "no single amplitude is the answer there; [[analysis.history]] marches the motion"
        found.append(Caution("response", place, reason, advice))
    doubtful = np.setdiff1d(unsure(curve, settings.error), moving)
    if len(doubtful):
        reason = (
            f"the error is not below {settings.error:g} at {len(doubtful)} of "
            f"{len(curve.frequency)} frequencies, {doubtful.min():.6g} to {doubtful.max():.6g} Hz, "
            f"after {auto.spent} of processor time"
        )
        advice = "raise analysis.response.points"
        found.append(Caution("response", place, reason, advice))
    found += _come_to_rest(place, auto.walks)
    found += _walk_on(place, auto.walks_on)
    elsewhere = other_pasts(curve, settings.error)
    if len(elsewhere):
        reason = (
            f"after another past than the load raised from rest the amplitude differs by more than "
            f"{settings.error:g} at {len(elsewhere)} frequencies, {elsewhere.min():.6g} to "
            f"{elsewhere.max():.6g} Hz"
        )
        advice = (
            "pairs that never slip keep what they were left with; [analysis.time] has other starts"
        )
        found.append(Caution("response", place, reason, advice))
    return found


def _smaller(place: str, auto: Anchored) -> list[Caution]:
    """That smaller motions are shown where larger ones do not repeat, and how large these are."""
    if not auto.outgrown:
        return []
    spans = ", ".join(f"{one.low:.6g} to {one.high:.6g} Hz" for one in auto.outgrown)
    sizes = [one.times for one in auto.outgrown if np.isfinite(one.times)]
    size = f", and the larger are up to {max(sizes):.3g} times as large" if sizes else ""
    reason = (
        f"larger motions do not repeat, they vary from cycle to cycle for good, or are left: smaller ones "
        f"that do are shown, {spans}{size}"
    )
    advice = (
        "a joint that vibrates so already may go on; [[analysis.history]] marches such a motion"
    )
    return [Caution("response", place, reason, advice)]


def _come_to_rest(place: str, walks: Sequence[tuple[float, float]]) -> list[Caution]:
    """That the response is where bodies that walk have come to rest: how far, m, and in how many cycles.

    What is there within a cycle has not walked.
    """
    walking = [one for one in walks if one[1] >= 1]
    if not walking:
        return []
    far, long = (max(values) for values in zip(*walking, strict=True))
    reason = (
        f"the bodies walk past each other at {len(walking)} of the frequencies sought, by up to "
        f"{readable(far, 'm', 3)} in about {long:.2g} cycles; the response is where they come to rest"
    )
    advice = "stiffer supports hold them sooner; [[analysis.history]] marches the motion on the way"
    return [Caution("response", place, reason, advice)]


def _walk_on(place: str, walks: Sequence[tuple[float, float]]) -> list[Caution]:
    """That bodies have not come to rest in the motion that is shown, and what it is then, if known."""
    if not walks:
        return []
    ahead, lasts = max(walks, key=lambda one: np.nan_to_num(abs(one[0])))
    reason = on_the_way(f"{len(walks)} of the frequencies sought", "at one", ahead, lasts)
    return [Caution("response", place, reason, STIFFER)]


def on_the_way(among: str, where: str, ahead: float, lasts: float) -> str:
    """That bodies walk on in the motion that is shown, and what it is where they come to rest, if known.

    Parameters
    ----------
    among, where : str
        How many of what, and at which of them the amplitude will change most.
    ahead, lasts : float
        By how much, relative, until they rest, and in how many cycles; nan where that is not found.
    """
    end = "where they come to rest was not found"
    if np.isfinite(ahead):
        end = (
            f"{where} they come to rest after about {lasts:.2g}, where the amplitude is "
            f"{100 * ahead:+.2g} % off"
        )
    return (
        f"the bodies walk past each other at {among} for more than {HORIZON:.0f} cycles, after which the "
        f"motion is shown: {end}"
    )


def _cut_off(case: Curve, curve: Response, axis: Axis, low: bool) -> Caution:
    """That a curve is largest at an end of its band, the lower one or the upper."""
    which, end, key = ("lower", axis.low, "from") if low else ("upper", axis.high, "to")
    reason = (
        f"for all that is known it is largest at the {which} end of the band, {end:.6g} Hz, "
        "beyond which its resonance may lie"
    )
    return Caution(
        "response", f"{curve.variant}, {case.load}", reason, f"give analysis.response.{key}"
    )


def _of_corrected(settings: ResponseAnalysis, case: Curve, found: Corrected) -> list[Caution]:
    """Where the bound of a corrected response is above what is asked for, and where its bodies walk."""
    curve, unsteady = found.response, found.unsteady
    place, said = f"corrected, {case.load}", list[Caution]()
    doubtful = unsure(curve, settings.error)
    if len(doubtful):
        reason = (
            f"the error is not below {settings.error:g} at {len(doubtful)} of {len(curve.frequency)} "
            f"frequencies, {doubtful.min():.6g} to {doubtful.max():.6g} Hz, after "
            f"{len(curve.anchors) + len(unsteady)} steady states"
        )
        if len(unsteady):
            reason += f"; the motion is not steady at {len(unsteady)} of these, first {unsteady[0]:.6g} Hz"
        advice = 'raise analysis.response.corrections, or take method = "auto" there'
        said.append(Caution("response", place, reason, advice))
    motions = found.motions
    rests = [one for one in motions if one.walk <= WALKS]
    said += _come_to_rest(place, [(one.walked, one.lasts) for one in rests])
    rates = [one.walk for one in motions if one.walk > WALKS]
    if rates:
        reason = (
            f"the bodies walk on past each other at {len(rates)} of {len(motions)} steady states, by up to "
            f"{max(rates):.2g} of the slip in each cycle: the response is that of bodies on their way, and "
            "may be another where they come to rest"
        )
        advice = "stiffer supports hold them; [analysis.time] looks for where they rest"
        said.append(Caution("response", place, reason, advice))
    return said


def models_of(assembly: Assembly, done: Mapping[str, Outcome[Any]]) -> dict[str, Model]:
    """Every variant that is asked for and has a table, with that table.

    The joint without friction needs none.
    """
    tables, refined = tables_of(done), value_of(done, "reduced")
    idle = assembly.measures.friction == 0 or not assembly.joint.load_amplitudes()
    models: dict[str, Model] = {}
    for variant in assembly.joint.variants:
        drive = TABLE_OF[variant]
        drive = assembly.joint.drive_named(drive) if drive == "load" else drive
        if drive not in tables and variant != "refined":
            drive = next((name for name in tables if name != "prescribed"), "")
        if drive in tables or idle:
            if refined is not None and drive == "prescribed":
                linear = refined.model_of(assembly)
            else:
                linear = two_mode_model(assembly.prepared, variant)
            models[variant] = (linear, tables.get(drive))
    return models


def _case(assembly: Assembly, models: Mapping[str, Model], variant: str, load: Load) -> Curve:
    """A variant under a load, ready to be computed over any frequencies."""
    model, table = models[variant]
    settings, friction = assembly.joint.analysis.response, assembly.measures.friction
    assert settings is not None
    frictionless = table is None or load.rho == 0 or friction == 0
    limit = opening_amplitude(assembly) if frictionless else np.inf

    def sweep(frequency: Array, downward: bool) -> Response:
        found = forced_response(
            model,
            None if frictionless else table,
            frequency,
            load.amplitude,
            rho=load.rho,
            friction=0.0 if frictionless else friction,
            variant=variant,
            tolerance=settings.tolerance,
            max_iterations=settings.max_iterations,
            downward=downward,
        )
        opened = np.abs(found.amplitude) > limit
        return replace(found, flag=np.where(opened, OUTSIDE, found.flag)) if opened.any() else found

    def respond(frequency: Array) -> Response:
        return swept_both_ways(partial(sweep, frequency))

    return Curve(load, model, None if frictionless else table, respond)


def _judged(response: Response, models: Mapping[str, Model]) -> Response:
    """The same with its error indicator, where there are friction and a refined model."""
    model, table = models.get("refined", (None, None))
    if not response.drive or model is None or table is None:
        return response
    return replace(response, error_indicator=error_indicator(response, model, table))

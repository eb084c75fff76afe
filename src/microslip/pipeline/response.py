"""Forced response of every variant of the reduced model under every load."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from microslip.analyses.reduced.response import Response, forced_response
from microslip.analyses.reduced.trust import error_indicator
from microslip.analyses.reduced.two_mode import two_mode_model
from microslip.brief import Brief
from microslip.errors import Failure, MicroslipError
from microslip.pipeline.loads import (
    Load,
    Model,
    frictionless_response,
    gentle_moment,
    given_scale,
    loads_of_file,
    scale_of_file,
)
from microslip.pipeline.outcome import Outcome, until_interrupted, value_of
from microslip.pipeline.outputs import with_outputs
from microslip.pipeline.prepare import Assembly
from microslip.pipeline.progress import Progress
from microslip.pipeline.reduced import tables_of
from microslip.typing import Array

TABLE_OF = {"printed": "moment", "consistent": "mode", "refined": "prescribed"}
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
    rho_scale : float
        C in ``rho = C mu P L / M``; nan where loads were given as moments.
    """

    curves: tuple[Response, ...] = ()
    frictionless: Response | None = None
    loads: tuple[Load, ...] = ()
    rho_scale: float = np.nan

    def __len__(self) -> int:
        return len(self.curves)


def run_responses(
    assembly: Assembly, done: Mapping[str, Outcome[Any]], progress: Progress
) -> Outcome[Responses]:
    """Responses under all loads; points without an answer in the table are failures."""
    settings = assembly.joint.analysis.response
    assert settings is not None
    models = models_of(assembly, done)
    if not models:
        reason = "no table of equivalent stiffness and damping"
        return Outcome(Responses(), (Failure("response", "", reason),))
    frequency = np.linspace(settings.from_, settings.to, settings.count)
    found = Responses()
    failures: list[Failure] = []
    with until_interrupted() as stop:
        try:
            found = replace(found, rho_scale=scale_of_file(assembly, models))
            linear, tables = frictionless_response(assembly, frequency), tables_of(done)
            loads = loads_of_file(
                assembly, found.rho_scale, lambda: gentle_moment(assembly, linear, tables)
            )
            found = replace(
                found,
                loads=loads,
                frictionless=frictionless_response(assembly, frequency, loads[0].moment),
            )
            progress.start("forced response", len(loads) * len(models))
            for load in loads:
                for variant in models:
                    curve = _respond(assembly, models, variant, load, frequency)
                    curve = with_outputs(assembly, models, curve)
                    found = replace(found, curves=(*found.curves, curve))
                    failures += _unanswered(curve)
                    progress.advance()
            progress.finish()
        except MicroslipError as error:
            failures.append(Failure("response", "", str(error)))
    return Outcome(found, tuple(failures), stop.is_set())


def models_of(assembly: Assembly, done: Mapping[str, Outcome[Any]]) -> dict[str, Model]:
    """Every variant that is asked for and has a table, with that table."""
    tables, refined = tables_of(done), value_of(done, "reduced")
    models = {}
    for variant in assembly.joint.variants:
        drive = TABLE_OF[variant]
        if drive not in tables and variant != "refined":
            drive = next((name for name in tables if name != "prescribed"), "")
        if drive in tables:
            offset = refined.offset if variant == "refined" else 0.0
            linear = two_mode_model(assembly.prepared, variant, offset)
            models[variant] = (linear, tables[drive])
    return models


def _respond(
    assembly: Assembly, models: Mapping[str, Model], variant: str, load: Load, frequency: Array
) -> Response:
    """Response of one variant, with its error indicator where there is a refined model."""
    model, table = models[variant]
    settings, friction = assembly.joint.analysis.response, assembly.joint.friction
    assert settings is not None
    frictionless = load.rho == 0 or friction == 0
    response = forced_response(
        model,
        None if frictionless else table,
        frequency,
        load.moment,
        rho=load.rho,
        friction=0.0 if frictionless else friction,
        variant=variant,
        tolerance=settings.tolerance,
        max_iterations=settings.max_iterations,
    )
    if frictionless or "refined" not in models:
        return response
    return replace(response, error_indicator=error_indicator(response, *models["refined"]))


def _unanswered(response: Response) -> list[Failure]:
    bad = response.unconverged
    if not len(bad):
        return []
    place = f"{response.variant}, M = {response.load:.4g} N m/m"
    reason = (
        f"{len(bad)} of {len(response.frequency)} points have no answer in the table, "
        f"{bad.min():.2f} to {bad.max():.2f} Hz"
    )
    return [Failure("response", place, reason)]


def known_scale(assembly: Assembly, done: Mapping[str, Outcome[Any]]) -> float:
    """C in ``rho = C mu P L / M`` as given, or as the forced response calibrated it; else nan."""
    given, responses = given_scale(assembly), value_of(done, "response")
    if np.isfinite(given) or responses is None:
        return given
    scale: float = responses.rho_scale
    return scale

"""What can be computed of a joint: one row per analysis, and nothing else lists them.

A row names what belongs to an analysis on every floor of the house: its section of the input file,
what it will compute and at what cost, how it runs, the motions, rows, datasets, tables and figures of
what it found. Each is a function or a reference to one, ``"package.module:name"``, resolved on use:
the table stands on the ground and imports nothing above it.

Everything that lists analyses goes through `ANALYSES`, in its order: the run, the summary, the
dataset, the terminal, the figures, ``check``. A new analysis is one row given to `register`.
"""

from __future__ import annotations

import pkgutil
from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass, field
from typing import Any, TypeAlias

from microslip.errors import MicroslipError

Reference: TypeAlias = Callable[..., Any] | str
"""A function (or class), or where it is: ``"package.module:name"``."""

ADD_SECTION = "microslip.describe.requests:add_section"
REMOVE_SECTION = "microslip.describe.requests:remove_section"
"""How the input file learns of a section, and forgets it: (name, model) and (name)."""


@dataclass(frozen=True)
class Analysis:
    """One analysis, from the input file to the figure.

    Attributes
    ----------
    name : str
        Section of the input file: ``[analysis.name]``; also what its failures are called.
    section : Reference
        Its model: a `pydantic` class.
    run : Reference
        ``(assembly, done, progress) -> Outcome``, or None where there is nothing to compute.
        ``done`` has the outcomes of `after` by name, as far as there are any.
    after : tuple of str
        Analyses whose outcome it takes; they stand above it.
    label : str
        Of its time among the timings; `name` where left out.
    request : Reference, optional
        ``(joint) -> iterable`` of names and values: what it will compute, for ``microslip check``.
        Called where it is asked for.
    cost : Reference, optional
        ``(joint) -> float``: seconds on one core; 0 where it is not asked for.
    motions : Reference, optional
        ``(run) -> iterable`` of `microslip.pipeline.motions.Motion`: how far the joint moves, for
        the stresses that are judged.
    rows : mapping of str to Reference
        Key of the summary, and ``(run) -> list of dict``.
    datasets : Reference, optional
        ``(run) -> dict``: groups of ``results.nc`` by name.
    table : Reference, optional
        ``(summary) -> iterable`` of lines and `rich` tables for the terminal.
    figures : mapping of str to Reference
        File name, and ``(run) -> Figure``, None where there is nothing to show; of several, a
        mapping whose keys are appended to the file name.
    """

    name: str
    section: Reference
    run: Reference
    after: tuple[str, ...] = ()
    label: str = ""
    request: Reference | None = None
    cost: Reference | None = None
    motions: Reference | None = None
    rows: Mapping[str, Reference] = field(default_factory=dict)
    datasets: Reference | None = None
    table: Reference | None = None
    figures: Mapping[str, Reference] = field(default_factory=dict)


def resolved(reference: Reference) -> Any:
    """What a reference stands for.

    Examples
    --------
    >>> resolved("math:sqrt")(9.0)
    3.0
    """
    return pkgutil.resolve_name(reference) if isinstance(reference, str) else reference


def column(name: str) -> Iterator[tuple[Analysis, Any]]:
    """Every row that has something in a column, and what that stands for.

    Examples
    --------
    >>> [row.name for row, _ in column("run")][:2]
    ['backbone', 'cycle']
    """
    for row in tuple(ANALYSES.values()):
        reference = getattr(row, name)
        if reference is not None:
            yield row, resolved(reference)


def register(row: Analysis) -> None:
    """Add an analysis below those that are there, and its section to the input file.

    Raises
    ------
    MicroslipError
        Where its name, a key of its summary or a name of a figure is taken, or it comes after one
        that is not there.
    """
    if row.name in ANALYSES:
        raise MicroslipError(f"analysis {row.name!r}: there is one of this name already")
    for other in ANALYSES.values():
        for what in ("rows", "figures"):
            for name in set(getattr(row, what)) & set(getattr(other, what)):
                raise MicroslipError(
                    f"analysis {row.name!r}: {name!r} among its {what} is one of {other.name!r}"
                )
    for name in row.after:
        if name not in ANALYSES:
            raise MicroslipError(f"analysis {row.name!r}: comes after {name!r}, which is not there")
    resolved(ADD_SECTION)(row.name, resolved(row.section))
    ANALYSES[row.name] = row


def unregister(name: str) -> None:
    """Take an analysis out again, and its section from the input file.

    Raises
    ------
    MicroslipError
        Where there is none, or another one takes its outcome.
    """
    if name not in ANALYSES:
        raise MicroslipError(f"analysis {name!r}: there is none of this name")
    for other in ANALYSES.values():
        if name in other.after:
            raise MicroslipError(f"analysis {name!r}: {other.name!r} takes its outcome")
    resolved(REMOVE_SECTION)(name)
    del ANALYSES[name]


ANALYSES: dict[str, Analysis] = {
    row.name: row
    for row in (
        Analysis(
            name="backbone",
            label="backbones",
            section="microslip.describe.requests:BackboneAnalysis",
            run="microslip.pipeline.backbone:run_backbones",
            request="microslip.pipeline.asked:backbone_request",
            cost="microslip.pipeline.cost:backbone_seconds",
            rows={"backbone": "microslip.results.backbone:backbone_rows"},
            datasets="microslip.results.backbone:backbone_datasets",
            table="microslip.show.tables:backbone_table",
            figures={"backbones": "microslip.show.plots.backbones:backbones_figure"},
        ),
        Analysis(
            name="cycle",
            label="cycles",
            section="microslip.describe.requests:CycleAnalysis",
            run="microslip.pipeline.cycle:run_cycles",
            request="microslip.pipeline.asked:cycle_request",
            cost="microslip.pipeline.cost:cycle_seconds",
            motions="microslip.pipeline.motions:cycle_motions",
            rows={"cycles": "microslip.results.cycle:cycle_rows"},
            datasets="microslip.results.cycle:cycle_datasets",
            table="microslip.show.tables:cycle_lines",
            figures={
                "contact_states": "microslip.show.plots.states:states_figure",
                "tractions": "microslip.show.plots.tractions:tractions_figure",
                "hysteresis": "microslip.show.plots.hysteresis:hysteresis_figure",
                "equivalent": "microslip.show.plots.equivalent:equivalent_figure",
                "dissipation": "microslip.show.plots.dissipation:dissipation_figure",
                "moment_rotation": "microslip.show.plots.loops:moment_rotation_figure",
                "energy": "microslip.show.plots.energy:energy_figure",
            },
        ),
        Analysis(
            name="reduced",
            label="cycles_prescribed",
            section="microslip.describe.requests:ReducedAnalysis",
            run="microslip.pipeline.reduced:run_refined",
            after=("cycle",),
            cost="microslip.pipeline.cost:refined_seconds",
        ),
        Analysis(
            name="response",
            section="microslip.describe.requests:ResponseAnalysis",
            run="microslip.pipeline.response:run_responses",
            after=("cycle", "reduced"),
            request="microslip.pipeline.asked:response_request",
            cost="microslip.pipeline.cost:response_seconds",
            motions="microslip.pipeline.motions:response_motions",
            rows={
                "response": "microslip.results.response:response_rows",
                "response_band": "microslip.results.response:band_rows",
            },
            datasets="microslip.results.response:response_datasets",
            table="microslip.show.tables:response_table",
            figures={"response": "microslip.show.plots.response:response_figure"},
        ),
        Analysis(
            name="harmonic",
            section="microslip.describe.requests:HarmonicAnalysis",
            run="microslip.pipeline.harmonic:run_harmonic",
            after=("response",),
            request="microslip.pipeline.asked:harmonic_request",
            cost="microslip.pipeline.cost:harmonic_seconds",
            motions="microslip.pipeline.motions:harmonic_motions",
            rows={
                "harmonic": "microslip.results.harmonic:harmonic_rows",
                "harmonic_folds": "microslip.results.harmonic:fold_rows",
            },
            datasets="microslip.results.harmonic:harmonic_datasets",
            table="microslip.show.tables:harmonic_table",
            figures={"harmonic": "microslip.show.plots.harmonic:harmonic_figure"},
        ),
        Analysis(
            name="time",
            label="time_domain",
            section="microslip.describe.requests:TimeAnalysis",
            run="microslip.pipeline.time:run_time_domain",
            after=("response",),
            request="microslip.pipeline.asked:time_request",
            cost="microslip.pipeline.cost:time_seconds",
            motions="microslip.pipeline.motions:time_motions",
            rows={"time_domain": "microslip.results.time:time_rows"},
            datasets="microslip.results.time:time_datasets",
            table="microslip.show.tables:time_table",
            figures={"steady_state": "microslip.show.plots.steady:steady_figure"},
        ),
        Analysis(
            name="history",
            label="histories",
            section="microslip.describe.excitation:AnyExcitation",
            run="microslip.pipeline.history:run_histories",
            after=("response",),
            request="microslip.pipeline.asked:history_request",
            cost="microslip.pipeline.cost:history_seconds",
            motions="microslip.pipeline.motions:history_motions",
            rows={"history": "microslip.results.history:history_rows"},
            datasets="microslip.results.history:history_datasets",
            table="microslip.show.tables:history_table",
            figures={"history": "microslip.show.plots.history:history_figures"},
        ),
    )
}
"""Every analysis by name, in the order in which they run and are shown."""

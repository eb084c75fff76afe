"""Table of the refined model: cycles with the mode's motion prescribed."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

from microslip.analyses.reduced.refined import load_offset, refined_table
from microslip.analyses.reduced.table import EquivalentTable
from microslip.analyses.statics.prescribed import hold_mode
from microslip.brief import Brief
from microslip.pipeline.outcome import Outcome, value_of
from microslip.pipeline.prepare import Assembly
from microslip.pipeline.progress import Progress

BELOW = 0.1
"""Smallest amplitude of the refined table over that of the other: there the joint sticks."""


@dataclass(frozen=True, repr=False)
class Refined(Brief):
    """What the refined model reads.

    Attributes
    ----------
    table : EquivalentTable
    offset : float
        c of the refined model, `microslip.analyses.reduced.refined.load_offset`.
    """

    table: EquivalentTable
    offset: float


def run_refined(
    assembly: Assembly, done: Mapping[str, Outcome[Any]], progress: Progress
) -> Outcome[Refined] | None:
    """Table over the amplitudes of the cycles', where a response reads it and there is friction."""
    joint = assembly.joint
    tables = tables_of(done)
    if "refined" not in joint.variants or not tables or joint.friction == 0:
        return None
    settings = joint.analysis.reduced
    sizes = tables.get("mode", next(iter(tables.values()))).amplitude
    smallest = BELOW * float(sizes[0])
    return tabulate(
        assembly,
        smallest,
        float(sizes[-1]),
        settings.amplitudes,
        steps=settings.steps,
        cycles=settings.max_cycles,
        upper=settings.upper_modes,
        sticking=smallest,
        progress=progress,
    )


def tabulate(
    assembly: Assembly,
    smallest: float,
    largest: float,
    count: int,
    *,
    steps: int,
    cycles: int = 4,
    upper: int,
    sticking: float,
    progress: Progress,
) -> Outcome[Refined]:
    """Table of the refined model.

    Parameters
    ----------
    assembly : Assembly
    smallest, largest : float
        Amplitudes of the sliding coordinate between which to tabulate.
    count : int
        Amplitudes.
    steps, cycles : int
        Load steps per cycle, and cycles at most.
    upper : int
        Upper modes that may be in superharmonic resonance.
    sticking : float
        Amplitude at which the joint sticks.
    progress : Progress
    """
    a = assembly
    progress.start("cycles, mode prescribed", count)
    held = hold_mode(a.prepared, a.between_states, upper=upper)
    table, failures = refined_table(
        held, smallest, largest, count, steps=steps, cycles=cycles, advance=progress.advance
    )
    offset = load_offset(held, sticking)
    progress.finish()
    return Outcome(Refined(table, offset), tuple(failures))


def tables_of(done: Mapping[str, Outcome[Any]]) -> dict[str, EquivalentTable]:
    """Tables that there are, by drive; that of the refined model is called ``prescribed``."""
    driven = value_of(done, "cycle") or {}
    tables = {drive: found.table for drive, found in driven.items() if found.table is not None}
    refined = value_of(done, "reduced")
    return tables if refined is None else {**tables, "prescribed": refined.table}

"""Quasi-static cycles of every drive, and the table of stiffness and damping of each."""

from __future__ import annotations

import time
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np

from microslip.analyses.prepared.scales import load_scale
from microslip.analyses.reduced.table import EquivalentTable, equivalent_table
from microslip.analyses.statics.cycle import Cycle, quasi_static_cycle
from microslip.brief import Brief
from microslip.errors import ContactError, Failure, MicroslipError
from microslip.numerics.execute import each, threads
from microslip.pipeline.loads import on_port, port_of
from microslip.pipeline.outcome import Outcome, until_interrupted
from microslip.pipeline.prepare import Assembly
from microslip.pipeline.progress import Progress
from microslip.typing import Array


@dataclass(frozen=True, repr=False)
class DrivenCycles(Brief):
    """Steady cycles of one drive.

    Attributes
    ----------
    cycles : tuple of Cycle
        Ascending load.
    moments : tuple of float
        Load on the driven port of each, by default the end moment; for drive ``mode`` the one as
        close to opening the joint.
    table : EquivalentTable or None
        None of fewer than two cycles.
    """

    cycles: tuple[Cycle, ...]
    moments: tuple[float, ...]
    table: EquivalentTable | None


def run_cycles(
    assembly: Assembly, done: Mapping[str, Outcome[Any]], progress: Progress
) -> Outcome[dict[str, DrivenCycles]]:
    """Cycles of every drive, by drive."""
    settings = assembly.joint.analysis.cycle
    assert settings is not None
    found: dict[str, DrivenCycles] = {}
    failures: tuple[Failure, ...] = ()
    timings: dict[str, float] = {}
    with until_interrupted() as stop:
        for drive in assembly.joint.drives:
            start = time.perf_counter()
            outcome = drive_cycles(assembly, drive, progress)
            found[drive], timings[drive] = outcome.value, time.perf_counter() - start
            failures += outcome.failures
            if outcome.interrupted:
                stop.set()
                break
    return Outcome(found, failures, stop.is_set(), timings)


def drive_cycles(assembly: Assembly, drive: str, progress: Progress) -> Outcome[DrivenCycles]:
    """Steady cycles of one drive at every amplitude of the file, in threads."""
    a, settings = assembly, assembly.joint.analysis.cycle
    assert settings is not None
    try:
        loads, moments = cycle_loads(a, drive)
    except MicroslipError as error:
        failure = Failure("cycle", f"{drive}-driven", str(error))
        return Outcome(DrivenCycles((), (), None), (failure,))

    def one(load: float) -> Cycle | ContactError:
        try:
            return quasi_static_cycle(
                a.prepared,
                port_of(a, drive),
                load,
                steps=settings.steps,
                max_cycles=settings.max_cycles,
                closure=settings.closure,
            )
        except ContactError as error:
            return error

    solved: list[Cycle] = []
    kept: list[float] = []
    failures: list[Failure] = []
    progress.start(f"quasi-static cycles, {drive}-driven", len(loads))
    with until_interrupted() as stop:
        for moment, outcome in zip(moments, each(one, loads, threads()), strict=True):
            if isinstance(outcome, Cycle):
                solved.append(outcome)
                kept.append(float(moment))
            else:
                place = f"{drive}-driven, {amplitude_named(a, moment)}"
                failures.append(Failure("cycle", place, str(outcome)))
            progress.advance()
        progress.finish()
    table = None
    if len(solved) >= 2:
        table = equivalent_table(solved, a.prepared, drive)
    return Outcome(DrivenCycles(tuple(solved), tuple(kept), table), tuple(failures), stop.is_set())


def cycle_loads(assembly: Assembly, drive: str) -> tuple[Array, Array]:
    """Amplitudes on the port of a drive, and the loads on the driven port they correspond to.

    Raises
    ------
    MicroslipError
        Where amplitudes are over a scale (`load_scale`), and there is none.
    """
    joint = assembly.joint
    moments = np.asarray(joint.cycle_amplitudes())
    asked = joint.analysis.cycle
    if joint.driven_by_end_moments:
        moments = moments * assembly.moment_unit
    elif asked is None or asked.listed is None:
        scale = load_scale(assembly.prepared, assembly.prepared.drive)
        if not np.isfinite(scale):
            raise MicroslipError(
                f"the interface does not feel the port {joint.driven.name!r}, so that no amplitudes "
                f"follow: list them as analysis.cycle.{joint.driven.load.key}"
            )
        moments = moments * scale
    return np.asarray(on_port(assembly, drive, moments)), moments


def amplitude_named(assembly: Assembly, load: float) -> str:
    """Amplitude of a cycle in messages: over P L where it is an end moment."""
    if assembly.joint.driven_by_end_moments:
        return f"M/(PL) = {load / assembly.moment_unit:.3g}"
    return assembly.joint.driven.load.named(load)

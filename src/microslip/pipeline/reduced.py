"""Table of the refined model: cycles with the mode's motion prescribed, or resonances of the full joint."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np

from microslip.analyses.reduced.refined import load_offset, refined_table
from microslip.analyses.reduced.resonance import resonance
from microslip.analyses.reduced.table import EquivalentTable
from microslip.analyses.reduced.two_mode import TwoModeModel, stuck_model, two_mode_model
from microslip.analyses.statics.held import hold_mode
from microslip.analyses.statics.prescribed import cycle_at
from microslip.brief import Brief
from microslip.describe.requests import MOST_OF_OPENING
from microslip.errors import Caution, ContactError, MicroslipError
from microslip.pipeline.loads import GENTLE, amplitude_scale, opening_amplitude
from microslip.pipeline.outcome import Outcome, value_of
from microslip.pipeline.prepare import Assembly
from microslip.pipeline.progress import Progress
from microslip.pipeline.resonant import resonant_table, steps_of, sticking_load

BELOW = 0.1
"""Smallest amplitude of the refined table over that of mode-driven cycles: there the joint sticks."""

ALMOST = 0.97
"""As close as the table comes to the opening amplitude, where contact is lost at an instant."""

ROOM = 1.1
"""The table is made to hold the resonance of this many times the largest load."""


MOST_DOUBLINGS = 5
"""Times that the range is doubled at most where no amplitude opens the joint."""

LIKE = 0.99
"""Assurance of the sliding and the stuck mode below which the one is no coordinate of the other: an
oscillator of the sliding mode lacks as much of the mass that vibrates."""

OFF = 1e-3
"""Relative error of the stuck resonance in the table from which on it is said."""


@dataclass(frozen=True, repr=False)
class Refined(Brief):
    """What the refined model reads.

    Attributes
    ----------
    table : EquivalentTable
    offset : float
        c of the refined model, `microslip.analyses.reduced.refined.load_offset`.
    model : TwoModeModel, optional
        That the table is of, where it is not `two_mode_model` with this offset.
    """

    table: EquivalentTable
    offset: float
    model: TwoModeModel | None = None

    def model_of(self, assembly: Assembly) -> TwoModeModel:
        """The model that the table is of."""
        return self.model or two_mode_model(assembly.prepared, "refined", self.offset)


def run_refined(
    assembly: Assembly, done: Mapping[str, Outcome[Any]], progress: Progress
) -> Outcome[Refined] | None:
    """Table for the loads of the file, where a response reads it and there is friction."""
    joint = assembly.joint
    if "refined" not in joint.variants or not joint.load_amplitudes():
        return None
    if assembly.measures.friction == 0:
        return None
    settings = joint.analysis.reduced
    if takes_resonances(assembly):
        alike = assembly.mode.assurance >= LIKE
        try:
            found = at_resonances(assembly, progress)
            if not (alike and found.failures):
                return found
        except ContactError:
            if not alike:
                raise
            progress.finish()
    smallest, largest = table_range(assembly, tables_of(done).get("mode"))
    return tabulate(
        assembly,
        smallest,
        largest,
        settings.amplitudes,
        steps=settings.steps,
        cycles=settings.max_cycles,
        upper=settings.upper_modes,
        sticking=smallest,
        progress=progress,
    )


def takes_resonances(assembly: Assembly) -> bool:
    """Whether the table is of resonances of the full joint, as prescribed cycles do not tell what it does.

    That is where the sliding mode is unlike the stuck one, and where no half turn takes the joint into
    itself: its contact force has a mean and even harmonics, which cycles give the inertia of the first.
    """
    if assembly.mode.assurance < LIKE:
        return True
    return hold_mode(assembly.prepared, assembly.between_states).half_turn is None


def at_resonances(assembly: Assembly, progress: Progress) -> Outcome[Refined]:
    """Table of the refined model from resonances of the full joint under the loads of the file.

    Where a motion is not steady, as beside opening, cycles serve a joint whose modes are alike.
    """
    joint, model = assembly.prepared, stuck_model(assembly.prepared)
    asked = assembly.joint.load_amplitudes()
    steps = steps_of(asked, sticking_load(joint, model))
    progress.start("resonances of the full joint", len(steps))
    table, failures = resonant_table(
        joint, model, steps, asked=min(asked), advance=progress.advance
    )
    progress.finish()
    return Outcome(Refined(table, float(model.offset[0]), model), tuple(failures))


def table_range(assembly: Assembly, driven: EquivalentTable | None) -> tuple[float, float]:
    """Modal amplitudes between which to tabulate: from sticking up to where the loads resonate.

    Upward it ends with the mode-driven cycles, or where there are none at `MOST_OF_OPENING` of the
    amplitude whose inertia opens the joint; at `ALMOST` of it where the largest load needs more. Where
    none opens it, `load_scale` takes its place, and the largest load has what it needs.

    Parameters
    ----------
    assembly : Assembly
    driven : EquivalentTable or None
        Of the mode-driven cycles.

    Raises
    ------
    MicroslipError
        Where the interface does not feel the mode.
    """
    scale, opening = amplitude_scale(assembly), opening_amplitude(assembly)
    if not 0 < scale < np.inf:
        raise MicroslipError(
            f"the amplitude that the interface feels is {scale:g}: the range of amplitudes is not known"
        )
    smallest, largest = GENTLE * scale, MOST_OF_OPENING * scale
    if driven is not None:
        smallest, largest = float(driven.amplitude[0]), float(driven.amplitude[-1])
    needed = ROOM * max(assembly.joint.load_amplitudes(), default=0.0)
    if np.isinf(opening):
        return BELOW * smallest, _holding(assembly, largest, needed)
    if largest < ALMOST * opening and _resonant_load(assembly, largest) < needed:
        largest = ALMOST * opening
    return BELOW * smallest, largest


def _holding(assembly: Assembly, largest: float, needed: float) -> float:
    """An amplitude whose resonance takes the load that is needed, of a joint that no amplitude opens."""
    for _ in range(MOST_DOUBLINGS):
        if _resonant_load(assembly, largest) >= needed:
            break
        largest *= 2
    return largest


def _resonant_load(assembly: Assembly, amplitude: float) -> float:
    """Load whose resonance has an amplitude; infinite where its cycle cannot be solved."""
    settings = assembly.joint.analysis.reduced
    held = hold_mode(assembly.prepared, assembly.between_states)
    try:
        cycle = cycle_at(held, amplitude, steps=settings.steps, cycles=2)
    except ContactError:
        return np.inf
    kappa = np.array([cycle.force / cycle.q / held.sliding_omega**2], complex)
    linear = two_mode_model(assembly.prepared, "refined")
    beyond = np.array([cycle.damping - linear.damping[0, 0]])
    found = resonance(linear, np.array([amplitude]), kappa, beyond)
    return float(found.load.max(initial=0.0))


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
    return Outcome(
        Refined(table, offset), tuple(failures), cautions=off_where_it_sticks(a, table, sticking)
    )


def off_where_it_sticks(
    assembly: Assembly, table: EquivalentTable, sticking: float
) -> tuple[Caution, ...]:
    """What to know of a table whose stuck joint, ``omega_sl² (1 + k_eq)``, is not that of the model."""
    mode = assembly.mode
    if table.amplitude[0] > 2 * sticking:
        return ()
    found = mode.sliding_omega * np.sqrt(1 + table.k_eq[0])
    off = float(found / mode.stuck_omega - 1)
    if abs(off) <= OFF:
        return ()
    reason = (
        f"the resonance of the refined model where the joint sticks is {off:+.2%} off: the rest of the joint "
        "does not move in its cycles as it does in the stuck mode"
    )
    remedy = 'take method = "corrected" in [analysis.response], or backbones by prescribed cycles'
    return (Caution("reduced", "stuck joint", reason, remedy),)


def tables_of(done: Mapping[str, Outcome[Any]]) -> dict[str, EquivalentTable]:
    """Tables that there are, by drive; that of the refined model is called ``prescribed``."""
    driven = value_of(done, "cycle") or {}
    tables = {drive: found.table for drive, found in driven.items() if found.table is not None}
    refined = value_of(done, "reduced")
    return tables if refined is None else {**tables, "prescribed": refined.table}

"""From a description to results: every analysis that it asks for, one after the other."""

from __future__ import annotations

import time
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from functools import cached_property
from typing import Any

import numpy as np
from threadpoolctl import threadpool_limits

from microslip.analyses.backbone.points import Backbone
from microslip.analyses.prepared.joint import PreparedJoint
from microslip.analyses.prepared.joint_modes import JointMode
from microslip.analyses.prepared.prestress import Prestress
from microslip.analyses.reduced.response import Response
from microslip.analyses.reduced.table import EquivalentTable
from microslip.analyses.statics.cycle import Cycle
from microslip.analyses.time.history import History
from microslip.analyses.time.point import TimePoint
from microslip.describe.joint import Joint
from microslip.errors import Caution, Failure, InputError, MicroslipError
from microslip.model.geometry import Geometry
from microslip.model.joint import JointModel
from microslip.model.structure import Structure
from microslip.pipeline.geometry import geometry_of
from microslip.pipeline.harmonic import HarmonicRun
from microslip.pipeline.notebook import html_page
from microslip.pipeline.outcome import Outcome, in_units_of, value_of
from microslip.pipeline.prepare import Assembly, assemble
from microslip.pipeline.progress import NullProgress, Progress
from microslip.pipeline.reduced import tables_of
from microslip.pipeline.selection import Selection
from microslip.registry import Analysis, column, resolved

MOST_FAILURES = 3
"""So many are shown where a run is printed."""

LOAD_KEYS: dict[str, Callable[[Any], Any]] = {
    "moment": lambda entry: entry.load,
    "rho": lambda entry: entry.rho,
}
RESPONSE_KEYS: dict[str, Callable[[Any], Any]] = {
    "variant": lambda response: response.variant,
    **LOAD_KEYS,
}
BACKBONE_KEYS: dict[str, Callable[[Any], Any]] = {
    "mode": lambda backbone: backbone.mode.number,
    "method": lambda backbone: backbone.method,
}
POINT_KEYS: dict[str, Callable[[Any], Any]] = {
    "moment": lambda point: point.steady.load,
    "frequency": lambda point: point.steady.frequency,
    "rho": lambda point: point.rho,
}
"""What results are selected by, and where it stands; ``moment`` is called as the load is."""


@dataclass(frozen=True, repr=False)
class Run:
    """What was computed of a joint.

    Attributes
    ----------
    assembly : Assembly
    outcomes : mapping of str to Outcome
        By analysis, in the order in which they ran; those not asked for are left out.
    timings : mapping of str to float
        Seconds of wall time per stage.
    interrupted : bool
        Ctrl-C ended it.
    """

    assembly: Assembly
    outcomes: Mapping[str, Outcome[Any]] = field(default_factory=dict)
    timings: Mapping[str, float] = field(default_factory=dict)
    interrupted: bool = False

    @property
    def joint(self) -> Joint:
        """The description."""
        return self.assembly.joint

    @property
    def model(self) -> JointModel:
        """The reduced model every analysis ran on."""
        return self.assembly.model

    @property
    def structure(self) -> Structure:
        """The finite elements."""
        return self.assembly.structure

    @cached_property
    def geometry(self) -> Geometry | None:
        """What the structure looks like; None of matrices whose nodes have no coordinates."""
        return geometry_of(self.joint, self.structure, self.assembly.imported)

    @property
    def prestress(self) -> Prestress:
        """Contact under the clamp alone."""
        return self.assembly.prestress

    @property
    def prepared(self) -> PreparedJoint:
        """What every analysis took."""
        return self.assembly.prepared

    @property
    def mode(self) -> JointMode:
        """Sliding and stuck mode."""
        return self.assembly.mode

    @property
    def failures(self) -> tuple[Failure, ...]:
        """Points of all analyses that have no answer, and why."""
        found = (f for outcome in self.outcomes.values() for f in outcome.failures)
        return tuple(in_units_of(self.joint, each) for each in found)

    @property
    def cautions(self) -> tuple[Caution, ...]:
        """What all analyses answered, and an engineer should know of the answer."""
        found = (c for outcome in self.outcomes.values() for c in outcome.cautions)
        return tuple(in_units_of(self.joint, each) for each in found)

    def value(self, analysis: str) -> Any:
        """What an analysis found; None where it was not asked for or found nothing."""
        return value_of(self.outcomes, analysis)

    @property
    def cycles(self) -> dict[str, tuple[Cycle, ...]]:
        """Quasi-static cycles by drive, ascending load."""
        driven = self.value("cycle") or {}
        return {drive: found.cycles for drive, found in driven.items()}

    @property
    def moments(self) -> dict[str, tuple[float, ...]]:
        """Load of each cycle on the driven port; for drive ``mode`` the one as close to opening the joint."""
        driven = self.value("cycle") or {}
        return {drive: found.moments for drive, found in driven.items()}

    @property
    def tables(self) -> dict[str, EquivalentTable]:
        """Equivalent stiffness and damping by drive; ``prescribed`` is the refined model's."""
        return tables_of(self.outcomes)

    @property
    def moment_offset(self) -> float:
        """c of the refined model, `microslip.analyses.reduced.refined.load_offset`; else nan."""
        refined = self.value("reduced")
        return np.nan if refined is None else refined.offset

    @property
    def responses(self) -> Selection[Response]:
        """Forced responses, load by load; `sel` takes variant, moment and rho."""
        found = self.value("response")
        return Selection(() if found is None else found.curves, self._keys(RESPONSE_KEYS))

    response = responses
    """The same, to be read as ``run.response.sel(variant="refined", moment=50)``."""

    @property
    def frictionless(self) -> Response | None:
        """The joint without friction under the first load, eq. (18)."""
        found = self.value("response")
        return None if found is None else found.frictionless

    @property
    def rho_scale(self) -> float:
        """C in ``rho = C mu P L / M``; nan where no load is given by rho."""
        return self.joint.rho_scale if self.joint.says_rho else np.nan

    @property
    def backbones(self) -> Selection[Backbone]:
        """By mode, then method, as asked for; `sel` takes both."""
        return Selection(self.value("backbone") or (), BACKBONE_KEYS)

    @property
    def harmonic(self) -> Selection[HarmonicRun]:
        """Responses by harmonic balance, one entry per load; `sel` takes moment and rho."""
        return Selection(self.value("harmonic") or (), self._keys(LOAD_KEYS))

    @property
    def time_domain(self) -> Selection[TimePoint]:
        """Steady states by time integration; `sel` takes moment, frequency and rho."""
        return Selection(self.value("time") or (), self._keys(POINT_KEYS))

    def _keys(self, keys: dict[str, Callable[[Any], Any]]) -> dict[str, Callable[[Any], Any]]:
        """The same with the load under its own key: moment, force or acceleration."""
        own = self.joint.driven.load.key
        return {own if key == "moment" else key: read for key, read in keys.items()}

    @property
    def histories(self) -> Selection[History]:
        """In the order of the file; `sel` takes name."""
        return Selection(self.value("history") or (), {"name": lambda h: h.name})

    def __repr__(self) -> str:
        facts = (f"  {name}: {fact}" for name, fact in _facts(self).items())
        return "\n".join((f"Run of {self.joint.title or self.joint.unnamed}", *facts))

    def _repr_html_(self) -> str:
        tables: dict[str, list[dict[str, Any]]] = {}
        for row, rows in column("rows"):
            if self.value(row.name) is not None:
                tables |= {key: resolved(of)(self) for key, of in rows.items()}
        return html_page(f"Run of {self.joint.title or self.joint.unnamed}", _facts(self), tables)


def _facts(run: Run) -> dict[str, str]:
    """What is said of a run in a few lines."""
    seconds = run.timings.get("total", 0.0)
    facts = {
        "joint": f"{run.model.pairs} contact pairs, {run.mode.sliding_frequency:.2f} Hz sliding, "
        f"{run.mode.stuck_frequency:.2f} Hz stuck",
        "computed": f"{', '.join(run.outcomes) or 'nothing'} in {seconds:.1f} s",
    }
    if run.failures:
        shown = "; ".join(str(failure) for failure in run.failures[:MOST_FAILURES])
        more = "; ..." if len(run.failures) > MOST_FAILURES else ""
        facts["not solved"] = f"{len(run.failures)}: {shown}{more}"
    return facts | ({"interrupted": "what was finished is here"} if run.interrupted else {})


def run(
    joint: Joint,
    progress: Progress | None = None,
    *,
    done: Mapping[str, Outcome[Any]] | None = None,
    keep: Callable[[str, Outcome[Any]], None] = lambda name, outcome: None,
) -> Run:
    """Run all the analyses that a description asks for.

    Parameters
    ----------
    joint : Joint
        From `microslip.load_joint`.
    progress : Progress, optional
        Told of every long step.
    done : mapping of str to Outcome, optional
        Analyses of the same description that need not be run again.
    keep : callable
        Given every other analysis and its outcome as it ends.

    Returns
    -------
    Run
        Points that could not be solved are listed in ``failures``; Ctrl-C sets ``interrupted`` and
        keeps what was done.

    Raises
    ------
    MicroslipError
        Where the joint itself cannot be prepared; `InputError` where it cannot do what is asked.
    """
    progress = progress or NullProgress()
    timings: dict[str, float] = {}
    outcomes: dict[str, Outcome[Any]] = {}
    done = done or {}
    interrupted = False
    with threadpool_limits(1):
        start = time.perf_counter()
        progress.start("finite elements, reduction, prestress", 1)
        assembly = assemble(joint)
        progress.advance()
        progress.finish()
        timings["assemble"] = time.perf_counter() - start
        for row, analyse in column("run"):
            if not asked_for(joint, row.name):
                continue
            if row.name in done:
                outcomes[row.name] = done[row.name]
                continue
            taken = {name: outcomes[name] for name in row.after if name in outcomes}
            start = time.perf_counter()
            try:
                outcome = _attempt(row, analyse, assembly, taken, progress)
            except KeyboardInterrupt:
                outcome = Outcome(None, interrupted=True)
            if outcome is None:
                continue
            outcomes[row.name] = outcome
            timings |= _timings(row, outcome, time.perf_counter() - start)
            keep(row.name, outcome)
            interrupted = outcome.interrupted
            if interrupted:
                break
    timings["total"] = sum(timings.values())
    return Run(assembly, outcomes, timings, interrupted)


def asked_for(joint: Joint, analysis: str) -> bool:
    """Whether the description has the section of an analysis; an empty list of them is none."""
    return getattr(joint.analysis, analysis, None) not in (None, ())


def _attempt(
    row: Analysis,
    analyse: Any,
    assembly: Assembly,
    taken: Mapping[str, Outcome[Any]],
    progress: Progress,
) -> Outcome[Any] | None:
    """Outcome of one analysis; an error that ends it is a failure of all of it."""
    try:
        outcome: Outcome[Any] | None = analyse(assembly, taken, progress)
    except InputError:
        raise
    except MicroslipError as error:
        return Outcome(None, (Failure(row.name, "", str(error)),))
    return outcome


def _timings(row: Analysis, outcome: Outcome[Any], seconds: float) -> dict[str, float]:
    label = row.label or row.name
    if not outcome.timings:
        return {label: seconds}
    return {f"{label}_{part}": spent for part, spent in outcome.timings.items()}

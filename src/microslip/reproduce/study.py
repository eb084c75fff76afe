"""What the figures share: the joint, its tables and its steady states, each computed once."""

from __future__ import annotations

import time
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from dataclasses import replace
from functools import cached_property
from importlib import resources
from typing import Any, TypeVar

import numpy as np
from scipy.interpolate import PchipInterpolator

from microslip.analyses.reduced.response import Response, forced_response
from microslip.analyses.reduced.table import EquivalentTable, equivalent_table
from microslip.analyses.reduced.two_mode import two_mode_model
from microslip.analyses.statics.cycle import Cycle, quasi_static_cycle
from microslip.analyses.time.point import Request, TimePoint
from microslip.analyses.time.readings import equivalent
from microslip.describe.lap import LapJoint
from microslip.describe.reading import load_joint
from microslip.errors import Failure, MicroslipError
from microslip.pipeline.cycle import DrivenCycles, drive_cycles
from microslip.pipeline.loads import frictionless_response
from microslip.pipeline.outcome import Outcome
from microslip.pipeline.prepare import Assembly, assemble
from microslip.pipeline.progress import NullProgress, Progress
from microslip.pipeline.reduced import Refined, tabulate
from microslip.pipeline.run import Run
from microslip.pipeline.time import integrate
from microslip.reproduce.calibration import calibrated_scale
from microslip.reproduce.friction_force import friction_table
from microslip.reproduce.settings import FULL, PAPER_BEST_RHO, PORTS, Settings
from microslip.typing import Array

T = TypeVar("T")


def reference_joint(settings: Settings) -> LapJoint:
    """The reference joint with the amplitudes and contact pairs of the settings."""
    place = resources.files("microslip").joinpath("templates", "reference_joint.toml")
    with resources.as_file(place) as path:
        joint = load_joint(path)
    assert isinstance(joint, LapJoint)
    assert joint.analysis.cycle is not None
    cycle = joint.analysis.cycle.model_copy(
        update={
            "moment_over_clamp_force_length": settings.cycle_loads(joint.opening_ratio),
            "steps": settings.cycle_steps,
        }
    )
    return joint.model_copy(
        update={
            "contact": joint.contact.model_copy(update={"pairs": settings.pairs}),
            "analysis": joint.analysis.model_copy(update={"cycle": cycle}),
        }
    )


class Study:
    """Shared computations of one reproduction; everything is computed when first asked for.

    Parameters
    ----------
    settings : Settings
    progress : Progress, optional

    Attributes
    ----------
    failures : list of Failure
        Points that could not be solved, and why.
    timings : dict of str to float
        Seconds of wall time by kind of work.
    """

    def __init__(self, settings: Settings = FULL, progress: Progress | None = None) -> None:
        self.settings = settings
        self.progress: Progress = progress or NullProgress()
        self.failures: list[Failure] = []
        self.timings: dict[str, float] = {}
        self._points: dict[tuple[float, float], TimePoint | None] = {}
        self._kept: dict[Any, Any] = {}

    def once(self, key: object, compute: Callable[[], T]) -> T:
        """What `compute` returned when the key was first asked for."""
        if key not in self._kept:
            self._kept[key] = compute()
        kept: T = self._kept[key]
        return kept

    @contextmanager
    def timed(self, name: str) -> Iterator[None]:
        """Add the time of the block to `timings`."""
        start = time.perf_counter()
        try:
            yield
        finally:
            self.timings[name] = self.timings.get(name, 0.0) + time.perf_counter() - start

    # the joint ---------------------------------------------------------------------------------

    @cached_property
    def joint(self) -> LapJoint:
        """The reference joint as described."""
        return reference_joint(self.settings)

    @cached_property
    def assembly(self) -> Assembly:
        """Matrices, reduction, prestress, linear states."""
        with self.timed("assemble"):
            self.progress.start("finite elements, reduction, prestress", 1)
            assembly = assemble(self.joint)
            self.progress.finish()
        return assembly

    @property
    def friction(self) -> float:
        """Coefficient of friction."""
        return self.joint.friction

    @property
    def rayleigh(self) -> tuple[float, float]:
        """Alpha (1/s) and beta (s)."""
        return self.assembly.model.rayleigh

    @property
    def unit(self) -> float:
        """P L, what end moments are measured by."""
        return self.assembly.moment_unit

    @cached_property
    def position(self) -> Array:
        """Contact pairs over L_p."""
        return np.asarray(self.assembly.model.position / self.joint.clamp.half_length)

    # quasi-static ------------------------------------------------------------------------------

    @cached_property
    def run(self) -> Run:
        """Quasi-static cycles of both drives and their tables."""
        driven: dict[str, DrivenCycles] = {}
        for drive in PORTS:
            with self.timed(f"cycles_{drive}"):
                outcome = drive_cycles(self.assembly, drive, self.progress)
            if outcome.interrupted:
                raise KeyboardInterrupt
            driven[drive] = outcome.value
            self.failures += outcome.failures
        run = Run(self.assembly, {"cycle": Outcome(driven)})
        if len(run.tables) < len(PORTS):
            raise MicroslipError("too few quasi-static cycles were solved for a table")
        return run

    @cached_property
    def tables(self) -> dict[str, EquivalentTable]:
        """By name: cycles driven by the moment and by the mode, by the moment with friction alone,
        and with the mode prescribed.
        """
        run, a = self.run, self.assembly
        alone = friction_table(
            run.tables["moment"],
            run.cycles["moment"],
            a.structure.interface,
            a.states,
            a.prepared,
        )
        return {**run.tables, "friction": alone, "prescribed": self.refined.table}

    @cached_property
    def refined(self) -> Refined:
        """Table of the refined model, and the offset of its amplitude per end moment."""
        sizes = self.run.tables["mode"].amplitude
        with self.timed("cycles_prescribed"):
            outcome = tabulate(
                self.assembly,
                float(sizes[0]),
                float(sizes[-1]),
                self.settings.prescribed,
                steps=self.settings.cycle_steps,
                upper=self.settings.upper_modes,
                sticking=0.01 * float(sizes[0]),
                progress=self.progress,
            )
        self.failures += outcome.failures
        return outcome.value

    def static_cycle(self, drive: str, load: float, **options: float) -> Cycle:
        """One quasi-static cycle with the paper's number of load steps."""
        settings = {"steps": self.settings.time_steps, "max_cycles": 6, "closure": 1e-6, **options}
        return quasi_static_cycle(
            self.assembly.prepared,
            PORTS[drive],
            load,
            steps=int(settings["steps"]),
            max_cycles=int(settings["max_cycles"]),
            closure=float(settings["closure"]),
        )

    def static_at(self, drive: str, amplitude: float) -> Cycle:
        """The quasi-static cycle whose modal amplitude is given (to 1e-4)."""
        table = self.run.tables[drive]
        load = float(
            np.exp(np.interp(np.log(amplitude), np.log(table.amplitude), np.log(table.load)))
        )
        for _ in range(6):
            cycle = self.static_cycle(drive, load)
            found = equivalent_table([cycle], self.assembly.prepared, drive)
            error = amplitude / float(found.amplitude[0])
            if abs(error - 1) < 1e-4:
                break
            load *= error
        return cycle

    def static_energies(self, drive: str, amplitude: Array) -> tuple[Array, Array]:
        """Dissipated and mean stored energy of a table at given modal amplitudes; nan outside."""
        table = self.run.tables[drive]
        x, knots = np.log(amplitude), np.log(table.amplitude)
        inside = (x >= knots[0]) & (x <= knots[-1])
        log_loss = PchipInterpolator(knots, np.log(np.maximum(table.dissipated, 1e-300)))
        stiffness = PchipInterpolator(knots, table.stored / table.amplitude**2)
        dissipated, stored = np.exp(log_loss(x)), stiffness(x) * amplitude**2
        return np.where(inside, dissipated, np.nan), np.where(inside, stored, np.nan)

    # loads -------------------------------------------------------------------------------------

    @cached_property
    def rho_scale(self) -> float:
        """C in ``rho = C mu P L / M``: the consistent model is damped most at the paper's 2.4."""
        mode = self.assembly.mode
        model = two_mode_model(self.assembly.prepared, "consistent")
        band = np.linspace(0.95 * mode.sliding_frequency, 1.05 * mode.stuck_frequency, 801)
        table = self.run.tables["mode"]
        return calibrated_scale(self.assembly, model, table, band, PAPER_BEST_RHO)

    def moment(self, rho: float) -> float:
        """End moment of a rho, N m per metre of width; for 0 one that keeps the joint closed."""
        if rho > 0:
            return self.rho_scale * self.joint.friction_moment / rho
        linear = self.frictionless
        smallest = float(self.run.tables["mode"].amplitude.min())
        return float(smallest / (linear.peak_amplitude / linear.load))

    @cached_property
    def frictionless(self) -> Response:
        """Linear response without friction to the paper's load, eq. (18)."""
        band = self.settings.response_band()
        return frictionless_response(self.assembly, band, self.moment(0.8))

    # time domain -------------------------------------------------------------------------------

    def time_points(self, rho: float, frequencies: Sequence[float]) -> list[TimePoint]:
        """Steady states at a load, in the order of the frequencies; unsolved ones are left out."""
        missing = [f for f in frequencies if (rho, f) not in self._points]
        if missing:
            with self.timed("time_domain"):
                self._integrate(rho, missing)
        points = (self._points[rho, f] for f in frequencies)
        return [point for point in points if point is not None]

    def time_point(self, rho: float, frequency: float) -> TimePoint:
        """One steady state; raises `MicroslipError` where it could not be found."""
        found = self.time_points(rho, [frequency])
        if not found:
            raise MicroslipError(f"no steady state at rho = {rho:g}, {frequency:g} Hz")
        return found[0]

    def _integrate(self, rho: float, frequencies: Sequence[float]) -> None:
        guesses = self._guesses(rho, frequencies)
        requests = [
            Request(
                rho=rho,
                frequency=f,
                load=self.moment(rho),
                friction=self.friction if rho > 0 else 0.0,
                guess=guess,
                steps=self.settings.time_steps,
                max_cycles=self.settings.max_cycles,
            )
            for f, guess in zip(frequencies, guesses, strict=True)
        ]
        # The largest amplitudes take longest: begin with them, that no core idles at the end.
        requests.sort(key=lambda request: -abs(request.guess))
        self.progress.start(f"time domain, ρ = {rho:g}", len(requests))
        for request, (point, failure) in zip(
            requests, integrate(self.assembly, requests), strict=True
        ):
            self._points[rho, request.frequency] = point
            if failure is not None:
                self.failures.append(failure)
            self.progress.advance()
        self.progress.finish()

    def _guesses(self, rho: float, frequencies: Sequence[float]) -> list[complex]:
        """Modal amplitudes of the consistent model, on the branch a sweep from above follows."""
        model = two_mode_model(self.assembly.prepared, "consistent")
        table = self.run.tables["mode"] if rho > 0 else None
        low = min(self.settings.band[0], *frequencies)
        high = max(self.settings.band[1], *frequencies)
        band = np.unique(np.r_[np.linspace(low, high, self.settings.frequencies), frequencies])
        response = forced_response(model, table, band, self.moment(rho))
        found = response.amplitude[np.searchsorted(band, frequencies)]
        if table is not None:  # beyond the table the model is no guide
            found = found * np.minimum(1, table.amplitude[-1] / np.abs(found))
        return [complex(value) for value in found]

    # ports -------------------------------------------------------------------------------------

    def edge_of_clamp(self) -> Assembly:
        """The assembly with one more port ``edge``: horizontal displacement at ``x = L_p``.

        Of the lower body's node of the contact pair nearest to the edge of the clamp.
        """
        a = self.assembly
        pair = int(np.argmin(np.abs(self.position - 1)))
        relative = a.structure.interface.relative.tocsr()
        row = relative.getrow(pair * a.model.dimension + 1)
        node = row.indices[np.argmin(row.data)]
        unit = np.zeros(relative.shape[1])
        unit[node] = 1.0
        kept = [a.model.port(name) for name in a.structure.loads]
        plain = replace(
            a.model,
            ports=tuple(a.structure.loads),
            port_modes=a.model.port_modes[:, kept],
            port_v=a.model.port_v[:, kept],
            port_port=a.model.port_port[np.ix_(kept, kept)],
        )
        model = a.reducer.with_ports(plain, {**a.states.ports(a.structure), "edge": unit})
        return replace(a, prepared=a.prepared.with_model(model))


def dynamic_equivalent(study: Study, point: TimePoint) -> complex:
    """``k_eq + i gamma_eq`` of a steady vibration, over omega_sl²."""
    found = equivalent(point.steady, study.assembly.prepared)
    return complex(found.k_eq, found.gamma_eq)

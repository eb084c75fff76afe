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

from microslip.analyses.reduced.refined import moment_offset, refined_table
from microslip.analyses.reduced.response import Response, forced_response, greatest_damping_load
from microslip.analyses.reduced.table import DRIVES, EquivalentTable, equivalent_table
from microslip.analyses.reduced.two_mode import two_mode_model
from microslip.analyses.statics.cycle import Cycle, quasi_static_cycle
from microslip.analyses.statics.prescribed import hold_mode
from microslip.analyses.time.points import Request, TimePoint, equivalent, steady_states
from microslip.describe.lap import LapJoint
from microslip.describe.reading import load_joint
from microslip.errors import MicroslipError
from microslip.model.flexibility import static_flexibility
from microslip.numerics.execute import workers
from microslip.pipeline.progress import NullProgress, Progress
from microslip.pipeline.run import JointAssembly, LapRun, assemble_joint, run_cycles
from microslip.reproduce.friction_force import friction_table
from microslip.reproduce.settings import FULL, PAPER_BEST_RHO, Settings
from microslip.typing import Array

T = TypeVar("T")


def reference_joint(settings: Settings) -> LapJoint:
    """The reference joint with the amplitudes and contact pairs of the settings."""
    place = resources.files("microslip").joinpath("templates", "reference_joint.toml")
    with resources.as_file(place) as path:
        joint = load_joint(path)
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
    failures : list of str
        Points that could not be solved, and why.
    timings : dict of str to float
        Seconds of wall time by kind of work.
    """

    def __init__(self, settings: Settings = FULL, progress: Progress | None = None) -> None:
        self.settings = settings
        self.progress: Progress = progress or NullProgress()
        self.failures: list[str] = []
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
    def assembly(self) -> JointAssembly:
        """Matrices, reduction, prestress, linear states."""
        with self.timed("assemble"):
            self.progress.start("finite elements, reduction, prestress", 1)
            assembly = assemble_joint(self.joint)
            self.progress.finish()
        return assembly

    @property
    def friction(self) -> float:
        """Coefficient of friction."""
        return self.joint.contact.friction

    @property
    def rayleigh(self) -> tuple[float, float]:
        """Alpha (1/s) and beta (s)."""
        return self.joint.damping.alpha, self.joint.damping.beta

    @property
    def unit(self) -> float:
        """P L, what end moments are measured by."""
        return self.assembly.moment_unit

    @cached_property
    def compliance(self) -> Array:
        """Contact compliance at the pairs: none where the contact is exact."""
        a = self.assembly
        return np.diag(a.flexibility.W - static_flexibility(a.model).W).copy()

    @cached_property
    def position(self) -> Array:
        """Contact pairs over L_p."""
        return np.asarray(self.assembly.model.position / self.joint.clamp.half_length)

    # quasi-static ------------------------------------------------------------------------------

    @cached_property
    def run(self) -> LapRun:
        """Quasi-static cycles of both drives and their tables."""
        result = LapRun(joint=self.joint, assembly=self.assembly)
        for drive in DRIVES:
            with self.timed(f"cycles_{drive}"):
                run_cycles(result, drive, self.progress)
        self.failures += result.failures
        if len(result.tables) < len(DRIVES):
            raise MicroslipError("too few quasi-static cycles were solved for a table")
        return result

    @cached_property
    def tables(self) -> dict[str, EquivalentTable]:
        """By name: cycles driven by the moment and by the mode, by the moment with friction alone,
        and with the mode prescribed.
        """
        run, a = self.run, self.assembly
        alone = friction_table(
            run.tables["moment"], run.cycles["moment"], a.model, a.structure.interface, a.states
        )
        return {**run.tables, "friction": alone, "prescribed": self.refined[0]}

    @cached_property
    def refined(self) -> tuple[EquivalentTable, float]:
        """Table of the refined model, and the offset of its amplitude per end moment."""
        a, drive = self.assembly, self.run.tables["mode"]
        omega = 0.5 * (a.states.sliding_omega + a.states.stuck_omega)
        with self.timed("cycles_prescribed"):
            count = self.settings.prescribed
            self.progress.start("cycles, mode prescribed", count)
            held = hold_mode(
                a.model,
                a.prestress,
                a.states,
                self.friction,
                omega,
                upper=self.settings.upper_modes,
                compliance=self.compliance,
            )
            table, failures = refined_table(
                held,
                float(drive.amplitude[0]),
                float(drive.amplitude[-1]),
                count,
                steps=self.settings.cycle_steps,
                advance=self.progress.advance,
            )
            self.failures += failures
            offset = moment_offset(held, 0.01 * float(drive.amplitude[0]))
            self.progress.finish()
        return table, offset

    def static_cycle(self, drive: str, load: float, **options: float) -> Cycle:
        """One quasi-static cycle with the paper's number of load steps."""
        a = self.assembly
        settings = {"steps": self.settings.time_steps, "max_cycles": 6, "closure": 1e-6, **options}
        return quasi_static_cycle(
            a.model,
            a.flexibility,
            a.prestress,
            DRIVES[drive],
            load,
            self.friction,
            steps=int(settings["steps"]),
            max_cycles=int(settings["max_cycles"]),
            closure=float(settings["closure"]),
        )

    def static_at(self, drive: str, amplitude: float) -> Cycle:
        """The quasi-static cycle whose modal amplitude is given (to 1e-4)."""
        a, table = self.assembly, self.run.tables[drive]
        load = float(
            np.exp(np.interp(np.log(amplitude), np.log(table.amplitude), np.log(table.load)))
        )
        for _ in range(6):
            cycle = self.static_cycle(drive, load)
            found = equivalent_table([cycle], a.model, a.states, self.joint.clamp.force, drive)
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
        best = self.best_load("consistent", "mode")
        return PAPER_BEST_RHO * best / (self.friction * self.unit)

    def best_load(self, variant: str, table: str) -> float:
        """End moment at which a two-mode model's resonance per unit load is lowest."""
        states, found = self.assembly.states, self.run.tables[table]
        model = two_mode_model(states, "moment", self.rayleigh, variant)
        band = np.linspace(0.95 * states.sliding_frequency, 1.05 * states.stuck_frequency, 801)
        scale = model.omega**2 / abs(model.force[0])
        bounds = (1e-5 * found.amplitude[0] * scale, found.amplitude[-1] * scale)
        return greatest_damping_load(model, found, band, bounds)

    def moment(self, rho: float) -> float:
        """End moment of a rho, N m per metre of width; for 0 one that keeps the joint closed."""
        if rho > 0:
            return self.rho_scale * self.friction * self.unit / rho
        peak = self.frictionless.peak_amplitude / self.frictionless.load
        return float(self.run.tables["mode"].amplitude[0] / peak)

    @cached_property
    def frictionless(self) -> Response:
        """Linear response without friction to the paper's load, eq. (18)."""
        model = two_mode_model(self.assembly.states, "moment", self.rayleigh, "consistent")
        return forced_response(
            model, None, self.settings.response_band(), self.moment(0.8), rho=0.0, friction=0.0
        )

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
        a = self.assembly
        found = steady_states(a.model, a.prestress, requests, self.compliance, workers())
        for request, outcome in zip(requests, found, strict=True):
            key = (rho, request.frequency)
            if isinstance(outcome, str):
                self.failures.append(outcome)
                self._points[key] = None
            else:
                self._points[key] = outcome
                if not outcome.steady.converged:
                    self.failures.append(
                        f"time domain, rho = {rho:g}, {request.frequency:g} Hz: not steady after "
                        f"{outcome.steady.cycles} cycles, last change {outcome.steady.change:.1e}"
                    )
            self.progress.advance()
        self.progress.finish()

    def _guesses(self, rho: float, frequencies: Sequence[float]) -> list[complex]:
        """Modal amplitudes of the consistent model, on the branch a sweep from above follows."""
        model = two_mode_model(self.assembly.states, "moment", self.rayleigh, "consistent")
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

    def edge_of_clamp(self) -> JointAssembly:
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
        return replace(a, model=model)


def dynamic_equivalent(study: Study, point: TimePoint) -> complex:
    """``k_eq + i gamma_eq`` of a steady vibration, over omega_sl²."""
    found = equivalent(point, study.assembly.model, study.assembly.states)
    return complex(found.k_eq, found.gamma_eq)

"""Steady states by time integration by name: rows of the summary, and a dataset.

Contact fields cover the last cycle of every steady state; signs as in `microslip.contact.fields`.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np
import xarray as xr

from microslip.analyses.time.history import nearest_pairs
from microslip.analyses.time.point import TimePoint
from microslip.analyses.time.readings import equivalent, harmonics_of, modal_force, phases
from microslip.analyses.time.scheme import March
from microslip.analyses.time.steady import drift_of
from microslip.contact.fields import contact_fields
from microslip.describe.outputs import PREFIX
from microslip.numerics.fourier import without_drift
from microslip.pipeline.outputs import harmonics_by_name, samples_by_name
from microslip.pipeline.run import Run
from microslip.results.labels import (
    MODAL,
    MODAL_FORCE,
    field_variables,
    load_entry,
    load_named,
    load_variable,
    local_variables,
    output_label,
    output_name,
    pair_position,
    rho_entry,
    rho_of,
    state_variable,
    variable,
    watched_position,
)
from microslip.results.outputs import (
    PARTS,
    lags,
    modal_variable,
    output_coordinates,
    output_variable,
    sizes,
    stacked,
)
from microslip.typing import Array, Complex, Indices

HARMONICS = 15
"""Harmonics of the waveforms that are stored."""

VERDICTS = ("", "undecided", "stable", "unstable")
"""What is said of stability, by number."""


def time_rows(run: Run) -> list[dict[str, Any]]:
    """One entry of the summary per steady state."""
    return [time_row(run, point) for point in run.time_domain]


def time_row(run: Run, point: TimePoint) -> dict[str, Any]:
    """Entry of a steady state in the summary."""
    steady = point.steady
    cycle = steady.cycle
    found = equivalent(point.steady, run.prepared)
    first = {name: y[1] for name, y in outputs_of(run, point).items()}
    return {
        **rho_entry(point.rho),
        **load_entry(run, steady.load),
        "frequency_hz": steady.frequency,
        "modal_amplitude": abs(steady.amplitude),
        "phase_rad": float(np.angle(steady.amplitude)),
        "dissipated_energy_j_per_m": cycle.dissipated,
        "stored_energy_j_per_m": found.stored,
        "k_eq": found.k_eq,
        "gamma_eq": found.gamma_eq,
        "external_work_j_per_m": cycle.external,
        "material_damping_j_per_m": cycle.modal_damping + cycle.residual_damping,
        "normal_work_j_per_m": cycle.normal_work,
        "cycles": steady.cycles,
        "converged": steady.converged,
        "last_change": steady.change,
        "settling_error": point.error,
        "walk_m_per_cycle": drift_of(steady, run.model.dimension),
        "walked_m": point.walked,
        "walk_cycles": point.lasts,
        "walk_ahead": point.ahead,
        "stability": point.verdict,
        "largest_multiplier": largest_multiplier(point),
        "starts": list(point.pasts),
        "steps_per_cycle": point.steps,
        "steps_error": point.steps_error,
        "residual_max": float(cycle.residual.max()),
        "unsolved_steps": 0,
        "seconds": steady.seconds,
        "outputs": sizes(run, first),
        "phases_deg": lags(run, first),
    }


def largest_multiplier(point: TimePoint) -> float:
    """Largest modulus of a Floquet multiplier of the vibration; nan where not known."""
    return float("nan") if point.stability is None else point.stability.largest


def outputs_of(run: Run, point: TimePoint) -> dict[str, Complex]:
    """Mean and harmonics of every output of a steady state, by name; a walk is left out."""
    theta = phases(point.steady)
    vibration = without_drift(point.steady.cycle.output, theta)
    omega = 2 * np.pi * point.steady.frequency
    motion = harmonics_of(vibration, theta, HARMONICS)
    return harmonics_by_name(run.assembly, motion, omega, np.arange(HARMONICS + 1))


def waveforms(run: Run, point: TimePoint) -> dict[str, Array]:
    """Every output over the last cycle of a steady state, by name."""
    cycle = point.steady.cycle
    dt = float(cycle.time[1] - cycle.time[0])
    return samples_by_name(run.assembly, cycle.output, dt, periodic=True)


def time_datasets(run: Run) -> dict[str, xr.Dataset]:
    """The group ``time_domain``."""
    return {"time_domain": _dataset(run)} if run.time_domain else {}


def _dataset(run: Run) -> xr.Dataset:
    """All steady states: waveforms, harmonics, energies, and contact over the last cycle."""
    points, model = run.time_domain, run.model
    cycles = [p.steady.cycle for p in points]
    motions = [local_motion(run, cycle) for cycle in cycles]
    watched = motions[0][0]
    theta = np.stack([phases(p.steady) for p in points])
    port = {name: model.port(name) for name in model.ports}
    trace, each = ("point", "step"), ("point",)
    field, local = ("point", "step", "pair"), ("point", "step", "position")
    rows = [time_row(run, p) for p in points]
    Q = np.stack(
        [
            harmonics_of(c.output[:, port["sliding"]], t, HARMONICS)
            for c, t in zip(cycles, theta, strict=True)
        ]
    )

    def scalar(name: str, unit: str, label: str) -> xr.Variable:
        return variable(each, np.array([row[name] for row in rows], dtype=float), unit, label)

    def wave(of: Callable[[TimePoint], Array]) -> Array:
        return np.stack([of(p) for p in points])

    data = {
        "load": load_variable(run, trace, np.stack([c.load for c in cycles]), "{}"),
        "f": variable(
            trace,
            wave(lambda p: modal_force(p.steady, run.prepared, HARMONICS)),
            MODAL_FORCE,
            f"contact force on the sliding mode beyond the sliding state, {HARMONICS} harmonics",
        ),
        "q_harmonics": variable(
            ("point", "harmonic", "part"),
            np.stack([Q.real, Q.imag], axis=-1),
            MODAL,
            "mean and harmonics of q: q = mean + sum Im(Q_h exp(i h theta))",
        ),
        **{
            output_name(name): variable(
                trace, np.stack([c.output[:, k] for c in cycles]), *output_label(name, run)
            )
            for name, k in port.items()
            if not name.startswith(PREFIX)
        },
        "output_value": output_variable(
            ("point", "step", "output"),
            np.stack([stacked(run, waveforms(run, p), -1) for p in points]),
            "output from prestress",
        ),
        "output_harmonics": output_variable(
            ("point", "output", "harmonic"),
            np.stack([stacked(run, outputs_of(run, p), 0) for p in points]),
            "mean and harmonics of the output",
        ),
        **local_variables(
            local,
            np.stack([slip for _, slip, _ in motions]),
            np.stack([gap for _, _, gap in motions]),
        ),
        "state": state_variable(field, np.stack([c.status for c in cycles])),
        **field_variables(
            field,
            contact_fields(
                np.stack([c.r for c in cycles]),
                np.stack([c.v for c in cycles]),
                run.prestress.solution.v,
                model.area,
            ),
        ),
        "dissipation": variable(
            ("point", "pair"),
            np.stack([c.friction_work / model.area for c in cycles]),
            "J/m^2",
            "friction work per cycle and area",
        ),
        "modal_amplitude": modal_variable(
            run, each, [row["modal_amplitude"] for row in rows], "first harmonic of q"
        ),
        "phase": scalar("phase_rad", "rad", "phase of q to the load"),
        "k_eq": scalar("k_eq", "1", "equivalent stiffness over omega_sl^2"),
        "gamma_eq": scalar("gamma_eq", "1", "equivalent damping over omega_sl^2"),
        "dissipated_energy": scalar("dissipated_energy_j_per_m", "J/m", "friction work per cycle"),
        "stored_energy": scalar(
            "stored_energy_j_per_m", "J/m", "mean stored energy of the contact"
        ),
        "external_work": scalar("external_work_j_per_m", "J/m", "work of the load per cycle"),
        "material_damping": scalar(
            "material_damping_j_per_m", "J/m", "loss in the material per cycle"
        ),
        "normal_work": scalar(
            "normal_work_j_per_m",
            "J/m",
            "work of the normal reactions per cycle: an error of the time steps",
        ),
        "cycles": scalar("cycles", "1", "cycles computed"),
        "last_change": scalar("last_change", "1", "change of the state over the last cycle"),
        "settling_error": scalar(
            "settling_error", "1", "by how much the state may be off the periodic one"
        ),
        "steps_error": scalar(
            "steps_error",
            "1",
            "by how much the time steps may put the first harmonic off, relative",
        ),
        "walk": scalar("walk_m_per_cycle", "m", "drift of the bodies past each other per cycle"),
        "walked": scalar("walked_m", "m", "drift of the bodies past each other until they rest"),
        "walk_cycles": scalar("walk_cycles", "1", "cycles until they do, about"),
        "walk_ahead": scalar("walk_ahead", "1", "relative change of the amplitude until they do"),
        "largest_multiplier": scalar(
            "largest_multiplier", "1", "largest modulus of a Floquet multiplier of the vibration"
        ),
        "stability": variable(
            each,
            np.array([VERDICTS.index(p.verdict) for p in points], np.int8),
            "1",
            "whether small disturbances of the steady state decay",
            flag_values=np.arange(len(VERDICTS), dtype=np.int8),
            flag_meanings="not_known undecided stable unstable",
        ),
        "residual_max": scalar("residual_max", "1", "largest residual of a contact problem"),
        "seconds": scalar("seconds", "s", "time it took"),
        "converged": variable(
            each,
            np.array([p.steady.converged for p in points], np.int8),
            "1",
            "whether the state repeats to the tolerance asked for",
            flag_values=np.array([0, 1], np.int8),
            flag_meanings="not_steady steady",
        ),
    }
    coords = (
        pair_position(run)
        | output_coordinates(run)
        | {
            "frequency": variable(
                each, np.array([p.steady.frequency for p in points]), "Hz", "frequency of the load"
            ),
            **rho_of(each, [p.rho for p in points]),
            load_named(run): load_variable(run, each, [p.steady.load for p in points]),
            "theta": variable(trace, theta, "rad", "phase of the load"),
            "harmonic": variable(("harmonic",), np.arange(HARMONICS + 1), "1", "0 is the mean"),
            "part": PARTS,
            "position": watched_position(run, watched),
        }
    )
    return xr.Dataset(data, coords)


def local_motion(run: Run, cycle: March) -> tuple[Indices, Array, Array]:
    """Pairs at the chosen positions, and their slip from prestress and gap over a cycle, m."""
    settings = run.joint.analysis.time
    wanted = (settings and settings.positions) or (run.assembly.measures.edge,)
    watched = nearest_pairs(run.model.position, wanted)
    fields = contact_fields(cycle.r, cycle.v, run.prestress.solution.v, run.model.area)
    return watched, fields.slip[:, watched], fields.gap[:, watched]

"""Results of the time domain by name: steady states and histories, as rows and as datasets.

Signs as in `microslip.results.dataset`. Contact fields cover the last cycle of every steady state, and the
chosen instants of a history.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import TYPE_CHECKING, Any

import numpy as np
import xarray as xr
from numpy.typing import NDArray

from microslip.analyses.time.history import History, decay, dwell_response, nearest_pairs
from microslip.analyses.time.points import TimePoint, equivalent, harmonics_of, modal_force, phases
from microslip.analyses.time.scheme import March
from microslip.describe.excitation import SteppedSine
from microslip.results.labels import (
    MODAL,
    MODAL_FORCE,
    OUTPUTS,
    pair_position,
    state_variable,
    variable,
)
from microslip.typing import Array

if TYPE_CHECKING:
    from microslip.pipeline.run import LapRun


HARMONICS = 15
"""Harmonics of the waveforms that are stored."""

_DRIVE_UNIT = {"moment": "N m/m", "mode": MODAL_FORCE}


# Steady states -----------------------------------------------------------------------------------


def time_domain_row(result: LapRun, point: TimePoint) -> dict[str, Any]:
    """Entry of a steady state in the summary."""
    steady = point.steady
    cycle = steady.cycle
    found = equivalent(point, result.model, result.states)
    return {
        "rho": point.rho,
        "moment_over_clamp_force_length": steady.load / result.assembly.moment_unit,
        "frequency_hz": steady.frequency,
        "corrected_frequency_hz": point.corrected_frequency,
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
        "residual_max": float(cycle.residual.max()),
        "unsolved_steps": 0,
        "seconds": steady.seconds,
    }


def time_domain_dataset(result: LapRun) -> xr.Dataset:
    """All steady states: waveforms, harmonics, energies, and contact over the last cycle."""
    points, model, states = result.time_domain, result.model, result.states
    cycles = [p.steady.cycle for p in points]
    motions = [local_motion(result, cycle) for cycle in cycles]
    watched = motions[0][0]
    theta = np.stack([phases(p.steady) for p in points])
    port = {name: model.port(name) for name in model.ports}
    trace, each = ("point", "step"), ("point",)
    field, local = ("point", "step", "pair"), ("point", "step", "position")
    rows = [time_domain_row(result, p) for p in points]
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
        "load": variable(trace, np.stack([c.load for c in cycles]), "N m/m", "end moment"),
        "f": variable(
            trace,
            wave(lambda p: modal_force(p, model, states, HARMONICS)),
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
            _output_name(name): variable(
                trace, np.stack([c.output[:, k] for c in cycles]), *_output_label(name)
            )
            for name, k in port.items()
        },
        **_local(
            local,
            np.stack([slip for _, slip, _ in motions]),
            np.stack([gap for _, _, gap in motions]),
        ),
        **_fields(
            result,
            field,
            np.stack([c.status for c in cycles]),
            np.stack([c.r for c in cycles]),
            np.stack([c.v for c in cycles]),
        ),
        "dissipation": variable(
            ("point", "pair"),
            np.stack([c.friction_work / model.area for c in cycles]),
            "J/m^2",
            "friction work per cycle and area",
        ),
        "modal_amplitude": scalar("modal_amplitude", MODAL, "first harmonic of q"),
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
    coords = pair_position(result) | {
        "frequency": variable(
            each, np.array([p.steady.frequency for p in points]), "Hz", "frequency of the load"
        ),
        "corrected_frequency": scalar(
            "corrected_frequency_hz", "Hz", "frequency without the period error of the steps"
        ),
        "rho": variable(each, np.array([p.rho for p in points]), "1", "rho = C mu P L / M"),
        "moment": variable(
            each, np.array([p.steady.load for p in points]), "N m/m", "amplitude of the end moment"
        ),
        "theta": variable(trace, theta, "rad", "phase of the load"),
        "harmonic": variable(("harmonic",), np.arange(HARMONICS + 1), "1", "0 is the mean"),
        "part": variable(("part",), ["real", "imaginary"], "1", "part of the complex number"),
        "position": _watched_position(result, watched),
    }
    return xr.Dataset(data, coords)


def local_motion(result: LapRun, cycle: March) -> tuple[NDArray[np.int64], Array, Array]:
    """Pairs at the chosen positions, and their slip from prestress and gap over a cycle, m."""
    settings = result.joint.analysis.time
    wanted = (settings and settings.positions) or (result.joint.clamp.half_length,)
    watched = nearest_pairs(result.model.position, wanted)
    rest = result.prestress.solution.v
    slip = cycle.v[:, 2 * watched + 1] - rest[2 * watched + 1]
    return watched, slip, -cycle.v[:, 2 * watched]


def _watched_position(result: LapRun, watched: NDArray[np.int64]) -> xr.Variable:
    x = result.model.position[watched]
    return variable(("position",), x, "m", "pair nearest to the position asked for")


def _output_name(port: str) -> str:
    return {"sliding": "q", "moment": "rotation", "clamp": "approach"}.get(port, port)


def _output_label(port: str) -> tuple[str, str]:
    return OUTPUTS.get(port, ("1", f"output of the port {port}"))


def _local(dims: tuple[str, ...], slip: Array, gap: Array) -> dict[str, xr.Variable]:
    """Slip and gap at the positions that were asked for."""
    return {
        "local_slip": variable(dims, slip, "m", "slip of the upper body over the lower"),
        "local_gap": variable(dims, gap, "m", "gap"),
    }


def _fields(
    result: LapRun, dims: tuple[str, ...], status: NDArray[np.int8], r: Array, v: Array
) -> dict[str, xr.Variable]:
    """Contact of all pairs, from states, reactions and relative displacements."""
    area, rest = result.model.area, result.prestress.solution.v
    return {
        "state": state_variable(dims, status),
        "pressure": variable(dims, r[..., ::2] / area, "Pa", "contact pressure"),
        "traction": variable(dims, -r[..., 1::2] / area, "Pa", "traction f on the upper body"),
        "slip": variable(
            dims, v[..., 1::2] - rest[1::2], "m", "slip of the upper body over the lower"
        ),
        "gap": variable(dims, -v[..., ::2], "m", "gap"),
    }


# Histories ---------------------------------------------------------------------------------------


def history_row(result: LapRun, history: History) -> dict[str, Any]:
    """Entry of a history in the summary."""
    q = history.output[:, result.model.port("sliding")]
    top = int(np.argmax(np.abs(q)))
    e = history.energies
    unit = result.assembly.moment_unit
    peak_load = float(np.abs(history.load).max())
    row = {
        "name": history.name,
        "signal": history.kind,
        "drive": history.drive,
        "peak_load": peak_load,
        "moment_over_clamp_force_length": (
            peak_load / unit if history.drive == "moment" else math.nan
        ),
        "time_step_s": history.dt,
        "steps": len(history.time) - 1,
        "steps_asked": history.steps,
        "duration_s": history.time[-1],
        "complete": history.complete and not history.failure,
        "failure": history.failure or None,
        "peak_modal_coordinate": q[top],
        "time_of_peak_s": history.time[top],
        "external_work_j_per_m": e.external[-1],
        "dissipated_energy_j_per_m": e.friction[-1],
        "material_damping_j_per_m": e.modal_damping[-1] + e.residual_damping[-1],
        "normal_work_j_per_m": e.normal[-1],
        "scheme_loss_j_per_m": e.scheme[-1],
        "mechanical_energy_change_j_per_m": e.mechanical[-1],
        "residual_max": history.residual,
        "unsolved_steps": 0,
        "seconds": history.seconds,
    }
    if history.kind == "free_decay":
        found = decay(history.time, q, history.cycle_steps)
        ends = ((0, "first"), (-1, "last")) if len(found.damping) else ()
        for k, name in ends:
            row[f"{name}_amplitude"] = found.amplitude[k]
            row[f"{name}_frequency_hz"] = found.frequency[k]
            row[f"{name}_damping_ratio"] = found.damping[k]
    return row


def history_dataset(result: LapRun, history: History) -> xr.Dataset:
    """Waveforms, energies and contact of one history."""
    model = result.model
    e = history.energies
    trace, book, field = ("time",), ("energy_time",), ("field_time", "pair")

    def energy(values: Array, label: str) -> xr.Variable:
        return variable(book, values, "J/m", label)

    data = {
        "load": variable(trace, history.load, _DRIVE_UNIT[history.drive], "load"),
        **{
            _output_name(name): variable(trace, history.output[:, k], *_output_label(name))
            for k, name in enumerate(model.ports)
        },
        **_local(("time", "position"), history.slip, history.gap),
        **_fields(result, field, history.status, history.r, history.v),
        "external_work": energy(e.external, "work of the load"),
        "friction_work": energy(e.friction, "friction work"),
        "modal_damping": energy(e.modal_damping, "loss in the material, modes"),
        "residual_damping": energy(e.residual_damping, "loss in the material, residual part"),
        "normal_work": energy(e.normal, "work of the normal reactions: an error of the time steps"),
        "scheme_loss": energy(e.scheme, "taken by the time integration itself"),
        "mechanical_energy": energy(
            e.mechanical, "kinetic and strain energy less the potential of the clamp, change"
        ),
        "dissipation": variable(
            ("pair",), history.friction_work / model.area, "J/m^2", "friction work per area"
        ),
    }
    coords = pair_position(result) | {
        "time": variable(trace, history.time, "s", "time"),
        "energy_time": variable(book, e.time, "s", "end of each cycle"),
        "field_time": variable(
            ("field_time",), history.dt * history.kept, "s", "when the contact was kept"
        ),
        "position": _watched_position(result, history.watched),
    }
    q = history.output[:, model.port("sliding")]
    if history.kind == "free_decay":
        data |= _decay_variables(history, q)
    if history.kind == "stepped_sine":
        data |= _dwell_variables(result, history, q)
    attrs = {
        "signal": history.kind,
        "drive": history.drive,
        "complete": int(history.complete and not history.failure),
        "failure": history.failure,
    }
    return xr.Dataset(data, coords, attrs)


def _decay_variables(history: History, q: Array) -> dict[str, xr.Variable]:
    found = decay(history.time, q, history.cycle_steps)
    half = ("extreme",)
    damping = np.full(len(found.time), np.nan)
    damping[1:] = found.damping
    return {
        "extreme_time": variable(half, found.time, "s", "time of each extreme of q"),
        "amplitude": variable(
            half, found.amplitude, MODAL, "half the way between extremes of q and their neighbours"
        ),
        "offset": variable(
            half, found.offset, MODAL, "mean of each extreme of q and its neighbours"
        ),
        "frequency": variable(
            half, found.frequency, "Hz", "from the time between the neighbouring extremes"
        ),
        "damping_ratio": variable(half, damping, "1", "from this and the amplitude before"),
    }


def _dwell_variables(result: LapRun, history: History, q: Array) -> dict[str, xr.Variable]:
    """Response read at the end of every dwell of a stepped sine."""
    entry = next(h for h in result.joint.analysis.history if h.label == history.name)
    assert isinstance(entry, SteppedSine)
    Q = dwell_response(history.time, q, entry.band(), entry.cycles)
    dims = ("dwell",)
    return {
        "dwell_frequency": variable(dims, np.array(entry.band()), "Hz", "frequency of the dwell"),
        "dwell_amplitude": variable(dims, np.abs(Q), MODAL, "first harmonic of q at its end"),
        "dwell_phase": variable(dims, np.angle(Q), "rad", "its phase to the load"),
    }

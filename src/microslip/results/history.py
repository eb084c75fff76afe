"""Histories by name: rows of the summary, and a dataset each.

Contact fields are those of the chosen instants; signs as in `microslip.contact.fields`.
"""

from __future__ import annotations

import math
from typing import Any

import numpy as np
import xarray as xr

from microslip.analyses.time.decay import decay, dwell_response
from microslip.analyses.time.history import History
from microslip.contact.fields import contact_fields
from microslip.describe.excitation import SteppedSine
from microslip.describe.outputs import PREFIX
from microslip.pipeline.outputs import samples_by_name
from microslip.pipeline.run import Run
from microslip.results.labels import (
    MODAL,
    field_variables,
    load_entry,
    load_unit,
    local_variables,
    output_label,
    output_name,
    pair_position,
    state_variable,
    variable,
    watched_position,
)
from microslip.results.outputs import output_coordinates, output_variable, sizes, stacked
from microslip.typing import Array


def history_rows(run: Run) -> list[dict[str, Any]]:
    """One entry of the summary per history."""
    return [history_row(run, history) for history in run.histories]


def history_datasets(run: Run) -> dict[str, xr.Dataset]:
    """Groups ``history/name``."""
    return {f"history/{h.name}": history_dataset(run, h) for h in run.histories}


def history_row(run: Run, history: History) -> dict[str, Any]:
    """Entry of a history in the summary."""
    q = history.output[:, run.model.port("sliding")]
    top = int(np.argmax(np.abs(q)))
    e = history.energies
    peak_load = float(np.abs(history.load).max())
    row = {
        "name": history.name,
        "signal": history.kind,
        "drive": history.drive,
        "peak_load": peak_load,
        **load_entry(run, math.nan if history.drive == "mode" else peak_load),
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
        "peak_outputs": sizes(run, {n: _largest(y) for n, y in waveforms(run, history).items()}),
    }
    if history.kind == "free_decay":
        found = decay(history.time, q, history.cycle_steps)
        ends = ((0, "first"), (-1, "last")) if len(found.damping) else ()
        for k, name in ends:
            row[f"{name}_amplitude"] = found.amplitude[k]
            row[f"{name}_frequency_hz"] = found.frequency[k]
            row[f"{name}_damping_ratio"] = found.damping[k]
    return row


def waveforms(run: Run, history: History) -> dict[str, Array]:
    """Every output over a history, by name."""
    return samples_by_name(run.assembly, history.output, history.dt)


def _largest(y: Array) -> float:
    return float(np.abs(y).max())


def history_dataset(run: Run, history: History) -> xr.Dataset:
    """Waveforms, energies and contact of one history."""
    model = run.model
    e = history.energies
    trace, book, field = ("time",), ("energy_time",), ("field_time", "pair")

    def energy(values: Array, label: str) -> xr.Variable:
        return variable(book, values, "J/m", label)

    data = {
        "load": variable(trace, history.load, load_unit(run, history.drive), "load"),
        **{
            output_name(name): variable(trace, history.output[:, k], *output_label(name, run))
            for k, name in enumerate(model.ports)
            if not name.startswith(PREFIX)
        },
        "output_value": output_variable(
            ("time", "output"), stacked(run, waveforms(run, history), -1), "output from prestress"
        ),
        **local_variables(("time", "position"), history.slip, history.gap),
        "state": state_variable(field, history.status),
        **field_variables(
            field, contact_fields(history.r, history.v, run.prestress.solution.v, run.model.area)
        ),
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
    coords = (
        pair_position(run)
        | output_coordinates(run)
        | {
            "time": variable(trace, history.time, "s", "time"),
            "energy_time": variable(book, e.time, "s", "end of each cycle"),
            "field_time": variable(
                ("field_time",), history.dt * history.kept, "s", "when the contact was kept"
            ),
            "position": watched_position(run, history.watched),
        }
    )
    q = history.output[:, model.port("sliding")]
    if history.kind == "free_decay":
        data |= _decay_variables(history, q)
    if history.kind == "stepped_sine":
        data |= _dwell_variables(run, history, q)
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


def _dwell_variables(run: Run, history: History, q: Array) -> dict[str, xr.Variable]:
    """Response read at the end of every dwell of a stepped sine."""
    entry = next(h for h in run.joint.analysis.history if h.label == history.name)
    assert isinstance(entry, SteppedSine)
    Q = dwell_response(history.time, q, entry.band(), entry.cycles)
    dims = ("dwell",)
    return {
        "dwell_frequency": variable(dims, np.array(entry.band()), "Hz", "frequency of the dwell"),
        "dwell_amplitude": variable(dims, np.abs(Q), MODAL, "first harmonic of q at its end"),
        "dwell_phase": variable(dims, np.angle(Q), "rad", "its phase to the load"),
    }

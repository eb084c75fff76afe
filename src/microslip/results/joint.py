"""The joint itself by name: its model and its prestress, as summaries and as datasets."""

from __future__ import annotations

from typing import Any

import numpy as np
import xarray as xr

from microslip.analyses.prepared.prestress import slides_from
from microslip.contact.fields import contact_extent
from microslip.contact.pairs import at_rest, normal, slip_history
from microslip.model.joint import JointModel
from microslip.pipeline.measures import Measures
from microslip.pipeline.run import Run
from microslip.results.labels import load_entry, load_named, pair_position, state_variable, variable
from microslip.typing import Array


def model_summary(run: Run) -> dict[str, Any]:
    """Sizes, interface, linear states, what drives the joint and what opens it."""
    model, mode, measures = run.model, run.mode, run.assembly.measures
    bonded = model.position[run.assembly.states.pairs]
    reach, held = np.abs(model.position).max(), np.abs(bonded).max()
    half = measures.half_length
    if measures.clamp:
        extent = {"half_length_over_clamp_half_length": reach / half}
        own = {
            "clamp_force_n_per_m": measures.force,
            "clamp_half_length_m": half,
            "clamp_force_length_n_m_per_m": run.assembly.moment_unit,
        }
        stuck = {"bonded_half_length_over_clamp_half_length": held / half}
    else:
        extent = {"half_length_m": half}
        own = {"contact_force_n_per_m": measures.force}
        stuck = {"bonded_from_to_m": [bonded.min(), bonded.max()]}
    spacing = np.diff(model.position).max(initial=0.0)
    return {
        "dofs": run.structure.dofs,
        "modes": len(model.omega),
        "contact_pairs": model.pairs,
        "interface": {"pair_spacing_m": spacing, **extent},
        "friction": measures.friction,
        **own,
        "sliding_frequency_hz": mode.sliding_frequency,
        "stuck_frequency_hz": mode.stuck_frequency,
        "mode_overlap": mode.overlap,
        **stuck,
        **opening_entry(run),
    }


def opening_entry(run: Run) -> dict[str, Any]:
    """What opens the joint, on the driven port, None where nothing does; and what slides its bodies away."""
    opening, prepared = run.assembly.opening_moment, run.prepared
    slides = slides_from(prepared.model, prepared.prestress, prepared.drive, prepared.law.friction)
    opened = {
        f"opening_{key}": value if np.isfinite(opening) else None
        for key, value in load_entry(run, opening).items()
    }
    if not 0 < slides < np.inf:  # zero where limit analysis does not say
        return opened
    return opened | {f"slides_from_{key}": value for key, value in load_entry(run, slides).items()}


def prestress_summary(run: Run) -> dict[str, Any]:
    """Extent and largest pressure of the contact under the preload alone."""
    start, measures = run.prestress, run.assembly.measures
    left, right = contact_extent(run.model.position, start.touching)
    peak = start.pressure.max()
    if measures.clamp:
        own = {
            "contact_half_length_over_clamp_half_length": max(-left, right) / measures.half_length,
            "peak_pressure_over_mean_clamp_pressure": peak / measures.mean_pressure,
        }
    else:
        own = {
            "contact_from_to_m": [left, right],
            "peak_pressure_over_mean_pressure": peak / measures.mean_pressure,
        }
    return {
        **own,
        "friction": "with" if start.frictional else "none",
        **bolts_entry(run),
        "peak_pressure_pa": peak,
        "residual": start.solution.residual,
    }


def bolts_entry(run: Run) -> dict[str, Any]:
    """Bolts that keep their length: what they were tightened to, and what is left after the last of them."""
    found = run.assembly.bolts
    if found is None:
        return {}
    return {
        "bolts": [
            {
                "name": name,
                "force_n_per_m": force,
                "shortening_m": by,
                "force_after_each_step_n_per_m": [float(f) for f in history],
            }
            for (name, force, by), history in zip(found.rows, found.history.T, strict=True)
        ],
    }


def model_dataset(run: Run) -> xr.Dataset:
    """The group ``model``: the model every analysis ran on."""
    model, states, joint = run.model, run.assembly.states, run.joint
    own, measures = run.mode, run.assembly.measures
    scalar = {
        "sliding_frequency": (own.sliding_frequency, "Hz", "natural frequency, sliding state"),
        "stuck_frequency": (own.stuck_frequency, "Hz", "natural frequency, stuck state"),
        "mode_overlap": (own.overlap, "1", "mass product of sliding and stuck mode"),
        "friction": (measures.friction, "1", "coefficient of friction, mean over the overlap"),
        **_pressing(measures),
        load_named(run, "opening"): (
            run.assembly.opening_moment,
            joint.driven.load.unit,
            f"{joint.driven.load.noun} at which the joint opens; infinite where none does",
        ),
    }
    mode = np.arange(len(model.omega))
    data = {name: variable((), *entry) for name, entry in scalar.items()}
    data |= {
        "area": variable(("pair",), model.area, "m", "area of the pair per metre of width"),
        "bonded": variable(
            ("pair",),
            np.isin(np.arange(model.pairs), states.pairs).astype(np.int8),
            "1",
            "pair bonded in the linear states",
            flag_values=np.array([0, 1], np.int8),
            flag_meanings="free bonded",
        ),
        "sliding_mode_slip": _slip(run, states.sliding, "slip of the sliding mode"),
        "stuck_mode_slip": _slip(run, states.stuck, "slip of the stuck mode"),
        "frequency": variable(
            ("mode",), model.omega / (2 * np.pi), "Hz", "natural frequency of free-interface mode"
        ),
        "modal_damping": variable(
            ("mode",), np.diag(model.damping_matrix()).copy(), "1/s", _damping_is(model)
        ),
    }
    coords = pair_position(run)
    coords["mode"] = variable(("mode",), mode, "1", "free-interface mode")
    return xr.Dataset(data, coords)


def _slip(run: Run, shape: Array, label: str) -> xr.Variable:
    """Slip of a mode at the pairs; of spatial ones in both tangential directions."""
    moved = slip_history(run.structure.interface.relative @ shape, run.model.dimension)
    dims = ("pair", "tangent")[: moved.ndim]
    return variable(dims, moved, "kg^-0.5 m^0.5", label)


def _pressing(measures: Measures) -> dict[str, tuple[float, str, str]]:
    """What presses the sides together, and over which length."""
    if measures.clamp:
        return {
            "clamp_force": (measures.force, "N/m", "clamp force per metre of width"),
            "clamp_half_length": (measures.half_length, "m", "half length of the clamped zone"),
        }
    return {
        "contact_force": (measures.force, "N/m", "sum of the normal reactions under the preload"),
        "interface_half_length": (measures.half_length, "m", "half length of the interface"),
    }


def prestress_dataset(run: Run) -> xr.Dataset:
    """The group ``prestress``: contact under the clamp alone."""
    start = run.prestress
    data = {
        "pressure": variable(("pair",), start.pressure, "Pa", "contact pressure"),
        "state": state_variable(("pair",), at_rest(start.touching)),
        "gap": variable(("pair",), -normal(start.solution.v, run.model.dimension), "m", "gap"),
        "residual": variable((), start.solution.residual, "1", "residual of the contact problem"),
    }
    return xr.Dataset(data, pair_position(run))


def _damping_is(model: JointModel) -> str:
    if model.damping is None:
        return "Rayleigh damping alpha + beta omega^2"
    return "diagonal of the modal damping matrix, which couples the modes"

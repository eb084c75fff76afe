"""The joint itself by name: its model and its prestress, as summaries and as datasets."""

from __future__ import annotations

from typing import Any

import numpy as np
import xarray as xr

from microslip.contact.fields import contact_extent
from microslip.contact.pairs import at_rest, normal, tangential_rows
from microslip.pipeline.run import Run
from microslip.results.labels import load_entry, load_named, pair_position, state_variable, variable


def model_summary(run: Run) -> dict[str, Any]:
    """Sizes, interface, linear states, what drives the joint and what opens it."""
    joint, model, mode = run.joint, run.model, run.mode
    clamp_half = joint.clamp.half_length
    bonded = model.position[run.assembly.states.pairs]
    return {
        "dofs": run.structure.dofs,
        "modes": len(model.omega),
        "contact_pairs": model.pairs,
        "interface": {
            "pair_spacing_m": np.diff(model.position).max(),
            "half_length_over_clamp_half_length": np.abs(model.position).max() / clamp_half,
        },
        "friction": joint.friction,
        "clamp_force_n_per_m": joint.clamp.force,
        "clamp_half_length_m": clamp_half,
        "clamp_force_length_n_m_per_m": run.assembly.moment_unit,
        "sliding_frequency_hz": mode.sliding_frequency,
        "stuck_frequency_hz": mode.stuck_frequency,
        "mode_overlap": mode.overlap,
        "bonded_half_length_over_clamp_half_length": np.abs(bonded).max() / clamp_half,
        **opening_entry(run),
    }


def opening_entry(run: Run) -> dict[str, Any]:
    """What opens the joint, on the driven port; None where nothing does."""
    opening = run.assembly.opening_moment
    return {
        f"opening_{key}": value if np.isfinite(opening) else None
        for key, value in load_entry(run, opening).items()
    }


def prestress_summary(run: Run) -> dict[str, Any]:
    """Extent and largest pressure of the contact under the clamp alone."""
    start, clamp = run.prestress, run.joint.clamp
    left, right = contact_extent(run.model.position, start.touching)
    mean = clamp.force / (2 * clamp.half_length)
    return {
        "contact_half_length_over_clamp_half_length": max(-left, right) / clamp.half_length,
        "peak_pressure_over_mean_clamp_pressure": start.pressure.max() / mean,
        "peak_pressure_pa": start.pressure.max(),
        "residual": start.solution.residual,
    }


def model_dataset(run: Run) -> xr.Dataset:
    """The group ``model``: the model every analysis ran on."""
    model, states, joint = run.model, run.assembly.states, run.joint
    own = run.mode
    tangential = run.structure.interface.relative[tangential_rows()]
    scalar = {
        "sliding_frequency": (own.sliding_frequency, "Hz", "natural frequency, sliding state"),
        "stuck_frequency": (own.stuck_frequency, "Hz", "natural frequency, stuck state"),
        "mode_overlap": (own.overlap, "1", "mass product of sliding and stuck mode"),
        "friction": (joint.friction, "1", "coefficient of friction, mean over the overlap"),
        "clamp_force": (joint.clamp.force, "N/m", "clamp force per metre of width"),
        "clamp_half_length": (joint.clamp.half_length, "m", "half length of the clamped zone"),
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
        "sliding_mode_slip": variable(
            ("pair",), tangential @ states.sliding, "kg^-0.5 m^0.5", "slip of the sliding mode"
        ),
        "stuck_mode_slip": variable(
            ("pair",), tangential @ states.stuck, "kg^-0.5 m^0.5", "slip of the stuck mode"
        ),
        "frequency": variable(
            ("mode",), model.omega / (2 * np.pi), "Hz", "natural frequency of free-interface mode"
        ),
        "modal_damping": variable(
            ("mode",), model.modal_damping(), "1/s", "Rayleigh damping alpha + beta omega^2"
        ),
    }
    coords = pair_position(run)
    coords["mode"] = variable(("mode",), mode, "1", "free-interface mode")
    return xr.Dataset(data, coords)


def prestress_dataset(run: Run) -> xr.Dataset:
    """The group ``prestress``: contact under the clamp alone."""
    start = run.prestress
    data = {
        "pressure": variable(("pair",), start.pressure, "Pa", "contact pressure"),
        "state": state_variable(("pair",), at_rest(start.touching)),
        "gap": variable(("pair",), -normal(start.solution.v), "m", "gap"),
        "residual": variable((), start.solution.residual, "1", "residual of the contact problem"),
    }
    return xr.Dataset(data, pair_position(run))

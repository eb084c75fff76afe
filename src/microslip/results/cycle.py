"""Quasi-static cycles by name: rows of the summary, contact over a cycle, and the tables."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from typing import Any

import numpy as np
import xarray as xr

from microslip.analyses.reduced.table import EquivalentTable, equivalent_table, modal_quantities
from microslip.analyses.statics.cycle import Cycle
from microslip.contact.fields import contact_extent, contact_fields
from microslip.contact.pairs import by_pair, touches
from microslip.numerics.fourier import without_drift
from microslip.pipeline.outputs import static_by_name
from microslip.pipeline.run import Run
from microslip.pipeline.sources import DRIVE
from microslip.results.labels import (
    MODAL,
    MODAL_FORCE,
    SLIP,
    field_variables,
    load_entry,
    load_named,
    load_unit,
    load_variable,
    output_label,
    output_name,
    over_clamp,
    pair_position,
    state_variable,
    variable,
)
from microslip.results.outputs import (
    modal_variable,
    output_coordinates,
    output_variable,
    sizes,
    stacked,
)
from microslip.typing import Array, Mask

BALANCED = 1e-3
"""Of the energy dissipated per cycle, what the work of the load may differ from it: a cycle whose energy
balances is closed for all that is made of it, also while tractions still creep."""


def table_of(run: Run, drive: str) -> EquivalentTable | None:
    """Equivalent table of a drive, also where too few cycles were solved for a response."""
    if drive in run.tables:
        return run.tables[drive]
    cycles = run.cycles.get(drive)
    if not cycles:
        return None
    return equivalent_table(cycles, run.prepared, drive)


def cycle_rows(run: Run) -> list[dict[str, Any]]:
    """One entry of the summary per drive and cycle."""
    return [row for drive in run.cycles for row in rows_of_drive(run, drive)]


def rows_of_drive(run: Run, drive: str) -> Iterator[dict[str, Any]]:
    """Rows of the cycles of one drive, ascending load."""
    table = table_of(run, drive)
    if table is None:
        return
    a = run.assembly
    wanted = run.joint.analysis.cycle
    for cycle, moment in zip(run.cycles[drive], run.moments[drive], strict=True):
        i = int(np.argmin(np.abs(table.load - cycle.amplitude)))
        touching = touches(cycle.status[np.argmax(cycle.load)])
        extent = contact_extent(a.model.position, touching)
        yield {
            "drive": drive,
            **load_entry(run, moment),
            "load": cycle.amplitude,
            "modal_amplitude": table.amplitude[i],
            "dissipated_energy_j_per_m": cycle.dissipated,
            "stored_energy_j_per_m": table.stored[i],
            "k_eq": table.k_eq[i],
            "gamma_eq": table.gamma_eq[i],
            **extent_entry(run, "contact_at_peak", extent),
            "separate_tip_contact_at_peak": bool(
                _outside(a.model.position, touching, extent).any()
            ),
            "residual_max": cycle.residual.max(),
            "unsolved_steps": 0,
            "hard_steps": cycle.hard_steps,
            "cycles_computed": cycle.cycles,
            "closure": cycle.closure,
            "energy_imbalance": cycle.imbalance,
            "walk_m": walk_of_cycle(cycle),
            "closed": (wanted is not None and cycle.closure <= wanted.closure)
            or cycle.imbalance <= BALANCED,
            "outputs": half_ranges(run, cycle),
        }


RETURNED = 1e-6
"""Of the largest distance from where they began: sides that end a cycle nearer have returned."""


def walk_of_cycle(cycle: Cycle) -> float:
    """By how much the sides of touching pairs have moved past each other after a cycle, m.

    The median over pairs; 0 where they have returned.
    """
    slip = by_pair(cycle.v, len(cycle.v[0]) // cycle.status.shape[1])[..., 1:]
    moved = np.linalg.norm(slip - slip[0], axis=-1)[:, touches(cycle.status[-1])]
    walk = float(np.median(moved[-1])) if moved.shape[1] else 0.0
    return walk if walk > RETURNED * moved.max(initial=0.0) else 0.0


def extent_entry(run: Run, name: str, extent: tuple[float, float]) -> dict[str, Any]:
    """Ends of the contact as an entry of the summary: over the half length of a clamp, else in m."""
    measures = run.assembly.measures
    if measures.clamp:
        return {f"{name}_over_clamp_half_length": [x / measures.half_length for x in extent]}
    return {f"{name}_m": list(extent)}


def half_ranges(run: Run, cycle: Cycle) -> dict[str, float]:
    """Half the way of every output over a cycle, a walk left out."""
    moved = static_by_name(run.assembly, without_drift(cycle.output, cycle.theta))
    return sizes(run, {name: 0.5 * np.ptp(y) for name, y in moved.items()})


def _outside(position: Array, touching: Mask, extent: tuple[float, float]) -> Mask:
    """Touching pairs that the central patch leaves out."""
    return touching & ((position < extent[0]) | (position > extent[1]))


def cycle_datasets(run: Run) -> dict[str, xr.Dataset]:
    """Groups ``cycles_moment`` or ``cycles_load``, ``cycles_mode`` and, side by side, their ``tables``."""
    groups = {
        f"cycles_{drive}": _cycles_dataset(run, drive)
        for drive, cycles in run.cycles.items()
        if cycles
    }
    return {**groups, "tables": _tables_dataset(run)} if groups else {}


def _cycles_dataset(run: Run, drive: str) -> xr.Dataset:
    cycles, model = run.cycles[drive], run.model
    fields = contact_fields(
        np.stack([c.r for c in cycles]),
        np.stack([c.v for c in cycles]),
        run.prestress.solution.v,
        model.area,
    )
    modal = [modal_quantities(c, run.prepared) for c in cycles]
    rows = list(rows_of_drive(run, drive))
    field = ("cycle", "step", "pair")
    trace = ("cycle", "step")
    each = ("cycle",)

    def per_cycle(name: str) -> Array:
        return np.array([np.nan if row[name] is None else row[name] for row in rows])

    data = {
        "state": state_variable(field, np.stack([c.status for c in cycles])),
        **field_variables(field, fields, slip=f"{SLIP} from prestress"),
        "load": variable(
            trace, np.stack([c.load for c in cycles]), load_unit(run, drive), "driving load"
        ),
        "q": variable(
            trace, np.stack([q for q, _ in modal]), MODAL, "sliding coordinate from prestress"
        ),
        **_rotation(run, cycles),
        **_driven(run, cycles),
        **_outputs(run, cycles),
        "f": variable(
            trace,
            np.stack([f for _, f in modal]),
            MODAL_FORCE,
            "contact force on the sliding mode beyond the sliding state",
        ),
        "iterations": variable(
            trace, np.stack([c.iterations for c in cycles]), "1", "active-set iterations"
        ),
        "residual": variable(
            trace, np.stack([c.residual for c in cycles]), "1", "residual of the contact problem"
        ),
        "dissipation": variable(
            ("cycle", "pair"),
            np.stack([c.friction_work / model.area for c in cycles]),
            "J/m^2",
            "friction work per cycle and area",
        ),
        "load_amplitude": variable(
            each, per_cycle("load"), load_unit(run, drive), "amplitude of the driving load"
        ),
        "dissipated_energy": variable(
            each, per_cycle("dissipated_energy_j_per_m"), "J/m", "friction work per cycle"
        ),
        "external_work": variable(
            each, np.array([c.external_work for c in cycles]), "J/m", "work of the load per cycle"
        ),
        "normal_work": variable(
            each,
            np.array([c.normal_work for c in cycles]),
            "J/m",
            "work of the normal reactions per cycle: an error of the load steps",
        ),
        "stored_energy": variable(
            each, per_cycle("stored_energy_j_per_m"), "J/m", "mean stored energy of the contact"
        ),
        "modal_amplitude": modal_variable(
            run, each, per_cycle("modal_amplitude"), "first harmonic of q"
        ),
        "k_eq": variable(each, per_cycle("k_eq"), "1", "equivalent stiffness over omega_sl^2"),
        "gamma_eq": variable(
            each, per_cycle("gamma_eq"), "1", "equivalent damping over omega_sl^2"
        ),
        "closure": variable(
            each,
            per_cycle("closure"),
            "1",
            "change of the reactions between the last two cycles over the largest prestress one",
        ),
        "cycles_computed": variable(
            each, np.array([c.cycles for c in cycles]), "1", "cycles computed until steady"
        ),
        "hard_steps": variable(
            each, np.array([c.hard_steps for c in cycles]), "1", "steps that needed safeguards"
        ),
    }
    coords = (
        pair_position(run)
        | output_coordinates(run)
        | {
            "theta": variable(("step",), cycles[0].theta, "rad", "phase of the load"),
            load_named(run): load_variable(run, each, run.moments[drive], "{}, or its equivalent"),
        }
    )
    return xr.Dataset(data, coords, {"drive": drive})


def _rotation(run: Run, cycles: Sequence[Cycle]) -> dict[str, xr.Variable]:
    """What end moments do work on, where the joint has them."""
    if DRIVE not in run.model.ports:
        return {}
    values = np.stack([c.output[:, run.model.port(DRIVE)] for c in cycles])
    return {"rotation": variable(("cycle", "step"), values, *output_label(DRIVE))}


def _driven(run: Run, cycles: Sequence[Cycle]) -> dict[str, xr.Variable]:
    """What the load of a named port does work on."""
    port = run.prepared.drive
    if port == DRIVE:
        return {}
    values = np.stack([c.output[:, run.model.port(port)] for c in cycles])
    return {output_name(port): variable(("cycle", "step"), values, *output_label(port, run))}


def _outputs(run: Run, cycles: Sequence[Cycle]) -> dict[str, xr.Variable]:
    moved = [static_by_name(run.assembly, c.output) for c in cycles]
    if not all(moved):
        return {}
    values = np.stack([stacked(run, each, -1) for each in moved])
    return {
        "output_value": output_variable(
            ("cycle", "step", "output"), values, "output from prestress; nan for rates"
        )
    }


def _tables_dataset(run: Run) -> xr.Dataset:
    """Equivalent tables of all drives side by side; nan where a cycle was not solved."""
    drives = [drive for drive, cycles in run.cycles.items() if cycles]
    levels = sorted({moment for drive in drives for moment in run.moments[drive]})
    columns = {
        "modal_amplitude": ("amplitude", MODAL, "first harmonic of the sliding coordinate"),
        "k_eq": ("k_eq", "1", "equivalent stiffness over omega_sl^2"),
        "gamma_eq": ("gamma_eq", "1", "equivalent damping over omega_sl^2"),
        "cross_stiffness": ("cross.real", "1", "cross stiffness over omega_sl^2"),
        "cross_damping": ("cross.imag", "1", "cross damping over omega_sl^2"),
        "dissipated_energy": ("dissipated", "J/m", "friction work per cycle"),
        "stored_energy": ("stored", "J/m", "mean stored energy of the contact"),
    }
    values = {name: np.full((len(drives), len(levels)), np.nan) for name in columns}
    for i, drive in enumerate(drives):
        table = table_of(run, drive)
        assert table is not None
        for cycle, moment in zip(run.cycles[drive], run.moments[drive], strict=True):
            row, level = int(np.argmin(np.abs(table.load - cycle.amplitude))), levels.index(moment)
            for name, (source, *_) in columns.items():
                attribute, _, part = source.partition(".")
                column = getattr(table, attribute)
                values[name][i, level] = (getattr(column, part) if part else column)[row]
    dims = ("drive", "level")
    data = {
        name: variable(dims, values[name], unit, label)
        for name, (_, unit, label) in columns.items()
    }
    moments = np.array(levels)
    coords = {
        "drive": variable(("drive",), drives, "1", "what drives the cycles"),
        load_named(run): load_variable(run, ("level",), moments, "{}, or its equivalent"),
    }
    if over_clamp(run):
        coords["moment_over_clamp_force_length"] = variable(
            ("level",), moments / run.assembly.moment_unit, "1", "end moment over P L"
        )
    return xr.Dataset(data, coords)

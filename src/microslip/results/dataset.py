"""What a run holds, by name: a short summary, labelled fields with units, and both on disk.

Signs. Pressure is positive in compression. The traction ``f`` acts on the upper body along x, so
``f = -r_t / area``: forward slip, where the upper body moves towards +x, has ``f = -mu p``. Slip is
the tangential displacement of the upper body relative to the lower, counted from prestress; the gap
is positive where the interface is open. All quantities are per metre of width.

Tractions are nodal forces over nodal areas: exact where the pressure is linear over an element,
unsmoothed everywhere, so that they integrate to the forces and stay inside the friction cone.
"""

from __future__ import annotations

import json
import math
import os
from collections.abc import Iterator, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
import xarray as xr
from numpy.typing import NDArray

from microslip.analyses.reduced.response import Response
from microslip.analyses.reduced.sweep import CONVERGED
from microslip.analyses.reduced.table import EquivalentTable, equivalent_table, modal_quantities
from microslip.analyses.statics.cycle import Cycle, Prestress
from microslip.contact.pairs import SEPARATED
from microslip.results.backbone import backbone_dataset, backbone_rows
from microslip.results.harmonic import fold_rows, harmonic_dataset, harmonic_rows
from microslip.results.labels import MODAL, MODAL_FORCE, pair_position, state_variable, variable
from microslip.results.timedomain import (
    history_dataset,
    history_row,
    time_domain_dataset,
    time_domain_row,
)
from microslip.typing import Array
from microslip.version import __version__

if TYPE_CHECKING:
    from microslip.model.joint import JointModel
    from microslip.pipeline.progress import Progress
    from microslip.pipeline.run import LapRun


_LOAD_UNIT = {"moment": "N m/m", "mode": MODAL_FORCE}


@dataclass(frozen=True)
class ContactFields:
    """Contact fields of a cycle, each ``(s + 1, m)``; signs in the header of this module.

    Attributes
    ----------
    pressure, traction : arrays
        Pa.
    slip, gap : arrays
        m; slip relative to prestress.
    """

    pressure: Array
    traction: Array
    slip: Array
    gap: Array


def contact_fields(cycle: Cycle, start: Prestress, model: JointModel) -> ContactFields:
    """Tractions, slip and gap of every pair at every step of a cycle."""
    d = model.dimension
    return ContactFields(
        pressure=cycle.r[:, ::d] / model.area,
        traction=-cycle.r[:, 1::d] / model.area,
        slip=cycle.v[:, 1::d] - start.solution.v[1::d],
        gap=-cycle.v[:, ::d],
    )


def contact_extent(position: Array, touching: NDArray[np.bool_]) -> tuple[float, float]:
    """Ends of the patch of touching pairs that holds the centre, or lies nearest to it.

    Patches that close separately, at the tips of the beams, do not count.

    Examples
    --------
    >>> x = np.linspace(-3, 3, 7)
    >>> contact_extent(x, np.array([True, False, True, True, True, True, False]))
    (-1.0, 2.0)
    """
    if not touching.any():
        return math.nan, math.nan
    pairs = np.flatnonzero(touching)
    left = right = int(pairs[np.argmin(np.abs(position[pairs]))])
    while left > 0 and touching[left - 1]:
        left -= 1
    while right < len(touching) - 1 and touching[right + 1]:
        right += 1
    return float(position[left]), float(position[right])


def table_of(result: LapRun, drive: str) -> EquivalentTable | None:
    """Equivalent table of a drive, also where too few cycles were solved for a response."""
    if drive in result.tables:
        return result.tables[drive]
    cycles = result.cycles.get(drive)
    if not cycles:
        return None
    return equivalent_table(cycles, result.model, result.states, result.joint.clamp.force, drive)


def frictionless_peak(result: LapRun, load: float) -> float:
    """Largest modal amplitude of the joint without friction in the band, scaled to a load."""
    reference = result.frictionless
    if reference is None or not reference.load:
        return math.nan
    return reference.peak_amplitude / reference.load * load


# Summary ---------------------------------------------------------------------------------------


def summary(result: LapRun) -> dict[str, Any]:
    """What a run found, in plain JSON types; None where there is no number.

    Parameters
    ----------
    result : LapRun

    Returns
    -------
    dict
        ``title``, ``version``, ``model``, ``prestress``, ``cycles``, ``response``, ``backbone``,
        ``harmonic``, ``harmonic_folds``, ``time_domain``, ``history``, ``rho_scale``, ``failures``,
        ``interrupted``, ``timings_s``. Units are in the names; forces and energies are per metre of
        width. A cycle is listed only where the solver certified every step, so its
        ``unsolved_steps`` are 0; cycles that failed are among the ``failures``.
    """
    cycles = [row for drive in result.cycles for row in _cycle_rows(result, drive)]
    found: dict[str, Any] = _plain(
        {
            "title": result.joint.title,
            "version": __version__,
            "model": _model_summary(result),
            "prestress": _prestress_summary(result),
            "cycles": cycles,
            "response": [_response_row(result, response) for response in result.responses],
            "backbone": list(backbone_rows(result)),
            "harmonic": harmonic_rows(result),
            "harmonic_folds": fold_rows(result),
            "time_domain": [time_domain_row(result, point) for point in result.time_domain],
            "history": [history_row(result, history) for history in result.histories],
            "rho_scale": result.rho_scale,
            "failures": list(result.failures),
            "interrupted": result.interrupted,
            "timings_s": dict(result.timings),
        }
    )
    return found


def _plain(value: Any) -> Any:
    """The same in types that JSON has; numbers that are not finite become None."""
    if isinstance(value, Mapping):
        return {str(key): _plain(item) for key, item in value.items()}
    if isinstance(value, list | tuple | np.ndarray):
        return [_plain(item) for item in value]
    if isinstance(value, bool | np.bool_):
        return bool(value)
    if isinstance(value, int | np.integer):
        return int(value)
    if isinstance(value, float | np.floating):
        return float(value) if math.isfinite(value) else None
    return value


def _model_summary(result: LapRun) -> dict[str, Any]:
    joint, model, states = result.joint, result.model, result.states
    clamp_half = joint.clamp.half_length
    bonded = model.position[states.pairs]
    return {
        "dofs": result.structure.dofs,
        "modes": len(model.omega),
        "contact_pairs": model.pairs,
        "interface": {
            "pair_spacing_m": np.diff(model.position).max(),
            "half_length_over_clamp_half_length": np.abs(model.position).max() / clamp_half,
        },
        "friction": joint.contact.friction,
        "clamp_force_n_per_m": joint.clamp.force,
        "clamp_half_length_m": clamp_half,
        "clamp_force_length_n_m_per_m": result.assembly.moment_unit,
        "sliding_frequency_hz": states.sliding_frequency,
        "stuck_frequency_hz": states.stuck_frequency,
        "mode_overlap": states.overlap,
        "bonded_half_length_over_clamp_half_length": np.abs(bonded).max() / clamp_half,
        "opening_moment_over_clamp_force_length": result.assembly.opening_moment
        / result.assembly.moment_unit,
    }


def _prestress_summary(result: LapRun) -> dict[str, Any]:
    start, clamp = result.prestress, result.joint.clamp
    left, right = contact_extent(result.model.position, start.touching)
    mean = clamp.force / (2 * clamp.half_length)
    return {
        "contact_half_length_over_clamp_half_length": max(-left, right) / clamp.half_length,
        "peak_pressure_over_mean_clamp_pressure": start.pressure.max() / mean,
        "peak_pressure_pa": start.pressure.max(),
        "residual": start.solution.residual,
    }


def _cycle_rows(result: LapRun, drive: str) -> Iterator[dict[str, Any]]:
    table = table_of(result, drive)
    if table is None:
        return
    a, clamp_half = result.assembly, result.joint.clamp.half_length
    wanted = result.joint.analysis.cycle
    for cycle, moment in zip(result.cycles[drive], result.moments[drive], strict=True):
        i = int(np.argmin(np.abs(table.load - cycle.amplitude)))
        touching = cycle.status[np.argmax(cycle.load)] != SEPARATED
        extent = contact_extent(a.model.position, touching)
        yield {
            "drive": drive,
            "moment_over_clamp_force_length": moment / a.moment_unit,
            "load": cycle.amplitude,
            "modal_amplitude": table.amplitude[i],
            "dissipated_energy_j_per_m": cycle.dissipated,
            "stored_energy_j_per_m": table.stored[i],
            "k_eq": table.k_eq[i],
            "gamma_eq": table.gamma_eq[i],
            "contact_at_peak_over_clamp_half_length": [x / clamp_half for x in extent],
            "separate_tip_contact_at_peak": bool(
                _outside(a.model.position, touching, extent).any()
            ),
            "residual_max": cycle.residual.max(),
            "unsolved_steps": 0,
            "hard_steps": cycle.hard_steps,
            "cycles_computed": cycle.cycles,
            "closure": cycle.closure,
            "closed": wanted is not None and cycle.closure <= wanted.closure,
        }


def _outside(
    position: Array, touching: NDArray[np.bool_], extent: tuple[float, float]
) -> NDArray[np.bool_]:
    """Touching pairs that the central patch leaves out."""
    return touching & ((position < extent[0]) | (position > extent[1]))


def _response_row(result: LapRun, response: Response) -> dict[str, Any]:
    bad = response.unconverged
    any_answer = bool((response.flag == CONVERGED).any())
    peak = response.peak_amplitude if any_answer else math.nan
    return {
        "variant": response.variant,
        "table": response.drive or None,
        "rho": response.rho,
        "moment_n": response.load,
        "moment_over_clamp_force_length": response.load / result.assembly.moment_unit,
        "peak_frequency_hz": response.peak_frequency if any_answer else math.nan,
        "peak_modal_amplitude": peak,
        "peak_amplitude_over_frictionless": peak / frictionless_peak(result, response.load),
        "peak_beside_unconverged": any_answer and _beside_unconverged(response),
        "unconverged_points": len(bad),
        "unconverged_from_hz": bad.min() if len(bad) else None,
        "unconverged_to_hz": bad.max() if len(bad) else None,
        "points": len(response.frequency),
        "contraction_max": response.contraction.max(),
        "iterations_max": response.iterations.max(),
        "error_indicator_max": None
        if response.error_indicator is None or not any_answer
        else response.error_indicator[response.flag == CONVERGED].max(),
        "error_indicator_at_peak": None
        if response.error_indicator is None or not any_answer
        else response.error_indicator[response.peak],
    }


def _beside_unconverged(response: Response) -> bool:
    """Whether the largest answer is next to a point without one, and so only a lower bound."""
    around = slice(max(response.peak - 1, 0), response.peak + 2)
    return bool((response.flag[around] != CONVERGED).any())


# Labelled fields -------------------------------------------------------------------------------


def dataset(result: LapRun) -> xr.DataTree:
    """Everything a run computed, with dimensions, units and long names.

    Groups ``model``, ``prestress``, ``cycles_moment``, ``cycles_mode``, ``tables``, ``response``,
    ``backbone``, ``harmonic``, ``time_domain`` and, below ``history``, one by the name of each
    history; a group is left out where its analysis was not asked for.

    Parameters
    ----------
    result : LapRun

    Returns
    -------
    xarray.DataTree
        In double precision; `write_results` stores the contact fields in single precision.
    """
    groups: dict[str, xr.Dataset] = {
        "model": _model_dataset(result),
        "prestress": _prestress_dataset(result),
    }
    for drive, cycles in result.cycles.items():
        if cycles:
            groups[f"cycles_{drive}"] = _cycles_dataset(result, drive)
    if any(result.cycles.values()):
        groups["tables"] = _tables_dataset(result)
    if result.responses:
        groups["response"] = _response_dataset(result)
    if any(backbone.points for backbone in result.backbones):
        groups["backbone"] = backbone_dataset(result)
    if any(run.points for run in result.harmonic):
        groups["harmonic"] = harmonic_dataset(result)
    if result.time_domain:
        groups["time_domain"] = time_domain_dataset(result)
    for history in result.histories:
        groups[f"history/{history.name}"] = history_dataset(result, history)
    root = xr.Dataset(
        attrs={
            "title": result.joint.title or "lap joint",
            "source": f"microslip {__version__}",
            "joint": result.joint.model_dump_json(by_alias=True, exclude_unset=True),
            "comment": "two-dimensional: forces, moments and energies are per metre of width",
            "failures": "\n".join(result.failures),
        }
    )
    return xr.DataTree.from_dict({"/": root, **groups})


def _model_dataset(result: LapRun) -> xr.Dataset:
    model, states, joint = result.model, result.states, result.joint
    relative = result.structure.interface.relative
    d = model.dimension
    scalar = {
        "sliding_frequency": (states.sliding_frequency, "Hz", "natural frequency, sliding state"),
        "stuck_frequency": (states.stuck_frequency, "Hz", "natural frequency, stuck state"),
        "mode_overlap": (states.overlap, "1", "mass product of sliding and stuck mode"),
        "friction": (joint.contact.friction, "1", "coefficient of friction"),
        "clamp_force": (joint.clamp.force, "N/m", "clamp force per metre of width"),
        "clamp_half_length": (joint.clamp.half_length, "m", "half length of the clamped zone"),
        "opening_moment": (
            result.assembly.opening_moment,
            "N m/m",
            "end moment at which the joint opens",
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
            ("pair",), relative[1::d] @ states.sliding, "kg^-0.5 m^0.5", "slip of the sliding mode"
        ),
        "stuck_mode_slip": variable(
            ("pair",), relative[1::d] @ states.stuck, "kg^-0.5 m^0.5", "slip of the stuck mode"
        ),
        "frequency": variable(
            ("mode",), model.omega / (2 * np.pi), "Hz", "natural frequency of free-interface mode"
        ),
        "modal_damping": variable(
            ("mode",), model.modal_damping(), "1/s", "Rayleigh damping alpha + beta omega^2"
        ),
    }
    coords = pair_position(result)
    coords["mode"] = variable(("mode",), mode, "1", "free-interface mode")
    return xr.Dataset(data, coords)


def _prestress_dataset(result: LapRun) -> xr.Dataset:
    start, d = result.prestress, result.model.dimension
    data = {
        "pressure": variable(("pair",), start.pressure, "Pa", "contact pressure"),
        "state": state_variable(("pair",), np.where(start.touching, 1, SEPARATED).astype(np.int8)),
        "gap": variable(("pair",), -start.solution.v[::d], "m", "gap"),
        "residual": variable((), start.solution.residual, "1", "residual of the contact problem"),
    }
    return xr.Dataset(data, pair_position(result))


def _cycles_dataset(result: LapRun, drive: str) -> xr.Dataset:
    cycles, model = result.cycles[drive], result.model
    fields = [contact_fields(c, result.prestress, model) for c in cycles]
    modal = [modal_quantities(c, model, result.states) for c in cycles]
    rows = list(_cycle_rows(result, drive))
    field = ("cycle", "step", "pair")
    trace = ("cycle", "step")
    each = ("cycle",)

    def stack(name: str) -> Array:
        return np.stack([getattr(f, name) for f in fields])

    def per_cycle(name: str) -> Array:
        return np.array([np.nan if row[name] is None else row[name] for row in rows])

    data = {
        "state": state_variable(field, np.stack([c.status for c in cycles])),
        "pressure": variable(field, stack("pressure"), "Pa", "contact pressure"),
        "traction": variable(field, stack("traction"), "Pa", "traction f on the upper body"),
        "slip": variable(
            field, stack("slip"), "m", "slip of the upper body over the lower from prestress"
        ),
        "gap": variable(field, stack("gap"), "m", "gap"),
        "load": variable(
            trace, np.stack([c.load for c in cycles]), _LOAD_UNIT[drive], "driving load"
        ),
        "q": variable(
            trace, np.stack([q for q, _ in modal]), MODAL, "sliding coordinate from prestress"
        ),
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
            each, per_cycle("load"), _LOAD_UNIT[drive], "amplitude of the driving load"
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
        "modal_amplitude": variable(
            each, per_cycle("modal_amplitude"), MODAL, "first harmonic of q"
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
    coords = pair_position(result) | {
        "theta": variable(("step",), cycles[0].theta, "rad", "phase of the load"),
        "moment": variable(
            each, np.array(result.moments[drive]), "N m/m", "end moment, or its equivalent"
        ),
    }
    return xr.Dataset(data, coords, {"drive": drive})


def _tables_dataset(result: LapRun) -> xr.Dataset:
    """Equivalent tables of all drives side by side; nan where a cycle was not solved."""
    drives = [drive for drive, cycles in result.cycles.items() if cycles]
    levels = sorted({moment for drive in drives for moment in result.moments[drive]})
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
        table = table_of(result, drive)
        assert table is not None
        for cycle, moment in zip(result.cycles[drive], result.moments[drive], strict=True):
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
        "moment": variable(("level",), moments, "N m/m", "end moment, or its equivalent"),
        "moment_over_clamp_force_length": variable(
            ("level",), moments / result.assembly.moment_unit, "1", "end moment over P L"
        ),
    }
    return xr.Dataset(data, coords)


def _response_dataset(result: LapRun) -> xr.Dataset:
    responses = result.responses
    curves, grid = ("curve",), ("curve", "frequency")

    def stack(values: Sequence[Any]) -> Array:
        return np.stack([np.asarray(v) for v in values])

    data = {
        "modal_amplitude": variable(
            grid, stack([np.abs(r.amplitude) for r in responses]), MODAL, "amplitude of q"
        ),
        "phase": variable(
            grid, stack([np.angle(r.amplitude) for r in responses]), "rad", "phase of q to the load"
        ),
        "iterations": variable(
            grid, stack([r.iterations for r in responses]), "1", "evaluations of the fixed point"
        ),
        "contraction": variable(
            grid, stack([r.contraction for r in responses]), "1", "contraction factor |g'|"
        ),
        "flag": variable(
            grid,
            stack([r.flag for r in responses]).astype(np.int8),
            "1",
            "what became of the point",
            flag_values=np.array([0, 1, 2], np.int8),
            flag_meanings="converged not_converged amplitude_above_table",
        ),
    }
    if any(r.error_indicator is not None for r in responses):
        unknown = np.full(len(responses[0].frequency), np.nan)
        estimates = [unknown if r.error_indicator is None else r.error_indicator for r in responses]
        data["error_indicator"] = variable(
            grid, stack(estimates), "1", "estimated relative error of the amplitude"
        )
    if result.frictionless is not None:
        reference = result.frictionless
        data["frictionless_compliance"] = variable(
            ("frequency",),
            np.abs(reference.amplitude) / reference.load,
            f"{MODAL} / (N m/m)",
            "amplitude of q per end moment without friction",
        )
    coords = {
        "frequency": variable(("frequency",), responses[0].frequency, "Hz", "frequency"),
        "variant": variable(
            curves, [r.variant for r in responses], "1", "variant of the reduced model"
        ),
        "table": variable(
            curves, [r.drive or "none" for r in responses], "1", "drive of the equivalent table"
        ),
        "rho": variable(curves, stack([r.rho for r in responses]), "1", "rho = C mu P L / M"),
        "moment": variable(
            curves, stack([r.load for r in responses]), "N m/m", "amplitude of the end moment"
        ),
    }
    return xr.Dataset(data, coords, {"rho_scale": result.rho_scale})


# On disk ---------------------------------------------------------------------------------------

_SINGLE = (
    *("pressure", "traction", "slip", "gap"),
    *("local_slip", "local_gap", "approach", "rotation", "u_clamp_edge", "lift", "stuck"),
)
_LONG = 10_000
"""Traces of more values are compressed."""
_PACKED = {"zlib": True, "complevel": 1, "shuffle": True}


@contextmanager
def replacing(path: Path) -> Iterator[Path]:
    """A temporary name beside `path` that takes its place once the block has ended well."""
    temporary = path.with_name(f".{path.stem}.{os.getpid()}{path.suffix}")
    try:
        yield temporary
        os.replace(temporary, path)
    finally:
        temporary.unlink(missing_ok=True)


def write_results(
    result: LapRun, out_dir: str | Path, progress: Progress | None = None
) -> list[Path]:
    """Write ``results.nc``, ``summary.json`` and ``figures/`` (PNG and SVG).

    A file of the same name is replaced in one go: whoever reads sees the old or the new one.

    Parameters
    ----------
    result : LapRun
    out_dir : path
        Made where it does not exist.
    progress : Progress, optional

    Returns
    -------
    list of pathlib.Path
        What was written.
    """
    from microslip.show.plots import figures_of, save_figures

    folder = Path(out_dir)
    folder.mkdir(parents=True, exist_ok=True)
    if progress is not None:
        progress.start("write results and figures", 2 + len(figures_of(result)))
    written = [write_summary(result, folder / "summary.json")]
    if progress is not None:
        progress.advance()
    written.append(write_dataset(dataset(result), folder / "results.nc"))
    if progress is not None:
        progress.advance()
    written += save_figures(result, folder / "figures", progress)
    if progress is not None:
        progress.finish()
    return written


def write_summary(result: LapRun, path: Path) -> Path:
    """Write the summary as JSON."""
    text = json.dumps(summary(result), indent=2, ensure_ascii=False, allow_nan=False)
    with replacing(path) as temporary:
        temporary.write_text(text + "\n", encoding="utf-8")
    return path


def write_dataset(tree: xr.DataTree, path: Path) -> Path:
    """Write labelled fields as netCDF-4, the contact fields in single precision."""
    encoding: dict[str, dict[str, Any]] = {}
    for node in tree.subtree:
        for name, values in node.data_vars.items():
            if values.ndim >= 2 or values.size > _LONG:
                single = {"dtype": "float32"} if name in _SINGLE else {}
                encoding.setdefault(node.path, {})[str(name)] = {**_PACKED, **single}
    with replacing(path) as temporary:
        tree.to_netcdf(temporary, engine="h5netcdf", encoding=encoding)
    return path

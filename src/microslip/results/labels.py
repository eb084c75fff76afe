"""Names and units of what results hold: one place for labelled variables."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np
import xarray as xr

from microslip.contact.fields import ContactFields
from microslip.pipeline.run import Run
from microslip.typing import Array, Indices, Status

MODAL = "kg^0.5 m^0.5"
"""Unit of a modal coordinate of a mass-normalised mode, per metre of width."""

MODAL_FORCE = "kg^0.5 m^0.5 s^-2"


OUTPUTS: dict[str, tuple[str, str]] = {
    "clamp": ("m", "approach of the clamped faces, mean of their change from prestress"),
    "moment": ("rad", "rotation of the ends that the end moments do work on"),
    "u_clamp_edge": ("m", "horizontal displacement of the lower beam at the edge of the clamp"),
    "lift": ("m", "vertical displacement of the middle of the joint"),
    "sliding": (MODAL, "sliding coordinate from prestress"),
    "stuck": (MODAL, "coordinate of the stuck mode from prestress"),
}
"""Unit and meaning of the output of each port of a lap joint."""

SLIP = "slip of the upper body over the lower"


def variable(
    dims: Sequence[str], values: Any, units: str, long_name: str, **attrs: Any
) -> xr.Variable:
    """Values with dimensions, unit and long name."""
    return xr.Variable(dims, values, {"units": units, "long_name": long_name, **attrs})


def load_unit(run: Run, drive: str) -> str:
    """Unit of the load of a drive."""
    return MODAL_FORCE if drive == "mode" else run.joint.driven.load.unit


def load_entry(run: Run, load: float) -> dict[str, float]:
    """A load on the driven port as an entry of the summary: of a moment over P L, else itself."""
    said = run.joint.driven.load
    if over_clamp(run):
        return {"moment_over_clamp_force_length": load / run.assembly.moment_unit}
    return {said.row: load}


def over_clamp(run: Run) -> bool:
    """Whether loads are reported over P L: moments of a joint whose clamp has dimensions."""
    return run.joint.driven.load.key == "moment" and run.assembly.measures.clamp


def load_named(run: Run, prefix: str = "", *suffix: str) -> str:
    """Name of a variable of the load: ``moment``, ``force``, ``acceleration`` or ``load_pressure``, since the
    contact has a pressure as well; with a prefix."""
    key = run.joint.driven.load.key
    own = "load_pressure" if key == "pressure" else key
    return "_".join((*filter(None, (prefix,)), own, *suffix))


def load_variable(
    run: Run, dims: Sequence[str], values: Any, label: str = "amplitude of the {}"
) -> xr.Variable:
    """Loads on the driven port; `label` says what they are of the noun between its braces."""
    said = run.joint.driven.load
    return variable(dims, np.asarray(values, float), said.unit, label.format(said.noun))


LOAD_COLUMNS = {
    "moment_over_clamp_force_length": "M/(PL)",
    "moment_n": "M, N m/m",
    "moment_n_m": "M, N m",
    "force_n_per_m": "F, N/m",
    "force_n": "F, N",
    "acceleration_m_per_s2": "a, m/s²",
    "pressure_pa": "p, Pa",
}
"""Keys of the summary that hold a load, with their headings in tables."""


def load_column(rows: Sequence[Mapping[str, Any]]) -> tuple[str, str]:
    """Heading and key of the load of rows of the summary.

    Examples
    --------
    >>> load_column([{"force_n_per_m": 20.0}])
    ('F, N/m', 'force_n_per_m')
    """
    key = next(key for key in LOAD_COLUMNS if all(key in row for row in rows))
    return LOAD_COLUMNS[key], key


def rho_entry(rho: float) -> dict[str, float]:
    """rho as an entry of the summary, where the file gives loads by it."""
    return {"rho": rho} if np.isfinite(rho) else {}


def rho_of(dims: Sequence[str], values: Sequence[float]) -> dict[str, xr.Variable]:
    """The coordinate ``rho``, where the file gives loads by it."""
    if not np.isfinite(values).any():
        return {}
    return {"rho": variable(dims, np.asarray(values, float), "1", "rho = C mu P L / M")}


def state_variable(dims: Sequence[str], values: Status) -> xr.Variable:
    """Contact states with the meaning of their numbers."""
    return variable(
        dims,
        values,
        "1",
        "contact state",
        flag_values=np.array([1, 2, 3, 4], np.int8),
        flag_meanings="stick forward_slip backward_slip separation",
    )


def pair_position(run: Run) -> dict[str, xr.Variable]:
    """Coordinate of the contact pairs, and where they are in the mesh, if they came from one."""
    x = run.model.position
    found = {"x": variable(("pair",), x, "m", "position of the contact pair along the interface")}
    imported = run.assembly.imported
    if imported is not None and imported.points is not None:
        place = variable(("pair", "axis"), imported.points, "m", "position of the pair in the mesh")
        found["point"] = place
    return found


def watched_position(run: Run, watched: Indices) -> xr.Variable:
    """Coordinate of the pairs whose motion is kept at every step."""
    x = run.model.position[watched]
    return variable(("position",), x, "m", "pair nearest to the position asked for")


def output_name(port: str) -> str:
    """What the output of a port is called in results."""
    known = {"sliding": "q", "moment": "rotation", "clamp": "approach"}
    return known.get(port, port if port in OUTPUTS else f"port_{port}")


def output_label(port: str, run: Run | None = None) -> tuple[str, str]:
    """Unit and meaning of the output of a port, of a named one where `run` has it."""
    named = () if run is None else run.joint.ports
    unit = next((own.load.output for own in named if own.name == port), "1")
    return OUTPUTS.get(port, (unit, f"what the load of the port {port} does work on"))


def local_variables(dims: tuple[str, ...], slip: Array, gap: Array) -> dict[str, xr.Variable]:
    """Slip and gap at the chosen positions; spatial slips have two components, along ``tangent``."""
    return {
        "local_slip": variable((*dims, "tangent")[: slip.ndim], slip, "m", SLIP),
        "local_gap": variable(dims, gap, "m", "gap"),
    }


def field_variables(
    dims: tuple[str, ...], fields: ContactFields, slip: str = SLIP
) -> dict[str, xr.Variable]:
    """Contact of all pairs; `slip` is the long name of the slip. Tractions and slips of spatial pairs have
    two components, along ``tangent``."""
    along = (*dims, "tangent")[: fields.slip.ndim]
    return {
        "pressure": variable(dims, fields.pressure, "Pa", "contact pressure"),
        "traction": variable(along, fields.traction, "Pa", "traction f on the upper body"),
        "slip": variable(along, fields.slip, "m", slip),
        "gap": variable(dims, fields.gap, "m", "gap"),
    }

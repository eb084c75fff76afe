"""Names and units of what results hold: one place for labelled variables."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING, Any

import numpy as np
import xarray as xr
from numpy.typing import NDArray

if TYPE_CHECKING:
    from microslip.pipeline.run import LapRun

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


def variable(
    dims: Sequence[str], values: Any, units: str, long_name: str, **attrs: Any
) -> xr.Variable:
    """Values with dimensions, unit and long name."""
    return xr.Variable(dims, values, {"units": units, "long_name": long_name, **attrs})


def state_variable(dims: Sequence[str], values: NDArray[np.int8]) -> xr.Variable:
    """Contact states with the meaning of their numbers."""
    return variable(
        dims,
        values,
        "1",
        "contact state",
        flag_values=np.array([1, 2, 3, 4], np.int8),
        flag_meanings="stick forward_slip backward_slip separation",
    )


def pair_position(result: LapRun) -> dict[str, xr.Variable]:
    """Coordinate of the contact pairs."""
    x = result.model.position
    return {"x": variable(("pair",), x, "m", "position of the contact pair along the interface")}

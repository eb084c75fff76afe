"""Outputs by name: what they are, and their values in every dataset and in the summary.

Datasets hold SI units, one dimension ``output`` with the names and the unit of each beside them.
The summary has the units that tables show, in its keys: ``deflection_mm``, ``slip_um``.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np
import xarray as xr

from microslip.analyses.prepared.direct import mode_motion
from microslip.describe.lap import LapJoint
from microslip.describe.matrices import VectorOutput
from microslip.describe.mesh import MeshOutput
from microslip.describe.outputs import NamedOutput, Output, position_of
from microslip.pipeline.outputs import columns
from microslip.pipeline.run import Run
from microslip.results.labels import MODAL, variable

PARTS = variable(("part",), ["real", "imaginary"], "1", "part of the complex number")
"""Coordinate of complex numbers."""


def primary(run: Run) -> NamedOutput:
    """The output that tables and figures show: the first of the file."""
    return run.joint.outputs[0]


def displacement(run: Run) -> NamedOutput | None:
    """The first output that is no rate, which static cycles know as well; None where all are."""
    moves = (o for o in run.joint.outputs if o.measured.order == 0 and not o.reacts)
    return next(moves, None)


def outputs_summary(run: Run) -> list[dict[str, Any]]:
    """What the outputs are, and what of each a unit of modal amplitude and of moment stands for."""
    return [
        {
            "name": output.name,
            "key": output.key,
            "quantity": output.quantity,
            "unit": output.measured.shown,
            "unit_in_si": 1 / output.measured.factor,
            "x_m": position(run, output),
            "beam": output.place[0] or None,
            "side": output.place[1] or None,
        }
        for output in run.joint.outputs
    ]


def position(run: Run, output: NamedOutput) -> float:
    """Where an output is along the interface, m, of a lap joint from its middle; nan where it is given by
    a vector or a node."""
    joint = run.joint
    if isinstance(joint, LapJoint) and isinstance(output, Output):
        return position_of(output, joint.extents, joint.clamp.edge)
    if isinstance(output, VectorOutput) and output.x is not None:
        return output.x
    if isinstance(output, MeshOutput) and output.at is not None:
        return output.at[0]
    return np.nan


def sizes(run: Run, values: Mapping[str, Any]) -> dict[str, float]:
    """Sizes of outputs under their keys in the summary, in the units of those.

    Parameters
    ----------
    run : Run
    values : mapping of str to number
        By name; SI. Those that are left out have none.
    """
    return {
        output.key: float(abs(values[output.name])) * output.measured.factor
        for output in run.joint.outputs
        if output.name in values
    }


def lags(run: Run, values: Mapping[str, Any]) -> dict[str, float]:
    """Phases of first harmonics by name, degrees against the sine of the load."""
    return {
        output.name: float(np.degrees(np.angle(values[output.name])))
        for output in run.joint.outputs
        if output.name in values
    }


def output_coordinates(run: Run) -> dict[str, xr.Variable]:
    """Names and units along the dimension ``output``."""
    outputs, dims = run.joint.outputs, ("output",)
    return {
        "output": variable(dims, [o.name for o in outputs], "1", "output"),
        "output_unit": variable(
            dims, [o.measured.unit for o in outputs], "1", "unit of the output"
        ),
    }


def stacked(run: Run, values: Mapping[str, Any], axis: int) -> Any:
    """Outputs side by side along a new axis; nan for those that have no values."""
    shape = next(iter(values.values())).shape
    found = [values.get(output.name, np.full(shape, np.nan)) for output in run.joint.outputs]
    return np.stack(found, axis=axis)


def output_variable(dims: Sequence[str], values: Any, label: str, per: str = "") -> xr.Variable:
    """Values of all outputs, whose units are beside their names.

    Parameters
    ----------
    dims : sequence of str
        ``output`` among them; complex values get ``part`` after these.
    values : array
    label : str
    per : str
        Unit that each is divided by.
    """
    unit = f"output_unit / ({per})" if per else "output_unit"
    if np.iscomplexobj(values):
        values, dims = np.stack([values.real, values.imag], axis=-1), (*dims, "part")
    return variable(dims, values, unit, label)


def per_mode(run: Run, output: NamedOutput) -> float:
    """An output per unit of the sliding coordinate; of a reaction with the inertia of the mode."""
    mode = run.mode
    if output.port in mode.load_on_sliding:
        return mode.load_on_sliding[output.port]
    sign = 1.0 if mode.load_on_sliding[run.prepared.drive] >= 0 else -1.0
    return sign * float(mode_motion(run.prepared)[run.model.port(output.port)])


def modal_factor(run: Run, output: NamedOutput | None = None) -> dict[str, Any]:
    """Attributes of a modal amplitude: what a unit of it is of a displacement in the mode, of the first
    where none is named."""
    output = output or displacement(run)
    if output is None:
        return {}
    size = abs(per_mode(run, output)) * output.measured.factor
    return {"per_unit": size, "per_unit_of": f"{output.measured.shown} of {output.name}"}


def modal_variable(run: Run, dims: Sequence[str], values: Any, label: str) -> xr.Variable:
    """Amplitudes of the sliding coordinate, with their factor to the first output."""
    return variable(dims, values, MODAL, label, **modal_factor(run))


def outputs_dataset(run: Run) -> xr.Dataset:
    """The group ``outputs``: where they are, what they are in the mode and under the clamp alone."""
    outputs, dims = run.joint.outputs, ("output",)
    places = list(columns(run.assembly).values())
    joint, s = run.prepared, run.prestress.solution
    rest = joint.flexibility.outputs(joint.held, s.q, s.r)
    still = np.array([o.measured.order == 0 for o in outputs])

    data = {
        "quantity": variable(dims, [o.quantity for o in outputs], "1", "what is measured"),
        "x": variable(
            dims, [position(run, o) for o in outputs], "m", "from the middle of the overlap"
        ),
        "beam": variable(dims, [o.place[0] for o in outputs], "1", "beam; empty: what is there"),
        "side": variable(dims, [o.place[1] for o in outputs], "1", "where on its height"),
        "sliding_mode": variable(
            dims,
            [per_mode(run, o) for o in outputs],
            f"output_unit / ({MODAL})",
            "displacement per unit of the sliding coordinate",
        ),
        "at_rest": variable(
            dims,
            np.where(still, rest[places], 0.0),
            "output_unit",
            "under the clamp alone, from the unloaded joint",
        ),
    }
    return xr.Dataset(data, output_coordinates(run))

"""Backbones by name: rows of the summary, and a dataset."""

from __future__ import annotations

from typing import Any

import numpy as np
import xarray as xr

from microslip.analyses.backbone.points import Backbone, BackbonePoint, material_damping
from microslip.pipeline.outputs import harmonics_by_name
from microslip.pipeline.run import Run
from microslip.results.labels import MODAL, variable
from microslip.results.outputs import PARTS, output_coordinates, output_variable, sizes, stacked
from microslip.typing import Complex


def backbone_rows(run: Run) -> list[dict[str, Any]]:
    """One entry of the summary per mode, method and amplitude."""
    return [row for backbone in run.backbones for row in _rows(run, backbone)]


def _rows(run: Run, backbone: Backbone) -> list[dict[str, Any]]:
    mode = backbone.mode
    return [
        {
            "mode": mode.number,
            "method": backbone.method,
            "modal_amplitude": point.amplitude,
            "amplitude_over_opening": point.amplitude / backbone.scale,
            "frequency_hz": point.omega / (2 * np.pi),
            "damping_ratio": point.damping_ratio,
            "material_damping_ratio": material_damping(run.model, point.omega, point.damping),
            "dissipated_energy_j_per_m": point.dissipated,
            "residual_max": point.residual,
            "closure": point.closure,
            "sliding_frequency_hz": mode.sliding_frequency,
            "stuck_frequency_hz": mode.stuck_frequency,
            "interface_matters": backbone.interface_matters,
            "outputs": sizes(run, outputs_of(run, point)),
        }
        for point in backbone.points
    ]


def outputs_of(run: Run, point: BackbonePoint) -> dict[str, Any]:
    """First harmonics of the outputs at a point of a backbone, phase against the mode."""
    if not len(point.motion):
        return {}
    return harmonics_by_name(run.assembly, point.motion, point.omega)


def backbone_datasets(run: Run) -> dict[str, xr.Dataset]:
    """The group ``backbone``."""
    return {"backbone": _dataset(run)} if any(b.points for b in run.backbones) else {}


def _dataset(run: Run) -> xr.Dataset:
    """All backbones, one curve each; nan beyond the points of a curve."""
    curves, count = run.backbones, max(len(b.points) for b in run.backbones)
    grid, each = ("curve", "point"), ("curve",)

    def stack(name: str) -> np.ndarray:
        values = np.full((len(curves), count), np.nan)
        for row, backbone in zip(values, curves, strict=True):
            row[: len(backbone.points)] = [getattr(p, name) for p in backbone.points]
        return values

    data = {
        "modal_amplitude": variable(grid, stack("amplitude"), MODAL, "amplitude of the mode"),
        "frequency": variable(grid, stack("omega") / (2 * np.pi), "Hz", "natural frequency"),
        "damping_ratio": variable(grid, stack("damping_ratio"), "1", "damping ratio"),
        "dissipated_energy": variable(grid, stack("dissipated"), "J/m", "friction work per cycle"),
        "residual": variable(grid, stack("residual"), "1", "residual of the contact problem"),
        "closure": variable(
            grid, stack("closure"), "1", "change of the reactions over the last cycle"
        ),
        "sliding_frequency": variable(
            each,
            [b.mode.sliding_frequency for b in curves],
            "Hz",
            "natural frequency, sliding state",
        ),
        "stuck_frequency": variable(
            each, [b.mode.stuck_frequency for b in curves], "Hz", "natural frequency, stuck state"
        ),
        "opening_amplitude": variable(
            each,
            [b.scale for b in curves],
            MODAL,
            "amplitude at which the inertia of the mode opens the joint",
        ),
    }
    if all(len(p.motion) for b in curves for p in b.points):
        data["output_amplitude"] = output_variable(
            (*grid, "output"),
            _outputs(run, count),
            "first harmonic of the output, phase against the mode",
        )
    coords = output_coordinates(run) | {
        "part": PARTS,
        "mode": variable(each, [b.mode.number for b in curves], "1", "mode of the joint"),
        "method": variable(each, [b.method for b in curves], "1", "method"),
    }
    return xr.Dataset(data, coords)


def _outputs(run: Run, count: int) -> Complex:
    """Outputs of all curves, (curves, points, outputs); nan beyond the points of a curve."""
    values = np.full((len(run.backbones), count, len(run.joint.outputs)), np.nan + 0j)
    for row, backbone in zip(values, run.backbones, strict=True):
        for k, point in enumerate(backbone.points):
            found = {name: np.asarray(y) for name, y in outputs_of(run, point).items()}
            row[k] = stacked(run, found, 0)
    return values

"""Everything a run computed, as labelled fields with units: the groups of ``results.nc``."""

from __future__ import annotations

import xarray as xr

from microslip.describe.whole import WideJoint
from microslip.errors import MicroslipError
from microslip.pipeline.run import Run
from microslip.registry import column
from microslip.results.joint import model_dataset, prestress_dataset
from microslip.results.outputs import outputs_dataset
from microslip.results.whole import whole_dataset
from microslip.version import __version__


def dataset(run: Run) -> xr.DataTree:
    """Everything a run computed, with dimensions, units and long names.

    Groups ``model``, ``prestress`` and those of every analysis that found something: ``backbone``,
    ``cycles_moment``, ``cycles_mode``, ``tables``, ``response``, ``harmonic``, ``time_domain`` and,
    below ``history``, one by the name of each history.

    Parameters
    ----------
    run : Run

    Returns
    -------
    xarray.DataTree
        In double precision; `microslip.results.files.write_dataset` stores the contact fields in
        single precision.

    Raises
    ------
    MicroslipError
        Where two analyses name a group alike.
    """
    groups: dict[str, xr.Dataset] = {
        "model": model_dataset(run),
        "prestress": prestress_dataset(run),
        "outputs": outputs_dataset(run),
    }
    for row, datasets in column("datasets"):
        if run.value(row.name) is None:
            continue
        for name, group in datasets(run).items():
            if name in groups:
                raise MicroslipError(f"analysis {row.name!r}: there is a group {name!r} already")
            groups[name] = group
    if run.joint.whole:
        groups = {name: whole_dataset(group) for name, group in groups.items()}
    root = xr.Dataset(
        attrs={
            "title": run.joint.title or run.joint.unnamed.removeprefix("a "),
            "source": f"microslip {__version__}",
            "joint": run.joint.model_dump_json(by_alias=True, exclude_unset=True),
            "comment": _per_width(run),
            "failures": "\n".join(map(str, run.failures)),
        }
    )
    return xr.DataTree.from_dict({"/": root, **groups})


def _per_width(run: Run) -> str:
    """What forces, moments and energies are per metre of."""
    spatial = run.model.dimension == 3
    kind = "three-dimensional" if spatial else "two-dimensional"
    if run.joint.whole:
        return f"{kind}: forces, moments and energies are those of the whole structure"
    if not spatial or not isinstance(run.joint, WideJoint):
        return f"{kind}: forces, moments and energies are per metre of width"
    return (
        f"{kind}: forces, moments and energies are per metre of the width, {run.joint.width:g} m; times "
        "the width they are those of the whole structure"
    )

"""Errors of the reduced models against time integration, from a run of `time_domain.toml`.

python docs/evidence/time_domain_errors.py FOLDER

For every load and variant, over the frequencies of the steady states: error of amplitude and phase of the
model's answer, where it folds of the nearer of its two motions.
"""

from __future__ import annotations

import sys
from pathlib import Path

import numpy as np
import xarray as xr

VARIANTS = ("refined", "consistent", "printed")


def answers(tree: xr.DataTree, variant: str, rho: float) -> tuple[np.ndarray, np.ndarray]:
    """Frequencies of a curve, and its one or two complex amplitudes there, columns."""
    curves = tree["response"].to_dataset()
    same = (curves["variant"] == variant) & np.isclose(curves["rho"], rho)
    curve = curves.isel(curve=int(np.flatnonzero(same)[0]))
    larger = curve["modal_amplitude"] * np.exp(1j * curve["phase"])
    smaller = curve["smaller_modal_amplitude"] * np.exp(1j * curve["smaller_phase"])
    return curve["frequency"].values, np.column_stack([larger.values, smaller.values])


def main(folder: Path) -> None:
    """Print the table."""
    tree = xr.open_datatree(folder / "results.nc")
    points = tree["time_domain"].to_dataset()
    true = (points["modal_amplitude"] * np.exp(1j * points["phase"])).values
    for rho in np.unique(points["rho"].values):
        own = (points["rho"].values == rho) & (points["converged"].values == 1)
        for variant in VARIANTS:
            f, found = answers(tree, variant, rho)
            at = np.abs(f[:, None] - points["frequency"].values[own]).argmin(axis=0)
            apart = np.nan_to_num(np.abs(found[at] - true[own, None]), nan=np.inf)
            ratio = found[at, apart.argmin(axis=1)] / true[own]
            size, turn = np.abs(ratio) - 1, np.degrees(np.angle(ratio))
            worst, most = int(np.nanargmax(abs(size))), int(np.nanargmax(abs(turn)))
            where = points["frequency"].values[own]
            print(
                f"| {rho:g} | {variant} | {100 * np.nanmedian(abs(size)):.2g} %, "
                f"{np.nanmedian(abs(turn)):.2f}° | {100 * size[worst]:+.3g} % at {where[worst]:g} Hz, "
                f"{turn[most]:+.3g}° at {where[most]:g} Hz | {np.isfinite(size).sum()} of {own.sum()}"
            )


if __name__ == "__main__":
    main(Path(sys.argv[1]))

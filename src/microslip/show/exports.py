"""Results for other programs: ParaView (VTK) and test rigs (universal files)."""

from __future__ import annotations

from pathlib import Path

from microslip.pipeline.run import Run
from microslip.results.universal import UFF, points_alone, write_universal
from microslip.results.vtk import VTK, write_vtk
from microslip.show.plots.selection import greatest_damping, main_drive

EXPORTS = {
    "vtk": "for ParaView: modes, prestress, motion and contact over a cycle and over vibrations",
    "uff": "universal file, dataset 58: frequency responses",
}
"""Formats for other programs."""


def export(run: Run, folder: Path, formats: tuple[str, ...]) -> list[Path]:
    """Write a run for other programs; what it has nothing for is left out.

    Parameters
    ----------
    run : Run
    folder : Path
        Of the run.
    formats : tuple of str
        Of `EXPORTS`.

    Raises
    ------
    InputError
        Where VTK is asked for and nothing is known of the places of the nodes.
    """
    written: list[Path] = []
    if "vtk" in formats:
        drive = main_drive(run)
        index = greatest_damping(run, drive) if drive else 0
        written += write_vtk(run, folder / VTK, drive, index)
    if "uff" in formats:
        path = write_universal(run, folder / UFF)
        written += [] if path is None else [path]
    return written


def not_exported(run: Run, formats: tuple[str, ...]) -> list[str]:
    """What a run has and the files for other programs have not, a line each."""
    if "uff" not in formats:
        return []
    return [
        f"not in {UFF}: {alone}: one point is no function of the frequency"
        for alone in points_alone(run)
    ]

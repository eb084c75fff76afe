"""Figures of a run: one module each, one house style."""

from __future__ import annotations

from collections.abc import Callable
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING

from matplotlib.figure import Figure

from microslip.pipeline.run import LapRun
from microslip.show.plots.backbone import backbone_figure
from microslip.show.plots.dissipation import dissipation_figure
from microslip.show.plots.harmonic import harmonic_figure
from microslip.show.plots.history import history_figure
from microslip.show.plots.hysteresis import hysteresis_figure
from microslip.show.plots.model import model_figure
from microslip.show.plots.natural import natural_figure
from microslip.show.plots.overview import overview
from microslip.show.plots.prestress import prestress_figure
from microslip.show.plots.response import response_figure
from microslip.show.plots.states import states_figure
from microslip.show.plots.steady import steady_figure
from microslip.show.plots.style import save
from microslip.show.plots.tractions import tractions_figure

if TYPE_CHECKING:
    from microslip.pipeline.progress import Progress

FIGURES: dict[str, Callable[[LapRun], Figure | None]] = {
    "model": model_figure,
    "prestress": prestress_figure,
    "contact_states": states_figure,
    "tractions": tractions_figure,
    "hysteresis": hysteresis_figure,
    "equivalent": backbone_figure,
    "backbones": natural_figure,
    "dissipation": dissipation_figure,
    "response": response_figure,
    "harmonic": harmonic_figure,
    "steady_state": steady_figure,
    "overview": overview,
}
"""File name of every figure and the function that draws it, None where there is nothing to show."""

__all__ = ["FIGURES", "figures_of", "overview", "save_figures"]


def save_figures(
    result: LapRun, folder: str | Path, progress: Progress | None = None
) -> list[Path]:
    """Write every figure that the run has data for, as PNG and SVG.

    Parameters
    ----------
    result : LapRun
    folder : path
        Made where it does not exist.
    progress : Progress, optional
        Advanced once per figure.

    Returns
    -------
    list of pathlib.Path
    """
    written: list[Path] = []
    for name, draw in figures_of(result).items():
        figure = draw(result)
        if figure is not None:
            written += save(figure, Path(folder), name)
        if progress is not None:
            progress.advance()
    return written


def figures_of(result: LapRun) -> dict[str, Callable[[LapRun], Figure | None]]:
    """File name and drawing function of every figure of a run, one for each of its histories."""
    histories = {
        f"history_{history.name}": partial(history_figure, history=history)
        for history in result.histories
    }
    return {**FIGURES, **histories}

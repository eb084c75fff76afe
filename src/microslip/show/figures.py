"""Every figure of a run: the joint's own, those of its analyses, and the overview."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from functools import partial
from pathlib import Path

import numpy as np
from matplotlib.figure import Figure
from matplotlib.text import Text

from microslip.describe.units_of_the_whole import in_whole
from microslip.pipeline.judge import Judgement
from microslip.pipeline.progress import NullProgress, Progress
from microslip.pipeline.run import Run
from microslip.registry import ANALYSES, resolved
from microslip.show.plots.model import model_figure
from microslip.show.plots.motions import (
    harmonic_motion_figure,
    motion_figure,
    time_motion_figure,
)
from microslip.show.plots.overview import overview
from microslip.show.plots.overview_spatial import spatial_overview
from microslip.show.plots.prestress import prestress_figure
from microslip.show.plots.spatial_fields import (
    pressure_figure,
    spatial_dissipation_figure,
    spatial_states_figure,
    spatial_steady_figure,
    spatial_tractions_figure,
)
from microslip.show.plots.structure import modes_figure, structure_figure
from microslip.show.plots.style import USUAL_FORMATS, save

Drawing = Callable[[Run], Figure | Mapping[str, Figure] | None]
"""A figure, several by what is appended to the file name, or None where there is nothing to show."""


IN_SPACE: dict[str, Drawing] = {
    "prestress": pressure_figure,
    "contact_states": spatial_states_figure,
    "tractions": spatial_tractions_figure,
    "dissipation": spatial_dissipation_figure,
    "steady_state": spatial_steady_figure,
}
"""What draws on surfaces what other figures draw along a line."""

MOTIONS: dict[str, tuple[str, Drawing]] = {
    "cycle": ("motion", motion_figure),
    "harmonic": ("motion_harmonic", harmonic_motion_figure),
    "time": ("motion_time", time_motion_figure),
}
"""Motions of a structure that has no figure of a lap joint, by the analysis that finds them."""

ALONG = ("prestress", "overview", "contact_states", "tractions", "dissipation", "steady_state")
"""Figures of fields along one planar interface."""

NO_PLACES = "the nodes have no coordinates"
NO_LINE = "pairs of several interfaces in the plane are not in line"
"""Why figures are left out."""


def figures_of(run: Run, judged: Judgement | None = None) -> dict[str, Drawing]:
    """File name of every figure that the run may have data for, and what draws it.

    Parameters
    ----------
    run : Run
    judged : Judgement, optional
        Of that run, where it is known, for the overview.
    """
    drawings = _every(run, judged)
    return {name: draw for name, draw in drawings.items() if name not in left_out(run)}


def left_out(run: Run) -> dict[str, str]:
    """Figures that there would be of another joint with the same analyses, and why there are none of this."""
    names = [name for name in _every(run, None) if name in ALONG]
    if run.model.dimension == 3:
        return dict.fromkeys(names, NO_PLACES) if run.geometry is None else {}
    return {} if in_line(run) else dict.fromkeys(names, NO_LINE)


def _every(run: Run, judged: Judgement | None) -> dict[str, Drawing]:
    """Figures of everything that was computed."""
    described = not run.structure.meshes
    drawings: dict[str, Drawing] = {
        "model": structure_figure if described else model_figure,
        "prestress": prestress_figure,
    }
    if described:
        drawings["modes"] = modes_figure
    for row in ANALYSES.values():
        if run.value(row.name) is not None:
            drawings |= {name: resolved(draw) for name, draw in row.figures.items()}
    if described:
        drawings |= dict(at for name, at in MOTIONS.items() if run.value(name) is not None)
    if run.model.dimension == 3:
        drawings |= {name: draw for name, draw in IN_SPACE.items() if name in drawings}
        return drawings | {"overview": partial(spatial_overview, judged=judged)}
    return drawings | {"overview": partial(overview, judged=judged)}


def in_line(run: Run) -> bool:
    """Whether all contact pairs are one after the other along one line, so that fields are drawn over it."""
    return run.model.dimension == 2 and bool((np.diff(run.model.position) > 0).all())


def draw_figures(name: str, draw: Drawing, run: Run) -> dict[str, Figure]:
    """Figures that a drawing gives, by file name."""
    found = draw(run)
    if found is None:
        return {}
    figures = (
        {f"{name}_{part}": figure for part, figure in found.items()}
        if isinstance(found, Mapping)
        else {name: found}
    )
    if run.joint.whole:
        for figure in figures.values():
            _in_whole(figure)
    return figures


def _in_whole(figure: Figure) -> None:
    """Give all text of a figure the units of the whole structure."""
    for text in figure.findobj(Text):
        said = text.get_text()
        if in_whole(said) != said:
            text.set_text(in_whole(said))


def save_figures(
    run: Run,
    folder: str | Path,
    progress: Progress | None = None,
    formats: Sequence[str] = USUAL_FORMATS,
    judged: Judgement | None = None,
) -> list[Path]:
    """Write every figure that the run has data for.

    Parameters
    ----------
    run : Run
    folder : path
        Made where it does not exist.
    progress : Progress, optional
        Advanced once per entry of `figures_of`.
    formats : sequence of str
        Any of ``png``, ``svg``, ``pdf``; without any nothing is drawn.
    judged : Judgement, optional
        Of that run, where it is known.

    Returns
    -------
    list of pathlib.Path
    """
    progress = progress or NullProgress()
    written: list[Path] = []
    for name, draw in figures_of(run, judged).items() if formats else ():
        for file, figure in draw_figures(name, draw, run).items():
            written += save(figure, Path(folder), file, formats)
        progress.advance()
    return written

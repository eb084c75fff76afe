"""One picture of a whole run of a joint in space."""

from __future__ import annotations

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.gridspec import SubplotSpec
from matplotlib.layout_engine import ConstrainedLayoutEngine

from microslip.pipeline.judge import Judgement, judge
from microslip.pipeline.run import Run
from microslip.show.plots.interface_maps import (
    colour_bar,
    laid_flat,
    never_touching,
    state_handles,
    title,
)
from microslip.show.plots.overview import BELOW, MOST_PANELS, Panel, found_panels, warn
from microslip.show.plots.selection import name_of
from microslip.show.plots.spatial_fields import draw_instant, draw_pressure, shown_cycle
from microslip.show.plots.structure import draw_given, marks_of
from microslip.show.plots.style import DOUBLE, MM, house_style, new_figure
from microslip.show.plots.view import view_of

HEADROOM = 0.97
"""Height of the panels in the figure: the layout leaves no room for titles above maps of fixed shape."""

RATIOS = (1.0, 1.2)
"""Heights of the rows: the lower one has panels in two parts with legends below."""

BETWEEN = 0.06
"""Room between the legends of the upper panels and the titles of the lower ones, over a panel's height."""

SQUARE = 1.4
"""Width over height of a map that fills its panel."""


@house_style
def spatial_overview(run: Run, judged: Judgement | None = None) -> Figure | None:
    """Structure, contact of its largest interface, and up to two panels of what was computed."""
    if run.geometry is None:
        return None
    contact: Panel = _pressure if shown_cycle(run) is None else _states
    panels = [contact, *found_panels(run)][:MOST_PANELS]
    rows = 1 if len(panels) == 1 else 2
    figure = new_figure(DOUBLE, (80 if rows == 1 else 178) * MM)
    grid = figure.add_gridspec(rows, 2, height_ratios=RATIOS[:rows])
    _structure(figure, grid[0, 0], run, "a")
    places = [grid[0, 1]]
    if rows == 2:
        places += [grid[1, 0], grid[1, 1]] if len(panels) == MOST_PANELS else [grid[1, :]]
    for draw, place, letter in zip(panels, places, "bcd", strict=False):
        draw(figure, place, run, letter)
    warn(figure, judge(run) if judged is None else judged)
    layout = figure.get_layout_engine()
    if isinstance(layout, ConstrainedLayoutEngine):
        layout.set(rect=(0, 0, 1, HEADROOM), hspace=BETWEEN)
    return figure


def _structure(figure: Figure, place: SubplotSpec, run: Run, letter: str) -> None:
    geometry = run.geometry
    assert geometry is not None
    ax = figure.add_subplot(place)
    marks = marks_of(run.joint, run.structure, run.prestress.preload, run.prepared.drive)
    handles = draw_given(ax, geometry, run.structure, marks, view_of(geometry))
    ax.set_title(f"({letter})  the structure", loc="left")
    ax.legend(handles=handles, ncols=2, loc="upper center", bbox_to_anchor=(0.5, -0.02))


def _largest(run: Run) -> int:
    """The interface that carries most of the preload."""
    assert run.geometry is not None
    force = run.prestress.pressure * run.model.area
    return int(np.argmax([force[each.pairs].sum() for each in run.geometry.surfaces]))


def _pressure(figure: Figure, place: SubplotSpec, run: Run, letter: str) -> None:
    drawn = laid_flat(run)[_largest(run)]
    ax = figure.add_subplot(place)
    shown = draw_pressure(ax, run, drawn)
    colour_bar(figure, shown, [ax], "pressure (MPa)")
    ax.set_title(f"({letter})  {ax.get_title(loc='left')}", loc="left")


def _states(figure: Figure, place: SubplotSpec, run: Run, letter: str) -> None:
    found = shown_cycle(run)
    assert found is not None
    drive, index, cycle = found
    drawn = laid_flat(run)[_largest(run)]
    status = cycle.status[1:, drawn[0].pairs]
    ax = figure.add_subplot(place)
    never = never_touching(status)
    draw_instant(ax, drawn, cycle, int(np.argmax(cycle.load)), never)
    said = title(drawn, run, f"contact at {name_of(run, drive, index)}")
    ax.set_title(f"({letter})  {said}", loc="left")
    shown = state_handles(never)
    ax.legend(handles=[*shown[:2], *shown[3:]], ncols=2, **(BELOW | {"bbox_to_anchor": _under(ax)}))


def _under(ax: Axes) -> tuple[float, float]:
    """Where the legend of a map stands: the flatter the map, the more of its heights is the same distance."""
    (left, right), (low, high) = ax.get_xlim(), ax.get_ylim()
    flat = abs(right - left) / abs(high - low)
    return 0.5, -0.16 * max(1.0, flat / SQUARE)

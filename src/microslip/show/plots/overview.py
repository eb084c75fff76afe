"""One picture of a whole run."""

from __future__ import annotations

import textwrap
from dataclasses import replace

from matplotlib.figure import Figure
from matplotlib.gridspec import SubplotSpec

from microslip.pipeline.judge import judge
from microslip.pipeline.run import Run
from microslip.show.plots.equivalent import amplitude_label, draw_equivalent
from microslip.show.plots.model import draw_model, draw_overlap
from microslip.show.plots.response import TITLES, draw_response
from microslip.show.plots.response import handles as response_handles
from microslip.show.plots.selection import greatest_damping, main_drive, name_of
from microslip.show.plots.states import draw_states
from microslip.show.plots.states import handles as state_handles
from microslip.show.plots.style import DOUBLE, MM, VERMILLION, draw_legend, house_style, new_figure

LINE, MOST = 135, 4
"""Characters of a line at the foot, and how many warnings stand there."""


@house_style
def overview(run: Run) -> Figure:
    """Joint, contact states, equivalent stiffness and damping, response.

    Without cycles there are no contact states, and the response has their room.
    """
    figure = new_figure(DOUBLE, 165 * MM)
    grid = figure.add_gridspec(2, 2)
    _joint(figure, grid[0, 0], run)
    drive = main_drive(run)
    if drive:
        index = greatest_damping(run, drive)
        states = figure.add_subplot(grid[0, 1])
        draw_states(states, run, drive, index)
        states.set_title(f"(b)  contact over a cycle, {name_of(run, drive, index)}", loc="left")
        states.legend(
            handles=state_handles(), loc="upper center", bbox_to_anchor=(0.5, -0.16), ncols=2
        )
    if run.tables:
        _equivalent(figure, grid[1, 0] if drive else grid[0, 1], run, "c" if drive else "b")
    if run.responses and run.frictionless is not None:
        variant = run.responses[-1].variant
        response = figure.add_subplot(grid[1, 1] if drive else grid[1, :])
        draw_response(response, run, variant)
        letter = "d" if drive else "c"
        title = f"({letter})  forced response, {TITLES.get(variant, variant)}"
        response.set_title(title, loc="left")
        draw_legend(
            response,
            response_handles(run),
            loc="upper center",
            bbox_to_anchor=(0.5, -0.16),
            ncols=2,
        )
    _warn(figure, run)
    return figure


def _warn(figure: Figure, run: Run) -> None:
    """What should be doubted, at the foot, a line each; what to do is in the summary."""
    said = [str(replace(caution, remedy="")) for caution in judge(run).cautions]
    cautions = [textwrap.shorten(line, LINE, placeholder=" ...") for line in said]
    if cautions:
        more = [f"and {len(cautions) - MOST} more in summary.json"] if len(cautions) > MOST else []
        text = "\n".join([*(f"warning: {c}" for c in cautions[:MOST]), *more])
        figure.supxlabel(text, fontsize=6.5, color=VERMILLION, x=0.01, ha="left")


def _joint(figure: Figure, place: SubplotSpec, run: Run) -> None:
    if not run.structure.meshes:
        return
    cells = place.subgridspec(2, 1, height_ratios=[1.0, 1.5])
    whole, near = figure.add_subplot(cells[0]), figure.add_subplot(cells[1])
    draw_model(whole, run)
    draw_overlap(near, run)
    whole.set_title("(a)  the joint and its overlap", loc="left")


def _equivalent(figure: Figure, place: SubplotSpec, run: Run, letter: str) -> None:
    cells = place.subgridspec(2, 1)
    top = figure.add_subplot(cells[0])
    bottom = figure.add_subplot(cells[1], sharex=top)
    draw_equivalent(top, run, "k_eq")
    draw_equivalent(bottom, run, "gamma_eq")
    top.set_title(f"({letter})  stiffness and damping against amplitude", loc="left")
    top.tick_params(labelbottom=False)
    bottom.set_xlabel(amplitude_label(run))
    bottom.legend(*top.get_legend_handles_labels(), loc="upper center", bbox_to_anchor=(0.5, -0.36))

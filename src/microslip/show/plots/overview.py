"""One picture of a whole run."""

from __future__ import annotations

import textwrap
from collections.abc import Callable
from dataclasses import replace
from typing import Any

from matplotlib.figure import Figure
from matplotlib.gridspec import SubplotSpec

from microslip.pipeline.judge import Judgement, judge
from microslip.pipeline.run import Run
from microslip.show.plots.backbones import draw_damping, draw_frequency, moving_output, spans_much
from microslip.show.plots.equivalent import AMPLITUDE, amplitude_label, draw_equivalent
from microslip.show.plots.harmonic import draw_amplitude
from microslip.show.plots.harmonic import handles as harmonic_handles
from microslip.show.plots.history import draw_motion, history_title
from microslip.show.plots.model import draw_model, draw_overlap
from microslip.show.plots.prestress import draw_prestress
from microslip.show.plots.response import TITLES, draw_response
from microslip.show.plots.response import handles as response_handles
from microslip.show.plots.selection import greatest_damping, main_drive, name_of
from microslip.show.plots.shown import label
from microslip.show.plots.states import draw_states
from microslip.show.plots.states import handles as state_handles
from microslip.show.plots.style import DOUBLE, MM, VERMILLION, draw_legend, house_style, new_figure

BELOW: dict[str, Any] = {"loc": "upper center", "bbox_to_anchor": (0.5, -0.16)}
"""Where a panel has its legend."""

PRELOADED = {True: "pressure under the clamp alone", False: "pressure under the preload alone"}
"""Title of the prestress, with a clamp or without."""

LINE, LINES, MOST = 135, 2, 4
"""Characters of a line at the foot, lines of a warning, and how many warnings stand there."""


Panel = Callable[[Figure, SubplotSpec, Run, str], None]
"""Draws one cell of the picture, with a letter in its title."""

MOST_PANELS = 3
"""Beside the joint."""


@house_style
def overview(run: Run, judged: Judgement | None = None) -> Figure:
    """Joint, and up to three panels of what was computed: contact states, equivalent stiffness and
    damping, response, backbone, motion in time; the prestress where there is nothing else. A run that
    comes with its judgement is not judged again."""
    panels = _panels(run)
    rows = 1 if len(panels) == 1 else 2
    figure = new_figure(DOUBLE, (90 if rows == 1 else 165) * MM)
    grid = figure.add_gridspec(rows, 2)
    _joint(figure, grid[0, 0], run)
    places = [grid[0, 1]]
    if rows == 2:
        places += [grid[1, 0], grid[1, 1]] if len(panels) == MOST_PANELS else [grid[1, :]]
    for draw, place, letter in zip(panels, places, "bcd", strict=False):
        draw(figure, place, run, letter)
    warn(figure, judge(run) if judged is None else judged)
    return figure


def _panels(run: Run) -> list[Panel]:
    """What there is to show, the most telling first."""
    states = [_states] if main_drive(run) else []
    return [*states, *found_panels(run)][:MOST_PANELS] or [_prestress]


def found_panels(run: Run) -> list[Panel]:
    """Panels of what was computed that need no line of contact pairs."""
    response = bool(run.responses) and run.frictionless is not None
    found = {
        _equivalent: bool(run.tables),
        _response: response,
        _harmonic: not response and any(entry.points for entry in run.harmonic),
        _backbone: any(b.points for b in run.backbones),
        _motion: bool(run.histories),
    }
    return [draw for draw, there in found.items() if there]


def _states(figure: Figure, place: SubplotSpec, run: Run, letter: str) -> None:
    drive = main_drive(run)
    index = greatest_damping(run, drive)
    ax = figure.add_subplot(place)
    draw_states(ax, run, drive, index)
    ax.set_title(f"({letter})  contact over a cycle, {name_of(run, drive, index)}", loc="left")
    draw_legend(ax, state_handles(), ncols=2, **BELOW)


def _response(figure: Figure, place: SubplotSpec, run: Run, letter: str) -> None:
    variant = run.responses[-1].variant
    ax = figure.add_subplot(place)
    draw_response(ax, run, variant)
    ax.set_title(f"({letter})  forced response, {TITLES.get(variant, variant)}", loc="left")
    draw_legend(ax, response_handles(run), ncols=2, **BELOW)


def _harmonic(figure: Figure, place: SubplotSpec, run: Run, letter: str) -> None:
    ax = figure.add_subplot(place)
    draw_amplitude(ax, run)
    ax.set_title(f"({letter})  forced response, harmonic balance", loc="left")
    draw_legend(ax, harmonic_handles(run), ncols=2, **BELOW)


def _backbone(figure: Figure, place: SubplotSpec, run: Run, letter: str) -> None:
    """Of the first mode."""
    solved = [b for b in run.backbones if b.points]
    mine = [b for b in solved if b.mode.number == solved[0].mode.number]
    output = moving_output(run, mine[0])
    cells = place.subgridspec(2, 1)
    top = figure.add_subplot(cells[0])
    bottom = figure.add_subplot(cells[1], sharex=top)
    draw_frequency(top, run, mine, output)
    draw_damping(bottom, run, mine, output, spans_much(mine))
    top.set_title(f"({letter})  backbone of mode {mine[0].mode.number}", loc="left")
    top.tick_params(labelbottom=False)
    top.set_ylabel("frequency (Hz)")
    bottom.set_ylabel("damping ratio (%)")
    bottom.set_xlabel(AMPLITUDE if output is None else label(output))
    found = top.get_legend_handles_labels()
    bottom.legend(*found, loc="upper center", bbox_to_anchor=(0.5, -0.36))


def _motion(figure: Figure, place: SubplotSpec, run: Run, letter: str) -> None:
    """Of the first history."""
    history = run.histories[0]
    ax = figure.add_subplot(place)
    draw_motion(ax, run, history)
    ax.set_xlabel("time (s)")
    ax.set_title(f"({letter})  {history_title(history)}", loc="left")


def _prestress(figure: Figure, place: SubplotSpec, run: Run, letter: str) -> None:
    ax = figure.add_subplot(place)
    draw_prestress(ax, run)
    ax.set_title(f"({letter})  {PRELOADED[run.assembly.measures.clamp]}", loc="left")


def warn(figure: Figure, judged: Judgement) -> None:
    """What should be doubted, at the foot, two lines each; what to do is in the summary."""
    said = [str(replace(caution, remedy="")) for caution in judged.cautions]
    cautions = [
        textwrap.fill(line, LINE, max_lines=LINES, placeholder=" ...", subsequent_indent="    ")
        for line in said
    ]
    if cautions:
        more = [f"and {len(cautions) - MOST} more in summary.json"] if len(cautions) > MOST else []
        text = "\n".join([*(f"warning: {c}" for c in cautions[:MOST]), *more])
        figure.supxlabel(text, fontsize=6.5, color=VERMILLION, x=0.01, ha="left")


def _joint(figure: Figure, place: SubplotSpec, run: Run) -> None:
    """The joint, or where no mesh of it is known the pressure that holds it."""
    if not run.structure.meshes:
        _prestress(figure, place, run, "a")
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

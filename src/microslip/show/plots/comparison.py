"""Results of several runs in one figure: a colour for what belongs together, a line style per run."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from matplotlib.figure import Figure
from matplotlib.lines import Line2D

from microslip.describe.outputs import NamedOutput
from microslip.pipeline.run import Run
from microslip.results.comparison import Named, curves, named_output, shared_output
from microslip.results.cycle import table_of
from microslip.show.plots.backbones import MOST_MODES, STYLES, amplitude, moving_output
from microslip.show.plots.curves import draw_curve, mark_no_peak, no_peak, no_peak_handle
from microslip.show.plots.equivalent import AMPLITUDE, LABELS, amplitude_label, per_modal
from microslip.show.plots.response import TITLES, per_moment
from microslip.show.plots.shown import (
    amplitude_axis,
    below_resonance,
    in_units,
    label,
    lag,
    phase_axis,
)
from microslip.show.plots.style import (
    BLACK,
    DOUBLE,
    DRIVES,
    MM,
    PRESCRIBED,
    SERIES,
    Entry,
    draw_legend,
    house_style,
    letters,
    new_figure,
)

RUN_LINES: tuple[Any, ...] = ("-", "--", ":", "-.", (0, (8, 2)), (0, (4, 1, 1, 1, 1, 1)))
"""Line style of the first, second ... run; of more the eye would not keep them apart."""

MOST_RUNS = len(RUN_LINES)

COMPARED: dict[str, Callable[[Run], bool]] = {
    "response": lambda run: bool(run.responses),
    "equivalent": lambda run: any(run.cycles.values()),
    "backbones": lambda run: any(b.points for b in run.backbones),
}
"""What can be laid over each other, and whether a run has it."""


def comparison_figures(runs: Sequence[Named]) -> dict[str, Figure]:
    """Every figure that at least two runs have something for, by file name."""
    drawings = {
        "response": response_comparison,
        "equivalent": equivalent_comparison,
        "backbones": backbones_comparison,
    }
    found = {
        name: draw(_lined(runs, COMPARED[name]))
        for name, draw in drawings.items()
        if sum(COMPARED[name](each.run) for each in runs) > 1
    }
    return {name: figure for name, figure in found.items() if figure is not None}


@dataclass(frozen=True)
class Lined(Named):
    """A run and its line style, the same in all figures.

    Attributes
    ----------
    line : str or tuple
    """

    line: Any = "-"


def _lined(runs: Sequence[Named], has: Callable[[Run], bool]) -> list[Lined]:
    """Runs that a figure shows."""
    every = [Lined(each.name, each.run, RUN_LINES[i]) for i, each in enumerate(runs)]
    return [each for each in every if has(each.run)]


def _run_handles(runs: Sequence[Lined]) -> list[Line2D]:
    return [Line2D([], [], color=BLACK, ls=each.line, label=each.label) for each in runs]


@house_style
def response_comparison(runs: Sequence[Lined]) -> Figure | None:
    """One column per variant: amplitude of the first output that all runs have, and its phase.

    Amplitudes are per load where a run has the joint without friction, whose load means nothing.
    None where the runs have no output in common.
    """
    output = shared_output(runs)
    if output is None:
        return None
    by_run = curves(runs)
    every = list(dict.fromkeys(curve for found in by_run for curve in found))
    loads = list(dict.fromkeys(curve.load_label for curve in every))
    colors = {load: SERIES[i % len(SERIES)]["color"] for i, load in enumerate(loads)}
    variants = list(dict.fromkeys(curve.variant for curve in every))
    over_load = any(per_moment(each.run) for each in runs)
    figure = new_figure(DOUBLE, 140 * MM)
    grid = figure.subplots(
        2, len(variants), sharex=True, sharey="row", squeeze=False, height_ratios=[3, 2]
    )
    for each, found in zip(runs, by_run, strict=True):
        for curve, response in found.items():
            k, line = variants.index(curve.variant), each.line
            color = colors[curve.load_label]
            y = in_units(each.run, response.outputs, named_output(each.run, output))
            size = np.abs(y) / (response.load if over_load else 1.0)
            draw_curve(grid[0, k], response, size, color, ls=line)
            mark_no_peak(grid[0, k], response, size, color)
            turned = lag(np.angle(y), below_resonance(each.run, named_output(each.run, output)))
            draw_curve(grid[1, k], response, turned, color, ls=line)
    for k, variant in enumerate(variants):
        grid[0, k].set_title(TITLES.get(variant, variant), loc="left")
        grid[1, k].set_title("phase", loc="left")
        grid[1, k].set_xlabel("frequency (Hz)")
    amplitude_axis(grid[0, 0])
    grid[0, 0].set_ylabel(_amplitude_label(output, runs, over_load))
    phase_axis(grid[1, 0], runs[0].run, output)
    frequency = np.concatenate([r.frequency for found in by_run for r in found.values()])
    grid[0, 0].set_xlim(frequency.min(), frequency.max())
    letters(grid.ravel())
    entries: list[Entry] = [*_load_handles(colors), *_run_handles(runs)]
    marked = [
        colors[curve.load_label]
        for found in by_run
        for curve, response in found.items()
        if no_peak(response)
    ]
    if marked:
        entries.append(no_peak_handle(marked))
    draw_legend(figure, entries, loc="outside lower center", ncols=2)
    return figure


def _amplitude_label(output: NamedOutput, runs: Sequence[Named], over_load: bool) -> str:
    """What the axis of amplitudes says, also where one is per moment and another per force."""
    if not over_load:
        return label(output)
    loads = {each.run.joint.driven.load for each in runs}
    if len(loads) == 1:
        return label(output, loads.pop())
    name, unit = output.name.replace("_", " "), output.measured.shown
    return f"{name} per load\n({unit} per unit of the load)"


def _load_handles(colors: dict[str, str]) -> list[Line2D]:
    return [Line2D([], [], color=color, lw=3, label=name) for name, color in colors.items()]


@house_style
def equivalent_comparison(runs: Sequence[Lined]) -> Figure:
    """Equivalent stiffness and damping, each over the square of the run's own sliding frequency."""
    figure = new_figure(DOUBLE, 85 * MM)
    axes = figure.subplots(1, 2, sharex=True)
    output = shared_output(runs, static=True)
    drives: dict[str, dict[str, Any]] = {}
    for each in runs:
        run, line = each.run, each.line
        tables = {drive: (table_of(run, drive), DRIVES[drive]) for drive in run.cycles}
        tables["prescribed"] = (run.tables.get("prescribed"), PRESCRIBED)
        for drive, (table, style) in tables.items():
            if table is None:
                continue
            drives[drive] = style
            x = table.amplitude * (1.0 if output is None else per_modal(run, output))
            for ax, name in zip(axes, LABELS, strict=True):
                ax.plot(x, getattr(table, name), color=style["color"], ls=line)
    for ax, name in zip(axes, LABELS, strict=True):
        ax.axhline(0, color=BLACK, lw=0.5)
        ax.set_xscale("log")
        ax.set_ylabel(LABELS[name])
        ax.set_xlabel(AMPLITUDE if output is None else amplitude_label(runs[0].run, output))
    letters(axes)
    kinds = [
        Line2D([], [], color=style["color"], lw=3, label=style["label"])
        for style in drives.values()
    ]
    figure.legend(handles=[*kinds, *_run_handles(runs)], loc="outside lower center", ncols=2)
    return figure


@house_style
def backbones_comparison(runs: Sequence[Lined]) -> Figure | None:
    """One column per mode that at least two runs have: frequency on top, damping ratio below."""
    by_run = [[b for b in each.run.backbones if b.points] for each in runs]
    numbers = [{b.mode.number for b in found} for found in by_run]
    common = sorted({n for mine in numbers for n in mine if sum(n in one for one in numbers) > 1})
    common = common[:MOST_MODES]
    if not common:
        return None
    figure = new_figure(DOUBLE, 115 * MM)
    grid = figure.subplots(2, len(common), sharex="col", squeeze=False)
    methods: dict[str, dict[str, Any]] = {}
    for k, number in enumerate(common):
        output = _moving(runs, by_run, number)
        for each, found in zip(runs, by_run, strict=True):
            for backbone in (b for b in found if b.mode.number == number):
                methods[backbone.method] = STYLES[backbone.method]
                style = {n: v for n, v in STYLES[backbone.method].items() if n != "label"}
                style |= {"linestyle": each.line, "markevery": max(len(backbone.points) // 12, 1)}
                own = None if output is None else named_output(each.run, output)
                x = amplitude(each.run, backbone, own)
                grid[0, k].plot(x, backbone.frequency, **style)
                grid[1, k].plot(x, 100 * backbone.damping_ratio, **style)
        grid[0, k].set_title(f"mode {number}", loc="left")
        grid[1, k].set_xlabel(AMPLITUDE if output is None else label(output))
        grid[1, k].set_xscale("log")
        amplitude_axis(grid[1, k])
    grid[0, 0].set_ylabel("natural frequency (Hz)")
    grid[1, 0].set_ylabel("damping ratio (%)")
    letters(grid.ravel())
    marks = [Line2D([], [], **{**style, "linestyle": "none"}) for style in methods.values()]
    figure.legend(handles=[*marks, *_run_handles(runs)], loc="outside lower center", ncols=2)
    return figure


def _moving(runs: Sequence[Named], by_run: Sequence[Any], number: int) -> NamedOutput | None:
    """An output that moves in a mode and that all runs have; None where there is none."""
    for each, found in zip(runs, by_run, strict=True):
        for backbone in (b for b in found if b.mode.number == number):
            output = moving_output(each.run, backbone)
            if output is None or output.name not in _shared(runs):
                return None
            return output
    return None


def _shared(runs: Sequence[Named]) -> set[str]:
    names = [{(o.name, o.quantity) for o in each.run.joint.outputs} for each in runs]
    return {name for name, _ in set.intersection(*names)}

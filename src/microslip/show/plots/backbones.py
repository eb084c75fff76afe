"""Backbones: natural frequency and damping ratio of modes of the joint against amplitude."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from microslip.analyses.backbone.cycles import Backbone
from microslip.describe.outputs import NamedOutput
from microslip.pipeline.run import Run
from microslip.results.backbone import outputs_of
from microslip.show.plots.equivalent import AMPLITUDE
from microslip.show.plots.shown import amplitude_axis, in_units, label
from microslip.show.plots.style import (
    BLACK,
    BLUE,
    COLUMN,
    DOUBLE,
    GREY,
    MM,
    VERMILLION,
    house_style,
    letters,
    new_figure,
)
from microslip.show.tables import MOVES

MOST_MODES = 4
"""Columns of the figure; further modes are in the results only."""

WIDE = 10.0
"""Ratio of the largest to the smallest damping ratio beyond which their axis is logarithmic."""

STYLES: dict[str, dict[str, Any]] = {
    "quasi_static": {
        "color": BLUE,
        "linestyle": "--",
        "marker": "s",
        "label": "quasi-static modal analysis",
    },
    "prescribed": {
        "color": VERMILLION,
        "linestyle": "-",
        "marker": "o",
        "label": "nonlinear mode, motion prescribed",
    },
    "harmonic": {
        "color": BLACK,
        "linestyle": "none",
        "marker": "D",
        "mfc": "none",
        "mew": 0.8,
        "ms": 4.5,
        "label": "nonlinear mode, harmonic balance",
    },
}


@house_style
def backbones_figure(run: Run) -> Figure | None:
    """One column per mode: frequency on top, damping ratio below."""
    solved = [b for b in run.backbones if b.points]
    numbers = list(dict.fromkeys(b.mode.number for b in solved))[:MOST_MODES]
    if not numbers:
        return None
    shown = [b for b in solved if b.mode.number in numbers]
    logarithmic = any(spans_much([b for b in shown if b.mode.number == n]) for n in numbers)
    figure = new_figure(COLUMN if len(numbers) == 1 else DOUBLE, 115 * MM)
    grid = figure.subplots(2, len(numbers), sharex="col", squeeze=False)
    for k, number in enumerate(numbers):
        mine = [b for b in solved if b.mode.number == number]
        output = moving_output(run, mine[0])
        draw_frequency(grid[0, k], run, mine, output)
        draw_damping(grid[1, k], run, mine, output, logarithmic)
        grid[0, k].set_title(f"mode {number}", loc="left")
        grid[1, k].set_xlabel(AMPLITUDE if output is None else label(output))
    grid[0, 0].set_ylabel("natural frequency (Hz)")
    grid[1, 0].set_ylabel("damping ratio (%)")
    if len(numbers) > 1:
        letters(grid.ravel())
    entries = dict(zip(*grid[0, 0].get_legend_handles_labels()[::-1], strict=True))
    figure.legend(
        entries.values(),
        entries.keys(),
        loc="outside lower center",
        ncols=1 if len(numbers) == 1 else 2,
    )
    return figure


def moving_output(run: Run, backbone: Backbone) -> NamedOutput | None:
    """The first output that moves in a mode; None where none does."""
    largest = backbone.points[-1]
    found = outputs_of(run, largest)
    for output in run.joint.outputs:
        if output.name in found and abs(found[output.name]) > MOVES * largest.amplitude:
            return output
    return None


def amplitude(run: Run, backbone: Backbone, output: NamedOutput | None) -> np.ndarray:
    """Amplitude of an output along a backbone, in its unit; modal where there is none."""
    if output is None:
        return backbone.amplitude
    sizes = [abs(in_units(run, outputs_of(run, point), output)) for point in backbone.points]
    return np.array(sizes, dtype=float)


def draw_frequency(
    ax: Axes, run: Run, backbones: list[Backbone], output: NamedOutput | None
) -> None:
    """Natural frequency, Hz, and those of the two linear states."""
    for backbone in backbones:
        ax.plot(amplitude(run, backbone, output), backbone.frequency, **_style(backbone))
    mode = backbones[0].mode
    ax.axhline(mode.stuck_frequency, color=GREY, lw=0.8, ls="-.", label="stuck joint")
    ax.axhline(mode.sliding_frequency, color=GREY, lw=0.8, ls=":", label="sliding joint")
    amplitude_axis(ax, "x")


def spans_much(backbones: Sequence[Backbone]) -> bool:
    """Whether the damping ratio of a mode spans more than a factor of `WIDE`."""
    values = np.concatenate([backbone.damping_ratio for backbone in backbones])
    return bool(values.max() > WIDE * values.min() > 0)


def draw_damping(
    ax: Axes, run: Run, backbones: list[Backbone], output: NamedOutput | None, logarithmic: bool
) -> None:
    """Damping ratio, %; logarithmic for every mode of a figure or for none."""
    for backbone in backbones:
        ax.plot(amplitude(run, backbone, output), 100 * backbone.damping_ratio, **_style(backbone))
    amplitude_axis(ax, "x")
    if logarithmic:
        amplitude_axis(ax)


def _style(backbone: Backbone) -> dict[str, Any]:
    return {**STYLES[backbone.method], "markevery": max(len(backbone.points) // 12, 1)}

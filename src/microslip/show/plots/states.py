"""Where the interface sticks, slips and separates over a cycle (the paper's figures 5a and 7a)."""

from __future__ import annotations

import numpy as np
from matplotlib.axes import Axes
from matplotlib.colors import BoundaryNorm, ListedColormap
from matplotlib.figure import Figure
from matplotlib.patches import Patch

from microslip.pipeline.run import Run
from microslip.show.plots.selection import (
    greatest_damping,
    main_drive,
    name_of,
    position_label,
    unit_centre,
    unit_position,
)
from microslip.show.plots.style import (
    BLACK,
    DOUBLE,
    MM,
    clamp_edges,
    house_style,
    letters,
    new_figure,
)

NAMES = ("1 stick", "2 forward slip", "3 backward slip", "4 separation")
COLOURS = ("#1d3557", "#D55E00", "#7cc4ee", "#f5f3ea")
"""From dark to light, so that grey print keeps them apart."""

LOAD_WIDTH = 0.14
"""Of the axes that show the load, over the width of a map."""


@house_style
def states_figure(run: Run) -> Figure | None:
    """Contact states of a cycle of microslip and of the one with the greatest damping."""
    drive = main_drive(run)
    if not drive:
        return None
    best = greatest_damping(run, drive)
    sizes = np.array([cycle.amplitude for cycle in run.cycles[drive]])
    small = int(np.argmin(np.abs(np.log(4 * sizes / sizes[best]))))
    shown = sorted({small, best})
    figure = new_figure(DOUBLE, 88 * MM)
    load, *axes = figure.subplots(
        1, 1 + len(shown), sharey=True, width_ratios=[LOAD_WIDTH] + [1] * len(shown)
    )
    for ax, index in zip(axes, shown, strict=True):
        draw_states(ax, run, drive, index)
        note = ", greatest damping" if index == best else ", microslip"
        ax.set_title(name_of(run, drive, index) + note, loc="left")
    letters(axes)
    for ax in axes:
        ax.set_ylabel("")
    cycle = run.cycles[drive][best]
    draw_load(load, cycle.theta, cycle.load / cycle.amplitude)
    edges = axes[0].get_legend_handles_labels()[0]
    figure.legend(handles=[*handles(), *edges], loc="outside lower center", ncols=5)
    return figure


def draw_load(ax: Axes, theta: np.ndarray, load: np.ndarray) -> None:
    """Load, over its amplitude, against the phase, which goes upward as in the map beside it."""
    ax.plot(load, theta / np.pi, color=BLACK)
    ax.axvline(0, color=BLACK, lw=0.5)
    ax.set_xlim(-1.15, 1.15)
    ax.set_xticks([-1, 0, 1])
    ax.set_xlabel("load")
    ax.set_ylabel(r"phase of the load $\theta$")


def handles() -> list[Patch]:
    """Legend entries of the four states."""
    return [
        Patch(facecolor=c, edgecolor=BLACK, linewidth=0.5, label=n)
        for n, c in zip(NAMES, COLOURS, strict=True)
    ]


def draw_states(ax: Axes, run: Run, drive: str, index: int) -> None:
    """State map of one cycle: position across, phase of the load upward."""
    cycle = run.cycles[drive][index]
    draw_state_map(ax, unit_position(run), cycle.theta, cycle.status, unit_centre(run))
    ax.set_xlabel(position_label(run))


def draw_state_map(
    ax: Axes, x: np.ndarray, theta: np.ndarray, status: np.ndarray, centre: float | None = 0.0
) -> None:
    """States at every phase `theta` of one cycle, the first of which repeats the last.

    `x` is over the half length of the clamp, whose middle is at `centre`, None where there is no clamp.
    """
    edges = np.concatenate([[x[0]], 0.5 * (x[1:] + x[:-1]), [x[-1]]])
    ax.pcolormesh(
        edges,
        theta / np.pi,
        status[1:],
        cmap=ListedColormap(COLOURS),
        norm=BoundaryNorm(np.arange(0.5, 5), 4),
        rasterized=True,
    )
    ax.grid(False)
    clamp_edges(ax, centre)
    start = theta[0] / np.pi
    ax.set_yticks(start + np.array([0, 0.5, 1, 1.5, 2]))
    if start == 0:
        ax.set_yticklabels(["0", "π/2", "π", "3π/2", "2π"])
    ax.set_xlim(x[0], x[-1])
    ax.set_xlabel("position $x/L_p$")
    ax.set_ylabel(r"phase of the load $\theta$")

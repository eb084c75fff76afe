"""One history: the motion with its envelope, the slip, and where the energy went."""

from __future__ import annotations

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from microslip.analyses.time.decay import extremes
from microslip.analyses.time.history import History
from microslip.pipeline.run import Run
from microslip.results.history import waveforms
from microslip.results.outputs import primary
from microslip.show.plots.selection import unit_position
from microslip.show.plots.shown import in_units, label
from microslip.show.plots.style import (
    BLACK,
    BLUE,
    DOUBLE,
    GREEN,
    GREY,
    MM,
    ORANGE,
    VERMILLION,
    house_style,
    letters,
    new_figure,
)
from microslip.show.plots.sweeps import frequency_axis

MOST_CYCLES = 150
"""A trace of more cycles is drawn as the band between the extremes of each."""


def history_figures(run: Run) -> dict[str, Figure]:
    """One figure per history, by its name."""
    return {history.name: history_figure(run, history) for history in run.histories}


@house_style
def history_figure(run: Run, history: History) -> Figure:
    """First output, slip at the first chosen position, energies, all over time.

    Slip along the first tangential direction of a spatial pair in green, along the second in orange.
    """
    figure = new_figure(DOUBLE, 145 * MM)
    axes = figure.subplots(3, 1, sharex=True)
    draw_motion(axes[0], run, history)
    axes[0].set_title(f"{primary(run).name} and its envelope", loc="left")
    x = unit_position(run)[history.watched[0]]
    ways = history.slip[:, 0].reshape(len(history.time), -1)
    for slip, colour in zip(ways.T, (GREEN, ORANGE), strict=False):
        _draw_trace(axes[1], history, 1e6 * slip, colour)
    axes[1].set_ylabel("slip (µm)")
    axes[1].set_title(rf"slip at $x$ = {x:.3g} ${run.assembly.measures.symbol}$", loc="left")
    _draw_energies(axes[2], history)
    axes[2].set_xlabel("time (s)")
    axes[2].set_xlim(0, max(history.time[-1], history.dt))
    letters(axes)
    figure.legend(*axes[2].get_legend_handles_labels(), loc="outside lower center", ncols=5)
    figure.suptitle(history_title(history))
    return figure


def draw_motion(ax: Axes, run: Run, history: History) -> None:
    """First output over time and its envelope; on top the frequency of a load that changes it."""
    y = in_units(run, waveforms(run, history))
    _draw_trace(ax, history, y, BLUE)
    at, top = extremes(history.time, y, history.cycle_steps)
    for side in (slice(0, None, 2), slice(1, None, 2)):
        ax.plot(at[side], top[side], color=BLACK, lw=0.9)
    ax.set_ylabel(label(primary(run)))
    entry = next((e for e in run.joint.analysis.history if e.label == history.name), None)
    if entry is not None:
        frequency_axis(ax, entry)


def history_title(history: History) -> str:
    """What a history is called: its name, its signal, what drives it, whether it ended early."""
    words = {
        "moment": ", driven by moments",
        "load": ", driven by the load",
        "mode": ", driven by the inertia of the mode",
    }
    drive = "" if history.kind == "free_decay" else words[history.drive]
    end = "" if history.complete and not history.failure else ", ended early"
    return f"{history.name}: {history.kind.replace('_', ' ')}{drive}{end}"


def _draw_trace(ax: Axes, history: History, y: np.ndarray, colour: str) -> None:
    """A line, or the band it fills where its cycles are too many to be seen."""
    cycle = history.cycle_steps
    whole = len(y) // cycle
    if whole <= MOST_CYCLES:
        ax.plot(history.time, y, color=colour, lw=0.8)
        return
    parts = y[: whole * cycle].reshape(whole, cycle)
    middle = history.time[cycle // 2 : whole * cycle : cycle]
    ax.fill_between(middle, parts.min(axis=1), parts.max(axis=1), color=colour, lw=0.3)


def _draw_energies(ax: Axes, history: History) -> None:
    e = history.energies
    material = e.modal_damping + e.residual_damping
    for y, name, style in (
        (e.external, "work of the load", {"color": BLACK, "ls": "-"}),
        (e.friction, "friction", {"color": VERMILLION, "ls": "--"}),
        (material, "material damping", {"color": ORANGE, "ls": "-."}),
        (e.mechanical, "kinetic and strain energy", {"color": BLUE, "ls": ":"}),
        (e.scheme + e.normal, "time steps", {"color": GREY, "ls": (0, (1, 3))}),
    ):
        ax.plot(e.time, y, label=name, **style)
    ax.set_ylabel("energy (J/m)")
    ax.set_title("energies since $t$ = 0", loc="left")

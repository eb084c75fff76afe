"""The steady state of largest amplitude in time: contact, waveforms and hysteresis loop."""

from __future__ import annotations

from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from microslip.analyses.time.point import TimePoint
from microslip.analyses.time.readings import modal_force, phases
from microslip.pipeline.run import Run
from microslip.results.outputs import primary
from microslip.results.time import HARMONICS, local_motion, waveforms
from microslip.show.plots.selection import position_label, unit_centre, unit_position
from microslip.show.plots.shown import in_units
from microslip.show.plots.states import LOAD_WIDTH, draw_load, draw_state_map, handles
from microslip.show.plots.style import (
    BLACK,
    BLUE,
    DOUBLE,
    MM,
    VERMILLION,
    house_style,
    letters,
    new_figure,
)

TURN = np.array([0, 0.5, 1, 1.5, 2])
NAMES = ("0", "π/2", "π", "3π/2", "2π")


@house_style
def steady_figure(run: Run) -> Figure | None:
    """Last cycle of the steady state of largest modal amplitude, from the zero of the load upward.

    Of a point that is unstable or not steady only where no other is, and the title says so.
    """
    if not run.time_domain:
        return None
    steady = [p for p in run.time_domain if p.settled]
    point = max(steady or run.time_domain, key=lambda p: abs(p.steady.amplitude))
    figure = new_figure(DOUBLE, 120 * MM)
    grid = figure.add_gridspec(2, 3, width_ratios=[1.25 * LOAD_WIDTH, 1.25, 1])
    states = figure.add_subplot(grid[:, 1])
    load = figure.add_subplot(grid[:, 0], sharey=states)
    waves, loop = figure.add_subplot(grid[0, 2]), figure.add_subplot(grid[1, 2])
    theta, order = _from_zero(point)
    draw_state_map(
        states, unit_position(run), theta, point.steady.cycle.status[order], unit_centre(run)
    )
    states.set_xlabel(position_label(run))
    states.set_yticks(np.interp(TURN * np.pi, theta, theta / np.pi), NAMES)
    states.set_title("contact states", loc="left")
    states.tick_params(labelleft=False)
    states.set_ylabel("")
    draw_load(load, theta, np.sin(theta))
    _draw_waves(waves, run, point, theta, order)
    _draw_loop(loop, run, point)
    letters((states, waves, loop))
    edges = states.get_legend_handles_labels()[0]
    figure.legend(handles=[*handles(), *edges], loc="outside lower center", ncols=5)
    figure.suptitle(_title(run, point))
    return figure


def _title(run: Run, point: TimePoint) -> str:
    ratio = point.steady.load / run.assembly.moment_unit
    rho = rf"$\rho$ = {point.rho:g}, " if np.isfinite(point.rho) else ""
    place = f"{rho}$M/(PL)$ = {ratio:.3g}, {point.steady.frequency:.2f} Hz"
    if point.steady.converged:
        unstable = "" if point.settled else "unstable "
        return f"{unstable}steady state of largest amplitude: {place}"
    return f"not steady: cycle {point.steady.cycles}, which still changes by " + (
        f"{point.steady.change:.0e}; {place}"
    )


def _from_zero(point: TimePoint) -> tuple[np.ndarray, np.ndarray]:
    """Phases within one turn, ascending, and the samples they belong to; ends repeat."""
    theta = phases(point.steady)
    turned = np.mod(theta[:-1], 2 * np.pi)
    first = int(np.argmin(turned))
    order = np.r_[np.arange(first, len(turned)), np.arange(first + 1)]
    order[order == 0] = len(turned)
    unrolled = turned[first] + 2 * np.pi * np.arange(len(turned) + 1) / len(turned)
    return unrolled, order


def _draw_waves(ax: Axes, run: Run, point: TimePoint, theta: np.ndarray, order: np.ndarray) -> None:
    """Load, first output and slip, each over its own largest value."""
    cycle = point.steady.cycle
    y = in_units(run, waveforms(run, point))[order]
    largest, unit = np.abs(y).max(), primary(run).measured.shown
    watched, slip, _ = local_motion(run, cycle)
    x = unit_position(run)[watched[0]]
    curves: tuple[tuple[np.ndarray, str, dict[str, Any]], ...] = (
        (point.steady.load * np.sin(theta), "load $M$", {"color": BLACK, "ls": ":"}),
        (y, f"{primary(run).name}, at most {largest:.3g} {unit}", {"color": BLUE, "ls": "-"}),
        (
            slip[order, 0] - slip[order[:-1], 0].mean(),
            rf"slip at $x$ = {x:.3g} ${run.assembly.measures.symbol}$ less its mean",
            {"color": VERMILLION, "ls": "--"},
        ),
    )
    for wave, label, style in curves:
        ax.plot(theta / np.pi, wave / max(np.abs(wave).max(), 1e-300), label=label, **style)
    ax.set_xticks(TURN, NAMES)
    ax.set_xlim(0, 2)
    ax.set_ylim(-1.15, 2.75)
    ax.set_yticks([-1, 0, 1])
    ax.set_xlabel(r"phase of the load $\theta$")
    ax.set_ylabel("over its largest value")
    ax.set_title("waveforms", loc="left")
    ax.legend(loc="upper center", ncols=1)


def _draw_loop(ax: Axes, run: Run, point: TimePoint) -> None:
    """Contact force on the sliding mode against its coordinate."""
    q = point.steady.cycle.output[:, run.model.port("sliding")]
    f = modal_force(point.steady, run.prepared, HARMONICS)
    size = np.abs(q).max()
    ax.plot(q / size, f / (run.mode.sliding_omega**2 * size), color=VERMILLION)
    ax.set_xlabel(r"sliding coordinate $q\,/\,q_{\max}$")
    ax.set_ylabel(r"force $f\,/\,(\omega_{sl}^2\,q_{\max})$")
    ax.set_title("contact force on the sliding mode", loc="left")

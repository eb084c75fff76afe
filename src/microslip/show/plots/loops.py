"""Moment against rotation: the loops that an engineer measures, whose area is the dissipation."""

from __future__ import annotations

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from microslip.analyses.prepared.direct import stuck_motion
from microslip.pipeline.prepare import DRIVE
from microslip.pipeline.run import Run
from microslip.show.plots.selection import spread
from microslip.show.plots.style import DOUBLE, LINES, MM, SERIES, house_style, letters, new_figure

MILLI = 1e-3
"""Rotations below it are shown in microradians."""


@house_style
def moment_rotation_figure(run: Run) -> Figure | None:
    """Loops of several end moments: as they are, and less the rotation of the stuck joint."""
    if not run.cycles.get(DRIVE):
        return None
    figure = new_figure(DOUBLE, 85 * MM)
    whole, beyond = figure.subplots(1, 2)
    draw_loops(whole, run, stuck=False)
    draw_loops(beyond, run, stuck=True)
    whole.set_title("end moment and rotation", loc="left")
    beyond.set_title("less the rotation of the stuck joint", loc="left")
    letters((whole, beyond))
    figure.legend(*whole.get_legend_handles_labels(), loc="outside lower center", ncols=4)
    return figure


def draw_loops(ax: Axes, run: Run, *, stuck: bool) -> None:
    """Loops on given axes; `stuck` leaves out what the joint would turn by if it did not slip.

    The rotation is that which the end moments do work on: of the right end less that of the left.
    """
    port = run.model.port(DRIVE)
    elastic = stuck_motion(run.prepared, DRIVE)[port] if stuck else 0.0
    shown = [run.cycles[DRIVE][index] for index in spread(run, DRIVE)]
    turned = [cycle.output[:, port] - elastic * cycle.load for cycle in shown]
    small = max(np.abs(angle).max() for angle in turned) < MILLI
    factor, unit = (1e6, "µrad") if small else (1e3, "mrad")
    for i, (cycle, angle) in enumerate(zip(shown, turned, strict=True)):
        ax.plot(
            factor * angle,
            cycle.load,
            color=SERIES[i % len(SERIES)]["color"],
            ls=LINES[i % len(LINES)],
            label=f"$M$ = {cycle.amplitude:.4g} N m/m",
        )
    ax.set_xlabel(f"rotation of the ends ({unit})")
    ax.set_ylabel("end moment $M$ (N m/m)")

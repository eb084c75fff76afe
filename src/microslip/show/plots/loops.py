"""Load against what it does work on: the loops that an engineer measures, whose area is the dissipation."""

from __future__ import annotations

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from microslip.analyses.prepared.direct import stuck_motion
from microslip.pipeline.run import Run
from microslip.show.plots.selection import spread
from microslip.show.plots.style import DOUBLE, LINES, MM, SERIES, house_style, letters, new_figure

MOTION = {
    "moment": "rotation",
    "force": "displacement",
    "base": "moment of mass",
    "pressure": "volume",
}
"""What a load does work on."""

UNITS = {
    "moment": (1e6, "µrad", 1e3, "mrad"),
    "force": (1e6, "µm", 1e3, "mm"),
    "base": (1e6, "mg m/m", 1e3, "g m/m"),
    "pressure": (1e9, "mm³/m", 1e6, "cm³/m"),
}
"""Its units and how many of them are one in SI, small and usual."""

MILLI = 1e-3
"""Rotations below it are shown in microradians."""


@house_style
def moment_rotation_figure(run: Run) -> Figure | None:
    """Loops of several loads: as they are, and less the motion of the stuck joint."""
    if not run.cycles.get(run.joint.drive_named("load")):
        return None
    figure = new_figure(DOUBLE, 85 * MM)
    whole, beyond = figure.subplots(1, 2)
    draw_loops(whole, run, stuck=False)
    draw_loops(beyond, run, stuck=True)
    what = MOTION[run.joint.driven.kind]
    whole.set_title(f"{run.joint.driven.load.noun} and {what}", loc="left")
    beyond.set_title(f"less the {what} of the stuck joint", loc="left")
    letters((whole, beyond))
    figure.legend(*whole.get_legend_handles_labels(), loc="outside lower center", ncols=4)
    return figure


def draw_loops(ax: Axes, run: Run, *, stuck: bool) -> None:
    """Loops on given axes; `stuck` leaves out what the joint would turn by if it did not slip.

    The motion is that which the load does work on: of the end moments the rotation of the right end
    less that of the left; of a base the mass that moves times how far it does.
    """
    own, drive, said = run.prepared.drive, run.joint.drive_named("load"), run.joint.driven
    port = run.model.port(own)
    elastic = stuck_motion(run.prepared, own)[port] if stuck else 0.0
    shown = [run.cycles[drive][index] for index in spread(run, drive)]
    turned = [cycle.output[:, port] - elastic * cycle.load for cycle in shown]
    small = max(np.abs(angle).max() for angle in turned) < MILLI
    factor, unit = UNITS[said.kind][:2] if small else UNITS[said.kind][2:]
    for i, (cycle, angle) in enumerate(zip(shown, turned, strict=True)):
        ax.plot(
            factor * angle,
            cycle.load,
            color=SERIES[i % len(SERIES)]["color"],
            ls=LINES[i % len(LINES)],
            label=f"${said.load.symbol}$ = {cycle.amplitude:.4g} {said.load.unit}",
        )
    ax.set_xlabel(
        f"{MOTION[said.kind]} of the {'ends' if said.kind == 'moment' else 'joint'} ({unit})"
    )
    ax.set_ylabel(f"{said.load.noun} ${said.load.symbol}$ ({said.load.unit})")

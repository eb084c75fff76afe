"""Energy that friction takes per cycle, against what the joint carries and against how far it moves."""

from __future__ import annotations

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from microslip.describe.outputs import NamedOutput
from microslip.pipeline.outputs import static_by_name
from microslip.pipeline.run import Run
from microslip.results.outputs import displacement
from microslip.show.plots.shown import in_units, label
from microslip.show.plots.style import DOUBLE, DRIVES, MM, house_style, letters, new_figure

ROUNDING = 1e-12
"""Of the largest, friction work that is rounding of joints that stick."""


@house_style
def energy_figure(run: Run) -> Figure | None:
    """Friction work per cycle of every drive over the load, and over the first displacement."""
    if not any(cycle.dissipated > 0 for cycles in run.cycles.values() for cycle in cycles):
        return None
    output = displacement(run)
    figure = new_figure(DOUBLE, 85 * MM)
    axes = figure.subplots(1, 1 if output is None else 2, sharey=True, squeeze=False)[0]
    for drive in run.cycles:
        draw_energy(axes[0], run, drive, np.array(run.moments[drive]))
        if output is not None:
            draw_energy(axes[1], run, drive, _sizes(run, drive, output))
    said = run.joint.driven.load
    axes[0].set_xlabel(
        f"{said.noun} ${said.symbol}$, or as close to opening the joint ({said.unit})"
    )
    axes[0].set_ylabel("friction work per cycle (J/m)")
    if output is not None:
        axes[1].set_xlabel(f"amplitude of {label(output)}")
        letters(axes)
    figure.legend(*axes[0].get_legend_handles_labels(), loc="outside lower center", ncols=2)
    return figure


def draw_energy(ax: Axes, run: Run, drive: str, over: np.ndarray) -> None:
    """Dissipated energy of the cycles of one drive on logarithmic axes."""
    work = np.array([cycle.dissipated for cycle in run.cycles[drive]])
    shown = work > ROUNDING * work.max(initial=0.0)
    ax.loglog(over[shown], work[shown], **DRIVES[drive])


def _sizes(run: Run, drive: str, output: NamedOutput) -> np.ndarray:
    """Half the way of an output over each cycle."""
    moved = [static_by_name(run.assembly, c.output) for c in run.cycles[drive]]
    return np.array([0.5 * np.ptp(in_units(run, y, output)) for y in moved])

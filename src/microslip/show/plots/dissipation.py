"""Where along the interface the energy goes (the paper's figure 8a)."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from microslip.pipeline.run import Run
from microslip.show.plots.selection import (
    main_drive,
    name_of,
    position_label,
    spread,
    unit_centre,
    unit_position,
)
from microslip.show.plots.style import (
    COLUMN,
    LINES,
    MM,
    SERIES,
    clamp_edges,
    house_style,
    new_figure,
)


@house_style
def dissipation_figure(run: Run) -> Figure | None:
    """Dissipated energy per length over its total, so that each curve has the area one."""
    drive = main_drive(run)
    if not drive or not any(c.dissipated > 0 for c in run.cycles[drive]):
        return None
    figure = new_figure(COLUMN, 85 * MM)
    draw_dissipation(figure.subplots(), run, drive)
    figure.legend(loc="outside lower center", ncols=2)
    return figure


def draw_dissipation(ax: Axes, run: Run, drive: str) -> None:
    """The same on given axes; what is off them at the very tips is marked with its largest value."""
    x = unit_position(run)
    inner = np.abs(x) < 0.95 * np.abs(x).max()
    top, tips = 0.0, []
    for i, index in enumerate(spread(run, drive)):
        cycle = run.cycles[drive][index]
        if not cycle.dissipated > 0:
            continue
        density = cycle.friction_work / run.model.area / cycle.dissipated
        density *= run.assembly.measures.half_length
        top = max(top, density[inner].max())
        ax.plot(
            x,
            density,
            color=SERIES[i % len(SERIES)]["color"],
            ls=LINES[i % len(LINES)],
            label=name_of(run, drive, index),
        )
        tips.append(density)
    clamp_edges(ax, unit_centre(run))
    ax.set_xlim(x[0], x[-1])
    if top > 0:
        ax.set_ylim(0, 1.1 * top)
        note_cut_tips(ax, x, tips)
    ax.set_xlabel(position_label(run))
    length = run.assembly.measures.symbol
    ax.set_ylabel(rf"dissipation density ${length}\,\mathrm{{d}}E/\mathrm{{d}}x\,/\,E$")


def note_cut_tips(ax: Axes, x: np.ndarray, curves: Sequence[np.ndarray]) -> None:
    """Say above the axes how far curves go that leave them at the ends of `x`.

    Where the edge of a beam presses alone the pressure is singular: what is drawn there belongs to one
    contact pair and grows with the number of pairs.
    """
    outer = np.abs(x) > 0.5 * np.abs(x).max()
    largest = max(float(curve[outer].max()) for curve in curves)
    if largest > ax.get_ylim()[1]:
        ax.set_title(f"↑ at the tips: up to {largest:.2g}", loc="right")

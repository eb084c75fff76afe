"""Friction limit and traction along the interface at four phases (the paper's figures 5b, c, 7b).

Drawn as the nodal tractions they are, without smoothing. Where an edge of a beam presses alone the
pressure is singular: the axes end at the rest of the interface and a note gives the value.
"""

from __future__ import annotations

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from microslip.contact.fields import contact_fields
from microslip.pipeline.run import Run
from microslip.show.plots.selection import (
    greatest_damping,
    main_drive,
    mean_pressure,
    name_of,
    position_label,
    pressure_unit,
    unit_position,
)
from microslip.show.plots.style import (
    DOUBLE,
    GREY,
    MM,
    VERMILLION,
    house_style,
    letters,
    new_figure,
)

PHASES = ((0.0, "0"), (0.5, "π/2"), (1.0, "π"), (1.5, "3π/2"))


@house_style
def tractions_figure(run: Run) -> Figure | None:
    """Both at four phases of the cycle with the greatest damping."""
    drive = main_drive(run)
    if not drive:
        return None
    index = greatest_damping(run, drive)
    figure = new_figure(DOUBLE, 105 * MM)
    axes = figure.subplots(2, 2, sharex=True, sharey=True)
    limit = _draw(axes.ravel(), run, drive, index)
    for ax in axes[1]:
        ax.set_xlabel(position_label(run))
    for ax in axes[:, 0]:
        ax.set_ylabel(f"traction $f\\,/\\,{pressure_unit(run)}$")
    axes[0, 0].set_ylim(-limit, limit)
    letters(axes.ravel())
    handles, labels = axes[0, 0].get_legend_handles_labels()
    figure.legend(handles, labels, loc="outside lower center", ncols=2)
    figure.suptitle(f"{name_of(run, drive, index)}, the cycle with the greatest damping")
    return figure


def _draw(axes: np.ndarray, run: Run, drive: str, index: int) -> float:
    """Draw the four panels; returns the half height that shows all but singular edges."""
    cycle = run.cycles[drive][index]
    fields = contact_fields(cycle.r, cycle.v, run.prestress.solution.v, run.model.area)
    unit = mean_pressure(run)
    friction = run.prepared.law.friction
    x = unit_position(run)
    limits = friction * fields.pressure / unit
    inner = np.abs(x) < 0.97 * np.abs(x).max()
    height = 1.15 * max(limits[:, inner].max(), 1e-12)
    for ax, (phase, name) in zip(axes, PHASES, strict=True):
        step = int(np.argmin(np.abs(cycle.theta - cycle.theta[0] - phase * np.pi)))
        limit, traction = limits[step], fields.traction[step] / unit
        ax.fill_between(x, -limit, limit, color="#dcdcdc", lw=0)
        ax.plot(x, limit, color=GREY, lw=0.9, ls="--", label=r"friction limit $\pm\mu p$")
        ax.plot(x, -limit, color=GREY, lw=0.9, ls="--")
        ax.plot(x, traction, color=VERMILLION, label="traction $f$ on the upper body")
        _note_edges(ax, x, limit, height)
        ax.set_xlim(x[0], x[-1])
        ax.set_title(rf"$\theta$ = {name}", loc="left")
    return height


def _note_edges(ax: Axes, x: np.ndarray, limit: np.ndarray, height: float) -> None:
    """Write the friction limit at the tips where it is off the axes."""
    for end, side in ((0, "left"), (-1, "right")):
        if limit[end] > height:
            ax.annotate(
                rf"$\mu p$ = {limit[end]:.2f} at the edge",
                (x[end], 0.93 * height),
                (x[end] * 0.93, 0.86 * height),
                ha=side,
                va="center",
            )

"""Contact pressure under the clamp alone."""

from __future__ import annotations

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from microslip.contact.fields import contact_extent
from microslip.describe.lap import LapJoint
from microslip.model.lap import pressing
from microslip.pipeline.run import Run
from microslip.show.plots.selection import (
    mean_pressure,
    position_label,
    pressure_unit,
    unit_position,
)
from microslip.show.plots.style import BLUE, COLUMN, GREY, MM, house_style, new_figure
from microslip.typing import Array

MINUS = "\N{MINUS SIGN}"


@house_style
def prestress_figure(run: Run) -> Figure:
    """Pressure over the mean pressure of the clamp, against position."""
    figure = new_figure(COLUMN, 60 * MM)
    draw_prestress(figure.subplots(), run)
    return figure


def draw_prestress(ax: Axes, run: Run) -> None:
    """The same on given axes."""
    half = run.assembly.measures.half_length
    x = unit_position(run)
    p = run.prestress.pressure / mean_pressure(run)
    outline = _outline(run, x[0], x[-1])
    if outline is not None:
        ax.plot(*outline, color=GREY, ls="--", lw=0.9, label="clamp")
    ax.fill_between(x, p, color=BLUE, alpha=0.15, lw=0)
    ends = contact_extent(run.model.position, run.prestress.touching)
    left, right = (f"{end / half:.4g}" for end in ends)
    ax.plot(x, p, color=BLUE, label=f"contact, {left} to {right}".replace("-", MINUS))
    ax.set_xlim(x[0], x[-1])
    ax.set_ylim(0, 1.08 * max(1.0, p.max(), 0.0 if outline is None else outline[1].max()))
    ax.set_xlabel(position_label(run))
    ax.set_ylabel(f"pressure $p\\,/\\,{pressure_unit(run)}$")
    ax.legend(loc="lower center")


def _outline(run: Run, left: float, right: float) -> tuple[Array, Array] | None:
    """The clamp's own pressure over its mean, from one end of the overlap to the other; None where there
    is no clamp."""
    if not isinstance(run.joint, LapJoint):
        return None
    half, pressed = run.joint.clamp.half_length, pressing(run.joint)
    x = np.linspace(pressed.knots[0], pressed.knots[-1], 101)
    p = 2 * half * pressed.density(x)
    return np.r_[left, x[0] / half, x / half, x[-1] / half, right], np.r_[0, 0, p, 0, 0]

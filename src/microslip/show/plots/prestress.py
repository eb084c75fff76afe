"""Contact pressure under the clamp alone."""

from __future__ import annotations

from matplotlib.axes import Axes
from matplotlib.figure import Figure

from microslip.contact.fields import contact_extent
from microslip.pipeline.run import Run
from microslip.show.plots.selection import unit_position
from microslip.show.plots.style import BLUE, COLUMN, GREY, MM, house_style, new_figure

MINUS = "\N{MINUS SIGN}"


@house_style
def prestress_figure(run: Run) -> Figure:
    """Pressure over the mean pressure of the clamp, against position."""
    figure = new_figure(COLUMN, 60 * MM)
    draw_prestress(figure.subplots(), run)
    return figure


def draw_prestress(ax: Axes, run: Run) -> None:
    """The same on given axes."""
    clamp = run.joint.clamp
    x = unit_position(run)
    p = run.prestress.pressure / (clamp.force / (2 * clamp.half_length))
    ax.plot(
        [x[0], -1, -1, 1, 1, x[-1]], [0, 0, 1, 1, 0, 0], color=GREY, ls="--", lw=0.9, label="clamp"
    )
    ax.fill_between(x, p, color=BLUE, alpha=0.15, lw=0)
    ends = contact_extent(run.model.position, run.prestress.touching)
    left, right = (f"{end / clamp.half_length:.4g}" for end in ends)
    ax.plot(x, p, color=BLUE, label=f"contact, {left} to {right}".replace("-", MINUS))
    ax.set_xlim(x[0], x[-1])
    ax.set_ylim(0, 1.08 * max(1.0, p.max()))
    ax.set_xlabel("position $x/L_p$")
    ax.set_ylabel("pressure $p\\,/\\,(P/2L_p)$")
    ax.legend(loc="lower center")

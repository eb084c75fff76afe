"""Modal contact force against the sliding coordinate: the loops whose area is the dissipation."""

from __future__ import annotations

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from microslip.analyses.reduced.table import modal_quantities
from microslip.pipeline.run import Run
from microslip.show.plots.selection import main_drive, name_of, spread
from microslip.show.plots.style import COLUMN, LINES, MM, SERIES, house_style, new_figure


@house_style
def hysteresis_figure(run: Run) -> Figure | None:
    """Loops of several amplitudes, each over its own amplitude."""
    drive = main_drive(run)
    if not drive:
        return None
    figure = new_figure(COLUMN, 90 * MM)
    draw_hysteresis(figure.subplots(), run, drive)
    figure.legend(loc="outside lower center", ncols=2)
    return figure


def draw_hysteresis(ax: Axes, run: Run, drive: str) -> None:
    """Loops on given axes: mean slope k_eq, area pi gamma_eq."""
    for i, index in enumerate(spread(run, drive)):
        q, f = modal_quantities(run.cycles[drive][index], run.prepared)
        size = np.abs(q).max()
        ax.plot(
            q / size,
            f / (run.mode.sliding_omega**2 * size),
            color=SERIES[i % len(SERIES)]["color"],
            ls=LINES[i % len(LINES)],
            label=name_of(run, drive, index),
        )
    ax.set_xlabel(r"sliding coordinate $q\,/\,q_{\max}$")
    ax.set_ylabel(r"contact force $f\,/\,(\omega_{sl}^2\,q_{\max})$")

"""Modal contact force against the sliding coordinate: the loops whose area is the dissipation."""

from __future__ import annotations

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from microslip.analyses.reduced.table import modal_quantities
from microslip.pipeline.run import LapRun
from microslip.show.plots.selection import main_drive, name_of, spread
from microslip.show.plots.style import COLUMN, LINES, MM, SERIES, house_style, new_figure


@house_style
def hysteresis_figure(result: LapRun) -> Figure | None:
    """Loops of several amplitudes, each over its own amplitude."""
    drive = main_drive(result)
    if not drive:
        return None
    figure = new_figure(COLUMN, 90 * MM)
    draw_hysteresis(figure.subplots(), result, drive)
    figure.legend(loc="outside lower center", ncols=2)
    return figure


def draw_hysteresis(ax: Axes, result: LapRun, drive: str) -> None:
    """Loops on given axes: mean slope k_eq, area pi gamma_eq."""
    for i, index in enumerate(spread(result, drive)):
        q, f = modal_quantities(result.cycles[drive][index], result.model, result.states)
        size = np.abs(q).max()
        ax.plot(
            q / size,
            f / (result.states.sliding_omega**2 * size),
            color=SERIES[i % len(SERIES)]["color"],
            ls=LINES[i % len(LINES)],
            label=name_of(result, drive, index),
        )
    ax.set_xlabel(r"sliding coordinate $q\,/\,q_{\max}$")
    ax.set_ylabel(r"contact force $f\,/\,(\omega_{sl}^2\,q_{\max})$")

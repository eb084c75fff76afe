"""Equivalent stiffness and damping against amplitude (the paper's figure 10).

Lines from the quasi-static cycles and from those of the refined model; open circles from the steady
states of the time domain.
"""

from __future__ import annotations

from typing import Any

from matplotlib.axes import Axes
from matplotlib.figure import Figure

from microslip.analyses.time.readings import equivalent
from microslip.pipeline.run import Run
from microslip.results.cycle import table_of
from microslip.show.plots.style import (
    BLACK,
    COLUMN,
    DRIVES,
    MM,
    PRESCRIBED,
    house_style,
    new_figure,
)

AMPLITUDE = r"modal amplitude $|q|$  (kg$^{1/2}$ m$^{1/2}$)"


@house_style
def equivalent_figure(run: Run) -> Figure | None:
    """Both against modal amplitude; on top the deflection of the joint's middle it stands for."""
    if not any(run.cycles.values()):
        return None
    figure = new_figure(COLUMN, 110 * MM)
    top, bottom = figure.subplots(2, 1, sharex=True)
    draw_equivalent(top, run, "k_eq")
    draw_equivalent(bottom, run, "gamma_eq")
    deflection_axis(top, run)
    bottom.set_xlabel(AMPLITUDE)
    handles, labels = top.get_legend_handles_labels()
    figure.legend(handles, labels, loc="outside lower center", ncols=1)
    return figure


_LABELS = {
    "k_eq": r"stiffness $k_{eq}\,/\,\omega_{sl}^2$",
    "gamma_eq": r"damping $\gamma_{eq}\,/\,\omega_{sl}^2$",
}


def draw_equivalent(ax: Axes, run: Run, name: str) -> None:
    """One column of the tables, every drive, logarithmic in amplitude."""
    for drive in run.cycles:
        table = table_of(run, drive)
        if table is not None:
            ax.plot(table.amplitude, getattr(table, name), **DRIVES[drive])
    if "prescribed" in run.tables:
        table = run.tables["prescribed"]
        ax.plot(table.amplitude, getattr(table, name), **PRESCRIBED)
    points = [p for p in run.time_domain if p.steady.converged and p.friction > 0]
    if points:
        found = [equivalent(p.steady, p.corrected_frequency, run.prepared) for p in points]
        ax.plot(
            [abs(p.steady.amplitude) for p in points],
            [getattr(e, name) for e in found],
            "o",
            color=BLACK,
            mfc="none",
            mew=0.7,
            label="steady states of the time domain",
        )
    ax.axhline(0, color=BLACK, lw=0.5)
    ax.set_xscale("log")
    ax.set_ylabel(_LABELS[name])


def deflection_axis(ax: Axes, run: Run) -> None:
    """Second axis on top: vertical deflection of the middle of the joint in the sliding mode."""
    lift = abs(run.mode.load_on_sliding.get("lift", 0.0))
    if not lift:
        return

    def deflection(q: Any) -> Any:
        return 1e3 * lift * q

    def amplitude(mm: Any) -> Any:
        return mm / (1e3 * lift)

    second = ax.secondary_xaxis("top", functions=(deflection, amplitude))
    force = run.joint.clamp.force / 1e6
    second.set_xlabel(rf"deflection of the middle (mm), $P$ = {force:g} MN/m")

"""Equivalent stiffness and damping against amplitude (the paper's figure 10).

Lines from the quasi-static cycles and from those of the refined model; open circles from the steady
states of the time domain.
"""

from __future__ import annotations

from typing import Any

from matplotlib.axes import Axes
from matplotlib.figure import Figure

from microslip.analyses.time.readings import equivalent
from microslip.describe.outputs import NamedOutput
from microslip.pipeline.run import Run
from microslip.results.cycle import table_of
from microslip.results.outputs import displacement, modal_factor
from microslip.show.plots.shown import label
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
    """Both against the first output in the sliding mode; on top the modal amplitude."""
    if not any(run.cycles.values()):
        return None
    figure = new_figure(COLUMN, 110 * MM)
    top, bottom = figure.subplots(2, 1, sharex=True)
    draw_equivalent(top, run, "k_eq")
    draw_equivalent(bottom, run, "gamma_eq")
    modal_axis(top, run)
    bottom.set_xlabel(amplitude_label(run))
    handles, labels = top.get_legend_handles_labels()
    figure.legend(handles, labels, loc="outside lower center", ncols=1)
    return figure


LABELS = {
    "k_eq": r"stiffness $k_{eq}\,/\,\omega_{sl}^2$",
    "gamma_eq": r"damping $\gamma_{eq}\,/\,\omega_{sl}^2$",
}


def draw_equivalent(ax: Axes, run: Run, name: str) -> None:
    """One column of the tables, every drive, logarithmic in amplitude."""
    for drive in run.cycles:
        table = table_of(run, drive)
        if table is not None:
            ax.plot(per_modal(run) * table.amplitude, getattr(table, name), **DRIVES[drive])
    if "prescribed" in run.tables:
        table = run.tables["prescribed"]
        # of resonances it is counted from the stuck mode
        ratio = (table.omega / run.mode.sliding_omega) ** 2
        value = ratio * getattr(table, name) + (ratio - 1 if name == "k_eq" else 0.0)
        ax.plot(per_modal(run) * table.amplitude, value, **PRESCRIBED)
    points = [p for p in run.time_domain if p.steady.converged and p.friction > 0]
    if points:
        found = [equivalent(p.steady, run.prepared) for p in points]
        ax.plot(
            [per_modal(run) * abs(p.steady.amplitude) for p in points],
            [getattr(e, name) for e in found],
            "o",
            color=BLACK,
            mfc="none",
            mew=0.7,
            label="steady states of the time domain",
        )
    ax.axhline(0, color=BLACK, lw=0.5)
    ax.set_xscale("log")
    ax.set_ylabel(LABELS[name])


def per_modal(run: Run, output: NamedOutput | None = None) -> float:
    """A displacement, the first where none is named, per unit of the modal amplitude in the sliding
    mode; 1 where that has none."""
    size: float = modal_factor(run, output).get("per_unit", 0.0)
    return size or 1.0


def amplitude_label(run: Run, output: NamedOutput | None = None) -> str:
    """What the axis of `per_modal` is called."""
    output = output or displacement(run)
    if output is None or per_modal(run, output) == 1.0:
        return AMPLITUDE
    return f"{label(output)[:-1]}, in the sliding mode)"


def modal_axis(ax: Axes, run: Run) -> None:
    """Second axis on top: the modal amplitude."""
    factor = per_modal(run)
    if factor == 1.0:
        return

    def amplitude(y: Any) -> Any:
        return y / factor

    def output(q: Any) -> Any:
        return q * factor

    second = ax.secondary_xaxis("top", functions=(amplitude, output))
    force = run.assembly.measures.force / 1e6
    second.set_xlabel(rf"{AMPLITUDE}, $P$ = {force:g} MN/m")

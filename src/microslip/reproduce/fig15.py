"""Figure 15: the tables, with the solutions at three frequencies on them."""

from __future__ import annotations

import numpy as np

from microslip.reproduce.plate import Plate
from microslip.reproduce.settings import PAPER_RHO
from microslip.reproduce.study import Study
from microslip.reproduce.variants import CONSISTENT, PRINTED, read_table, solutions
from microslip.show.plots.style import DOUBLE, MM, SERIES, house_style, letters, new_figure

FREQUENCIES = (160.0, 173.0, 175.0)
"""Hz, the paper's."""


@house_style
def fig15(study: Study) -> Plate:
    """Equivalent damping and stiffness over amplitude, solutions of both models marked."""
    figure = new_figure(DOUBLE, 120 * MM)
    axes = figure.subplots(2, 2, sharex=True)
    data = {}
    for column, case in zip(axes.T, (PRINTED, CONSISTENT), strict=True):
        table = study.tables[case.table]
        grid = np.geomspace(table.amplitude[0], table.amplitude[-1], 400)
        best = float(table.amplitude[int(np.argmax(table.gamma_eq))])
        curve = read_table(study, case.table, grid)
        for ax, part in zip(column, ("imag", "real"), strict=True):
            ax.semilogx(grid / best, getattr(curve, part), color="k")
        for i, f in enumerate(FREQUENCIES):
            found = solutions(study, case, PAPER_RHO, f)
            at = read_table(study, case.table, found)
            style = SERIES[i + 1]
            for ax, part in zip(column, ("imag", "real"), strict=True):
                ax.plot(found / best, getattr(at, part), ls="", label=f"{f:g} Hz", **style)
            data[f"{case.key}, {f:g} Hz"] = {
                "solutions_over_greatest_damping": (found / best).tolist(),
                "gamma_eq": at.imag.tolist(),
                "k_eq": at.real.tolist(),
            }
        column[0].set_title(case.label, loc="left")
        column[1].set_xlabel("amplitude read $|q|/q^*$\n($q^*$: at the greatest damping)")
    for ax in axes[0]:
        ax.set_ylabel(r"$\gamma_{eq}$")
    for ax in axes[1]:
        ax.set_ylabel("$k_{eq}$")
    for ax in axes.ravel():
        ax.margins(y=0.12)
    letters(axes.ravel())
    figure.legend(*axes[0, 0].get_legend_handles_labels(), loc="outside lower center", ncols=3)
    return Plate(
        figure,
        f"Equivalent damping (a, b) and stiffness (c, d) over ω_sl² against the amplitude at which "
        f"the model reads them, over the amplitude q* of the greatest damping, and every solution "
        f"at ρ = {PAPER_RHO:g} and three frequencies. Left: as printed, friction alone under the "
        "end moment. Right: consistent, mode-driven.",
        data=data,
    )

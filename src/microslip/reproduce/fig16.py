"""Figure 16 and appendix B: the fixed-point map, its iterates, and where iteration fails."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.colors import BoundaryNorm, ListedColormap
from matplotlib.lines import Line2D
from matplotlib.patches import Patch
from numpy.typing import NDArray

from microslip.reproduce.fig15 import FREQUENCIES
from microslip.reproduce.maps import response_map, solution_counts
from microslip.reproduce.plate import Number, Plate, Trend
from microslip.reproduce.settings import PAPER_RHO
from microslip.reproduce.study import Study
from microslip.reproduce.variants import CONSISTENT, PRINTED, Case, fixed_point_map, solutions
from microslip.show.plots.style import (
    BLUE,
    DOUBLE,
    MM,
    VERMILLION,
    house_style,
    letters,
    new_figure,
)

ITERATES = 200
"""Plain iterations at most."""

DRAWN = 30
"""So many of the first and of the last iterates are drawn."""

CLOSE = 1e-6
"""Relative change of the last iterate that counts as converged."""

COUNT_COLOURS = ("#bbbbbb", "#ffffff", "#f6d9a8", "#E69F00")
"""No solution in the table, one, two, three or more."""


@house_style
def fig16(study: Study) -> Plate:
    """The map at three frequencies, and slopes and solutions over the plane."""
    figure = new_figure(DOUBLE, 150 * MM)
    axes = figure.subplots(2, 3)
    data: dict[str, Any] = {}
    for ax, f in zip(axes[0], FREQUENCIES, strict=True):
        _draw_map(ax, study, f, data)
    axes[0, 0].set_ylabel("$g(q)/q^*$")
    regions = {}
    for ax, case in zip(axes[1, :2], (PRINTED, CONSISTENT), strict=True):
        regions[case] = _draw_regions(ax, study, case)
        ax.set_title(case.variant + (", friction alone" if case == PRINTED else ""), loc="left")
    axes[1, 0].set_ylabel(r"$\rho$")
    _draw_slopes(axes[1, 2], study)
    letters(axes.ravel())
    figure.legend(handles=_handles(), loc="outside lower center", ncols=4)
    slope = {c.key: _at(study, c, PAPER_RHO) for c in (PRINTED, CONSISTENT)}
    counted = {c.key: r["most_solutions"] for c, r in regions.items()}
    uniqueness = (
        "Counted by bracketing every root of g(q) - q in the table; the response folds where "
        f"there are three. Consistent and mode-driven: {counted[CONSISTENT.key]}."
    )
    return Plate(
        figure,
        f"(a)–(c) The fixed-point map g(q) of appendix B at ρ = {PAPER_RHO:g} and three frequencies, "
        "over the amplitude q* of greatest damping, with the first and last iterates of plain iteration from "
        "rest. (d), (e) Number of solutions over ρ and frequency; inside the line |g'| ≥ 1 at the "
        "answer and plain iteration diverges. (f) Largest |g'| over the band at each ρ.",
        numbers=[
            Number(
                "slope",
                slope[PRINTED.key],
                f"Largest |g'| over {study.settings.band[0]:g} to {study.settings.band[1]:g} Hz at "
                f"ρ = {PAPER_RHO:g}, as printed with friction alone. Consistent and mode-driven: "
                f"{slope[CONSISTENT.key]:.2f}; over all ρ: {regions[PRINTED]['largest_slope']:.2f} "
                f"and {regions[CONSISTENT]['largest_slope']:.2f}.",
            ),
            Number("solutions", float(counted[PRINTED.key]), uniqueness),
        ],
        trends=[
            Trend(
                "iteration_converges",
                "plain iteration converges everywhere to the only solution",
                all(
                    r["share_diverging"] == 0 and r["most_solutions"] == 1 for r in regions.values()
                ),
                {case.key: region for case, region in regions.items()},
                "A slope 'less than 1' may be below -1; on steep flanks it is. Theorem 1 asks for "
                "|g'| < 1.",
            ),
            _theorem_agrees(data),
        ],
        data=data,
    )


def iterate(g: Callable[[float], float]) -> tuple[list[float], bool]:
    """Plain iteration from rest: the iterates, and whether they converge.

    Examples
    --------
    >>> iterate(lambda q: 1 + 0.5 * q)[1], iterate(lambda q: 1 - 1.5 * q)[1]
    (True, False)
    """
    q = [0.0]
    for _ in range(ITERATES):
        q.append(g(q[-1]))
        if not np.isfinite(q[-1]) or abs(q[-1]) > 1e12:
            return q[:-1], False
        if abs(q[-1] - q[-2]) <= CLOSE * abs(q[-1]):
            return q, True
    return q, False


def slope_at(g: Callable[[float], float], q: float) -> float:
    """Derivative of the map by central difference."""
    h = 1e-5 * q
    return (g(q + h) - g(q - h)) / (2 * h)


def _draw_map(ax: Axes, study: Study, frequency: float, data: dict[str, Any]) -> None:
    top = 0.0
    for case, style in _CASES.items():
        table = study.tables[case.table]
        best = float(table.amplitude[int(np.argmax(table.gamma_eq))])
        g = fixed_point_map(study, case, PAPER_RHO, frequency)
        path, converged = iterate(g)
        roots = solutions(study, case, PAPER_RHO, frequency)
        top = max(top, 1.35 * float(max(roots.max(initial=0.0), max(path[:6]))) / best)
        grid = np.geomspace(table.amplitude[0] / 10, table.amplitude[-1], 500)
        ax.plot(grid / best, [g(q) / best for q in grid], **style)
        for part in (path[:DRAWN], path[-DRAWN:]):
            steps = np.repeat(np.array(part) / best, 2)
            ax.plot(steps[1:-1], steps[2:], color=style["color"], lw=0.5)
        ax.plot(roots / best, roots / best, "o", color=style["color"], mfc="white")
        data[f"{case.key}, {frequency:g} Hz"] = {
            "solutions_over_greatest_damping": (roots / best).tolist(),
            "slopes": [slope_at(g, float(root)) for root in roots],
            "plain_iteration_converges": converged,
            "iterations": len(path) - 1,
            "reached_over_greatest_damping": path[-1] / best,
        }
    ax.plot([0, top], [0, top], color="k", lw=0.6, ls=":")
    ax.set_xlim(0, top)
    ax.set_ylim(0, top)
    ax.set_xlabel("$q/q^*$\n($q^*$: at the greatest damping)")
    ax.set_title(f"{frequency:g} Hz", loc="left")


_CASES: dict[Case, dict[str, Any]] = {
    PRINTED: {"color": BLUE, "ls": "--"},
    CONSISTENT: {"color": VERMILLION, "ls": "-"},
}


def _draw_regions(ax: Axes, study: Study, case: Case) -> dict[str, Any]:
    rho, frequency, counts = solution_counts(study, case)
    ax.pcolormesh(
        frequency,
        rho,
        np.minimum(counts, 3),
        cmap=ListedColormap(COUNT_COLOURS),
        norm=BoundaryNorm(np.arange(-0.5, 4), 4),
        shading="nearest",
        rasterized=True,
    )
    found = response_map(study, case)
    slope = np.where(np.isfinite(found.slope), found.slope, 0.0)
    if (slope >= 1).any():
        ax.contour(found.frequency, found.rho, slope, levels=[1.0], colors="k", linewidths=0.9)
    ax.grid(False)
    ax.set_xlim(frequency[0], frequency[-1])
    ax.set_ylim(rho[0], rho[-1])
    ax.set_xlabel("frequency (Hz)")
    return {
        "share_diverging": float((slope >= 1).mean()),
        "share_without_answer": float(np.isnan(found.slope).mean()),
        "largest_slope": float(slope.max()),
        "most_solutions": int(counts.max()),
        "share_several": float((counts > 1).mean()),
        "rho_of_several": _span(rho, (counts > 1).any(axis=1)),
        "rho_of_diverging": _span(found.rho, (slope >= 1).any(axis=1)),
    }


def _span(rho: NDArray, where: Any) -> list[float]:
    return [float(rho[where].min()), float(rho[where].max())] if where.any() else []


def _draw_slopes(ax: Axes, study: Study) -> None:
    for case, style in _CASES.items():
        found = response_map(study, case)
        ax.plot(found.rho, np.nanmax(found.slope, axis=1), **style)
    ax.axhline(1, color="k", lw=0.6, ls=":")
    ax.set_xlabel(r"$\rho$")
    ax.set_ylabel("largest $|g'|$")


def _at(study: Study, case: Case, rho: float) -> float:
    found = response_map(study, case)
    return float(np.nanmax(found.slope[int(np.argmin(np.abs(found.rho - rho)))]))


def _handles() -> list[Any]:
    lines = [Line2D([], [], label=case.label, **style) for case, style in _CASES.items()]
    names = ("no solution in the table", "one", "two", "three or more")
    patches = [
        Patch(facecolor=c, edgecolor="k", linewidth=0.5, label=n)
        for c, n in zip(COUNT_COLOURS, names, strict=True)
    ]
    return [*lines, *patches, Line2D([], [], color="k", lw=0.9, label="$|g'|$ = 1")]


def _theorem_agrees(data: dict[str, Any]) -> Trend:
    """Plain iteration may only converge to a solution whose slope is below 1 in size."""
    checked = {}
    for key, entry in data.items():
        roots = np.array(entry["solutions_over_greatest_damping"])
        if not len(roots) or not entry["plain_iteration_converges"]:
            continue
        i = int(np.argmin(np.abs(roots - entry["reached_over_greatest_damping"])))
        checked[key] = abs(entry["slopes"][i])
    return Trend(
        "iteration_obeys_theorem",
        "where plain iteration converges, |g'| < 1 at the solution it reaches",
        all(slope < 1 for slope in checked.values()),
        checked,
        "Theorem 1 of the paper, checked on the iterates.",
    )

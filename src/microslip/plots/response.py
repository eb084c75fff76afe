"""Forced response over frequency, per unit load (the paper's figures 11 and 13)."""

from __future__ import annotations

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.lines import Line2D

from microslip.pipeline import LapRun
from microslip.plots.selection import scientific
from microslip.plots.style import (
    COLUMN,
    DOUBLE,
    GREY,
    MM,
    SERIES,
    house_style,
    letters,
    new_figure,
)
from microslip.reduced import CONVERGED, Response
from microslip.results import frictionless_peak

TITLES = {"printed": "model as the paper prints it", "consistent": "consistent model"}


@house_style
def response_figure(result: LapRun) -> Figure | None:
    """One panel per variant, every load, over the frictionless peak."""
    variants = list(dict.fromkeys(r.variant for r in result.responses))
    if not variants or result.frictionless is None:
        return None
    figure = new_figure(DOUBLE if len(variants) > 1 else COLUMN, 90 * MM)
    axes = figure.subplots(1, len(variants), sharey=True, squeeze=False)[0]
    for ax, variant in zip(axes, variants, strict=True):
        draw_response(ax, result, variant)
        ax.set_title(TITLES.get(variant, variant), loc="left")
    for ax in axes[1:]:
        ax.set_ylabel("")
    if len(axes) > 1:
        letters(axes)
    figure.legend(handles=handles(result), loc="outside lower center", ncols=6)
    return figure


def draw_response(ax: Axes, result: LapRun, variant: str) -> None:
    """Curves of one variant.

    Points without an answer are crosses below; where the answer jumps from one branch of a fold to
    the other between two frequencies, a dotted line joins them.
    """
    for i, response in enumerate(r for r in result.responses if r.variant == variant):
        size = np.abs(response.amplitude) / frictionless_peak(result, response.load)
        good = response.flag == CONVERGED
        line = np.where(good, size, np.nan)
        style = SERIES[i % len(SERIES)]
        ax.plot(
            *_broken(response.frequency, line, _jumps(response)),
            color=style["color"],
            marker=style["marker"],
            markevery=(7 * i, max(len(size) // 9, 1)),
        )
        for k in _jumps(response):
            ends = slice(k, k + 2)
            ax.plot(response.frequency[ends], line[ends], color=style["color"], lw=0.7, ls=":")
        bad = np.flatnonzero(~good)
        if len(bad):
            ax.plot(
                response.frequency[bad[:: max(len(bad) // 25, 1)]],
                np.full(len(bad[:: max(len(bad) // 25, 1)]), 0.02 + 0.025 * i),
                "x",
                color=style["color"],
                ms=3,
                mew=0.7,
                transform=ax.get_xaxis_transform(),
            )
        points = [p for p in result.time_domain if p.steady.load == response.load]
        peak = frictionless_peak(result, response.load)
        if points:
            ax.plot(
                [p.corrected_frequency for p in points],
                [abs(p.steady.amplitude) / peak for p in points],
                "o",
                color=style["color"],
                mfc="none",
                ms=5,
                mew=0.9,
            )
    ax.set_yscale("log")
    band = result.responses[0].frequency
    ax.set_xlim(band[0], band[-1])
    ax.set_xlabel("frequency (Hz)")
    ax.set_ylabel("$|q|/M$ over its frictionless peak")


def _jumps(response: Response) -> np.ndarray:
    """Indices of points after which a response with friction changes by more than a factor 2."""
    if not response.drive:
        return np.array([], dtype=np.int64)
    change = np.abs(np.diff(np.log(np.maximum(np.abs(response.amplitude), 1e-300))))
    good = response.flag == CONVERGED
    return np.flatnonzero((change > np.log(2)) & good[1:] & good[:-1])


def _broken(x: np.ndarray, y: np.ndarray, after: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """The same line with gaps after the given points."""
    return np.insert(x, after + 1, x[after]), np.insert(y, after + 1, np.nan)


def handles(result: LapRun) -> list[Line2D]:
    """Legend entries: the loads, and the cross where there are any."""
    first = result.responses[0].variant
    shown = [r for r in result.responses if r.variant == first]
    entries = [
        Line2D([], [], **SERIES[i % len(SERIES)], label=_load(result, r))
        for i, r in enumerate(shown)
    ]
    if any(len(r.unconverged) for r in result.responses):
        entries.append(
            Line2D([], [], color=GREY, marker="x", ls="none", ms=4, label="no answer in the table")
        )
    if result.time_domain:
        entries.append(
            Line2D([], [], color=GREY, marker="o", mfc="none", ls="none", ms=5, label="time domain")
        )
    return entries


def _load(result: LapRun, response: Response) -> str:
    """What the user called this load."""
    load = result.joint.load
    if load is not None and load.rho is not None and np.isfinite(response.rho):
        return rf"$\rho$ = {response.rho:g}"
    return rf"$M/(PL)={scientific(response.load / result.assembly.moment_unit)}$"

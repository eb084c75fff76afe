"""Responses by harmonic balance over frequency: branches through their folds, and their stability."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.lines import Line2D

from microslip.pipeline.harmonic import HarmonicRun
from microslip.pipeline.run import Run
from microslip.results.harmonic import branch_outputs, outputs_of
from microslip.results.outputs import primary
from microslip.show.plots.selection import load_label
from microslip.show.plots.shown import (
    amplitude_axis,
    below_resonance,
    in_units,
    label,
    lag,
    phase_axis,
)
from microslip.show.plots.style import COLUMN, GREY, LINES, MM, SERIES, house_style, new_figure

STABLE: dict[str, Any] = {"marker": "+", "ls": "none", "ms": 6, "mew": 1.0}
UNSTABLE: dict[str, Any] = {"marker": "d", "mfc": "none", "ls": "none", "ms": 5, "mew": 0.8}


@house_style
def harmonic_figure(run: Run) -> Figure | None:
    """Amplitude and phase of every load: responses as marks, the branches followed as lines."""
    if not any(entry.points for entry in run.harmonic):
        return None
    figure = new_figure(COLUMN, 130 * MM)
    top, bottom = figure.subplots(2, 1, sharex=True, height_ratios=[3, 2])
    per_moment = any(entry.rho == 0 for entry in run.harmonic)
    for i, entry in enumerate(run.harmonic):
        style = SERIES[i % len(SERIES)]
        for (frequency, _), outputs in zip(entry.curves, branch_outputs(run, entry), strict=True):
            line = {"color": style["color"], "lw": 0.7, "ls": LINES[i % len(LINES)]}
            y = in_units(run, outputs)
            unit = entry.load if per_moment else 1.0
            top.plot(frequency, np.abs(y) / unit, **line)
            bottom.plot(frequency, lag(np.angle(y), below_resonance(run)), **line)
        draw_points(top, run, entry, style, size_over(unit))
        draw_points(bottom, run, entry, style, phase(run))
    amplitude_axis(top)
    top.set_ylabel(label(primary(run), run.joint.driven.load if per_moment else None))
    phase_axis(bottom, run)
    bottom.set_xlabel("frequency (Hz)")
    loads = [
        Line2D(
            [],
            [],
            color=SERIES[i % len(SERIES)]["color"],
            ls=LINES[i % len(LINES)],
            label=load_label(run, entry.rho, entry.load),
        )
        for i, entry in enumerate(run.harmonic)
    ]
    figure.legend(handles=[*loads, *handles(run)], loc="outside lower center", ncols=2)
    return figure


def draw_points(
    ax: Axes,
    run: Run,
    entry: HarmonicRun,
    style: dict[str, Any],
    value: Callable[[complex], float],
) -> None:
    """First output of the responses of one load: crosses, and open diamonds where they are not stable."""
    for unstable, mark in ((False, STABLE), (True, UNSTABLE)):
        shown = [
            p for p, bad in zip(entry.points, _unstable(entry), strict=True) if bad == unstable
        ]
        if shown:
            ax.plot(
                [p.frequency for p in shown],
                [value(complex(in_units(run, outputs_of(run, p))[1])) for p in shown],
                color=style["color"],
                **mark,
            )


def size_over(unit: float) -> Callable[[complex], float]:
    """Amplitude of a first harmonic over a unit."""
    return lambda y: abs(y) / unit


def phase(run: Run) -> Callable[[complex], float]:
    """Phase of a first harmonic of the first output, degrees."""
    start = below_resonance(run)
    return lambda y: float(lag(np.angle(y), start))


def _unstable(entry: HarmonicRun) -> list[bool]:
    return [found is not None and not found.stable for found in entry.stability]


def handles(run: Run) -> list[Line2D]:
    """Legend entries of the marks that there are."""
    found = [bad for entry in run.harmonic for bad in _unstable(entry)]
    entries = []
    if not all(found):
        entries.append(Line2D([], [], color=GREY, **STABLE, label="harmonic balance"))
    if any(found):
        entries.append(Line2D([], [], color=GREY, **UNSTABLE, label="harmonic balance, unstable"))
    return entries

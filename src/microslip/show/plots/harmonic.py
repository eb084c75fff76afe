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
from microslip.show.plots.selection import load_label
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
    for i, entry in enumerate(run.harmonic):
        style = SERIES[i % len(SERIES)]
        for frequency, amplitude in entry.curves:
            line = {"color": style["color"], "lw": 0.7, "ls": LINES[i % len(LINES)]}
            top.plot(frequency, np.abs(amplitude) / entry.load, **line)
            bottom.plot(frequency, lag(np.angle(amplitude)), **line)
        draw_points(top, entry, style, size_over(entry.load))
        draw_points(bottom, entry, style, lambda q: float(lag(np.angle(q))))
    top.set_yscale("log")
    top.set_ylabel(r"$|q|/M$  (kg$^{1/2}$ m$^{1/2}$ per N m/m)")
    bottom.set_ylabel("phase of $q$ (degrees)")
    bottom.set_yticks(-np.array([0, 45, 90, 135, 180]))
    bottom.set_ylim(-190, 10)
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
    ax: Axes, entry: HarmonicRun, style: dict[str, Any], value: Callable[[complex], float]
) -> None:
    """Responses of one load: crosses, and open diamonds where they are not stable."""
    for unstable, mark in ((False, STABLE), (True, UNSTABLE)):
        shown = [
            p for p, bad in zip(entry.points, _unstable(entry), strict=True) if bad == unstable
        ]
        if shown:
            ax.plot(
                [p.frequency for p in shown],
                [value(p.amplitude) for p in shown],
                color=style["color"],
                **mark,
            )


def size_over(unit: float) -> Callable[[complex], float]:
    """Amplitude over a unit."""
    return lambda q: abs(q) / unit


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


def lag(angle: np.ndarray | float) -> np.ndarray:
    """Radians to degrees between -270 and 90, so that a lag of half a turn does not jump."""
    return (np.degrees(angle) + 270) % 360 - 270

"""Responses by harmonic balance over frequency: branches through their folds, and their stability."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping
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
from microslip.show.plots.style import (
    COLUMN,
    GREY,
    LINES,
    MM,
    SERIES,
    Entry,
    draw_legend,
    house_style,
    marks,
    new_figure,
)
from microslip.typing import Array, Complex

STABLE: dict[str, Any] = {"marker": "+", "ls": "none", "ms": 6, "mew": 1.0}
UNSTABLE: dict[str, Any] = {"marker": "d", "mfc": "none", "ls": "none", "ms": 5, "mew": 0.8}


@house_style
def harmonic_figure(run: Run) -> Figure | None:
    """Amplitude and phase of every load: responses as marks, the branches followed as lines."""
    if not any(entry.points for entry in run.harmonic):
        return None
    figure = new_figure(COLUMN, 130 * MM)
    top, bottom = figure.subplots(2, 1, sharex=True, height_ratios=[3, 2])
    draw_amplitude(top, run)
    top.set_xlabel("")
    for i, entry in enumerate(run.harmonic):
        for (frequency, _), y in _branches(run, entry):
            bottom.plot(frequency, lag(np.angle(y), below_resonance(run)), **_line(i))
        draw_points(bottom, run, entry, SERIES[i % len(SERIES)], phase(run))
    phase_axis(bottom, run)
    bottom.set_xlabel("frequency (Hz)")
    draw_legend(figure, handles(run), loc="outside lower center", ncols=2)
    return figure


def draw_amplitude(ax: Axes, run: Run) -> None:
    """Amplitude of the first output of every load; per end moment where one has no friction."""
    per_moment = any(entry.rho == 0 for entry in run.harmonic)
    for i, entry in enumerate(run.harmonic):
        unit = entry.load if per_moment else 1.0
        for (frequency, _), y in _branches(run, entry):
            ax.plot(frequency, np.abs(y) / unit, **_line(i))
        draw_points(ax, run, entry, SERIES[i % len(SERIES)], size_over(unit))
    amplitude_axis(ax)
    ax.set_xlabel("frequency (Hz)")
    ax.set_ylabel(label(primary(run), run.joint.driven.load if per_moment else None))


def handles(run: Run) -> list[Entry]:
    """Legend entries of the loads, of the marks, and of the branches."""
    colours = {entry.load: _line(i)["color"] for i, entry in enumerate(run.harmonic)}
    loads: list[Entry] = [
        Line2D([], [], **{**_line(i), "lw": 1.1}, label=load_label(run, entry.rho, entry.load))
        for i, entry in enumerate(run.harmonic)
    ]
    entries = [*loads, *point_handles(run, colours)]
    if any(entry.curves for entry in run.harmonic):
        entries.append(Line2D([], [], color=GREY, lw=0.7, label="line: branch followed"))
    return entries


def _branches(run: Run, entry: HarmonicRun) -> Iterator[tuple[Any, np.ndarray]]:
    """Curves that were followed, and the first output along each."""
    for curve, outputs in zip(entry.curves, branch_outputs(run, entry), strict=True):
        yield curve, in_units(run, outputs)


def _line(i: int) -> dict[str, Any]:
    """Look of the branches of the i-th load."""
    return {"color": SERIES[i % len(SERIES)]["color"], "lw": 0.7, "ls": LINES[i % len(LINES)]}


def draw_points(
    ax: Axes,
    run: Run,
    entry: HarmonicRun,
    style: dict[str, Any],
    value: Callable[[Complex], Array],
) -> None:
    """First output of the responses of one load: crosses, and open diamonds where they are not stable."""
    for unstable, mark in ((False, STABLE), (True, UNSTABLE)):
        shown = [
            p for p, bad in zip(entry.points, _unstable(entry), strict=True) if bad == unstable
        ]
        if shown:
            ax.plot(
                [p.frequency for p in shown],
                value(np.array([in_units(run, outputs_of(run, p))[1] for p in shown])),
                color=style["color"],
                **mark,
            )


def size_over(unit: float) -> Callable[[Complex], Array]:
    """Amplitudes of first harmonics over a unit."""
    return lambda y: np.abs(y) / unit


def phase(run: Run) -> Callable[[Complex], Array]:
    """Phases of first harmonics of the first output, degrees."""
    start = below_resonance(run)
    return lambda y: lag(np.angle(y), start)


def _unstable(entry: HarmonicRun) -> list[bool]:
    return [found is not None and not found.stable for found in entry.stability]


def point_handles(run: Run, colours: Mapping[float, str]) -> list[Entry]:
    """Legend entries of the marks that there are, in the colours of their loads.

    Parameters
    ----------
    run : Run
    colours : mapping of float to str
        Of the loads that are drawn.
    """
    entries = []
    for unstable, name, mark in (
        (False, "harmonic balance", STABLE),
        (True, "harmonic balance, unstable", UNSTABLE),
    ):
        found = [
            colours[entry.load]
            for entry in run.harmonic
            if entry.load in colours and unstable in _unstable(entry)
        ]
        if found:
            entries.append(marks(found, name, **mark))
    return entries

"""Forced response over frequency: size and phase of the first output under every load.

Where steady states were found by time integration or by harmonic balance they are laid over the
curves, with the phase below; those of the time domain at their frequency corrected for the period
error.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.lines import Line2D

from microslip.analyses.reduced.response import Response
from microslip.analyses.reduced.sweep import CONVERGED
from microslip.pipeline.harmonic import HarmonicRun
from microslip.pipeline.run import Run
from microslip.results.outputs import primary
from microslip.results.response import has_peak
from microslip.results.time import outputs_of
from microslip.show.plots import harmonic
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
    DOUBLE,
    GREY,
    MM,
    SERIES,
    house_style,
    letters,
    new_figure,
)

TITLES = {
    "printed": "model as the paper prints it",
    "consistent": "consistent model",
    "refined": "refined model",
}


@house_style
def response_figure(run: Run) -> Figure | None:
    """One column per variant, every load: amplitude of the first output, and its phase."""
    variants = list(dict.fromkeys(r.variant for r in run.responses))
    if not variants or run.frictionless is None:
        return None
    figure = new_figure(DOUBLE if len(variants) > 1 else COLUMN, 140 * MM)
    grid = figure.subplots(
        2, len(variants), sharex=True, sharey="row", squeeze=False, height_ratios=[3, 2]
    )
    for k, variant in enumerate(variants):
        draw_response(grid[0, k], run, variant)
        grid[0, k].set_title(TITLES.get(variant, variant), loc="left")
        draw_phase(grid[1, k], run, variant)
        grid[1, k].set_title("phase", loc="left")
        grid[0, k].set_xlabel("")
    for ax in grid[:, 1:].ravel():
        ax.set_ylabel("")
    if grid.size > 1:
        letters(grid.ravel())
    entries = handles(run)
    columns = 2 if len(variants) == 1 else 4
    figure.legend(handles=entries, loc="outside lower center", ncols=columns)
    return figure


def draw_response(ax: Axes, run: Run, variant: str) -> None:
    """Curves of one variant.

    Points without an answer are crosses below; where the answer jumps from one branch of a fold to
    the other between two frequencies, a dotted line joins them. A curve that is largest at an end of
    the band, and so has no peak in it, is marked there.
    """
    for i, response in enumerate(r for r in run.responses if r.variant == variant):
        unit = response.load if per_moment(run) else 1.0
        size = np.abs(in_units(run, response.outputs)) / unit
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
        if _no_peak(response):
            k = response.peak
            mark = "<" if k == 0 else ">"
            ax.plot(response.frequency[k], size[k], mark, color=style["color"], **AT_EDGE)
        _draw_points(ax, run, response.load, style, harmonic.size_over(unit))
        for entry in _runs(run, response.load):
            harmonic.draw_points(ax, run, entry, style, harmonic.size_over(unit))
    amplitude_axis(ax)
    band = run.responses[0].frequency
    ax.set_xlim(band[0], band[-1])
    ax.set_xlabel("frequency (Hz)")
    ax.set_ylabel(label(primary(run), run.joint.driven.load if per_moment(run) else None))


def per_moment(run: Run) -> bool:
    """Whether amplitudes are drawn per end moment: where a load stands for the joint without
    friction, which is linear, and whose moment means nothing."""
    return any(response.rho == 0 for response in run.responses)


def draw_phase(ax: Axes, run: Run, variant: str) -> None:
    """Phase of the first output to the load, curves of one variant and time domain."""
    phase = harmonic.phase(run)
    for i, response in enumerate(r for r in run.responses if r.variant == variant):
        style = SERIES[i % len(SERIES)]
        good = response.flag == CONVERGED
        angle = np.angle(in_units(run, response.outputs))
        turned = np.where(good, lag(angle, below_resonance(run)), np.nan)
        ax.plot(
            *_broken(response.frequency, turned, _jumps(response)),
            color=style["color"],
            marker=style["marker"],
            markevery=(7 * i, max(len(turned) // 9, 1)),
        )
        _draw_points(ax, run, response.load, style, phase)
        for entry in _runs(run, response.load):
            harmonic.draw_points(ax, run, entry, style, phase)
    phase_axis(ax, run)
    ax.set_xlabel("frequency (Hz)")


def _runs(run: Run, load: float) -> list[HarmonicRun]:
    return [entry for entry in run.harmonic if entry.load == load]


def _draw_points(
    ax: Axes,
    run: Run,
    load: float,
    style: dict[str, Any],
    value: Callable[[complex], float],
) -> None:
    """First output of the steady states of one load: open circles; open squares where they are not steady."""
    points = [p for p in run.time_domain if p.steady.load == load]
    for steady, mark in ((True, STEADY), (False, NOT_STEADY)):
        shown = [p for p in points if p.steady.converged == steady]
        if shown:
            ax.plot(
                [p.corrected_frequency for p in shown],
                [value(complex(in_units(run, outputs_of(run, p))[1])) for p in shown],
                color=style["color"],
                **mark,
            )


STEADY: dict[str, Any] = {"marker": "o", "mfc": "none", "ls": "none", "ms": 5, "mew": 0.9}
NOT_STEADY: dict[str, Any] = {"marker": "s", "mfc": "none", "ls": "none", "ms": 7, "mew": 1.1}


AT_EDGE: dict[str, Any] = {"mfc": "none", "ms": 8, "mew": 1.1, "clip_on": False}


def _no_peak(response: Response) -> bool:
    """Whether there are answers, and none of them is a peak."""
    return bool((response.flag == CONVERGED).any()) and not has_peak(response)


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


def handles(run: Run) -> list[Line2D]:
    """Legend entries: the loads, and the cross where there are any."""
    first = run.responses[0].variant
    shown = [r for r in run.responses if r.variant == first]
    entries = [
        Line2D([], [], **SERIES[i % len(SERIES)], label=load_label(run, r.rho, r.load))
        for i, r in enumerate(shown)
    ]
    if any(len(r.unconverged) for r in run.responses):
        entries.append(
            Line2D([], [], color=GREY, marker="x", ls="none", ms=4, label="no answer in the table")
        )
    if any(_no_peak(r) for r in run.responses):
        mark = Line2D([], [], color=GREY, ls="none", marker=">", **AT_EDGE)
        mark.set_label("no peak in the band")
        entries.append(mark)
    if run.time_domain:
        entries.append(Line2D([], [], color=GREY, **STEADY, label="time domain"))
    if not all(p.steady.converged for p in run.time_domain):
        entries.append(Line2D([], [], color=GREY, **NOT_STEADY, label="time domain, not steady"))
    return entries + harmonic.handles(run)

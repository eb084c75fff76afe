"""Forced response over frequency: size and phase of the first output under every load.

Where steady states were found by time integration or by harmonic balance they are laid over the
curves, with the phase below.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.lines import Line2D

from microslip.analyses.reduced.response import NO_DIGIT, Response
from microslip.analyses.reduced.sweep import CONVERGED
from microslip.analyses.time.point import TimePoint
from microslip.pipeline.harmonic import HarmonicRun
from microslip.pipeline.run import Run
from microslip.results.outputs import primary
from microslip.results.time import outputs_of
from microslip.show.plots import harmonic
from microslip.show.plots.curves import draw_curve, mark_no_peak, no_peak, no_peak_handle
from microslip.show.plots.selection import load_label
from microslip.show.plots.shown import (
    amplitude_axis,
    in_units,
    label,
    phase_axis,
)
from microslip.show.plots.style import (
    COLUMN,
    DOUBLE,
    MM,
    SERIES,
    Entry,
    draw_legend,
    house_style,
    letters,
    marks,
    new_figure,
)
from microslip.typing import Array, Complex, Mask

TITLES = {
    "printed": "model as the paper prints it",
    "consistent": "consistent model",
    "refined": "refined model",
    "corrected": "refined model, corrected by time integration",
    "auto": "refined model, put right by time integration",
}

UNBOUNDED: dict[str, Any] = {"ls": (0, (1, 1.2)), "lw": 1.0, "alpha": 0.7}
"""Lines of curves that steady states put right, where nothing bounds their error."""


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
    draw_legend(figure, entries, loc="outside lower center", ncols=columns)
    return figure


def draw_response(ax: Axes, run: Run, variant: str) -> None:
    """Curves of one variant.

    Points without an answer are crosses below; where the answer jumps from one branch of a fold to
    the other between two frequencies, a dotted line joins them. A curve that is largest at an end of
    the band, and so has no peak in it, is marked there.
    """
    for i, response in enumerate(r for r in run.responses if r.variant == variant):
        unit = response.load if per_moment(run) else 1.0
        value = harmonic.size_over(unit)
        size = value(in_units(run, response.outputs))
        good = response.flag == CONVERGED
        style = SERIES[i % len(SERIES)]
        _draw_motions(ax, run, response, i, value)
        _draw_bound(ax, run, response, size, style["color"])
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
        mark_no_peak(ax, response, size, style["color"])
        _draw_points(ax, run, response.load, style, value)
        for entry in _runs(run, response.load):
            harmonic.draw_points(ax, run, entry, style, value)
    amplitude_axis(ax)
    band = run.responses[0].frequency
    ax.set_xlim(band[0], band[-1])
    ax.set_xlabel("frequency (Hz)")
    ax.set_ylabel(label(primary(run), run.joint.driven.load if per_moment(run) else None))


def _draw_motions(
    ax: Axes, run: Run, response: Response, i: int, value: Callable[[Complex], Array]
) -> None:
    """The i-th curve of a figure: a value of the first output, dashed of the smaller motion, dotted of the
    larger one that does not repeat."""
    style, y = SERIES[i % len(SERIES)], value(in_units(run, response.outputs))
    unknown = _unbounded(run, response)
    bounded = np.where(unknown, np.nan, y)
    every = _every(i, y)
    draw_curve(ax, response, bounded, style["color"], marker=style["marker"], markevery=every)
    if unknown.any():
        joined = unknown.copy()
        joined[1:] |= unknown[:-1]
        joined[:-1] |= unknown[1:]
        draw_curve(ax, response, np.where(joined, y, np.nan), style["color"], **UNBOUNDED)
    if response.smaller is not None:
        low = value(in_units(run, response.smaller.outputs))
        draw_curve(ax, response.smaller, low, style["color"], **SMALLER)
    if response.larger is not None:
        high = value(in_units(run, response.larger.outputs))
        draw_curve(ax, response.larger, high, style["color"], **LARGER)


def _error(run: Run, response: Response) -> Array | None:
    """Stated error of the first output where steady states put it right."""
    if not response.anchors:
        return None
    return response.output_errors.get(primary(run).name, response.error_indicator)


def _unbounded(run: Run, response: Response) -> Mask:
    """Answers without a digit that is sure, of a curve that steady states put right."""
    error, good = _error(run, response), response.flag == CONVERGED
    return np.zeros(len(good), bool) if error is None else good & ~(error < NO_DIGIT)


def _draw_bound(ax: Axes, run: Run, response: Response, size: Array, color: str) -> None:
    """Where steady states put it right: those that the curve passes through, and its stated error."""
    error = _error(run, response)
    if error is None:
        return
    sure = (response.flag == CONVERGED) & (error < NO_DIGIT)
    low, high = (
        np.where(sure, size * (1 - error), np.nan),
        np.where(sure, size * (1 + error), np.nan),
    )
    ax.fill_between(response.frequency, low, high, color=color, alpha=0.25, lw=0)
    at = [int(np.argmin(np.abs(response.frequency - one.frequency))) for one in response.anchors]
    on = [
        k
        for k, one in zip(at, response.anchors, strict=True)
        if abs(abs(response.amplitude[k]) - abs(one.amplitude)) < 0.03 * abs(one.amplitude)
    ]
    marker = ANCHOR if len(on) <= FEW else {**ANCHOR, "ms": 1.8, "mew": 0.5}
    ax.plot(response.frequency[on], size[on], color=color, **marker)


def per_moment(run: Run) -> bool:
    """Whether amplitudes are drawn per end moment: where a load stands for the joint without
    friction, which is linear, and whose moment means nothing."""
    return any(response.rho == 0 for response in run.responses)


def draw_phase(ax: Axes, run: Run, variant: str) -> None:
    """Phase of the first output to the load, curves of one variant and time domain."""
    phase = harmonic.phase(run)
    for i, response in enumerate(r for r in run.responses if r.variant == variant):
        style = SERIES[i % len(SERIES)]
        _draw_motions(ax, run, response, i, phase)
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
    value: Callable[[Complex], Array],
) -> None:
    """First output of the steady states of one load, each kind with its own mark."""
    points = [p for p in run.time_domain if p.steady.load == load]
    for kind, mark in TIME_POINTS.items():
        if shown := [p for p in points if _kind(p) == kind]:
            ax.plot(
                [p.steady.frequency for p in shown],
                value(np.array([in_units(run, outputs_of(run, p))[1] for p in shown])),
                color=style["color"],
                **mark,
            )


FEW = 40
"""More steady states of a curve than this have smaller marks."""

SMALLER: dict[str, Any] = {"ls": (0, (4, 2)), "lw": 0.9}
LARGER: dict[str, Any] = {"ls": (0, (1, 1.2)), "lw": 1.2}
ANCHOR: dict[str, Any] = {"marker": "d", "mfc": "white", "ls": "none", "ms": 3.5, "mew": 0.7}
STEADY: dict[str, Any] = {"marker": "o", "mfc": "none", "ls": "none", "ms": 5, "mew": 0.9}
NOT_STEADY: dict[str, Any] = {"marker": "s", "mfc": "none", "ls": "none", "ms": 7, "mew": 1.1}
UNSTABLE: dict[str, Any] = {"marker": "v", "mfc": "none", "ls": "none", "ms": 5, "mew": 0.9}
TIME_POINTS = {
    "time domain": STEADY,
    "time domain, unstable": UNSTABLE,
    "time domain, not steady": NOT_STEADY,
}
"""Kinds of points of the time domain, and their marks."""


def _kind(point: TimePoint) -> str:
    if not point.steady.converged:
        return "time domain, not steady"
    return "time domain" if point.settled else "time domain, unstable"


def _every(i: int, values: np.ndarray) -> tuple[int, int]:
    """Which points of the i-th curve have a mark."""
    return 7 * i, max(len(values) // 9, 1)


def handles(run: Run) -> list[Entry]:
    """Legend entries: the loads, and the marks there are, in the colours of the loads that have them."""
    first = run.responses[0].variant
    shown = [r for r in run.responses if r.variant == first]
    colours = [SERIES[i % len(SERIES)]["color"] for i in range(len(shown))]
    entries: list[Entry] = [
        Line2D([], [], **SERIES[i % len(SERIES)], label=load_label(run, r.rho, r.load))
        for i, r in enumerate(shown)
    ]

    def of(loads: set[float]) -> list[str]:
        return [c for c, r in zip(colours, shown, strict=True) if r.load in loads]

    if folded := of({r.load for r in run.responses if r.smaller is not None}):
        entries.append(marks(folded, "smaller of two motions", **SMALLER))
    if larger := of({r.load for r in run.responses if r.larger is not None}):
        entries.append(marks(larger, "larger motion, does not repeat", **LARGER))
    unanswered = [r for r in run.responses if len(r.unconverged)]
    if bad := of({r.load for r in unanswered}):
        held_to_states = all(r.variant in ("auto", "corrected") for r in unanswered)
        name = "no steady state known" if held_to_states else "no answer in the table"
        entries.append(marks(bad, name, marker="x", ls="none", ms=4))
    if unknown := of({r.load for r in run.responses if _unbounded(run, r).any()}):
        entries.append(marks(unknown, "error not bounded", **UNBOUNDED))
    if edge := of({r.load for r in run.responses if no_peak(r)}):
        entries.append(no_peak_handle(edge))
    if held := of({r.load for r in run.responses if r.anchors}):
        entries.append(marks(held, "steady state in time", **ANCHOR))
    for kind, mark in TIME_POINTS.items():
        if found := of({p.steady.load for p in run.time_domain if _kind(p) == kind}):
            entries.append(marks(found, kind, **mark))
    by_load = {entry.load: colour for entry in run.harmonic for colour in of({entry.load})}
    return entries + harmonic.point_handles(run, by_load)

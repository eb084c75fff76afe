"""One forced response over frequency: its line, its jumps, and the mark where it has no peak."""

from __future__ import annotations

from collections.abc import Iterable
from typing import Any

import numpy as np
from matplotlib.axes import Axes

from microslip.analyses.reduced.response import CONVERGED, Response
from microslip.results.response import has_peak
from microslip.show.plots.style import Entry, marks

AT_EDGE: dict[str, Any] = {"mfc": "none", "ms": 8, "mew": 1.1, "clip_on": False}


def draw_curve(ax: Axes, response: Response, y: np.ndarray, color: str, **style: Any) -> None:
    """Anything of a response over frequency, amplitude and phase alike.

    Points without an answer are left out. Where the answer jumps from one branch of a fold to the other
    between two frequencies, the line ends and a thin dotted one leads over.
    """
    line = np.where(response.flag == CONVERGED, y, np.nan)
    draw_line(ax, response.frequency, line, _jumps(response), color, **style)


def draw_line(
    ax: Axes, x: np.ndarray, line: np.ndarray, after: np.ndarray, color: str, **style: Any
) -> None:
    """A line that ends at the points `after` which it jumps; a thin dotted one leads over."""
    ax.plot(
        np.insert(x, after + 1, x[after]),
        np.insert(line, after + 1, np.nan),
        color=color,
        **style,
    )
    for k in after:
        ax.plot(x[k : k + 2], line[k : k + 2], color=color, lw=0.7, ls=":")


def mark_no_peak(ax: Axes, response: Response, size: np.ndarray, color: str) -> None:
    """Mark the end of the band at which a curve that has no peak in it is largest."""
    if no_peak(response):
        k = response.peak
        ax.plot(response.frequency[k], size[k], "<" if k == 0 else ">", color=color, **AT_EDGE)


def no_peak(response: Response) -> bool:
    """Whether there are answers, and none of them is a peak."""
    return bool((response.flag == CONVERGED).any()) and not has_peak(response)


def no_peak_handle(colours: Iterable[str]) -> Entry:
    """Legend entry of that mark, in the colours of the curves that have it."""
    return marks(colours, "no peak in the band", ls="none", marker=">", **AT_EDGE)


def _jumps(response: Response) -> np.ndarray:
    """Indices of points after which a response with friction changes by more than a factor 2."""
    if not response.drive:
        return np.array([], dtype=np.int64)
    good = response.flag == CONVERGED
    found = jumps(np.abs(response.amplitude))
    return found[good[found] & good[found + 1]]


def jumps(size: np.ndarray) -> np.ndarray:
    """Indices of points after which an amplitude changes by more than a factor 2.

    Examples
    --------
    >>> jumps(np.array([1.0, 1.5, 4.0, 3.0])).tolist()
    [1]
    """
    change = np.abs(np.diff(np.log(np.maximum(size, 1e-300))))
    return np.flatnonzero(change > np.log(2))

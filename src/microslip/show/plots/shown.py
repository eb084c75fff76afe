"""The output that figures show, in the unit an engineer has for it: the first of the file."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any, Literal

import numpy as np
from matplotlib.axes import Axes
from matplotlib.ticker import LogLocator, NullFormatter

from microslip.describe.outputs import NamedOutput
from microslip.describe.ports import LoadKind
from microslip.pipeline.run import Run
from microslip.results.outputs import per_mode, primary

MANY = 300.0
"""Ratio of the ends of a logarithmic axis beyond which only powers of ten have numbers."""


def label(output: NamedOutput, per: LoadKind | None = None) -> str:
    """What an axis says of an output, or of it per load of a kind.

    Examples
    --------
    >>> label(NamedOutput(name="tip", quantity="rotation"))
    'tip (mrad)'
    >>> from microslip.describe.ports import KINDS
    >>> label(NamedOutput(name="tip"), KINDS["moment"])
    'tip per end moment\\n(mm per N m/m)'
    """
    name, unit = output.name.replace("_", " "), output.measured.shown
    return f"{name} per {per.noun}\n({unit} per {per.unit})" if per else f"{name} ({unit})"


def in_units(run: Run, values: Mapping[str, Any], output: NamedOutput | None = None) -> Any:
    """Values of an output, of the first where none is named, in the unit that figures have for it."""
    wanted = output or primary(run)
    return np.asarray(values[wanted.name]) * wanted.measured.factor


def below_resonance(run: Run, output: NamedOutput | None = None) -> float:
    """Phase of an output, of the first where none is named, to the load far below the resonance.

    Degrees: 0 or 180 and, of a rate, 90 more for each derivative; from -90 to 180.
    """
    output, mode = output or primary(run), run.mode
    ahead = per_mode(run, output) * mode.load_on_sliding[run.prepared.drive] >= 0
    start = (0.0 if ahead else 180.0) + 90.0 * output.measured.order
    return start if start <= 180 else start - 360


def lag(angle: np.ndarray | float, start: float = 0.0) -> np.ndarray:
    """Radians to degrees between 270 below and 90 above `start`, so that a lag of half a turn does
    not jump.

    Examples
    --------
    >>> lag(np.radians([-170.0, -190.0])), lag(np.radians([170.0, -10.0]), 180.0)
    (array([-170., -190.]), array([170., -10.]))
    """
    return (np.degrees(angle) + 270 - start) % 360 - 270 + start


def amplitude_axis(ax: Axes, which: Literal["x", "y"] = "y") -> None:
    """Logarithmic scale of amplitudes that are drawn, with numbers as one says them: 0.1, 0.2, 0.5,
    1 ...; powers of ten alone where there would be too many."""
    ax.set(**{f"{which}scale": "log"})
    axis = ax.yaxis if which == "y" else ax.xaxis
    low, high = axis.get_view_interval()
    if high < MANY * low:
        axis.set_major_locator(LogLocator(subs=(1.0, 2.0, 5.0)))
        axis.set_major_formatter("{x:g}")
    axis.set_minor_formatter(NullFormatter())


def phase_axis(ax: Axes, run: Run, output: NamedOutput | None = None) -> None:
    """Ticks and label of the phase of an output, of the first where none is named."""
    start = below_resonance(run, output)
    ax.set_yticks(start - np.array([0, 45, 90, 135, 180]))
    ax.set_ylim(start - 190, start + 10)
    ax.set_ylabel(f"phase to the {run.joint.driven.load.key} (degrees)")

"""Motions of the structure where they are largest: over a cycle, at the peak of a response."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from matplotlib.colors import Normalize
from matplotlib.figure import Figure

from microslip.model.geometry import Geometry
from microslip.pipeline.motion import motion_from_prestress
from microslip.pipeline.run import Run
from microslip.pipeline.vibration import largest_vibrations
from microslip.show.plots.interface_maps import colour_bar
from microslip.show.plots.selection import name_of
from microslip.show.plots.spatial_fields import shown_cycle
from microslip.show.plots.structure import BAR, LARGEST, draw_motion
from microslip.show.plots.style import DOUBLE, house_style, letters, new_figure
from microslip.show.plots.view import columns_of, fitted, same_frame, skin_of, view_of
from microslip.typing import Array

MICRO = 1e6
"""m to µm."""

METHODS = {"harmonic": "harmonic balance", "time": "time integration"}
"""What the analyses of vibrations are called in titles."""


def motion_figure(run: Run) -> Figure | None:
    """Displacement from prestress at both turns of the load, in the cycle of greatest damping."""
    found = shown_cycle(run)
    if run.geometry is None or found is None:
        return None
    drive, index, cycle = found
    steps = [int(np.argmax(cycle.load)), int(np.argmin(cycle.load))]
    moved = motion_from_prestress(run.assembly, cycle, steps)
    labels = ("load at its largest", "load at its largest the other way")
    return moved_figure(
        run.geometry, moved, labels, f"motion from prestress, {name_of(run, drive, index)}"
    )


def harmonic_motion_figure(run: Run) -> Figure | None:
    """Displacement from prestress at both turns of the largest response by harmonic balance."""
    return _vibration_figure(run, "harmonic")


def time_motion_figure(run: Run) -> Figure | None:
    """The same of the largest steady state in time."""
    return _vibration_figure(run, "time")


def _vibration_figure(run: Run, analysis: str) -> Figure | None:
    found = largest_vibrations(run).get(analysis)
    if run.geometry is None or found is None:
        return None
    turns = found.turns()
    moved = found.from_prestress(run.assembly, np.array(turns))
    named = run.joint.driven.load.named(found.load)
    doubt = f" ({found.doubt})" if found.doubt else ""
    said = f"{METHODS[analysis]}, largest response: {named}, {found.motion.frequency:.2f} Hz{doubt}"
    labels = [
        f"largest, {lag(turns[0])}",
        f"largest the other way, {lag(turns[1] - np.pi)}",
    ]
    return moved_figure(run.geometry, moved, labels, said)


def lag(phase: float) -> str:
    """How long after the load ``sin(theta)`` is largest something is, in degrees of its phase.

    Examples
    --------
    >>> lag(3.14159265), lag(1.57079633)
    ('90° after the load', 'with the load')
    """
    after = round((np.degrees(phase) - 90.0 + 180.0) % 360.0 - 180.0)
    if after == 0:
        return "with the load"
    return f"{abs(after)}° {'after' if after > 0 else 'before'} the load"


@house_style
def moved_figure(geometry: Geometry, moved: Array, labels: Sequence[str], said: str) -> Figure:
    """Bodies under some displacements (s, dofs) of the structure, all on one scale."""
    motions = [geometry.displacement(x) for x in moved]
    sizes = [np.linalg.norm(u, axis=1) for u in motions]
    top = max(float(size.max(initial=0.0)) for size in sizes) or 1e-6
    unit, factor = ("mm", 1e3) if top > 1e-3 else ("µm", MICRO)
    view, skin = view_of(geometry), skin_of(geometry)
    columns = columns_of(geometry, view, len(motions))
    figure = new_figure(DOUBLE, DOUBLE)
    axes = list(figure.subplots(-(-len(motions) // columns), columns, squeeze=False).ravel())
    norm = Normalize(0.0, factor * top)
    shown = None
    for ax, u, size, label in zip(axes, motions, sizes, labels, strict=True):
        shown = draw_motion(ax, geometry, skin, view, u / top, norm, factor * size)
        ax.set_title(label, loc="left")
    same_frame(axes)
    fitted(figure, axes, columns, BAR)
    if shown is not None:
        colour_bar(figure, shown, axes, f"displacement ({unit})")
    letters(axes)
    figure.suptitle(f"{said}, drawn {rounded(LARGEST * geometry.size / top)} times as large")
    return figure


def rounded(factor: float) -> str:
    """A factor in two digits, without an exponent where it is large.

    Examples
    --------
    >>> rounded(1523.0), rounded(0.2541)
    ('1,500', '0.25')
    """
    return f"{float(f'{factor:.2g}'):,.7g}"

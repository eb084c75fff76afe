"""The joint as it is computed: mesh, clamp, end moments, supports and dimensions."""

from __future__ import annotations

import numpy as np
from matplotlib.axes import Axes
from matplotlib.collections import PolyCollection
from matplotlib.figure import Figure
from matplotlib.patches import FancyArrowPatch

from microslip.describe.lap import LapJoint
from microslip.describe.ports import END_MOMENTS, Port
from microslip.model.lap import SIDES, pressing
from microslip.pipeline.run import Run
from microslip.show.plots.style import (
    BLACK,
    BLUE,
    DOUBLE,
    MM,
    VERMILLION,
    house_style,
    letters,
    new_figure,
)

_FILLS = ("#9fd0ee", "#f0e3c0")
_DIMENSION = {"arrowstyle": "<->", "lw": 0.6, "shrinkA": 0, "shrinkB": 0, "mutation_scale": 6}
_FORCE = {
    "arrowstyle": "-|>",
    "lw": 0.7,
    "color": BLUE,
    "shrinkA": 0,
    "shrinkB": 0,
    "mutation_scale": 5,
}


@house_style
def model_figure(run: Run) -> Figure | None:
    """The whole joint, and its overlap from near; None for a structure without a mesh."""
    if not run.structure.meshes:
        return None
    figure = new_figure(DOUBLE, 88 * MM)
    whole, near = figure.subplots(2, 1, height_ratios=[1.0, 1.8])
    draw_model(whole, run)
    draw_overlap(near, run)
    whole.set_title("the whole joint", loc="left")
    near.set_title("the overlap", loc="left")
    letters((whole, near))
    return figure


def _lap(run: Run) -> LapJoint:
    """The description, whose dimensions are drawn: a joint with meshes is a lap joint."""
    assert isinstance(run.joint, LapJoint)
    return run.joint


def draw_model(ax: Axes, run: Run) -> None:
    """The whole joint to scale: mesh, end moments, supports, clamp, lengths in mm."""
    beams, support = _lap(run).beams, _lap(run).support
    half = 1e3 * beams.overlap_half_length
    far = [1e3 * length - half for length in beams.lengths]
    thick = [1e3 * t for t in beams.thicknesses]
    size = max(*thick, 0.025 * max(far))
    _mesh(ax, run, 0.1)
    ends = zip(SIDES, far, thick, (support.left, support.right), strict=True)
    for side, x, t, kind in ends:
        if _bent(run, side):
            _moment(ax, side * x, side * t / 2, side, size)
        if kind == "pinned":
            _support(ax, side * x, side * t / 2, size)
        elif kind == "clamped":
            _wall(ax, side * x, side * t / 2, side, 0.8 * size)
    _clamp(ax, run, 5)
    below, above = -thick[0] - 1.6 * size, thick[1] + 1.5 * size
    if beams.identical:
        _dimension(ax, -far[0], half, below, f"$L={far[0] + half:.4g}$ mm")
    else:
        _dimension(ax, -far[0], half, below, f"{far[0] + half:.4g} mm")
        _dimension(ax, -half, far[1], above + 1.3 * size, f"{far[1] + half:.4g} mm", above=True)
    _dimension(ax, -half, half, above, f"$2L_o={2 * half:.4g}$ mm", above=True)
    ax.set_xlim(-far[0] - 2.4 * size, far[1] + 2.4 * size)
    ax.set_ylim(below - 1.8 * size, above + (1.7 if beams.identical else 3.0) * size)
    _bare(ax)


def draw_overlap(ax: Axes, run: Run) -> None:
    """The overlap to scale: mesh, clamp traction, contact pairs."""
    joint = _lap(run)
    half = 1e3 * joint.beams.overlap_half_length
    lower, upper = (1e3 * t for t in joint.beams.thicknesses)
    t = max(lower, upper)
    clamp, middle = 1e3 * joint.clamp.half_length, 1e3 * joint.clamp.centre
    margin = 0.95 * half
    _mesh(ax, run, 0.2)
    _clamp(ax, run, 13)
    ax.plot([-half, half], [0, 0], color=VERMILLION, lw=1.4, solid_capstyle="butt")
    ax.annotate(
        f"{run.model.pairs} contact\npairs",
        (half + 0.06 * margin, 0),
        (0, -3),
        textcoords="offset points",
        color=VERMILLION,
        va="top",
    )
    force = joint.clamp.force / 1e6
    top = upper + 0.75 * t
    ax.text(middle, top, f"$P={force:.4g}$ MN/m", color=BLUE, ha="center", va="bottom")
    _dimension(ax, middle - clamp, middle + clamp, -lower - 0.9 * t, f"$2L_p={2 * clamp:.4g}$ mm")
    x = -half - 0.5 * margin
    ax.annotate("", (x, 0), (x, -lower), arrowprops=_DIMENSION)
    ax.text(x, 0.12 * t, f"{lower:.4g} mm", ha="center", va="bottom")
    if not joint.beams.identical:
        x = half + 0.5 * margin
        ax.annotate("", (x, 0), (x, upper), arrowprops=_DIMENSION)
        ax.text(x, upper + 0.12 * t, f"{upper:.4g} mm", ha="center", va="bottom")
    ax.set_xlim(-half - margin, half + margin)
    ax.set_ylim(-lower - 2.0 * t, upper + 1.5 * t)
    _bare(ax)


def _bare(ax: Axes) -> None:
    ax.set_aspect("equal")
    ax.set_axis_off()


def _mesh(ax: Axes, run: Run, width: float) -> None:
    for mesh, fill in zip(run.structure.meshes, _FILLS, strict=False):
        quads = 1e3 * mesh.p[:, mesh.t].transpose(2, 1, 0)
        ax.add_collection(
            PolyCollection(list(quads), facecolors=fill, edgecolors="#404040", linewidths=width)
        )


def _clamp(ax: Axes, run: Run, count: int) -> None:
    """Arrows of the clamp traction on both outer faces, as long as it is large."""
    thick = [1e3 * t for t in _lap(run).beams.thicknesses]
    pressed = pressing(_lap(run))
    x = np.linspace(pressed.knots[0], pressed.knots[-1], 61)
    size = pressed.density(x) / pressed.density(x).max()
    arrows = np.linspace(0, len(x) - 1, count).astype(int)
    for side, t in zip(SIDES, thick, strict=True):
        ends = side * (t + 0.65 * max(thick) * size)
        for i in arrows[size[arrows] > 0.1]:
            ax.annotate("", (1e3 * x[i], side * t), (1e3 * x[i], ends[i]), arrowprops=_FORCE)
        ax.plot(1e3 * x, ends, color=BLUE, lw=0.7)


def _wall(ax: Axes, x: float, y: float, side: float, size: float) -> None:
    """A clamped end: the face of a wall, hatched behind."""
    low, high = y - size, y + size
    ax.plot([x, x], [low, high], color=BLACK, lw=1.0)
    for start in np.linspace(low, high, 6):
        ax.plot([x, x + 0.3 * side * size], [start, start - 0.3 * size], color=BLACK, lw=0.5)


def _bent(run: Run, side: float) -> bool:
    """Whether a moment acts at an end."""
    port = _lap(run).driven
    if port is END_MOMENTS:
        return True
    return (
        isinstance(port, Port)
        and port.kind == "moment"
        and ("left" if side < 0 else "right") in port.ends
    )


def _moment(ax: Axes, x: float, y: float, side: float, size: float) -> None:
    """Curved arrow of the end moment, positive: the joint bends concave up."""
    ax.add_patch(
        FancyArrowPatch(
            (x + side * 0.3 * size, y - 1.3 * size),
            (x + side * 0.3 * size, y + 1.5 * size),
            connectionstyle=f"arc3,rad={side * 0.7}",
            arrowstyle="-|>",
            mutation_scale=7,
            color=VERMILLION,
            lw=1.0,
        )
    )
    ax.text(
        x - side * 0.9 * size, y + 1.6 * size, "$M$", color=VERMILLION, ha="center", va="center"
    )


def _support(ax: Axes, x: float, y: float, size: float) -> None:
    """Roller below a point: held vertically, free horizontally but for weak springs."""
    foot = [x, x - 0.45 * size, x + 0.45 * size]
    ax.fill(foot, [y, y - 0.85 * size, y - 0.85 * size], fc="white", ec=BLACK, lw=0.7, zorder=3)
    ax.plot([x - 0.6 * size, x + 0.6 * size], [y - 1.1 * size] * 2, color=BLACK, lw=0.7)
    ax.plot([x], [y], "o", color=BLACK, ms=2.2, zorder=4)


def _dimension(
    ax: Axes, start: float, stop: float, y: float, text: str, above: bool = False
) -> None:
    """Dimension line with its text above or below the middle."""
    ax.annotate("", (start, y), (stop, y), arrowprops=_DIMENSION)
    ax.annotate(
        text,
        (0.5 * (start + stop), y),
        (0, 2 if above else -2),
        textcoords="offset points",
        ha="center",
        va="bottom" if above else "top",
    )

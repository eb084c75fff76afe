"""What a file describes, before anything is computed: structure, interfaces, motions without stiffness."""

from __future__ import annotations

import textwrap
from collections.abc import Iterator, Sequence

import numpy as np
from matplotlib.axes import Axes
from matplotlib.cm import ScalarMappable
from matplotlib.collections import PolyCollection
from matplotlib.colors import Normalize
from matplotlib.figure import Figure
from matplotlib.lines import Line2D

from microslip.contact.pairs import by_pair
from microslip.model.geometry import ContactSurface, Geometry
from microslip.model.mesh.facets import FacetGroup
from microslip.model.structure import Structure
from microslip.show.plots.charts import Chart, bare, chart_of, loop_of
from microslip.show.plots.interface_maps import colour_bar, outline
from microslip.show.plots.structure import scattered, shapes_figure
from microslip.show.plots.style import BLACK, DOUBLE, MM, house_style, new_figure
from microslip.show.plots.view import View, fitted, frame, view_of
from microslip.typing import Array

LOWER, UPPER = "#4d9ac9", "#dba04a"
"""Colours of the two sides."""

APART = 0.13
"""Distance of each side from the middle as it is drawn, over the extent of the interface."""

ARROWS = 40
"""Normals that are drawn."""

DOT = 110.0
"""Area of the dot of the largest pair, points²."""


@house_style
def interface_figure(
    geometry: Geometry, structure: Structure, surface: ContactSurface, area: Array, gap: Array
) -> Figure:
    """An interface taken apart, with its sides and normals; beside it its pairs in its own plane.

    Parameters
    ----------
    geometry : Geometry
    structure : Structure
    surface : ContactSurface
    area, gap : (m,) arrays
        Of its pairs; areas count by their ratios, gaps are in m.
    """
    view = view_of(geometry)
    spatial = geometry.dimension == 3
    chart = chart_of(surface, geometry.points) if spatial else None
    figure = new_figure(DOUBLE, (82 if spatial else 60) * MM)
    axes = figure.subplots(1, 2 if spatial else 1, squeeze=False)[0]
    handles = draw_apart(axes[0], geometry, structure, surface, view)
    axes[0].set_title("(a)  taken apart" if spatial else "taken apart", loc="left")
    if chart is None:
        fitted(figure, [axes[0]], 1)
    else:
        handles += draw_pairs(axes[1], geometry, surface, chart, area, gap)
        if gap.any():
            scale = ScalarMappable(_gap_scale(gap), GAPS)
            colour_bar(figure, scale, axes[1:], "initial gap (µm)")
        said = f" ({chart.said})" if chart.said else ""
        axes[1].set_title(f"(b)  pairs, as large as their areas{said}", loc="left")
    figure.suptitle(f"interface {surface.name}: {len(surface.points)} pairs")
    figure.legend(handles=handles, loc="outside lower center", ncols=3)
    return figure


MOST_MOTIONS = 12
"""Motions without stiffness that are drawn."""


@house_style
def motions_figure(geometry: Geometry, shapes: Array, names: Sequence[str]) -> Figure:
    """Motions without stiffness: those of single bodies along and about the axes, then what is left.

    Parameters
    ----------
    geometry : Geometry
    shapes : (dofs, k) array
        That span them.
    names : sequence of str
        What they are.
    """
    drawn = simple_motions(geometry, shapes)
    some = dict(list(drawn.items())[:MOST_MOTIONS])
    figure = shapes_figure(geometry, some)
    more = f", and {len(drawn) - MOST_MOTIONS} more" if len(drawn) > MOST_MOTIONS else ""
    said = "; ".join(dict.fromkeys(names))
    figure.suptitle(textwrap.fill(f"without stiffness: {said}{more}", LINE), x=0.01, ha="left")
    return figure


def simple_motions(geometry: Geometry, shapes: Array) -> dict[str, Array]:
    """As many motions as shapes (dofs, k) span, by what they are: each of one body along or about an axis
    where there are such, numbered where there are not."""
    moved = geometry.motion @ shapes
    found: dict[str, Array] = {}
    kept = np.zeros((shapes.shape[1], 0))
    for body in np.unique(geometry.body[geometry.body >= 0]):
        called = geometry.names[body] if geometry.names else f"body {body + 1}"
        for name, field in _rigid(geometry, int(body)):
            mix = np.linalg.lstsq(moved, field, rcond=None)[0]
            if np.linalg.norm(moved @ mix - field) < WITHIN * np.linalg.norm(field):
                found[f"{called} {name}"] = shapes @ mix
                kept = np.column_stack([kept, mix])
    rest = np.linalg.svd(kept, full_matrices=True)[0][:, kept.shape[1] :]
    numbered = {f"motion {len(found) + k + 1}": shapes @ mix for k, mix in enumerate(rest.T)}
    return {**found, **numbered}


def _rigid(geometry: Geometry, body: int) -> Iterator[tuple[str, Array]]:
    """Translations and turns of a body as displacements (d n,) of all points."""
    d, own = geometry.dimension, geometry.body == body
    for k in range(d):
        yield f"along {'xyz'[k]}", (own[:, None] * np.eye(d)[k]).ravel()
    arm = np.zeros((len(geometry.points), 3))
    arm[:, :d] = geometry.points - geometry.points[own].mean(axis=0)
    for k in range(3) if d == 3 else (2,):
        turn = np.cross(np.eye(3)[k], arm)[:, :d]
        yield f"about {'xyz'[k]}", (own[:, None] * turn).ravel()


WITHIN = 1e-5
"""Of a motion, what a combination of shapes may miss of it."""

LINE = 100
"""Characters of a line above the motions."""

GAPS = "coolwarm"
"""Colours of gaps: overlaps are blue."""


def _gap_scale(gap: Array) -> Normalize:
    largest = 1e6 * float(np.abs(gap).max())
    return Normalize(-largest, largest)


def draw_apart(
    ax: Axes, geometry: Geometry, structure: Structure, surface: ContactSurface, view: View
) -> list[Line2D]:
    """Both sides, moved apart along the normals, and the normals between them; entries of the legend."""
    extent = float(np.linalg.norm(np.ptp(surface.points, axis=0)))
    mean = np.nan_to_num(surface.normal).mean(axis=0)
    length = float(np.linalg.norm(mean))
    step = APART * extent * (mean / length if length else mean)
    own, other = surface.facets, surface.opposite
    lower, upper = (own, other) if surface.own_below else (other, own)
    reached = [view.flat(surface.points)]
    for groups, way, colour, order in ((lower, -step, LOWER, 1), (upper, step, UPPER, 3)):
        for group in groups:
            loops = geometry.points[group.nodes[:, _around(group, geometry.dimension)]] + way
            reached.append(view.flat(loops).reshape(-1, 2))
            ax.add_collection(
                PolyCollection(
                    list(view.flat(loops)),
                    closed=geometry.dimension == 3,
                    facecolors=colour if geometry.dimension == 3 else "none",
                    edgecolors="#40404080" if geometry.dimension == 3 else colour,
                    linewidths=0.2 if geometry.dimension == 3 else 2.0,
                    alpha=None if order == 1 else 0.72,
                    zorder=order,
                )
            )
    if not own:
        reached += _draw_nodes(ax, geometry, structure, surface, view, step)
    _draw_normals(ax, surface, view, 2 * float(np.linalg.norm(step)))
    frame(ax, np.vstack(reached))
    below, above = (f" side, {name}" if name else " side" for name in surface.sides)
    return [
        Line2D([], [], color=LOWER, lw=4, label=f"lower{below}"),
        Line2D([], [], color=UPPER, lw=4, label=f"upper{above}"),
        Line2D([], [], color=BLACK, ls="", marker=r"$\uparrow$", ms=8, label="normal"),
    ]


def _around(group: FacetGroup, dimension: int) -> Sequence[int]:
    if dimension == 3:
        return loop_of(group.kind)
    return (0, 2, 1) if group.nodes.shape[1] == 3 else (0, 1)


def _draw_normals(ax: Axes, surface: ContactSurface, view: View, length: float) -> None:
    """Normals at some of the pairs, from the lower to the upper side."""
    known = np.flatnonzero(np.isfinite(surface.normal).all(axis=1))
    if not len(known):
        return
    some = known[scattered(surface.points[known], ARROWS)]
    way = 0.8 * length * surface.normal[some]
    start = surface.points[some] - 0.5 * way
    for tail, tip in view.flat(np.stack([start, start + way], axis=1)):
        arrow = {"arrowstyle": "-|>", "lw": 0.6, "shrinkA": 0, "shrinkB": 0, "mutation_scale": 5}
        ax.annotate("", tuple(tip), tuple(tail), arrowprops=arrow, zorder=2)


def _draw_nodes(
    ax: Axes,
    geometry: Geometry,
    structure: Structure,
    surface: ContactSurface,
    view: View,
    step: Array,
) -> list[Array]:
    """Nodes of both sides where no faces are known: those that close the gap as they move along the normal
    are of the lower side."""
    d = geometry.dimension
    relative = structure.interface.relative
    rows = by_pair(np.arange(relative.shape[0]), d)[surface.pairs, 0]
    reached = []
    for sign, colour in ((-1.0, LOWER), (1.0, UPPER)):
        found: list[int] = []
        for pair, row in enumerate(rows):
            forces = geometry.forces(relative[int(row)].toarray().ravel())
            along = forces @ np.nan_to_num(surface.normal[pair])
            found += np.flatnonzero(sign * along < 0).tolist()
        if found:
            flat = view.flat(geometry.points[found] + sign * step)
            ax.plot(*flat.T, "o", color=colour, ms=4.0, mew=0, zorder=3)
            reached.append(flat)
    return reached


def draw_pairs(
    ax: Axes, geometry: Geometry, surface: ContactSurface, chart: Chart, area: Array, gap: Array
) -> list[Line2D]:
    """Pairs as dots as large as their areas over the facets of both sides; colours are initial gaps."""
    outline(ax, chart)
    if not chart.said:
        for group in surface.opposite:
            loops = chart.flat_points(geometry.points[group.nodes[:, loop_of(group.kind)]])
            ax.add_collection(
                PolyCollection(list(loops), facecolors="none", edgecolors=_other(surface), lw=0.6)
            )
    size = DOT * area / max(float(area.max()), 1e-300)
    own = LOWER if surface.own_below else UPPER
    shade = {"c": 1e6 * gap, "cmap": GAPS, "norm": _gap_scale(gap)} if gap.any() else {"color": own}
    x, y = chart.centres.T
    ax.scatter(x, y, s=size, linewidths=0.3, edgecolors=BLACK, zorder=3, **shade)
    bare(ax, chart)
    carries = surface.sides[0 if surface.own_below else 1] or "one side"
    return [Line2D([], [], color=own, ls="", marker="o", mec=BLACK, label=f"pair, on {carries}")]


def _other(surface: ContactSurface) -> str:
    return UPPER if surface.own_below else LOWER

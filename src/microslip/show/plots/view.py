"""Bodies as one sees them: outside faces, seen along a direction, the far ones drawn first."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.cm import ScalarMappable
from matplotlib.collections import LineCollection, PolyCollection
from matplotlib.colors import Normalize, to_rgb
from matplotlib.figure import Figure

from microslip.model.geometry import Geometry
from microslip.model.mesh.boundary import boundary
from microslip.show.plots.charts import MILLI, loop_of
from microslip.show.plots.solid import Camera, by_pyvista, picture_of
from microslip.show.plots.style import MM
from microslip.typing import Array, Indices

FILLS = ("#9fd0ee", "#f0e3c0", "#c9e4c5", "#e6cfe0", "#f4c9a8", "#d9d9d9")
"""Colours of the bodies."""

DOTS = ("#4d9ac9", "#dba04a", "#6fae68", "#b07aa8", "#d98a4f", "#8c8c8c")
"""The same of nodes without elements."""

TOWARD = (0.42, -0.78, 0.52)
"""From where a structure is seen: along its length, across it, and across its interface."""

LIGHT = 0.62
"""Brightness of a face that looks away from the light."""

SHARP = 0.85
"""Cosine between faces below which the edge between them is drawn."""

NODES = 4.0
"""Size of the dot of a node, points."""


@dataclass(frozen=True)
class View:
    """A direction of sight.

    Attributes
    ----------
    right, up, toward : (d,) arrays
        Unit vectors of the picture, and towards who looks; zero in the plane.
    """

    right: Array
    up: Array
    toward: Array

    def flat(self, x: Array) -> Array:
        """(..., 2) places in the picture, mm, of points (..., d) in m."""
        return np.asarray(MILLI * np.stack([x @ self.right, x @ self.up], axis=-1))

    def depth(self, x: Array) -> Array:
        """How near points (..., d) are."""
        return np.asarray(x @ self.toward)


def view_of(geometry: Geometry) -> View:
    """The plane itself; in space from above the interface, along its longest extent."""
    if geometry.dimension == 2:
        return View(np.array([1.0, 0.0]), np.array([0.0, 1.0]), np.zeros(2))
    normals = np.vstack([each.normal for each in geometry.surfaces] or [np.eye(3)[2:]])
    above = int(np.argmax(np.abs(normals.mean(axis=0))))
    extent = np.ptp(geometry.points, axis=0)
    extent[above] = -1.0
    long = int(np.argmax(extent))
    e1, e3 = np.eye(3)[long], np.eye(3)[above]
    toward = np.array([TOWARD]) @ np.stack([e1, np.cross(e3, e1), e3])
    toward = toward[0] / np.linalg.norm(toward)
    right = np.cross(e3, toward)
    right /= np.linalg.norm(right)
    return View(right, np.cross(toward, right), toward)


@dataclass(frozen=True)
class Skin:
    """Outside faces of bodies in space, or elements in the plane.

    Attributes
    ----------
    loops : tuple of (f, k) int arrays
        Nodes around the faces.
    body : tuple of (f,) int arrays
    outward : tuple of (f, d) arrays
        Unit normals; towards who looks in the plane.
    edges : (e, k) int array
        Ends of the edges between faces that meet at an angle.
    """

    loops: tuple[Indices, ...]
    body: tuple[Indices, ...]
    outward: tuple[Array, ...]
    edges: Indices


def fitted(figure: Figure, axes: Sequence[Axes], columns: int, room: float = 0.0) -> None:
    """Give a figure the height that its pictures need.

    Parameters
    ----------
    figure : Figure
    axes : sequence of Axes
        Of equal scales, row by row.
    columns : int
    room : float
        Width that stands beside them, mm.
    """
    wide = (figure.get_figwidth() / MM - 8.0 - room) / columns
    shape = max(float(np.ptp(ax.get_ylim()) / np.ptp(ax.get_xlim())) for ax in axes)
    rows = -(-len(axes) // columns)
    tall = min(wide * shape, MOST_HEIGHT / rows)
    figure.set_figheight((rows * (tall + 7.0) + 12.0) * MM)


MOST_HEIGHT = 200.0
"""Of all pictures of a figure, mm."""


def columns_of(geometry: Geometry, view: View, count: int) -> int:
    """One column for long structures, two for others."""
    wide, tall = np.ptp(view.flat(geometry.points), axis=0)
    return min(count, 1 if wide > LONG * tall else 2)


LONG = 2.2
"""Width over height of a picture that takes a row of its own."""


def skin_of(geometry: Geometry) -> Skin:
    """Outside faces of a geometry's elements; none where only nodes are known."""
    x = geometry.points
    if geometry.dimension == 2 or not geometry.blocks:
        loops = tuple(block.nodes[:, loop_of(block.kind)] for block in geometry.blocks)
        body = tuple(geometry.body[nodes[:, 0]] for nodes in loops)
        return Skin(loops, body, tuple(np.zeros((len(n), 2)) for n in loops), _rim(geometry))
    surface, _ = boundary(geometry.blocks)
    starts = np.cumsum([0, *(block.count for block in geometry.blocks)])
    loops_of, bodies, normals = [], [], []
    for block, start in zip(geometry.blocks, starts, strict=False):
        own = (surface.elements >= start) & (surface.elements < start + block.count)
        for face, (kind, local) in enumerate(block.type.faces):
            at = surface.elements[own & (surface.faces == face)] - start
            if not len(at):
                continue
            nodes = block.nodes[at][:, list(local)]
            corners = x[nodes[:, : 3 if kind.startswith("tri") else 4]]
            across = np.cross(corners[:, 2] - corners[:, 0], corners[:, -1] - corners[:, 1])
            if corners.shape[1] == 3:
                across = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
            across /= np.maximum(np.linalg.norm(across, axis=1, keepdims=True), 1e-300)
            inside = x[block.nodes[at]].mean(axis=1) - corners.mean(axis=1)
            across *= np.where((across * inside).sum(axis=1, keepdims=True) > 0, -1.0, 1.0)
            loops_of.append(nodes[:, loop_of(kind)])
            bodies.append(geometry.body[nodes[:, 0]])
            normals.append(across)
    return Skin(tuple(loops_of), tuple(bodies), tuple(normals), _sharp(loops_of, normals))


def _rim(geometry: Geometry) -> Indices:
    """Edges on the outside of plane bodies."""
    corners = boundary(geometry.blocks)[1] if geometry.blocks else np.zeros((0, 4), np.int64)
    return np.asarray(corners[:, -2:])


def _sharp(loops: list[Indices], normals: list[Array]) -> Indices:
    """Edges whose two faces meet at an angle."""
    ends, faces = [], []
    count = 0
    for nodes in loops:
        k = nodes.shape[1]
        for i in range(k):
            ends.append(np.sort(np.stack([nodes[:, i], nodes[:, (i + 1) % k]], axis=1), axis=1))
            faces.append(count + np.arange(len(nodes)))
        count += len(nodes)
    if not ends:
        return np.zeros((0, 2), np.int64)
    pairs, of = np.vstack(ends), np.concatenate(faces)
    normal = np.vstack(normals)
    order = np.lexsort(pairs.T)
    pairs, of = pairs[order], of[order]
    same = (pairs[1:] == pairs[:-1]).all(axis=1)
    smooth = np.einsum("ed,ed->e", normal[of[1:]], normal[of[:-1]]) > SHARP
    drop = np.zeros(len(pairs), bool)
    drop[1:] |= same  # once
    drop[:-1] |= same & smooth
    drop[1:] |= same & smooth
    return np.asarray(pairs[~drop])


def draw_skin(
    ax: Axes,
    geometry: Geometry,
    skin: Skin,
    view: View,
    *,
    moved: Array | None = None,
    values: Array | None = None,
    norm: Normalize | None = None,
    colours: str = "viridis",
    mesh: bool = True,
    fade: float = 1.0,
    rest: bool = False,
) -> ScalarMappable | None:
    """Bodies in their colours, or in those of values at the nodes; None where nothing has a scale.

    Parameters
    ----------
    ax : Axes
    geometry : Geometry
    skin : Skin
    view : View
    moved : (n, d) array, optional
        Places of the points, where they have moved.
    values : (n,) array, optional
        Colours of the faces by the mean of their nodes.
    norm : Normalize, optional
        Of the values.
    colours : str
        Of the values.
    mesh : bool
        Whether to draw the edges of all faces.
    fade : float
        Opacity.
    rest : bool
        Whether to draw their edges where they were before they moved; PyVista hides those behind the bodies.
    """
    x = geometry.points if moved is None else moved
    if skin.loops and geometry.dimension == 3 and fade == 1 and by_pyvista():
        at_rest = MILLI * geometry.points if rest else None
        return _solid(ax, x, skin, view, values, norm, colours, mesh, at_rest)
    if rest:
        draw_edges(ax, geometry, skin, view, "#00000045")
    polygons: list[Array] = []
    depth, shade, colour, mean = [], [], [], []
    light = view.toward + 0.6 * view.up
    light = light / (np.linalg.norm(light) or 1.0)
    for nodes, body, outward in zip(skin.loops, skin.body, skin.outward, strict=True):
        seen = np.flatnonzero(outward @ view.toward > 0) if view.toward.any() else slice(None)
        here = x[nodes[seen]]
        polygons += list(view.flat(here))
        depth.append(view.depth(here.mean(axis=1)))
        lit = np.clip(outward[seen] @ light, 0, 1) if view.toward.any() else np.ones(len(here))
        shade.append(LIGHT + (1 - LIGHT) * lit)
        colour.append(np.array([to_rgb(FILLS[b % len(FILLS)]) for b in body[seen]]).reshape(-1, 3))
        if values is not None:
            mean.append(values[nodes[seen]].mean(axis=1))
    if not polygons:
        return _dots(ax, geometry, x, view, values, norm, colours)
    order = np.argsort(np.concatenate(depth), kind="stable")
    edge = "#40404060" if mesh else "face"
    shown = PolyCollection(
        [polygons[k] for k in order],
        linewidths=0.15 if mesh else 0.2,
        rasterized=len(polygons) > 500,
        alpha=fade if fade < 1 else None,
    )
    if values is None:
        shown.set_facecolor(list((np.vstack(colour) * np.concatenate(shade)[:, None])[order]))
    else:
        shown.set_array(np.concatenate(mean)[order])
        shown.set_cmap(colours)
        shown.set_norm(norm or Normalize())
    shown.set_edgecolor(edge)
    ax.add_collection(shown)
    return shown if values is not None else None


def _solid(
    ax: Axes,
    x: Array,
    skin: Skin,
    view: View,
    values: Array | None,
    norm: Normalize | None,
    colours: str,
    mesh: bool,
    at_rest: Array | None,
) -> ScalarMappable | None:
    """Bodies in space by PyVista."""
    fills = [np.array([to_rgb(FILLS[b % len(FILLS)]) for b in body]) for body in skin.body]
    norm = norm or Normalize()
    picture = picture_of(
        MILLI * x,
        skin.loops,
        skin.edges,
        Camera(view.right, view.up, view.toward),
        fills,
        1 - LIGHT,
        values,
        norm,
        colours,
        mesh,
        at_rest,
    )
    ax.imshow(picture.pixels, extent=picture.extent, zorder=1, interpolation="antialiased")
    if values is None:
        return None
    shown = ScalarMappable(norm, colours)
    shown.set_array(values)
    return shown


def _dots(
    ax: Axes,
    geometry: Geometry,
    x: Array,
    view: View,
    values: Array | None,
    norm: Normalize | None,
    colours: str,
) -> ScalarMappable | None:
    """Nodes, where no elements are known."""
    flat = view.flat(x)
    if values is not None:
        return ax.scatter(flat[:, 0], flat[:, 1], s=NODES**2, c=values, norm=norm, cmap=colours)
    for body in np.unique(geometry.body):
        own = flat[geometry.body == body]
        ax.plot(own[:, 0], own[:, 1], ".", color=DOTS[body % len(DOTS)], ms=NODES, mew=0)
    return None


def draw_edges(
    ax: Axes, geometry: Geometry, skin: Skin, view: View, colour: str = "#00000070"
) -> None:
    """Edges of the bodies where they are, also those behind."""
    ends = view.flat(geometry.points[skin.edges])
    ax.add_collection(
        LineCollection(
            list(ends), colors=colour, linewidths=0.5, zorder=3, rasterized=len(ends) > 2000
        )
    )


def frame(ax: Axes, flat: Array, margin: float = 0.06) -> None:
    """Equal scales and limits around places (n, 2) of the picture, and no axes."""
    low, high = flat.min(axis=0), flat.max(axis=0)
    around = margin * float((high - low).max())
    ax.set_xlim(low[0] - around, high[0] + around)
    ax.set_ylim(low[1] - around, high[1] + around)
    ax.set_aspect("equal")
    ax.set_axis_off()


def same_frame(axes: Sequence[Axes]) -> None:
    """Give pictures of one structure the limits of all of them, so that they stand at one height."""
    across, along = (np.array([get(ax) for ax in axes]) for get in (Axes.get_xlim, Axes.get_ylim))
    for ax in axes:
        ax.set_xlim(across[:, 0].min(), across[:, 1].max())
        ax.set_ylim(along[:, 0].min(), along[:, 1].max())


TRIAD = 14.0
"""Length of a direction, points."""


ROOM = 0.08
"""Height below a plane structure for them, over the width of the picture."""


def draw_triad(ax: Axes, geometry: Geometry, view: View) -> None:
    """Directions of the coordinates in the lower left corner, below plane structures; of one size in pictures
    of any size."""
    d = geometry.dimension
    across, along = ax.get_xlim(), ax.get_ylim()
    if d == 2:
        ax.set_ylim(along[0] - ROOM * (across[1] - across[0]), along[1])
    ways = view.flat(np.eye(d)) / MILLI * TRIAD
    start = 0.4 * TRIAD - 1.6 * np.minimum(ways.min(axis=0), 0.0)
    for name, way in zip("xyz", ways, strict=False):
        arrow = {"arrowstyle": "-|>", "lw": 0.7, "mutation_scale": 6, "shrinkA": 0, "shrinkB": 0}
        corner: dict[str, Any] = {"xycoords": "axes points", "annotation_clip": False}
        ax.annotate(
            "",
            tuple(start + way),
            tuple(start),
            textcoords="axes points",
            arrowprops={**arrow, "fc": "k"},
            **corner,
        )
        at = start + way * (1 + 6.0 / max(float(np.linalg.norm(way)), 1.0))
        ax.annotate(name, tuple(at), ha="center", va="center", fontsize=8, **corner)

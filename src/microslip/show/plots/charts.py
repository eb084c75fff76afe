"""Interfaces laid flat: the part of each that a contact pair stands for, in millimetres.

A flat interface is seen from its upper side. A curved one is unrolled where all its normals lie in one plane
and it is part of a circular cylinder, else projected on its mean plane, which is said beside the axes.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cache

import numpy as np
from matplotlib.axes import Axes

from microslip.model.geometry import ContactSurface
from microslip.model.mesh.element_types import element_type
from microslip.typing import Array, Indices

MILLI = 1e3
"""Millimetres per metre."""

FLAT = 0.02
"""Largest distance of normals from their mean of an interface that counts as flat."""

ROUND = 0.02
"""Largest distance from a circular cylinder, over its radius."""

LETTERS = "xyz"


@dataclass(frozen=True)
class Chart:
    """A flat picture of an interface.

    Attributes
    ----------
    cells : tuple of (k, 2) arrays
        Corners of the parts, mm.
    pair : (c,) int array
        Which pair of the interface each part belongs to; -1 where there is none.
    outlines : tuple of (k, 2) arrays
        Facets of the mesh.
    centres : (m, 2) array
        Pairs.
    basis : (m, 2, 3) array
        Directions of both axes at each pair.
    labels : (str, str)
        Of the axes.
    said : str
        How a curved interface was laid flat, where axes do not say it.
    """

    cells: tuple[Array, ...]
    pair: Indices
    outlines: tuple[Array, ...]
    centres: Array
    basis: Array
    labels: tuple[str, str]
    said: str = ""

    def flat(self, vectors: Array) -> Array:
        """(..., m, 2) components along the axes of vectors (..., m, 3)."""
        return np.asarray(np.einsum("mkd,...md->...mk", self.basis, vectors))

    def flat_points(self, points: Array) -> Array:
        """(..., 2) places, mm, of points (..., 3) on a flat interface."""
        return np.asarray(MILLI * points @ self.basis[0].T)

    @property
    def extent(self) -> Array:
        """(2,) width and height, mm."""
        every = np.vstack([self.centres, *self.cells])
        return np.asarray(np.ptp(every, axis=0))

    @property
    def margins(self) -> Array:
        """(2,) room around it for arrows, mm."""
        extent = self.extent
        return np.minimum(ROOM * max(float(extent.max()), 1e-9), EDGE * np.maximum(extent, 1e-9))


ROOM, EDGE = 0.08, 0.15
"""Room around an interface, over its larger extent, and at most over its extent that way."""


def chart_of(surface: ContactSurface, points: Array) -> Chart:
    """The interface laid flat.

    Parameters
    ----------
    surface : ContactSurface
        In space.
    points : (n, 3) array
        Of the geometry.
    """
    cells, pair, outlines = cells_of(surface, points)
    mean = surface.normal.mean(axis=0)
    mean /= np.linalg.norm(mean) or 1.0
    apart = float(np.linalg.norm(surface.normal - mean, axis=1).max())
    if apart > FLAT:
        found = _unrolled(surface, cells, pair, outlines)
        if found is not None:
            return found
    along = surface.tangents[:, 0].mean(axis=0)
    along -= (along @ mean) * mean
    length = np.linalg.norm(along)
    first = along / length if length > FLAT else _across(mean)
    axes = np.stack([first, np.cross(mean, first)])
    basis = np.tile(axes, (len(surface.points), 1, 1))
    return Chart(
        cells=tuple(MILLI * cell @ axes.T for cell in cells),
        pair=pair,
        outlines=tuple(MILLI * line @ axes.T for line in outlines),
        centres=MILLI * surface.points @ axes.T,
        basis=basis,
        labels=(_named(axes[0]), _named(axes[1])),
        said="projected on its mean plane" if apart > FLAT else "",
    )


def _across(normal: Array) -> Array:
    """A unit vector across another one."""
    axis = np.eye(3)[int(np.argmin(np.abs(normal)))]
    found = axis - (axis @ normal) * normal
    return np.asarray(found / np.linalg.norm(found))


def _named(direction: Array) -> str:
    """What an axis is called: the coordinate where it is along one, else its direction."""
    k = int(np.argmax(np.abs(direction)))
    if abs(direction[k]) > 1 - 1e-6:
        return f"{'−' if direction[k] < 0 else ''}{LETTERS[k]} (mm)"
    parts = ", ".join(f"{x + 0.0:.2f}" for x in np.round(direction, 2))
    return f"along ({parts}) (mm)"


def _unrolled(
    surface: ContactSurface, cells: tuple[Array, ...], pair: Indices, outlines: tuple[Array, ...]
) -> Chart | None:
    """Of part of a circular cylinder; None where it is none."""
    _, size, directions = np.linalg.svd(surface.normal, full_matrices=False)
    if size[2] > ROUND * size[0]:
        return None
    axis = directions[2] * (1.0 if directions[2][int(np.argmax(np.abs(directions[2])))] > 0 else -1)
    first = _across(axis)
    plane = np.stack([first, np.cross(axis, first)])
    flat = surface.points @ plane.T
    # circle through all: |x|² = 2 c x + (r² - c²)
    fit = np.linalg.lstsq(np.c_[2 * flat, np.ones(len(flat))], (flat**2).sum(axis=1), rcond=None)[0]
    centre = fit[:2]
    radius = float(np.sqrt(fit[2] + centre @ centre))
    if np.abs(np.linalg.norm(flat - centre, axis=1) - radius).max() > ROUND * radius:
        return None
    middle = flat.mean(axis=0) - centre
    start = float(np.arctan2(middle[1], middle[0]))

    def angle(x: Array) -> Array:
        arm = x @ plane.T - centre
        return np.asarray(
            np.mod(np.arctan2(arm[:, 1], arm[:, 0]) - start + np.pi, 2 * np.pi) - np.pi
        )

    def laid(x: Array) -> Array:
        turned = angle(x)
        if np.ptp(turned) > np.pi:  # across the cut
            turned = np.where(turned < 0, turned + 2 * np.pi, turned)
        return MILLI * np.column_stack([radius * turned, x @ axis])

    turned = angle(surface.points)
    way = start + turned
    hoop = -np.sin(way)[:, None] * plane[0] + np.cos(way)[:, None] * plane[1]
    centres = MILLI * np.column_stack([radius * turned, surface.points @ axis])
    return Chart(
        cells=tuple(laid(cell) for cell in cells),
        pair=pair,
        outlines=tuple(laid(line) for line in outlines),
        centres=centres,
        basis=np.stack([hoop, np.tile(axis, (len(hoop), 1))], axis=1),
        labels=(f"along the circumference, radius {MILLI * radius:.4g} mm (mm)", _named(axis)),
    )


def cells_of(
    surface: ContactSurface, points: Array
) -> tuple[tuple[Array, ...], Indices, tuple[Array, ...]]:
    """Parts of the facets that lie nearest to each node, their pairs, and the facets.

    Facets without any pair, as of a surface that is longer than what it meets, are left out. Where no mesh
    has facets, squares of equal size at the pairs.
    """
    if not surface.facets:
        return (), np.zeros(0, dtype=np.int64), ()
    number = np.full(len(points), -1)
    number[surface.nodes] = np.arange(len(surface.nodes))
    cells: list[Array] = []
    pair: list[Array] = []
    outlines: list[Array] = []
    for group in surface.facets:
        nodes = group.nodes[(number[group.nodes] >= 0).any(axis=1)]
        corners = points[nodes]
        for k, cell in enumerate(reference_cells(group.kind)):
            here = np.einsum("qk,fkd->fqd", group.type.shapes(cell), corners)
            cells += list(here)
            pair.append(number[nodes[:, k]])
        loop = loop_of(group.kind)
        outlines += list(corners[:, loop])
    return tuple(cells), np.concatenate(pair), tuple(outlines)


@cache
def loop_of(kind: str) -> tuple[int, ...]:
    """Nodes of a facet around its edge: corners, and between them the middles of sides."""
    shape = element_type(kind)
    if shape.order == 1:
        return tuple(range(shape.corners))
    return tuple(n for k in range(shape.corners) for n in (k, shape.corners + k))


@cache
def reference_cells(kind: str) -> tuple[Array, ...]:
    """Parts of a reference facet that lie nearest to each of its nodes: corners of each, (k, 2).

    Triangles are taken equilateral, so that all their corners are alike.

    Examples
    --------
    >>> [len(cell) for cell in reference_cells("quad4")]
    [4, 4, 4, 4]
    >>> (reference_cells("tri3")[0].round(3) + 0.0).tolist()
    [[0.0, 0.0], [0.5, 0.0], [0.333, 0.333], [0.0, 0.5]]
    """
    shape = element_type(kind)
    even = np.array([[1.0, 0.0], [0.5, np.sqrt(0.75)]]) if shape.family == "tri" else np.eye(2)
    nodes = shape.nodes @ even
    out = []
    for own in nodes:
        cell = nodes[: shape.corners]
        for other in nodes:
            if other is not own and np.abs(other - own).max() > 0:
                cell = _nearer(cell, own, other)
        at = int(np.argmin(np.linalg.norm(cell - own, axis=1)))
        out.append(np.roll(cell, -at, axis=0) @ np.linalg.inv(even))
    return tuple(out)


def _nearer(polygon: Array, own: Array, other: Array) -> Array:
    """Part of a convex polygon that lies nearer to one point than to another."""
    way = other - own
    beyond = polygon @ way - 0.5 * (other + own) @ way
    kept = []
    for k, (x, d) in enumerate(zip(polygon, beyond, strict=True)):
        y, e = polygon[k - 1], beyond[k - 1]
        if d * e < 0:
            kept.append(y + (x - y) * e / (e - d))
        if d <= 0:
            kept.append(x)
    return np.array(kept)


def bare(ax: Axes, chart: Chart) -> None:
    """Equal scales, limits and labels of axes that show an interface."""
    ax.set_aspect("equal")
    every = np.vstack([chart.centres, *chart.cells])
    low, high = every.min(axis=0), every.max(axis=0)
    across, along = chart.margins
    ax.set_xlim(low[0] - across, high[0] + across)
    ax.set_ylim(low[1] - along, high[1] + along)
    ax.grid(False)
    ax.set_xlabel(chart.labels[0])
    ax.set_ylabel(chart.labels[1])

"""Distances of curved surfaces that fit each other, without what their facets are off.

Facets with straight sides lie up to ``L² / (8 R)`` off the curve of radius R that their nodes are on. Where
the nodes of both sides do not match, that much distance comes and goes along a fit that has none, easily more
than what a press fit is pressed by. From the normals n_a at the nodes x_a of a facet with shape functions N_a
the curve lies outside of it, at the point x, by

    -1/2 sum_a N_a n_a · (x - x_a),

to second order for any facet (half of what the tangent planes at its nodes lie outside), which is nothing
where a curved facet lies on it already. What is off is taken away where the distance is much more even
without it: of surfaces that fit. What is left of a distance that was little else is none.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from microslip.model.mesh.element_types import element_type
from microslip.model.mesh.facets import FacetGroup, Facets, nodal_normals
from microslip.model.mortar.segments import NOTHING, Segments
from microslip.typing import Array, Indices, Mask

EVEN = 0.5
"""Range of distances without what facets are off, over that with it, up to which surfaces fit."""

LEFT = 0.1
"""Of the most that facets are off: distances that are smaller without it are none."""

ROUNDING = 1e-12
"""Of the coordinates: facets that are less off are flat."""

Found = Sequence[tuple[FacetGroup, Segments]]


def without_facets(own: Facets, other: Facets, found: Found) -> Found:
    """Segments whose distances are those of the curves, where both sides fit each other.

    Parameters
    ----------
    own, other : Facets
        Slave and master.
    found : sequence of (FacetGroup, Segments)
        Of `microslip.model.mortar.segments.segments`.
    """
    normals = curve_normals(own), curve_normals(other)
    off = [
        outside(own, part.slave_kind, part.slave_nodes, part.slave_xi, normals[0])
        + outside(other, part.master_kind, part.master_nodes, part.master_xi, normals[1])
        for _, part in found
    ]
    most = max(float(np.abs(each).max(initial=0.0)) for each in off)
    if most <= ROUNDING * float(np.abs(own.points).max()):
        return found
    gaps = [part.gap - each for (_, part), each in zip(found, off, strict=True)]
    if not _range(gaps) <= EVEN * _range([part.gap for _, part in found]):
        return found
    if max(float(np.abs(gap).max()) for gap in gaps) <= LEFT * most:
        gaps = [np.zeros_like(gap) for gap in gaps]
    return [(g, replace(part, gap=gap)) for (g, part), gap in zip(found, gaps, strict=True)]


def _range(gaps: Sequence[Array]) -> float:
    return max(float(gap.max()) for gap in gaps) - min(float(gap.min()) for gap in gaps)


def outside(surface: Facets, kind: str, nodes: Indices, xi: Array, normals: Array) -> Array:
    """(s, q) distance of the curve outside of facets, along the normals.

    Parameters
    ----------
    surface : Facets
    kind : str
        Type of the facets.
    nodes : (s, k) int array
    xi : (s, q, d - 1) array
        Reference coordinates on them.
    normals : (n, d) array
        Of the curve at the nodes of the surface.

    Examples
    --------
    >>> points = np.array([[-0.1, 0.995], [0.1, 0.995]])
    >>> circle = Facets("chord", points, ())
    >>> nodes, middle = np.array([[0, 1]]), np.zeros((1, 1, 1))
    >>> outside(circle, "line2", nodes, middle, points).round(4)  # of 1 - 0.995
    array([[0.005]])
    """
    if kind == NOTHING:
        return np.zeros(xi.shape[:2])
    N = element_type(kind).shapes(xi)
    x, n = surface.points[nodes], normals[nodes]
    at = np.einsum("sqa,sad->sqd", N, x, optimize=True)
    above = (
        np.einsum("sqd,sad->sqa", at, n, optimize=True) - np.einsum("sad,sad->sa", x, n)[:, None]
    )
    return np.asarray(-0.5 * np.einsum("sqa,sqa->sq", N, above))


def curve_normals(surface: Facets) -> Array:
    """(n, d) unit normals of the curve at the nodes of a surface, zero elsewhere.

    At corners inside the surface the mean of the facets with the weights of Max (Journal of Graphics Tools 4
    (1999) 1), exact on a circle and on a sphere. At the rim, where the facets of one side are missing, the
    normal of the nearest corner inside, mirrored by the plane across the middle of the side between them:
    so the normals of an arc stand to each other. Corners of the rim follow from their neighbours there.
    """
    mean = nodal_normals(surface)
    total = np.zeros_like(mean)
    corners = [group.nodes[:, : group.type.corners] for group in surface.groups]
    for nodes in corners:
        np.add.at(total, nodes, _weighted(surface.points[nodes]))
    inside = _unit(total)
    out = np.where(inside.any(axis=1, keepdims=True), inside, mean)
    sides, rim = _sides_and_rim(corners, len(mean))
    for _ in range(2):
        ends = np.vstack([sides, sides[:, ::-1]])
        ends = ends[rim[ends[:, 0]] & ~rim[ends[:, 1]]]
        way = surface.points[ends[:, 1]] - surface.points[ends[:, 0]]
        length = np.linalg.norm(way, axis=1)
        # the nearest of each corner comes first
        order = np.lexsort((length, ends[:, 0]))
        at, first = np.unique(ends[order, 0], return_index=True)
        chosen = order[first]
        e, n = way[chosen] / length[chosen, None], out[ends[chosen, 1]]
        out[at] = n - 2 * np.einsum("kd,kd->k", n, e)[:, None] * e
        rim = rim.copy()
        rim[at] = False
    return np.asarray(out)


def _unit(x: Array) -> Array:
    length = np.linalg.norm(x, axis=-1, keepdims=True)
    return np.asarray(x / np.where(length > 0, length, 1.0))


def _weighted(x: Array) -> Array:
    """(f, k, d) normals at the corners of facets, times their weights."""
    if x.shape[2] == 2:
        along = x[:, 1] - x[:, 0]
        normal = np.column_stack([along[:, 1], -along[:, 0]]) / (along**2).sum(axis=1)[:, None]
        return np.repeat(normal[:, None], x.shape[1], axis=1)
    ahead, back = np.roll(x, -1, axis=1) - x, np.roll(x, 1, axis=1) - x
    size = (ahead**2).sum(axis=2) * (back**2).sum(axis=2)
    return np.asarray(np.cross(ahead, back) / size[..., None])


def _sides_and_rim(corners: Sequence[Indices], count: int) -> tuple[Indices, Mask]:
    """(s, 2) sides of facets, and which of the nodes are at the rim: of a side that belongs to one facet.

    In the plane, where facets are sides, of one side alone.
    """
    rim = np.zeros(count, dtype=bool)
    if corners[0].shape[1] == 2:
        sides = np.concatenate(corners)
        nodes, times = np.unique(sides, return_counts=True)
        rim[nodes[times == 1]] = True
        return sides, rim
    around = [np.stack([c, np.roll(c, -1, axis=1)], axis=2).reshape(-1, 2) for c in corners]
    sides, times = np.unique(np.sort(np.concatenate(around), axis=1), axis=0, return_counts=True)
    rim[sides[times == 1]] = True
    return sides, rim

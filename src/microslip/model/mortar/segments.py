"""Mortar segments: where facets of two surfaces face each other, and quadrature on what they share.

Each facet is cut into flat simplices. On the plane through the centre of a slave simplex, across its
averaged normal n, slave and master simplices are projected along n and clipped; each shared piece is
a segment (Puso & Laursen, Computer Methods in Applied Mechanics and Engineering 193 (2004) 601).
Its quadrature points are projected back along n onto both true, curved facets,

    T^T (x(xi) - x_p) = 0,   T the tangents of the plane,

by Newton's method, so that flat facets of any shape are mapped exactly.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np
from scipy import spatial

from microslip.brief import Brief
from microslip.errors import ModelError
from microslip.model.mesh.element_types import ElementType, element_type
from microslip.model.mesh.facets import (
    FacetGroup,
    Facets,
    area_vectors,
    is_affine,
    nodal_normals,
    pieces_of,
)
from microslip.model.mortar.clipping import common_intervals, common_triangles, twice_areas
from microslip.typing import Array, Indices

FACING = 0.2
"""Facets face each other where the cosine between their opposed normals is above this."""

CURVED = 19
"""Degree of quadrature where position is not linear in the reference coordinates: the highest there is."""

BEYOND = 0.5
"""Reference coordinate beyond the edge of a facet up to which a projected point is taken."""


NOTHING = "none"
"""Kind of the facets of a side that does not move."""


@dataclass(frozen=True, repr=False)
class Segments(Brief):
    """Quadrature on what facets of two groups share, s segments of q points.

    Attributes
    ----------
    slave_kind, master_kind : str
    slave, master : (s,) int arrays
        Facets in their groups.
    slave_nodes, master_nodes : (s, k) int arrays
    slave_xi, master_xi : (s, q, d - 1) arrays
        Reference coordinates.
    weight : (s, q) array
        Area on the slave surface.
    gap : (s, q) array
        Distance along the slave normal, m; negative where the bodies overlap.
    """

    slave_kind: str
    master_kind: str
    slave: Indices
    master: Indices
    slave_nodes: Indices
    master_nodes: Indices
    slave_xi: Array
    master_xi: Array
    weight: Array
    gap: Array

    @property
    def slave_shapes(self) -> Array:
        """(s, q, k) shape functions of the slave facets."""
        return element_type(self.slave_kind).shapes(self.slave_xi)

    @property
    def master_shapes(self) -> Array:
        """(s, q, k) shape functions of the master facets; k = 0 of a rigid flat."""
        if self.master_kind == NOTHING:
            return np.zeros((*self.weight.shape, 0))
        return element_type(self.master_kind).shapes(self.master_xi)


@dataclass(frozen=True, repr=False)
class _Simplices(Brief):
    """Flat pieces of the facets of a group, (p, d, d) corners, and what they are pieces of."""

    corners: Array
    facet: Indices
    xi: Array

    @property
    def centre(self) -> Array:
        return np.asarray(self.corners.mean(axis=1))

    @property
    def radius(self) -> Array:
        return np.asarray(np.linalg.norm(self.corners - self.centre[:, None], axis=2).max(axis=1))


def segments(
    slave: Facets, master: Facets, reach: float, degree: int | None = None
) -> Iterator[tuple[FacetGroup, Segments]]:
    """Segments of two surfaces, group by group of the slave's.

    Parameters
    ----------
    slave, master : Facets
    reach : float
        Distance up to which facets are coupled, m.
    degree : int, optional
        Of the quadrature on segments. When left out it is exact for facets in which position is linear in
        the reference coordinates, and `CURVED` for others.
    """
    normals = nodal_normals(slave)
    for own in slave.groups:
        for other in master.groups:
            used = degree or _degree(slave, own, master, other)
            found = _segments(slave, own, master, other, normals, reach, used)
            if found is not None:
                yield own, found


def _degree(slave: Facets, own: FacetGroup, master: Facets, other: FacetGroup) -> int:
    affine = is_affine(slave.points[own.nodes], own.type) and is_affine(
        master.points[other.nodes], other.type
    )
    if not affine:
        return CURVED
    return sum(g.type.order * (2 if g.type.family == "quad" else 1) for g in (own, other))


def _segments(
    slave: Facets,
    own: FacetGroup,
    master: Facets,
    other: FacetGroup,
    normals: Array,
    reach: float,
    degree: int,
) -> Segments | None:
    mine, theirs = _simplices(slave, own), _simplices(master, other)
    first, second = _near(mine, theirs, reach)
    normal = _normals_at_centres(own, mine, normals)[first]
    facing = -np.einsum("pd,pd->p", normal, _flat_normals(theirs)[second]) > FACING
    first, second, normal = first[facing], second[facing], normal[facing]
    tangents = tangents_of(normal)
    origin = mine.centre[first]
    shared, pairs = _shared(
        _projected(mine.corners[first], origin, tangents),
        _projected(theirs.corners[second], origin, tangents),
    )
    if not len(pairs):
        return None
    first, second = first[pairs], second[pairs]
    normal, tangents, origin = normal[pairs], tangents[pairs], origin[pairs]
    flat, weight = _quadrature(shared, degree)
    facets = mine.facet[first], theirs.facet[second]
    nodes = own.nodes[facets[0]], other.nodes[facets[1]]
    found, at = [], []
    for shape, part, chosen, surface, side in (
        (own.type, mine, first, slave, nodes[0]),
        (other.type, theirs, second, master, nodes[1]),
    ):
        x = surface.points[side]
        guess = _linear_guess(part, chosen, origin, tangents, flat)
        xi = _onto(x, shape, origin, tangents, flat, guess)
        found.append(xi)
        at.append(np.einsum("sqk,skd->sqd", shape.shapes(xi), x, optimize=True))
    true = area_vectors(slave.points[nodes[0]], own.type, found[0])
    cosine = np.einsum("sqd,sd->sq", true, normal) / np.linalg.norm(true, axis=2)
    gap = np.einsum("sqd,sd->sq", at[1] - at[0], normal)
    good = (np.abs(gap).max(axis=1) <= reach) & (cosine.min(axis=1) > FACING)
    if not good.any():
        return None
    return Segments(
        own.kind,
        other.kind,
        facets[0][good],
        facets[1][good],
        nodes[0][good],
        nodes[1][good],
        found[0][good],
        found[1][good],
        (weight / np.where(cosine > FACING, cosine, 1.0))[good],
        gap[good],
    )


def _simplices(facets: Facets, group: FacetGroup) -> _Simplices:
    pieces = np.array(pieces_of(facets, group))
    corners = facets.points[group.nodes[:, pieces]]
    count, each = corners.shape[:2]
    return _Simplices(
        corners.reshape(count * each, *corners.shape[2:]),
        np.repeat(np.arange(count), each),
        np.tile(group.type.nodes[pieces], (count, 1, 1)),
    )


def _near(mine: _Simplices, theirs: _Simplices, reach: float) -> tuple[Indices, Indices]:
    """Pairs of simplices that may be within reach."""
    tree = spatial.cKDTree(theirs.centre)
    radii = mine.radius + theirs.radius.max() + reach
    lists = tree.query_ball_point(mine.centre, radii)
    first = np.repeat(np.arange(len(lists)), [len(found) for found in lists])
    second = np.array([k for found in lists for k in found], dtype=np.int64)
    if not len(second):
        return first, second
    apart = np.linalg.norm(mine.centre[first] - theirs.centre[second], axis=1)
    near = apart <= mine.radius[first] + theirs.radius[second] + reach
    return first[near], second[near]


def _normals_at_centres(group: FacetGroup, part: _Simplices, normals: Array) -> Array:
    """(p, d) averaged normals at the centres of simplices."""
    shapes = group.type.shapes(part.xi.mean(axis=1))
    out = np.einsum("pk,pkd->pd", shapes, normals[group.nodes[part.facet]])
    return np.asarray(out / np.linalg.norm(out, axis=1, keepdims=True))


def _flat_normals(part: _Simplices) -> Array:
    c = part.corners
    if c.shape[2] == 2:
        along = c[:, 1] - c[:, 0]
        out = np.column_stack([along[:, 1], -along[:, 0]])
    else:
        out = np.cross(c[:, 1] - c[:, 0], c[:, 2] - c[:, 0])
    return np.asarray(out / np.linalg.norm(out, axis=1, keepdims=True))


def tangents_of(normal: Array) -> Array:
    """(p, d - 1, d) orthonormal tangents of (p, d) unit normals.

    In the plane ``t = (n_y, -n_x)``; in space t_1 is the direction of x in the tangent plane, or of y where
    x is nearly normal, and ``t_2 = n × t_1``.

    Examples
    --------
    >>> tangents_of(np.array([[0.0, 1.0]]))[0]
    array([[ 1., -0.]])
    >>> tangents_of(np.array([[0.0, 0.0, 1.0]]))[0]
    array([[1., 0., 0.],
           [0., 1., 0.]])
    """
    if normal.shape[1] == 2:
        return np.stack([normal[:, 1], -normal[:, 0]], axis=1)[:, None]
    axis = np.where(np.abs(normal[:, :1]) < 0.9, [[1.0, 0.0, 0.0]], [[0.0, 1.0, 0.0]])
    first = axis - np.sum(axis * normal, axis=1, keepdims=True) * normal
    first /= np.linalg.norm(first, axis=1, keepdims=True)
    return np.stack([first, np.cross(normal, first)], axis=1)


def _projected(x: Array, origin: Array, tangents: Array) -> Array:
    """(p, k, d - 1) coordinates in the planes of (p, k, d) points."""
    return np.einsum("pkd,ptd->pkt", x - origin[:, None], tangents, optimize=True)


def _shared(first: Array, second: Array) -> tuple[Array, Indices]:
    if first.shape[2] == 1:
        return common_intervals(first[:, :, 0], second[:, :, 0])
    # seen along the slave's normal the master turns the other way; projected simplices may be turned over
    return common_triangles(_turned(first), _turned(second))


def _turned(triangles: Array) -> Array:
    return np.where((twice_areas(triangles) < 0)[:, None, None], triangles[:, ::-1], triangles)


def _quadrature(simplices: Array, degree: int) -> tuple[Array, Array]:
    """Points (s, q, d - 1) and weights (s, q) on simplices in the planes."""
    if simplices.shape[2] == 1:
        xi, w = element_type("line2").quadrature(degree)
        shapes = element_type("line2").shapes(xi)
        size = 0.5 * np.abs(simplices[:, 1, 0] - simplices[:, 0, 0])
    else:
        xi, w = element_type("tri3").quadrature(degree)
        shapes = element_type("tri3").shapes(xi)
        size = twice_areas(simplices)
    return np.einsum("qk,skt->sqt", shapes, simplices), size[:, None] * w


def _linear_guess(
    part: _Simplices, chosen: Indices, origin: Array, tangents: Array, flat: Array
) -> Array:
    """(s, q, d - 1) reference coordinates of points, position taken as linear in each simplex."""
    corners = _projected(part.corners[chosen], origin, tangents)
    xi = part.xi[chosen]
    edges = corners[:, 1:] - corners[:, :1]
    by_edge = np.linalg.solve(np.swapaxes(edges, 1, 2)[:, None], (flat - corners[:, :1])[..., None])
    return np.asarray(xi[:, :1] + by_edge[..., 0] @ (xi[:, 1:] - xi[:, :1]))


def _onto(
    x: Array, shape: ElementType, origin: Array, tangents: Array, flat: Array, guess: Array
) -> Array:
    """Reference coordinates at which facets lie over points of the planes."""
    nodes = _projected(x, origin, tangents)
    size = np.abs(nodes).max()
    xi = guess
    for _ in range(30):
        off = np.einsum("sqk,skt->sqt", shape.shapes(xi), nodes, optimize=True) - flat
        slope = np.einsum("sqkc,skt->sqtc", shape.gradients(xi), nodes, optimize=True)
        step = np.linalg.solve(slope, off[..., None])[..., 0]
        xi = xi - np.clip(step, -BEYOND, BEYOND)
        if np.abs(step).max(initial=0.0) < 1e-13 or np.abs(off).max(initial=0.0) < 1e-16 * size:
            return xi
    if np.abs(off).max() > 1e-9 * size:
        raise ModelError(
            "points of one surface could not be found on the other: facets are strongly curved; use a finer "
            "mesh there"
        )
    return xi

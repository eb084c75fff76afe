"""Faces of elements as surfaces: their nodes seen from outside, normals, areas and flat pieces."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from microslip.brief import Brief
from microslip.errors import ModelError
from microslip.model.mesh.assembly import orientation
from microslip.model.mesh.element_types import ElementType, element_type
from microslip.model.mesh.finite_elements import FiniteElementMesh
from microslip.typing import Array, Indices

STRAIGHT = 1e-6
"""Of the size of a facet: so far off its corners' line or plane a node still lies in it. Files round to as
little as seven digits."""


@dataclass(frozen=True, repr=False)
class FacetGroup(Brief):
    """Facets of one type.

    Attributes
    ----------
    kind : str
        Name of the `ElementType`.
    nodes : (f, k) int array
        Rows of the points of the mesh, counter-clockwise as seen from outside; in the plane from left to
        right as seen from inside the body.
    labels : (f,) int array
        Numbers of their elements in the file.
    """

    kind: str
    nodes: Indices
    labels: Indices

    @property
    def type(self) -> ElementType:
        """Shape of the facets."""
        return element_type(self.kind)


@dataclass(frozen=True, repr=False)
class Facets(Brief):
    """A named surface.

    Attributes
    ----------
    name : str
    points : (n, d) array
        Of the whole mesh.
    groups : tuple of FacetGroup
    """

    name: str
    points: Array
    groups: tuple[FacetGroup, ...]

    @property
    def nodes(self) -> Indices:
        """Rows of the points that lie on the surface, ascending."""
        return np.unique(np.concatenate([group.nodes.ravel() for group in self.groups]))

    @property
    def count(self) -> int:
        """Number of facets."""
        return sum(len(group.nodes) for group in self.groups)

    def areas(self, group: FacetGroup) -> Array:
        """(f,) areas of the facets of a group."""
        xi, weights = group.type.quadrature(6)
        across = area_vectors(self.points[group.nodes], group.type, xi)
        return np.asarray(np.linalg.norm(across, axis=2) @ weights)

    def size(self) -> float:
        """Mean diameter of the facets."""
        return float(np.mean(np.concatenate([self.diameters(group) for group in self.groups])))

    def diameters(self, group: FacetGroup) -> Array:
        """(f,) largest distances between corners."""
        x = self.points[group.nodes[:, : group.type.corners]]
        return np.asarray(np.linalg.norm(x[:, :, None] - x[:, None], axis=3).max(axis=(1, 2)))


def facets_of(mesh: FiniteElementMesh, name: str) -> Facets:
    """Facets of a named surface, seen from outside.

    Raises
    ------
    ModelError
        Where there is no such surface, where it is empty or names a face twice.
    """
    surface = mesh.surface(name)
    keys = np.column_stack([surface.elements, surface.faces])
    _, first, counts = np.unique(keys, axis=0, return_index=True, return_counts=True)
    if (counts > 1).any():
        k = int(first[np.argmax(counts)])
        raise ModelError(
            f"surface {name!r} names face S{surface.faces[k] + 1} of element "
            f"{mesh.element_labels[surface.elements[k]]} twice"
        )
    found: dict[str, list[tuple[Indices, Indices]]] = {}
    for block, start in zip(mesh.blocks, mesh.starts[:-1], strict=True):
        own = (surface.elements >= start) & (surface.elements < start + block.count)
        if not own.any():
            continue
        mirrored = orientation(mesh, block) < 0
        for face, (kind, local) in enumerate(block.type.faces):
            at = surface.elements[own & (surface.faces == face)] - start
            if not len(at):
                continue
            order = _turned(element_type(kind)) if mirrored else slice(None)
            nodes = block.nodes[at][:, list(local)][:, order]
            found.setdefault(kind, []).append((nodes, block.labels[at]))
    groups = tuple(
        FacetGroup(kind, np.vstack([n for n, _ in parts]), np.concatenate([l for _, l in parts]))
        for kind, parts in found.items()
    )
    return Facets(name, mesh.points, groups)


def _turned(shape: ElementType) -> Indices:
    """Order of the nodes of a facet seen from the other side."""
    flip = shape.nodes[:, ::-1] if shape.dimension == 2 else -shape.nodes
    return np.array([int(np.argmin(np.abs(shape.nodes - at).max(axis=1))) for at in flip])


def area_vectors(x: Array, shape: ElementType, xi: Array) -> Array:
    """Outward normals times area per reference area, (f, q, d).

    Parameters
    ----------
    x : (f, k, d) array
        Nodes of the facets.
    shape : ElementType
    xi : (q, d - 1) array, or (f, q, d - 1)
    """
    gradients = shape.gradients(xi)
    tangents = np.einsum(
        "fkd,qkc->fqcd" if xi.ndim == 2 else "fkd,fqkc->fqcd", x, gradients, optimize=True
    )
    return _across(tangents)


def _across(tangents: Array) -> Array:
    if tangents.shape[-2] == 1:
        along = tangents[..., 0, :]
        return np.stack([along[..., 1], -along[..., 0]], axis=-1)
    return np.cross(tangents[..., 0, :], tangents[..., 1, :])


def nodal_normals(facets: Facets) -> Array:
    """(n, d) outward unit normals at the nodes of a surface, zero elsewhere.

    The mean over the facets of a node, each weighted with its area.
    """
    total = np.zeros_like(facets.points)
    for group in facets.groups:
        x, shape = facets.points[group.nodes], group.type
        normal = area_vectors(x, shape, shape.nodes)
        normal /= np.linalg.norm(normal, axis=2, keepdims=True)
        np.add.at(total, group.nodes, normal * facets.areas(group)[:, None, None])
    length = np.linalg.norm(total, axis=1, keepdims=True)
    return np.asarray(total / np.where(length > 0, length, 1.0))


WHOLE = {
    "line": ((0, 1),),
    "tri": ((0, 1, 2),),
    "quad": ((0, 1, 2), (0, 2, 3)),
}
PIECES = {
    "line3": ((0, 2), (2, 1)),
    "tri6": ((0, 3, 5), (3, 1, 4), (5, 4, 2), (3, 4, 5)),
    "quad8": ((0, 4, 7), (4, 1, 5), (5, 2, 6), (6, 3, 7), (4, 5, 6), (4, 6, 7)),
    "quad9": tuple(
        piece
        for a, b, c in ((0, 4, 7), (1, 5, 4), (2, 6, 5), (3, 7, 6))
        for piece in ((a, b, 8), (a, 8, c))
    ),
}
"""Flat pieces of facets whose sides are straight, and of others."""


def pieces_of(facets: Facets, group: FacetGroup) -> tuple[tuple[int, ...], ...]:
    """Simplices between nodes that a facet of a group is cut into to find what it meets."""
    straight = is_straight(facets.points[group.nodes], group.type)
    return (
        WHOLE[group.type.family] if straight else PIECES.get(group.kind, WHOLE[group.type.family])
    )


def is_straight(x: Array, shape: ElementType) -> bool:
    """Whether all facets are flat and have straight sides."""
    size = np.ptp(x, axis=1).max()
    if shape.order == 2:
        sides = x[:, : shape.corners]
        ends = np.roll(sides, -1, axis=1)
        count = shape.corners if shape.corners > 2 else 1
        middle = x[:, shape.corners : shape.corners + count]
        along = (ends - sides)[:, :count]
        along = along / np.linalg.norm(along, axis=2, keepdims=True)
        off = middle - sides[:, :count]
        off = off - np.sum(off * along, axis=2, keepdims=True) * along
        if np.abs(off).max() > STRAIGHT * size:
            return False
    if shape.family == "quad":
        from_first = x[:, 1:] - x[:, :1]
        normal = np.cross(from_first[:, 0], from_first[:, 1])
        normal /= np.linalg.norm(normal, axis=1, keepdims=True)
        if np.abs(np.einsum("fkd,fd->fk", from_first, normal)).max() > STRAIGHT * size:
            return False
    return True


def is_affine(x: Array, shape: ElementType) -> bool:
    """Whether position is linear in the reference coordinates in all facets."""
    tangents = np.einsum("fkd,qkc->fqcd", x, shape.gradients(shape.nodes), optimize=True)
    return bool(np.ptp(tangents, axis=1).max() <= STRAIGHT * np.ptp(x, axis=1).max())

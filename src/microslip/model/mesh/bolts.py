"""Bolts in meshes: a coordinate s by which each is shortened, and what it moves.

In a section through the shank the nodes are doubled, and the two sides overlap by s along the axis n:

    u+ = u- + n s.

Between head and nut, with g the pair of unit forces that draws them together, a rigid bolt has ``g^T u = s``
and one of stiffness k the energy ``k (s - g^T u)² / 2``. s is the first component of a point that no
element has.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
import scipy.sparse as sp
from scipy.sparse.csgraph import connected_components

from microslip.brief import Brief
from microslip.errors import ModelError
from microslip.model.mesh.boundary import all_faces
from microslip.model.mesh.facets import Facets, area_vectors, facets_of
from microslip.model.mesh.finite_elements import Equation, FiniteElementMesh
from microslip.typing import Array, Indices, Mask

FLAT = 1e-6
"""Of its area, what a section may lack as seen along its axis."""


@dataclass(frozen=True, repr=False)
class MeshBolt(Brief):
    """A bolt of a mesh.

    Attributes
    ----------
    name : str
    point : int
        Row of the point whose first component is the shortening s.
    keeps_length : bool
        Whether s is held once it is tightened, or stays free under a constant force.
    pull : (d n,) array, optional
        g of a bolt between two places.
    stiffness : float, optional
        k of a bolt between two places, N/m; None where it is rigid.
    """

    name: str
    point: int
    keeps_length: bool = True
    pull: Array | None = None
    stiffness: float | None = None


def bolt_between(
    mesh: FiniteElementMesh, name: str, pull: Array, stiffness: float | None = None
) -> tuple[FiniteElementMesh, MeshBolt]:
    """A bolt between two places that keeps its length.

    Parameters
    ----------
    mesh : FiniteElementMesh
    name : str
    pull : (d n,) array
        Unit forces on the two places, towards each other.
    stiffness : float, optional
        N/m; rigid where left out.

    Returns
    -------
    FiniteElementMesh
        With one more point, and of a rigid bolt one more equation.
    MeshBolt
    """
    d = mesh.dimension
    used = np.abs(pull).reshape(-1, d).any(axis=1)
    mesh, point = _with_point(mesh, mesh.points[used].mean(axis=0))
    if stiffness is None:
        # the largest term is the one that follows
        order = np.argsort(-np.abs(pull), kind="stable")
        terms = [(int(k) // d, int(k) % d, float(pull[k])) for k in order if pull[k] != 0]
        equation = Equation((*terms, (point, 0, -1.0)))
        mesh = replace(mesh, equations=(*mesh.equations, equation))
    return mesh, MeshBolt(name, point, True, pull, stiffness)


def bolt_through(
    mesh: FiniteElementMesh, name: str, section: str, keeps_length: bool = True
) -> tuple[FiniteElementMesh, MeshBolt]:
    """A bolt that is meshed, cut at a section through its shank.

    Parameters
    ----------
    mesh : FiniteElementMesh
    name : str
    section : str
        Surface of the faces on one side of the cut.
    keeps_length : bool

    Returns
    -------
    FiniteElementMesh
        With the nodes of the section doubled, one more point, and the equations of the cut.
    MeshBolt

    Raises
    ------
    ModelError
        Where the surface is not flat, lies on the outside, or does not cut through.
    """
    facets = facets_of(mesh, section)
    axis, centre = _axis(facets)
    cut = facets.nodes
    beyond = _beyond(mesh, section, cut, axis, centre)
    first = len(mesh.points)
    renamed = np.arange(first)
    renamed[cut] = first + np.arange(len(cut))
    blocks = tuple(
        replace(block, nodes=np.where(far[:, None], renamed[block.nodes], block.nodes))
        for block, far in zip(mesh.blocks, beyond, strict=True)
    )
    mesh = replace(
        mesh,
        points=np.vstack([mesh.points, mesh.points[cut]]),
        node_labels=np.concatenate([mesh.node_labels, mesh.node_labels[cut]]),
        blocks=blocks,
    )
    mesh, point = _with_point(mesh, centre)
    equations = tuple(
        Equation(
            (
                (int(renamed[node]), i, 1.0),
                (int(node), i, -1.0),
                *([(point, 0, float(axis[i]))] if axis[i] != 0 else []),
            )
        )
        for node in cut
        for i in range(mesh.dimension)
    )
    return replace(mesh, equations=(*mesh.equations, *equations)), MeshBolt(
        name, point, keeps_length
    )


def _with_point(mesh: FiniteElementMesh, at: Array) -> tuple[FiniteElementMesh, int]:
    """The mesh with a point that belongs to no element."""
    label = 1 + int(mesh.node_labels.max())
    return replace(
        mesh,
        points=np.vstack([mesh.points, at]),
        node_labels=np.append(mesh.node_labels, label),
    ), len(mesh.points)


def _axis(facets: Facets) -> tuple[Array, Array]:
    """Unit normal of a flat section, out of the elements that it is named by, and its centre."""
    vectors, areas, moments = [], [], []
    for group in facets.groups:
        x = facets.points[group.nodes]
        xi, weights = group.type.quadrature(2 * group.type.order)
        across = area_vectors(x, group.type, xi) * weights[:, None]
        size = np.linalg.norm(across, axis=2)
        vectors.append(across.sum(axis=(0, 1)))
        areas.append(size.sum())
        at = np.einsum("qk,fkd->fqd", group.type.shapes(xi), x)
        moments.append(np.einsum("fq,fqd->d", size, at))
    total, area = np.sum(vectors, axis=0), float(np.sum(areas))
    length = float(np.linalg.norm(total))
    if area - length > FLAT * area:
        raise ModelError(
            f"section {facets.name!r} is not flat, or names faces of both sides of the cut: name those of "
            "the elements on one side of a plane through the shank"
        )
    axis = total / length
    axis[np.abs(axis) < FLAT * FLAT] = 0.0
    return axis / np.linalg.norm(axis), np.sum(moments, axis=0) / area


def _beyond(
    mesh: FiniteElementMesh, section: str, cut: Indices, axis: Array, centre: Array
) -> list[Mask]:
    """Of every block, which elements lie on the other side of a section and touch it.

    Raises
    ------
    ModelError
        Where there are none, or the two sides hang together around the section.
    """
    on = np.zeros(len(mesh.points), dtype=bool)
    on[cut] = True
    near = [on[block.nodes].any(axis=1) for block in mesh.blocks]
    parts = [
        replace(block, nodes=block.nodes[own], labels=block.labels[own])
        for block, own in zip(mesh.blocks, near, strict=True)
    ]
    number = np.concatenate(
        [start + np.flatnonzero(own) for start, own in zip(mesh.starts, near, strict=False)]
    )
    faces, corners = all_faces(parts)
    _, same = np.unique(corners, axis=0, return_inverse=True)
    named = mesh.surface(section)
    keys = {(int(e), int(f)) for e, f in zip(named.elements, named.faces, strict=True)}
    ours = np.array(
        [(int(number[e]), int(f)) in keys for e, f in zip(faces.elements, faces.faces, strict=True)]
    )
    on_cut = np.isin(same.ravel(), same.ravel()[ours])
    theirs = on_cut & ~ours
    if theirs.sum() < ours.sum():
        raise ModelError(
            f"section {section!r} lies on the outside of its body: it must lie inside the bolt, through its "
            "shank"
        )
    graph = sp.coo_matrix(
        (np.ones((~on_cut).sum()), (faces.elements[~on_cut], same.ravel()[~on_cut])),
        shape=(len(number), same.max() + 1),
    )
    _, group = connected_components(graph @ graph.T, directed=False)
    near_side, far_side = (np.unique(group[faces.elements[side]]) for side in (ours, theirs))
    if np.isin(near_side, far_side).any():
        raise ModelError(
            f"section {section!r} does not cut its bolt through: beside it elements of both sides hang "
            "together; name all faces from one side of the shank to the other"
        )
    middle = np.concatenate([mesh.points[part.nodes].mean(axis=1) for part in parts])
    far = (middle - centre) @ axis > 0
    far[np.isin(group, far_side)] = True
    far[np.isin(group, near_side)] = False
    sides = np.split(far, np.cumsum([part.count for part in parts])[:-1])
    out = [np.zeros(block.count, dtype=bool) for block in mesh.blocks]
    for mask, own, side in zip(out, near, sides, strict=True):
        mask[own] = side
    return out


def spring_of(bolts: Sequence[MeshBolt], dimension: int, dofs: int) -> sp.csc_matrix:
    """(n, n) stiffness of the bolts that are springs, of all degrees of freedom."""
    total = sp.csc_matrix((dofs, dofs))
    for bolt in bolts:
        if bolt.stiffness is not None:
            row = sp.csc_matrix(shortened(bolt, dimension, dofs))
            total = total + bolt.stiffness * (row.T @ row)
    return total


def shortened(bolt: MeshBolt, dimension: int, dofs: int) -> Array:
    """(1, n) row of a bolt between two places: ``s - g^T u``, by which it is shorter than it was."""
    assert bolt.pull is not None
    row = np.zeros((1, dofs))
    row[0, : len(bolt.pull)] = -bolt.pull
    row[0, dimension * bolt.point] = 1.0
    return row

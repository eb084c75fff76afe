"""What a structure looks like: its points and elements, what moves them, and its interfaces as surfaces.

Pictures and files for other programs need no more of a joint than this, whatever it was described by.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
import scipy.sparse as sp
from scipy.sparse.csgraph import connected_components

from microslip.brief import Brief
from microslip.model.mesh.facets import FacetGroup, facets_of
from microslip.model.mesh.finite_elements import Block, FiniteElementMesh
from microslip.model.mesh.naming import named_bodies
from microslip.model.meshed import MeshedStructure
from microslip.model.mortar.coupling import MortarCoupling
from microslip.model.mortar.segments import tangents_of
from microslip.model.numbering import Numbering
from microslip.model.pair_table import Pairs
from microslip.model.points import bodies_of
from microslip.model.readers.found import DIRECTIONS
from microslip.model.structure import Structure
from microslip.typing import Array, Indices

AXES = ("x", "y", "z")
"""Directions of degrees of freedom that a table of nodes has coordinates for."""


@dataclass(frozen=True, repr=False)
class ContactSurface(Brief):
    """Contact pairs of one interface, where they are and which way they look.

    Attributes
    ----------
    name : str
    first : int
        Its first pair among those of the joint.
    points : (m, d) array
        Places of the pairs, m.
    normal : (m, d) array
        Unit normals, from the lower to the upper side; nan where they are not known.
    tangents : (m, d - 1, d) array
        Unit vectors of the tangential components; nan likewise.
    nodes : (m,) int array
        Points of the geometry that the pairs stand on; -1 where they stand on none.
    facets : tuple of FacetGroup
        Faces between those points, of the side that carries the pairs; empty where no mesh has any.
    opposite : tuple of FacetGroup
        Faces of the other side.
    sides : tuple of str
        Names of the lower and the upper side, empty where they have none.
    own_below : bool
        Whether the lower side carries the pairs.
    """

    name: str
    first: int
    points: Array
    normal: Array
    tangents: Array
    nodes: Indices
    facets: tuple[FacetGroup, ...] = ()
    opposite: tuple[FacetGroup, ...] = ()
    sides: tuple[str, str] = ("", "")
    own_below: bool = True

    @property
    def pairs(self) -> slice:
        """Its pairs among those of the joint."""
        return slice(self.first, self.first + len(self.points))

    def along(self, components: Array) -> Array:
        """Vectors (..., m, d) in space of tangential components (..., m, d - 1), or (..., m) in the plane."""
        flat = self.tangents.shape[1] == 1 and components.shape[-1] == len(self.points)
        each = components[..., None] if flat else components
        return np.asarray(np.einsum("...mk,mkd->...md", each, self.tangents))


@dataclass(frozen=True, repr=False)
class Geometry(Brief):
    """A structure as pictures need it.

    Attributes
    ----------
    points : (n, d) array
        m, d = 2 or 3.
    labels : (n,) int array
        Numbers of the points in the file, from 1 where it has none.
    body : (n,) int array
        Which body a point belongs to, -1 of none.
    blocks : tuple of Block
        Elements; empty where only nodes are known.
    motion : (d n, dofs) sparse
        Displacements of the points, m, from those of the structure.
    place : (dofs,) int array
        Component ``d k + i`` of point k that each degree of freedom of the structure is, -1 of none.
    surfaces : tuple of ContactSurface
    names : tuple of str
        Of the bodies; empty where they have none.
    """

    points: Array
    labels: Indices
    body: Indices
    blocks: tuple[Block, ...]
    motion: sp.csr_matrix
    place: Indices
    surfaces: tuple[ContactSurface, ...]
    names: tuple[str, ...] = ()

    @property
    def dimension(self) -> int:
        """2 or 3."""
        return self.points.shape[1]

    @property
    def size(self) -> float:
        """Diagonal of the box around it, m."""
        return float(np.linalg.norm(np.ptp(self.points, axis=0)))

    def displacement(self, x: Array) -> Array:
        """(n, d) displacements of the points of one motion (dofs,) of the structure.

        Examples
        --------
        >>> one = Geometry(
        ...     np.zeros((1, 2)), np.array([7]), np.array([0]), (), sp.csr_matrix(np.eye(2)), np.arange(2), ()
        ... )
        >>> one.displacement(np.array([3.0, 4.0]))
        array([[3., 4.]])
        """
        return np.asarray((self.motion @ x).reshape(self.points.shape))

    def forces(self, load: Array) -> Array:
        """(n, d) forces on the points of a load vector (dofs,); what acts on no point is left out."""
        out = np.zeros(self.points.size)
        there = self.place >= 0
        out[self.place[there]] = load[there]
        return out.reshape(self.points.shape)

    @property
    def held(self) -> Array:
        """(n, d): whether a component of a point of an element cannot move."""
        still = np.diff(self.motion.indptr).reshape(self.points.shape) == 0
        return np.asarray(still & (self.body >= 0)[:, None])


def geometry_of_mesh(meshed: MeshedStructure, names: Sequence[str]) -> Geometry:
    """Of a structure from a mesh.

    Parameters
    ----------
    meshed : MeshedStructure
    names : sequence of str
        Of its interfaces.
    """
    mesh, d = meshed.mesh, meshed.mesh.dimension
    motion = meshed.basis.tocsr()[: mesh.points.size]
    motion.eliminate_zeros()
    body = np.full(len(mesh.points), -1)
    for k, nodes in enumerate(mesh.bodies):
        body[nodes] = k
    free = meshed.structure.free
    surfaces, first = [], 0
    for name, coupling in zip(names, meshed.couplings, strict=True):
        surfaces.append(_surface(mesh, coupling, name, first))
        first += coupling.pairs
    return Geometry(
        points=mesh.points,
        labels=np.asarray(mesh.node_labels),
        body=body,
        blocks=mesh.blocks,
        motion=motion,
        place=np.where(free < d * len(mesh.points), free, -1),
        surfaces=tuple(surfaces),
        names=tuple(name for name, _ in named_bodies(mesh)),
    )


def _surface(
    mesh: FiniteElementMesh, coupling: MortarCoupling, name: str, first: int
) -> ContactSurface:
    names = coupling.slave, coupling.master
    own, other = (facets_of(mesh, side).groups if side in mesh.surfaces else () for side in names)
    return ContactSurface(
        name=name,
        first=first,
        points=coupling.points,
        normal=coupling.normal,
        tangents=coupling.tangents,
        nodes=coupling.nodes,
        facets=own,
        opposite=other,
        sides=names if coupling.slave_below else (names[1], names[0]),
        own_below=coupling.slave_below,
    )


def geometry_of_lap(structure: Structure) -> Geometry:
    """Of a structure whose meshes are quadrilaterals with nodes in the middle of their sides."""
    points: list[Array] = []
    body: list[Indices] = []
    blocks: list[Block] = []
    start = 0
    for k, own in enumerate(bodies_of(structure.meshes)):
        mesh = own.mesh
        here = np.vstack([mesh.p.T, mesh.p[:, mesh.facets].mean(axis=1).T])
        nodes = start + np.vstack([mesh.t, mesh.p.shape[1] + mesh.t2f]).T
        labels = 1 + sum(block.count for block in blocks) + np.arange(len(nodes))
        blocks.append(Block("quad8", nodes, labels))
        points.append(here)
        body.append(np.full(len(here), k))
        start += len(here)
    every = np.vstack(points)
    place = np.asarray(structure.free)
    return Geometry(
        points=every,
        labels=1 + np.arange(len(every)),
        body=np.concatenate(body),
        blocks=tuple(blocks),
        motion=_picked(place, every.size),
        place=place,
        surfaces=(_between(structure, every, place),),
    )


def geometry_of_nodes(
    structure: Structure, numbering: Numbering | None, pairs: Pairs, length: float
) -> Geometry | None:
    """Of a structure of matrices whose nodes have coordinates; None where they have none, or where pairs in
    space have no known directions.

    Parameters
    ----------
    structure : Structure
    numbering : Numbering or None
    pairs : Pairs
    length : float
        Unit of length of the matrices and the coordinates, m.
    """
    d = structure.interface.dimension
    places = None if numbering is None else numbering.coordinates(d)
    if numbering is None or places is None or (d == 3 and pairs.normals is None):
        return None
    node = np.array([label[0] for label in numbering.labels])
    labels, at, row = np.unique(node, return_index=True, return_inverse=True)
    points = length * places[at]
    axis = np.full(len(node), -1)
    for k, word in enumerate(AXES[:d]):
        axis[numbering.direction == DIRECTIONS[word]] = k
    place = np.where(axis >= 0, d * row.ravel() + axis, -1)
    _, part = connected_components(structure.stiffness, directed=False)
    return Geometry(
        points=points,
        labels=labels,
        body=np.asarray(part[at]),
        blocks=(),
        motion=length * _picked(place, points.size),
        place=place,
        surfaces=(_between(structure, points, place, pairs.normals, pairs.tangents),),
    )


def _picked(place: Indices, rows: int) -> sp.csr_matrix:
    there = np.flatnonzero(place >= 0)
    shape = (rows, len(place))
    return sp.csr_matrix((np.ones(len(there)), (place[there], there)), shape=shape)


def _between(
    structure: Structure,
    points: Array,
    place: Indices,
    normals: Array | None = None,
    tangents: Array | None = None,
) -> ContactSurface:
    """Pairs where the nodes are that they are between; of horizontal beams where no normals are given and
    there is a mesh."""
    m, d = structure.interface.pairs, structure.interface.dimension
    weights = abs(structure.interface.relative).tocoo()
    there = place[weights.col] >= 0
    pair, node = weights.row[there] // d, place[weights.col[there]] // d
    total = np.zeros((m, d + 1))
    np.add.at(total, pair, weights.data[there][:, None] * np.c_[points[node], np.ones(len(node))])
    with np.errstate(invalid="ignore"):
        middle = total[:, :d] / total[:, d:]
    if normals is None:
        normals = np.tile([0.0, 1.0] if structure.meshes else [np.nan, np.nan], (m, 1))
    if tangents is None:
        tangents = tangents_of(normals)
    return ContactSurface("contact", 0, middle, normals, tangents, np.full(m, -1))

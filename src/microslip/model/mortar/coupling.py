"""Two surfaces coupled by mortar: relative displacement, area and gap of pairs at the slave's nodes.

With the multiplier functions Phi_j of `microslip.model.mortar.multipliers` and the relative displacement of
points that face each other along the slave's normal,

    v_j = 1/A_j ∫ Phi_j (u_s - u_m) dA,   A_j = ∫ Phi_j dA,

so that reactions ``r_j = p A_j`` of a constant pressure p are that pressure's own nodal forces on both sides:
the patch test. Names do not matter: the upper side is where the normal points to, and ``v_n`` closes the
gap, `microslip.contact.pairs`.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
import scipy.sparse as sp

from microslip.brief import Brief
from microslip.errors import ModelError
from microslip.model.interface import Interface
from microslip.model.mesh.facets import FacetGroup, Facets, facets_of, nodal_normals
from microslip.model.mesh.finite_elements import FiniteElementMesh
from microslip.model.mortar.multipliers import multipliers
from microslip.model.mortar.positions import along, arc_length, turns
from microslip.model.mortar.segments import Segments, segments, tangents_of
from microslip.model.mortar.slivers import given_away, shares_met
from microslip.model.mortar.smoothing import without_facets
from microslip.typing import Array, Indices, Mask

REACH = 2.0
"""Surfaces are coupled up to this many facets apart unless said otherwise."""

OVERLAP = 0.05
"""Of the size of a facet: bodies that overlap more are an error unless said otherwise."""

WHOLLY = 0.02
"""A facet is covered wholly where no larger part of it is left."""

TINY = 1e-10
"""Of the mean: pairs with less area are left out."""

NOISE = 1e-13
"""Of the area of a pair: weights below are rounding."""

LEVEL = 1e-6
"""A component of the mean normal below this does not say which side is above."""


@dataclass(frozen=True, repr=False)
class MortarCoupling(Brief):
    """Pairs of two surfaces, at nodes of the slave that face the master, in order along the interface.

    Attributes
    ----------
    slave, master : str
        Names of the surfaces.
    nodes : (m,) int array
        Nodes of the slave.
    points : (m, d) array
        Their positions, m.
    normal : (m, d) array
        Unit normals from the lower to the upper side.
    tangents : (m, d - 1, d) array
        Unit tangents.
    position : (m,) array
        Coordinate along the mean first tangent, or where that does not tell pairs apart in the plane length
        along the interface, ascending, m.
    area : (m,) array
        m², or m per metre of width.
    gap : (m,) array
        Initial distance of the sides, negative where they overlap, m.
    slave_weights, master_weights : (m, n) sparse
        Mean displacement of both sides from those of the n points of the mesh; rows have sum one.
    slave_below : bool
        Whether the slave is the lower side.
    covered : float
        Part of the slave surface that faces the master.
    met : float
        Part of the smaller of both surfaces that faces the other; of a rigid flat that of the slave.
    still : (m, d - 1) bool array, optional
        Tangential components without any relative displacement.
    """

    slave: str
    master: str
    nodes: Indices
    points: Array
    normal: Array
    tangents: Array
    position: Array
    area: Array
    gap: Array
    slave_weights: sp.csr_matrix
    master_weights: sp.csr_matrix
    slave_below: bool
    covered: float
    met: float
    still: Mask | None = None

    @property
    def pairs(self) -> int:
        """Number of pairs."""
        return len(self.nodes)

    @property
    def dimension(self) -> int:
        """2 or 3."""
        return self.points.shape[1]

    @property
    def jump(self) -> sp.csr_matrix:
        """(m, n): displacement of the upper side less that of the lower one, for one component."""
        difference = self.master_weights - self.slave_weights
        return (difference if self.slave_below else -difference).tocsr()

    def relative(self) -> sp.csr_matrix:
        """(d m, d n): B of `Interface`, normal and tangential components pair by pair."""
        d, m = self.dimension, self.pairs
        moving = 1.0 if self.still is None else ~self.still[..., None]
        directions = np.concatenate([-self.normal[:, None], moving * self.tangents], axis=1)
        jump = self.jump.tocoo()
        shape = (d * m, d * jump.shape[1])
        rows = (d * jump.row[:, None] + np.arange(d))[:, :, None] + np.zeros(d, dtype=int)
        columns = (d * jump.col[:, None] + np.arange(d))[:, None] + np.zeros((d, 1), dtype=int)
        values = jump.data[:, None, None] * directions[jump.row]
        out = sp.coo_matrix((values.ravel(), (rows.ravel(), columns.ravel())), shape=shape).tocsr()
        out.eliminate_zeros()
        return out

    def interface(self) -> Interface:
        """The pairs as the rest of the program knows them."""
        return Interface(self.position, self.area, self.relative(), self.dimension)


def couple(
    mesh: FiniteElementMesh,
    first: str,
    second: str,
    *,
    slave: str | None = None,
    reach: float | None = None,
    overlap: float | None = None,
    degree: int | None = None,
) -> MortarCoupling:
    """Couple two named surfaces of a mesh; their nodes need not match.

    Parameters
    ----------
    mesh : FiniteElementMesh
    first, second : str
        Names of the surfaces.
    slave : str, optional
        The one that carries the pairs; the finer one when left out.
    reach : float, optional
        Distance up to which they are coupled, m; two facets when left out.
    overlap : float, optional
        Depth to which the bodies may overlap, m; a twentieth of a facet when left out.
    degree : int, optional
        Of the quadrature, see `segments`.

    Raises
    ------
    ModelError
        Where a surface is missing or empty, both share nodes, they never meet, or overlap too far.

    Examples
    --------
    >>> from microslip.model.mesh.finite_elements import Block, Surface
    >>> square = np.array([[0.0, 0.0], [1.0, 0.0], [1.0, 1.0], [0.0, 1.0]])
    >>> block = Block("quad4", np.array([[0, 1, 2, 3], [4, 5, 6, 7]]), np.array([1, 2]))
    >>> top, bottom = (Surface(np.array([e]), np.array([f])) for e, f in ((0, 2), (1, 0)))
    >>> mesh = FiniteElementMesh(
    ...     np.vstack([square, square + [0.0, 1.0]]), np.arange(8), (block,), surfaces={"a": top, "b": bottom}
    ... )
    >>> pairs = couple(mesh, "a", "b")
    >>> pairs.area
    array([0.5, 0.5])
    >>> pairs.relative().toarray()[0].nonzero()[0]  # vertical displacement of nodes 3 and 4
    array([7, 9])
    """
    sides = facets_of(mesh, first), facets_of(mesh, second)
    own, other = _chosen(sides, slave)
    _check_apart(own, other)
    within = reach_of(sides, reach)
    found = list(segments(own, other, within, degree))
    if not found:
        raise ModelError(_never_meet(own, other, within))
    found = list(without_facets(own, other, found))
    allowed = OVERLAP * min(own.size(), other.size()) if overlap is None else overlap
    pairs = coupling_of(own, other.name, found, nodal_normals(own), allowed)
    return replace(pairs, met=pairs.covered * max(_whole(own) / _whole(other), 1.0))


def reach_of(sides: Sequence[Facets], given: float | None) -> float:
    """Distance up to which surfaces are coupled, m: that given, else so many facets."""
    return REACH * max(side.size() for side in sides) if given is None else given


def coupling_of(
    own: Facets,
    master: str,
    found: Sequence[tuple[FacetGroup, Segments]],
    normals: Array,
    overlap: float,
) -> MortarCoupling:
    """Pairs of a slave surface from its segments with another side.

    Parameters
    ----------
    own : Facets
        The slave.
    master : str
        Name of the other side.
    found : sequence of (FacetGroup, Segments)
        Group by group of the slave's facets.
    normals : (n, d) array
        Outward unit normals at the nodes of the slave.
    overlap : float
        Depth to which the sides may overlap, m.

    Raises
    ------
    ModelError
        Where they overlap further.
    """
    sums = _Sums(shares_met(own, found))
    for group in own.groups:
        sums.add(own, group, [s for g, s in found if g is group])
    area, kept = sums.kept()
    normals, points = normals[kept], own.points[kept]
    below = _points_up(normals, points, area)
    up = normals if below else -normals
    tangents = tangents_of(up)
    if turns(tangents):
        position = arc_length(own, kept, tangents)
        order = np.argsort(position, kind="stable")
    else:
        position = along(points, tangents)
        order = _in_order(points, tangents)
    scale = sp.diags(1.0 / area[order])
    gap = (sums.gap[kept] / area)[order]
    deepest = int(np.argmin(gap))
    if gap[deepest] < -overlap:
        at = ", ".join(f"{x:.6g}" for x in points[order][deepest])
        raise ModelError(
            f"{own.name!r} and {master!r} overlap by {-gap[deepest]:.4g} m at ({at}) m; up to "
            f"{overlap:.4g} m is taken for rounding or interference: move the bodies apart, or allow it with "
            "overlap"
        )
    return MortarCoupling(
        slave=own.name,
        master=master,
        nodes=kept[order],
        points=points[order],
        normal=up[order],
        tangents=tangents[order],
        position=position[order],
        area=area[order],
        gap=gap,
        slave_weights=(scale @ sums.matrix(sums.slave, kept[order])).tocsr(),
        master_weights=(scale @ sums.matrix(sums.master, kept[order])).tocsr(),
        slave_below=below,
        covered=sums.covered / _whole(own),
        met=sums.covered / _whole(own),
    )


def _whole(surface: Facets) -> float:
    """Area of a surface."""
    return sum(float(surface.areas(group).sum()) for group in surface.groups)


class _Sums:
    """Integrals over segments: of the multipliers, with the gap, and with the shapes of both sides."""

    def __init__(self, share: Array) -> None:
        self.share = share
        self.area, self.gap, self.covered = np.zeros(len(share)), np.zeros(len(share)), 0.0
        self.slave: list[tuple[Array, Indices, Indices]] = []
        self.master: list[tuple[Array, Indices, Indices]] = []

    def add(self, surface: Facets, group: FacetGroup, parts: list[Segments]) -> None:
        """What the segments of one group of the slave's facets add."""
        k = group.type.size
        moments = np.zeros((len(group.nodes), k, k))
        covered = np.zeros(len(group.nodes))
        for part in parts:
            N = part.slave_shapes
            np.add.at(
                moments,
                part.slave,
                np.einsum("sqa,sqb->sab", part.weight[:, :, None] * N, N, optimize=True),
            )
            np.add.at(covered, part.slave, part.weight.sum(axis=1))
        self.covered += float(covered.sum())
        met = np.flatnonzero(covered)
        whole = np.abs(covered / surface.areas(group) - 1.0) < WHOLLY
        coefficients = np.zeros_like(moments)
        given = given_away(group.type, self.share[group.nodes[met]])
        coefficients[met] = given @ multipliers(group.kind, moments[met], whole[met])
        products = coefficients @ moments
        nodes = group.nodes
        self._put(self.slave, products[met], nodes[met], nodes[met])
        for part in parts:
            weighted = part.weight[:, :, None] * np.einsum(
                "sqb,sab->sqa", part.slave_shapes, coefficients[part.slave], optimize=True
            )
            shared = np.einsum("sqa,sqb->sab", weighted, part.master_shapes, optimize=True)
            self._put(self.master, shared, part.slave_nodes, part.master_nodes)
            np.add.at(self.area, part.slave_nodes, weighted.sum(axis=1))
            np.add.at(self.gap, part.slave_nodes, np.einsum("sqa,sq->sa", weighted, part.gap))

    @staticmethod
    def _put(
        into: list[tuple[Array, Indices, Indices]], values: Array, rows: Indices, columns: Indices
    ) -> None:
        shape = values.shape
        into.append(
            (
                values.ravel(),
                np.broadcast_to(rows[:, :, None], shape).ravel(),
                np.broadcast_to(columns[:, None, :], shape).ravel(),
            )
        )

    def kept(self) -> tuple[Array, Indices]:
        """Areas and nodes of the pairs."""
        met = self.area != 0
        kept = np.flatnonzero(self.area > TINY * np.abs(self.area[met]).mean())
        return self.area[kept], kept

    def matrix(self, entries: list[tuple[Array, Indices, Indices]], kept: Indices) -> sp.csr_matrix:
        """Rows of the kept nodes, free of rounding."""
        n = len(self.area)
        values, rows, columns = (np.concatenate(each) for each in zip(*entries, strict=True))
        out = sp.coo_matrix((values, (rows, columns)), shape=(n, n)).tocsr()[kept]
        limit = np.repeat(NOISE * self.area[kept], np.diff(out.indptr))
        out.data[np.abs(out.data) < limit] = 0.0
        out.eliminate_zeros()
        return out


def _chosen(sides: tuple[Facets, Facets], slave: str | None) -> tuple[Facets, Facets]:
    """Slave and master."""
    names = [side.name for side in sides]
    if slave is not None and slave not in names:
        raise ModelError(f"slave {slave!r} is not one of the two surfaces, {' and '.join(names)}")
    if slave is None:
        slave = names[0] if sides[0].size() <= sides[1].size() * (1 + 1e-9) else names[1]
    return sides if slave == names[0] else (sides[1], sides[0])


def _check_apart(own: Facets, other: Facets) -> None:
    shared = np.intersect1d(own.nodes, other.nodes)
    if len(shared):
        raise ModelError(
            f"surfaces {own.name!r} and {other.name!r} share {len(shared)} nodes: contact and ties are "
            "between bodies with nodes of their own; does the mesh merge coincident nodes?"
        )


def _never_meet(own: Facets, other: Facets, reach: float) -> str:
    a, b = own.points[own.nodes], own.points[other.nodes]
    apart = min(float(np.linalg.norm(b - x, axis=1).min()) for x in a)
    start = f"surfaces {own.name!r} and {other.name!r} never meet"
    mean = [nodal_normals(side)[side.nodes].mean(axis=0) for side in (own, other)]
    if apart <= reach and mean[0] @ mean[1] > 0:
        return (
            f"{start}: both look in the same direction, so one of them is the far side of its body"
        )
    return (
        f"{start}: their nearest nodes are {apart:.4g} m apart, and facets are coupled along their normals "
        f"up to {reach:.4g} m; is this the right surface, and are all lengths in the same unit? reach "
        "couples surfaces farther apart"
    )


def _points_up(normals: Array, points: Array, area: Array) -> bool:
    """Whether a surface looks up in the mean: along y in the plane, z in space; else along x, ...; a closed
    one outwards."""
    mean = area @ normals / area.sum()
    for component in mean[::-1]:
        if abs(component) > LEVEL:
            return bool(component > 0)
    middle = area @ points / area.sum()
    return bool(area @ np.einsum("md,md->m", points - middle, normals) > 0)


def _in_order(points: Array, tangents: Array) -> Indices:
    """Pairs in ascending order along the first tangent, then along the others."""
    mean = tangents.mean(axis=0)
    coordinates = points @ mean.T
    coordinates = np.round(coordinates / (1e-9 * max(np.ptp(coordinates), 1e-300)))
    return np.lexsort(coordinates.T[::-1])

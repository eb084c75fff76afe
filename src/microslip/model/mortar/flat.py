"""A surface against a rigid flat: the mortar coupling with a plane that nothing moves.

The plane ``n · x = offset`` has the body on the side that its unit normal n points to. Pairs are at the nodes
of the surface, with the normal of the plane; their gap is the distance from it, and it has no displacement.
"""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from microslip.errors import ModelError
from microslip.model.mesh.facets import FacetGroup, Facets, area_vectors, facets_of, is_affine
from microslip.model.mesh.finite_elements import FiniteElementMesh
from microslip.model.mortar.coupling import OVERLAP, MortarCoupling, coupling_of, reach_of
from microslip.model.mortar.segments import CURVED, FACING, NOTHING, Segments
from microslip.typing import Array

FLAT = "the rigid flat"
"""What the other side is called."""


def couple_with_flat(
    mesh: FiniteElementMesh,
    surface: str,
    normal: Array,
    offset: float,
    *,
    reach: float | None = None,
    overlap: float | None = None,
) -> MortarCoupling:
    """Couple a named surface of a mesh with a rigid flat.

    Parameters
    ----------
    mesh : FiniteElementMesh
    surface : str
    normal : (d,) array
        Of the flat, towards the body.
    offset : float
        ``n · x`` of its points, m.
    reach : float, optional
        Distance up to which facets are coupled, m; two facets when left out.
    overlap : float, optional
        Depth to which the body may lie in the flat, m; a twentieth of a facet when left out.

    Raises
    ------
    ModelError
        Where the surface is missing, does not face the flat within reach, or lies too deep in it.

    Examples
    --------
    >>> from microslip.model.mesh.finite_elements import Block, Surface
    >>> square = np.array([[0.0, 0.0], [1.0, 0.0], [1.0, 1.0], [0.0, 1.0]])
    >>> block = Block("quad4", np.array([[0, 1, 2, 3]]), np.array([1]))
    >>> bottom = Surface(np.array([0]), np.array([0]))
    >>> mesh = FiniteElementMesh(square, np.arange(4), (block,), surfaces={"bottom": bottom})
    >>> pairs = couple_with_flat(mesh, "bottom", np.array([0.0, 1.0]), -0.25)
    >>> pairs.gap, pairs.area
    (array([0.25, 0.25]), array([0.5, 0.5]))
    """
    n = np.asarray(normal, dtype=float)
    n = n / np.linalg.norm(n)
    own = facets_of(mesh, surface)
    size = own.size()
    within = reach_of([own], reach)
    found = list(faces_of_flat(own, n, offset, within))
    if not found:
        height = own.points[own.nodes] @ n - offset
        raise ModelError(
            f"surface {surface!r} never meets the rigid flat: its nodes are {height.min():.4g} to "
            f"{height.max():.4g} m in front of it, and facets that look against its normal are coupled up to "
            f"{within:.4g} m; is this the right surface, does the normal point to the body, and is the "
            "offset in the right unit? reach couples facets farther away"
        )
    allowed = OVERLAP * size if overlap is None else overlap
    return coupling_of(own, FLAT, found, np.tile(-n, (len(mesh.points), 1)), allowed)


def faces_of_flat(
    own: Facets, normal: Array, offset: float, reach: float
) -> Iterator[tuple[FacetGroup, Segments]]:
    """Whole facets that face the flat within reach, group by group."""
    for group in own.groups:
        x, shape = own.points[group.nodes], group.type
        double = 2 * shape.order * (2 if shape.family == "quad" else 1)
        xi, weights = shape.quadrature(double if is_affine(x, shape) else CURVED)
        across = area_vectors(x, shape, xi)
        size = np.linalg.norm(across, axis=2)
        gap = np.einsum("qk,fkd->fqd", shape.shapes(xi), x) @ normal - offset
        facing = (-across @ normal > FACING * size).all(axis=1)
        good = np.flatnonzero(facing & (np.abs(gap).max(axis=1) <= reach))
        if not len(good):
            continue
        at = np.tile(xi, (len(good), 1, 1))
        yield (
            group,
            Segments(
                slave_kind=group.kind,
                master_kind=NOTHING,
                slave=good,
                master=np.zeros(len(good), dtype=np.int64),
                slave_nodes=group.nodes[good],
                master_nodes=np.zeros((len(good), 0), dtype=np.int64),
                slave_xi=at,
                master_xi=at,
                weight=(size * weights)[good],
                gap=gap[good],
            ),
        )

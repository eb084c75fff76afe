"""Nodes of a slave surface that the other side meets by a sliver only, beyond the edge of the contact.

Such a node has next to no area, but the force with which the edge presses: what it would report as a pressure
has no limit as the sliver narrows. Its multiplier function is given to the nearest node of the facet that is
met well. The sum of all functions stays one, so that an even pressure passes as it is.
"""

from __future__ import annotations

from collections.abc import Iterable

import numpy as np

from microslip.model.mesh.element_types import ElementType
from microslip.model.mesh.facets import FacetGroup, Facets, area_vectors
from microslip.model.mortar.multipliers import positive
from microslip.model.mortar.segments import Segments
from microslip.typing import Array

SLIVER = 0.25
"""Share of a node's function that is met at the end of a facet of which half is: with less, the node is
nearer to the next edge of the mesh than to the contact."""

WELL = 0.5
"""Share with which a node takes the functions of its neighbours."""


def shares_met(own: Facets, found: Iterable[tuple[FacetGroup, Segments]]) -> Array:
    """(n,) share of the functions of all nodes, over the facets that are met, that the other side meets.

    Parameters
    ----------
    own : Facets
        The slave.
    found : iterable of (FacetGroup, Segments)
        Group by group of its facets.
    """
    met, whole = np.zeros(len(own.points)), np.zeros(len(own.points))
    parts = list(found)
    for group in own.groups:
        shape, weights = group.type, positive(group.type)
        covered = np.zeros(len(group.nodes), dtype=bool)
        for part in (s for g, s in parts if g is group):
            covered[part.slave] = True
            own_part = np.einsum("sq,sqa->sa", part.weight, part.slave_shapes) @ weights.T
            np.add.at(met, part.slave_nodes, own_part)
        xi, w = shape.quadrature(6)
        across = np.linalg.norm(area_vectors(own.points[group.nodes], shape, xi), axis=2)
        of_facet = (across * w) @ shape.shapes(xi) @ weights.T
        np.add.at(whole, group.nodes[covered], of_facet[covered])
    return np.divide(met, whole, out=np.zeros_like(met), where=whole > 0)


def given_away(shape: ElementType, share: Array) -> Array:
    """(f, k, k) matrices T: the functions T Phi of facets, without those of nodes met by a sliver only.

    Parameters
    ----------
    shape : ElementType
    share : (f, k) array
        Of `shares_met`, of the nodes of every facet.

    Examples
    --------
    >>> from microslip.model.mesh.element_types import element_type
    >>> given_away(element_type("line2"), np.array([[0.9, 0.1], [0.4, 0.1]])).tolist()
    [[[1.0, 1.0], [0.0, 0.0]], [[1.0, 0.0], [0.0, 1.0]]]
    """
    at = np.array(shape.reference)
    apart = np.linalg.norm(at[:, None] - at[None], axis=2)
    out = np.broadcast_to(np.eye(shape.size), (len(share), shape.size, shape.size)).copy()
    for facet in np.flatnonzero((share < SLIVER).any(axis=1) & (share >= WELL).any(axis=1)):
        takes = np.flatnonzero(share[facet] >= WELL)
        for node in np.flatnonzero(share[facet] < SLIVER):
            near = apart[takes, node] <= apart[takes, node].min() * (1 + 1e-9)
            out[facet, node, node] = 0.0
            out[facet, takes[near], node] = 1.0 / near.sum()
    return out

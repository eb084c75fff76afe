"""Ties: surfaces that do not move against each other, by the same mortar as contact.

``v_j = 0`` in all directions for every pair of `MortarCoupling`. Across a gap g a rigid turn omega would
leave ``omega × g``, and a tie would hold the bodies as a spring to the ground does. The slave's nodes are
therefore moved, within the tolerance, until its mean positions are those of the master,
``W_s x = W_m x``, with the weights of the displacements themselves: then no rigid motion meets
resistance, whatever the shape of the surfaces.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import scipy.sparse as sp
import scipy.sparse.linalg as spla

from microslip.errors import Caution, ModelError
from microslip.model.mesh.constraints import Constraints
from microslip.model.mesh.facets import STRAIGHT, facets_of
from microslip.model.mesh.finite_elements import FiniteElementMesh, Tie
from microslip.model.mortar.coupling import couple

TOLERANCE = 0.1
"""Of the size of a facet: distance up to which surfaces are tied where nothing else is said."""

PARTLY = 0.98
"""A caution says how much of a slave is tied where it is less."""


def tolerance_of(mesh: FiniteElementMesh, tie: Tie) -> float:
    """Distance up to which surfaces are tied, m."""
    if tie.tolerance is not None:
        return tie.tolerance
    return TOLERANCE * max(facets_of(mesh, name).size() for name in (tie.slave, tie.master))


def tied(mesh: FiniteElementMesh, tie: Tie) -> tuple[FiniteElementMesh, Constraints]:
    """The mesh with the slave of a tie moved onto its master, and the constraints of the tie.

    Raises
    ------
    ModelError
        Where the surfaces never meet within the tolerance, overlap beyond it, or lie apart and may not be
        moved.
    """
    tolerance = tolerance_of(mesh, tie)
    try:
        pairs = couple(
            mesh, tie.slave, tie.master, slave=tie.slave, reach=tolerance, overlap=tolerance
        )
    except ModelError as error:
        raise ModelError(f"tie {tie.name!r}: {error}") from error
    jump = (pairs.slave_weights - pairs.master_weights).tocsr()
    own = pairs.slave_weights[:, pairs.nodes].tocsc()
    points = mesh.points.copy()
    moved = spla.splu(own).solve(jump @ mesh.points)
    farthest = float(np.linalg.norm(moved, axis=1).max())
    if not tie.adjust and farthest > STRAIGHT * facets_of(mesh, tie.slave).size():
        raise ModelError(
            f"{tie.said}: ADJUST=NO, and {tie.slave!r} lies {farthest:.4g} m off "
            f"{tie.master!r}: tied across a gap bodies resist turns as if the ground held them. Take "
            "ADJUST=NO out, so that the slave is moved onto the master, or close the gap in the mesh"
        )
    points[pairs.nodes] -= moved
    d = mesh.dimension
    rows = sp.kron(jump, sp.identity(d)).tocsr()
    constraints = Constraints(rows, (d * pairs.nodes[:, None] + np.arange(d)).ravel())
    cautions = mesh.cautions
    if pairs.covered < PARTLY:
        cautions = (
            *cautions,
            Caution(
                "mesh",
                f"tie {tie.name!r}",
                f"only {pairs.covered:.0%} of {tie.slave!r} lie within {tolerance:.3g} m of {tie.master!r}",
                "the rest is left free: is the tolerance right, or are the sides to be exchanged?",
            ),
        )
    return replace(mesh, points=points, cautions=cautions), constraints

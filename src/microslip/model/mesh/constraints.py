"""Linear constraints between degrees of freedom, ``C u = 0``, and the displacements that satisfy them.

A structure keeps the degrees of freedom that constraints leave free: ``u = T y`` with ``C T = 0``, stiffness
``T^T K T``. Each constraint gives up one degree of freedom, its own where it has one.

Reference nodes of couplings have rotations as well; these stand behind the displacements of all
points, as `Rotations` says.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
import scipy.sparse as sp
import scipy.sparse.linalg as spla
from scipy.sparse.csgraph import maximum_bipartite_matching

from microslip.brief import Brief
from microslip.errors import ModelError
from microslip.model.mesh.facets import facets_of
from microslip.model.mesh.finite_elements import Coupling, Equation, FiniteElementMesh
from microslip.model.mesh.loads import traction_load
from microslip.typing import Array, Indices

NOISE = 1e-14
"""Of the largest coefficient: smaller ones are rounding."""

LARGEST = 1e9
"""A displacement that follows others this much larger does so by rounding alone."""


@dataclass(frozen=True, repr=False)
class Constraints(Brief):
    """Rows of C, and the degree of freedom that each gives up.

    Attributes
    ----------
    rows : (c, n) sparse
    own : (c,) int array
    """

    rows: sp.csr_matrix
    own: Indices


def stacked(parts: Sequence[Constraints], dofs: int) -> Constraints:
    """All constraints together; `parts` may have fewer degrees of freedom than `dofs`."""
    wide = [sp.csr_matrix((0, dofs))]
    for part in parts:
        missing = dofs - part.rows.shape[1]
        wide.append(sp.hstack([part.rows, sp.csr_matrix((part.rows.shape[0], missing))]))
    own = [np.zeros(0, dtype=np.int64), *(part.own for part in parts)]
    return Constraints(sp.vstack(wide).tocsr(), np.concatenate(own))


@dataclass(frozen=True, repr=False)
class Rotations(Brief):
    """Degrees of freedom of the rotations of reference nodes: one in the plane, three in space each.

    Attributes
    ----------
    nodes : tuple of int
        Rows of the points.
    first : int
        Number of the first rotation.
    each : int
        Of them per node.
    """

    nodes: tuple[int, ...]
    first: int
    each: int

    def of(self, node: int) -> Indices:
        """Numbers of the rotations of a node."""
        return self.first + self.each * self.nodes.index(node) + np.arange(self.each)

    @property
    def dofs(self) -> int:
        """Degrees of freedom of points and rotations together."""
        return self.first + self.each * len(self.nodes)


def rotations_of(mesh: FiniteElementMesh) -> Rotations:
    """Rotations of the reference nodes of the couplings of a mesh."""
    nodes = tuple(sorted({coupling.reference for coupling in mesh.couplings}))
    return Rotations(nodes, mesh.points.size, 1 if mesh.dimension == 2 else 3)


def constraints_of(mesh: FiniteElementMesh, rotations: Rotations) -> Constraints:
    """Equations and couplings of a mesh."""
    parts = [equation_rows(mesh.equations, mesh.dimension, rotations.dofs)]
    parts += [coupling_rows(mesh, coupling, rotations) for coupling in mesh.couplings]
    return stacked(parts, rotations.dofs)


def equation_rows(equations: Sequence[Equation], dimension: int, dofs: int) -> Constraints:
    """Equations between components of nodes; each gives up that of its first term.

    Examples
    --------
    >>> equation_rows([Equation(((0, 1, 1.0), (2, 1, -1.0)))], 2, 6).rows.toarray()
    array([[ 0.,  1.,  0.,  0.,  0., -1.]])
    """
    out = sp.lil_matrix((len(equations), dofs))
    own = np.zeros(len(equations), dtype=np.int64)
    for k, equation in enumerate(equations):
        for node, component, factor in equation.terms:
            out[k, dimension * node + component] += factor
        own[k] = dimension * equation.terms[0][0] + equation.terms[0][1]
    return Constraints(out.tocsr(), own)


def coupling_rows(mesh: FiniteElementMesh, coupling: Coupling, rotations: Rotations) -> Constraints:
    """A surface coupled with its reference node.

    Kinematic: every node of the surface moves with the reference node as with a rigid body,
    ``u_i = u + theta × (x_i - x)`` in the coupled components. Distributing: the reference node moves with
    the surface in the mean, weighted with area: ``u + theta × (x_i - x)`` fits u_i best.
    """
    d = mesh.dimension
    facets = facets_of(mesh, coupling.surface)
    nodes = facets.nodes
    arms = mesh.points[nodes] - mesh.points[coupling.reference]
    if coupling.radius is not None:
        near = np.linalg.norm(arms, axis=1) <= coupling.radius
        if not near.any():
            raise ModelError(
                f"coupling {coupling.name!r}: no node of surface {coupling.surface!r} lies within the "
                f"influence radius of {coupling.radius:.4g} m of its reference node"
            )
        nodes, arms = nodes[near], arms[near]
    # (k, d, d + rotations): displacement of each node with the reference node
    rigid = np.concatenate([np.tile(np.eye(d), (len(nodes), 1, 1)), spins(arms)], axis=2)
    own = np.concatenate([d * coupling.reference + np.arange(d), rotations.of(coupling.reference)])
    if coupling.kind == "kinematic":
        return _follow(nodes, rigid, own, coupling, rotations.dofs)
    moved = rigid.reshape(-1, rigid.shape[2])
    shares = traction_load(mesh, coupling.surface, np.eye(d)[0]).reshape(-1, d)[nodes, 0]
    weight = np.repeat(np.maximum(shares, 0.0), d)
    gram = moved.T @ (weight[:, None] * moved)
    if np.linalg.cond(gram / np.sqrt(np.outer(gram.diagonal(), gram.diagonal()))) > 1e12:
        raise ModelError(
            f"coupling {coupling.name!r}: the nodes of surface {coupling.surface!r} lie on one line and "
            "have no rotation about it"
        )
    fit = np.linalg.solve(gram, (weight[:, None] * moved).T)
    columns = (d * nodes[:, None] + np.arange(d)).ravel()
    # rotations that are not coupled turn alone
    coupled = [k for k in range(len(own)) if k < d or _turns(k, d) in coupling.components]
    own, fit = own[coupled], fit[coupled]
    count = len(own)
    place = (
        np.concatenate([np.arange(count), np.repeat(np.arange(count), len(columns))]),
        np.concatenate([own, np.tile(columns, count)]),
    )
    values = np.concatenate([np.ones(count), -fit.ravel()])
    return Constraints(sp.coo_matrix((values, place), (count, rotations.dofs)).tocsr(), own)


def _turns(row: int, dimension: int) -> int:
    """Component, as decks count them from 0, of a rotation behind the displacements."""
    return 5 if dimension == 2 else row


def _follow(
    nodes: Indices, rigid: Array, own: Indices, coupling: Coupling, dofs: int
) -> Constraints:
    d = rigid.shape[1]
    kept = [c for c in coupling.components if c < d] or list(range(d))
    rows, columns, values = [], [], []
    for k, component in enumerate(kept):
        at = k * len(nodes) + np.arange(len(nodes))
        rows += [at, np.repeat(at, len(own))]
        columns += [d * nodes + component, np.tile(own, len(nodes))]
        values += [np.ones(len(nodes)), -rigid[:, component].ravel()]
    place = np.concatenate(rows), np.concatenate(columns)
    out = sp.coo_matrix(
        (np.concatenate(values), place), shape=(len(kept) * len(nodes), dofs)
    ).tocsr()
    out.eliminate_zeros()
    return Constraints(out, np.concatenate([d * nodes + component for component in kept]))


def spins(arms: Array) -> Array:
    """(k, d, r) displacements ``theta × a`` of arms a by unit rotations, r = 1 in the plane and 3 in space.

    Examples
    --------
    >>> spins(np.array([[2.0, 0.0]]))[0, :, 0]
    array([-0.,  2.])
    """
    if arms.shape[1] == 2:
        return np.stack([-arms[:, 1], arms[:, 0]], axis=1)[:, :, None]
    return np.stack([np.cross(axis, arms) for axis in np.eye(3)], axis=2)


def free_displacements(constraints: Constraints, fixed: Indices) -> tuple[sp.csc_matrix, Indices]:
    """Basis T of the displacements with ``C T = 0`` and nothing at `fixed`, and what it keeps.

    Parameters
    ----------
    constraints : Constraints
        Of n degrees of freedom.
    fixed : (f,) int array

    Returns
    -------
    (n, k) sparse, (k,) int array
        ``u = T u[kept]``.

    Raises
    ------
    ModelError
        Where constraints say the same twice, or contradict each other.

    Examples
    --------
    >>> twice = Constraints(sp.csr_matrix([[1.0, 0.0, -2.0]]), np.array([0]))
    >>> T, kept = free_displacements(twice, np.array([1]))
    >>> T.toarray().ravel(), kept
    (array([2., 0., 1.]), array([2]))
    """
    n = constraints.rows.shape[1]
    C = _without(constraints.rows, fixed)
    busy = np.diff(C.indptr) > 0
    C, own = C[busy], constraints.own[busy]
    given_up = _given_up(C, np.where(np.isin(own, fixed), -1, own))
    kept = np.setdiff1d(np.arange(n), np.concatenate([given_up, fixed]))
    unit = sp.csr_matrix((np.ones(len(kept)), (kept, np.arange(len(kept)))), (n, len(kept)))
    if not len(given_up):
        return unit.tocsc(), kept
    try:
        factors = spla.splu(C[:, given_up].tocsc())
    except RuntimeError as error:
        raise ModelError(_REPEATED) from error
    rest = C[:, kept].tocsc()
    felt = np.flatnonzero(np.diff(rest.indptr))
    values = factors.solve(-rest[:, felt].toarray())
    values[np.abs(values) < NOISE * np.abs(values).max(initial=0.0)] = 0.0
    if np.abs(values).max(initial=0.0) > LARGEST:
        raise ModelError(_REPEATED)
    i, j = np.nonzero(values)
    follow = sp.csr_matrix((values[i, j], (given_up[i], felt[j])), shape=(n, len(kept)))
    return (unit + follow).tocsc(), kept


def carried(constraints: Constraints, fixed: Indices, kept: Indices, given: Array) -> Array:
    """Displacements with those given at `fixed`, none at `kept`, and what constraints make of both elsewhere.

    Parameters
    ----------
    constraints : Constraints
        Of n degrees of freedom.
    fixed, kept : int arrays
        Of `free_displacements`.
    given : (n,) array
        Zero but at `fixed`.

    Returns
    -------
    (n,) array

    Examples
    --------
    >>> twice = Constraints(sp.csr_matrix([[1.0, 0.0, -2.0]]), np.array([0]))
    >>> carried(twice, np.array([2]), np.array([1]), np.array([0.0, 0.0, 1.0]))
    array([2., 0., 1.])
    """
    out = np.array(given, dtype=float)
    follow = np.setdiff1d(np.arange(len(out)), np.union1d(fixed, kept))
    if len(follow):
        busy = np.diff(_without(constraints.rows, fixed).indptr) > 0
        C = constraints.rows[busy]
        out[follow] = spla.splu(C[:, follow].tocsc()).solve(-np.asarray(C @ out))
    return out


_REPEATED = (
    "constraints (ties, equations, couplings, supports) say the same twice or contradict each other: a "
    "node may be tied, coupled or held once"
)


def _without(matrix: sp.csr_matrix, columns: Indices) -> sp.csr_matrix:
    """A matrix with nothing in some columns."""
    keep = np.ones(matrix.shape[1])
    keep[columns] = 0.0
    out = (matrix @ sp.diags(keep)).tocsr()
    out.eliminate_zeros()
    return out


def _given_up(C: sp.csr_matrix, own: Indices) -> Indices:
    """One degree of freedom for each constraint: its own where it is free, else any, each taken once."""
    own = own.copy()
    _, first = np.unique(own, return_index=True)
    alone = np.zeros(len(own), dtype=bool)
    alone[first] = True
    there = np.array(
        [own[k] in C.indices[C.indptr[k] : C.indptr[k + 1]] for k in range(len(own))], bool
    )
    own[~(alone & there)] = -1
    lost = np.flatnonzero(own < 0)
    if len(lost):
        graph = _without(C[lost], own[own >= 0])
        match = maximum_bipartite_matching(graph, perm_type="column")
        if (match < 0).any():
            raise ModelError(_REPEATED)
        own[lost] = match
    return own

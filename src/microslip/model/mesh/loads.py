"""Load vectors of a mesh: tractions on surfaces, forces and moments on node sets, springs on surfaces.

A load vector is an output as well: ``load @ x`` is the displacement that a unit of it does work on.
"""

from __future__ import annotations

from collections.abc import Callable
from functools import partial

import numpy as np
import scipy.linalg
import scipy.sparse as sp

from microslip.errors import ModelError
from microslip.model.mesh.facets import area_vectors, facets_of
from microslip.model.mesh.finite_elements import FiniteElementMesh
from microslip.typing import Array, Indices

Traction = Callable[[Array, Array], Array]
"""Traction (..., d) in Pa from positions (..., d) in m and outward unit normals (..., d)."""

DEGREE = 8
"""Of the quadrature of tractions."""


def traction_load(mesh: FiniteElementMesh, surface: str, traction: Traction | Array) -> Array:
    """Consistent nodal forces ``∫ N t dA`` of a traction on a surface.

    Parameters
    ----------
    mesh : FiniteElementMesh
    surface : str
    traction : (d,) array or callable
        Pa; ``traction(position, normal)`` where it is not the same everywhere.

    Returns
    -------
    (d n,) array
    """
    facets = facets_of(mesh, surface)
    load = np.zeros_like(mesh.points)
    for group in facets.groups:
        x, shape = mesh.points[group.nodes], group.type
        xi, weights = shape.quadrature(DEGREE)
        across = area_vectors(x, shape, xi)
        size = np.linalg.norm(across, axis=2)
        N = shape.shapes(xi)
        if callable(traction):
            at = np.einsum("qk,fkd->fqd", N, x)
            t = np.broadcast_to(traction(at, across / size[:, :, None]), at.shape)
        else:
            t = np.broadcast_to(traction, across.shape)
        forces = np.einsum("fqd,qk->fkd", t * (size * weights)[:, :, None], N)
        np.add.at(load, group.nodes, forces)
    return load.ravel()


def pressure_load(mesh: FiniteElementMesh, surface: str) -> Array:
    """Nodal forces of a unit pressure on a surface, against its outward normal."""
    return traction_load(mesh, surface, lambda position, normal: -normal)


def resultant_load(mesh: FiniteElementMesh, surface: str, direction: Array) -> Array:
    """Nodal forces of a unit force spread evenly over a surface."""
    d = np.asarray(direction, dtype=float)
    load = traction_load(mesh, surface, d / np.linalg.norm(d))
    return np.asarray(load / np.linalg.norm(load.reshape(-1, mesh.dimension).sum(axis=0)))


def nodal_load(mesh: FiniteElementMesh, nodes: Indices, direction: Array) -> Array:
    """A unit force shared evenly by nodes; the output is their mean displacement.

    Examples
    --------
    >>> mesh = FiniteElementMesh(np.eye(3, 2), np.arange(3), ())
    >>> nodal_load(mesh, np.array([0, 2]), np.array([0.0, 1.0]))
    array([0. , 0.5, 0. , 0. , 0. , 0.5])
    """
    load = np.zeros_like(mesh.points)
    load[nodes] = np.asarray(direction, dtype=float) / (np.linalg.norm(direction) * len(nodes))
    return load.ravel()


def nodal_moment(mesh: FiniteElementMesh, nodes: Indices, axis: Array | None = None) -> Array:
    """A unit moment as forces ``axis × (x - c)`` on nodes, c their middle; the output is their mean rotation.

    Parameters
    ----------
    mesh : FiniteElementMesh
    nodes : (k,) int array
    axis : (3,) array, optional
        Of the moment in space; in the plane it turns counter-clockwise.

    Raises
    ------
    ModelError
        Where all nodes lie on the axis.

    Examples
    --------
    >>> mesh = FiniteElementMesh(np.array([[-1.0, 0.0], [1.0, 0.0]]), np.arange(2), ())
    >>> nodal_moment(mesh, np.array([0, 1])) + 0.0  # arms of 1 m
    array([ 0. , -0.5,  0. ,  0.5])
    """
    d = mesh.dimension
    turn = np.array([0.0, 0.0, 1.0]) if d == 2 else np.asarray(axis, dtype=float)
    arms = np.zeros((len(nodes), 3))
    arms[:, :d] = mesh.points[nodes] - mesh.points[nodes].mean(axis=0)
    moved = np.cross(turn / np.linalg.norm(turn), arms)[:, :d]
    work = float((moved**2).sum())
    if not work > 1e-20 * float((arms**2).sum()):
        if len(nodes) == 1:
            raise ModelError(
                f"a moment on node {mesh.node_labels[nodes[0]]} alone has no arm: reference nodes of "
                "couplings have rotations, others do not; name a surface, or more nodes"
            )
        raise ModelError("a moment on nodes that all lie on its axis has no arm")
    load = np.zeros_like(mesh.points)
    load[nodes] = moved / work
    return load.ravel()


def shared_mass(mesh: FiniteElementMesh, nodes: Indices, surface: str | None) -> Array:
    """(k,) shares of nodes in a mass that is spread over a surface, or shared evenly without one.

    Of a surface they are those of the diagonal of its mass matrix, so that all are positive.
    """
    if surface is None:
        return np.full(len(nodes), 1.0 / len(nodes))
    own = spring_stiffness(mesh, surface, 1.0, 0).diagonal()[mesh.dimension * nodes]
    return np.asarray(own / own.sum())


def nodal_springs(mesh: FiniteElementMesh, nodes: Indices, each: float, axis: int) -> sp.csc_matrix:
    """Stiffness of equal springs to the ground at nodes, N/m each, along `axis`."""
    n = mesh.points.size
    at = mesh.dimension * np.unique(nodes) + axis
    return sp.coo_matrix((np.full(len(at), each), (at, at)), shape=(n, n)).tocsc()


ROUND = 0.02
"""Share of a turn of a surface that is along its normals, below which it is round about the axis: a regular
polygon of twelve edges has 0.023 about its own."""


def moment_load(mesh: FiniteElementMesh, surface: str, axis: Array | None = None) -> Array:
    """A unit moment as a traction that is linear over a surface, without any other resultant.

    Tractions are rigid motions u of the surface: their components along the normals, ``n (n · u)``, as
    bending stresses act on a section; the whole u where its normal components have next to no resultant, as
    the shear of torsion acts on the end of a shaft, and on what is round about the axis. With ``A`` and ``J``
    the resultants of both in all rigid motions, and ``A x = lambda J x``, ``X^T J X = 1``, that of f is

        t = sum_k (X^T f)_k (n (n · u_k) / lambda_k  or  u_k).

    In the plane the moment turns counter-clockwise.

    Parameters
    ----------
    mesh : FiniteElementMesh
    surface : str
    axis : (3,) array, optional
        Axis of the moment in space.
    """
    d = mesh.dimension
    turn = np.ones(1) if d == 2 else np.asarray(axis, dtype=float)
    shares = traction_load(mesh, surface, np.eye(d)[0]).reshape(-1, d)[:, 0]
    centre = shares @ mesh.points / shares.sum()

    def moved(position: Array, k: int) -> Array:
        """Displacements of rigid motion k: translations, then turns about the centre."""
        if k < d:
            return np.broadcast_to(np.eye(d)[k], position.shape)
        arm = np.zeros((*position.shape[:-1], 3))
        arm[..., :d] = position - centre
        return np.asarray(np.cross(np.eye(3)[2 if d == 2 else k - d], arm)[..., :d])

    def along_normals(position: Array, normal: Array, k: int) -> Array:
        return np.asarray(np.sum(moved(position, k) * normal, axis=-1, keepdims=True) * normal)

    every = range(d + len(turn))
    motions = np.stack([moved(mesh.points, k).ravel() for k in every])
    pressing, whole = (
        np.stack([traction_load(mesh, surface, partial(field, k=k)) for k in every])
        for field in (along_normals, lambda position, normal, k: moved(position, k))
    )
    share, X = scipy.linalg.eigh(_symmetric(pressing @ motions.T), _symmetric(whole @ motions.T))
    resultant = np.concatenate([np.zeros(d), turn / np.linalg.norm(turn)])
    weight, bent = X.T @ resultant, share > ROUND
    return np.asarray(
        (weight[bent] / share[bent]) @ X[:, bent].T @ pressing
        + weight[~bent] @ X[:, ~bent].T @ whole
    )


def _symmetric(A: Array) -> Array:
    return np.asarray(0.5 * (A + A.T))


def spring_stiffness(
    mesh: FiniteElementMesh, surface: str, per_area: float, axis: int
) -> sp.csc_matrix:
    """Stiffness of springs to the ground spread over a surface, `per_area` in N/m³ along `axis`."""
    n, d = mesh.points.shape
    rows, columns, values = [], [], []
    for group in facets_of(mesh, surface).groups:
        x, shape = mesh.points[group.nodes], group.type
        xi, weights = shape.quadrature(DEGREE)
        size = np.linalg.norm(area_vectors(x, shape, xi), axis=2) * weights
        N = shape.shapes(xi)
        part = per_area * np.einsum("fq,qa,qb->fab", size, N, N, optimize=True)
        dofs = d * group.nodes + axis
        rows.append(np.broadcast_to(dofs[:, :, None], part.shape).ravel())
        columns.append(np.broadcast_to(dofs[:, None], part.shape).ravel())
        values.append(part.ravel())
    place = np.concatenate(rows), np.concatenate(columns)
    return sp.coo_matrix((np.concatenate(values), place), shape=(d * n, d * n)).tocsc()

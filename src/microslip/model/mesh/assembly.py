"""Stiffness and mass of meshes of isoparametric elements, in the plane and in space.

With the gradients G of the shape functions and the Jacobian determinant J of an element,

    K_ai,bj = ∫ (lambda G_ai G_bj + mu G_aj G_bi + mu delta_ij G_a · G_b) J,
    M_ai,bj = delta_ij ∫ rho N_a N_b J.

Incompatible modes ``1 - xi_k²`` let linear quadrilaterals and hexahedra bend (Taylor, Beresford & Wilson,
International Journal for Numerical Methods in Engineering 10 (1976) 1211): their gradients are taken with
the Jacobian of the centre, so that constant stresses do no work on them, and they are condensed.
"""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np
import scipy.sparse as sp

from microslip.errors import ModelError
from microslip.model.elasticity import Material
from microslip.model.mesh.element_types import ElementType
from microslip.model.mesh.finite_elements import INCOMPATIBLE, Block, FiniteElementMesh
from microslip.typing import Array, Indices

AT_ONCE = 4_000_000
"""Entries of element matrices that are formed together."""

FLAT = 1e-10
"""An element is degenerate where its Jacobian determinant is below this part of its largest one."""

FEW = 5
"""Elements that a message names one by one."""


def assemble(
    mesh: FiniteElementMesh, materials: Mapping[str, Material] | Material | None = None
) -> tuple[sp.csc_matrix, sp.csc_matrix]:
    """Stiffness and consistent mass of a mesh.

    Parameters
    ----------
    mesh : FiniteElementMesh
    materials : Material, or mapping of str to Material, optional
        One for all elements, or by element set; those of the sections of the mesh when left out.

    Returns
    -------
    stiffness, mass : (d n, d n) sparse
        Component i of node k in ``d k + i``; per metre of width in the plane.

    Raises
    ------
    ModelError
        Where an element is inverted or degenerate, or has no material.

    Examples
    --------
    >>> square = np.array([[0.0, 0.0], [1.0, 0.0], [1.0, 1.0], [0.0, 1.0]])
    >>> mesh = FiniteElementMesh(square, np.arange(4), (Block("quad4", np.arange(4)[None], np.ones(1)),))
    >>> stiffness, mass = assemble(mesh, Material(70e9, 0.3, 2000.0))
    >>> round(float(mass.sum()) / 2, 6)  # mass of the unit square, once per direction
    2000.0
    """
    given, of = material_of_elements(mesh, materials)
    lam, mu = np.array([m.lame() for m in given]).T
    density = np.array([m.density for m in given])
    d, n = mesh.dimension, mesh.dimension * len(mesh.points)
    K, M = sp.csc_matrix((n, n)), sp.csc_matrix((n, n))
    for block, start in zip(mesh.blocks, mesh.starts[:-1], strict=True):
        sign = orientation(mesh, block)
        chunk = max(1, AT_ONCE // (d * block.type.size) ** 2)
        for first in range(0, block.count, chunk):
            part = slice(first, first + chunk)
            own = of[start : start + block.count][part]
            nodes = block.nodes[part].astype(np.int32)
            stiff, heavy = _element_matrices(
                mesh.points[nodes], block, sign, lam[own], mu[own], density[own]
            )
            dofs = (d * nodes[:, :, None] + np.arange(d, dtype=np.int32)).reshape(len(nodes), -1)
            place = (
                np.repeat(dofs, dofs.shape[1], axis=1).ravel(),
                np.tile(dofs, dofs.shape[1]).ravel(),
            )
            # summed as they come: the entries of all elements are several times those of the matrix
            K = K + sp.coo_matrix((stiff.ravel(), place), shape=(n, n)).tocsc()
            M = M + sp.coo_matrix((heavy.ravel(), place), shape=(n, n)).tocsc()
    M.eliminate_zeros()
    points = [(d * node + i, m) for node, m in mesh.masses.items() for i in range(d)]
    if points:
        at, m = np.array(points).T
        M = (M + sp.coo_matrix((m, (at.astype(int), at.astype(int))), shape=(n, n))).tocsc()
    return 0.5 * (K + K.T), 0.5 * (M + M.T)


def material_of_elements(
    mesh: FiniteElementMesh, materials: Mapping[str, Material] | Material | None
) -> tuple[list[Material], Indices]:
    """Materials, and the number of that of each element.

    Raises
    ------
    ModelError
        Where an element has none, or a section names one that is not there.
    """
    if isinstance(materials, Material):
        return [materials], np.zeros(mesh.elements, dtype=np.int64)
    if materials is None:
        unknown = [s for s in mesh.sections if s.material not in mesh.materials]
        if unknown and unknown[0].material in mesh.lacking:
            raise ModelError(mesh.lacking[unknown[0].material])
        if unknown:
            there = ", ".join(mesh.materials) or "none"
            raise ModelError(
                f"the section of element set {unknown[0].elements!r} names the material "
                f"{unknown[0].material!r}; there is {there}"
            )
        pairs = [(s.elements, mesh.materials[s.material]) for s in mesh.sections]
    else:
        pairs = list(materials.items())
    of = np.full(mesh.elements, -1)
    for k, (name, _) in enumerate(pairs):
        of[mesh.elements_of_set(name)] = k
    if (of < 0).any():
        raise ModelError(
            f"{_elements(mesh.element_labels[of < 0])} no material: name their element set in elements of "
            "a [[material]], or give the file a section for them"
        )
    return [material for _, material in pairs], of


def orientation(mesh: FiniteElementMesh, block: Block) -> int:
    """1 where elements count their nodes as this package does, -1 where all of them mirror it.

    Raises
    ------
    ModelError
        Where elements are inverted or degenerate, naming them.
    """
    shape = block.type
    if shape.dimension != mesh.dimension:
        raise ModelError(f"elements {block.kind} do not fill a mesh of dimension {mesh.dimension}")
    points, _ = shape.quadrature(2 * shape.order)
    det = np.linalg.det(_jacobians(mesh.points[block.nodes], shape, points))
    size = np.abs(det).max(axis=1, keepdims=True)
    flat = (np.abs(det) <= FLAT * size).any(axis=1) | (size[:, 0] == 0)
    if flat.any():
        raise ModelError(
            f"{_elements(block.labels[flat])} no volume at some point ({block.kind}): collapsed or folded"
        )
    sign = 1 if (det > 0).sum() >= (det < 0).sum() else -1
    wrong = (sign * det < 0).any(axis=1)
    if wrong.any():
        raise ModelError(
            f"{_elements(block.labels[wrong])} a negative Jacobian determinant ({block.kind}): inverted or "
            "folded, or nodes in another order than in the others"
        )
    return sign


def _elements(labels: Indices) -> str:
    """``element 7 has``, ``elements 7, 8 have``: the start of a message."""
    if len(labels) == 1:
        return f"element {labels[0]} has"
    rest = f" and {len(labels) - FEW} more" if len(labels) > FEW else ""
    return f"elements {', '.join(map(str, labels[:FEW]))}{rest} have"


def _jacobians(x: Array, shape: ElementType, points: Array) -> Array:
    """(e, q, d, d) derivatives of the position (first) by reference coordinates (second)."""
    return np.einsum("ekd,qkc->eqdc", x, shape.gradients(points), optimize=True)


def _element_matrices(
    x: Array, block: Block, sign: int, lam: Array, mu: Array, density: Array
) -> tuple[Array, Array]:
    """(e, d k, d k) stiffness and mass of elements at (e, k, d) nodes."""
    shape, d = block.type, x.shape[2]
    points, weights = shape.quadrature(2 * shape.order)
    gradient, volume = gradients_of(x, block, sign)
    if block.formulation == INCOMPATIBLE:
        gradient = np.concatenate([gradient, _bubbles(x, shape, points, volume, weights)], axis=2)
    K = _stiffness(gradient, volume, lam, mu)
    kept = d * shape.size
    if block.formulation == INCOMPATIBLE:
        K = K[:, :kept, :kept] - K[:, :kept, kept:] @ np.linalg.solve(
            K[:, kept:, kept:], K[:, kept:, :kept]
        )
    N = shape.shapes(points)
    scalar = np.einsum("eq,qa,qb->eab", volume * density[:, None], N, N, optimize=True)
    M = np.einsum("eab,ij->eaibj", scalar, np.eye(d)).reshape(len(x), kept, kept)
    return K, M


def gradients_of(x: Array, block: Block, sign: int) -> tuple[Array, Array]:
    """Gradients of the shape functions (e, q, k, d), 1/m, and volumes (e, q) at the points of the quadrature.

    Parameters
    ----------
    x : (e, k, d) array
        Nodes of the elements, m.
    block : Block
    sign : int
        See `orientation`.
    """
    shape = block.type
    points, weights = shape.quadrature(2 * shape.order)
    jacobian = _jacobians(x, shape, points)
    volume = sign * np.linalg.det(jacobian) * weights
    gradient = np.einsum(
        "qkc,eqcd->eqkd", shape.gradients(points), np.linalg.inv(jacobian), optimize=True
    )
    return gradient, volume


def _stiffness(gradient: Array, volume: Array, lam: Array, mu: Array) -> Array:
    e, q, k, d = gradient.shape
    flat = gradient.reshape(e, q, k * d)
    outer = (np.swapaxes(flat * volume[:, :, None], 1, 2) @ flat).reshape(e, k, d, k, d)
    trace = np.einsum("eaibi->eab", outer)
    K = lam[:, None, None, None, None] * outer + mu[:, None, None, None, None] * (
        outer.transpose(0, 1, 4, 3, 2) + np.einsum("eab,ij->eaibj", trace, np.eye(d))
    )
    return np.asarray(K.reshape(e, k * d, k * d))


def _bubbles(x: Array, shape: ElementType, points: Array, volume: Array, weights: Array) -> Array:
    """(e, q, d, d) gradients of the incompatible modes, with the Jacobian of the centre."""
    if shape.family not in ("quad", "hex") or shape.order != 1:
        raise ModelError(f"incompatible modes are for quad4 and hex8, not {shape.name}")
    centre = _jacobians(x, shape, np.zeros((1, shape.dimension)))[:, 0]
    by_reference = -2.0 * points[:, :, None] * np.eye(shape.dimension)
    gradient = np.einsum("qmc,ecd->eqmd", by_reference, np.linalg.inv(centre), optimize=True)
    scale = np.abs(np.linalg.det(centre))[:, None] * weights / volume
    return np.asarray(gradient * scale[:, :, None, None])

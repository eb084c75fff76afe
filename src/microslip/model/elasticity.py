"""Plane elasticity: stiffness, mass and loads, assembled through scikit-fem.

Strong form ``div sigma + b = rho u_tt`` with ``sigma = lambda tr(eps) I + 2 mu eps``. The element is
the eight-node serendipity quadrilateral: its quadratic displacements bend without locking, and the
nodal forces of its edges (Simpson's 1/6, 4/6, 1/6) are all positive, so each corner and mid-side
node of the interface can be a contact pair.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
import scipy.sparse as sp
import skfem
from skfem.helpers import dot
from skfem.models.elasticity import linear_elasticity

from microslip.brief import Brief
from microslip.typing import Array, Indices


@dataclass(frozen=True)
class Material:
    """Linear isotropic material.

    Attributes
    ----------
    youngs_modulus : float
        E in Pa.
    poissons_ratio : float
        nu, dimensionless.
    density : float
        rho in kg/m³.
    plane : str
        ``"strain"`` or ``"stress"``.
    thermal_expansion : float
        alpha in 1/K.
    """

    youngs_modulus: float
    poissons_ratio: float
    density: float
    plane: str = "strain"
    thermal_expansion: float = 0.0

    def lame(self) -> tuple[float, float]:
        """First and second Lamé parameter of the plane problem, in Pa."""
        E, nu = self.youngs_modulus, self.poissons_ratio
        thin = self.plane == "stress"
        return E * nu / (1 - nu**2 if thin else (1 + nu) * (1 - 2 * nu)), E / (2 * (1 + nu))

    def thermal_stress(self) -> float:
        """Pressure per temperature where nothing can move in the directions that are modelled, in Pa/K.

        ``E alpha/(1 - 2 nu)`` in plane strain and in space, ``E alpha/(1 - nu)`` in plane stress.

        Examples
        --------
        >>> round(Material(200e9, 0.25, 7850.0, "stress", 12e-6).thermal_stress())
        3200000
        """
        nu = self.poissons_ratio
        free = 1 - nu if self.plane == "stress" else 1 - 2 * nu
        return self.youngs_modulus * self.thermal_expansion / free

    def plane_modulus(self) -> float:
        """E' of the plane problem: E/(1 - nu²) in plane strain, E in plane stress."""
        if self.plane == "stress":
            return self.youngs_modulus
        return self.youngs_modulus / (1 - self.poissons_ratio**2)


@dataclass(frozen=True, repr=False)
class Body(Brief):
    """One elastic body: its mesh, matrices and the basis that its loads are made with.

    Attributes
    ----------
    mesh : skfem.MeshQuad
    nodes : (2, n) array
        Positions of the corner and mid-side nodes, m.
    stiffness, mass : (2 n, 2 n) sparse
        Displacement of node ``k`` in ``2 k`` (x) and ``2 k + 1`` (y), per metre of width.
    basis : skfem.Basis
        Vector basis of the displacements.
    order : (2 n,) int array
        Degree of freedom of the basis behind each one here.
    """

    mesh: skfem.MeshQuad
    nodes: Array
    stiffness: sp.csc_matrix
    mass: sp.csc_matrix
    basis: skfem.Basis
    order: Indices


ELEMENT = skfem.ElementVector(skfem.ElementQuadS2())


def elastic_body(mesh: skfem.MeshQuad, material: Material) -> Body:
    """Stiffness and consistent mass of one body, per metre of width.

    Examples
    --------
    >>> body = elastic_body(skfem.MeshQuad(), Material(70e9, 0.3, 2000.0))
    >>> round(float(body.mass.sum()) / 2, 6)  # mass of the unit square, once per direction
    2000.0
    """
    lam, mu = material.lame()
    density = material.density
    basis = skfem.Basis(mesh, ELEMENT, intorder=4)

    @skfem.BilinearForm
    def inertia(u, v, w):  # type: ignore[no-untyped-def]
        return density * dot(u, v)

    dofs = np.hstack([basis.nodal_dofs, basis.facet_dofs])
    order = dofs.T.ravel()
    stiffness = skfem.asm(linear_elasticity(lam, mu), basis).tocsr()[order][:, order]
    mass = skfem.asm(inertia, basis).tocsr()[order][:, order]
    return Body(
        mesh,
        basis.doflocs[:, dofs[0]],
        (0.5 * (stiffness + stiffness.T)).tocsc(),
        mass.tocsc(),
        basis,
        order,
    )


def traction_load(
    body: Body, facets: Indices, traction: Callable[[Array, Array], tuple[Array, Array]]
) -> Array:
    """Consistent nodal forces of a traction on boundary facets, per metre of width.

    Parameters
    ----------
    body : Body
    facets : (k,) int array
        Boundary facets of ``body.mesh``.
    traction : callable
        ``traction(x, y) -> (t_x, t_y)`` in Pa.

    Returns
    -------
    (2 n,) array, N/m.
    """
    edge = skfem.FacetBasis(body.mesh, ELEMENT, facets=facets, intorder=4)

    @skfem.LinearForm
    def work(v, w):  # type: ignore[no-untyped-def]
        tx, ty = traction(w.x[0], w.x[1])
        return tx * v[0] + ty * v[1]

    return np.asarray(skfem.asm(work, edge)[body.order], dtype=float)


def traction_stiffness(body: Body, facets: Indices, per_area: float, axis: int) -> sp.csc_matrix:
    """Stiffness of springs spread over boundary facets, `per_area` in N/m³ along `axis`."""
    edge = skfem.FacetBasis(body.mesh, ELEMENT, facets=facets, intorder=4)

    @skfem.BilinearForm
    def spring(u, v, w):  # type: ignore[no-untyped-def]
        return per_area * u[axis] * v[axis]

    return skfem.asm(spring, edge).tocsr()[body.order][:, body.order].tocsc()

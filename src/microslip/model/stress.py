"""What sections of the beams carry under a displacement of the mesh: force, moment, nominal stress.

    N = int sigma_xx dy,     M = -int sigma_xx (y - y_m) dy,     sigma = |N|/h + 6 |M|/h²

per metre of width, from the strains of the elements of each column of the mesh. Resultants know no
singularity of a support or a corner: this is the stress that an engineer compares with a yield stress.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import skfem

from microslip.brief import Brief
from microslip.model.elasticity import ELEMENT, Material
from microslip.model.structure import Structure
from microslip.typing import Array


@dataclass(frozen=True, repr=False)
class Sections(Brief):
    """Sections across beams, one at each column of elements.

    Attributes
    ----------
    position : (k,) array
        Middle of the column, m.
    force, moment : (k,) arrays
        N and M, N/m and N m/m; positive moments bend concave up.
    thickness : (k,) array
        h, m.
    """

    position: Array
    force: Array
    moment: Array
    thickness: Array

    @property
    def stress(self) -> Array:
        """Largest nominal stress of each section, Pa."""
        h = self.thickness
        return np.abs(self.force) / h + 6 * np.abs(self.moment) / h**2


def sections_of_beam(mesh: skfem.MeshQuad, material: Material, displacement: Array) -> Sections:
    """Sections of one beam along x, whose elements stand in columns.

    Parameters
    ----------
    mesh : skfem.MeshQuad
    material : Material
    displacement : (2 n,) array
        Of the corner nodes and then the mid-side nodes, x and y of each.
    """
    basis = skfem.Basis(mesh, ELEMENT, intorder=4)
    values = np.empty(len(displacement))
    values[np.hstack([basis.nodal_dofs, basis.facet_dofs]).T.ravel()] = displacement
    lam, mu = material.lame()
    strain = basis.interpolate(values).grad
    stress = (lam + 2 * mu) * strain[0, 0] + lam * strain[1, 1]
    y = basis.global_coordinates().value[1]
    bottom, top = mesh.p[1].min(), mesh.p[1].max()
    corners = mesh.p[0, mesh.t]
    left, right = corners.min(axis=0), corners.max(axis=0)
    size = 1e-9 * (mesh.p[0].max() - mesh.p[0].min())
    _, first, column = np.unique(np.round(left / size), return_index=True, return_inverse=True)
    width = (right - left)[first]

    def across(density: Array) -> Array:
        """Integral over each column, per length of it."""
        total = np.bincount(column.ravel(), (density * basis.dx).sum(axis=1))
        return np.asarray(total / width)

    return Sections(
        position=0.5 * (left + right)[first],
        force=across(stress),
        moment=-across(stress * (y - 0.5 * (bottom + top))),
        thickness=np.full(len(width), top - bottom),
    )


def sections_outside(
    structure: Structure, material: Material | tuple[Material, ...], shape: Array
) -> Sections:
    """Sections of all beams beside the overlap, where each carries what it carries alone.

    Parameters
    ----------
    structure : Structure
        Of a mesh; without one there are no sections.
    material : Material or tuple of Material
        Of all bodies, or of each.
    shape : (n,) array
        Displacement of its degrees of freedom: a mode, or a static answer.
    """
    if not structure.meshes:
        return Sections(*[np.empty(0)] * 4)
    counts = [2 * (mesh.p.shape[1] + mesh.facets.shape[1]) for mesh in structure.meshes]
    whole = np.zeros(sum(counts))
    whole[structure.free] = shape
    parts = np.split(whole, np.cumsum(counts)[:-1])
    own = (material,) * len(parts) if isinstance(material, Material) else material
    found = [
        sections_of_beam(mesh, metal, part)
        for mesh, metal, part in zip(structure.meshes, own, parts, strict=True)
    ]
    edge = np.abs(structure.interface.position).max()
    outside = [np.abs(beam.position) > edge for beam in found]

    def joined(name: str) -> Array:
        parts = [getattr(beam, name)[kept] for beam, kept in zip(found, outside, strict=True)]
        return np.concatenate(parts)

    return Sections(*(joined(name) for name in ("position", "force", "moment", "thickness")))


def deflection(structure: Structure, shape: Array) -> float:
    """Largest displacement across the beams, in the unit of the shape."""
    whole = np.zeros(structure.free.max() + 2)
    whole[structure.free] = shape
    return float(np.abs(whole[: len(whole) // 2 * 2].reshape(-1, 2)[:, 1]).max())

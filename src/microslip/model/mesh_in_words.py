"""What a mesh is, in words: its bodies, its interfaces, and the motions that nothing holds."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
import scipy.sparse.csgraph as csgraph

from microslip.describe.mesh import MeshFile, MeshInterface, MeshMaterial
from microslip.describe.plausible import TABLE
from microslip.describe.units import readable
from microslip.errors import Caution
from microslip.model.mesh.finite_elements import FiniteElementMesh
from microslip.model.mesh.naming import elements_at, named_bodies
from microslip.model.meshed import MeshedStructure
from microslip.model.mortar.coupling import MortarCoupling
from microslip.typing import Array

FREE = 1e-6
"""A translation is free where so little of it is not among the motions without stiffness."""


def names_of_motions(found: MeshedStructure, null: Array) -> tuple[str, ...]:
    """What each motion without stiffness is, by the part of the structure that it moves.

    Parameters
    ----------
    found : MeshedStructure
    null : (n, e) array
        The motions. Elastic bodies have rigid ones alone: what is no translation turns.
    """
    if not null.shape[1]:
        return ()
    structure, mesh, d = found.structure, found.mesh, found.mesh.dimension
    count, parts = csgraph.connected_components(structure.stiffness, directed=False)
    bodies = named_bodies(mesh)
    owner = np.full(len(mesh.points), -1)
    for k, (_, nodes) in enumerate(bodies):
        owner[nodes] = k
    node = np.where(structure.free < mesh.points.size, structure.free // d, 0)
    largest = float(np.linalg.norm(null, axis=0).max())
    names: list[str] = []
    for part in range(count):
        inside = parts == part
        own = null * inside[:, None]
        rank = int(np.linalg.matrix_rank(own, tol=1e-6 * largest))
        if not rank:
            continue
        basis = np.linalg.svd(own, full_matrices=False)[0][:, :rank]
        # springs of bolts join bodies of which some are held
        points = inside & (structure.free < mesh.points.size)
        moving = [
            k
            for k in np.unique(owner[node[points]])
            if k >= 0 and np.linalg.norm(own[points & (owner[node] == k)]) > 1e-6 * largest
        ]
        whose = " and ".join(bodies[k][0] for k in moving)
        moved = 0
        for axis in range(d):
            rigid = points & np.isin(owner[node], moving) & (structure.free % d == axis)
            unit = rigid / max(float(np.linalg.norm(rigid)), 1e-300)
            if np.linalg.norm(basis.T @ unit) > 1 - FREE:
                names.append(f"translation along {'xyz'[axis]} of {whose}")
                moved += 1
        names += [f"rotation of {whose}"] * (rank - moved)
    return tuple(names)


def coupled_said(mesh: FiniteElementMesh, on: str | None) -> str:
    """That a coupling leaves out some directions of its reference node, where a place is one: the end of a
    message about what does not move."""
    if on is None or on not in mesh.node_sets:
        return ""
    every = range(6) if mesh.dimension == 3 else (0, 1, 5)
    for coupling in mesh.couplings:
        given = [c + 1 for c in every if c in coupling.components]
        if coupling.reference in mesh.node_sets[on] and len(given) < len(every):
            if coupling.kind == "distributing":
                given = [1, 2, 3][: mesh.dimension] + [c for c in given if c > 3]
            return (
                f", or not coupled: of this reference node coupling {coupling.name!r} couples the components "
                f"{', '.join(map(str, given))} alone"
            )
    return ""


def bodies_said(mesh: FiniteElementMesh) -> list[str]:
    """Bodies with their names and sizes: a row of ``microslip check``."""
    return [
        f"{name} ({len(elements_at(mesh, nodes))} elements, {len(nodes)} nodes)"
        for name, nodes in named_bodies(mesh)
    ]


def interface_said(entry: MeshInterface, coupling: MortarCoupling) -> tuple[str, str]:
    """Area, pairs and gaps of an interface: a row of ``microslip check``."""
    unit = "m²" if coupling.dimension == 3 else "m²/m"
    apart = distances_said(coupling.gap, float(np.ptp(coupling.points, axis=0).max()))
    return (
        f"interface {entry.name}",
        f"{coupling.area.sum():.4g} {unit}, {coupling.pairs} pairs on {coupling.slave}, "
        f"{coupling.covered:.0%} of it facing {coupling.master}, {apart}",
    )


def distances_said(gap: Array, length: float) -> str:
    """How far apart the sides of an interface of some length are, m; what is rounding of it is nothing.

    Examples
    --------
    >>> distances_said(np.array([-8.4e-19, 1.1e-18]), 0.04)
    'touching in the mesh'
    >>> distances_said(np.array([1e-18, 2e-5]), 0.04)
    '0 m to 20 µm apart in the mesh'
    """
    apart = np.where(np.abs(gap) < ROUNDING * length, 0.0, gap)
    if not apart.any():
        return "touching in the mesh"
    return f"{readable(apart.min(), 'm', 3)} to {readable(apart.max(), 'm', 3)} apart in the mesh"


ROUNDING = 1e-9
"""Of the length of an interface, a distance that files do not mean."""


def doubtful_materials(mesh: FiniteElementMesh, given: MeshFile) -> list[Caution]:
    """That a material of the file is not usual, as where the file is in other units."""
    return [
        _unusual(
            f"mesh.length_unit = {given.length_unit}, mesh.force_unit = {given.force_unit}",
            f"material {name!r}",
            own.youngs_modulus,
            own.density,
            "are these the units of the file? Densities go with N and mm in tonnes/mm³",
        )
        for name, own in mesh.materials.items()
        if not _usual(own.youngs_modulus, own.density)
    ]


def given_materials(given: Sequence[MeshMaterial]) -> list[Caution]:
    """That a material of the joint file is not usual, as where a unit is missing."""
    return [
        _unusual(
            f"material[{k}]" if len(given) > 1 else "material",
            "it",
            own.youngs_modulus,
            own.density,
            'are the units right? "210 GPa", "7850 kg/m³"',
        )
        for k, own in enumerate(given)
        if not _usual(own.youngs_modulus, own.density)
    ]


def _usual(youngs_modulus: float, density: float) -> bool:
    usual = {row.key: row for row in TABLE}
    E, rho = usual["material.youngs_modulus"], usual["material.density"]
    return E.low <= youngs_modulus <= E.high and rho.low <= density <= rho.high


def _unusual(where: str, what: str, youngs_modulus: float, density: float, remedy: str) -> Caution:
    reason = f"{what} has E = {youngs_modulus:.3g} Pa and {density:.3g} kg/m³"
    return Caution("input", where, reason, remedy)


SMALLEST, LARGEST = 5e-3, 20.0
"""m, what structures with joints usually measure, as of lap joints."""


def doubtful_size(mesh: FiniteElementMesh, given: MeshFile) -> list[Caution]:
    """That bodies are larger or smaller than usual, as where the file is in another unit of length."""
    used = np.unique(np.concatenate([block.nodes.ravel() for block in mesh.blocks]))
    size = float(np.ptp(mesh.points[used], axis=0).max())
    if SMALLEST <= size <= LARGEST:
        return []
    return [
        Caution(
            "input",
            f"mesh.length_unit = {given.length_unit}",
            f"the bodies measure {readable(size, 'm', 3)}",
            "is this the unit of the file? Most programs make meshes in mm",
        )
    ]

"""Temperature: nodal forces with which a mesh expands as it would without constraint.

Of a change of temperature T, uniform in each element,

    eps_th = alpha T I,   f_ai = ∫ (B^T D eps_th) J = ∫ s T G_ai J,

s the stress per temperature of a body that cannot move (`Material.thermal_stress`) and G the gradients of
the shape functions. In plane strain a body expands by ``(1 + nu) alpha T``, since it cannot across the plane.
Incompatible modes take no part: their gradients have no mean over an element
(`microslip.model.mesh.assembly`), and so a uniform stress does no work on them.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np

from microslip.errors import ModelError
from microslip.model.elasticity import Material
from microslip.model.mesh.assembly import gradients_of, material_of_elements, orientation
from microslip.model.mesh.finite_elements import FiniteElementMesh
from microslip.typing import Array


def thermal_load(
    mesh: FiniteElementMesh,
    change: Array,
    materials: Mapping[str, Material] | Material | None = None,
) -> Array:
    """Nodal forces of a change of temperature.

    Parameters
    ----------
    mesh : FiniteElementMesh
    change : (e,) array
        Of the temperature of every element, K.
    materials : optional
        See `microslip.model.mesh.assembly.assemble`.

    Returns
    -------
    (d n,) array
        N; per metre of width in the plane. They balance each other in every element.

    Examples
    --------
    >>> from microslip.model.mesh.finite_elements import Block
    >>> square = np.array([[0.0, 0.0], [1.0, 0.0], [1.0, 1.0], [0.0, 1.0]])
    >>> mesh = FiniteElementMesh(square, np.arange(4), (Block("quad4", np.arange(4)[None], np.ones(1)),))
    >>> steel = Material(200e9, 0.25, 7850.0, "stress", 12e-6)
    >>> thermal_load(mesh, np.array([10.0]), steel).round().tolist()  # half of 32 MPa times 1 m each
    [-16000000.0, -16000000.0, 16000000.0, -16000000.0, 16000000.0, 16000000.0, -16000000.0, 16000000.0]
    """
    given, of = material_of_elements(mesh, materials)
    stress = np.array([m.thermal_stress() for m in given])[of] * change
    load = np.zeros_like(mesh.points)
    for block, start in zip(mesh.blocks, mesh.starts[:-1], strict=True):
        own = stress[start : start + block.count]
        hot = np.flatnonzero(own)
        if not len(hot):
            continue
        nodes = block.nodes[hot]
        gradient, volume = gradients_of(mesh.points[nodes], block, orientation(mesh, block))
        forces = np.einsum("eqkd,eq->ekd", gradient, volume * own[hot, None])
        np.add.at(load, nodes, forces)
    return load.ravel()


def changes(mesh: FiniteElementMesh, sets: Sequence[str] | None, temperature: float) -> Array:
    """(e,) change of temperature of every element: of some element sets, or of all.

    Raises
    ------
    ModelError
        Where there is no such set.
    """
    out = np.full(mesh.elements, temperature if sets is None else 0.0)
    for name in sets or ():
        out[mesh.elements_of_set(name)] = temperature
    return out


def check_expands(
    mesh: FiniteElementMesh,
    change: Array,
    materials: Mapping[str, Material] | Material | None,
    name: str,
) -> None:
    """Raise `ModelError` where nothing of what becomes warmer or colder expands."""
    given, of = material_of_elements(mesh, materials)
    if not np.any(np.array([m.thermal_expansion for m in given])[of] * change):
        raise ModelError(
            f"preload {name!r}: nothing that changes its temperature expands: give thermal_expansion of a "
            "[[material]], or *EXPANSION in the file of the mesh"
        )

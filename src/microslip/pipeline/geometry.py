"""What the structure of a description looks like, whatever its kind."""

from __future__ import annotations

from microslip.describe.joint import Joint
from microslip.describe.matrices import LENGTHS, MatricesJoint
from microslip.describe.mesh import MeshJoint
from microslip.describe.saved_model import ModelJoint
from microslip.model.geometry import (
    Geometry,
    geometry_of_lap,
    geometry_of_mesh,
    geometry_of_nodes,
)
from microslip.model.imported import Imported
from microslip.model.structure import Structure


def geometry_of(joint: Joint, structure: Structure, imported: Imported | None) -> Geometry | None:
    """Geometry of a structure; None of matrices whose nodes have no coordinates.

    Parameters
    ----------
    joint : Joint
        Its description.
    structure : Structure
    imported : Imported or None
        Where it came from files.
    """
    if isinstance(joint, MeshJoint) and imported is not None and imported.meshed is not None:
        return geometry_of_mesh(imported.meshed, [entry.name for entry in joint.interface])
    if isinstance(joint, MatricesJoint) and imported is not None:
        length = LENGTHS[joint.matrices.length_unit]
        return geometry_of_nodes(structure, imported.numbering, imported.pairs, length)
    return geometry_of_lap(structure) if structure.meshes else None


def unplaced(joint: Joint) -> str:
    """Why a structure has no geometry, and what would give it one."""
    if isinstance(joint, ModelJoint):
        return "a saved model has no geometry: draw the joint that it comes from"
    return "the nodes of the matrices have no coordinates: give matrices.nodes, or x and y in matrices.dofs"

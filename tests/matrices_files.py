"""Lap joints written as matrices: the files, and the description that reads them again."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import scipy.sparse as sp

from microslip.describe.lap import LapJoint
from microslip.model.imported import Imported
from microslip.model.lap import structure_of
from microslip.model.structure import Structure
from microslip.typing import Array


def sparse_parts(name: str, matrix: Any) -> dict[str, Array]:
    """A sparse matrix as arrays of an ``.npz``, beside others."""
    m = sp.csc_matrix(matrix)
    parts = {"data": m.data, "indices": m.indices, "indptr": m.indptr, "shape": np.array(m.shape)}
    return {f"{name}.{part}": value for part, value in parts.items()} | {
        f"{name}.format": np.array("csc")
    }


def arrays_of(structure: Structure) -> dict[str, Array]:
    """Everything a description needs of a structure, by name."""
    found = sparse_parts("K", structure.stiffness) | sparse_parts("M", structure.mass)
    found |= sparse_parts("B", structure.interface.relative)
    if structure.supports is not None and structure.motions is not None:
        found |= sparse_parts("supports", structure.supports) | {"motions": structure.motions}
    found |= {name.replace("output ", "out_"): load for name, load in structure.loads.items()}
    interface = structure.interface
    return found | {"pairs_position": interface.position, "pairs_area": interface.area}


def as_matrices(joint: LapJoint, folder: Path, file: str = "joint.npz") -> dict[str, Any]:
    """Write the matrices of a lap joint driven by moments or one port; the document that reads them."""
    np.savez(folder / file, **arrays_of(structure_of(joint)))
    driven = joint.driven
    name = "moment" if joint.driven_by_end_moments else driven.name
    contact = joint.contact
    return {
        "kind": "matrices",
        "matrices": {
            "stiffness": f"{file}:K",
            "mass": f"{file}:M",
            "motions": f"{file}:motions",
            "supports": f"{file}:supports",
        },
        "interface": {"pairs": f"{file}:pairs", "relative": f"{file}:B"},
        "contact": {
            key: value
            for key in ("friction", "law", "tangential_stiffness", "normal_stiffness")
            if (value := getattr(contact, key)) is not None
        },
        "preload": {"name": "clamp", "vector": f"{file}:clamp", "force": joint.clamp.force},
        "damping": {"alpha": joint.damping.alpha, "beta": joint.damping.beta},
        "port": {"name": name, "kind": driven.kind, "vector": f"{file}:{name}"},
        "output": [
            {
                "name": output.name,
                "quantity": output.quantity,
                "vector": f"{file}:out_{output.name}",
            }
            for output in joint.outputs
            if not output.across
        ],
    }


def mesh_as_matrices(
    found: Imported, document: dict[str, Any], folder: Path, file: str = "plates.npz"
) -> dict[str, Any]:
    """Write the matrices of a joint from a spatial mesh, undivided; the document that reads them.

    Parameters
    ----------
    found : Imported
        What the mesh was read as; SI, per metre of its width.
    document : dict
        Of the mesh: one preload and one port.
    folder : Path
    file : str
    """
    structure, pairs, width = found.structure, found.pairs, document["mesh"]["width"]
    metres = 1.0 if width == "whole" else width
    arrays = arrays_of(structure)
    arrays |= sparse_parts("K", metres * structure.stiffness)
    arrays |= sparse_parts("M", metres * structure.mass)
    arrays |= {
        "pairs_area": metres * pairs.area,
        "pairs_gap": pairs.gap,
        "pairs_friction": pairs.friction,
    }
    np.savez(folder / file, **arrays)
    return {
        "kind": "matrices",
        "matrices": {
            "stiffness": f"{file}:K",
            "mass": f"{file}:M",
            "width": width,
            "modes": document["mesh"]["modes"],
        },
        "interface": {"pairs": f"{file}:pairs", "relative": f"{file}:B"},
        "preload": {
            "name": document["preload"]["name"],
            "vector": f"{file}:{document['preload']['name']}",
            "force": document["preload"]["force"],
        },
        "damping": document["damping"],
        "port": {
            "name": document["port"]["name"],
            "kind": document["port"]["kind"],
            "vector": f"{file}:{document['port']['name']}",
        },
        "load": document["load"],
        "output": [
            {"name": output["name"], "vector": f"{file}:out_{output['name']}"}
            | ({"quantity": output["quantity"]} if "quantity" in output else {})
            for output in document["output"]
            if output.get("quantity") != "slip"
        ],
        "analysis": document["analysis"],
    }


def by_nodes(
    found: Imported, document: dict[str, Any], folder: Path, file: str = "nodes"
) -> dict[str, Any]:
    """The same of a mesh whose nodes match, its pairs by nodes and normals: CSV tables."""
    mesh, coupling = found.meshed.mesh, found.meshed.couplings[0]
    d, labels = mesh.dimension, np.asarray(mesh.node_labels)
    written = mesh_as_matrices(found, document, folder)
    axes = "xyz"[:d]
    rows = [f"node,direction,{','.join(axes)}"]
    for place in found.structure.free:
        node, axis = divmod(int(place), d)
        rows.append(
            f"{labels[node]},{axes[axis]},{','.join(map(repr, map(float, mesh.points[node])))}"
        )
    (folder / f"{file}_dofs.csv").write_text("\n".join(rows) + "\n")
    width = document["mesh"]["width"]
    rows = ["position,area,first,second,nx,ny,nz"]
    for k, own in enumerate(coupling.nodes):
        here = np.linalg.norm(mesh.points - mesh.points[own], axis=1) < 1e-9
        (other,) = set(np.flatnonzero(here)) - {own}
        sides = (own, other) if coupling.slave_below else (other, own)
        area = found.pairs.area[k] * width
        numbers = (found.pairs.position[k], area, *labels[list(sides)], *coupling.normal[k])
        rows.append(",".join(repr(float(x)) for x in numbers))
    (folder / f"{file}_pairs.csv").write_text("\n".join(rows) + "\n")
    written["matrices"]["dofs"] = f"{file}_dofs.csv"
    return written | {
        "interface": {"pairs": f"{file}_pairs.csv"},
        "contact": {"friction": document["interface"]["friction"]},
    }

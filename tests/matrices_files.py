"""Lap joints written as matrices: the files, and the description that reads them again."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import scipy.sparse as sp

from microslip.describe.lap import LapJoint
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

"""Meshes written as input decks, for the tests of the reader."""

from __future__ import annotations

TYPES = {
    "tri3": "CPE3",
    "tri6": "CPE6",
    "quad4": "CPE4",
    "quad8": "CPE8",
    "tet4": "C3D4",
    "tet10": "C3D10",
    "hex8": "C3D8I",
    "hex20": "C3D20",
    "wedge6": "C3D6",
    "wedge15": "C3D15",
}


def write_inp(mesh, path, steps=""):
    """Nodes, elements, sets, surfaces, materials and sections; numbers are written to the last bit."""
    lines = ["*HEADING", "a mesh", "*NODE, NSET=ALL"]
    for label, x in zip(mesh.node_labels, mesh.points, strict=True):
        lines.append(f"{label}, " + ", ".join(repr(float(c)) for c in x))
    known = []
    for block in mesh.blocks:
        lines.append(f"*ELEMENT, TYPE={TYPES[block.kind]}, ELSET=E_{block.kind}")
        known += list(block.labels)
        for label, nodes in zip(block.labels, block.nodes, strict=True):
            values = [str(label), *(str(mesh.node_labels[k]) for k in nodes)]
            for k in range(0, len(values), 8):
                more = "," if k + 8 < len(values) else ""
                lines.append(", ".join(values[k : k + 8]) + more)
    for kind, sets, labels in (
        ("NSET", mesh.node_sets, mesh.node_labels),
        ("ELSET", mesh.element_sets, known),
    ):
        for name, members in sets.items():
            lines.append(f"*{kind}, {kind}={name}")
            lines += [
                ", ".join(str(labels[k]) for k in members[i : i + 12])
                for i in range(0, len(members), 12)
            ]
    for name, surface in mesh.surfaces.items():
        lines.append(f"*SURFACE, NAME={name}")
        lines += [
            f"{known[e]}, S{f + 1}" for e, f in zip(surface.elements, surface.faces, strict=True)
        ]
    for name, m in mesh.materials.items():
        lines += [
            f"*MATERIAL, NAME={name}",
            "*ELASTIC",
            f"{m.youngs_modulus!r}, {m.poissons_ratio!r}",
        ]
        lines += ["*DENSITY", f"{m.density!r}"]
    for section in mesh.sections:
        lines += [f"*SOLID SECTION, ELSET={section.elements}, MATERIAL={section.material}"]
    path.write_text("\n".join(lines) + "\n" + steps)
    return path

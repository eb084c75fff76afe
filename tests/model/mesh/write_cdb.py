"""Meshes written as ANSYS archives, for the tests of the reader: columns as `CDWRITE` has them."""

from __future__ import annotations

NUMBERS = {"tri3": 182, "quad4": 182, "tri6": 183, "quad8": 183}
NUMBERS |= {"tet4": 185, "wedge6": 185, "hex8": 185, "tet10": 187, "wedge15": 186, "hex20": 186}

REPEATED = {
    "tri3": "0122",
    "tri6": "01223425",
    "tet4": "01223333",
    "wedge6": "01223455",
}
"""Nodes of the ElementType in the place of each node of the brick or quadrilateral, by digit."""

WEDGE15 = (0, 1, 2, 2, 3, 4, 5, 5, 6, 7, 2, 8, 9, 10, 5, 11, 12, 13, 14, 14)


def places(kind, count):
    if kind == "wedge15":
        return WEDGE15
    return [int(c) for c in REPEATED[kind]] if kind in REPEATED else range(count)


def columns(values, width=9):
    return "".join(f"{value:>{width}}" for value in values)


def write_cdb(mesh, path, *, plane=2, more="", solid=True):
    """Nodes, elements of one material, components, supports and the material."""
    numbers = sorted({NUMBERS[block.kind] for block in mesh.blocks})
    types = {number: k for k, number in enumerate(numbers, start=1)}
    lines = ["/COM,ANSYS RELEASE 2023 R1", "/PREP7", "/NOPR", "/TITLE,a mesh"]
    lines += ["*IF,_CDRDOFF,EQ,1,THEN     !if solid model was read in", "_CDRDOFF=", "*ELSE"]
    lines += [f"NUMOFF,NODE,{len(mesh.points):9d}", "*ENDIF", "DOF,DELETE"]
    for number, k in types.items():
        lines.append(f"ET,{k:9d},{number}")
        if number in (182, 183):
            lines.append(f"KEYOP,{k:9d}, 3,{plane:9d}")
    count = len(mesh.points)
    lines.append(f"NBLOCK,6,SOLID,{count:10d},{count:10d}" if solid else "NBLOCK,6")
    lines.append("(3i9,6e24.16e3)" if solid else "(1i9,6e24.16e3)")
    for label, x in zip(mesh.node_labels, mesh.points, strict=True):
        values = [*map(float, x)]
        while values and values[-1] == 0.0:
            values.pop()  # zeros at the end are left out
        head = columns([label, 0, 0] if solid else [label])
        lines.append(head + "".join(f"{value:24.16E}" for value in values))
    lines.append("N,R5.3,LOC,       -1,")
    lines += [f"EBLOCK,19,SOLID,{mesh.elements:10d},{mesh.elements:10d}", "(19i9)"]
    for block in mesh.blocks:
        for label, nodes in zip(block.labels, block.nodes, strict=True):
            own = [mesh.node_labels[nodes[k]] for k in places(block.kind, len(nodes))]
            head = [1, types[NUMBERS[block.kind]], 1, 1, 0, 0, 0, 0, len(own), 0, label]
            lines.append(columns([*head, *own[:8]]))
            if len(own) > 8:
                lines.append(columns(own[8:]))
    lines.append(columns([-1]))
    labels = [label for block in mesh.blocks for label in block.labels]
    for kind, sets, known in (
        ("NODE", mesh.node_sets, mesh.node_labels),
        ("ELEM", mesh.element_sets, labels),
    ):
        for name, members in sets.items():
            found = ranges([int(known[k]) for k in members])
            lines += [f"CMBLOCK,{name:<8},{kind},{len(found):8d}  ! users component", "(8i10)"]
            lines += [columns(found[i : i + 8], 10) for i in range(0, len(found), 8)]
    for m in mesh.materials.values():
        given = {"EX": m.youngs_modulus, "NUXY": m.poissons_ratio, "ALPX": 1e-5, "DENS": m.density}
        for name, value in given.items():
            lines.append("MPTEMP,R5.0, 1, 1,  0.00000000    ,")
            lines.append(f"MPDATA,R5.0, 1,{name:<4},       1, 1, {value!r},")
    for row, component in mesh.held:
        label = mesh.node_labels[row]
        lines.append(
            f"D,{label:7d},{('UX', 'UY', 'UZ')[component]:<4},  0.00000000    ,  0.00000000    "
        )
    path.write_text("\n".join([*lines, more.rstrip(), "/GO", "FINISH"]) + "\n")
    return path


def ranges(labels):
    """Ascending numbers, where three or more follow each other the first, and the last below zero."""
    out, labels = [], sorted(labels)
    while labels:
        first = last = labels.pop(0)
        while labels and labels[0] == last + 1:
            last = labels.pop(0)
        out += [first] if last == first else [first, -last]
    return out

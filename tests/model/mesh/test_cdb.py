"""ANSYS archives: what is written comes back, and what is not understood is refused by line."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from grids import box
from write_cdb import NUMBERS, write_cdb

from microslip.errors import InputError
from microslip.model.elasticity import Material
from microslip.model.mesh.ansys.elements import formulation
from microslip.model.mesh.assembly import assemble
from microslip.model.mesh.element_types import TYPES
from microslip.model.mesh.facets import facets_of
from microslip.model.mesh.finite_elements import Section
from microslip.model.mesh.read import read_mesh

STEEL = Material(210e9, 0.3, 7800.0)


def named(kind):
    """A box with its side x = 0 as a component and held there, numbers with gaps, and its last element."""
    d = TYPES[kind].dimension
    mesh = box(kind, [np.linspace(-0.3, s, 3) for s in (1.0, 0.7, 0.4)[:d]])
    side = np.flatnonzero(np.abs(mesh.points[:, 0] + 0.3) < 1e-9)
    held = np.array([(node, c) for node in side for c in range(d)])
    return replace(
        mesh,
        blocks=(replace(mesh.blocks[0], formulation=formulation(kind)),),
        node_labels=3 * mesh.node_labels + mesh.node_labels // 4,
        node_sets={"WALL": side},
        element_sets={"LAST": np.array([mesh.elements - 1])},
        materials={"steel": STEEL},
        sections=(Section("all", "steel"),),
        held=held,
    )


@pytest.mark.parametrize("kind", NUMBERS)
def test_every_shape_comes_back(kind, tmp_path):
    mesh = named(kind)
    back = read_mesh(write_cdb(mesh, tmp_path / "mesh.cdb"))
    assert back.dimension == mesh.dimension
    np.testing.assert_array_equal(back.points, mesh.points)
    np.testing.assert_array_equal(back.node_labels, mesh.node_labels)
    assert [block.kind for block in back.blocks] == [kind]
    np.testing.assert_array_equal(back.blocks[0].nodes, mesh.blocks[0].nodes)
    np.testing.assert_array_equal(back.blocks[0].labels, mesh.blocks[0].labels)
    np.testing.assert_array_equal(back.nodes_of_set("WALL"), mesh.node_sets["WALL"])
    np.testing.assert_array_equal(back.elements_of_set("LAST"), mesh.element_sets["LAST"])
    np.testing.assert_array_equal(facets_of(back, "WALL").nodes, mesh.node_sets["WALL"])
    np.testing.assert_array_equal(back.held, mesh.held)
    assert back.materials == {"MATERIAL 1": STEEL}
    for a, b in zip(assemble(back), assemble(mesh, STEEL), strict=True):
        assert abs(a - b).max() <= 1e-12 * abs(b).max()


def test_units_of_the_archive(tmp_path):
    """Millimetres, newtons, tonnes: the same stiffness."""
    mesh = named("hex20")
    scaled = replace(
        mesh, points=1e3 * mesh.points, materials={"steel": Material(210e3, 0.3, 7.8e-9)}
    )
    back = read_mesh(write_cdb(scaled, tmp_path / "mm.cdb"), length=1e-3)
    for a, b in zip(assemble(back), assemble(mesh, STEEL), strict=True):
        assert abs(a - b).max() <= 1e-12 * abs(b).max()


def test_blocks_without_the_columns_of_the_solid_model(tmp_path):
    mesh = named("quad8")
    back = read_mesh(write_cdb(mesh, tmp_path / "bare.cdb", solid=False))
    np.testing.assert_array_equal(back.points, mesh.points)


def test_plane_stress_is_a_key_option(tmp_path):
    back = read_mesh(write_cdb(named("quad4"), tmp_path / "thin.cdb", plane=0))
    assert back.materials["MATERIAL 1"].plane == "stress"


def test_a_triangle_of_its_own_has_six_nodes(tmp_path):
    mesh = named("tri6")
    path = write_cdb(mesh, tmp_path / "six.cdb")
    text = path.read_text().replace("DOF,DELETE", "DOF,DELETE\nKEYOP,        1, 1,        1")
    head, rest = text.split("(19i9)\n")
    rows, tail = rest.split("\n       -1\n")
    out = []
    for row in rows.splitlines():
        values = [int(row[k : k + 9]) for k in range(0, len(row), 9)]
        i, j, k, _, m, n, _, p = values[11:]
        values[8:] = [6, 0, values[10], i, j, k, m, n, p]
        out.append("".join(f"{value:9d}" for value in values))
    path.write_text(head + "(19i9)\n" + "\n".join(out) + "\n       -1\n" + tail)
    back = read_mesh(path)
    np.testing.assert_array_equal(back.blocks[0].nodes, mesh.blocks[0].nodes)


def test_loads_and_contact_are_passed_over_with_a_word(tmp_path):
    """A contact element of four nodes beside the brick, and a force."""
    mesh = named("hex8")
    path = write_cdb(mesh, tmp_path / "loaded.cdb", more="F, 3,FX  ,  1000.0 ,  0.0\nNLGEOM,ON")
    text = path.read_text().replace("DOF,DELETE", "DOF,DELETE\nET,        7,174")
    row = "".join(f"{n:9d}" for n in (2, 7, 7, 7, 0, 0, 0, 0, 4, 0, 9000, *mesh.node_labels[:4]))
    path.write_text(text.replace("(19i9)\n", f"(19i9)\n{row}\n"))
    back = read_mesh(path)
    assert back.elements == mesh.elements
    said = " ".join(map(str, back.cautions))
    line = next(k for k, text in enumerate(path.read_text().splitlines(), 1) if text[:2] == "F,")
    assert f"F (line {line})" in said
    assert "NLGEOM" in said
    assert "1 contact elements" in said
    assert "incompatible modes" in said


def test_expansion_is_passed_over_with_a_word(tmp_path):
    path = write_cdb(named("hex8"), tmp_path / "warm.cdb")
    rows = path.read_text().splitlines(keepends=True)
    (line,) = (k for k, row in enumerate(rows, 1) if "ALPX" in row)
    said = " ".join(map(str, read_mesh(path).cautions))
    assert f"ALPX (line {line}): not used; give thermal_expansion in [[material]]" in said
    path.write_text("".join(row for row in rows if "ALPX" not in row))
    assert "ALPX" not in " ".join(map(str, read_mesh(path).cautions))


REFUSED = {
    "CE": (
        "/GO",
        "CE,R5.0,DEFI, 2, 1, 0.0",
        r"line \d+: CE: is not understood; CMBLOCK, D, EBLOCK",
    ),
    "TB": ("/GO", "TB,BISO,1,1", "TB: is not understood"),
    "beam": ("ET,        1,185", "ET,        1,188", "is an element 188, which is not understood"),
    "no type": ("ET,        1,185", "", "is of type 1, which no ET names"),
    "option": ("DOF,", "KEYOP,1,6,1\nDOF,", "key option 6 = 1 of element 185"),
    "anisotropic": ("/GO", "MPDATA,R5.0, 1,EY  , 1, 1, 1.0,", "EY is not understood: isotropic"),
    "hot": ("/GO", "MPDATA,R5.0, 2,EX  , 1, 1, 1.0, 2.0,", "values at several temperatures"),
    "no number": ("/GO", "MP,EX,1,2.1E11,warm", "MP: 'WARM' is no number"),
    "shear": ("/GO", "MP,GXY,1,1.0", "GXY is not EX"),
    "moved": ("/GO", "D,3,UX,0.1", "displacements other than zero are loads"),
    "turned support": ("/GO", "D,3,ROTX,0.0", "ROTX of a solid is not understood"),
    "nodes in a row": ("/GO", "D,3,UX,0.0,0.0,20,1", "D: '20': one node and one component"),
    "components in a row": ("/GO", "D,3,UX,0.0,,,,UY,UZ", "D: 'UY': one node and one component"),
    "away": ("/GO", "D,1,UX,0.0", "line .*: D: node 1 is not there"),
    "format": ("(19i9)", "(19a9)", "the format .* is not understood"),
    "no format": ("(19i9)\n", "", "a format in brackets was expected on the next line"),
    "cut": ("\n       -1\n", "\n", "EBLOCK: ends with 'CMBLOCK"),
    "words": ("N,R5.3,LOC,", "NODES,", "NBLOCK: ends with"),
    "count": ("LAST    ,ELEM,       1", "LAST    ,ELEM,       3", "LAST: 3 numbers were announced"),
    "kind": ("WALL    ,NODE,", "WALL    ,LINE,", "components are of NODE or ELEM"),
    "density": (",DENS,", ",DAMP,", "material 1 has no DENS"),
    "one by one": ("/GO", "N,900,1.0,1.0,1.0", "nodes one by one"),
}


@pytest.mark.parametrize("case", REFUSED)
def test_what_is_not_understood_is_refused(case, tmp_path):
    old, new, said = REFUSED[case]
    path = write_cdb(named("hex8"), tmp_path / "mesh.cdb")
    text = path.read_text()
    assert old in text
    added = f"{new}\n{old}" if old == "/GO" else new
    path.write_text(text.replace(old, added, 1))
    with pytest.raises(InputError, match=said) as error:
        read_mesh(path)
    assert "mesh.cdb" in str(error.value)


def test_a_pyramid_is_refused_by_its_line(tmp_path):
    mesh = named("hex8")
    block = mesh.blocks[0]
    nodes = block.nodes.copy()
    nodes[0, 4:] = nodes[0, 4]
    path = write_cdb(replace(mesh, blocks=(replace(block, nodes=nodes),)), tmp_path / "p.cdb")
    line = 1 + path.read_text().splitlines().index("(19i9)") + 1
    with pytest.raises(InputError, match=rf"p\.cdb: line {line}: EBLOCK: element 100 has no shape"):
        read_mesh(path)


def test_a_file_without_nodes_or_not_there(tmp_path):
    (tmp_path / "none.cdb").write_text("/PREP7\n")
    with pytest.raises(InputError, match=r"none\.cdb: there are no nodes"):
        read_mesh(tmp_path / "none.cdb")
    with pytest.raises(InputError, match=r"away\.cdb: cannot be read"):
        read_mesh(tmp_path / "away.cdb")

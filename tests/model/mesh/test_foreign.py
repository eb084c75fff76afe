"""Meshes of Gmsh and VTK through meshio."""

from dataclasses import replace

import meshio
import numpy as np
import pytest
from grids import box

from microslip.errors import InputError
from microslip.model.elasticity import Material
from microslip.model.mesh.assembly import assemble
from microslip.model.mesh.element_types import TYPES
from microslip.model.mesh.facets import facets_of
from microslip.model.mesh.foreign import CELLS, read_foreign

STEEL = Material(210e9, 0.3, 7800.0)
CELL = {kind: cell for cell, kind in CELLS.items()}


def grid(kind):
    d = TYPES[kind].dimension
    return box(kind, [np.linspace(0, s, 3) for s in (1.0, 0.7, 0.4)[:d]])


def as_meshio(mesh):
    """Elements, and the faces at x = 0 in a physical group ``left``, the elements in ``body``."""
    block = mesh.blocks[0]
    d = mesh.dimension
    sides = {}
    for kind, local in block.type.faces:
        for nodes in block.nodes[:, list(local)]:
            if np.abs(mesh.points[nodes, 0]).max() < 1e-9:
                sides.setdefault(kind, []).append(nodes)
    names = {**CELL, "line2": "line", "line3": "line3"}
    cells = [(CELL[block.kind], block.nodes)]
    cells += [(names[kind], np.array(nodes)) for kind, nodes in sides.items()]
    tags = [np.full(len(block.nodes), 7), *(np.full(len(n), 3) for n in sides.values())]
    points = np.hstack([mesh.points, np.zeros((len(mesh.points), 3 - d))])
    return meshio.Mesh(
        points,
        cells,
        cell_data={"gmsh:physical": tags, "gmsh:geometrical": tags},
        field_data={"body": np.array([7, d]), "left": np.array([3, d - 1])},
    )


@pytest.mark.parametrize("ending", ["gmsh22", "vtk", "vtu"])
@pytest.mark.parametrize("kind", CELL)
def test_elements_and_groups_come_back(kind, ending, tmp_path):
    mesh = grid(kind)
    path = tmp_path / f"mesh.{'msh' if 'gmsh' in ending else ending}"
    content = as_meshio(mesh)
    if "gmsh" not in ending:
        content = meshio.Mesh(
            content.points, content.cells, cell_data={"part": content.cell_data["gmsh:physical"]}
        )
    meshio.write(path, content, file_format=ending)
    back = read_foreign(path, length=1e-3)
    body, left = ("body", "left") if "gmsh" in ending else ("part=7", "part=3")
    assert back.dimension == mesh.dimension
    assert np.allclose(back.points, 1e-3 * mesh.points)
    assert np.array_equal(back.blocks[0].nodes, mesh.blocks[0].nodes)
    assert len(back.elements_of_set(body)) == mesh.elements
    at_left = np.flatnonzero(np.abs(mesh.points[:, 0]) < 1e-9)
    assert facets_of(back, left).nodes.tolist() == at_left.tolist()
    assert back.node_sets[left].tolist() == at_left.tolist()
    moved = replace(back, points=mesh.points)
    formulation = moved.blocks[0].formulation
    same = replace(mesh, blocks=(replace(mesh.blocks[0], formulation=formulation),))
    assert abs(assemble(moved, STEEL)[0] - assemble(same, STEEL)[0]).max() < 1e-3


def test_a_file_of_gmsh_itself(tmp_path):
    """Two quadratic blocks with a coarse and a fine side, in the present format, ASCII and binary."""
    gmsh = pytest.importorskip("gmsh")
    for order, binary in ((1, 0), (2, 1)):
        gmsh.initialize(interruptible=False)
        gmsh.option.setNumber("General.Terminal", 0)
        gmsh.option.setNumber("Mesh.Binary", binary)
        gmsh.option.setNumber("Mesh.MeshSizeMax", 0.4)
        first = gmsh.model.occ.addBox(0, 0, 0, 1, 1, 0.5)
        gmsh.model.occ.synchronize()
        gmsh.model.addPhysicalGroup(3, [first], name="block")
        top = gmsh.model.getEntitiesInBoundingBox(-0.1, -0.1, 0.49, 1.1, 1.1, 0.51, 2)
        gmsh.model.addPhysicalGroup(2, [tag for _, tag in top], name="top")
        gmsh.model.mesh.generate(3)
        gmsh.model.mesh.setOrder(order)
        path = tmp_path / f"block{order}.msh"
        gmsh.write(str(path))
        gmsh.finalize()
        mesh = read_foreign(path)
        assert mesh.blocks[0].kind == ("tet4", "tet10")[order - 1]
        mass = assemble(mesh, {"block": STEEL})[1]
        assert mass.sum() / 3 == pytest.approx(7800 * 0.5, rel=1e-12)
        facets = facets_of(mesh, "top")
        assert sum(facets.areas(g).sum() for g in facets.groups) == pytest.approx(1.0, rel=1e-12)


def test_what_is_no_mesh_of_elements_is_refused(tmp_path):
    with pytest.raises(InputError, match="cannot be read"):
        read_foreign(tmp_path / "away.msh")
    (tmp_path / "text.msh").write_text("nothing\n")
    with pytest.raises(InputError, match=r"text\.msh: meshio cannot read it"):
        read_foreign(tmp_path / "text.msh")
    with pytest.raises(InputError, match=r"the ending must be one of \.msh"):
        read_foreign(tmp_path / "mesh.stl")
    points = np.random.default_rng(0).uniform(size=(5, 3))
    for cells, message in (
        ([("pyramid", np.array([[0, 1, 2, 3, 4]]))], "1 cells 'pyramid' are not understood"),
        ([("line", np.array([[0, 1]]))], "there are no elements"),
        ([("triangle", np.array([[0, 1, 2], [1, 2, 3]]))], "must lie in a plane"),
    ):
        meshio.write(tmp_path / "bad.vtu", meshio.Mesh(points, cells))
        with pytest.raises(InputError, match=message):
            read_foreign(tmp_path / "bad.vtu")


@pytest.mark.parametrize("version", [2.2, 4.1])
def test_a_cell_may_be_in_several_physical_groups(version, tmp_path):
    """As gmsh itself writes it: 2.2 repeats the cells of every group, 4.1 numbers the groups of an entity."""
    gmsh = pytest.importorskip("gmsh")
    gmsh.initialize(interruptible=False)
    try:
        gmsh.option.setNumber("General.Terminal", 0)
        gmsh.option.setNumber("Mesh.MshFileVersion", version)
        for i in range(2):
            gmsh.model.occ.addBox(2.0 * i, 0, 0, 1, 1, 1)
        gmsh.model.occ.synchronize()
        ends = [
            tag
            for _, tag in gmsh.model.getEntities(2)
            if abs(gmsh.model.occ.getCenterOfMass(2, tag)[0] % 2) < 1e-9
        ]
        gmsh.model.addPhysicalGroup(2, ends[:1], name="one")
        gmsh.model.addPhysicalGroup(2, ends, name="both")
        gmsh.model.addPhysicalGroup(3, [1], name="first")
        gmsh.model.addPhysicalGroup(3, [1, 2], name="all")
        gmsh.model.mesh.generate(3)
        gmsh.write(str(tmp_path / "groups.msh"))
    finally:
        gmsh.finalize()
    mesh = read_foreign(tmp_path / "groups.msh")
    area = {
        name: sum(facets_of(mesh, name).areas(g).sum() for g in facets_of(mesh, name).groups)
        for name in ("one", "both")
    }
    assert area == pytest.approx({"one": 1.0, "both": 2.0})
    count = sum(len(block.nodes) for block in mesh.blocks)
    assert len(mesh.element_sets["all"]) == count
    assert 0 < len(mesh.element_sets["first"]) < count
    one = np.zeros(3 * len(mesh.points))
    one[::3] = 1.0
    assert one @ assemble(mesh, STEEL)[1] @ one == pytest.approx(2 * STEEL.density)


def test_an_entity_of_two_groups_is_in_both(tmp_path):
    """Two squares side by side: the left end is in both groups, the right end in one.

    Each square is an entity, and the right one has its nodes clockwise: it is turned as a whole.
    """
    text = """$MeshFormat
4.1 0 8
$EndMeshFormat
$PhysicalNames
3
1 1 "one"
1 2 "both"
2 3 "body"
$EndPhysicalNames
$Entities
0 2 2 0
1 0 0 0 0 1 0 2 1 2 0
2 2 0 0 2 1 0 1 2 0
1 0 0 0 1 1 0 1 3 0
2 1 0 0 2 1 0 1 3 0
$EndEntities
$Nodes
1 6 1 6
2 1 0 6
1
2
3
4
5
6
0 0 0
1 0 0
2 0 0
0 1 0
1 1 0
2 1 0
$EndNodes
$Elements
4 4 1 4
1 1 1 1
1 1 4
1 2 1 1
2 3 6
2 1 3 1
3 1 2 5 4
2 2 3 1
4 5 6 3 2
$EndElements
"""
    (tmp_path / "ends.msh").write_text(text)
    mesh = read_foreign(tmp_path / "ends.msh")
    assert list(mesh.node_sets["one"]) == [0, 3]
    assert list(mesh.node_sets["both"]) == [0, 2, 3, 5]
    assert list(mesh.element_sets["body"]) == [0, 1]
    assert assemble(mesh, STEEL)[1].sum() == pytest.approx(2 * 2 * STEEL.density)


def test_an_empty_file_says_so(tmp_path):
    (tmp_path / "none.msh").write_text("")
    with pytest.raises(InputError, match=r"none\.msh: the file is empty"):
        read_foreign(tmp_path / "none.msh")

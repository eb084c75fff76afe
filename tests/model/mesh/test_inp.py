"""Input decks of Abaqus and CalculiX: what is read, and what is refused."""

import re
import shutil
import subprocess
from dataclasses import replace

import numpy as np
import pytest
import scipy.sparse.linalg as spla
from grids import box
from lap_as_mesh import lap_as_mesh
from test_lap_as_mesh import of_mesh, same
from write_inp import TYPES, write_inp

import microslip
from microslip.errors import InputError
from microslip.model.elasticity import Material
from microslip.model.mesh.abaqus.inp import read_inp
from microslip.model.mesh.assembly import assemble
from microslip.model.mesh.facets import facets_of
from microslip.model.mesh.finite_elements import Section

STEEL = Material(210e9, 0.3, 7800.0)


def test_the_reference_joint_as_a_deck_is_the_lap_joint(tmp_path):
    joint = microslip.reference_joint(pairs=21)
    mesh = read_inp(write_inp(lap_as_mesh(joint), tmp_path / "lap.inp"))
    meshed, lap = of_mesh(joint, mesh)
    assert same(meshed.structure.stiffness, lap.stiffness)
    assert same(meshed.structure.mass, lap.mass)
    assert same(meshed.structure.interface.relative, lap.interface.relative)


@pytest.mark.parametrize("kind", TYPES)
def test_a_mesh_comes_back_as_it_was(kind, tmp_path):
    axes = [
        np.linspace(0, s, 3) for s in (1.0, 0.7, 0.4)[: 2 + (kind[:3] in ("tet", "hex", "wed"))]
    ]
    mesh = box(kind, axes, formulation="incompatible" if kind == "hex8" else "full")
    mesh = replace(
        mesh,
        element_sets={"BODY": np.arange(mesh.elements)},
        node_sets={"some": np.array([0, 3])},
        materials={"steel": STEEL},
        sections=(Section("BODY", "steel"),),
    )
    back = read_inp(write_inp(mesh, tmp_path / "mesh.inp"))
    assert np.array_equal(back.points, mesh.points)
    assert np.array_equal(back.blocks[0].nodes, mesh.blocks[0].nodes)
    assert back.node_sets["some"].tolist() == [0, 3]
    K, M = assemble(mesh)
    K2, M2 = assemble(back)
    assert abs(K - K2).max() == 0
    assert abs(M - M2).max() == 0


ASSEMBLY = """*Heading
** two cubes, the second moved and turned
*Part, name=Cube
*Node
1, 0, 0, 0
2, 1, 0, 0
3, 1, 1, 0
4, 0, 1, 0
*System
0, 0, 1, 0, 1, 1
-1, 0, 1
*Node, nset=top
5, 0, 0, 0
6, 0, -1, 0
7, 1, -1, 0
8, 1, 0, 0
*System
*Element, type=C3D8I, elset=all
1, 1, 2, 3, 4,
5, 6, 7, 8
*Elset, elset=set-1, generate
1, 1, 1
*Surface, name=upper, type=element
set-1, S2
*Surface, name=low, type=node
1
2
3
4
*Solid section, elset=all, material="Soft steel"
,
*End part
*Assembly, name=A
*Instance, name=one, part=cube
*End instance
*Instance, name=Two, part=Cube
0., 0., 1.001
0., 0., 0., 0., 0., 1., 90.
*End instance
*Node
1, 0.5, 0.5, 3.0
*Nset, nset=ref
1
*Nset, nset=tops, instance=Two
5, 6, 7, 8
*Nset, nset=mixed
one.top, Two.1
*Element, type=MASS, elset=lump
1, 1
*Mass, elset=lump
2.5e-3
*Tie, name=weld, position tolerance=0.01, adjust=yes
Two.low, one.upper
*Coupling, constraint name=pilot, ref node=ref, surface=Two.upper
*Kinematic
1, 6
*Equation
2
one.1, 1, 1., one.2, 1, -1.
*Boundary
one.1, 1, 3
one.top, ENCASTRE
*End assembly
*Material, name="Soft steel"
*Density
7.8e-9,
*Elastic
200000., 0.3
*Surface interaction, name=i
*Friction
0.2,
*Step
*Static
*Cload
ref, 1, 3.
*End step
"""


def written(tmp_path, text):
    path = tmp_path / "deck.inp"
    path.write_text(text)
    return path


def test_parts_instances_and_everything_between_them(tmp_path):
    mesh = read_inp(written(tmp_path, ASSEMBLY), length=1e-3)
    assert mesh.dimension == 3
    assert mesh.elements == 2
    assert len(mesh.points) == 17
    cube = np.array(
        [[0, 0, 0], [1, 0, 0], [1, 1, 0], [0, 1, 0], [0, 0, 1], [1, 0, 1], [1, 1, 1], [0, 1, 1]]
    )
    # the x of *System is the y of the deck, its y the -x
    first = mesh.points[:8] * 1e3
    assert np.allclose(first[:4], cube[:4])
    assert np.allclose(first[4:], cube[4:])
    second = mesh.points[8:16] * 1e3
    turned = np.column_stack([-cube[:, 1], cube[:, 0], cube[:, 2] + 1.001])
    assert np.allclose(second, turned)
    assert mesh.node_sets["tops"].tolist() == [12, 13, 14, 15]
    assert sorted(mesh.node_sets["mixed"]) == [4, 5, 6, 7, 8]
    assert mesh.node_sets["one.top"].tolist() == [4, 5, 6, 7]
    assert mesh.masses == {16: 2.5}
    assert mesh.materials["Soft steel"] == Material(
        pytest.approx(200e9), 0.3, pytest.approx(7800.0)
    )
    assert mesh.ties[0].slave == "Two.low"
    assert mesh.ties[0].tolerance == pytest.approx(1e-5)
    assert facets_of(mesh, "Two.low").nodes.tolist() == [8, 9, 10, 11]
    assert facets_of(mesh, "one.upper").nodes.tolist() == [4, 5, 6, 7]
    assert mesh.couplings[0].reference == 16
    assert mesh.equations[0].terms == ((0, 0, 1.0), (1, 0, -1.0))
    assert {tuple(row) for row in mesh.held} >= {(0, 0), (0, 1), (0, 2), (4, 0), (7, 5)}
    said = [str(caution) for caution in mesh.cautions]
    line = 1 + ASSEMBLY.splitlines().index("*Surface interaction, name=i")
    assert any(f"deck.inp:{line}: *SURFACE INTERACTION" in text for text in said)
    assert any("*STEP" in text and "not used" in text for text in said)
    assert assemble(mesh)[0].shape == (51, 51)


REFUSED = [
    (
        "*Shell section, elset=all, material=m\n1.\n",
        r"deck.inp:\d+: \*SHELL SECTION: solid elements alone",
    ),
    ("*Rigid body, nset=top, ref node=1\n", r"\*RIGID BODY: write it as \*COUPLING"),
    (
        "*Pre-tension section, surface=s, node=1\n",
        r"name its surface as section of a \[\[preload\]\]",
    ),
    ("*Frobnicate\n", r"\*FROBNICATE: this keyword is not understood"),
    ("*Element, type=S9R5\n9, 1, 2\n", r"\*ELEMENT: elements of type S9R5 are not understood"),
    ("*Nset, nset=a, shape=round\n1\n", r"\*NSET: the parameter SHAPE is not understood"),
    ("*Element, type=C3D4\n9, 1, 2, 3\n", r"an element C3D4 has 4 nodes, and 3 are given"),
    ("*Element, type=C3D4\n9, 1, 2, 3, 77\n", r"element 9: there is no node 77"),
    ("*Node\n1, 0, 0, 0\n", "node 1 is given twice"),
    ("*Node\n20, zero, 0, 0\n", r"deck.inp:\d+: value 2 is 'zero': it must be a number"),
    ("*Nset, nset=b, generate\n1, 4, 2\n", "GENERATE from 1 to 4 by 2"),
    ("*Elset, elset=c\nnowhere\n", "there is no element set 'nowhere' here; there is all, set-1"),
    ("*Surface, name=s\nall, SNEG\n", "face 'SNEG': S1 to S6 are understood"),
    ("*Boundary\n1, 1, 1, 0.5\n", "displacements other than zero"),
]


@pytest.mark.parametrize(("more", "message"), REFUSED)
def test_what_is_not_understood_is_refused_by_keyword_and_line(more, message, tmp_path):
    text = ASSEMBLY.replace("*End part\n", f"{more}*End part\n")
    with pytest.raises(InputError, match=message):
        read_inp(written(tmp_path, text))


def test_a_section_without_material_and_a_tie_without_surface_are_named(tmp_path):
    with pytest.raises(InputError, match="there is no material 'gold'; there is Soft steel"):
        read_inp(written(tmp_path, ASSEMBLY.replace('material="Soft steel"', "material=gold")))
    with pytest.raises(InputError, match=r"there is no surface 'Two\.high'; there is one\.upper"):
        read_inp(written(tmp_path, ASSEMBLY.replace("Two.low, one", "Two.high, one")))
    with pytest.raises(InputError, match="no part 'Ball'; there is Cube"):
        read_inp(written(tmp_path, ASSEMBLY.replace("name=one, part=cube", "name=one, part=Ball")))


def test_included_files_stand_in_their_place(tmp_path):
    head, tail = ASSEMBLY.split("*Material")
    (tmp_path / "rest.inp").write_text("*Material" + tail)
    mesh = read_inp(written(tmp_path, head + "*Include, input=rest.inp\n"))
    assert "Soft steel" in mesh.materials
    with pytest.raises(InputError, match=r"away\.inp: cannot be read"):
        read_inp(written(tmp_path, head + "*Include, input=away.inp\n"))


STEPS = """*BOUNDARY
root, 1, 3
*STEP
*FREQUENCY
6
*END STEP
*STEP
*STATIC
*CLOAD
tip, 2, 100.0
tip, 3, 50.0
*NODE PRINT, NSET=tip
U
*END STEP
"""


@pytest.mark.skipif(shutil.which("ccx") is None, reason="CalculiX is not installed")
@pytest.mark.parametrize("kind", ["hex20", "hex8", "tet10", "tet4"])
def test_displacements_and_frequencies_are_those_of_calculix_on_the_same_deck(kind, tmp_path):
    """Frequencies of hexahedra alone: CalculiX integrates the mass of tetrahedra with fewer points."""
    mesh = box(kind, [np.linspace(0, 0.2, 7), np.linspace(0, 0.03, 3), np.linspace(0, 0.02, 2)])
    mesh = replace(
        mesh,
        element_sets={"BODY": np.arange(mesh.elements)},
        node_sets={
            "root": np.flatnonzero(mesh.points[:, 0] < 1e-9),
            "tip": np.flatnonzero(mesh.points[:, 0] > 0.2 - 1e-9),
        },
        materials={"steel": STEEL},
        sections=(Section("BODY", "steel"),),
    )
    path = write_inp(mesh, tmp_path / "beam.inp", STEPS)
    subprocess.run(["ccx", "-i", "beam"], cwd=tmp_path, check=True, capture_output=True)
    text = (tmp_path / "beam.dat").read_text()
    back = read_inp(path)
    K, M = assemble(back)
    held = np.zeros(back.points.shape, bool)
    held[back.held[:, 0], back.held[:, 1]] = True
    free = ~held.ravel()
    load = np.zeros(back.points.shape)
    load[back.node_sets["tip"]] = [0.0, 100.0, 50.0]
    u = np.zeros(back.points.size)
    u[free] = spla.spsolve(K[free][:, free].tocsc(), load.ravel()[free])
    _, table = text.split("displacements")
    rows = np.array([line.split() for line in table.splitlines()[1:] if line.strip()], float)
    ours = u.reshape(-1, 3)[rows[:, 0].astype(int) - 1]
    assert np.abs(ours - rows[:, 1:]).max() < 2e-6 * np.abs(ours).max()
    if kind != "hex20":
        return
    frequencies = re.findall(r"^\s+\d+\s+\S+\s+\S+\s+(\S+)\s+\S+\s*$", text, re.M)[:6]
    values = spla.eigsh(
        K[free][:, free].tocsc(),
        k=6,
        M=M[free][:, free].tocsc(),
        sigma=0.0,
        return_eigenvectors=False,
    )
    calculix = np.array([float(value) for value in frequencies])
    assert np.sqrt(np.sort(values)) / (2 * np.pi) == pytest.approx(calculix, rel=1e-6)

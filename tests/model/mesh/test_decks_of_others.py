"""Decks as other programs write them: couplings, materials, surface elements, supports in steps, ties."""

from __future__ import annotations

import re
from dataclasses import replace

import numpy as np
import pytest
from grids import box
from mesh_files import plates_document
from test_inp import STEEL
from write_inp import write_inp

from microslip.describe.reading import parse_joint
from microslip.errors import InputError, ModelError
from microslip.model.mesh.abaqus.inp import read_inp
from microslip.model.mesh.assembly import assemble
from microslip.model.mesh.boundary import surface_of_nodes, with_surfaces
from microslip.model.mesh.constraints import constraints_of, free_displacements, rotations_of
from microslip.model.mesh.facets import facets_of
from microslip.model.mesh.finite_elements import Section
from microslip.model.mortar.ties import tied
from microslip.pipeline.prepare import assemble as prepared


def beam(folder, more="", kind="hex8"):
    """A bar with its end named, and node 900 off it, in the middle."""
    axes = [np.linspace(0, 4, 5), np.linspace(-1, 1, 3), np.linspace(-1, 1, 3)]
    mesh = box(kind, axes, formulation="incompatible" if kind == "hex8" else "full")
    end = surface_of_nodes(mesh.blocks, np.flatnonzero(mesh.points[:, 0] > 4 - 1e-9))
    mesh = with_surfaces(
        replace(
            mesh,
            element_sets={"BODY": np.arange(mesh.elements)},
            materials={"steel": STEEL},
            sections=(Section("BODY", "steel"),),
        ),
        {"end": end},
    )
    path = write_inp(mesh, folder / "bar.inp", "*NODE, NSET=RP\n900, 5.0, 0.0, 0.0\n" + more)
    return mesh, path


COUPLED = "*COUPLING, CONSTRAINT NAME=c, REF NODE=RP, SURFACE=end{}\n*DISTRIBUTING{}\n{}"


@pytest.mark.parametrize(
    "usual", [", WEIGHTING METHOD=UNIFORM", ", weighting method=Uniform, coupling=CONTINUUM"]
)
def test_what_is_usual_of_a_coupling_may_be_said(usual, tmp_path):
    _, plain = beam(tmp_path, COUPLED.format("", "", ""))
    one = read_inp(plain)
    _, said = beam(tmp_path, COUPLED.format("", usual, ""))
    other = read_inp(said)
    rows = [constraints_of(mesh, rotations_of(mesh)).rows for mesh in (one, other)]
    assert abs(rows[0] - rows[1]).max() == 0


@pytest.mark.parametrize("other", ["WEIGHTING METHOD=QUADRATIC", "COUPLING=STRUCTURAL"])
def test_what_is_not_usual_of_a_coupling_is_refused(other, tmp_path):
    _, path = beam(tmp_path, COUPLED.format("", f", {other}", ""))
    with pytest.raises(InputError, match=rf"\*DISTRIBUTING: {other}: \w+ alone is understood"):
        read_inp(path)


@pytest.mark.parametrize("kind", ["DISTRIBUTING", "KINEMATIC"])
def test_a_coupling_reaches_as_far_as_its_radius(kind, tmp_path):
    """Of nine nodes of the end the middle and four others lie within 1.5 of the node that is 1 off it."""
    text = COUPLED.format(", INFLUENCE RADIUS=1.5", "", "").replace("DISTRIBUTING", kind)
    mesh = read_inp(beam(tmp_path, text)[1])
    rows = constraints_of(mesh, rotations_of(mesh)).rows
    felt = np.unique(rows.indices[rows.indices < mesh.points.size] // 3)
    near = np.linalg.norm(mesh.points - mesh.points[-1], axis=1) <= 1.5
    assert felt.tolist() == np.flatnonzero(near).tolist()
    assert near.sum() == 6
    # a rigid motion fits whatever follows
    turn = np.array([0.3, -0.2, 0.7])
    u = np.cross(turn, mesh.points) + np.array([1.0, 2.0, 3.0])
    assert np.abs(rows @ np.concatenate([u.ravel(), turn])).max() < 1e-12
    far = read_inp(beam(tmp_path, text.replace("1.5", "0.5"))[1])
    turns = rotations_of(far)
    with pytest.raises(ModelError, match="no node of surface 'end' lies within the influence"):
        constraints_of(far, turns)


def test_rotations_that_a_distributing_coupling_leaves_out_turn_alone(tmp_path):
    """Held, they hold nothing of the bar: of its six free motions the three turns are left."""
    mesh = read_inp(beam(tmp_path, COUPLED.format("", "", "1, 3\n"))[1])
    rotations = rotations_of(mesh)
    constraints = constraints_of(mesh, rotations)
    node = len(mesh.points) - 1
    held = np.concatenate([3 * node + np.arange(3), rotations.of(node)])
    T, _ = free_displacements(constraints, held)
    K = T[: mesh.points.size].T @ assemble(mesh)[0] @ T[: mesh.points.size]
    values = np.linalg.eigvalsh(K.toarray())
    assert (values < 1e-9 * values.max()).sum() == 3
    whole = read_inp(beam(tmp_path, COUPLED.format("", "", "1, 6\n"))[1])
    assert constraints_of(whole, rotations_of(whole)).rows.shape[0] == 6


def test_old_couplings_say_what_to_write(tmp_path):
    _, path = beam(tmp_path, "*ELEMENT, TYPE=DCOUP3D, ELSET=d\n900, 900\n")
    with pytest.raises(
        InputError, match=r"type DCOUP3D are not understood; write what it couples as \*SURF"
    ):
        read_inp(path)


# -- materials -------------------------------------------------------------------------------------


def without_density(folder):
    document = plates_document(folder) | {"analysis": {"cycle": {"force": [1e3]}}}
    path = folder / "plates.inp"
    path.write_text(re.sub(r"\*DENSITY\n[^*]*", "", path.read_text()))
    return document


def test_a_deck_without_density_takes_that_of_the_joint_file(tmp_path):
    document = without_density(tmp_path)
    with pytest.raises(InputError, match=r"plates.inp:\d+: \*MATERIAL: 'steel' has no \*DENSITY"):
        prepared(parse_joint(document, "plates", tmp_path))
    steel = {"youngs_modulus": 210e9, "poissons_ratio": 0.3, "density": 7850.0}
    found = prepared(parse_joint(document | {"material": steel}, "plates", tmp_path))
    whole = plates_document(tmp_path) | {"analysis": document["analysis"], "material": steel}
    expected = prepared(parse_joint(whole, "plates", tmp_path))
    assert abs(found.structure.mass - expected.structure.mass).max() == 0
    assert abs(found.structure.stiffness - expected.structure.stiffness).max() == 0


def test_constants_of_other_materials_are_named_as_such(tmp_path):
    _, path = beam(tmp_path)
    many = "*ELASTIC, TYPE=ENGINEERING CONSTANTS\n1., 1., 1., .3, .3, .3, 1., 1.\n1.\n"
    path.write_text(re.sub(r"\*ELASTIC\n[^*]*", many, path.read_text()))
    with pytest.raises(InputError, match="TYPE=ENGINEERING CONSTANTS: isotropic materials alone"):
        read_inp(path)


# -- surface elements ------------------------------------------------------------------------------

SHELLS = {"hex8": ("CPS4", 4), "tet10": ("CPS6", 6), "hex20": ("S8R", 8), "tet4": ("M3D3", 3)}


def with_skin(folder, kind, elset="GROUP"):
    """The bar with elements on its end, as gmsh writes a physical surface."""
    mesh, path = beam(folder, kind=kind)
    name, size = SHELLS[kind]
    lines = [f"*ELEMENT, TYPE={name}, ELSET={elset}"]
    for k, nodes in enumerate(facets_of(mesh, "end").groups[0].nodes):
        assert len(nodes) == size
        lines.append(", ".join(map(str, [5000 + k, *mesh.node_labels[nodes]])))
    path.write_text(path.read_text() + "\n".join(lines) + "\n")
    return mesh, path


@pytest.mark.parametrize("kind", SHELLS)
def test_elements_on_bodies_are_left_out_and_name_surfaces(kind, tmp_path):
    mesh, path = with_skin(tmp_path, kind)
    line = 1 + next(
        k for k, text in enumerate(path.read_text().splitlines()) if "ELSET=GROUP" in text
    )
    found = read_inp(path)
    assert found.elements == mesh.elements
    own, end = found.surfaces["GROUP"], found.surfaces["end"]
    assert sorted(zip(own.elements, own.faces, strict=True)) == sorted(
        zip(end.elements, end.faces, strict=True)
    )
    assert "GROUP" not in found.element_sets
    count, name = len(own.elements), SHELLS[kind][0]
    said = f"bar.inp:{line + 1}, {count} elements {name}: left out"
    assert any(said in str(caution) for caution in found.cautions)
    K, M = assemble(found)
    K2, M2 = assemble(mesh)
    n = mesh.points.size
    assert abs(K[:n, :n] - K2).max() == 0
    assert abs(M[:n, :n] - M2).max() == 0


def test_elements_with_a_section_or_nodes_of_their_own_are_refused(tmp_path):
    _, path = with_skin(tmp_path, "hex8")
    text = path.read_text()
    path.write_text(text + "*SOLID SECTION, ELSET=GROUP, MATERIAL=steel\n")
    with pytest.raises(
        InputError, match=r"bar.inp:\d+: \*SOLID SECTION: .* 4 elements CPS4 \(bar.inp:"
    ):
        read_inp(path)
    path.write_text(text + "*ELEMENT, TYPE=CPS4\n6000, 900, 1, 2, 3\n")
    with pytest.raises(
        InputError, match=r"bar.inp:\d+: element 6000 of type CPS4 stands beside solid"
    ):
        read_inp(path)


# -- supports and ties -----------------------------------------------------------------------------


STEP = "*STEP\n*STATIC\n*BOUNDARY\n1, 1, 3\n*END STEP\n"


def test_supports_of_the_only_step_hold_as_those_outside(tmp_path):
    document = plates_document(tmp_path) | {"analysis": {"cycle": {"force": [1e3]}}}
    path = tmp_path / "plates.inp"
    outside, held = path.read_text(), "*BOUNDARY\n1, 1, 3\n"
    path.write_text(outside + held)
    expected = prepared(parse_joint(document, "plates", tmp_path))
    path.write_text(outside + f"*STEP\n*FREQUENCY\n{held}*END STEP\n*STEP\n*STATIC\n*END STEP\n")
    found = prepared(parse_joint(document, "plates", tmp_path))
    assert abs(found.structure.stiffness - expected.structure.stiffness).max() == 0
    assert any("supports of the only *STEP" in str(each) for each in found.imported.cautions)


@pytest.mark.parametrize(
    "steps",
    [
        STEP + STEP,
        STEP.replace("1, 1, 3", "1, 1, 3, 0.1"),
        STEP.replace("*BOUNDARY", "*BOUNDARY, OP=NEW"),
        STEP.replace("*BOUNDARY", "*BOUNDARY, TYPE=VELOCITY"),
    ],
)
def test_supports_that_a_step_changes_are_named_where_nothing_holds_the_joint(steps, tmp_path):
    document = plates_document(tmp_path) | {"analysis": {"cycle": {"force": [1e3]}}}
    path = tmp_path / "plates.inp"
    path.write_text(path.read_text() + steps)
    lines = path.read_text().splitlines()
    line = 1 + next(n for n, text in enumerate(lines) if text.startswith("*BOUNDARY"))
    said = (
        r"supports inside \*STEP are not read where several steps have some, or they move "
        rf"\(plates.inp:{line}: \*BOUNDARY"
    )
    found = prepared(parse_joint(document, "plates", tmp_path))
    assert any("supports inside *STEP" in str(caution) for caution in found.imported.cautions)
    del document["support"]
    with pytest.raises(InputError, match=r"nothing holds .*" + said):
        prepared(parse_joint(document, "plates", tmp_path))


@pytest.mark.parametrize("gap", [0.0, 0.01])
def test_a_tie_that_must_not_be_adjusted_holds_what_touches_alone(gap, tmp_path):
    """Two bars end to end."""
    axes = [np.linspace(-1, 1, 3)] * 2
    lower = box("hex8", [np.linspace(0, 1, 2), *axes])
    blocks = lower.blocks[0]
    n, e = len(lower.points), lower.elements
    mesh = replace(
        lower,
        points=np.vstack([lower.points, lower.points + np.array([1 + gap, 0, 0])]),
        node_labels=1 + np.arange(2 * n),
        blocks=(
            replace(
                blocks,
                nodes=np.vstack([blocks.nodes, blocks.nodes + n]),
                labels=1 + np.arange(2 * e),
            ),
        ),
    )
    ends = {
        "left": np.flatnonzero(np.abs(mesh.points[:n, 0] - 1) < 1e-9),
        "right": n + np.flatnonzero(np.abs(mesh.points[n:, 0] - 1 - gap) < 1e-9),
    }
    mesh = with_surfaces(mesh, {k: surface_of_nodes(mesh.blocks, v) for k, v in ends.items()})
    for adjust in ("YES", "NO"):
        tie = f"*TIE, NAME=t, ADJUST={adjust}, POSITION TOLERANCE=0.1\nright, left\n"
        back = read_inp(write_inp(mesh, tmp_path / "bars.inp", tie))
        if gap and adjust == "NO":
            with pytest.raises(
                ModelError, match=r"tie 't' \(bars.inp:\d+: \*TIE\): ADJUST=NO, .* 0.01 m off"
            ):
                tied(back, back.ties[0])
        else:
            assert tied(back, back.ties[0])[1].rows.shape[0] == 27


# -- reference nodes -------------------------------------------------------------------------------


def with_reference(folder, kind, row="", **changed):
    """The bolted plates with a node 10 mm off the free end that its face is coupled with."""
    document = plates_document(folder) | {"analysis": {"cycle": {"force": [1e3]}}}
    path = folder / "plates.inp"
    path.write_text(
        path.read_text()
        + "*NODE, NSET=RP\n9001, 90.0, 1.0, 4.0\n"
        + f"*COUPLING, CONSTRAINT NAME=c, REF NODE=RP, SURFACE=right\n*{kind}\n{row}"
    )
    return document | changed


AXIS = [0.0, 3.0, 4.0]


@pytest.mark.parametrize("opposite", [None, "right"])
@pytest.mark.parametrize("kind", ["KINEMATIC", "DISTRIBUTING"])
def test_a_moment_on_a_reference_node_works_on_its_rotation(kind, opposite, tmp_path):
    """On a rigid turn of the free plate, theta times the unit axis; with its opposite on a face nothing."""
    port = {"name": "twist", "kind": "moment", "on": "RP", "direction": AXIS}
    document = with_reference(
        tmp_path,
        kind,
        port=port if opposite is None else port | {"opposite": opposite, "direction": "y"},
        output=[{"name": "turn", "quantity": "rotation", "on": "RP", "direction": AXIS}],
        load={"moment": [10.0]},
        analysis={"cycle": {"moment": [10.0]}},
    )
    found = prepared(parse_joint(document, "plates", tmp_path))
    meshed = found.imported.meshed
    mesh, theta = meshed.mesh, np.array([0.2, -0.5, 0.9])
    upper = np.unique(
        np.concatenate(
            [
                block.nodes[np.isin(start + np.arange(block.count), mesh.element_sets["upper"])]
                for block, start in zip(mesh.blocks, mesh.starts, strict=False)
            ]
        )
    )
    node = mesh.node_sets["RP"][0]
    u = np.zeros((len(mesh.points), 3))
    u[[*upper, node]] = np.cross(theta, mesh.points[[*upper, node]]) + 0.3
    whole = np.concatenate([u.ravel(), theta])
    # the structure's own displacements give the rest back
    assert np.abs(meshed.basis @ whole[found.structure.free] - whole).max() < 1e-9
    turned = theta @ AXIS / 5
    assert found.structure.loads[found.joint.measured[0].port] @ whole[
        found.structure.free
    ] == pytest.approx(turned)
    work = found.structure.loads["twist"] @ whole[found.structure.free]
    if opposite is None:
        assert work == pytest.approx(turned, rel=1e-9)
    else:
        assert abs(work) < 1e-9


def test_what_a_coupling_leaves_out_and_a_node_alone_are_named(tmp_path):
    port = {"name": "push", "kind": "force", "on": "RP", "direction": "z"}
    document = with_reference(tmp_path, "KINEMATIC", "1, 1\n", port=port)
    with pytest.raises(
        InputError, match=r"or not coupled: .* coupling 'c' couples the components 1 alone"
    ):
        prepared(parse_joint(document, "plates", tmp_path))
    moment = {"name": "twist", "kind": "moment", "on": "RP", "direction": "y"}
    wanted = {"load": {"moment": [1.0]}, "analysis": {"cycle": {"moment": [1.0]}}}
    document = with_reference(tmp_path, "DISTRIBUTING", "1, 3\n", port=moment, **wanted)
    with pytest.raises(
        InputError, match=r"or not coupled: .* couples the components 1, 2, 3 alone"
    ):
        prepared(parse_joint(document, "plates", tmp_path))
    document = with_reference(tmp_path, "KINEMATIC", port=moment | {"on": "ONE"}, **wanted)
    with (tmp_path / "plates.inp").open("a") as deck:
        deck.write("*NSET, NSET=ONE\n1\n")
    with pytest.raises(InputError, match="a moment on node 1 alone has no arm: reference nodes"):
        prepared(parse_joint(document, "plates", tmp_path))

"""Matrices with pairs in space: joints from meshes again, by B and by nodes; units, tangents, mistakes."""

from __future__ import annotations

import json

import numpy as np
import pytest
from matrices_files import by_nodes, mesh_as_matrices, sparse_parts
from mesh_files import matching_document, plates_document
from same_joint import SAME, differ
from typer.testing import CliRunner

from microslip.analyses.statics.cycle import quasi_static_cycle
from microslip.cli.check import app as check
from microslip.cli.run import app as command
from microslip.describe.reading import parse_joint
from microslip.errors import InputError
from microslip.pipeline.geometry import geometry_of
from microslip.pipeline.prepare import assemble
from microslip.pipeline.run import run
from microslip.results.store import load_run

REQUESTS = {
    "cycle": {"force": ["5 kN/m", "30 kN/m"], "steps": 60},
    "response": {"count": 41},
    "reduced": {"amplitudes": 6},
    "harmonic": {"frequencies": [158.0, 161.0], "harmonics": 3, "stability": False},
}

REDUCED = 1e-6
"""Asked of the responses of reduced models, whose cycles close to 1e-5 of the largest reaction."""


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    return tmp_path_factory.mktemp("space")


@pytest.fixture(scope="module")
def matching(folder):
    return matching_document(folder) | {"analysis": REQUESTS}


@pytest.fixture(scope="module")
def as_mesh(matching, folder):
    return run(parse_joint(matching, "mesh", folder))


@pytest.fixture(scope="module")
def nodes_document(as_mesh, matching, folder):
    return by_nodes(as_mesh.assembly.imported, matching, folder)


@pytest.fixture(scope="module")
def by_node(nodes_document, folder):
    return run(parse_joint(nodes_document, "nodes", folder))


def found(document, folder):
    return assemble(parse_joint(document, "matrices", folder))


def check_same(one, other):
    assert not other.failures
    for name in ("sliding_omega", "stuck_omega", "overlap"):
        assert differ(getattr(one.mode, name), getattr(other.mode, name)) < SAME
    assert differ(one.prestress.pressure, other.prestress.pressure) < SAME
    assert differ(one.assembly.opening_moment, other.assembly.opening_moment) < SAME
    for drive, cycles in one.cycles.items():
        for a, b in zip(cycles, other.cycles[drive], strict=True):
            assert a.dissipated > 0
            assert differ(a.r, b.r) < SAME
            assert differ(a.dissipated, b.dissipated) < SAME
    # at resonance a difference of frequency counts 1 / (2 zeta) times
    quality = 1 / (one.joint.damping.beta * one.mode.sliding_omega)
    for a, b in zip(one.harmonic, other.harmonic, strict=True):
        for p, q in zip(a.points, b.points, strict=True):
            assert differ(p.amplitude, q.amplitude) < quality * SAME
    for a, b in zip(one.responses, other.responses, strict=True):
        np.testing.assert_allclose(a.frequency, b.frequency, rtol=1e-6)
        assert differ(a.amplitude, b.amplitude) < REDUCED


def test_a_matching_mesh_answers_the_same_as_pairs_of_nodes_and_normals(as_mesh, by_node):
    assert by_node.model.dimension == 3
    check_same(as_mesh, by_node)


def test_and_as_a_matrix_of_relative_displacements(as_mesh, matching, folder):
    document = mesh_as_matrices(as_mesh.assembly.imported, matching, folder)
    check_same(as_mesh, run(parse_joint(document, "matrices", folder)))


def test_meshes_that_do_not_match_answer_the_same_with_gaps(folder):
    """Pairs behind the middle lie apart by a micrometre: some stay open."""
    document = plates_document(folder) | {"analysis": {"cycle": {}}}
    document["mesh"]["width"] = 0.02
    document["preload"]["force"] = 6e5
    document["damping"] = {"beta": 1e-6}
    document["interface"] = document["interface"] | {"gap": 1e-6}
    mesh = assemble(parse_joint(document, "mesh", folder))
    slopes = mesh.imported.points[:, 0] / 0.015
    written = mesh_as_matrices(mesh.imported, document, folder, "apart.npz")
    matrices = found(written, folder)
    assert differ(mesh.prestress.pressure, matrices.prestress.pressure) < SAME
    load = 0.2 * mesh.opening_moment
    a, b = (quasi_static_cycle(j.prepared, "tip", load, steps=60) for j in (mesh, matrices))
    assert differ(a.dissipated, b.dissipated) < SAME
    arrays = dict(np.load(folder / "apart.npz"))
    arrays["pairs_gap"] = np.where(slopes > 0, 2e-6, 0.0)
    np.savez(folder / "apart.npz", **arrays)
    aside = found(written, folder)
    assert aside.prestress.touching.sum() < matrices.prestress.touching.sum()


def changed(document, folder, table, change):
    """The description with one of its CSV tables changed, column by column."""
    lines = (folder / table).read_text().splitlines()
    names = lines[0].split(",")
    columns = dict(
        zip(names, zip(*(line.split(",") for line in lines[1:]), strict=True), strict=True)
    )
    columns = {name: list(values) for name, values in columns.items()}
    columns = change(columns) or columns
    rows = [",".join(map(str, row)) for row in zip(*columns.values(), strict=True)]
    (folder / f"changed_{table}").write_text("\n".join([",".join(columns), *rows]) + "\n")
    return json.loads(json.dumps(document).replace(table, f"changed_{table}"))


def quick(document):
    return document | {"analysis": {"cycle": {"force": ["5 kN/m", "30 kN/m"]}}}


@pytest.mark.parametrize("angle", [0.7, 2.0])
def test_other_tangents_change_nothing(by_node, nodes_document, folder, angle):
    """The cone is round: the first tangent turned about the normal."""

    def turned(columns):
        count = len(columns["nx"])
        ways = {"tx": np.cos(angle), "ty": np.sin(angle), "tz": 0.0}
        return columns | {name: [float(value)] * count for name, value in ways.items()}

    other = found(quick(changed(nodes_document, folder, "nodes_pairs.csv", turned)), folder)
    assert differ(by_node.prestress.pressure, other.prestress.pressure) < SAME
    amplitude = by_node.cycles["load"][1].amplitude
    again = quasi_static_cycle(other.prepared, "tip", amplitude, steps=60)
    assert differ(by_node.cycles["load"][1].dissipated, again.dissipated) < SAME


def test_millimetres_and_the_whole(by_node, matching, folder):
    """In mm, N and tonnes, with loads in N: energies times the width, all else as it is."""
    width, mm = 0.02, 1e-3
    structure, pairs = by_node.structure, by_node.assembly.imported.pairs
    arrays = dict(np.load(folder / "plates.npz"))
    arrays |= sparse_parts("K", width * mm * structure.stiffness)
    arrays |= sparse_parts("M", width * mm * structure.mass)
    arrays["pairs_area"] = pairs.area * width / mm**2
    arrays["pairs_position"] = pairs.position / mm
    np.savez(folder / "mm.npz", **arrays)
    document = mesh_as_matrices(by_node.assembly.imported, matching, folder, "again.npz")
    document = json.loads(json.dumps(document).replace("again.npz", "mm.npz"))
    document["matrices"] |= {"width": "whole", "length_unit": "mm"}
    document["preload"]["force"] = "12 kN"
    document["load"] = {"force": ["1 N", "40 N"]}
    document["analysis"] = {"cycle": {"force": ["100 N", "600 N"], "steps": 60}}
    whole = run(parse_joint(document, "whole", folder))
    assert not whole.failures
    assert differ(by_node.mode.stuck_omega, whole.mode.stuck_omega) < SAME
    assert differ(by_node.prestress.pressure, whole.prestress.pressure) < SAME
    for a, b in zip(by_node.cycles["load"], whole.cycles["load"], strict=True):
        assert b.amplitude == pytest.approx(width * a.amplitude, rel=1e-12)
        assert differ(width * a.dissipated, b.dissipated) < SAME
    assert "12 kN," in repr(whole.joint)


def test_slip_and_gap_are_of_a_pair_and_a_tangent(by_node, nodes_document, folder):
    """Work of reactions on what is measured: unit loads of the two slips are rows of B."""
    corner = {"name": "away", "quantity": "slip", "pair": 3, "tangent": 2}
    apart = {"name": "apart", "quantity": "gap", "pair": 3}
    document = quick(nodes_document) | {"output": [corner, apart]}
    structure = found(document, folder).structure
    where = int(np.flatnonzero(by_node.assembly.imported.pairs.rows == 3)[0])
    rows = structure.interface.relative[3 * where : 3 * where + 3].toarray()
    np.testing.assert_allclose(structure.loads["output away"], rows[2], atol=0)
    np.testing.assert_allclose(structure.loads["output apart"], -rows[0], atol=0)
    refusals = {
        "give tangent, 1 or 2": {"pair": 3},
        "3 pairs are as near to x = 0 m": {"x": 0.0, "tangent": 1},
        "there are 15 pairs": {"pair": 16, "tangent": 1},
        "give x alone, its position, or pair": {"pair": 3, "x": 0.0},
    }
    for said, place in refusals.items():
        document["output"] = [{"name": "way", "quantity": "slip"} | place]
        with pytest.raises(InputError, match=said):
            found(document, folder)


def test_a_component_that_a_plane_of_symmetry_holds_has_no_reaction(nodes_document, folder):
    """Nothing moves along y: half of the tangential directions are held, and the plane problem is left."""
    arrays, keep = dict(np.load(folder / "plates.npz")), []
    rows = (folder / "nodes_dofs.csv").read_text().splitlines()
    keep = [k for k, row in enumerate(rows[1:]) if row.split(",")[1] != "y"]
    assembly = found(quick(nodes_document), folder)
    structure = assembly.structure
    width = 0.02
    for name, matrix in (("K", structure.stiffness), ("M", structure.mass)):
        arrays |= sparse_parts(name, width * matrix[keep][:, keep])
    B = structure.interface.relative[:, keep]
    B.eliminate_zeros()
    arrays |= sparse_parts("B", B)
    arrays |= {name: structure.loads[name][keep] for name in ("bolt", "tip")}
    arrays |= {"out_tip": structure.loads["output tip"][keep]}
    np.savez(folder / "held.npz", **arrays)
    (folder / "held_dofs.csv").write_text("\n".join([rows[0], *(rows[1:][k] for k in keep)]) + "\n")
    document = json.loads(json.dumps(quick(nodes_document)).replace("plates.npz", "held.npz"))
    document["matrices"]["dofs"] = "held_dofs.csv"
    one = found(document, folder)
    document["interface"] = {"pairs": "held.npz:pairs", "relative": "held.npz:B"}
    other = found(document, folder)
    assert not other.prestress.solution.r[2::3].any()
    assert differ(one.prestress.pressure, other.prestress.pressure) < SAME
    a, b = (quasi_static_cycle(j.prepared, "tip", 3e4, steps=60) for j in (one, other))
    assert a.dissipated > 0
    assert differ(a.dissipated, b.dissipated) < SAME


# -- what is said, drawn and written ---------------------------------------------------------------


def test_motions_without_stiffness_have_names(by_node):
    names = by_node.assembly.imported.zero_modes
    assert [name.split(" of ")[0] for name in names] == [
        *(f"translation along {axis}" for axis in "xyz"),
        *["rotation"] * 3,
    ]


AS_FILE = """kind = "matrices"
interface = {pairs = "nodes_pairs.csv"}
contact = {friction = 0.3}
preload = [{name = "bolt", vector = "plates.npz:bolt", force = "12 kN"}]
damping = {beta = "20 us"}
port = [{name = "tip", vector = "plates.npz:tip"}]
load = {force = "1 N"}
output = [{name = "tip", vector = "plates.npz:out_tip"}]
analysis = {cycle = {force = ["100 N", "600 N"], steps = 60}, response = {count = 11}}

[matrices]
stiffness = "plates.npz:K"
mass = "plates.npz:M"
width = "whole"
dofs = "nodes_dofs.csv"
modes = 16
"""


def test_a_file_is_checked_run_drawn_and_read_again(nodes_document, folder, tmp_path):
    (folder / "joint.toml").write_text(AS_FILE)
    shown = CliRunner().invoke(
        check, [str(folder / "joint.toml"), "--out", str(tmp_path / "given")]
    )
    assert shown.exit_code == 0, shown.output
    drawn = {file.name for file in (tmp_path / "given").iterdir()}
    assert {"structure.png", "interface_contact.png", "motions.png"} <= drawn
    out = str(tmp_path / "out")
    done = CliRunner().invoke(
        command, [str(folder / "joint.toml"), "--out", out, "--format", "png", "--export", "vtk"]
    )
    assert done.exit_code == 0, done.output
    again = load_run(tmp_path / "out")
    assert again.model.dimension == 3
    figures = {file.name for file in (tmp_path / "out" / "figures").iterdir()}
    assert {"response.png", "tractions.png", "dissipation.png"} <= figures
    assert "force_n" in (tmp_path / "out" / "summary.json").read_text()


def test_what_says_no_directions_has_no_maps(as_mesh, matching, folder, tmp_path):
    """B alone does not tell which way the pairs look."""
    document = mesh_as_matrices(as_mesh.assembly.imported, matching, folder)
    document["matrices"]["dofs"] = "nodes_dofs.csv"
    assembly = found(quick(document), folder)
    assert assembly.imported.pairs.normals is None
    assert geometry_of(assembly.joint, assembly.structure, assembly.imported) is None


def test_check_says_what_results_are_per(nodes_document, folder):
    facts = dict(found(quick(nodes_document), folder).imported.facts)
    assert facts["width"] == "0.02 m: all forces and energies are per metre of it"


# -- mistakes --------------------------------------------------------------------------------------


def swap(columns):
    columns["first"], columns["second"] = columns["second"], columns["first"]


def turn_round(columns):
    columns["nz"] = [-float(value) for value in columns["nz"]]


def exchange(columns):
    columns["second"][0], columns["second"][4] = columns["second"][4], columns["second"][0]


def repeat(columns):
    for name in ("first", "second"):
        columns[name][1] = columns[name][0]


def slant(columns):
    count = len(columns["nx"])
    return columns | {"tx": [0.8] * count, "ty": [0.0] * count, "tz": [0.6] * count}


def lengthen(columns):
    columns["nz"] = [2 * float(value) for value in columns["nz"]]


OF_PAIRS = {
    "sides in the other order": (swap, "are the two sides in this order"),
    "normals turned round": (turn_round, "normals were turned round"),
    "nodes that do not face each other": (exchange, "they must face each other"),
    "a pair twice": (repeat, "are a pair already"),
    "tangents aslant": (slant, "the tangent is not at right angles to the normal"),
    "a long normal": (lengthen, "the normal has the length 2"),
}


@pytest.mark.parametrize("mistake", OF_PAIRS)
def test_a_mistake_in_the_table_is_named(nodes_document, folder, mistake):
    change, said = OF_PAIRS[mistake]
    document = changed(quick(nodes_document), folder, "nodes_pairs.csv", change)
    with pytest.raises(InputError, match=said):
        found(document, folder)


def with_map(document, folder, change):
    """The description with B in place of nodes, changed."""
    B = found(document, folder).structure.interface.relative
    np.savez(folder / "map.npz", **sparse_parts("B", change(B)))
    return document | {
        "interface": {"pairs": document["interface"]["pairs"], "relative": "map.npz:B"}
    }


def exchanged(B):
    order = np.arange(B.shape[0]).reshape(-1, 3)[:, [1, 0, 2]].ravel()
    return B[order]


def shifted(B):
    return B[:, np.roll(np.arange(B.shape[1]), 1)]


def stretched(B):
    scale = np.ones(B.shape[0])
    scale[2::3] = 2.0
    return B.multiply(scale[:, None])


def still(B):
    keep = np.ones(B.shape[0])
    keep[3] = 0.0
    return B.multiply(keep[:, None])


def wider(B):
    return np.hstack([np.zeros((B.shape[0], 1)), B.toarray()])


OF_MAPS = {
    "transposed": (lambda B: B.T, "it is transposed; it must be 45 by 270"),
    "indices from one": (wider, "do its indices count from 1"),
    "normal and tangent exchanged": (exchanged, "the two rows of a pair exchanged"),
    "columns shifted": (shifted, "indices count from 1"),
    "tangents of two lengths": (stretched, "not of one length"),
    "a normal row without entries": (still, "row 4 of 45 is empty"),
    "one row too many": (lambda B: B[:44], "must be 30 by 270.* or 45 rows in space"),
}


@pytest.mark.parametrize("mistake", OF_MAPS)
def test_a_mistake_in_the_matrix_is_named(nodes_document, folder, mistake):
    change, said = OF_MAPS[mistake]
    document = with_map(quick(nodes_document), folder, change)
    with pytest.raises(InputError, match=said):
        found(document, folder)


def test_a_width_is_needed_in_space(nodes_document, folder):
    document = quick(json.loads(json.dumps(nodes_document)))
    del document["matrices"]["width"]
    with pytest.raises(InputError, match=r"matrices\.width is missing"):
        found(document, folder)


def test_normals_in_space_need_degrees_of_freedom_there(nodes_document, folder):
    """A table of degrees of freedom in which z was written as rz."""

    def renamed(columns):
        columns["direction"] = ["rz" if way == "z" else way for way in columns["direction"]]

    document = changed(quick(nodes_document), folder, "nodes_dofs.csv", renamed)
    with pytest.raises(InputError, match="no degree of freedom is along z"):
        found(document, folder)


def test_areas_in_another_unit_are_doubted(nodes_document, folder):
    def larger(columns):
        columns["area"] = [1e6 * float(area) for area in columns["area"]]

    document = changed(quick(nodes_document), folder, "nodes_pairs.csv", larger)
    assert "times the square of the length" in " ".join(map(str, found(document, folder).doubts))

"""The usual mistakes in foreign matrices: each has one message that says what is wrong, and no run."""

from __future__ import annotations

import json
import re
from pathlib import Path

import numpy as np
import pytest
import scipy.sparse as sp
from matrices_files import as_matrices, sparse_parts
from typer.testing import CliRunner

from microslip.cli.main import app
from microslip.describe.reading import load_joint, parse_joint
from microslip.describe.reference import reference_joint
from microslip.errors import InputError
from microslip.pipeline.prepare import assemble

ROOT = Path(__file__).parents[2]
EXAMPLE = ROOT / "examples" / "matrices_beam"


@pytest.fixture(scope="module")
def base(tmp_path_factory):
    """The reference joint with few pairs as arrays, and the document that reads them."""
    folder = tmp_path_factory.mktemp("base")
    document = as_matrices(reference_joint(pairs=21), folder)
    document["analysis"] = {"cycle": {"moment": [1000.0]}}
    return dict(np.load(folder / "joint.npz")), document


def sparse(arrays, name):
    parts = (arrays[f"{name}.{part}"] for part in ("data", "indices", "indptr"))
    return sp.csc_matrix(tuple(parts), shape=tuple(arrays[f"{name}.shape"]))


def put(name, change):
    """A change of one sparse matrix."""
    return lambda arrays: sparse_parts(name, change(sparse(arrays, name)))


def skewed(matrix):
    matrix = matrix.tolil()
    matrix[3, 5] += 0.01 * abs(matrix).max()
    return matrix


def with_entry(row, column, factor):
    def change(matrix):
        changed = matrix.tolil()
        changed[row, column] = factor * matrix.diagonal().max()
        return changed

    return change


def mechanism():
    """Two bars in a row, three joints: four motions without stiffness in one part."""
    K = np.zeros((6, 6))
    for i, angle in ((0, 0.3), (2, 1.1)):
        e = np.array([np.cos(angle), np.sin(angle)])
        b = np.concatenate([-e, e])
        K[i : i + 4, i : i + 4] += 1e9 * np.outer(b, b)
    return K


def with_part(block):
    """Six more degrees of freedom, which everything else does not know."""

    def change(arrays):
        grown = sparse_parts("K", sp.block_diag([sparse(arrays, "K"), block]))
        grown |= sparse_parts("M", sp.block_diag([sparse(arrays, "M"), np.eye(6)]))
        B = sparse(arrays, "B")
        grown |= sparse_parts("B", sp.hstack([B, np.zeros((B.shape[0], 6))]))
        grown |= sparse_parts(
            "supports", sp.block_diag([sparse(arrays, "supports"), np.zeros((6, 6))])
        )
        n = sparse(arrays, "K").shape[0]
        for name, value in arrays.items():
            if value.shape[:1] == (n,) and "." not in name:
                grown[name] = np.concatenate([value, np.zeros((6, *value.shape[1:]))])
        return grown

    return change


def column(name, values):
    return lambda arrays: {f"pairs_{name}": np.broadcast_to(values, arrays["pairs_area"].shape)}


SIGNS = np.tile([-1.0, 1.0], 21)

MISTAKES = {
    "normals turned round": (put("B", lambda B: sp.diags(SIGNS) @ B), "normals were turned round"),
    "sides in the other order": (put("B", lambda B: -B), "are the two sides in this order"),
    "B transposed": (put("B", lambda B: B.T), "it is transposed; it must be 42 by"),
    "B with one column more": (
        put("B", lambda B: sp.hstack([np.zeros((42, 1)), B])),
        "do its indices count from 1",
    ),
    "B with held columns": (
        put("B", lambda B: sp.hstack([B, np.zeros((42, 12))])),
        "does it count degrees of freedom that supports hold",
    ),
    "B with an empty row": (
        put("B", lambda B: sp.diags((np.arange(42) != 6).astype(float)) @ B),
        "row 7 of 42 is empty",
    ),
    "three rows a pair": (
        put("B", lambda B: sp.vstack([B, B[:21]])),
        "matrices.width is missing: loads and results in space",
    ),
    "upper triangle of K": (
        put("K", sp.triu),
        "only the upper triangle is there: write matrices.stored",
    ),
    "lower triangle of M": (put("M", sp.tril), "matrices.mass.* only the lower triangle is there"),
    "asymmetric K": (put("K", skewed), "is not symmetric: between degree of freedom"),
    "indefinite K": (
        put("K", lambda K: K - 1e-4 * K.diagonal().min() * sp.eye(K.shape[0])),
        r"stiffness.* has \d+ negative eigenvalues",
    ),
    "indefinite M": (put("M", with_entry(8, 8, 1e-9)), "mass.* negative eigenvalue"),
    "negative diagonal": (put("K", with_entry(4, 4, -1.0)), "degree of freedom 5 is -"),
    "a support by penalty": (put("K", with_entry(4, 4, 1e15)), "a support by penalty"),
    "not a number": (put("M", lambda M: M * np.nan), "not finite"),
    "a loose node": (with_part(np.zeros((6, 6))), "has no stiffness at all, as 6 of"),
    "a mechanism": (
        with_part(mechanism()),
        r"8 motions have no stiffness, where 3 connected parts",
    ),
    "M of another size": (
        put("M", lambda M: M[:-2, :-2]),
        "both must be of the same degrees of freedom",
    ),
    "K not square": (put("K", lambda K: K[:-2]), "and not square"),
    "motions transposed": (lambda arrays: {"motions": arrays["motions"].T}, "it is transposed"),
    "a preload of another size": (
        lambda arrays: {"clamp": arrays["clamp"][:-2]},
        "entries, and the stiff",
    ),
    "no preload": (lambda arrays: {"clamp": 0 * arrays["clamp"]}, "holds nothing but zeros"),
    "no area": (
        column("area", np.r_[1.0, 0.0, np.ones(19)]),
        "row 2, area: must be greater than 0",
    ),
    "one position twice": (
        column("position", np.r_[0, 0, 1:20]),
        "rows 1 and 2 have the same position",
    ),
    "friction beyond reason": (column("friction", 30.0), "row 1, friction: must be 0 to 2"),
    "a normal in space": (column("nz", 1.0), "component nz, and B has two rows a pair"),
}


@pytest.mark.parametrize("mistake", MISTAKES)
def test_check_names_the_mistake(base, tmp_path, mistake):
    arrays, document = base
    change, said = MISTAKES[mistake]
    np.savez(tmp_path / "joint.npz", **(arrays | change(arrays)))
    with pytest.raises(InputError, match=said) as caught:
        assemble(parse_joint(document, "matrices", tmp_path))
    text = str(caught.value)
    assert "\n" not in text
    assert "joint.npz" in text or text.startswith(("interface", "matrices.width"))


def written(document, folder, **sections):
    """The example with some tables changed, as a file."""
    lines = (ROOT / "examples" / "matrices_beam.toml").read_text()
    lines = lines.replace("matrices_beam/", f"{EXAMPLE}/")
    for old, new in sections.items():
        lines = lines.replace(f"{EXAMPLE}/{old}.csv", f"{folder}/{new}.csv")
    (folder / "joint.toml").write_text(document(lines))
    return folder / "joint.toml"


def pairs(folder, change):
    """The table of the example's pairs, each row changed."""
    head, *rows = (EXAMPLE / "pairs.csv").read_text().splitlines()
    rows = [",".join(map(str, change(k, row.split(",")))) for k, row in enumerate(rows)]
    (folder / "pairs.csv").write_text("\n".join([head, *rows]) + "\n")
    return {"pairs": "pairs"}


def turned(k, row):
    return [*row[:5], "-1"]


def swapped(k, row):
    return [*row[:2], row[3], row[2], *row[4:]]


def only(change, row_number):
    return lambda k, row: change(k, row) if k == row_number - 1 else row


def long(k, row):
    return [*row[:5], "2"]


def elsewhere(node):
    return lambda k, row: [*row[:2], node if k == 3 else row[2], *row[3:]]


PAIRS = {
    "normals turned round": (turned, "normals were turned round"),
    "sides in the other order": (swapped, "are the two sides in this order"),
    "a normal that is too long": (long, "the normal has the length 2"),
    "one normal turned round": (only(turned, 5), "row 5: the normal of this pair opposes"),
    "one pair in the other order": (only(swapped, 1), "row 1: the normal of this pair opposes"),
    "a node from zero": (elsewhere(0), "there is no node 0"),
    "a node that faces another": (elsewhere(57), "row 4: its nodes are 0.0112 m apart along"),
    "a held node": (elsewhere(1), r"row 4: there is no node 1 among .* held by supports"),
}


@pytest.mark.parametrize("mistake", PAIRS)
def test_check_names_the_pair(tmp_path, mistake):
    """Exit code 2 and one message, from the command itself."""
    change, said = PAIRS[mistake]
    file = written(lambda text: text, tmp_path, **pairs(tmp_path, change))
    done = CliRunner().invoke(app, ["check", str(file)])
    assert done.exit_code == 2
    assert done.stderr.startswith("error: ")
    assert re.search(said, done.stderr)
    assert done.stderr.count("\n") == 1


def test_a_shifted_map_is_seen_where_the_nodes_are_known(tmp_path):
    joint = load_joint(ROOT / "examples" / "matrices_beam.toml")
    B = assemble(joint).structure.interface.relative / 1e-3
    columns = np.roll(np.arange(B.shape[1]), 1)
    sp.save_npz(tmp_path / "B.npz", B[:, columns].tocsr())
    file = written(
        lambda text: text.replace("[contact]", f'relative = "{tmp_path}/B.npz"\n[contact]'),
        tmp_path,
    )
    with pytest.raises(
        InputError,
        match=r"along the interface, and the tangential one across it: .* indices count from 1",
    ):
        assemble(load_joint(file))


def test_a_name_that_no_variable_has_is_said_to_be_none(tmp_path):
    """And not a file that is missing."""
    (tmp_path / "K.mat").write_bytes(b"")
    file = written(
        lambda text: text.replace(f"{EXAMPLE}/beam.sti", f"{tmp_path}/K.mat:sys/K"), tmp_path
    )
    with pytest.raises(InputError, match=r"'sys/K' is no name of a variable, nor of a field"):
        load_joint(file)


def test_nodes_of_incompatible_modes_are_named(tmp_path):
    """CalculiX numbers them beyond the nodes of the deck."""
    rows = (EXAMPLE / "nodes.csv").read_text().splitlines()
    (tmp_path / "nodes.csv").write_text("\n".join(rows[:-2]) + "\n")
    with pytest.raises(
        InputError, match=r"is not among the 144 nodes of the table, as more .* C3D8I"
    ):
        assemble(load_joint(written(lambda text: text, tmp_path, nodes="nodes")))


def test_a_list_of_degrees_of_freedom_with_those_that_are_held(tmp_path):
    rows = ["node,direction", *(f"{node},{d}" for node in range(1, 147) for d in "xy")]
    (tmp_path / "dofs.csv").write_text("\n".join(rows) + "\n")
    file = written(
        lambda text: text.replace("nodes =", f'dofs = "{tmp_path}/dofs.csv"\n#'), tmp_path
    )
    with pytest.raises(
        InputError, match=r"292 degrees of freedom, and the stiffness is 286 .* supports hold"
    ):
        assemble(load_joint(file))


@pytest.mark.parametrize(
    ("old", "new", "said"),
    [
        ("friction = 0.3\n", "", "contact.friction is missing"),
        ('node = 144\ndirection = "y"\n\n[load]', "\n[load]", "where is the load"),
        ("node = 144", "node = 999", "there is no node 999"),
        ('x = "22.5 mm"', 'x = "2 m"', "lies off the interface"),
        ('quantity = "slip"', 'quantity = "slip"\nnode = 3', "give x alone"),
        ('port = "tip"\nforce', 'port = "top"\nforce', "there is no .*port.* of this name"),
        ('force = ["2 N/m", "5 N/m", "10 N/m"]', 'moment = "2 N*m/m"', "give force"),
        (
            'kind = "matrices"',
            'kind = "shells"',
            'must be "lap" or "matrices" or "mesh" or "model"',
        ),
        ('length_unit = "mm"', 'length_unit = "inch"', "length_unit"),
        ('beam.sti"', 'beam.stf"', "no such file"),
        ('"400 kN/m"', '"400 kN"', "force"),
    ],
)
def test_the_file_itself(tmp_path, old, new, said):
    def change(text):
        assert old in text
        return text.replace(old, new, 1)

    done = CliRunner().invoke(app, ["check", str(written(change, tmp_path))])
    assert done.exit_code == 2
    assert re.search(said, done.stderr)


# -- what is doubted and not refused ---------------------------------------------------------------


def doubts(base, folder, change, more=None):
    arrays, document = base
    np.savez(folder / "joint.npz", **(arrays | change(arrays)))
    joint = parse_joint(json.loads(json.dumps(document)) | (more or {}), "matrices", folder)
    return " ".join(str(caution) for caution in assemble(joint).doubts)


def test_mass_in_another_unit_is_doubted(base, tmp_path):
    said = doubts(base, tmp_path, put("M", lambda M: 1e12 * M))
    assert "the lowest elastic frequency is 0.000862 Hz: are the units right" in said.replace(
        "; ", ": "
    )


def test_areas_in_another_unit_are_doubted(base, tmp_path):
    said = doubts(base, tmp_path, lambda arrays: {"pairs_area": 1e6 * arrays["pairs_area"]})
    assert "times as long as the positions reach" in said


def test_a_contact_stiffness_of_another_unit_is_doubted(base, tmp_path):
    elastic = {"friction": 0.3, "law": "elastic", "tangential_stiffness": 1e3}
    said = doubts(base, tmp_path, lambda arrays: {}, {"contact": elastic})
    assert "softer than the structure" in said


def test_the_reference_joint_is_not_doubted(base, tmp_path):
    assert doubts(base, tmp_path, lambda arrays: {}) == ""


def test_a_pressure_that_no_metal_bears_is_doubted(tmp_path):
    """As where areas are in other units than is said: a million times the pressure."""
    document = as_matrices(reference_joint(pairs=21), tmp_path)
    document["analysis"] = {"cycle": {"moment": [1000.0]}}
    quiet = assemble(parse_joint(document, "matrices", tmp_path))
    assert not quiet.doubts
    document["preload"]["force"] *= 0.99e10 / quiet.prestress.pressure.max()
    assert not assemble(parse_joint(document, "matrices", tmp_path)).doubts
    document["preload"]["force"] *= 1.02
    (doubt,) = assemble(parse_joint(document, "matrices", tmp_path)).doubts
    assert "10.1 GPa" in str(doubt)
    assert "units" in str(doubt)


def test_check_doubts_what_a_run_would(tmp_path):
    file = written(lambda text: text.replace('"400 kN/m"', '"4e9 kN/m"'), tmp_path)
    said = CliRunner().invoke(app, ["check", str(file)])
    assert said.exit_code == 0
    assert said.stderr.count("no metal bears more than 10 GPa") == 1


def test_a_table_beside_other_arrays_is_told_by_how_its_names_begin(base, tmp_path):
    arrays, document = base
    np.savez(tmp_path / "joint.npz", **arrays)
    table = document["interface"] | {"pairs": "joint.npz"}
    with pytest.raises(InputError, match=r"joint\.npz:NAME\" for .* names begin with out or pairs"):
        assemble(parse_joint(document | {"interface": table}, "matrices", tmp_path))

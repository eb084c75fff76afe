"""Readers of foreign matrices: the same matrices in every format, and files that programs wrote."""

from __future__ import annotations

import importlib.util
import struct
from pathlib import Path

import h5py
import numpy as np
import pytest
import scipy.io
import scipy.sparse as sp
from matrices_files import sparse_parts

from microslip.errors import InputError
from microslip.model.readers.files import read_matrix, read_table, read_vector
from microslip.model.readers.found import Found, ordered

HERE = Path(__file__).parent / "calculix"

MATRIX = np.array([[4.0, -1.5, 0.0], [-1.5, 3.0, 0.25], [0.0, 0.25, 2.0]])
HALF = [(1, 1, 4.0), (2, 1, -1.5), (2, 2, 3.0), (3, 2, 0.25), (3, 3, 2.0)]
LABELS = {1: (7, 1), 2: (7, 2), 3: (9, 2)}


def lines(entries, form):
    return "".join(form(i, j, value) + "\n" for i, j, value in entries)


def by_label(i, j, value):
    (m, a), (n, b) = LABELS[i], LABELS[j]
    return f"{m},{a}, {n},{b}, {value:.15e}"


def mat73(path, name, matrix):
    """As MATLAB stores it: dense arrays transposed, sparse ones as groups."""
    with h5py.File(path, "w") as file:
        file[name] = matrix.T
        compressed = sp.csc_matrix(matrix)
        group = file.create_group("sparse")
        group.attrs["MATLAB_sparse"] = np.uint64(matrix.shape[0])
        group["data"], group["ir"] = compressed.data, compressed.indices.astype(np.uint64)
        group["jc"] = compressed.indptr.astype(np.uint64)
        file.create_group("beam/inner").attrs["MATLAB_class"] = np.bytes_("struct")
        file["beam/M"] = matrix.T
        file.copy(group, "beam/inner/K")


def written(folder, kind):
    """The matrix in a format: its source."""
    path = folder / "file"
    if kind == "npz":
        np.savez(path.with_suffix(".npz"), **sparse_parts("K", MATRIX), other=np.ones(3))
        return f"{path}.npz:K"
    if kind == "save_npz":
        sp.save_npz(path.with_suffix(".npz"), sp.csr_matrix(MATRIX))
        return f"{path}.npz"
    if kind == "npy":
        np.save(path.with_suffix(".npy"), MATRIX)
        return f"{path}.npy"
    if kind == "mat5":
        scipy.io.savemat(path.with_suffix(".mat"), {"K": sp.csc_matrix(MATRIX), "M": MATRIX})
        return f"{path}.mat:K"
    if kind == "mat5 field":
        beam = {"inner": {"K": sp.csc_matrix(MATRIX)}, "M": np.eye(3), "name": "beam"}
        scipy.io.savemat(path.with_suffix(".mat"), {"beam": beam})
        return f"{path}.mat:beam.inner.K"
    if kind.startswith("mat73"):
        mat73(path.with_suffix(".mat"), "K", MATRIX)
        names = {"dense": "K", "sparse": "sparse", "field": "beam.M", "nested": "beam.inner.K"}
        return f"{path}.mat:{names[kind.split()[1]]}"
    if kind.startswith("market"):
        symmetry = kind.split()[1]
        with open(f"{path}.mtx", "wb") as file:
            scipy.io.mmwrite(file, sp.coo_matrix(MATRIX), symmetry=symmetry)
        return f"{path}.mtx"
    text = {
        "lower": lines(HALF, by_label),
        "upper": lines([(j, i, v) for i, j, v in HALF], by_label),
        "whole": lines(
            [(i, j, v) for i, j, v in HALF] + [(j, i, v) for i, j, v in HALF if i != j], by_label
        ),
        "coordinate": lines(HALF, lambda i, j, v: f"{i} {j} {v:.15e}"),
    }[kind]
    Path(f"{path}.mtx").write_text("** written by a program\n" + text)
    return f"{path}.mtx"


@pytest.mark.parametrize(
    "kind",
    [
        *("npz", "save_npz", "npy", "mat5", "mat5 field"),
        *("mat73 dense", "mat73 sparse", "mat73 field", "mat73 nested"),
        *("market symmetric", "market general", "lower", "upper", "whole", "coordinate"),
    ],
)
def test_every_format_gives_the_same_matrix(tmp_path, kind):
    found = read_matrix(written(tmp_path, kind))
    np.testing.assert_allclose(found.whole("full").toarray(), MATRIX, rtol=1e-14)
    if kind in ("lower", "upper", "whole"):
        assert found.labels == tuple(LABELS.values())


@pytest.mark.parametrize(
    ("kind", "there"), [("mat5 field", "beam.M"), ("mat73 field", "beam.inner.K")]
)
def test_fields_of_structures_are_named(tmp_path, kind, there):
    path = written(tmp_path, kind).partition(":")[0]
    with pytest.raises(InputError, match=rf"holds no 'beam'; there is .*{there}"):
        read_matrix(f"{path}:beam")


def test_a_field_that_is_no_matrix_of_numbers_is_refused(tmp_path):
    path = written(tmp_path, "mat5 field").partition(":")[0]
    with pytest.raises(InputError, match=r"beam.name does not hold real numbers"):
        read_matrix(f"{path}:beam.name")


def calculix(name):
    """A matrix of the plate, dense."""
    return read_matrix(str(HERE / name)).whole("full").toarray()


def test_calculix_stiffness_and_mass_have_its_own_frequency():
    """``plate.dat`` is what CalculiX found of ``plate.inp`` with its own eigenvalue solver."""
    K, M = calculix("plate.sti"), calculix("plate.mas")
    found = np.sqrt(np.linalg.eigvals(np.linalg.solve(M, K)).real.min()) / (2 * np.pi)
    row = next(
        line.split()
        for line in (HERE / "plate.dat").read_text().splitlines()
        if line.split()[:1] == ["1"] and len(line.split()) == 5
    )
    assert found == pytest.approx(float(row[3]), rel=2e-7)  # seven digits are printed


def test_calculix_says_which_degrees_of_freedom_there_are():
    labels = read_matrix(str(HERE / "plate.sti")).labels
    assert labels is not None
    assert labels[:3] == ((2, 1), (2, 2), (3, 1))
    assert read_table(str(HERE / "plate.dof"))["node"].tolist()[:3] == [2, 2, 3]


def test_a_substructure_is_the_same_stiffness_in_another_layout():
    """CalculiX wrote both: ``substructure.mtx`` as a linear user element, ``free.sti`` as triples."""
    found = read_matrix(f"{HERE / 'substructure.mtx'}:STIFFNESS")
    assert found.labels == ((1, 1), (1, 2), (3, 1), (3, 2), (4, 1), (4, 2), (6, 2))
    whole = read_matrix(str(HERE / "free.sti"))
    assert whole.labels is not None
    rows = [whole.labels.index(label) for label in found.labels]
    expected = whole.whole("full").toarray()[np.ix_(rows, rows)]
    scale = np.abs(expected).max()
    np.testing.assert_allclose(found.whole("full").toarray(), expected, atol=1e-12 * scale)


def test_a_file_of_several_wants_a_name(tmp_path):
    np.savez(tmp_path / "two.npz", K=MATRIX, M=MATRIX)
    with pytest.raises(InputError, match=r"which one is meant\? It holds K, M"):
        read_matrix(str(tmp_path / "two.npz"))
    with pytest.raises(InputError, match="holds no 'C'; there is K, M"):
        read_matrix(f"{tmp_path / 'two.npz'}:C")


@pytest.mark.parametrize(
    ("text", "said"),
    [
        ("1 1 2.0\n1 1 3.0\n", "an entry is there twice"),
        ("0 0 2.0\n1 1 3.0\n", "rows and columns count from 1"),
        ("1 1\n", "2 numbers a line"),
        ("1.5 1 2.0\n", "whole numbers"),
        ("7,9, 7,9, 1.0\n", "directions are 1 to 6"),
        ("nothing\n", "no table of matrix entries"),
        ("*USER ELEMENT, NODES=1, LINEAR\n*MATRIX,TYPE=STIFFNESS\n1.0\n", "the nodes"),
    ],
)
def test_text_that_is_no_matrix(tmp_path, text, said):
    path = tmp_path / "file.mtx"
    path.write_text(text)
    with pytest.raises(InputError, match=said) as caught:
        read_matrix(str(path))
    assert "file.mtx" in str(caught.value)


def test_indices_that_count_from_one(tmp_path):
    parts = sparse_parts("K", MATRIX)
    parts["K.indices"] = parts["K.indices"] + 1
    np.savez(tmp_path / "one.npz", **parts)
    with pytest.raises(InputError, match="do its indices count from 1"):
        read_matrix(f"{tmp_path / 'one.npz'}:K")


def test_an_unknown_ending(tmp_path):
    with pytest.raises(InputError, match=r"no matrix can be read .* \.npz"):
        read_matrix(str(tmp_path / "file.xyz"))


def test_a_table_with_a_line_too_short(tmp_path):
    path = tmp_path / "pairs.csv"
    path.write_text("# pairs\nposition,area\n0,1\n1\n")
    with pytest.raises(InputError, match="line 4 has 1 values, the header 2"):
        read_table(str(path))
    path.write_text("position,area\n0,one\n")
    with pytest.raises(InputError, match="line 2, area = 'one'"):
        read_table(str(path))


def test_columns_of_an_array_file(tmp_path):
    np.savez(tmp_path / "a.npz", pairs_position=np.arange(3.0), pairs_area=np.ones(3), K=MATRIX)
    found = read_table(f"{tmp_path / 'a.npz'}:pairs")
    assert sorted(found) == ["area", "position"]


def test_a_vector_of_another_length(tmp_path):
    np.save(tmp_path / "v.npy", np.ones(4))
    with pytest.raises(InputError, match="has 4 entries, and the stiffness has 3"):
        read_vector(str(tmp_path / "v.npy"), 3)


def test_another_order_of_the_degrees_of_freedom():
    half = Found(sp.csc_matrix(np.triu(MATRIX)), "upper", tuple(LABELS.values()))
    labels = ((9, 2), (7, 2), (8, 1), (7, 1))
    found = ordered(half, labels).whole("full").toarray()
    np.testing.assert_array_equal(found[np.ix_([3, 1, 0], [3, 1, 0])], MATRIX)
    assert not found[2].any()


# -- through packages that are installed when they are wanted --------------------------------------


def test_a_reader_that_is_not_installed(tmp_path, monkeypatch):
    monkeypatch.setitem(__import__("sys").modules, "pyyeti.nastran", None)
    monkeypatch.setitem(__import__("sys").modules, "pyyeti", None)
    (tmp_path / "k.op4").write_text("")
    with pytest.raises(InputError, match=r"pip install .microslip\[nastran\]"):
        read_matrix(str(tmp_path / "k.op4"))


@pytest.mark.skipif(importlib.util.find_spec("pyyeti") is None, reason="needs the extra nastran")
@pytest.mark.parametrize("binary", [True, False])
def test_nastran_op4_and_external_superelement(tmp_path, binary):
    with np.printoptions():  # which pyyeti changes for all when it is imported
        from pyyeti.nastran import op4

    path = tmp_path / "kaa.op4"
    op4.write(str(path), ["kaa", "maa"], [MATRIX, np.eye(3)], binary=binary)
    np.testing.assert_allclose(read_matrix(f"{path}:KAA").matrix.toarray(), MATRIX, rtol=1e-12)
    (tmp_path / "se.asm").write_text("EXTRN,7,12,9,2,2995001,0\n")
    found = read_table(str(tmp_path / "se.asm"))
    assert found["node"].tolist() == [7, 7, 9, 2995001]
    assert found["direction"].tolist() == [1, 2, 2, 0]


def record(data):
    return struct.pack("<i", len(data)) + data + struct.pack("<i", len(data))


def write_op2(path, matrices, integer):
    """Matrices as OUTPUT2 writes them: records with their lengths, each behind the number of its words."""
    word, size = ("<i", 4) if integer == 4 else ("<q", 8)

    def keys(*values):
        return b"".join(record(struct.pack(word, value)) for value in values)

    def words(*values):
        return record(b"".join(struct.pack(word, value) for value in values))

    def text(value, count):
        return record(value.ljust(count * size).encode())

    out = [keys(3), words(11, 22, 26), keys(7), text("NASTRAN FORT TAPE ID CODE - ", 7)]
    out += [keys(2), text("XXXXXXXX", 2), keys(-1, 0)]
    for name, matrix in matrices.items():
        rows, columns = matrix.shape
        out += [keys(2), text(name, 2), keys(-1, 7), words(101, columns, rows, 6, 2, rows, 9999)]
        out += [keys(-2, 1, 0, 2), text(name, 2), keys(-3, 1, 1)]
        for k, column in enumerate(matrix.T):
            first, last = np.flatnonzero(column)[[0, -1]]
            values = column[first : last + 1].astype("<f8").tobytes()
            data = struct.pack(word, first + 1) + values
            out += [keys(len(data) // size), record(data), keys(0, -4 - k)]
            out += [keys(int(k + 1 < columns))]
        out += [keys(0)]
    path.write_bytes(b"".join([*out, keys(0)]))


@pytest.mark.skipif(importlib.util.find_spec("pyyeti") is None, reason="needs the extra nastran")
@pytest.mark.parametrize("integer", [4, 8])
def test_nastran_op2(tmp_path, integer):
    path = tmp_path / "se.op2"
    write_op2(path, {"KAA": MATRIX, "MAA": np.eye(3)}, integer)
    printed = np.get_printoptions()
    np.testing.assert_array_equal(read_matrix(f"{path}:KAA").matrix.toarray(), MATRIX)
    np.testing.assert_array_equal(read_matrix(f"{path}:MAA").matrix.toarray(), np.eye(3))
    assert np.get_printoptions() == printed
    with pytest.raises(InputError, match="holds no 'baa'; there is kaa, maa"):
        read_matrix(f"{path}:BAA")
    write_op2(path, {}, integer)
    with pytest.raises(InputError, match="holds no matrices"):
        read_matrix(f"{path}:KAA")
    path.write_bytes(b"nothing of the kind")
    with pytest.raises(InputError, match="is no OP2 file that can be read"):
        read_matrix(f"{path}:KAA")


@pytest.mark.skipif(importlib.util.find_spec("pyyeti") is None, reason="needs the extra nastran")
def test_nastran_dmig_knows_its_degrees_of_freedom(tmp_path):
    """Two nodes and a modal coordinate, one triangle; numbers as Nastran punches them."""
    labels = [(7, 1), (7, 2), (2995001, 0)]

    def column(j):
        head = f"DMIG*   KAAX    {'':>8}{labels[j][0]:>16}{labels[j][1]:>16}"
        rows = [
            f"*       {labels[i][0]:>16}{labels[i][1]:>16}{MATRIX[i, j]:>16.9E}".replace("E", "D")
            for i in range(j, 3)
            if MATRIX[i, j]
        ]
        return [head, *rows]

    text = [f"{'DMIG':<8}{'KAAX':<8}{0:>8}{6:>8}{2:>8}{0:>8}", *column(0), *column(1), *column(2)]
    path = tmp_path / "se.pch"
    path.write_text("\n".join(text) + "\n")
    found = read_matrix(f"{path}:KAAX")
    assert found.labels == tuple(labels)
    np.testing.assert_allclose(found.whole("full").toarray(), MATRIX, rtol=1e-9)
    path.write_text("nothing of the kind\n")
    with pytest.raises(InputError, match="DMIG"):
        read_matrix(f"{path}:KAAX")


def ansys_example():
    """The ``.full`` file that comes with the reader, of a rotor sector."""
    spec = (
        importlib.util.find_spec("ansys.mapdl.reader")
        if importlib.util.find_spec("ansys")
        else None
    )
    return None if spec is None else Path(str(spec.origin)).parent / "examples" / "file.full"


@pytest.mark.skipif(ansys_example() is None, reason="needs the extra ansys")
def test_ansys_full():
    K, M = (read_matrix(f"{ansys_example()}:{name}") for name in "KM")
    assert K.labels == M.labels
    stiffness, mass = K.whole("full"), M.whole("full")
    assert abs(stiffness - stiffness.T).max() == 0
    # mass of a translation along x is that along y: rows that are held take from both alike
    directions = np.array([direction for _, direction in K.labels])
    totals = [(directions == d).astype(float) @ mass @ (directions == d) for d in (1, 2, 3)]
    assert np.ptp(totals) < 1e-8 * max(totals)

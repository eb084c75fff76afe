"""A joint from matrices: the lap joint again, CalculiX, units, gaps and elastic contact."""

from __future__ import annotations

import importlib.util
import shutil
from pathlib import Path

import numpy as np
import pytest
import scipy.sparse as sp
import scipy.sparse.linalg as spla
from matrices_files import arrays_of, as_matrices, sparse_parts
from same_joint import (
    LOAD,
    REQUESTS,
    SAME,
    check_answers,
    check_cycles,
    check_states,
    differ,
    reference_document,
)

from microslip.analyses.prepared.balance import pulled_apart
from microslip.contact.fields import contact_extent
from microslip.describe.reading import load_joint, parse_joint
from microslip.describe.reference import reference_joint
from microslip.errors import InputError
from microslip.model.lap import structure_of
from microslip.pipeline.prepare import assemble
from microslip.pipeline.run import run

ROOT = Path(__file__).parents[2]
EXAMPLE = ROOT / "examples" / "matrices_beam.toml"


@pytest.fixture(scope="module")
def lap_file():
    return reference_document(41)


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    return tmp_path_factory.mktemp("matrices")


@pytest.fixture(scope="module")
def document(lap_file, folder):
    joint = parse_joint(lap_file)
    return as_matrices(joint, folder) | {"analysis": REQUESTS, "load": LOAD}


@pytest.fixture(scope="module")
def both(lap_file, document, folder):
    return run(parse_joint(lap_file)), run(parse_joint(document, "matrices", folder))


def test_reference_joint_as_matrices_has_the_same_states(both):
    check_states(*both)


def test_reference_joint_as_matrices_has_the_same_cycles(both):
    check_cycles(*both)


def test_reference_joint_as_matrices_answers_the_same(both):
    check_answers(*both)


OTHERS = {
    "cantilever": {
        "support": {"left": "clamped", "right": "free"},
        "port": [{"name": "tip", "kind": "force", "at": "right"}],
        "load": {"port": "tip", "force": [10.0]},
    },
    "shaken": {
        "support": {"left": "clamped", "right": "free"},
        "port": [{"name": "wall", "kind": "base"}],
        "load": {"port": "wall", "acceleration": [10.0]},
    },
    "different beams": {"beams": {"upper": {"thickness": "10 mm", "length": "0.3 m"}}},
    "elastic": {
        "contact": {"law": "elastic", "tangential_stiffness": 1e13, "normal_stiffness": 3e13}
    },
    "clamp aside": {"clamp": {"centre": "8 mm", "half_length": "20 mm"}},
}


@pytest.mark.parametrize("name", OTHERS)
def test_other_lap_joints_as_matrices(lap_file, folder, name):
    document = {key: value for key, value in lap_file.items() if key != "load"}
    for key, value in OTHERS[name].items():
        document[key] = document.get(key, {}) | value if isinstance(value, dict) else value
    probe = assemble(parse_joint(document | {"analysis": {"cycle": {}}}))
    key = probe.joint.driven.load.key
    share = 0.3 * (probe.opening_moment if np.isfinite(probe.opening_moment) else 1e5)
    document["analysis"] = {"cycle": {key: [share], "steps": 100}}
    joint = parse_joint(document)
    written = as_matrices(joint, folder, "other.npz") | {"analysis": document["analysis"]}
    if "load" in document:
        written["load"] = document["load"]
    lap, matrices = run(joint), run(parse_joint(written, "matrices", folder))
    assert not matrices.failures
    assert differ(lap.mode.sliding_omega, matrices.mode.sliding_omega) < SAME
    assert differ(lap.prestress.pressure, matrices.prestress.pressure) < SAME
    assert differ(lap.assembly.opening_moment, matrices.assembly.opening_moment) < SAME
    drive = joint.drive_named("load")
    one, other = lap.cycles[drive][0], matrices.cycles[drive][0]
    assert differ(one.r, other.r) < SAME
    assert one.dissipated > 0
    assert differ(one.dissipated, other.dissipated) < SAME


def found(document, folder):
    return assemble(parse_joint(document, "matrices", folder))


def quick(document):
    return document | {"analysis": {"cycle": {"moment": [1e3, 2e3]}}}


def test_millimetres_and_another_width_change_nothing(document, folder):
    """The same joint 50 mm wide, in tonnes, newtons and millimetres, and its forces per metre."""
    base = quick(document)
    arrays = arrays_of(structure_of(reference_joint(pairs=41)))
    width, mm = 0.05, 1e-3
    for name, factor in (("K", width * mm), ("M", width * mm), ("supports", width * mm)):
        arrays[f"{name}.data"] = factor * arrays[f"{name}.data"]
    arrays["pairs_position"] = arrays["pairs_position"] / mm
    arrays["pairs_area"] = arrays["pairs_area"] * width / mm**2
    arrays["moment"] = (
        arrays["moment"] * mm
    )  # on displacements in mm: per N mm of moment, times 1e3
    np.savez(folder / "mm.npz", **arrays)
    swapped = {
        key: value for key, value in base.items() if key not in ("matrices", "interface")
    } | {
        "matrices": {k: v.replace("joint", "mm") for k, v in base["matrices"].items()}
        | {"length_unit": "mm", "width": "50 mm"},
        "interface": {k: v.replace("joint", "mm") for k, v in base["interface"].items()},
        "port": base["port"] | {"vector": "mm.npz:moment"},
    }
    a, b = found(base, folder), found(swapped, folder)
    assert differ(a.mode.stuck_omega, b.mode.stuck_omega) < 1e-9
    assert differ(a.prestress.pressure, b.prestress.pressure) < 1e-9
    assert differ(a.opening_moment, b.opening_moment) < 1e-9
    name = a.joint.outputs[0].port
    assert differ(a.mode.load_on_sliding[name], b.mode.load_on_sliding[name]) < 1e-9


def test_positions_may_be_counted_from_anywhere(document, folder):
    """The patch under the clamp is the same, and so is what positions are measured by, also of the whole."""
    there = quick(document)
    a = found(there, folder)
    b = found(with_column(there, folder, position=a.model.position + 3.0), folder)
    low, high = contact_extent(a.model.position, a.prestress.touching)
    assert low < 0 < high
    assert contact_extent(b.model.position, b.prestress.touching) == pytest.approx(
        (low + 3.0, high + 3.0), rel=1e-12
    )
    own, load = there["matrices"] | {"width": "whole"}, {"moment": [20.0]}
    wide = with_column(there | {"matrices": own, "load": load}, folder, area=0.02 * a.model.area)
    whole = found(wide, folder)
    reach = float(np.ptp(a.model.position))
    for each in (a, b, whole):
        assert 2 * each.measures.half_length == pytest.approx(
            reach, rel=0.03
        )  # half a pair at each end


def test_the_half_turn_is_found(document, folder, lap_file):
    image = found(quick(document), folder).model.image
    assert image is not None
    assert (image == np.arange(41)[::-1]).all()
    uneven = lap_file | {"beams": lap_file["beams"] | {"upper": {"thickness": "12 mm"}}}
    other = as_matrices(parse_joint(uneven), folder, "uneven.npz")
    assert found(quick(other | {"load": LOAD}), folder).model.image is None


# -- contact that a lap joint does not have --------------------------------------------------------


def with_column(document, folder, **columns):
    arrays = dict(np.load(folder / "joint.npz"))
    arrays |= {f"pairs_{name}": values for name, values in columns.items()}
    np.savez(folder / "columns.npz", **arrays)
    return document | {"interface": document["interface"] | {"pairs": "columns.npz:pairs"}}


def test_initial_gaps_keep_pairs_apart(document, folder):
    x = np.linspace(-1, 1, 41)
    gap = 2e-6 * x**2
    wide = quick(with_column(document, folder, gap=gap))
    narrow = found(wide, folder).prestress
    flat = found(quick(document), folder).prestress
    assert narrow.touching.sum() < flat.touching.sum()
    assert (narrow.solution.v[::2][~narrow.touching] < 0).all()
    np.testing.assert_allclose(narrow.solution.v[::2][narrow.touching], 0, atol=1e-15)
    # the clamp is carried whatever the gap
    assert narrow.solution.r[::2].sum() == pytest.approx(flat.solution.r[::2].sum(), rel=1e-9)


def test_contact_with_gaps_is_that_of_all_degrees_of_freedom(document, folder):
    """``K x + B_c^T r = P p`` with ``B_c x = g`` at the pairs that touch, solved as it stands: reactions
    press there and everywhere else ``B x < g``. K is divided by its size, for the rounding."""
    gap = 2e-6 * np.linspace(-1, 1, 41) ** 2
    assembly = found(quick(with_column(document, folder, gap=gap)), folder)
    structure, start = assembly.structure, assembly.prestress
    B = structure.interface.relative[::2]
    touching = B[start.touching]
    size = structure.stiffness.diagonal().mean()
    system = sp.bmat([[structure.stiffness / size, touching.T], [touching, None]]).tocsc()
    load = start.preload["clamp"] * structure.loads["clamp"]
    answer = spla.spsolve(system, np.concatenate([load / size, gap[start.touching]]))
    x, r = answer[: structure.dofs], size * answer[structure.dofs :]
    assert (r > 0).all()
    assert (B[~start.touching] @ x < gap[~start.touching]).all()
    reactions = start.solution.r[::2]
    np.testing.assert_allclose(reactions[start.touching], r, rtol=0, atol=1e-8 * r.max())
    np.testing.assert_allclose(start.solution.v[::2], B @ x - gap, rtol=0, atol=1e-12)


def test_another_preload_keeps_the_gaps(document, folder):
    gap = 2e-6 * np.linspace(-1, 1, 41) ** 2
    prepared = found(quick(with_column(document, folder, gap=gap)), folder).prepared
    clamp = prepared.prestress.preload["clamp"]
    again = prepared.with_preload({"clamp": clamp}).prestress
    np.testing.assert_allclose(again.pressure, prepared.prestress.pressure, rtol=1e-9)
    more = prepared.with_preload({"clamp": 2 * clamp}).prestress
    twice = quick(with_column(document, folder, gap=gap))
    twice["preload"] = twice["preload"] | {"force": "2 MN/m"}
    np.testing.assert_allclose(more.pressure, found(twice, folder).prestress.pressure, rtol=1e-9)
    assert differ(more.pressure, 2 * again.pressure) > 1e-3  # gaps do not grow with the force


def test_a_uniform_gap_only_moves_the_bodies(document, folder):
    """All gaps alike: the beams come together as rigid bodies and press as before."""
    soft = quick(with_column(document, folder, gap=np.full(41, 1e-7)))
    moved, flat = found(soft, folder).prestress, found(quick(document), folder).prestress
    # pinned ends hold the height of the bodies, and springs their place: a tilt of 1e-7 over 0.2 m
    np.testing.assert_allclose(moved.pressure, flat.pressure, atol=2e-3 * flat.pressure.max())


def test_friction_and_stiffness_of_each_pair(document, folder):
    mu = np.linspace(0.1, 0.4, 41)
    stiffness = np.full(41, 1e13)
    given = with_column(document, folder, friction=mu, tangential_stiffness=stiffness)
    given = quick(given | {"contact": {"law": "elastic"}})
    one = found(given, folder).prepared.law
    np.testing.assert_array_equal(one.friction, mu)
    area = np.load(folder / "joint.npz")["pairs_area"]
    np.testing.assert_allclose(one.compliance[1::2], 1 / (1e13 * area), rtol=1e-14)
    assert not one.compliance[::2].any()


# -- bodies that nothing holds ---------------------------------------------------------------------


@pytest.fixture(scope="module")
def free_ends(lap_file):
    """The reference joint with both ends free, driven by its end moments."""
    return lap_file | {
        "support": {"left": "free", "right": "free"},
        "analysis": {"cycle": {"moment": ["2 kN*m/m", "15 kN*m/m"], "steps": 100}},
    }


def without_springs(joint, folder, file):
    """The document of a joint without the springs that hold its mean position."""
    document = as_matrices(joint, folder, file)
    structure = structure_of(joint)
    bare = structure.stiffness - structure.supports
    np.savez(folder / file, **(dict(np.load(folder / file)) | sparse_parts("K", bare)))
    for key in ("motions", "supports"):
        del document["matrices"][key]
    return document


def test_free_bodies_are_as_with_springs_that_hold_their_place(free_ends, folder):
    """What a lap joint has springs for, at its free ends, matrices need not have.

    On those springs the beams swing at 14 rad/s, and they bend at 2,671: ``(14 / 2671)² = 2.7e-5``.
    """
    joint = parse_joint(free_ends)
    document = without_springs(joint, folder, "free.npz") | {"analysis": free_ends["analysis"]}
    lap, matrices = run(joint), run(parse_joint(document, "matrices", folder))
    assert len(matrices.assembly.imported.zero_modes) == 6
    assert differ(lap.mode.sliding_omega, matrices.mode.sliding_omega) < 2.7e-5
    assert differ(lap.mode.stuck_omega, matrices.mode.stuck_omega) < 2.7e-5
    assert differ(lap.assembly.opening_moment, matrices.assembly.opening_moment) < 1e-6
    for a, b in zip(lap.cycles["moment"], matrices.cycles["moment"], strict=True):
        assert differ(a.dissipated, b.dissipated) < 1e-4


def test_a_load_that_nothing_holds_is_refused(free_ends, folder):
    """A force on one end would push both beams away; equal moments at the two do not."""
    joint = parse_joint(free_ends)
    document = quick(without_springs(joint, folder, "pushed.npz"))
    port = {"name": "push", "kind": "force", "vector": "pushed.npz:out_deflection"}
    document |= {"port": port, "analysis": {"cycle": {"force": [1.0, 2.0]}}}
    with pytest.raises(
        InputError, match="nothing holds the joint as a whole against the load 'push'"
    ):
        found(document, folder)


# -- matrices by CalculiX --------------------------------------------------------------------------


def frequency(name, least=1.0):
    """Lowest frequency that CalculiX prints, Hz, beyond motions without stiffness."""
    text = (Path(__file__).parent / "calculix" / f"{name}.dat").read_text()
    rows = [line.split() for line in text.splitlines() if len(line.split()) == 5]
    return min(float(row[3]) for row in rows if row[0].isdigit() and float(row[3]) > least)


def test_states_are_those_that_calculix_finds_with_the_pairs_tied():
    """Pairs that touch tied by equations: in both directions, and normal to the contact alone.

    ``tests/pipeline/calculix``: ``deck("", tied(pairs, "12"))`` and ``"2"`` of
    ``examples/matrices_beam/make.py``, the 11 pairs within 18.75 mm; seven digits are printed.
    """
    assembly = assemble(load_joint(EXAMPLE))
    x = assembly.model.position[assembly.prestress.touching]
    assert np.abs(x).max() == pytest.approx(18.75e-3)
    assert len(x) == 11
    assert assembly.mode.stuck_frequency == pytest.approx(frequency("stuck"), rel=2e-7)
    assert assembly.mode.sliding_frequency == pytest.approx(frequency("sliding"), rel=2e-7)


def test_the_free_beam_opens_where_statics_says():
    """A tip force F on the upper beam, free but for the contact: moments about the tip of the overlap.

    The resultant of the pressure reaches the left tip where ``F (l + L_o) = P L_o``; with l from the middle
    to the tip 120 mm and L_o = 30 mm, and turned round the right one with ``F (l - L_o) = (P - F) L_o``.
    """
    P, reach, tip = 400e3, 30.0, 120.0
    limits = P * reach / (tip + reach), P * reach / (tip - reach)
    assert assemble(load_joint(EXAMPLE)).opening_moment == pytest.approx(min(limits), rel=1e-6)


def test_what_pulls_the_free_beam_apart_is_more_than_statics_allows():
    """A steady tip force beside the clamp's, up and down: the limits above are one of each."""
    model = assemble(load_joint(EXAMPLE)).model
    low, high = 400e3 * 30.0 / (120.0 + 30.0), 400e3 * 30.0 / (120.0 - 30.0)

    def apart(force):
        loads = ({"clamp": 400e3, "tip": sign * force} for sign in (1, -1))
        return [pulled_apart(model, model.amplitudes(each)) for each in loads]

    assert apart(0.999 * low) == [False, False]
    assert sorted(apart(1.001 * low)) == sorted(apart(0.999 * high)) == [False, True]
    assert apart(1.001 * high) == [True, True]
    assert pulled_apart(model, model.amplitudes({"clamp": -400e3}))


def test_motions_without_stiffness_have_names():
    names = assemble(load_joint(EXAMPLE)).imported.zero_modes
    assert sorted(name.split(" of ")[0] for name in names) == [
        "rotation",
        "translation along x",
        "translation along y",
    ]


@pytest.mark.skipif(importlib.util.find_spec("matplotlib") is None, reason="draws")
def test_a_run_is_written_and_read_again(tmp_path):
    from typer.testing import CliRunner

    from microslip.cli.check import app as check
    from microslip.cli.run import app as command
    from microslip.results.store import load_run

    shutil.copytree(EXAMPLE.parent / "matrices_beam", tmp_path / "matrices_beam")
    file = tmp_path / "joint.toml"
    text = EXAMPLE.read_text().replace("count = 26", "count = 2\nharmonics = 2\nstability = false")
    file.write_text(text.replace("[analysis.cycle]", "[analysis.cycle]\ncount = 4"))
    shown = CliRunner().invoke(check, [str(file)])
    assert shown.exit_code == 0
    assert "translation along x of part 2" in " ".join(shown.output.split())
    done = CliRunner().invoke(
        command, [str(file), "--out", str(tmp_path / "out"), "--format", "png"]
    )
    assert done.exit_code == 0, done.output
    again = load_run(tmp_path / "out")
    assert len(again.harmonic) == 3
    assert (tmp_path / "out" / "figures" / "overview.png").is_file()


def test_stored_results_of_other_files_are_not_read(tmp_path):
    """What the run was of has changed since."""
    from microslip.results.store import RunStore

    here = tmp_path / "matrices_beam"
    shutil.copytree(EXAMPLE.parent / "matrices_beam", here)
    (tmp_path / "joint.toml").write_text(EXAMPLE.read_text())
    store = RunStore(tmp_path / "run.h5")
    store.begin(load_joint(tmp_path / "joint.toml"))
    assert store.read()[0] == load_joint(tmp_path / "joint.toml")
    table = (here / "pairs.csv").read_text()
    (here / "pairs.csv").write_text(table.replace("1.25,", "1.5,", 1))
    with pytest.raises(InputError, match="have changed since"):
        store.read()


# -- matrices reduced by others --------------------------------------------------------------------


def craig_bampton(structure, modes):
    """Basis (n, b + modes) that keeps every degree of freedom of the pairs; the rest by fixed modes."""
    K, M = structure.stiffness.tocsc(), structure.mass.tocsc()
    edge = np.unique(structure.interface.relative.tocsc().nonzero()[1])
    inner = np.setdiff1d(np.arange(structure.dofs), edge)
    own = K[inner][:, inner].tocsc()
    T = np.zeros((structure.dofs, len(edge) + modes))
    T[edge, np.arange(len(edge))] = 1.0
    T[inner, : len(edge)] = -spla.splu(own).solve(K[inner][:, edge].toarray())
    T[inner, len(edge) :] = spla.eigsh(own, k=modes, M=M[inner][:, inner], sigma=0)[1]
    return T


def test_a_craig_bampton_model_is_as_good_as_its_modes(tmp_path):
    """Degrees of freedom that are no displacements: modal coordinates of a reduction by others."""
    joint = reference_joint(pairs=21)
    document = as_matrices(joint, tmp_path) | {"analysis": {"cycle": {"moment": [5e3, 15e3]}}}
    structure = structure_of(joint)
    T = craig_bampton(structure, 60)
    arrays = dict(np.load(tmp_path / "joint.npz"))
    reduced = {"pairs_position": arrays["pairs_position"], "pairs_area": arrays["pairs_area"]}
    for name, matrix in (("K", structure.stiffness), ("M", structure.mass)):
        reduced |= sparse_parts(name, T.T @ (matrix @ T))
    reduced |= sparse_parts("supports", T.T @ (structure.supports @ T))
    reduced |= sparse_parts("B", structure.interface.relative @ T)
    reduced["motions"] = np.linalg.lstsq(T, structure.motions, rcond=None)[0]
    reduced |= {name: T.T @ v for name, v in arrays.items() if v.shape == (structure.dofs,)}
    whole = run(parse_joint(document, "matrices", tmp_path))
    np.savez(tmp_path / "joint.npz", **reduced)
    small = run(parse_joint(document, "matrices", tmp_path))
    assert small.structure.dofs < 150
    assert differ(whole.mode.sliding_omega, small.mode.sliding_omega) < 1e-5
    assert differ(whole.mode.stuck_omega, small.mode.stuck_omega) < 1e-5
    assert differ(whole.assembly.opening_moment, small.assembly.opening_moment) < 1e-4
    for a, b in zip(whole.cycles["moment"], small.cycles["moment"], strict=True):
        assert differ(a.dissipated, b.dissipated) < 1e-4


def test_methods_agree_where_pairs_have_gaps(document, folder):
    """Time integration knows nothing of harmonic balance: both close and open the gaps alike."""
    gap = 1e-6 * np.linspace(-1, 1, 41) ** 2
    given = with_column(document, folder, gap=gap) | {
        "analysis": {
            "response": {"from": 168, "to": 182},
            "reduced": {"amplitudes": 6},
            "time": {"frequencies": [174.0], "steps": 300},
            "harmonic": {"frequencies": [174.0, 174.5], "harmonics": 7, "stability": False},
            "cycle": {"moment": [5e3]},
        },
        "load": {"moment": [200.0]},
    }
    found = run(parse_joint(given, "matrices", folder))
    steady = found.time_domain[0].steady
    balanced = next(p for p in found.harmonic[0].points if p.frequency == 174.0)
    assert steady.converged
    assert abs(steady.amplitude) == pytest.approx(abs(balanced.amplitude), rel=5e-3)

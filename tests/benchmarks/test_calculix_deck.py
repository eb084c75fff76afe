"""The CalculiX deck poses our problem: same mesh, loads, supports and penalty. Needs no ccx."""

from __future__ import annotations

import json
import shutil
import sys

import numpy as np
import pytest
from conftest import GEOMETRY, ROOT

from microslip.errors import ContactError, ModelError
from microslip.model.elasticity import Material, elastic_body
from microslip.model.lap import lap_joint_structure
from microslip.model.lap_mesh import MeshControl, lap_joint_meshes

FOLDER = ROOT / "benchmarks" / "calculix"
sys.path.insert(0, str(FOLDER))

import ccx_compare  # noqa: E402
from ccx_deck import Loading, load_path, write_deck  # noqa: E402
from ccx_results import contact_points, iterations, read_path  # noqa: E402
from linear_joint import linear_joint  # noqa: E402
from same_elements import (  # noqa: E402
    ccx_points,
    gauss_points,
    linear_structure,
    point_interface,
    rectangle_mass,
    rectangle_stiffness,
)

MATERIAL = Material(70e9, 0.3, 2000.0, "strain")
CONTROL = MeshControl(contact_pairs=21)
LOADING = Loading(
    clamp=1e3,
    moment=0.503,
    spring=1e5,
    friction=0.25,
    normal_stiffness=2e15,
    tangential_stiffness=1e15,
    steps=8,
    cycles=2,
)
LAYER = 2.0
FACES = {"S3": (0, 1, 5, 4), "S5": (2, 3, 7, 6)}
"""Corners of the lower and the upper face of a C3D8, as CalculiX numbers them."""


@pytest.fixture(scope="module")
def joint():
    return linear_joint(GEOMETRY, CONTROL)


@pytest.fixture(scope="module")
def deck(joint):
    """The deck as a list of (keyword, parameters, rows)."""
    text = write_deck(joint, MATERIAL, LOADING, layer_mm=LAYER)
    cards = []
    for line in text.splitlines():
        if line.startswith("*"):
            keyword, *rest = [part.strip() for part in line.split(",")]
            parameters = dict(part.split("=") for part in rest if "=" in part)
            cards.append((keyword, parameters, []))
        else:
            cards[-1][2].append([part.strip() for part in line.split(",")])
    return cards


def rows(deck, keyword, **wanted):
    return [
        row
        for card, parameters, content in deck
        if card == keyword and all(parameters.get(k) == v for k, v in wanted.items())
        for row in content
    ]


@pytest.fixture(scope="module")
def nodes(deck):
    return np.array(rows(deck, "*NODE"), dtype=float)[:, 1:]


@pytest.fixture(scope="module")
def hexes(deck):
    return np.array(rows(deck, "*ELEMENT", TYPE="C3D8I"), dtype=int)[:, 1:] - 1


@pytest.fixture(scope="module")
def steps(deck):
    """Nodal forces, N, at the end of each *STEP: (steps, nodes, 3), loads of earlier steps kept."""
    count = len(rows(deck, "*NODE"))
    force = np.zeros((count, 3))
    history = []
    for keyword, _, content in deck:
        if keyword == "*CLOAD":
            for node, direction, value in content:
                force[int(node) - 1, int(direction) - 1] = float(value)
        if keyword == "*END STEP":
            history.append(force.copy())
    return np.array(history)


def test_no_number_is_longer_than_calculix_reads(deck):
    cards = [content for keyword, _, content in deck if keyword != "*HEADING"]
    assert max(len(field) for content in cards for row in content for field in row) <= 20


def test_elements_fill_the_beams_the_right_way_round(nodes, hexes):
    corner = nodes[hexes]
    edges = [corner[:, k] - corner[:, 0] for k in (1, 3, 4)]
    volume = np.einsum("ek,ek->e", np.cross(edges[0], edges[1]), edges[2])
    assert volume.min() > 0
    assert volume.sum() == pytest.approx(2 * 251.5 * 12.5 * LAYER, rel=1e-10)


def test_contact_faces_lie_on_the_pairs(deck, nodes, hexes):
    structure = lap_joint_structure(GEOMETRY, MATERIAL, CONTROL, horizontal_spring=1e5)
    pairs = structure.interface.position * 1e3
    for name, above in (("SLAVE", False), ("MASTER", True)):
        faces = rows(deck, "*SURFACE", NAME=name)
        corners = np.array([nodes[hexes[int(e) - 1][list(FACES[face])]] for e, face in faces])
        np.testing.assert_array_equal(corners[:, :, 1], 0.0)
        bodies = nodes[hexes[[int(e) - 1 for e, _ in faces]]][:, :, 1].mean(axis=1)
        assert np.all((bodies > 0) == above)
        np.testing.assert_allclose(np.unique(np.round(corners[:, :, 0], 9)), pairs, atol=1e-8)


def test_plane_strain(deck, nodes):
    """Every node behind follows the one in front of it; none moves across."""
    ties = np.array([row for row in rows(deck, "*EQUATION") if len(row) > 1], dtype=float)
    behind, front = ties[:, 0].astype(int) - 1, ties[:, 3].astype(int) - 1
    np.testing.assert_array_equal(nodes[behind, :2], nodes[front, :2])
    np.testing.assert_array_equal(ties[:, [2, 5]], np.tile([1.0, -1.0], (len(ties), 1)))
    np.testing.assert_array_equal(ties[:, 1], ties[:, 4])
    assert len(np.unique(ties[:, :2], axis=0)) == len(nodes)
    assert ["ALL", "3", "3"] in rows(deck, "*BOUNDARY")


def test_clamp_and_moment(nodes, steps):
    """Resultants: P pressing each beam about x = 0, +-M on the ends, nothing else."""
    upper = nodes[:, 1] >= 6.25
    pressed = steps[0]
    clamp = LOADING.clamp / 1e3 * LAYER
    np.testing.assert_allclose(pressed[upper].sum(axis=0), [0, -clamp, 0], atol=1e-9 * clamp)
    np.testing.assert_allclose(pressed[~upper].sum(axis=0), [0, clamp, 0], atol=1e-9 * clamp)
    assert pressed[upper][:, 1] @ nodes[upper, 0] == pytest.approx(0, abs=1e-9 * clamp)
    top = steps[LOADING.steps // 4] - pressed
    moment = LOADING.moment * LAYER
    for side in (-1, 1):
        end = np.isclose(nodes[:, 0], side * (251.5 - 37.5))
        bending = -top[end, 0] @ nodes[end, 1]
        assert bending == pytest.approx(side * moment, rel=1e-10)
        np.testing.assert_allclose(top[end].sum(axis=0), 0, atol=1e-10 * moment)
    assert not top[np.abs(nodes[:, 0]) < 213].any()


def test_loads_do_the_work_of_ours_on_linear_displacements(joint):
    """Both sets of nodal forces are consistent, so they agree on every linear field of a beam."""
    ours = lap_joint_structure(GEOMETRY, MATERIAL, CONTROL, horizontal_spring=1e5)
    full = np.zeros((2, max(ours.free) + 1))
    full[0, ours.free], full[1, ours.free] = ours.loads["clamp"], ours.loads["moment"]
    positions = _our_nodes()
    rng = np.random.default_rng(3)
    for load, theirs in zip(full, (joint.clamp, joint.moment), strict=True):
        missing = np.zeros(positions.size)
        missing[: len(load)] = load
        forces = missing.reshape(-1, 2)
        for above in (False, True):
            gradient = rng.standard_normal((2, 2))
            mine = _in_body(positions, above)
            other = _in_body(joint.nodes, above)
            expected = np.sum(forces[mine] * (positions[mine] @ gradient))
            found = np.sum(theirs[other] * (joint.nodes[other] @ gradient))
            assert found == pytest.approx(expected, rel=1e-9, abs=1e-12)


def _our_nodes():
    return np.hstack(
        [elastic_body(mesh, MATERIAL).nodes for mesh in lap_joint_meshes(GEOMETRY, CONTROL)]
    ).T


def _in_body(positions, above):
    """First half of the nodes is the lower beam's, in both meshes."""
    half = len(positions) // 2
    return slice(half, None) if above else slice(None, half)


def test_the_moment_follows_a_sine(steps):
    history = steps - steps[0]
    size = np.abs(history).max(axis=(1, 2)) * np.sign([f for _, f in load_path(LOADING)])
    expected = np.sin(2 * np.pi * np.arange(17) / 8)
    np.testing.assert_allclose(size / size.max(), expected, atol=1e-10)


def test_springs_supports_and_contact(deck, nodes):
    springs = [float(row[0]) for row in rows(deck, "*SPRING")[1::2]]
    assert sum(springs) == pytest.approx(2 * LOADING.spring * 1e-6 * LAYER, rel=1e-10)
    held = [int(row[0]) - 1 for row in rows(deck, "*BOUNDARY") if row[0] != "ALL"]
    np.testing.assert_allclose(nodes[held, 0], [-214, 214])
    np.testing.assert_allclose(nodes[held, 1], [-nodes[held[1], 1], nodes[held[1], 1]])
    assert abs(nodes[held[1], 1] - 6.25) <= 12.5 * CONTROL.max_layer / 2
    assert float(rows(deck, "*SURFACE BEHAVIOR")[0][0]) == pytest.approx(2e6)
    friction = np.array(rows(deck, "*FRICTION"), dtype=float)
    np.testing.assert_allclose(friction[:, 1], 1e6)
    assert friction[0, 0] < 1e-6
    np.testing.assert_array_equal(friction[1:, 0], 0.25)
    assert [float(v) for v in rows(deck, "*ELASTIC")[0]] == pytest.approx([70e3, 0.3])


def test_what_calculix_cannot_pose_is_refused(joint):
    with pytest.raises(ModelError, match=r"material\.plane"):
        write_deck(joint, Material(70e9, 0.3, 2000.0, "stress"), LOADING)
    frictionless = Loading(1e3, 0.5, 1e5, 0.0, 1e15, 1e15)
    with pytest.raises(ModelError, match=r"contact\.friction"):
        write_deck(joint, MATERIAL, frictionless)


def test_rectangle_bends_exactly():
    """Pure bending of one element of any aspect stores E' I kappa² L / 2 (and shear-locks without
    its incompatible modes); rigid motion stores nothing."""
    for width, height in ((1.0, 1.0), (7.0, 0.3)):
        k = rectangle_stiffness(width, height, MATERIAL)
        x = np.array([0, width, width, 0]) - width / 2
        y = np.array([0, 0, height, height]) - height / 2
        for u in (np.ones(4), np.zeros(4)):
            rigid = np.column_stack([u, 1 - u]).ravel()
            assert rigid @ k @ rigid == pytest.approx(0, abs=1e-12 * k.max())
        spin = np.column_stack([-y, x]).ravel()
        assert spin @ k @ spin == pytest.approx(0, abs=1e-12 * k.max() * width**2)
        bent = np.column_stack([-x * y, np.full(4, width**2 / 8)]).ravel()
        exact = MATERIAL.plane_modulus() * height**3 / 12 * width
        assert bent @ k @ bent == pytest.approx(exact, rel=1e-10)
        m = rectangle_mass(width, height, MATERIAL.density)
        assert spin @ m @ spin == pytest.approx(
            MATERIAL.density * width * height * (width**2 + height**2) / 12
        )


def test_contact_points_integrate_polynomials():
    """Radon's rule is exact to degree 5 on triangles, two Gauss points to degree 3."""
    for (xi, weights), degree in ((ccx_points(), 5), (gauss_points(2), 3)):
        for power in range(degree + 1):
            exact = 0.0 if power % 2 else 1 / (power + 1)
            assert weights @ xi**power == pytest.approx(exact, abs=1e-12)


def test_contact_points_see_linear_displacements(joint):
    """Approach and slip of the bodies' linear motions, at the points; areas cover the overlap."""
    interface = point_interface(joint, ccx_points(), 2 * len(joint.nodes))
    x, y = joint.nodes.T
    upper = np.arange(len(x)) >= len(x) // 2
    u = np.column_stack([np.where(upper, 3 * x, x), np.where(upper, 0.5 * x + y, 2 * x)])
    v = interface.relative @ u.ravel()
    np.testing.assert_allclose(v[0::2], 1.5 * interface.position, atol=1e-15)
    np.testing.assert_allclose(v[1::2], 2 * interface.position, atol=1e-15)
    assert interface.area.sum() == pytest.approx(2 * GEOMETRY.overlap_half_length)


def test_beams_of_linear_elements_bend_exactly(joint):
    """Nodal forces of pure bending, u_y'' = kappa: the end moment E' I kappa, on both ends alone."""
    structure = linear_structure(joint, MATERIAL, 0.0, gauss_points(2))
    kappa, nu, h = 1e-3, MATERIAL.poissons_ratio, GEOMETRY.thickness
    x, y = joint.nodes.T
    upper = np.arange(len(x)) >= len(x) // 2
    height = y - np.where(upper, h / 2, -h / 2)
    rise = kappa / 2 * (x**2 + nu / (1 - nu) * height**2)
    held = joint.supported[upper.astype(int)]
    u = np.column_stack([-kappa * x * height, rise - rise[held]]).ravel()
    forces = np.zeros(u.size)
    forces[structure.free] = structure.stiffness @ u[structure.free]
    moment = MATERIAL.plane_modulus() * h**3 / 12 * kappa
    far = np.abs(x) > GEOMETRY.overlap_half_length * 1.001
    found, expected = forces.reshape(-1, 2)[far], moment * joint.moment[far]
    np.testing.assert_allclose(found, expected, atol=1e-8 * np.abs(expected).max())


def test_reads_what_calculix_prints(joint, tmp_path):
    """Two increments in the format of ccx: the far ends turn, the upper overlap shifts."""
    turned = joint.nodes * [1, -1] @ [[0, 0], [1, 0]]
    text = ""
    for k in range(2):
        text += f"\n displacements (vx,vy,vz) for set WATCH and time  {k + 1:.7E}\n\n"
        for node in np.unique(np.r_[joint.end_nodes, joint.lower_nodes, joint.upper_nodes]):
            shift = 2e-3 * k if node in joint.upper_nodes else 0.0
            ux = 1e3 * 1e-6 * k * turned[node, 0] * np.sign(joint.nodes[node, 0]) + shift
            text += f"{node + 1:10d} {ux: .6E}  0.000000E+00  0.000000E+00\n"
    dat = tmp_path / "joint.dat"
    dat.write_text(text)
    path = read_path(dat, joint, 2)
    np.testing.assert_array_equal(path.time, [1, 2])
    # u_x = -1e-6 y sign(x): the right end turns by 1e-6, the left by -1e-6, concave up.
    np.testing.assert_allclose(path.rotation, [0, 2e-6], rtol=1e-5)
    np.testing.assert_allclose(path.slip, np.outer([0, 2e-6], np.ones(21)), atol=1e-12)
    with pytest.raises(ContactError, match="2 of 3 increments"):
        read_path(dat, joint, 3)


def test_reads_convergence(tmp_path):
    cvg = tmp_path / "joint.cvg"
    cvg.write_text(
        "SUMMARY OF C0NVERGENCE INFORMATION\n"
        "  STEP   INC  ATT   ITER     CONT.   RESID.        CORR.      RESID.      CORR.\n"
        "                              EL.    FORCE         DISP       FLUX        TEMP.\n"
        "                              (#)     (%)           (%)        (%)         (%)\n"
        "     1     1     1     1     1400  0.2214E+03  0.1000E+03  0.0000E+00  0.0000E+00\n"
        "     1     1     1     2     1380  0.0000E+00  0.1000E+00  0.0000E+00  0.0000E+00\n"
        "     2     1     1     1     1381  0.2214E+03  0.1000E+03  0.0000E+00  0.0000E+00\n"
    )
    np.testing.assert_array_equal(iterations(cvg), [2, 1])
    np.testing.assert_array_equal(contact_points(cvg), [1400, 1380, 1381])


def test_skips_without_calculix(monkeypatch, capsys):
    monkeypatch.setenv("PATH", "")
    assert ccx_compare.main([]) == 0
    assert "skipped" in capsys.readouterr().out


@pytest.mark.validate
@pytest.mark.skipif(shutil.which("ccx") is None, reason="CalculiX is not installed")
def test_calculix_dissipates_the_same(tmp_path, finding):
    """Same elements, same contact points: only the algorithms differ."""
    record = tmp_path / "table.json"
    assert ccx_compare.main(["--pairs", "21", "--steps", "40", "--json", str(record)]) == 0
    calculix, same, *_ = json.loads(record.read_text())["rows"]
    for name, allowed in (("dissipated", 3e-4), ("rotation", 1e-6)):
        off = abs(same[name] / calculix[name] - 1)
        finding(f"{name}, against CalculiX on the same elements", off, at_most=allowed)

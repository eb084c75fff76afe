"""Constant stress across interfaces whose nodes do not match: the contact patch test.

A state of constant stress is in equilibrium with the reactions ``r = A (-n s n, t s n)`` of the pairs and the
tractions on the rest of the outside, at every node; and its displacements, linear in the coordinates, leave
no relative displacement.
"""

import sys
from pathlib import Path

import numpy as np
import pytest

sys.path.insert(0, str(Path(__file__).parents[1] / "mesh"))
from blocks import two_blocks

from microslip.model.elasticity import Material
from microslip.model.mesh.assembly import assemble
from microslip.model.mesh.element_types import TYPES
from microslip.model.mesh.facets import facets_of
from microslip.model.mesh.loads import traction_load
from microslip.model.mortar.coupling import couple

MATERIAL = Material(70e9, 0.3, 2700.0)
PLANE = [
    ("tri3", "quad4"),
    ("quad8", "tri6"),
    ("quad9", "quad4"),
    ("tri6", "tri3"),
    ("quad8", "quad8"),
]
SPACE = [
    ("tet4", "hex8"),
    ("tet10", "tet10"),
    ("hex20", "tet10"),
    ("hex20", "hex20"),
    ("hex27", "wedge15"),
    ("wedge6", "tet10"),
    ("hex8", "hex20"),
]


def residuals(mesh, pairs, seed=3):
    """Nodal forces out of balance over the largest reaction, and relative displacement over displacement."""
    d = mesh.dimension
    K, _ = assemble(mesh, MATERIAL)
    G = 1e-3 * np.random.default_rng(seed).standard_normal((d, d))
    u = (mesh.points @ G.T).ravel()
    strain = 0.5 * (G + G.T)
    lam, mu = MATERIAL.lame()
    stress = lam * np.trace(strain) * np.eye(d) + 2 * mu * strain
    outside = sum(traction_load(mesh, f"rest{k}", lambda x, n: n @ stress) for k in range(2))
    traction = pairs.normal @ stress
    r = np.empty((pairs.pairs, d))
    r[:, 0] = -np.sum(traction * pairs.normal, axis=1)
    r[:, 1:] = np.einsum("md,mtd->mt", traction, pairs.tangents)
    r *= pairs.area[:, None]
    B = pairs.relative()
    balance = K @ u + B.T @ r.ravel() - outside
    return np.abs(balance).max() / np.abs(r).max(), np.abs(B @ u).max() / np.abs(u).max()


@pytest.mark.parametrize("tilt", [0.0, 0.4])
@pytest.mark.parametrize(("lower", "upper"), PLANE)
def test_patch_test_in_the_plane(lower, upper, tilt):
    for turn in (0.0, 0.7):
        mesh = two_blocks(lower, upper, tilt=tilt, turn=turn, shake=0.2)
        for slave in ("touch0", "touch1"):
            pairs = couple(mesh, "touch0", "touch1", slave=slave)
            assert max(residuals(mesh, pairs)) < 1e-10
            assert pairs.area.min() > 0


@pytest.mark.parametrize("tilt", [0.0, 0.3])
@pytest.mark.parametrize(("lower", "upper"), SPACE)
def test_patch_test_in_space(lower, upper, tilt):
    for turn, slave in ((0.0, "touch0"), (0.5, "touch1")):
        mesh = two_blocks(lower, upper, tilt=tilt, turn=turn)
        pairs = couple(mesh, "touch0", "touch1", slave=slave)
        assert max(residuals(mesh, pairs)) < 1e-10
        assert pairs.area.min() > 0


@pytest.mark.parametrize(
    ("lower", "upper"), [("tet4", "tet10"), ("hex8", "hex20"), ("hex20", "tet10")]
)
def test_patch_test_with_facets_of_any_shape(lower, upper):
    mesh = two_blocks(lower, upper, tilt=0.2, turn=0.3, shake=0.2)
    pairs = couple(mesh, "touch0", "touch1")
    assert max(residuals(mesh, pairs)) < 1e-10


def area(mesh, name):
    facets = facets_of(mesh, name)
    return sum(facets.areas(group).sum() for group in facets.groups)


CASES = [*PLANE, *SPACE]


@pytest.mark.parametrize(("lower", "upper"), CASES)
def test_rigid_motions_leave_no_relative_displacement_and_areas_add_up(lower, upper):
    mesh = two_blocks(lower, upper, tilt=0.3, turn=0.4, shake=0.1)
    d = mesh.dimension
    pairs = couple(mesh, "touch0", "touch1")
    B = pairs.relative()
    motions = [np.tile(e, len(mesh.points)) for e in np.eye(d)]
    for i in range(d):
        for j in range(i):
            spin = np.zeros((d, d))
            spin[i, j], spin[j, i] = 1.0, -1.0
            motions.append((mesh.points @ spin).ravel())
    for motion in motions:
        assert np.abs(B @ motion).max() < 1e-12
    for weights in (pairs.slave_weights, pairs.master_weights):
        assert np.allclose(weights.sum(axis=1), 1.0, atol=1e-12)
    assert pairs.area.sum() == pytest.approx(area(mesh, "touch0"), rel=1e-12)
    assert pairs.covered == pytest.approx(1.0, rel=1e-12)
    assert np.abs(pairs.gap).max() < 1e-14


@pytest.mark.parametrize("slave", ["touch0", "touch1"])
@pytest.mark.parametrize(("lower", "upper"), CASES)
def test_sides_that_cover_each_other_in_part(lower, upper, slave):
    """A smaller body presses evenly: its nodal forces are those of the pressure; the other's balance them."""
    mesh = two_blocks(lower, upper, counts=(3, 3), sizes=(1.0, 0.61), turn=0.2)
    d = mesh.dimension
    pairs = couple(mesh, "touch0", "touch1", slave=slave)
    assert pairs.area.min() > 0
    assert pairs.area.sum() == pytest.approx(area(mesh, "touch1"), rel=1e-12)
    r = np.zeros((pairs.pairs, d))
    r[:, 0] = pairs.area
    forces = -(pairs.relative().T @ r.ravel()).reshape(-1, d)
    small = np.unique(facets_of(mesh, "touch1").nodes)
    exact = traction_load(mesh, "touch1", lambda x, n: -n).reshape(-1, d)
    assert np.abs(forces[small] - exact[small]).max() < 1e-12
    assert np.abs(forces.sum(axis=0)).max() < 1e-13
    for i in range(d):
        for j in range(i):
            moment = mesh.points[:, i] @ forces[:, j] - mesh.points[:, j] @ forces[:, i]
            assert abs(moment) < 1e-13


def test_sign_follows_geometry_and_not_names():
    mesh = two_blocks("quad8", "quad8")
    one, other = couple(mesh, "touch0", "touch1"), couple(mesh, "touch1", "touch0", slave="touch1")
    up = np.zeros((len(mesh.points), 2))
    upper = mesh.points[:, 1] > 1e-9
    upper[facets_of(mesh, "touch1").nodes] = True
    up[upper] = [2.0, 1.0]
    for pairs in (one, other):
        v = (pairs.relative() @ up.ravel()).reshape(-1, 2)
        assert np.allclose(v, [-1.0, 2.0])  # opens, and the upper body moves to the right
        assert np.all(np.diff(pairs.interface().position) > 0)


def random_case(seed):
    """Two bodies of any element types, finenesses and distortions, and the side that is the slave."""
    rng = np.random.default_rng(seed)
    d = 2 if seed % 3 else 3
    kinds = [k for k, shape in TYPES.items() if shape.dimension == d and shape.family != "line"]
    lower, upper = rng.choice(kinds, 2)
    counts = tuple(int(n) for n in rng.integers(2, 9 if d == 2 else 5, 2))
    shape = {
        "tilt": rng.uniform(0, 0.5),
        "turn": rng.uniform(-3, 3),
        "shake": rng.choice([0, 0.1, 0.25]),
    }
    return two_blocks(lower, upper, counts=counts, **shape), f"touch{rng.integers(2)}"


def check_random_case(seed):
    mesh, slave = random_case(seed)
    pairs = couple(mesh, "touch0", "touch1", slave=slave)
    assert max(residuals(mesh, pairs, seed)) < 1e-10
    assert pairs.area.min() > 0


@pytest.mark.parametrize("seed", range(12))
def test_patch_test_of_bodies_drawn_at_random(seed):
    check_random_case(seed)


@pytest.mark.validate
@pytest.mark.parametrize("start", range(5000, 5300, 50))
def test_patch_test_of_many_bodies_drawn_at_random(start):
    for seed in range(start, start + 50):
        check_random_case(seed)

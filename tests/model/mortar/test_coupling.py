"""Matching nodes, curved surfaces, gaps, and pairs of surfaces that cannot be coupled."""

import sys
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

sys.path.insert(0, str(Path(__file__).parents[1] / "mesh"))
from blocks import block, two_blocks

from microslip.errors import ModelError
from microslip.model.mesh.boundary import joined, with_surfaces
from microslip.model.mesh.element_types import TYPES
from microslip.model.mesh.facets import facets_of
from microslip.model.mesh.finite_elements import Surface
from microslip.model.mortar.clipping import common_triangles, twice_areas
from microslip.model.mortar.coupling import couple
from microslip.model.mortar.multipliers import positive


@pytest.mark.parametrize("kind", ["tri3", "tri6", "quad4", "quad8", "quad9"])
def test_matching_nodes_in_the_plane_are_paired_one_to_one(kind):
    for bend in (None, lambda p: 0.2 * p[:, 0] ** 2):
        mesh = two_blocks(kind, kind, counts=(4, 4), bend=bend)
        pairs = couple(mesh, "touch0", "touch1")
        assert pairs.pairs == len(facets_of(mesh, "touch0").nodes)
        assert np.allclose(pairs.slave_weights.data, 1.0, atol=1e-12)
        assert np.allclose(pairs.master_weights.data, 1.0, atol=1e-12)
        there = mesh.points[pairs.master_weights.indices]
        assert np.allclose(there, pairs.points, atol=1e-12)


@pytest.mark.parametrize("kind", ["tet4", "hex8", "wedge6", "hex27", "tet10", "hex20", "wedge15"])
def test_matching_nodes_in_space(kind):
    """One to one where all shape functions have positive integrals; else middles less their corners."""
    mesh = two_blocks(kind, kind, counts=(3, 3))
    pairs = couple(mesh, "touch0", "touch1")
    if kind in ("tet10", "hex20"):
        middle = np.diff(pairs.slave_weights.indptr) == 3
        assert 0 < middle.sum() < pairs.pairs
        assert np.allclose(np.sort(pairs.slave_weights[middle].data)[-1], 1 / (1 - 0.4))
    elif kind != "wedge15":
        assert np.allclose(pairs.slave_weights.data, 1.0, atol=1e-11)
        assert np.allclose(mesh.points[pairs.master_weights.indices], pairs.points, atol=1e-11)
    assert pairs.area.min() > 0


def test_areas_normals_and_gaps_of_a_curved_surface_are_those_of_the_curve():
    """A wave: facets of second order find it, and their distance from each other vanishes as h³."""

    def wave(p):
        return 0.1 * np.sin(3 * p[:, 0])

    s, w = np.polynomial.legendre.leggauss(60)
    exact = 0.5 * w @ np.sqrt(1 + (0.3 * np.cos(1.5 * (s + 1))) ** 2)
    errors = []
    for n in (8, 16, 32):
        mesh = two_blocks("quad8", "quad8", counts=(n, n + 1), bend=wave)
        pairs = couple(mesh, "touch0", "touch1", slave="touch0")
        slope = 0.3 * np.cos(3 * pairs.points[:, 0])
        normal = np.column_stack([-slope, np.ones_like(slope)])
        normal /= np.linalg.norm(normal, axis=1, keepdims=True)
        turned = np.abs(pairs.normal - normal).max()
        errors.append([abs(pairs.area.sum() - exact), turned, np.abs(pairs.gap).max()])
        translation = (pairs.relative() @ np.ones(2 * len(mesh.points))).reshape(-1, 2)
        assert np.abs(translation).max() < 1e-12
    orders = np.log2(np.array(errors[:-1]) / errors[1:])
    assert orders[-1, 0] > 2.7
    assert orders[-1, 1] > 0.9
    assert orders[-1, 2] > 2.7


@pytest.mark.parametrize(
    "kinds",
    [
        ("tet10", "hex20"),
        pytest.param(("hex20", "wedge15"), marks=pytest.mark.validate),
        pytest.param(("hex27", "tet10"), marks=pytest.mark.validate),
    ],
)
def test_a_curved_surface_in_space_has_the_area_of_the_curve(kinds):
    """The same wave along x in space; rigid turns leave as much as the distance of the facets does."""

    def wave(p):
        return 0.1 * np.sin(3 * p[:, 0])

    s, w = np.polynomial.legendre.leggauss(60)
    exact = 0.5 * w @ np.sqrt(1 + (0.3 * np.cos(1.5 * (s + 1))) ** 2)
    errors = []
    for n in (4, 8):
        mesh = two_blocks(*kinds, counts=(n, n + 1), bend=wave)
        pairs = couple(mesh, "touch0", "touch1", slave="touch0")
        translation = pairs.relative() @ np.ones(3 * len(mesh.points))
        assert np.abs(translation).max() < 1e-12
        assert pairs.area.min() > 0
        turn = mesh.points[:, [1, 0, 2]] * [-1.0, 1.0, 0.0]
        slip = np.abs(pairs.relative() @ turn.ravel()).max()
        errors.append([abs(pairs.area.sum() - exact), slip])
    assert errors[-1][0] < 1e-3
    assert errors[-1][0] < errors[0][0]
    assert errors[-1][1] < errors[0][1] / 2


def test_gap_is_the_distance_of_the_sides():
    lower, upper = block("quad8", 0, 4), block("quad8", 1, 5)
    mesh = joined(lower, replace(upper, points=upper.points + np.array([0.0, 0.02])))
    assert np.allclose(couple(mesh, "touch0", "touch1").gap, 0.02, atol=1e-14)
    mesh = joined(
        lower,
        replace(upper, points=upper.points * [1.0, 1.0] + 0.01 * upper.points[:, :1] * [0, 1]),
    )
    pairs = couple(mesh, "touch0", "touch1", slave="touch0")
    assert np.allclose(pairs.gap, 0.01 * pairs.points[:, 0], atol=1e-14)


def moved(shift, kind="quad8"):
    lower, upper = block(kind, 0, 4), block(kind, 1, 5)
    return joined(lower, replace(upper, points=upper.points + np.array(shift)))


def test_surfaces_that_cannot_be_coupled_are_named():
    with pytest.raises(
        ModelError, match=r"'touch1' and 'touch0' never meet: their nearest nodes are 5 m apart"
    ):
        couple(moved([0.0, 5.0]), "touch0", "touch1")
    with pytest.raises(ModelError, match=r"overlap by 0\.05 m at"):
        couple(moved([0.0, -0.05]), "touch0", "touch1")
    assert couple(moved([0.0, -0.05]), "touch0", "touch1", overlap=0.06).gap == pytest.approx(-0.05)
    with pytest.raises(
        ModelError, match="no surface 'top' in the mesh; it has touch0, rest0, touch1"
    ):
        couple(moved([0.0, 0.0]), "top", "touch1")
    with pytest.raises(ModelError, match="not one of the two surfaces"):
        couple(moved([0.0, 0.0]), "touch0", "touch1", slave="rest0")
    with pytest.raises(ModelError, match="share 9 nodes"):
        couple(moved([0.0, 0.0]), "touch0", "touch0")
    mesh = moved([0.0, 0.0])
    empty = with_surfaces(mesh, {"nothing": Surface(np.zeros(0, int), np.zeros(0, int))})
    with pytest.raises(ModelError, match="'nothing' has no faces"):
        couple(empty, "nothing", "touch1")
    twice = mesh.surface("touch0")
    double = with_surfaces(
        mesh, {"double": Surface(np.tile(twice.elements, 2), np.tile(twice.faces, 2))}
    )
    with pytest.raises(ModelError, match=r"'double' names face S3 of element \d+ twice"):
        couple(double, "double", "touch1")


def test_clipped_triangles_have_the_area_that_sampling_finds():
    rng = np.random.default_rng(0)
    first, second = rng.uniform(0, 1, (2, 200, 3, 2))
    first, second = (
        np.where((twice_areas(t) < 0)[:, None, None], t[:, ::-1], t) for t in (first, second)
    )
    parts, pairs = common_triangles(first, second)
    area = np.bincount(pairs, 0.5 * twice_areas(parts), 200)
    grid = (np.stack(np.meshgrid(*[np.arange(300)] * 2), axis=-1).reshape(-1, 2) + 0.5) / 300

    def inside(t):
        edges = np.roll(t, -1, axis=0) - t
        off = grid[:, None] - t
        return (edges[:, 0] * off[..., 1] - edges[:, 1] * off[..., 0] >= 0).all(axis=1)

    for k in range(0, 200, 10):
        sampled = (inside(first[k]) & inside(second[k])).mean()
        assert area[k] == pytest.approx(sampled, abs=2e-3)


@pytest.mark.parametrize("kind", ["line2", "line3", "tri3", "tri6", "quad4", "quad8", "quad9"])
def test_functions_of_facets_covered_in_part_are_nowhere_negative(kind):
    shape = TYPES[kind]
    rng = np.random.default_rng(1)
    xi = rng.uniform(-1, 1, (2000, shape.dimension))
    if shape.family == "tri":
        xi = np.abs(xi)
        xi = xi[xi.sum(axis=1) <= 1]
    phi = shape.shapes(xi) @ positive(shape).T
    assert phi.min() > -1e-14
    assert np.allclose(phi.sum(axis=1), 1.0)

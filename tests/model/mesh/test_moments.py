"""Moments on surfaces: by normal tractions as in bending, and by shear where these have none."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
import scipy.sparse.linalg as spla
from mesh_files import faces_where, grid

from microslip.model.elasticity import Material
from microslip.model.mesh.assembly import assemble
from microslip.model.mesh.boundary import boundary, with_surfaces
from microslip.model.mesh.finite_elements import Block, FiniteElementMesh, Surface
from microslip.model.mesh.loads import moment_load


def polygon(edges):
    """A regular polygon of triangles about its middle, in the plane, with its rim."""
    angle = 2 * np.pi * np.arange(edges) / edges
    points = np.vstack([[0.0, 0.0], np.column_stack([np.cos(angle), np.sin(angle)])])
    k = np.arange(edges)
    nodes = np.column_stack([np.zeros(edges, dtype=np.int64), 1 + k, 1 + (k + 1) % edges])
    block = Block("tri3", nodes, 1 + k)
    mesh = FiniteElementMesh(points, 1 + np.arange(len(points)), (block,))
    faces, _ = boundary(mesh.blocks)
    return with_surfaces(mesh, {"rim": Surface(faces.elements, faces.faces)})


@pytest.mark.parametrize("edges", [3, 4, 6, 8, 12])
def test_a_polygon_takes_a_moment_on_its_edges(edges):
    mesh = polygon(edges)
    load = moment_load(mesh, "rim").reshape(-1, 2)
    x, y = mesh.points.T
    assert load[:, 1] @ x - load[:, 0] @ y == pytest.approx(1.0)
    np.testing.assert_allclose(load.sum(axis=0), 0.0, atol=1e-12 * np.abs(load).max())


@pytest.mark.parametrize("edges", [16, 40, 200])
def test_what_is_round_takes_a_moment_by_shear(edges):
    mesh = polygon(edges)
    load = moment_load(mesh, "rim").reshape(-1, 2)
    x, y = mesh.points.T
    assert load[:, 1] @ x - load[:, 0] @ y == pytest.approx(1.0)
    np.testing.assert_allclose(load.sum(axis=0), 0.0, atol=1e-12)
    rim = np.hypot(x, y) > 0.5
    around = load[rim, 1] * x[rim] - load[rim, 0] * y[rim]
    np.testing.assert_allclose(around, 1.0 / edges, rtol=1e-9)


def ring(inner=0.8, outer=1.0, height=2.0, around=64):
    """A tube about z of bricks, its ends named."""
    mesh = grid(
        (
            np.linspace(inner, outer, 4),
            np.linspace(0.0, 2 * np.pi, around + 1),
            np.linspace(0.0, height, 9),
        )
    )
    r, angle, z = mesh.points.T
    points = np.column_stack([r * np.cos(angle), r * np.sin(angle), z]).round(12)
    points, again = np.unique(points, axis=0, return_inverse=True)
    block = mesh.blocks[0]
    mesh = FiniteElementMesh(
        points, 1 + np.arange(len(points)), (replace(block, nodes=again.ravel()[block.nodes]),)
    )
    ends = {"bottom": 0.0, "top": height}
    return with_surfaces(
        mesh,
        {
            name: faces_where(mesh, lambda x, z=z: np.abs(x[:, 2] - z) < 1e-9)
            for name, z in ends.items()
        },
    )


def resultants(mesh, load):
    """Force and moment about the origin."""
    each = load.reshape(-1, 3)
    return each.sum(axis=0), np.cross(mesh.points, each).sum(axis=0)


@pytest.mark.parametrize("axis", [(0, 0, 1), (1, 0, 0), (1, 2, 2), (0.3, -1, 0.1)])
def test_a_moment_about_any_axis_has_no_other_resultant(axis):
    mesh = ring(around=16)
    way = np.array(axis) / np.linalg.norm(axis)
    force, moment = resultants(mesh, moment_load(mesh, "top", way))
    np.testing.assert_allclose(force, 0.0, atol=1e-12)
    np.testing.assert_allclose(moment, way, atol=1e-12)


def test_a_section_without_symmetry_is_bent_about_the_axis_alone():
    """A right triangle as face: its product of inertia turns the moment of a traction along one axis."""
    points = np.array([[0, 0, 0], [2, 0, 0], [0, 1, 0], [0, 0, 1]], dtype=float)
    mesh = FiniteElementMesh(
        points, 1 + np.arange(4), (Block("tet4", np.arange(4)[None], np.ones(1)),)
    )
    mesh = with_surfaces(mesh, {"face": faces_where(mesh, lambda x: np.abs(x[:, 2]) < 1e-12)})
    load = moment_load(mesh, "face", np.array([1.0, 0.0, 0.0]))
    force, moment = resultants(mesh, load)
    np.testing.assert_allclose(force, 0.0, atol=1e-12)
    np.testing.assert_allclose(moment, [1.0, 0.0, 0.0], atol=1e-12)
    assert not load.reshape(-1, 3)[:, :2].any()


def test_a_tube_is_twisted_as_saint_venant_has_it():
    """``theta = T L / (G J)``: shear in proportion to the radius is the stress of the whole tube."""
    mesh = ring()
    steel = Material(210e9, 0.3, 7850.0)
    K, _ = assemble(mesh, steel)
    load = moment_load(mesh, "top", np.array([0.0, 0.0, 1.0]))
    free = np.repeat(mesh.points[:, 2] > 1e-9, 3)
    u = np.zeros(len(load))
    u[free] = spla.spsolve(K[free][:, free].tocsc(), load[free])
    G = 210e9 / 2.6
    twist = 2.0 / (G * np.pi / 2 * (1.0 - 0.8**4))
    assert load @ u == pytest.approx(twist, rel=0.01)

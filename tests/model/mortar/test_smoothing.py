"""Curved surfaces that fit each other, with facets that do not match."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from mesh_files import faces_where, grid, on_body, two_bodies

from microslip.model.mesh.boundary import with_surfaces
from microslip.model.mesh.facets import facets_of
from microslip.model.mortar.coupling import couple
from microslip.model.mortar.smoothing import curve_normals


def fit(around, hole=1.0, dimension=2, turn=np.pi / 2, axis=(0.0, 0.0)):
    """A pin of radius one in a bush, both `turn` round, in so many facets each."""
    length = [] if dimension == 2 else [np.linspace(0.0, 1.0, 4)]

    def ring(inner, outer, n, at=(0.0, 0.0)):
        mesh = grid((np.linspace(inner, outer, 3), np.linspace(0.0, turn, n + 1), *length))
        r, angle, *z = mesh.points.T
        return replace(
            mesh, points=np.column_stack([at[0] + r * np.cos(angle), at[1] + r * np.sin(angle), *z])
        )

    mesh = two_bodies(ring(0.5, 1.0, around[0]), ring(hole, hole + 0.5, around[1], axis))

    def at(radius, middle=(0.0, 0.0)):
        return lambda x: np.abs(np.hypot(*(x[:, :2] - middle).T) - radius) < 1e-9

    return with_surfaces(
        mesh,
        {"pin": on_body(mesh, "lower", at(1.0)), "bush": on_body(mesh, "upper", at(hole, axis))},
    )


@pytest.mark.parametrize("dimension", [2, 3])
@pytest.mark.parametrize("turn", [np.pi / 2, 1.5 * np.pi])
def test_sides_that_fit_touch_whatever_their_facets(dimension, turn):
    pairs = couple(fit((10, 13), dimension=dimension, turn=turn), "pin", "bush")
    assert not pairs.gap.any()


def test_a_clearance_is_even_beside_what_its_facets_are_off():
    clearance = 0.02
    for n in (10, 20):
        pairs = couple(fit((n, round(1.3 * n)), hole=1 + clearance), "pin", "bush")
        off = np.abs(pairs.gap - clearance)[n // 4 : -n // 4].max()
        assert off < 1e-2 * (np.pi / 2 / n) ** 2 / 8


def test_surfaces_of_other_curvatures_keep_their_distances():
    """A pin in a hole three times as large, which it touches at one end."""
    mesh = fit((20, 20), hole=3.0, axis=(-2.0, 0.0), turn=0.3)
    pairs = couple(mesh, "pin", "bush", reach=0.2)
    x, y = pairs.points.T
    exact = 3.0 - np.hypot(x + 2.0, y)
    assert pairs.gap == pytest.approx(exact, abs=1e-3)
    assert np.ptp(pairs.gap) > 0.01


def test_flat_sides_with_an_edge_stay_as_they_are():
    """The facets around an edge of two planes are on no curve."""

    def bent(n, height):
        mesh = grid((np.linspace(-1.0, 1.0, n + 1), np.linspace(height, height + 0.5, 3)))
        x, y = mesh.points.T
        return replace(mesh, points=np.column_stack([x, y - 0.1 * np.abs(x)]))

    mesh = two_bodies(bent(8, -0.5), bent(12, 0.0))
    surfaces = {
        name: on_body(mesh, body, lambda p: np.abs(p[:, 1] + 0.1 * np.abs(p[:, 0])) < 1e-9)
        for name, body in (("below", "lower"), ("above", "upper"))
    }
    pairs = couple(with_surfaces(mesh, surfaces), "below", "above")
    assert np.abs(pairs.gap).max() < 1e-12


def test_normals_of_a_sphere_and_of_a_circle_are_exact_inside():
    ring = facets_of(fit((7, 7)), "pin")
    found = curve_normals(ring)[ring.nodes]
    assert np.allclose(found, ring.points[ring.nodes], atol=1e-12)
    axis = np.linspace(-0.4, 0.4, 5) + 0.03 * np.array([0, 1, -1, 1, 0])
    ball = grid((axis, axis, np.array([0.5, 1.0])))
    ball = replace(
        ball, points=ball.points / np.linalg.norm(ball.points, axis=1)[:, None] * ball.points[:, 2:]
    )
    ball = replace(ball, element_sets={"all": np.arange(ball.elements)})
    ball = with_surfaces(
        ball, {"top": faces_where(ball, lambda x: np.linalg.norm(x, axis=1) > 0.99)}
    )
    top = facets_of(ball, "top")
    inside = [k for k in top.nodes if np.abs(ball.points[k, :2]).max() < 0.3]
    assert len(inside) == 9
    assert np.allclose(curve_normals(top)[inside], ball.points[inside], atol=1e-12)

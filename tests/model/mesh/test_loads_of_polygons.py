"""Moments by normal tractions: on a prism about its own axis there are fewer the more edges it has."""

from __future__ import annotations

import numpy as np
import pytest

from microslip.errors import ModelError
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
def test_what_is_round_takes_none(edges):
    with pytest.raises(ModelError, match="takes no moment about this axis by normal tractions"):
        moment_load(polygon(edges), "rim")

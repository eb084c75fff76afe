"""A punch whose end lies a little before or behind an edge of the facets below it."""

from __future__ import annotations

import numpy as np
import pytest
from mesh_files import grid, on_body, two_bodies

from microslip.model.mesh.boundary import with_surfaces
from microslip.model.mortar.coupling import couple


def punch_on_plate(end, dimension):
    """A punch from 0 to `end` on a plate from 0 to 6 with facets of length one: both 2 wide and 1 high."""
    across = [] if dimension == 2 else [np.linspace(0.0, 2.0, 3)]
    plate = grid((np.linspace(0.0, 6.0, 7), *across, np.array([-1.0, 0.0])))
    punch = grid((np.linspace(0.0, end, 3), *across, np.array([0.0, 1.0])))
    mesh = two_bodies(plate, punch)
    contact = {
        name: on_body(mesh, body, lambda x: np.abs(x[:, dimension - 1]) < 1e-12)
        for name, body in (("plate", "lower"), ("punch", "upper"))
    }
    return with_surfaces(mesh, contact)


@pytest.mark.parametrize("dimension", [2, 3])
def test_no_pair_is_left_with_a_sliver_of_area(dimension):
    width = 1.0 if dimension == 2 else 2.0
    for end in (2.9, 3.0, 3.001, 3.05, 3.4, 3.6):
        pairs = couple(punch_on_plate(end, dimension), "punch", "plate", slave="plate")
        assert pairs.area.sum() == pytest.approx(end * width, rel=1e-12)
        least = 0.5 * (width / 4 if dimension == 3 else 1.0)
        assert pairs.area.min() > 0.25 * least, end


@pytest.mark.parametrize("dimension", [2, 3])
def test_functions_of_what_is_met_still_pass_an_even_pressure(dimension):
    """The weights of both sides are means: of one, and of a coordinate the same on both sides."""
    for end in (3.001, 3.3, 3.7):
        mesh = punch_on_plate(end, dimension)
        pairs = couple(mesh, "punch", "plate", slave="plate")
        x = mesh.points[:, 0]
        for weights in (pairs.slave_weights, pairs.master_weights):
            assert np.allclose(weights @ np.ones(len(x)), 1.0, atol=1e-12)
            assert pairs.area @ (weights @ x) == pytest.approx(
                0.5 * end * pairs.area.sum(), rel=1e-12
            )
        assert np.allclose(pairs.slave_weights @ x, pairs.master_weights @ x, atol=1e-12)


def test_pairs_do_not_depend_on_how_little_the_punch_lies_over_the_edge():
    at = {
        end: couple(punch_on_plate(end, 2), "punch", "plate", slave="plate")
        for end in (3.0, 3 + 1e-6)
    }
    a, b = at.values()
    assert np.allclose(a.area, b.area, atol=1e-5)
    assert np.allclose(a.points, b.points)

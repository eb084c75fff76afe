"""A hub shrunk on a hollow shaft, without any load: against Lamé's rings."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from mesh_files import STEEL_MM, grid, on_body, two_bodies
from model.mesh.write_inp import write_inp

from microslip.contact.pairs import normal
from microslip.describe.reading import parse_joint
from microslip.errors import InputError
from microslip.model.mesh.boundary import with_surfaces
from microslip.pipeline.prepare import assemble
from microslip.pipeline.run import run

INNER, FIT, OUTER, TOO_LARGE = 5.0, 10.0, 20.0, 10e-3
"""Radii and interference, mm."""


def quarter_ring(inner, outer, radial, around):
    """Quadrilaterals between two radii in the first quadrant."""
    mesh = grid((np.linspace(inner, outer, radial + 1), np.linspace(0.0, np.pi / 2, around + 1)))
    r, angle = mesh.points.T
    return replace(mesh, points=np.column_stack([r * np.cos(angle), r * np.sin(angle)]))


def document(folder, inner=FIT, **interface):
    """A quarter of both, held by its planes of symmetry; nodes of the fit do not match."""
    mesh = two_bodies(quarter_ring(INNER, FIT, 12, 30), quarter_ring(inner, OUTER, 16, 38))

    def where(radius):
        return lambda x: np.abs(np.hypot(*x.T) - radius) < 1e-6

    mesh = with_surfaces(
        mesh,
        {
            "shaft": on_body(mesh, "lower", where(FIT)),
            "hub": on_body(mesh, "upper", where(inner)),
            "rim": on_body(mesh, "upper", where(OUTER)),
        },
    )
    x, y = mesh.points.T
    sets = {
        "along_x": np.flatnonzero(np.abs(y) < 1e-9),
        "along_y": np.flatnonzero(np.abs(x) < 1e-9),
    }
    write_inp(replace(mesh, node_sets=sets), folder / "fit.inp")
    return {
        "kind": "mesh",
        "mesh": {"file": "fit.inp", "length_unit": "mm", "force_unit": "N", "modes": 20},
        "support": [{"on": "along_x", "directions": ["y"]}, {"on": "along_y", "directions": ["x"]}],
        "interface": {"first": "shaft", "second": "hub", "friction": 0.15} | interface,
        "damping": {"beta": 1e-7},
        "port": {"name": "side", "kind": "force", "on": "rim", "direction": "x"},
        "analysis": {"cycle": {"force": [5e5, 1e6]}},
    }


def lame(interference):
    """Pressure of two rings of the same metal in plane strain, Pa for mm of interference."""
    E, nu = STEEL_MM.youngs_modulus, STEEL_MM.poissons_ratio
    strained, across = E / (1 - nu**2), nu / (1 - nu)
    shaft = (FIT**2 + INNER**2) / (FIT**2 - INNER**2) - across
    hub = (OUTER**2 + FIT**2) / (OUTER**2 - FIT**2) + across
    return 1e6 * interference * strained / (FIT * (shaft + hub))


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    return tmp_path_factory.mktemp("fit")


def test_interference_alone_presses_with_the_pressure_of_lame(folder):
    a = assemble(parse_joint(document(folder, gap=-TOO_LARGE * 1e-3), "fit", folder))
    start = a.prestress
    assert start.touching.all()
    assert start.pressure == pytest.approx(lame(TOO_LARGE), rel=1e-2)
    assert start.solution.residual < 1e-12
    # its force is what residuals and ranges are measured by
    assert 0.3 < start.force / normal(start.solution.r).sum() < 3


def test_a_fit_slips_and_its_cycles_balance_their_energy(folder):
    found = run(parse_joint(document(folder, gap=-TOO_LARGE * 1e-3), "fit", folder))
    assert not found.failures
    for cycle in found.cycles["load"]:
        assert cycle.residual.max() < 1e-9
        assert cycle.dissipated > 0
    # every field scales with the interference and the load together
    twice = document(folder, gap=-2 * TOO_LARGE * 1e-3)
    twice["analysis"] = {"cycle": {"force": [1e6, 2e6]}}
    other = run(parse_joint(twice, "fit", folder))
    for one, two in zip(found.cycles["load"], other.cycles["load"], strict=True):
        assert two.dissipated == pytest.approx(4 * one.dissipated, rel=1e-6)


def test_interference_that_the_mesh_has_counts_as_well(folder):
    """The hub is drawn too small, and the overlap allowed."""
    given = document(folder, overlap=2 * TOO_LARGE * 1e-3, inner=FIT - TOO_LARGE)
    start = assemble(parse_joint(given, "fit", folder)).prestress
    assert np.median(start.pressure) == pytest.approx(lame(TOO_LARGE), rel=5e-3)
    assert start.pressure == pytest.approx(lame(TOO_LARGE), rel=2e-2)


def test_without_preload_and_without_interference_nothing_presses(folder):
    with pytest.raises(InputError, match=r"(?s)preload: missing.*negative gap"):
        parse_joint(document(folder), "fit", folder)
    with pytest.raises(InputError, match="no pair has a negative gap"):
        assemble(parse_joint(document(folder, overlap=1e-3), "fit", folder))

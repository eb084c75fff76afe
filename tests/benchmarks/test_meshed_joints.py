"""Meshes of the population of joints in space: a box with a hole, in both files; a population turned."""

from __future__ import annotations

import sys

import numpy as np
import pytest
from conftest import ROOT

from microslip.model.elasticity import Material
from microslip.model.mesh.assembly import assemble
from microslip.model.mesh.loads import traction_load
from microslip.model.mesh.read import read_mesh

sys.path.insert(0, str(ROOT / "benchmarks" / "population"))

from meshed_bodies import ABAQUS, box, deck, gmsh_file
from meshed_joints import joints

KINDS = [*ABAQUS]


def holed(shape, quadratic):
    """A box of 4 by 3 by 2 with a hole of 1 by 1 through it."""
    axes = [np.array([0.0, 1.5, 2.5, 4.0]), np.array([0.0, 1.0, 2.0, 3.0]), np.array([0.0, 2.0])]
    places = {"TOP": ((0, 4), (0, 3), (2, 2)), "SIDE": ((4, 4), (0, 3), (0, 2))}
    hole = np.array([2.0, 1.5])
    return box(
        "BODY", shape, quadratic, axes, places, lambda c: bool(np.allclose(c[:2], hole, atol=0.1))
    )


@pytest.mark.parametrize("kind", KINDS)
@pytest.mark.parametrize("ending", [".inp", ".msh"])
def test_a_box_with_a_hole(kind, ending, tmp_path):
    """Mass, areas of surfaces and a node set, by geometry; quadratic wedges of Gmsh are not read."""
    if kind == ("wedge", True) and ending == ".msh":
        return
    body = holed(*kind)
    nodes = {"EDGE": ("BODY", ((0, 0), (0, 3), (0, 0)))}
    file = tmp_path / f"body{ending}"
    file.write_text((deck if ending == ".inp" else gmsh_file)([body], nodes))
    mesh = read_mesh(file)
    _, mass = assemble(mesh, Material(1.0, 0.3, 1.0))
    assert mass.sum() == pytest.approx(3 * (4 * 3 - 1) * 2, rel=1e-12)
    for name, area in (("TOP", 11.0), ("SIDE", 6.0)):
        load = traction_load(mesh, name, np.array([0.0, 0.0, 1.0]))
        assert load.sum() == pytest.approx(area, rel=1e-12)
    assert sorted(mesh.points[mesh.node_sets["EDGE"]][:, 1]) == pytest.approx([0, 1, 2, 3])


def test_a_seed_is_a_population_and_turning_it_changes_directions_alone():
    one, same, turned = (list(joints(7, 6, angle)) for angle in (0.0, 0.0, 35.0))
    assert one == same
    for a, b in zip(one, turned, strict=True):
        assert (a.key, a.share, a.unsound, a.name) == (b.key, b.share, b.unsound, b.name)
        rows = zip(a.text.splitlines(), b.text.splitlines(), strict=True)
        assert {x.split(" = ")[0] for x, y in rows if x != y} <= {"direction"}

"""A block squeezed between faces that are hardly not parallel: friction alone keeps it from coming out."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from mesh_files import faces_where, grid, on_body, two_bodies
from model.mesh.write_inp import write_inp

from microslip.contact.pairs import by_pair, normal
from microslip.describe.reading import parse_joint
from microslip.model.mesh.boundary import joined, with_surfaces
from microslip.pipeline.run import run

FORCE = 1e5
"""On the upper plate, N per metre of width."""

STEEP = 0.05
"""The coefficient of friction is six times as large."""


def document(folder, angle, dimension, guided):
    """Two plates, and a block between them that nothing holds; both its faces lean by `angle`.

    The upper plate is guided along the force, and carries all of it, or built in at its sides, and bends.
    """
    across = [np.linspace(-5.0, 5.0, 3)] * (dimension - 2)

    def block(along, low, high, first_label=1):
        mesh = grid((along, *across, np.linspace(0.0, 1.0, 4)))
        x, share = mesh.points[:, 0], mesh.points[:, -1]
        heights = low + angle * x * (low == 0.0) - angle * x * (low == 10.0)
        tops = high + angle * x * (high == 0.0) - angle * x * (high == 10.0)
        points = mesh.points.copy()
        points[:, -1] = heights + share * (tops - heights)
        labels = mesh.blocks[0].labels + first_label - 1
        return replace(mesh, points=points, blocks=(replace(mesh.blocks[0], labels=labels),))

    long, short = np.linspace(-20.0, 20.0, 9), np.linspace(-12.0, 12.0, 7)
    below = block(long, -8.0, 0.0)
    above = block(long, 10.0, 18.0, 1 + below.elements)
    mesh = two_bodies(joined(below, above), block(short, 0.0, 10.0))

    def face(height):
        return lambda p: np.abs(p[:, -1] - height - np.sign(5 - height) * angle * p[:, 0]) < 1e-9

    surfaces = {
        "below": on_body(mesh, "lower", face(0.0)),
        "above": on_body(mesh, "lower", face(10.0)),
        "bottom": on_body(mesh, "upper", face(0.0)),
        "roof": on_body(mesh, "upper", face(10.0)),
        "top": faces_where(mesh, lambda p: np.abs(p[:, -1] - 18.0) < 1e-9),
        "ground": faces_where(mesh, lambda p: np.abs(p[:, -1] + 8.0) < 1e-9),
        "sides": faces_where(mesh, lambda p: (np.abs(p[:, 0]) > 20 - 1e-9) & (p[:, -1] > 9)),
        "end": on_body(mesh, "upper", lambda p: p[:, 0] > 12 - 1e-9),
    }
    write_inp(with_surfaces(mesh, surfaces), folder / "block.inp")
    down = [0.0] * (dimension - 1) + [-1.0]
    guide = {"directions": ["x", "y"][: dimension - 1]} if guided else {}
    width = {"width": "10 mm"} if dimension == 3 else {}
    return {
        "kind": "mesh",
        "mesh": {"file": "block.inp", "length_unit": "mm", "force_unit": "N", "modes": 20} | width,
        "support": [{"on": "ground"}, {"on": "sides"} | guide],
        "interface": [
            {"name": "low", "first": "below", "second": "bottom", "friction": 0.3},
            {"name": "high", "first": "above", "second": "roof", "friction": 0.3},
        ],
        "preload": {"on": ["top"], "force": FORCE, "direction": down},
        "damping": {"beta": 1e-7},
        "port": {"name": "push", "kind": "force", "on": "end", "direction": "x"},
        "analysis": {"cycle": {"force": [0.1 * FORCE], "steps": 40}},
    }


@pytest.mark.parametrize("dimension", [2, 3])
@pytest.mark.parametrize("guided", [True, False])
@pytest.mark.parametrize("angle", [3e-7, 1e-5, 1e-3, STEEP])
def test_a_block_is_not_squeezed_out(angle, guided, dimension, tmp_path):
    """Pressures change with the angle, in proportion; faces of a guided plate carry the whole force.

    What pushes the block out is the sine of the pressures, what holds it the cosine of tractions.
    """
    found = []
    for leaning in (0.0, angle):
        given = document(tmp_path, leaning, dimension, guided)
        found.append(run(parse_joint(given, "block", tmp_path)))
    assert not found[1].failures
    a, b = (one.assembly.prestress.solution for one in found)
    force = normal(b.r, dimension)
    if guided:
        assert force.sum() == pytest.approx(2 * FORCE, rel=2 * angle)
    assert np.abs(force - normal(a.r, dimension)).max() < 3 * angle * FORCE
    assert np.linalg.norm(by_pair(b.v, dimension)[:, 1:], axis=1).max() < 1e-6
    if angle == STEEP:
        high = found[1].assembly.imported.points[:, -1] > 5e-3
        each = [by_pair(b.r, dimension)[chosen].sum(axis=0) for chosen in (high, ~high)]
        taken = sum(np.linalg.norm(r[1:]) for r in each) / sum(r[0] for r in each)
        assert taken == pytest.approx(STEEP, rel=1e-6)

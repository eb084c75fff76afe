"""Bores in the plane: where pairs lie along an interface that turns."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from mesh_files import grid, on_body, two_bodies
from model.mesh.write_inp import write_inp

from microslip.describe.reading import parse_joint
from microslip.model.mesh.boundary import with_surfaces
from microslip.pipeline.prepare import assemble
from microslip.pipeline.run import run

INNER, FIT, OUTER = 5.0, 10.0, 20.0
"""Radii, mm."""


def ring(inner, outer, radial, around, turn):
    """Quadrilaterals between two radii, from the angle -90 degrees on."""
    mesh = grid((np.linspace(inner, outer, radial + 1), np.linspace(0.0, 1.0, around + 1)))
    r, share = mesh.points.T
    angle = turn * share - np.pi / 2
    mesh = replace(mesh, points=np.column_stack([r * np.cos(angle), r * np.sin(angle)]))
    if turn < 6:
        return mesh
    _, first, same = np.unique(
        np.round(mesh.points, 9), axis=0, return_index=True, return_inverse=True
    )
    (block,) = mesh.blocks
    return replace(
        mesh,
        points=mesh.points[first],
        node_labels=1 + np.arange(len(first)),
        blocks=(replace(block, nodes=same.ravel()[block.nodes]),),
    )


def bore(folder, *, half=False, **interface):
    """A hub on a shaft with 5 um of interference, whole or the half at x > 0."""
    turn, part = (np.pi, 2) if half else (2 * np.pi, 1)
    mesh = two_bodies(ring(INNER, FIT, 4, 60 // part, turn), ring(FIT, OUTER, 6, 80 // part, turn))

    def where(radius):
        return lambda x: np.abs(np.hypot(*x.T) - radius) < 1e-6

    mesh = with_surfaces(
        mesh,
        {
            "shaft": on_body(mesh, "lower", where(FIT)),
            "hub": on_body(mesh, "upper", where(FIT)),
            "rim": on_body(mesh, "upper", where(OUTER)),
        },
    )
    x, y = mesh.points.T
    sets = {
        "bore": np.flatnonzero(np.hypot(x, y) < INNER + 1e-6),
        "plane": np.flatnonzero(np.abs(x) < 1e-9),
    }
    write_inp(replace(mesh, node_sets=sets), folder / "bore.inp")
    plane = [{"on": "plane", "directions": ["x"]}] if half else []
    document = {
        "kind": "mesh",
        "mesh": {"file": "bore.inp", "length_unit": "mm", "force_unit": "N", "modes": 20},
        "support": [{"on": "bore"}, *plane],
        "interface": {"first": "shaft", "second": "hub", "friction": 0.15, "gap": -5e-6}
        | interface,
        "damping": {"beta": 1e-7},
        "port": {"name": "pull", "kind": "force", "on": "rim", "direction": "y"},
        "analysis": {"cycle": {"force": [1e5]}},
    }
    return assemble(parse_joint(document, "bore", folder))


@pytest.mark.parametrize("half", [False, True])
def test_position_is_the_length_along_a_bore(half, tmp_path):
    a = bore(tmp_path, half=half)
    meshed = a.imported.meshed
    (coupling,) = meshed.couplings
    x, y = coupling.points.T
    # 0 is at the largest x, and on from there clockwise; facets are a little shorter than the arc
    angle = np.arctan2(y, x)
    middle = np.abs(angle) < 3.0
    assert a.model.position[middle] == pytest.approx(-FIT * 1e-3 * angle[middle], abs=1e-4)
    assert (np.diff(a.model.position) > 0).all()
    # which is the direction of the tangents
    chords = np.diff(coupling.points, axis=0)
    assert (np.einsum("kd,kd->k", chords, coupling.tangents[1:, 0]) > 0).all()


def test_friction_along_a_bore_is_that_of_its_half(tmp_path):
    table = {"friction": [[-0.02, 0.1], [0.02, 0.3]]}
    whole, half = bore(tmp_path, **table), bore(tmp_path, half=True, **table)
    found = []
    for a in (whole, half):
        (coupling,) = a.imported.meshed.couplings
        x, y = coupling.points.T
        right = x > 1e-6
        order = np.argsort(y[right])
        found.append((y[right][order], a.prepared.law.friction[right][order]))
    (y_whole, mu_whole), (y_half, mu_half) = found
    assert np.ptp(mu_whole) > 0.1
    assert mu_half == pytest.approx(np.interp(y_half, y_whole, mu_whole), abs=2e-3)


def test_measured_distances_along_a_bore(tmp_path):
    """A table round the bore with a distance that varies as the cosine of the angle: read at every pair."""
    angle = np.linspace(-np.pi, np.pi, 91)[:-1]
    x, y = FIT * np.cos(angle), FIT * np.sin(angle)
    rows = zip(x, y, 1e-3 * np.cos(angle), strict=True)
    lines = ["x,y,gap", *(f"{a!r},{b!r},{g!r}" for a, b, g in (map(float, row) for row in rows))]
    (tmp_path / "round.csv").write_text("\n".join(lines))
    a = bore(tmp_path, topography="round.csv")
    (coupling,) = a.imported.meshed.couplings
    at = np.arctan2(*coupling.points.T[::-1])
    assert a.imported.pairs.gap == pytest.approx(-5e-6 + 1e-6 * np.cos(at), abs=2e-8)


def test_a_hub_without_friction_may_spin_and_is_pulled_all_the_same(tmp_path):
    """Nothing holds its spin, and what turns it is rounding."""
    found = run(bore(tmp_path, friction=0.0).joint)
    assert not found.failures
    (cycle,) = found.cycles["load"]
    assert cycle.imbalance == 0.0
    assert cycle.dissipated < 1e-10 * cycle.to_and_fro
    # its pull arrives at the fit: the reactions along y carry it
    (coupling,) = found.assembly.imported.meshed.couplings
    r = cycle.r.reshape(len(cycle.theta), -1, 2)
    carried = r[..., 0] @ coupling.normal[:, 1] + r[..., 1] @ coupling.tangents[:, 0, 1]
    swing = carried - 0.5 * (carried.max() + carried.min())
    assert np.abs(swing).max() == pytest.approx(1e5, rel=1e-6)

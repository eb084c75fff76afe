"""Half of a bolted joint whose interface the plane of symmetry cuts, nodes of both sides not matching."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from mesh_files import grid, on_body, two_bodies
from model.mesh.write_inp import write_inp

from microslip.describe.reading import parse_joint
from microslip.model.mesh.boundary import with_surfaces
from microslip.pipeline.run import run


def document(folder, half):
    """Two plates of 12 mm across, from the plane y = 0 on or whole, pressed together and drawn along x."""

    def across(n):
        side = np.linspace(0.0, 6.0, n)
        return side if half else np.concatenate([-side[:0:-1], side])

    lower = grid((np.linspace(-30.0, 10.0, 13), across(4), np.array([-3.0, -1.5, 0.0])))
    upper = grid((np.linspace(-10.0, 30.0, 12), across(5), np.array([0.0, 1.5, 3.0])))
    mesh = two_bodies(lower, upper)
    flat = {"lower": (0.0, -3.0, "below"), "upper": (0.0, 3.0, "above")}
    named = {"end": on_body(mesh, "upper", lambda p: np.abs(p[:, 0] - 30.0) < 1e-9)}
    for body, (inner, outer, place) in flat.items():
        named[f"{body}_contact"] = on_body(
            mesh, body, lambda p, z=inner: (np.abs(p[:, 2] - z) < 1e-9) & (np.abs(p[:, 0]) < 10.1)
        )
        named[place] = on_body(
            mesh, body, lambda p, z=outer: (np.abs(p[:, 2] - z) < 1e-9) & (np.abs(p[:, 0]) < 10.1)
        )
    mesh = with_surfaces(mesh, named)
    x, y, _ = mesh.points.T
    sets = {"left": np.flatnonzero(x < -29.9), "plane": np.flatnonzero(np.abs(y) < 1e-9)}
    name = "half.inp" if half else "whole.inp"
    write_inp(replace(mesh, node_sets=sets), folder / name)
    share = 0.5 if half else 1.0
    supports = [{"on": "left"}] + ([{"on": "plane", "directions": ["y"]}] if half else [])
    return {
        "kind": "mesh",
        "mesh": {"file": name, "length_unit": "mm", "width": "whole", "modes": 30},
        "support": supports,
        "interface": {"first": "lower_contact", "second": "upper_contact", "friction": 0.3},
        "preload": {"on": ["above", "below"], "force": 4000.0 * share},
        "damping": {"beta": "1 us"},
        "port": {"name": "end", "kind": "force", "on": "end", "direction": [0.8, 0.0, 0.6]},
        "analysis": {"cycle": {"force": [100.0 * share, 200.0 * share], "steps": 60}},
    }


def test_half_of_a_joint_has_half_of_its_energy(tmp_path):
    whole, half = (
        run(parse_joint(document(tmp_path, each), "s", tmp_path)) for each in (False, True)
    )
    assert not whole.failures
    assert not half.failures
    middle = np.abs(half.assembly.imported.points[:, 1]) < 1e-9
    assert 0 < middle.sum() < half.model.pairs
    p = half.prestress.pressure
    both = whole.assembly.imported.points
    for point, own in zip(half.assembly.imported.points, p, strict=True):
        k = int(np.argmin(np.linalg.norm(both - point, axis=1)))
        assert own == pytest.approx(whole.prestress.pressure[k], abs=1e-7 * p.max())
    for one, two in zip(half.cycles["load"], whole.cycles["load"], strict=True):
        assert one.dissipated > 0
        assert 2 * one.dissipated == pytest.approx(two.dissipated, rel=1e-6)

"""CalculiX in space: contact points of the faces, and what becomes of a pair that opens."""

from __future__ import annotations

import shutil
import sys

import numpy as np
import pytest
from conftest import ROOT

from microslip import load_joint
from microslip.contact.pairs import at_rest, slip_history
from microslip.contact.solver import ContactSolver
from microslip.model.flexibility import Flexibility
from microslip.model.mesh.read import read_mesh

FOLDER = ROOT / "benchmarks" / "calculix"
sys.path.insert(0, str(FOLDER))

import half_lap_beam  # noqa: E402
from lifted_pair import PATHS, lifted_pair  # noqa: E402
from same_faces import point_interface, step_of_ccx  # noqa: E402

FRICTION = 0.3


def one_pair():
    """A pair behind a spring of 5e7 N/m each way: what the two cubes press is 5 N at 0.1 µm."""
    nothing = np.zeros((3, 0))
    flexibility = Flexibility(
        np.eye(3) / 5e7, nothing, np.zeros(0), np.eye(3), np.zeros((0, 3)), np.eye(3)
    )
    return ContactSolver(flexibility, FRICTION, np.array([5.0]), at_rest(np.array([False])))


def forces(path, step):
    """Friction and pressure at the end of a path of the upper side."""
    solver, sticks_at = one_pair(), slip_history(np.zeros(3), 3)
    for along, away in path:
        found = step(solver, np.array([-away, along, 0.0]), np.zeros(0), sticks_at)
    # friction on the upper side is the reaction against its slip
    return -found.r[1], found.r[0]


def coulomb(solver, v_free, f_q, sticks_at):
    found = solver.solve(v_free, f_q, sticks_at)
    sticks_at[:] = slip_history(found.v, 3)
    return found


@pytest.mark.parametrize(
    ("name", "with_coulomb", "with_ccx"),
    [
        ("put down aside", 0.0, -FRICTION),
        ("put down where it was", 0.0, 0.0),
        ("pulled aside", -FRICTION, -FRICTION),
    ],
)
def test_a_pair_put_down_has_no_traction_and_in_calculix_it_has(
    tmp_path, name, with_coulomb, with_ccx
):
    """Friction over pressure: Coulomb's law forgets a contact that was lost, CalculiX does not."""
    for step, expected in ((coulomb, with_coulomb), (step_of_ccx, with_ccx)):
        friction, pressure = forces(PATHS[name], step)
        assert pressure == pytest.approx(5.0, rel=1e-9)
        assert friction / pressure == pytest.approx(expected, abs=1e-9)
    if shutil.which("ccx"):
        friction, pressure = lifted_pair("ccx", tmp_path, PATHS[name], friction=FRICTION)[-1]
        assert friction / pressure == pytest.approx(with_ccx, abs=1e-4)


def test_points_of_the_faces_see_linear_displacements():
    """Approach and slip of linear motions of both halves, and the area of the laps less three holes."""
    joint = load_joint(ROOT / "examples" / "half_lap_beam.toml")
    mesh = read_mesh(ROOT / "examples" / "meshes" / "half_lap_beam.inp", length=1e-3)
    interface = point_interface(mesh, joint.interface[0].first, joint.interface[0].second, 2)
    assert np.all(np.diff(interface.position) >= 0)
    holes = 3 * np.pi / 4 * 8.5e-3**2
    # holes are polygons of few sides
    assert interface.area.sum() == pytest.approx(0.120 * 0.0254 - holes, rel=0.02)
    # the upper half is the lower one turned: the second half of the nodes
    upper = np.arange(len(mesh.points)) >= len(mesh.points) // 2
    x, y, _ = mesh.points.T
    u = np.column_stack(
        [np.where(upper, 3 * x, x), np.where(upper, 2 * y, y), np.where(upper, 2 * x, x)]
    )
    v = interface.relative @ u.ravel()
    along = interface.position
    np.testing.assert_allclose(v[0::3], -along, atol=1e-12)
    np.testing.assert_allclose(np.abs(v[1::3]), 2 * np.abs(along), atol=1e-12)
    assert np.abs(v[2::3]).max() == pytest.approx(0.0127, rel=0.1)


def test_skips_without_calculix(monkeypatch, capsys):
    monkeypatch.setenv("PATH", "")
    assert half_lap_beam.main([]) == 0
    assert "skipped" in capsys.readouterr().out

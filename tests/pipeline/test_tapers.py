"""A wedge pressed into its seat: reactions by statics, with friction and without."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from mesh_files import grid, on_body, two_bodies
from model.mesh.write_inp import write_inp

from microslip.analyses.prepared.prestress import prestress
from microslip.analyses.prepared.settled import raised
from microslip.contact.pairs import by_pair, normal
from microslip.describe.reading import parse_joint
from microslip.errors import InputError
from microslip.model.mesh.boundary import with_surfaces
from microslip.pipeline.prepare import assemble
from microslip.pipeline.run import run
from microslip.results.joint import prestress_summary

FORCE = 1e5
"""On the wedge, N per metre of width."""

MORSE, SHALLOW, STEEP = 1.43, 5.0, 30.0
"""Angles between the faces and the direction of the force, degrees."""


def document(folder, angle, friction, prestressed=None, **preload):
    """Half of a wedge that is wider above, held in its plane of symmetry; nodes do not match."""
    slope = np.tan(np.radians(angle))
    seat = grid((np.linspace(0.0, 1.0, 9), np.linspace(0.0, 30.0, 22)))
    x, y = seat.points.T
    face = 10.0 + slope * y
    seat = replace(seat, points=np.column_stack([face + x * (60.0 - face), y]))
    wedge = grid((np.linspace(0.0, 1.0, 6), np.linspace(3.0, 27.0, 16)))
    x, y = wedge.points.T
    wedge = replace(wedge, points=np.column_stack([x * (10.0 + slope * y), y]))
    mesh = two_bodies(seat, wedge)

    def on_face(x):
        return np.abs(x[:, 0] - 10.0 - slope * x[:, 1]) < 1e-6

    mesh = with_surfaces(
        mesh,
        {
            "seat": on_body(mesh, "lower", on_face),
            "wedge": on_body(mesh, "upper", on_face),
            "top": on_body(mesh, "upper", lambda x: np.abs(x[:, 1] - 27.0) < 1e-6),
        },
    )
    x = mesh.points[:, 0]
    sets = {"outside": np.flatnonzero(x > 60 - 1e-9), "middle": np.flatnonzero(np.abs(x) < 1e-9)}
    write_inp(replace(mesh, node_sets=sets), folder / "wedge.inp")
    asked = {} if prestressed is None else {"prestress": prestressed}
    force = {"on": ["top"], "force": FORCE, "direction": [0, -1, 0]}
    return asked | {
        "kind": "mesh",
        "mesh": {"file": "wedge.inp", "length_unit": "mm", "force_unit": "N", "modes": 20},
        "support": [{"on": "outside"}, {"on": "middle", "directions": ["x"]}],
        "interface": {"first": "seat", "second": "wedge", "friction": friction},
        "preload": preload or force,
        "damping": {"beta": 1e-7},
        "port": {"name": "press", "kind": "force", "on": "top", "direction": "y"},
        "analysis": {"cycle": {"force": [0.02 * FORCE, 0.1 * FORCE]}},
    }


def reactions(assembly):
    """Normal and tangential reaction of all pairs together."""
    r = by_pair(assembly.prestress.solution.r, 2)
    return r[:, 0].sum(), abs(r[:, 1].sum())


@pytest.mark.parametrize("angle", [MORSE, SHALLOW, STEEP])
@pytest.mark.parametrize("friction", [0.0, 0.15])
def test_without_friction_the_faces_carry_the_force_over_the_sine(angle, friction, tmp_path):
    given = document(tmp_path, angle, friction, "frictionless")
    pressed, sheared = reactions(assemble(parse_joint(given, "wedge", tmp_path)))
    assert pressed == pytest.approx(FORCE / np.sin(np.radians(angle)), rel=1e-6)
    assert sheared < 1e-9 * pressed


@pytest.mark.parametrize("angle", [MORSE, SHALLOW, STEEP])
@pytest.mark.parametrize("friction", [0.05, 0.15, 0.4])
def test_pressed_in_with_friction_the_faces_slip(angle, friction, tmp_path):
    """The whole face slips as the wedge goes in, self-locking or not: ``N = F / (sin + mu cos)``."""
    given = document(tmp_path, angle, friction, "frictional")
    a = assemble(parse_joint(given, "wedge", tmp_path))
    pressed, sheared = reactions(a)
    sine, cosine = np.sin(np.radians(angle)), np.cos(np.radians(angle))
    assert pressed * sine + sheared * cosine == pytest.approx(FORCE, rel=1e-6)
    assert pressed == pytest.approx(FORCE / (sine + friction * cosine), rel=1e-3)
    assert a.prestress.solution.residual < 1e-9
    # in how many steps does not matter
    p = a.prepared
    bare = prestress(p.model, p.flexibility, a.prestress.preload)
    finer = raised(p.model, p.flexibility, bare, p.law.friction, steps=64)
    r = a.prestress.solution.r
    assert finer.solution.r == pytest.approx(r, abs=1e-3 * normal(r).max())


def test_a_taper_is_pressed_in_with_friction_unless_asked_otherwise(tmp_path):
    """And its cycles start there: pushed and pulled by little it hardly slips, and nothing is left over."""
    a = assemble(parse_joint(document(tmp_path, SHALLOW, 0.15), "wedge", tmp_path))
    asked = assemble(
        parse_joint(document(tmp_path, SHALLOW, 0.15, "frictional"), "wedge", tmp_path)
    )
    assert np.array_equal(a.prestress.solution.r, asked.prestress.solution.r)
    assert any("gentle slopes" in doubt.reason for doubt in a.doubts)
    found = run(a.joint)
    assert not found.failures
    assert prestress_summary(found)["friction"] == "with"
    for cycle in found.cycles["load"]:
        assert cycle.residual.max() < 1e-9
        work = cycle.dissipated
        assert work >= -1e-12


def test_steep_faces_say_what_friction_would_change(tmp_path):
    a = assemble(parse_joint(document(tmp_path, STEEP, 0.3), "wedge", tmp_path))
    sine, cosine = np.sin(np.radians(STEEP)), np.cos(np.radians(STEEP))
    assert reactions(a)[0] == pytest.approx(FORCE / sine, rel=1e-6)
    said = [d.reason for d in a.doubts if "sloping surfaces" in d.reason]
    assert len(said) == 1
    assert f"{sine / (sine + 0.3 * cosine):.0%}" in said[0]


def test_another_friction_is_pressed_in_anew(tmp_path):
    p = assemble(parse_joint(document(tmp_path, SHALLOW, 0.15), "wedge", tmp_path)).prepared
    sine, cosine = np.sin(np.radians(SHALLOW)), np.cos(np.radians(SHALLOW))
    for friction in (0.3, 0.1):
        r = p.with_friction(friction).prestress.solution.r
        assert normal(r).sum() == pytest.approx(FORCE / (sine + friction * cosine), rel=1e-3)


@pytest.mark.parametrize(
    ("preload", "said"),
    [
        ({"on": ["top"], "force": FORCE}, "a force on one has a direction"),
        ({"on": ["top"], "shortening": 1e-5}, "a force on one has a direction"),
        (
            {"on": ["top"], "force": FORCE, "direction": [0, -1, 0], "holds": "length"},
            "keeps its length acts between two places",
        ),
    ],
)
def test_a_force_on_one_place_has_a_direction_and_no_length(preload, said, tmp_path):
    with pytest.raises(InputError, match=said):
        parse_joint(document(tmp_path, STEEP, 0.1, **preload), "wedge", tmp_path)


@pytest.mark.parametrize(("share", "holds"), [(0.98, True), (1.02, False)])
def test_what_draws_a_wedge_out_is_friction_beyond_the_slope(share, holds, tmp_path):
    """Pressed in by F, with N = F/(sin + mu cos) on its face, it comes out at F + N (mu cos - sin)."""
    friction, angle = 0.15, np.radians(SHALLOW)
    pressed = FORCE / (np.sin(angle) + friction * np.cos(angle))
    draws = FORCE + pressed * (friction * np.cos(angle) - np.sin(angle))
    given = document(tmp_path, SHALLOW, friction)
    given["analysis"] = {"cycle": {"force": [share * draws], "steps": 40}}
    failures = run(parse_joint(given, "wedge", tmp_path)).failures
    if holds:
        assert not failures
    else:
        (failure,) = failures
        assert "there is no solution" in failure.reason
        assert "take a smaller load" in failure.reason

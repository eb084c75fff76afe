"""Bolts that are tightened one after the other, with parts that are loose until theirs is."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from mesh_files import faces_where, graded, grid, on_body, section_document, spot, two_bodies
from model.mesh.write_inp import write_inp

from microslip.analyses.prepared import tightening
from microslip.describe.reading import parse_joint
from microslip.errors import ContactError, InputError
from microslip.model.mesh.boundary import joined, with_surfaces
from microslip.pipeline.prepare import assemble


def straps():
    """Two plates end to end under a strap, a bolt through it and each of them; mm, in mirror image."""
    across, low = [-10.0, -5.0, 5.0, 10.0], [-5.0, 0.0]
    pieces = [(-45, -29, 2), (-29, -19, 2), (-19, -2, 2)]
    plate = graded((-80, -45, 2), *pieces)
    left, right = grid((plate, across, low)), grid((-plate[::-1], across, low))
    block = replace(right.blocks[0], labels=right.blocks[0].labels + left.elements)
    mesh = two_bodies(
        joined(left, replace(right, blocks=(block,))),
        grid(
            (graded(*pieces, (-2, 2, 1), (2, 19, 2), (19, 29, 2), (29, 45, 2)), across, [0.0, 6.0])
        ),
    )

    surfaces = {"strap": on_body(mesh, "upper", spot(0.0, -45, 45))}
    for name, sign in (("left", -1), ("right", 1)):
        lap, bolted = sorted([2 * sign, 45 * sign]), sorted([19 * sign, 29 * sign])
        surfaces |= {
            name: faces_where(mesh, lambda p, s=sign: s * p[:, 0] > 80 - 1e-9),
            f"{name}_lap": on_body(mesh, "lower", spot(0.0, *lap)),
            f"{name}_head": faces_where(mesh, spot(6.0, *bolted, 5.0)),
            f"{name}_nut": faces_where(mesh, spot(-5.0, *bolted, 5.0)),
        }
    return with_surfaces(mesh, surfaces)


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    folder = tmp_path_factory.mktemp("straps")
    write_inp(straps(), folder / "straps.inp")
    return folder


def bolt(side, **more):
    keys = {"name": side, "on": [f"{side}_head", f"{side}_nut"], "direction": [0, 0, -1]}
    return keys | {"stiffness": 3e9} | more


def tightened(folder, bolts, built_in=("left",), **more):
    laps = [
        {"name": s, "first": f"{s}_lap", "second": "strap", "friction": 0.3}
        for s in ("left", "right")
    ]
    document = {
        "kind": "mesh",
        "mesh": {"file": "straps.inp", "length_unit": "mm", "width": "20 mm", "modes": 16},
        "support": [{"on": side} for side in built_in],
        "interface": laps,
        "preload": bolts,
        "port": {"name": "tip", "kind": "force", "on": "left_head", "direction": "z"},
        "load": {"force": [5.0]},
        "analysis": {"cycle": {"force": [5.0]}},
        "output": {"name": "tip", "on": "left_head", "direction": "z"},
    } | more
    return assemble(parse_joint(document, "straps", folder))


FORCES = {"left": 3e5, "right": 5e5}


@pytest.mark.parametrize("amount", ["force", "shortening"])
def test_a_free_plate_is_loose_until_its_own_bolt_is_tightened(folder, amount):
    """After the first step the other bolt may as well be left out, its plate on soft springs; in the end
    it may as well be tightened together with the first, by how far both are shortened in all."""
    given = {s: f if amount == "force" else f / 3e9 for s, f in FORCES.items()}
    order = {"left": 1, "right": 2}
    found = tightened(folder, [bolt(s, order=order[s], **{amount: given[s]}) for s in order])
    # a part that nothing holds is refused
    soft = [{"on": "right", "direction": axis, "total": 1e5} for axis in "xyz"]
    alone = tightened(folder, [bolt("left", **{amount: given["left"]})], spring=soft)
    np.testing.assert_allclose(
        found.bolts.history[0], [alone.bolts.force[0], 0.0], rtol=1e-6, atol=1.0
    )
    if amount == "force":
        assert found.bolts.force[1] == pytest.approx(FORCES["right"], rel=1e-9)
    together = tightened(folder, [bolt(s, shortening=by) for s, _, by in found.bolts.rows])
    np.testing.assert_allclose(found.bolts.force, together.bolts.force, rtol=1e-6)
    pressure = together.prestress.pressure
    assert np.abs(found.prestress.pressure - pressure).max() < 1e-6 * pressure.max()


def test_the_other_order_is_the_mirror_image(folder):
    both = ("left", "right")
    one = tightened(folder, [bolt("left", force=3e5), bolt("right", force=5e5, order=2)], both)
    other = tightened(folder, [bolt("right", force=3e5), bolt("left", force=5e5, order=2)], both)
    np.testing.assert_allclose(one.bolts.history, other.bolts.history, rtol=1e-6, atol=1.0)


def test_a_bolt_that_pushes_a_loose_plate_away_is_refused(folder):
    bolts = [bolt("left", force=3e5), bolt("right", force=5e5, order=2, direction=[0, 0, 1])]
    with pytest.raises(
        ContactError, match="'right': cannot be tightened to a force: the preload pulls bodies"
    ):
        tightened(folder, bolts)


def test_a_part_that_a_bolt_alone_holds_is_tightened_to_a_force(tmp_path):
    """The upper beam hangs on a soft bolt: shortened by what the force took, it has that force."""
    bolt = {"name": "bolt", "on": ["below", "above"], "stiffness": 5e8}

    def found(**amount):
        given = section_document(tmp_path) | {"preload": bolt | amount}
        given["analysis"] = {"cycle": {"force": [50.0]}}
        return assemble(parse_joint(given, "beams", tmp_path))

    by_force = found(force=4e5)
    ((_, force, shortening),) = by_force.bolts.rows
    assert force == pytest.approx(4e5, rel=1e-9)
    by_length = found(shortening=shortening)
    assert by_length.bolts.force[0] == pytest.approx(4e5, rel=1e-6)
    assert by_force.prestress.solution.r[::2].sum() == pytest.approx(4e5, rel=1e-6)


def test_where_a_loose_plate_lies_does_not_matter(folder, monkeypatch):
    """It counts from where its bolt is snug, and what holds the plate until then is no part of the joint."""
    bolts = [bolt("left", shortening=1e-4), bolt("right", shortening=1e-4, order=2)]
    expected = tightened(folder, bolts).bolts
    monkeypatch.setattr(tightening, "HOLDS", 0.01 * tightening.HOLDS)
    found = tightened(folder, bolts).bolts
    np.testing.assert_allclose(found.history, expected.history, rtol=1e-6, atol=1.0)
    np.testing.assert_allclose(found.shortening, expected.shortening, rtol=1e-6)


@pytest.mark.parametrize("holds", [{}, {"stiffness": None, "holds": "length"}])
def test_bolts_two_by_two_with_a_plate_that_is_free(folder, holds):
    """Mirror images: the plates change places, and so does the order."""
    forces = []
    for first, second in (("left", "right"), ("right", "left")):
        bolts = [bolt(first, force=4e5, **holds), bolt(second, force=4e5, order=2, **holds)]
        bolts = [{k: v for k, v in each.items() if v is not None} for each in bolts]
        forces.append(tightened(folder, bolts).bolts.history[-1])
    np.testing.assert_allclose(forces[0][1], 4e5, rtol=1e-9)
    np.testing.assert_allclose(forces[0], forces[1], rtol=1e-6)


def test_a_plate_without_a_bolt_is_refused_by_name(folder):
    with pytest.raises(InputError) as caught:
        tightened(folder, [bolt("left", force=3e5)])
    said = str(caught.value)
    assert "no support and no contact under pressure holds" in said
    for way in ("translation along x", "translation along y", "translation along z"):
        assert f"{way} of body 2" in said
    assert "rotation of body 2 (3)" in said
    assert "upper" not in said


def test_a_bolt_with_next_to_no_force_is_named(folder):
    found = tightened(folder, [bolt("left", force=3e5), bolt("right", force=2e3)])
    assert any(
        "preload 'right': has 0.7% of the force of 'left'" in str(each) for each in found.doubts
    )
    found = tightened(folder, [bolt("left", force=3e5), bolt("right", force=4e3)])
    assert not any("of the force of" in str(each) for each in found.doubts)

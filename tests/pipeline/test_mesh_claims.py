"""Surfaces that two entries of a joint claim: a tie on an interface, two interfaces of one place."""

from __future__ import annotations

import numpy as np
import pytest
from mesh_files import matching_document, plates_document

from microslip.describe.reading import parse_joint
from microslip.errors import InputError
from microslip.model.mesh.abaqus.inp import read_inp
from microslip.pipeline.prepare import assemble


def plates_with(folder, more="", name="plates.inp", **changed):
    """The bolted plates with more lines in their deck, or other sections in their joint file."""
    document = plates_document(folder, name) | {"analysis": {"cycle": {"force": [1e3]}}} | changed
    with (folder / name).open("a") as deck:
        deck.write(more)
    return document


def refused(document, folder):
    with pytest.raises(InputError) as caught:
        assemble(parse_joint(document, "plates", folder))
    return str(caught.value)


def contact(name, where, friction=0.3):
    return {
        "name": name,
        "first": f"lower_{where}",
        "second": f"upper_{where}",
        "friction": friction,
    }


@pytest.mark.parametrize("sides", ["upper_contact, lower_contact", "lower_contact, upper_contact"])
def test_a_tie_of_a_deck_on_an_interface_is_refused_by_its_line(sides, tmp_path):
    document = plates_with(tmp_path, f"*TIE, NAME=glue\n{sides}\n")
    line = 1 + (tmp_path / "plates.inp").read_text().splitlines().index(sides)
    said = refused(document, tmp_path)
    assert f"tie 'glue' (plates.inp:{line}: *TIE) bonds" in said
    assert "over 100 % of interface 'contact'" in said


def test_a_tie_of_the_joint_file_on_an_interface_is_refused(tmp_path):
    tie = {"slave": "upper_contact", "master": "lower_contact"}
    said = refused(plates_with(tmp_path, tie=tie), tmp_path)
    assert "tie 'upper_contact to lower_contact' ([[tie]]) bonds" in said


def test_a_tie_of_a_part_of_an_interface_is_refused_with_its_share(tmp_path):
    """Before the bolt, 10 of 30 mm."""
    tie = {"slave": "upper_fore", "master": "lower_fore"}
    assert "over 33 % of interface 'contact'" in refused(plates_with(tmp_path, tie=tie), tmp_path)


@pytest.mark.parametrize("tie", [("upper_fore", "lower_contact"), ("upper_contact", "lower_fore")])
def test_a_tie_beside_an_interface_may_share_one_of_its_surfaces(tie, tmp_path):
    document = plates_with(
        tmp_path,
        tie={"slave": tie[0], "master": tie[1]},
        interface={**contact("aft", "aft"), "reach": 1e-3},
    )
    assert assemble(parse_joint(document, "plates", tmp_path)).imported.zero_modes == ()


@pytest.mark.parametrize(("where", "share"), [("contact", "100 %"), ("aft", "33 %")])
def test_two_interfaces_of_one_place_are_refused_by_name(where, share, tmp_path):
    document = plates_with(
        tmp_path, interface=[contact("lap", "contact"), contact("again", where, 0.1)]
    )
    said = refused(document, tmp_path)
    assert f"interface 'lap' and interface 'again' are of the same surfaces over {share}" in said


def test_two_flats_under_one_surface_are_refused(tmp_path):
    flats = [
        {"name": name, "first": "lower_contact", "flat": normal, "offset": 0.0, "friction": 0.3}
        for name, normal in (("one", [0, 0, -1.0]), ("two", [0, 0, -2.0]))
    ]
    said = refused(plates_with(tmp_path, interface=flats), tmp_path)
    assert "interface 'one' and interface 'two' are of the same surfaces over 100 %" in said


def equations(folder, chosen):
    """Nodes of the matching plates that lie on each other, bound by equations where `chosen(x)`."""
    document = matching_document(folder)
    mesh = read_inp(folder / "matching.inp")
    low = mesh.element_sets["lower"]
    below = np.unique(
        np.concatenate([b.nodes[np.isin(np.arange(b.count), low)] for b in mesh.blocks])
    )
    lines = []
    for k in below[(np.abs(mesh.points[below, 2]) < 1e-9) & (mesh.points[below, 0] > -15.1)]:
        apart = np.linalg.norm(mesh.points - mesh.points[k], axis=1)
        if chosen(mesh.points[k, 0]):
            other = np.setdiff1d(np.flatnonzero(apart < 1e-9), [k])[0]
            a, b = mesh.node_labels[other], mesh.node_labels[k]
            lines += [f"*EQUATION\n2\n{a}, {c}, 1.0, {b}, {c}, -1.0" for c in (1, 2, 3)]
    with (folder / "matching.inp").open("a") as deck:
        deck.write("\n".join(lines) + "\n")
    return document | {"analysis": {"cycle": {"force": [1e3]}}}


def test_pairs_that_equations_bond_are_refused_or_counted(tmp_path):
    said = refused(equations(tmp_path, lambda x: True), tmp_path)
    assert "hold both sides of all 15 contact pairs together" in said
    found = assemble(parse_joint(equations(tmp_path, lambda x: x < -10), "plates", tmp_path))
    said = [str(caution) for caution in found.imported.cautions]
    assert any("3 of 15 contact pairs can neither slide nor open" in text for text in said)


def test_motions_are_of_the_bodies_that_move(tmp_path):
    """A bolt of some stiffness joins the free plate to the clamped one, and resists one of six motions."""
    bolt = {"name": "bolt", "on": ["head", "nut"], "force": "600 kN/m", "stiffness": "5e9 N/m/m"}
    names = assemble(
        parse_joint(plates_with(tmp_path, preload=bolt), "plates", tmp_path)
    ).imported.zero_modes
    assert len(names) == 5
    assert {"translation along x of upper", "translation along y of upper"} < set(names)
    assert names.count("rotation of upper") == 3


def test_a_bolt_that_pushes_is_told_in_words_of_a_mesh(tmp_path):
    bolt = {"name": "bolt", "on": ["nut", "head"], "direction": [0, 0, -1.0], "force": "600 kN/m"}
    said = refused(plates_with(tmp_path, preload=bolt), tmp_path)
    assert "do its forces draw the parts together" in said
    assert "is B positive" not in said

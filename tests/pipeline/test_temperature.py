"""Temperature of a joint from a mesh: bolts of another material as bars beside each other."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from mesh_files import faces_where, grid, on_body, two_bodies
from model.mesh.write_inp import write_inp

from microslip.describe.reading import parse_joint
from microslip.errors import InputError
from microslip.model.mesh.boundary import joined, with_surfaces
from microslip.model.mesh.finite_elements import Section
from microslip.pipeline.prepare import assemble

HEIGHT, WIDE, BOLT = 40.0, 30.0, 6.0
"""Of both blocks together and their widths, mm."""

SPRING = 3e9
"""To the ground at the top, N/m per metre of width: without the bolt it alone holds the upper block."""

BLOCK_E, BOLT_E, BLOCK_ALPHA, BOLT_ALPHA = 70e9, 210e9, 23e-6, 12e-6


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    """Two blocks on each other and a bolt beside them, all tops at one height."""
    folder = tmp_path_factory.mktemp("temperature")
    half, y = 0.5 * HEIGHT, np.linspace(0, 0.5 * HEIGHT, 4)
    mesh = two_bodies(grid((np.linspace(0, WIDE, 6), y)), grid((np.linspace(0, WIDE, 5), y + half)))
    bolt = grid((50.0 + np.array([0.0, BOLT]), np.linspace(0, HEIGHT, 5)))
    labels = bolt.blocks[0].labels + mesh.elements
    bolt = replace(
        bolt,
        blocks=(replace(bolt.blocks[0], labels=labels),),
        element_sets={"bolt": np.arange(bolt.elements)},
    )
    mesh = joined(mesh, bolt)
    mesh = replace(mesh, node_labels=1 + np.arange(len(mesh.points)))
    x, y = mesh.points.T
    below = mesh.element_sets["bolt"][1]

    def level(height):
        return lambda p: np.abs(p[:, 1] - height) < 1e-9

    mesh = with_surfaces(
        mesh,
        {
            "lower_contact": on_body(mesh, "lower", level(half)),
            "upper_contact": on_body(mesh, "upper", level(half)),
            "top": on_body(mesh, "upper", level(HEIGHT)),
            "side": on_body(mesh, "upper", lambda p: np.abs(p[:, 0] - WIDE) < 1e-9),
            "nut": faces_where(mesh, lambda p: np.abs(p[:, 1]) < 1e-9),
        },
    )
    ends = {"bottom": np.flatnonzero(y < 1e-9), "foot": np.flatnonzero((y < 1e-9) & (x > 49))}
    mesh = replace(mesh, node_sets=ends, sections=(*mesh.sections, Section("bolt", "steel")))
    deck = write_inp(mesh, folder / "bars.inp")
    text = deck.read_text().replace("TYPE=CPE4,", "TYPE=CPS4I,")
    tops = 1 + np.flatnonzero(y > HEIGHT - 1e-9)
    rows = "".join(f"*EQUATION\n2\n{k}, 2, 1., {tops[0]}, 2, -1.\n" for k in tops[1:])
    cut = f"*SURFACE, NAME=SHANK\n{mesh.element_labels[below]}, S3\n"
    deck.write_text(text + cut + rows)
    return folder


def document(preload, expansions=(BLOCK_ALPHA, BOLT_ALPHA), **more):
    common = {"poissons_ratio": 0.0, "density": 7800.0, "plane": "stress"}
    blocks = {"elements": ["lower", "upper"], "youngs_modulus": BLOCK_E}
    bolt = {"elements": ["bolt"], "youngs_modulus": BOLT_E}
    own = [
        common | body | {"thermal_expansion": alpha}
        for body, alpha in zip((blocks, bolt), expansions, strict=True)
    ]
    return {
        "kind": "mesh",
        "mesh": {"file": "bars.inp", "length_unit": "mm", "modes": 10},
        "material": own,
        "support": [{"on": "bottom"}],
        "spring": [
            {"on": "side", "direction": "x", "stiffness": 1e10},
            {"on": "top", "direction": "y", "total": SPRING},
        ],
        "interface": {"first": "lower_contact", "second": "upper_contact", "friction": 0.3},
        "preload": preload,
        "port": {"name": "push", "on": "side", "direction": "x"},
        "load": {"force": [1.0]},
        "analysis": {"cycle": {"force": [1.0]}},
    } | more


def assembled(folder, *args, **more):
    return assemble(parse_joint(document(*args, **more), "bars", folder))


SHANK = {"name": "bolt", "section": "SHANK", "force": 5e4}


def bars(warmer_blocks, warmer_bolt, expansions):
    """Forces of a bolt, blocks and a spring whose ends move together: of the bolt, and of the blocks.

    With w the way of the top down and s the shortening, ``F = k_bolt (s - w - alpha T h)`` is
    ``k_blocks (w + alpha T h) + k_spring w``.
    """
    blocks, bolt = BLOCK_E * WIDE / HEIGHT, BOLT_E * BOLT / HEIGHT
    start = 5e4 / (blocks + SPRING)
    shortening = 5e4 / bolt + start
    longer = [
        alpha * warmer * HEIGHT * 1e-3
        for alpha, warmer in zip(expansions, (warmer_blocks, warmer_bolt), strict=True)
    ]
    down = bolt * (shortening - longer[1]) - blocks * longer[0]
    down /= blocks + SPRING + bolt
    return bolt * (shortening - down - longer[1]), blocks * (down + longer[0])


@pytest.mark.parametrize(
    ("warmer", "expansions"),
    [(40.0, (23e-6, 12e-6)), (-15.0, (11e-6, 17e-6)), (-2.0, (18e-6, 0.0))],
)
def test_a_bolt_of_another_material_is_a_bar_beside_bars(folder, warmer, expansions):
    found = assembled(folder, [SHANK, {"name": "heat", "temperature": warmer}], expansions)
    bolt, blocks = bars(warmer, warmer, expansions)
    assert found.bolts.history[0, 0] == pytest.approx(5e4, rel=1e-8)
    assert found.bolts.force[0] == pytest.approx(bolt, rel=1e-8)
    assert found.prestress.pressure @ found.model.area == pytest.approx(blocks, rel=1e-8)


def test_bodies_are_warmed_one_by_one(folder):
    heat = [
        {"name": "inside", "on": ["lower", "upper"], "temperature": "30 K"},
        {"name": "outside", "on": "bolt", "temperature": "-10 K"},
    ]
    found = assembled(folder, [SHANK, *heat])
    bolt, blocks = bars(30.0, -10.0, (BLOCK_ALPHA, BOLT_ALPHA))
    assert found.bolts.force[0] == pytest.approx(bolt, rel=1e-8)
    assert found.prestress.pressure @ found.model.area == pytest.approx(blocks, rel=1e-8)


def test_what_is_tightened_hot_has_its_force_hot(folder):
    """With the number of the bolt's own step the temperature comes before its force is set."""
    found = assembled(folder, [SHANK, {"name": "heat", "temperature": 40.0, "order": 1}])
    assert found.bolts.force[0] == pytest.approx(5e4, rel=1e-8)


@pytest.mark.parametrize(
    ("heat", "expansions", "said"),
    [
        ({"temperature": 40.0}, (0.0, 0.0), "nothing that changes its temperature expands"),
        (
            {"temperature": 40.0, "on": "bolt"},
            (1e-5, 0.0),
            "nothing that changes its temperature expands",
        ),
        (
            {"temperature": 40.0, "on": "nowhere"},
            (1e-5, 1e-5),
            '"nowhere": the mesh has no element set',
        ),
        ({"temperature": "40 degC"}, (1e-5, 1e-5), "expected a change of temperature"),
        ({"temperature": 0.0}, (1e-5, 1e-5), "0 changes nothing"),
        ({"temperature": 40.0, "force": 1e3}, (1e-5, 1e-5), "give one of force"),
        ({"temperature": 40.0, "holds": "length"}, (1e-5, 1e-5), "and this is a temperature"),
    ],
)
def test_temperatures_that_change_nothing_are_refused(folder, heat, expansions, said):
    with pytest.raises(InputError, match=said):
        assembled(folder, [SHANK, {"name": "heat"} | heat], expansions)

"""From the description of a lap joint to its finite elements."""

from __future__ import annotations

import numpy as np
import pytest
from conftest import ROOT

from microslip.describe.reading import load_joint, parse_joint
from microslip.model.lap import geometry, materials, mesh_control, structure_of

EXAMPLE = ROOT / "examples" / "lap_joint.toml"


def test_models_of_the_reference_joint():
    joint = load_joint(EXAMPLE)
    g = geometry(joint)
    assert (g.length, g.thickness, g.overlap_half_length, g.clamp_half_length) == (
        0.2515,
        0.0125,
        0.0375,
        0.025,
    )
    assert materials(joint)[0].plane_modulus() == pytest.approx(70e9 / 0.91)
    assert mesh_control(joint).contact_pairs == 201
    assert joint.clamp_force_length == pytest.approx(251.5e3)
    assert joint.opening_ratio == pytest.approx(37.5 / 251.5)


SMALL = {
    "beams": {"length": "200 mm", "thickness": "10 mm", "overlap_half_length": "30 mm"},
    "material": {"youngs_modulus": "70 GPa", "poissons_ratio": 0.3, "density": "2 g/cm^3"},
    "contact": {"friction": 0.25, "pairs": 20},
    "clamp": {"force": "1 MN/m", "half_length": "20 mm"},
    "support": {"horizontal_spring": 0},
    "load": {"moment": 50},
}


def test_a_described_joint_weighs_what_its_beams_weigh():
    """Rigid translation: mass of both beams per metre of width; without springs no force."""
    structure = structure_of(parse_joint(SMALL))
    one_direction = np.zeros(structure.dofs + 2)
    one_direction[0::2] = 1.0
    along = one_direction[structure.free]
    assert along @ structure.mass @ along == pytest.approx(2 * 0.2 * 0.01 * 2000)
    assert np.abs(structure.stiffness @ along).max() < 1e-9 * np.abs(structure.stiffness).max()
    assert len(structure.interface.position) == 21


def test_springs_of_the_description_hold_both_ends():
    joint = parse_joint({**SMALL, "support": {"horizontal_spring": "3e5 N/m/m"}})
    structure = structure_of(joint)
    along = np.zeros(structure.dofs + 2)
    along[0::2] = 1.0
    along = along[structure.free]
    assert along @ structure.stiffness @ along == pytest.approx(2 * 3e5)


def test_plane_of_the_description_is_that_of_the_material():
    stress = {**SMALL, "material": {**SMALL["material"], "plane": "stress"}}
    assert materials(parse_joint(stress))[1].plane_modulus() == 70e9

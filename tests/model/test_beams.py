"""The joint by beam theory, against closed forms and against the finite elements."""

from __future__ import annotations

import math

import numpy as np
import pytest
from conftest import GEOMETRY, MATERIAL, SPRING

from microslip.describe.reading import parse_joint
from microslip.model.beams import SPREAD, beam_estimate, timoshenko
from microslip.model.elasticity import Material
from microslip.model.lap import geometry, materials
from microslip.model.lap_mesh import LapGeometry
from microslip.model.stress import sections_outside
from microslip.pipeline.prepare import assemble

SLENDER = LapGeometry(1.0, 0.005, 0.05, 0.04)


def test_element_holds_rigid_motions():
    stiffness, mass = timoshenko(0.3, 0.02, MATERIAL)
    rigid = np.array([[1, 0, 0, 1, 0, 0], [0, 1, 0, 0, 1, 0], [0, 0, 1, 0, 0.3, 1.0]], float)
    assert np.abs(stiffness @ rigid.T).max() < 1e-9 * np.abs(stiffness).max()
    # a rigid body: its mass both ways, and its moment of inertia about its end
    m = MATERIAL.density * 0.02 * 0.3
    turning = m * (0.3**2 / 3 + 0.02**2 / 12)
    assert np.diag(rigid @ mass @ rigid.T) == pytest.approx([m, m, turning], rel=1e-12)


def test_cantilever_bends_and_shears():
    """P l³/(3 E'I) + P l/(kappa G A), Timoshenko."""
    l, h = 0.05, 0.02
    stiffness, _ = timoshenko(l, h, MATERIAL)
    tip = np.linalg.solve(stiffness[3:, 3:], [0.0, 1.0, 0.0])[1]
    shear = 5 / 6 * MATERIAL.youngs_modulus / 2.6 * h
    bent = l**3 / (3 * MATERIAL.plane_modulus() * h**3 / 12)
    assert tip == pytest.approx(bent + l / shear, rel=1e-12)


def test_deflection_under_end_moments_is_that_of_a_stepped_beam():
    """M s²/(8 E'I) of the span s, less what the overlap is stiffer: two beams side by side."""
    g = SLENDER
    found = beam_estimate(g, MATERIAL, 0.0 + 1.0)
    bending = MATERIAL.plane_modulus() * g.thickness**3 / 12
    half = g.length - g.overlap_half_length
    reach = g.clamp_half_length + SPREAD * g.thickness
    # area moment: curvature 1/B outside the overlap, 1/(2 B) where two beams share the moment;
    # between, where one tip is free, all of it is in the other beam
    whole = half**2 / 2
    shared = reach * (half - reach / 2)
    assert found.deflection == pytest.approx((whole - shared / 2) / bending, rel=2e-2)


def test_frequencies_scale_as_beams_do():
    """f goes with c h / l²: as large a joint twice has half of it, a stiffer metal more."""
    one = beam_estimate(GEOMETRY, MATERIAL, 0.0 + 1e-3)
    double = LapGeometry(*(2 * x for x in (0.2515, 0.0125, 0.0375, 0.025)))
    two = beam_estimate(double, MATERIAL, 1e-3)
    assert two.sliding_frequency == pytest.approx(one.sliding_frequency / 2, rel=1e-4)
    steel = Material(210e9, 0.3, 7850.0)
    three = beam_estimate(GEOMETRY, steel, 1e-3)
    ratio = math.sqrt(3 * 2000 / 7850)
    assert three.stuck_frequency == pytest.approx(ratio * one.stuck_frequency, rel=1e-4)


def test_without_springs_nothing_changes_but_the_mean_position():
    none, weak = (beam_estimate(GEOMETRY, MATERIAL, k) for k in (0.0, 1e3))
    assert none.sliding_frequency == pytest.approx(weak.sliding_frequency, rel=1e-4)
    assert none.stuck_frequency == pytest.approx(weak.stuck_frequency, rel=1e-4)
    assert none.deflection == pytest.approx(weak.deflection, rel=1e-3)


def test_a_stuck_overlap_is_stiffer_and_stiff_springs_too():
    weak, stiff = (beam_estimate(GEOMETRY, MATERIAL, k) for k in (SPRING, 1e10))
    assert weak.stuck_frequency > weak.sliding_frequency
    assert stiff.sliding_frequency > weak.sliding_frequency
    assert stiff.stuck_frequency > weak.stuck_frequency


JOINTS = [
    # length, thickness, overlap, clamp (mm), E (GPa), density, spring
    (251.5, 12.5, 37.5, 25.0, 70, 2000, 1e5),
    (120.0, 15.0, 35.0, 20.0, 210, 7850, 1e4),
    (400.0, 10.0, 60.0, 35.0, 110, 4430, 1e7),
    (200.0, 9.0, 70.0, 60.0, 70, 2700, 3e8),
    (90.0, 4.0, 12.0, 6.0, 210, 7850, 1e6),
    (200.0, 5.0, 6.0, 4.0, 70, 2700, 1e7),  # contact ends just before the overlap does
]


@pytest.mark.parametrize(("length", "h", "overlap", "clamp", "E", "rho", "spring"), JOINTS)
def test_frequencies_are_those_of_the_finite_elements(length, h, overlap, clamp, E, rho, spring):
    joint = parse_joint(
        {
            "beams": {
                "length": f"{length} mm",
                "thickness": f"{h} mm",
                "overlap_half_length": f"{overlap} mm",
            },
            "material": {"youngs_modulus": f"{E} GPa", "poissons_ratio": 0.3, "density": rho},
            "contact": {"friction": 0.3, "pairs": 41},
            "clamp": {"force": "100 kN/m", "half_length": f"{clamp} mm"},
            "support": {"horizontal_spring": spring},
            "mesh": {"modes": 20},
            "analysis": {"cycle": {}},
        }
    )
    assembly = assemble(joint)
    mode = assembly.mode
    found = beam_estimate(geometry(joint), materials(joint), spring)
    assert found.sliding_frequency == pytest.approx(mode.sliding_frequency, rel=0.03)
    assert found.stuck_frequency == pytest.approx(mode.stuck_frequency, rel=0.05)
    sections = sections_outside(assembly.structure, materials(joint), assembly.states.sliding)
    share = np.abs(sections.moment).max() * mode.load_on_sliding["moment"] / mode.sliding_omega**2
    assert found.modal_share == pytest.approx(share, rel=0.05)

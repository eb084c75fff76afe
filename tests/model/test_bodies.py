"""Rigid motions of the bodies, and supports of any stiffness."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from conftest import GEOMETRY, MATERIAL

from microslip.analyses.prepared.joint_modes import joint_modes
from microslip.analyses.prepared.prestress import opening_load
from microslip.describe.lap import LapJoint
from microslip.describe.reading import parse_joint
from microslip.errors import InputError
from microslip.model.bodies import left_free, rigid_motions
from microslip.model.joint import Reducer, soft_modes
from microslip.model.lap import lap_joint_structure
from microslip.model.lap_mesh import MeshControl
from microslip.model.structure import Structure
from microslip.pipeline.loads import opening_of
from microslip.pipeline.prepare import Assembly, assemble

SPRINGS = (0.0, 1.0, 1e3, 1e5, 1e6, 3e6, 1e7, 1e8, 1e9, 1e10, 1e12)
"""N/m per metre of width: from none to ten times Young's modulus, as stiff as a wall."""

JOINTS = {
    "slender": {
        "beams": {"length": "0.6 m", "thickness": "15 mm", "overlap_half_length": "0.2 m"},
        "material": {"youngs_modulus": "210 GPa", "poissons_ratio": 0.3, "density": 7850},
        "clamp": {"force": "50 kN/m", "half_length": "70 mm"},
    },
    "stubby": {
        "beams": {"length": "40 mm", "thickness": "5 mm", "overlap_half_length": "6 mm"},
        "material": {"youngs_modulus": "110 GPa", "poissons_ratio": 0.25, "density": 4430},
        "clamp": {"force": "8 MN/m", "half_length": "5 mm"},
    },
}


def joint(name: str, spring: float) -> LapJoint:
    return LapJoint.model_validate(
        {
            **JOINTS[name],
            "contact": {"friction": 0.3, "pairs": 21},
            "support": {"horizontal_spring": spring},
            "damping": {"beta": 1e-6},
            "analysis": {},
        }
    )


def structure(spring: float, support: str = "pinned") -> Structure:
    return lap_joint_structure(
        GEOMETRY,
        MATERIAL,
        MeshControl(contact_pairs=11),
        horizontal_spring=spring,
        ends=(support, support),
        weak_spring=spring,
    )


@pytest.fixture(scope="module", params=list(JOINTS))
def supported(request) -> list[Assembly]:
    """One joint on springs of every stiffness."""
    return [assemble(joint(request.param, spring)) for spring in SPRINGS]


# --- rigid motions


def test_rigid_motions_strain_nothing():
    found = structure(0.0, "free")
    assert found.motions.shape == (found.dofs, 6)
    energy = np.einsum("ij,ij->j", found.motions, found.stiffness @ found.motions)
    diagonal = found.stiffness.diagonal()
    assert np.abs(energy).max() < 1e-13 * (diagonal @ np.abs(found.motions) ** 2).min()


def test_fixed_ends_leave_four_motions():
    """Six of two bodies, less two ends that are held vertically."""
    found = structure(0.0)
    assert found.motions.shape == (found.dofs, 4)
    assert np.linalg.matrix_rank(found.motions) == 4


def test_springs_are_all_that_supports_hold():
    """Work of the springs in a shift along x: two of them, each over the whole face."""
    k = 3e4
    found = structure(k, "free")
    shift = found.motions[:, [0, 3]].sum(axis=1)
    assert shift @ found.supports @ shift == pytest.approx(2 * k, rel=1e-12)


def test_left_free_solves_for_what_is_fixed():
    motions = rigid_motions(np.array([[0.0, 1.0, 1.0], [0.0, 0.0, 2.0]]), 0, 6)
    free = left_free(motions, np.array([1, 3]))  # two nodes on rollers: only x is left
    assert free.shape == (6, 1)
    assert free[[1, 3, 5]] == pytest.approx(np.zeros((3, 1)), abs=1e-15)
    assert free[[0, 2, 4], 0] == pytest.approx(free[0, 0] * np.ones(3))


def test_motions_of_ports_are_those_of_the_structure():
    """Modal ports from the kept modes agree with the load vectors they stand for."""
    found = structure(1e5)
    reducer = Reducer(found, 20, (0.0, 0.0))
    model = reducer.model({"moment": found.loads["moment"]})
    shape = np.zeros(20)
    shape[[4, 7]] = 1.0, -2.0
    modal = model.with_modal_ports({"p": shape}).bodies.ports[-1]
    vector = found.mass @ (reducer.modes.shapes @ shape)
    direct = reducer.with_ports(model, {"p": vector}).bodies.ports[-1]
    assert modal == pytest.approx(direct, abs=1e-12 * np.abs(found.motions.T @ found.mass).max())


# --- supports of any stiffness


def test_opening_moment_is_that_of_the_contact_alone(supported):
    """Clamp force times half the overlap, whatever holds the ends."""
    for assembly in supported:
        j = assembly.joint
        expected = j.clamp.force * j.beams.overlap_half_length
        assert assembly.opening_moment == pytest.approx(expected, rel=1e-10)


def test_opening_inertia_follows_the_mode(supported):
    """It depends on the mode alone, which stiffer supports change smoothly: no jump, nothing missing."""
    limits = np.array([opening_of(a, a.mode.port) for a in supported])
    assert np.isfinite(limits).all()
    assert np.abs(np.diff(limits[:7])).max() < 1e-3 * limits[0]  # up to 1e7: weak for both beams
    assert np.abs(np.log(limits / limits[0])).max() < np.log(1.2)


def test_stiffer_supports_raise_every_frequency(supported):
    """Rayleigh: stiffness added to the ground lowers none."""
    for state in ("sliding_frequency", "stuck_frequency"):
        f = np.array([getattr(a.mode, state) for a in supported])
        assert (np.diff(f) > -1e-7 * f[0]).all()


def test_first_mode_that_deforms_the_joint_is_the_driven_one(supported):
    """Modes of the bodies on their supports do not count, however stiff these are."""
    for a in supported:
        first = joint_modes(a.model, a.prestress, a.prepared.law)[0]
        assert first.sliding_frequency == pytest.approx(a.mode.sliding_frequency, rel=1e-4)


def test_prestress_does_not_see_the_supports(supported):
    """By more than the share of the springs in the stiffness along the beams."""
    first = supported[0].prestress.pressure
    for a in supported[1:]:
        m, b = a.joint.material, a.joint.beams
        share = a.joint.spring_used / (m.youngs_modulus * b.thickness / b.length)
        assert np.abs(a.prestress.pressure - first).max() < (1e-9 + share) * first.max()


def test_weakest_springs_only_hold_the_mean_position(supported):
    """Without springs and with those that are raised the joint is one and the same."""
    none, weak = supported[:2]
    assert none.joint.spring_used == weak.joint.spring_used > 1.0
    assert none.mode.sliding_frequency == weak.mode.sliding_frequency


def test_conditioning_decides_what_statics_solves_for(supported):
    """No mode outside the unknowns drowns the flexibility of the others, truncated ones among them."""
    for a in supported:
        e, m = a.model.equilibrium_modes, a.model
        give = (np.abs(m.mode_v[:, e:]).max(axis=0) / m.omega[e:]) ** 2
        rest = give[::-1].cumsum()[::-1] - give
        truncated = np.linalg.norm(m.residual, 2)
        assert (give[:-1] <= 10 * (rest[:-1] + truncated)).all()


def test_soft_modes_without_motion_at_the_pairs_count_with_softer_ones():
    assert soft_modes(np.array([0.0, 0.0, 1.0]), np.array([[0.0, 1.0, 1.0]])) == 2
    assert soft_modes(np.array([1.0, 1.0]), np.zeros((1, 2))) == 0


# --- what is refused


def test_a_wall_is_refused():
    text = {**JOINTS["slender"], "contact": {"friction": 0.3}, "analysis": {"cycle": {}}}
    text["support"] = {"horizontal_spring": "1e15 N/m/m"}
    with pytest.raises(InputError, match=r"support.horizontal_spring.*must be below 1000"):
        parse_joint(text)


def test_without_known_motions_no_load_is_said_to_open():
    a = assemble(joint("stubby", 1e5))
    blind = replace(a.model, bodies=None)
    assert opening_load(blind, a.prestress, "moment") == np.inf

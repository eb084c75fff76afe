"""Lap joints of two different beams, clamps off the middle, and loads at one end."""

from __future__ import annotations

import numpy as np
import pytest
import scipy.sparse.linalg as spla
import skfem
from conftest import GEOMETRY, MATERIAL
from scipy.integrate import trapezoid

from microslip.analyses.prepared.joint import prepare_joint
from microslip.analyses.prepared.prestress import opening_load
from microslip.analyses.statics.cycle import quasi_static_cycle
from microslip.contact.law import contact_law
from microslip.contact.pairs import normal, tangential
from microslip.describe.lap import LapJoint
from microslip.errors import ModelError
from microslip.model.elasticity import Material, elastic_body
from microslip.model.end_loads import EndLoad
from microslip.model.joint import Reducer
from microslip.model.lap import lap_joint_structure, pressing
from microslip.model.lap_mesh import LapGeometry, MeshControl
from microslip.model.modes import bonding
from microslip.model.pressing import parabolic, pressed_load, tabulated
from microslip.pipeline.prepare import Assembly, assemble

MIRRORED = 1e-8
"""Rounding of the eigenvalue problem and of the flexibility, relative."""


def described(**sections) -> LapJoint:
    """A joint of steel on aluminium with an eccentric clamp, unless `sections` say otherwise."""
    document = {
        "beams": {
            "length": "200 mm",
            "thickness": "8 mm",
            "overlap_half_length": "40 mm",
            "upper": {"length": "140 mm", "thickness": "12 mm"},
        },
        "material": {
            "youngs_modulus": "210 GPa",
            "poissons_ratio": 0.3,
            "density": 7850,
            "upper": {"youngs_modulus": "70 GPa", "poissons_ratio": 0.33, "density": 2700},
        },
        "contact": {"friction": 0.3, "pairs": 41},
        "clamp": {"force": "300 kN/m", "half_length": "20 mm", "centre": "7 mm"},
        "damping": {"beta": 1e-6},
        "analysis": {},
    }
    return LapJoint.model_validate(document | sections)


@pytest.fixture(scope="module")
def different() -> Assembly:
    return assemble(described())


@pytest.fixture(scope="module")
def turned() -> Assembly:
    """The same joint after a half turn: what was above is below, what was left is right."""
    return assemble(
        described(
            beams={
                "length": "140 mm",
                "thickness": "12 mm",
                "overlap_half_length": "40 mm",
                "upper": {"length": "200 mm", "thickness": "8 mm"},
            },
            material={
                "youngs_modulus": "70 GPa",
                "poissons_ratio": 0.33,
                "density": 2700,
                "upper": {"youngs_modulus": "210 GPa", "poissons_ratio": 0.3, "density": 7850},
            },
            clamp={"force": "300 kN/m", "half_length": "20 mm", "centre": "-7 mm"},
        )
    )


# --- symmetries


def test_half_turn_exchanges_the_beams(different, turned):
    for state in ("sliding_frequency", "stuck_frequency", "overlap"):
        one, other = getattr(different.mode, state), getattr(turned.mode, state)
        assert other == pytest.approx(one, rel=MIRRORED)
    one, other = different.prestress.pressure, turned.prestress.pressure[::-1]
    assert np.abs(one - other).max() < MIRRORED * one.max()
    assert different.model.image is None


def test_half_turn_mirrors_a_cycle(different, turned):
    """The load reverses with the turn: both bend the joint concave up before, and down after."""
    amplitude = 0.4 * different.opening_moment
    one = quasi_static_cycle(different.prepared, "moment", amplitude, steps=60)
    other = quasi_static_cycle(turned.prepared, "moment", amplitude, steps=60, phase=np.pi)
    assert one.dissipated > 0
    assert other.dissipated == pytest.approx(one.dissipated, rel=1e-6)


def test_saying_that_the_upper_beam_is_alike_changes_nothing():
    beams = {"length": "200 mm", "thickness": "8 mm", "overlap_half_length": "40 mm"}
    metal = {"youngs_modulus": "210 GPa", "poissons_ratio": 0.3, "density": 7850}
    clamp = {"force": "300 kN/m", "half_length": "20 mm"}
    short = {"beams": beams, "material": metal, "clamp": clamp}
    said = {
        "beams": beams | {"upper": {"length": "200 mm", "thickness": "8 mm"}},
        "material": metal | {"upper": dict(metal)},
        "clamp": clamp | {"centre": "0 mm", "pressure": "uniform"},
    }
    one, other = assemble(described(**short)), assemble(described(**said))
    assert one.joint.symmetric
    assert other.joint.symmetric
    assert np.array_equal(one.model.residual, other.model.residual)
    assert np.array_equal(one.prestress.pressure, other.prestress.pressure)


def test_frequencies_follow_the_moduli(different):
    """All moduli four times: twice the frequencies, whatever the beams."""
    stiffer = described(
        material={
            "youngs_modulus": "840 GPa",
            "poissons_ratio": 0.3,
            "density": 7850,
            "upper": {"youngs_modulus": "280 GPa", "poissons_ratio": 0.33, "density": 2700},
        },
        support={"horizontal_spring": 4e5},
    )
    twice = assemble(stiffer)
    assert twice.mode.sliding_frequency == pytest.approx(
        2 * different.mode.sliding_frequency, rel=1e-6
    )


# --- what opens it


@pytest.mark.parametrize(
    "clamp",
    [
        {"half_length": "20 mm", "centre": "7 mm"},
        {"half_length": "20 mm", "centre": "-20 mm", "pressure": "parabolic"},
        {"half_length": "30 mm", "pressure": [["-30 mm", 0], ["10 mm", 3], ["30 mm", 1]]},
    ],
)
def test_resultant_of_the_clamp_says_what_opens(clamp):
    """P times the distance from the clamp's resultant to the nearer tip, statics of one beam."""
    joint = described(clamp={"force": "300 kN/m", **clamp})
    a = assemble(joint)
    load = a.structure.loads["clamp"]
    nodes = elastic_body(a.structure.meshes[1], MATERIAL).nodes
    below = 2 * elastic_body(a.structure.meshes[0], MATERIAL).nodes.shape[1]
    full = np.zeros(below + 2 * nodes.shape[1])
    full[a.structure.free] = load
    pull = full[below + 1 :: 2]
    assert pull.sum() == pytest.approx(-1.0, rel=1e-12)
    centre = -(nodes[0] @ pull)
    assert joint.clamp.resultant == pytest.approx(centre, abs=1e-15)
    expected = 300e3 * (0.04 - abs(centre))
    assert a.opening_moment == pytest.approx(expected, rel=1e-9)
    assert joint.opening_ratio * joint.clamp_force_length == pytest.approx(expected, rel=1e-12)


@pytest.mark.parametrize(
    ("pressed", "mean", "second"),
    [
        (parabolic(0.1, 0.5), 0.1, 0.01 + 0.25 / 5),
        (tabulated(np.array([-0.6, 0.0, 0.6]), np.array([0.0, 1.0, 0.0])), 0.0, 0.36 / 6),
        (tabulated(np.array([-0.3, 0.9]), np.array([0.0, 2.0])), 0.5, 0.25 + 1.44 / 18),
    ],
)
def test_pressure_is_integrated_exactly(pressed, mean, second):
    """First and second moments of a parabola and of triangles, over edges that their ends cut."""
    mesh = skfem.MeshQuad.init_tensor(np.linspace(-1, 1, 9) ** 3, np.array([0.0, 1.0]))
    body = elastic_body(mesh, MATERIAL)
    top = mesh.facets_satisfying(lambda x: np.abs(x[1] - 1) < 1e-12, True)
    force, x = pressed_load(body, top, pressed)[1::2], body.nodes[0]
    assert force.sum() == pytest.approx(1.0, rel=1e-12)
    assert x @ force == pytest.approx(mean, abs=1e-14)
    assert x**2 @ force == pytest.approx(second, rel=1e-12)


def test_a_table_that_pulls_or_does_not_press_is_refused():
    for values in ([0.0, 0.0], [-1.0, 2.0]):
        with pytest.raises(ModelError, match="press somewhere and pull nowhere"):
            tabulated(np.array([-1.0, 1.0]), np.array(values))


def test_symmetry_of_a_pressure_is_seen():
    assert pressing(described(clamp={"force": 1.0, "half_length": 0.02})).symmetric
    skew = {"force": 1.0, "half_length": 0.02, "pressure": [[-0.02, 1.0], [0.02, 2.0]]}
    assert not pressing(described(clamp=skew)).symmetric
    assert not described(clamp=skew).symmetric


# --- loads at the ends


PORTS = (
    EndLoad("tip", "force", "right", "y"),
    EndLoad("pull", "force", "both", "x"),
    EndLoad("bend", "moment", "right"),
    EndLoad("shake", "base", direction="y"),
)


@pytest.fixture(scope="module")
def free_structure():
    return lap_joint_structure(
        GEOMETRY,
        MATERIAL,
        MeshControl(contact_pairs=11),
        horizontal_spring=0.0,
        ends=("free", "free"),
        ports=PORTS,
    )


def test_resultants_of_the_loads(free_structure):
    s = free_structure
    nodes = np.hstack([elastic_body(mesh, MATERIAL).nodes for mesh in s.meshes])
    weight = 2 * MATERIAL.density * GEOMETRY.length * GEOMETRY.thickness
    expected = {  # force along x, along y, moment about the middle
        "tip": (0, 1, GEOMETRY.length - GEOMETRY.overlap_half_length),
        "pull": (0, 0, -GEOMETRY.thickness),  # the ends are half a thickness above and below
        "bend": (0, 0, 1),
        "shake": (0, -weight, 0),
    }
    for name, (along, across, turn) in expected.items():
        fx, fy = s.loads[name][::2], s.loads[name][1::2]
        scale = np.abs(s.loads[name]).sum()
        assert fx.sum() == pytest.approx(along, abs=1e-12 * scale)
        assert fy.sum() == pytest.approx(across, rel=1e-12, abs=1e-12 * scale)
        found = nodes[0] @ fy - nodes[1] @ fx
        assert found == pytest.approx(turn, rel=1e-9, abs=1e-12 * scale)


@pytest.mark.parametrize(
    ("load", "words"),
    [
        (EndLoad("a", "twist"), "no load 'twist'"),
        (EndLoad("a", "force", "top"), "no end 'top'"),
        (EndLoad("a", "force", "left", "z"), "no direction 'z'"),
    ],
)
def test_unknown_loads_are_refused(load, words):
    with pytest.raises(ModelError, match=words):
        lap_joint_structure(
            GEOMETRY, MATERIAL, MeshControl(11), horizontal_spring=1e5, ports=(load,)
        )


@pytest.fixture(scope="module")
def cantilever():
    """Slender, short overlap, clamped on the left: stuck it is a stepped beam."""
    steel, brass = Material(210e9, 0.3, 7850.0, "stress"), Material(100e9, 0.3, 8500.0, "stress")
    geometry = LapGeometry(0.4, 0.005, 0.02, 0.02, 0.0, 0.3, 0.004)
    s = lap_joint_structure(
        geometry,
        (steel, brass),
        MeshControl(contact_pairs=41),
        horizontal_spring=0.0,
        ends=("clamped", "free"),
        ports=(*PORTS, EndLoad("weight", "base", direction="y")),
    )
    model = Reducer(s, 30, (0.0, 0.0)).model(s.loads)
    basis = bonding(s.interface.relative, np.arange(2 * model.pairs))
    forces = basis.T @ np.column_stack([s.loads[name] for name in model.ports])
    stuck = forces.T @ spla.spsolve((basis.T @ s.stiffness @ basis).tocsc(), forces)
    return steel, brass, model, stuck


def stepped_beam(steel, brass, moment, other, n=20001):
    """``int M m / (E I) dx`` over the three parts of the bonded cantilever."""
    E1, E2, h1, h2 = steel.youngs_modulus, brass.youngs_modulus, 0.005, 0.004
    axis = (E2 * h2**2 - E1 * h1**2) / 2 / (E1 * h1 + E2 * h2)  # of the bonded section, from y = 0
    both = E1 * h1 * (h1**2 / 12 + (axis + h1 / 2) ** 2)
    both += E2 * h2 * (h2**2 / 12 + (h2 / 2 - axis) ** 2)
    parts = (
        (-0.38, -0.02, E1 * h1**3 / 12),
        (-0.02, 0.02, both),
        (0.02, 0.28, E2 * h2**3 / 12),
    )
    total = 0.0
    for a, b, EI in parts:
        x = np.linspace(a, b, n)
        total += trapezoid(moment(x) * other(x), x) / EI
    return total


def test_stuck_cantilever_is_a_stepped_beam(cantilever):
    """Deflection under a tip force, rotation under a tip moment, weight: Euler–Bernoulli, 1 %."""
    steel, brass, model, stuck = cantilever
    arm, one = (lambda x: 0.28 - x), (lambda x: np.ones_like(x))
    tip, bend, weight = (model.port(name) for name in ("tip", "bend", "weight"))

    def hanging(x):
        line1, line2 = 7850 * 0.005, 8500 * 0.004
        right = 0.28 - np.maximum(x, -0.02)
        left = np.maximum(0.02 - x, 0.0)
        # upper beam from -0.02 on, lower one up to 0.02, each beyond x, times their arms
        upper = np.where(x > -0.02, line2 * right**2 / 2, line2 * 0.3 * (0.13 - x))
        return -(upper + line1 * left**2 / 2)

    for port, moment, other in ((tip, arm, arm), (bend, one, one), (tip, arm, one)):
        conjugate = bend if other is one else tip
        expected = stepped_beam(steel, brass, moment, other)
        assert stuck[port, conjugate] == pytest.approx(expected, rel=0.01)
    expected = stepped_beam(steel, brass, hanging, arm)
    assert stuck[weight, tip] == pytest.approx(expected, rel=0.01)


def test_only_the_free_beam_moves_as_a_rigid_one(cantilever):
    _, _, model, _ = cantilever
    assert model.bodies.v.shape[1] == 3


def test_tip_force_opens_a_cantilever_at_its_arm(cantilever):
    """Contact resultant and clamp balance force and moment on the free beam: closed form.

    Force F at distance d from the middle: N = P ± F, and N e = ± F d with |e| <= L_o.
    Upwards N = P - F, hence F = P L_o / (d + L_o); downwards F = P L_o / (d - L_o).
    """
    _, _, model, _ = cantilever
    joint = prepare_joint(model, contact_law(model.pairs, 0.3), {"clamp": 1e5}, "tip")
    d, half = 0.28, 0.02
    expected = 1e5 * half / (d + half)
    assert opening_load(model, joint.prestress, "tip") == pytest.approx(expected, rel=1e-9)
    assert opening_load(model, joint.prestress, "bend") == pytest.approx(1e5 * half, rel=1e-9)


# --- friction along x


def test_friction_table_of_one_value_is_that_value():
    one = assemble(described())
    other = assemble(described(contact={"friction": [[-0.04, 0.3], [0.01, 0.3]], "pairs": 41}))
    assert np.array_equal(one.prepared.law.friction, other.prepared.law.friction)
    assert other.joint.friction == pytest.approx(0.3, rel=1e-12)


def test_every_pair_slips_at_its_own_friction():
    table = [["-40 mm", 0.05], ["0 mm", 0.1], ["40 mm", 0.6]]
    a = assemble(described(contact={"friction": table, "pairs": 41}))
    x = a.model.position
    expected = np.where(x < 0, 0.1 + 0.05 * x / 0.04, 0.1 + 0.5 * x / 0.04)
    assert a.prepared.law.friction == pytest.approx(expected, rel=1e-12)
    cycle = quasi_static_cycle(a.prepared, "moment", 0.6 * a.opening_moment, steps=80)
    pull, press = np.abs(tangential(cycle.r)), normal(cycle.r)
    excess = pull - expected * press
    assert excess.max() < 1e-7 * press.max()
    slips = (np.abs(excess) < 1e-6 * press.max()) & (press > 1e-3 * press.max())
    ratio = (pull / np.maximum(press, 1e-300))[slips]
    assert np.ptp(ratio) > 0.05  # pairs slip at different coefficients

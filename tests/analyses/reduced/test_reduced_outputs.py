"""Outputs of reduced models against harmonic balance, time integration, and linear solutions."""

from __future__ import annotations

import numpy as np
import pytest
from conftest import description

import microslip
from microslip.analyses.prepared.direct import direct_motion, stuck_motion
from microslip.analyses.reduced.outputs import motion_per_amplitude, response_motion
from microslip.analyses.reduced.refined import load_offset, refined_table
from microslip.analyses.reduced.response import forced_response
from microslip.analyses.reduced.table import equivalent_table
from microslip.analyses.reduced.two_mode import two_mode_model
from microslip.analyses.statics.cycle import quasi_static_cycle
from microslip.analyses.statics.held import hold_mode
from microslip.analyses.time.readings import phases
from microslip.describe.reading import parse_joint
from microslip.errors import MicroslipError
from microslip.numerics.fourier import harmonic, without_drift

BEYOND = 0.01
"""What an output may miss beyond the modal amplitude that it follows from: that the other modes have
their inertia at one frequency."""

OUTPUTS = [
    {"name": "middle"},
    {"name": "end", "quantity": "rotation", "x": "right end"},
    {"name": "beside", "x": "30 mm", "beam": "upper", "side": "top"},
]

OTHER = {
    "beams": {"length": "128 mm", "thickness": "4.1 mm", "overlap_half_length": "42 mm"},
    "material": {"youngs_modulus": "110 GPa", "poissons_ratio": 0.35, "density": 4430},
    "contact": {"friction": 0.19, "pairs": 41},
    "clamp": {"force": "43 kN/m", "half_length": "20 mm"},
    "support": {"horizontal_spring": 1.9e5},
}
LONG = {
    "beams": {"length": "600 mm", "thickness": "6 mm", "overlap_half_length": "30 mm"},
    "material": {"youngs_modulus": "210 GPa", "poissons_ratio": 0.3, "density": 7850},
    "contact": {"friction": 0.4, "pairs": 41},
    "clamp": {"force": "300 kN/m", "half_length": "15 mm"},
    "damping": {"beta": "2 us"},
}


def prepared(**sections):
    return microslip.prepare(
        parse_joint({**description(41, 40), **sections, "output": OUTPUTS, "analysis": {}})
    )


@pytest.fixture(scope="module")
def joint():
    return prepared()


@pytest.fixture(scope="module")
def refined(joint):
    return refined_model(joint)


def refined_model(joint):
    mode = joint.principal()
    held = hold_mode(joint, 0.5 * (mode.sliding_omega + mode.stuck_omega), upper=2)
    opening = microslip.opening_load(joint, mode.port) / mode.sliding_omega**2
    table, _ = refined_table(held, 1e-4 * opening, 0.5 * opening, 32)
    return two_mode_model(joint, "refined", load_offset(held, 1e-4 * opening)), table


def load_to_reach(share, joint, model, table):
    """End moment whose resonance reaches a share of the amplitude that opens the joint, and where."""
    mode = joint.principal()
    band = np.linspace(0.95 * mode.sliding_frequency, 1.03 * mode.stuck_frequency, 801)
    low, high = 1e-9, 1e-1
    for _ in range(30):
        load = microslip.opening_load(joint) * np.sqrt(low * high)
        found = forced_response(model, table, band, load, variant="refined")
        small = found.flag.max() == 0 and found.peak_amplitude < 2 * share * table.amplitude[-1]
        low, high = (np.sqrt(low * high), high) if small else (low, np.sqrt(low * high))
    return load, found.peak_frequency


def test_without_friction_it_is_the_linear_joint(joint):
    """Harmonic balance of a joint that only slides knows nothing of modes of the sliding state."""
    free = joint.with_friction(0.0)
    frequency = np.array([120.0, 160.0, 172.0, 190.0, 260.0])
    linear = two_mode_model(free, "consistent")
    load = 1e-3
    response = forced_response(linear, None, frequency, load)
    found = response_motion(response, linear, None, free)
    solved = microslip.harmonic_response(free, load, frequency, harmonics=1)
    assert len(solved.points) == len(frequency)
    for point in solved.points:
        k = int(np.argmin(np.abs(frequency - point.frequency)))
        for name in ("output middle", "output end", "output beside", "moment"):
            port = joint.model.port(name)
            # the mode of the structure and that of its model differ by the reduction
            assert found[k, port] == pytest.approx(point.output[1, port], rel=2e-4)


@pytest.mark.parametrize(
    ("sections", "share"),
    [
        ({}, 0.02),
        pytest.param({}, 0.1, marks=pytest.mark.validate),
        (OTHER, 0.02),
        pytest.param(LONG, 0.05, marks=pytest.mark.validate),
    ],
    ids=["reference", "reference further", "thin", "long"],
)
def test_outputs_are_as_good_as_the_amplitude(sections, share):
    """Refined model and harmonic balance at several frequencies about the resonance."""
    joint = prepared(**sections)
    model, table = refined_model(joint)
    load, peak = load_to_reach(share, joint, model, table)
    frequency = np.array([0.9, 1.01, 1.05, 1.1]) * peak
    response = forced_response(model, table, frequency, load, variant="refined")
    motion = response_motion(response, model, table, joint)
    solved = microslip.harmonic_response(joint, load, frequency, harmonics=5)
    assert len(solved.points) == len(frequency)
    for point in solved.points:  # branch by branch
        k = int(np.argmin(np.abs(frequency - point.frequency)))
        own = response.amplitude[k] / point.amplitude
        for name in ("output middle", "output end", "output beside"):
            port = joint.model.port(name)
            ratio = motion[k, port] / point.output[1, port]
            assert abs(ratio / own - 1) < BEYOND


def test_outputs_against_the_time_domain(joint, refined):
    model, table = refined
    load, peak = load_to_reach(0.1, joint, model, table)
    frequency = 1.02 * peak
    steady = microslip.steady_state(joint, frequency, load, steps=240)
    theta = phases(steady)
    exact = harmonic(without_drift(steady.cycle.output, theta), theta)
    # same amplitude on both sides, so that what is compared is the motion and not the amplitude
    per_amplitude = motion_per_amplitude(table, np.array([abs(steady.amplitude)]))[0]
    for name in ("output middle", "output beside"):
        port = joint.model.port(name)
        assert exact[port] / steady.amplitude == pytest.approx(per_amplitude[port], rel=BEYOND)


def test_a_load_that_sticks_moves_the_stuck_joint(joint, refined):
    """At small load and low frequency: the static solution with every touching pair bonded."""
    model, table = refined
    load = 1e-7 * microslip.opening_load(joint)
    low = forced_response(model, table, np.array([2.0, 3.0]), load, variant="refined")
    found = response_motion(low, model, table, joint)[0] / load
    bonded = stuck_motion(joint, joint.drive)
    for name in ("output middle", "output end"):
        port = joint.model.port(name)
        # the inertia of the reference frequency is in the table: a share of (omega_0/omega_2)²
        assert found[port] == pytest.approx(bonded[port], rel=0.02)


def test_static_cycles_of_both_drives_move_alike_once_the_moments_own_part_is_out(joint):
    """Per amplitude of the mode, at an amplitude that sticks, whatever drives it."""
    found = []
    for port in ("moment", joint.principal().port):
        size = 1e-5 * microslip.opening_load(joint, port)
        cycles = [quasi_static_cycle(joint, port, size * k, steps=40) for k in (1, 2)]
        found.append(equivalent_table(cycles, joint, port).motion[0])
    k = joint.model.port("output middle")
    assert found[0][k] == pytest.approx(found[1][k], rel=0.02)


def test_everything_scales_with_the_preload(joint):
    twice = joint.with_preload({"clamp": 2e6})
    size = 0.05 * microslip.opening_load(joint)
    one = quasi_static_cycle(joint, "moment", size, steps=60)
    two = quasi_static_cycle(twice, "moment", 2 * size, steps=60)
    ports = [joint.model.port(name) for name in ("output middle", "output end", "output beside")]
    expected = 2 * one.output[:, ports]
    assert two.output[:, ports] == pytest.approx(expected, rel=1e-6, abs=1e-9 * expected.max())


def test_nothing_but_the_mode_follows_its_own_inertia_load(joint):
    k = joint.model.port("output middle")
    own = joint.mode.load_on_sliding["output middle"] / joint.mode.sliding_omega**2
    direct = direct_motion(joint, joint.mode.port, np.zeros(1))[0, k]
    assert abs(direct) < 1e-6 * abs(own)


def test_a_slender_joint_turns_and_deflects_as_beams_do():
    """Stuck, the overlap is a beam of twice the height: curvature an eighth of that outside."""
    sections = {
        "beams": {"length": "1.2 m", "thickness": "8 mm", "overlap_half_length": "30 mm"},
        "clamp": {"force": "1 MN/m", "half_length": "30 mm"},
        "support": {"horizontal_spring": 1e2},
    }
    joint = prepared(**sections)
    found = stuck_motion(joint, "moment")
    stiffness = 70e9 / (1 - 0.3**2) * 0.008**3 / 12
    half, overlap = 1.2 - 0.03, 0.03
    turn = (half - overlap + overlap / 8) / stiffness
    assert found[joint.model.port("output end")] == pytest.approx(turn, rel=0.01)
    inside = half * overlap - overlap**2 / 2
    drop = (half**2 / 2 - inside * (1 - 1 / 8)) / stiffness
    assert found[joint.model.port("output middle")] == pytest.approx(-drop, rel=0.01)


def test_backbones_carry_outputs_in_their_modes_proportion(joint):
    """Small: the stuck mode's own shape, from the structure."""
    curve = microslip.backbone(joint, count=3, smallest=1e-6, largest=1e-4, method="prescribed")
    k = joint.model.port("output middle")
    point = curve.points[0]
    mode = joint.mode
    shape = mode.load_on_stuck["output middle"] / mode.overlap  # per unit of the sliding coordinate
    assert point.motion[k] / point.amplitude == pytest.approx(shape, rel=0.01)
    static = microslip.backbone(joint, count=3, method="quasi_static")
    harmonics = microslip.backbone(joint, count=3, method="harmonic", harmonics=3)
    for one, other in zip(static.points[:2], harmonics.points[:2], strict=True):
        ratio = one.motion[k] / one.amplitude, other.motion[k] / other.amplitude
        assert ratio[0] == pytest.approx(ratio[1], rel=0.05)


def test_a_table_without_outputs_says_so(refined):
    _, table = refined
    bare = type(table)(**{**table.__dict__, "motion": None})
    with pytest.raises(MicroslipError, match="holds no outputs"):
        motion_per_amplitude(bare, np.array([1.0]))


def test_bodies_that_move_together_have_their_inertia(joint):
    """The axial motion of an end: rigid motion of both beams on weak springs, far above resonance.

    Against harmonic balance near the reference frequency, at an amplitude that sticks.
    """
    document = {**description(41, 40), "output": [{"name": "a", "quantity": "axial displacement"}]}
    document["output"][0]["x"] = "right end"
    document["analysis"] = {}
    axial = microslip.prepare(parse_joint(document))
    model, table = refined_model(axial)
    load = 1e-5 * microslip.opening_load(axial)
    frequency = np.array([178.0, 182.0])
    response = forced_response(model, table, frequency, load, variant="refined")
    motion = response_motion(response, model, table, axial)
    k = axial.model.port("output a")
    solved = microslip.harmonic_response(axial, load, frequency, harmonics=3)
    assert len(solved.points) == len(frequency)
    for point in solved.points:
        found = motion[int(np.argmin(np.abs(frequency - point.frequency)))]
        assert found[k] == pytest.approx(point.output[1, k], rel=0.02)

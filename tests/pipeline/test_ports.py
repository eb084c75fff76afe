"""Ports that the user names: beam theory, reciprocity, statics, and every degree of freedom."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
import scipy.sparse.linalg as spla

import microslip
from microslip import parse_joint, run
from microslip.analyses.prepared.direct import stuck_motion
from microslip.analyses.prepared.scales import load_scale
from microslip.analyses.statics.cycle import quasi_static_cycle
from microslip.describe.beam import bending_stiffnesses
from microslip.errors import InputError
from microslip.model.modes import bonding
from microslip.pipeline.prepare import assemble
from microslip.results.dataset import dataset
from microslip.results.summary import summary

TIP = {"name": "tip", "kind": "force", "at": "right"}
TIP_MOTION = {"name": "tip", "quantity": "deflection", "x": "right end"}
CANTILEVER = {"left": "clamped", "right": "free"}
STOCKY = {
    "beams": {"length": 0.2, "thickness": 0.01, "overlap_half_length": 0.03},
    "clamp": {"force": "1 MN/m", "half_length": 0.02},
    "contact": {"friction": 0.3, "pairs": 31},
}
LENGTH, THICKNESS, HALF = 0.4, 0.005, 0.025


def document(**sections: Any) -> dict[str, Any]:
    """Two slender beams clamped all over a short overlap, the left one built in."""
    return {
        "beams": {"length": LENGTH, "thickness": THICKNESS, "overlap_half_length": HALF},
        "material": {"youngs_modulus": "70 GPa", "poissons_ratio": 0.3, "density": 2700},
        "contact": {"friction": 2.0, "pairs": 41},
        "clamp": {"force": "1 MN/m", "half_length": HALF},
        "support": CANTILEVER,
        "damping": {"beta": "5 us"},
        "output": [TIP_MOTION],
        "port": [TIP],
        "analysis": {},
        **sections,
    }


def compliance(joint: microslip.LapJoint, moment: Any) -> float:
    """Deflection of the tip by the unit-load theorem; the overlap is one beam of twice the height.

    Parameters
    ----------
    joint : LapJoint
    moment : callable
        Bending moment against the distance from the tip.
    """
    free = LENGTH - 2 * HALF
    stiffness = bending_stiffnesses(joint)[0]
    total = 0.0
    for start, stop, factor in ((0, free, 1), (free, LENGTH, 8), (LENGTH, LENGTH + free, 1)):
        s = np.linspace(start, stop, 4001)
        total += np.trapezoid(moment(s) * s, s) / (factor * stiffness)
    return total


def own_weight(joint: microslip.LapJoint, s: np.ndarray) -> np.ndarray:
    """Bending moment at a distance from the tip under 1 m/s² on all masses."""
    free = LENGTH - 2 * HALF
    line = joint.material.densities[0] * THICKNESS
    doubled = np.clip(s - free, 0, 2 * HALF)
    return line * (s**2 / 2 + doubled * (s - free - doubled / 2))


def test_a_stuck_slender_joint_bends_as_a_beam_under_a_force_at_its_tip():
    cycles = {"force": [0.1], "steps": 40}
    joint = parse_joint(document(load={"port": "tip", "force": 0.1}, analysis={"cycle": cycles}))
    found = summary(run(joint))
    (row,) = found["cycles"]
    assert row["force_n_per_m"] == 0.1
    assert "moment_over_clamp_force_length" not in row
    expected = 0.1 * compliance(joint, lambda s: s)
    assert row["outputs"]["tip_mm"] == pytest.approx(1e3 * expected, rel=0.01)


def test_a_stuck_slender_joint_bends_as_a_beam_under_the_inertia_of_its_base():
    """The base accelerates upward, what hangs on it stays behind: -M 1 a."""
    base = {"name": "shaker", "kind": "base"}
    cycles = {"acceleration": [0.01], "steps": 40}
    load = {"port": "shaker", "acceleration": 0.01}
    joint = parse_joint(document(port=[base], load=load, analysis={"cycle": cycles}))
    found = run(joint)
    (cycle,) = found.cycles["load"]
    deflection = cycle.output[:, found.model.port("output tip")]
    expected = 0.01 * compliance(joint, lambda s: own_weight(joint, s))
    top = int(np.argmax(cycle.load))
    assert deflection[top] == pytest.approx(-expected, rel=0.01)
    (row,) = summary(found)["cycles"]
    assert row["acceleration_m_per_s2"] == 0.01


def test_at_low_frequency_a_base_moves_the_joint_as_its_inertia_does_at_rest():
    """To the inertia of the vibration, (f/f_1)² of it, and of the beam's slide, which is as at f_1."""
    base = {"name": "shaker", "kind": "base"}
    first = assemble(parse_joint(document(**STOCKY))).mode.stuck_frequency
    band = {"from": first / 60, "to": first / 50, "count": 3}
    analysis = {"cycle": {"acceleration": [0.01], "steps": 40}, "response": band}
    load = {"port": "shaker", "acceleration": 0.01}
    found = run(parse_joint(document(**STOCKY, port=[base], load=load, analysis=analysis)))
    (cycle,) = found.cycles["load"]
    static = np.abs(cycle.output[:, found.model.port("output tip")]).max()
    response = found.response.sel(acceleration=0.01)
    dynamic = response.outputs["tip"]
    np.testing.assert_allclose(np.abs(dynamic), static, rtol=5e-3)
    np.testing.assert_allclose(np.angle(-dynamic), 0, atol=1e-2)


def test_two_ports_are_reciprocal():
    """What a force at one end does to the rotation of the other is what a moment there does to the
    deflection of the first: Maxwell and Betti."""
    ports = [
        {"name": "push", "kind": "force", "at": "right", "direction": "x"},
        {"name": "lever", "kind": "moment", "at": "right"},
        {"name": "shaker", "kind": "base", "direction": "x"},
        TIP,
    ]
    joint = microslip.prepare(parse_joint(document(port=ports)))
    names = [port["name"] for port in ports]
    moved = {name: stuck_motion(joint, name) for name in names}
    work = np.array([[moved[a][joint.model.port(b)] for b in names] for a in names])
    size = np.sqrt(np.diag(work))
    assert (size > 0).all()
    np.testing.assert_allclose(
        work / np.outer(size, size), (work / np.outer(size, size)).T, atol=1e-9
    )
    assert abs(work[0, 1]) > 0.01 * size[0] * size[1]


def test_a_named_pair_of_end_moments_is_the_pair_that_needs_no_name():
    # assembled twice, with other columns: as far as the factorisation is good
    pinned = {"support": {"horizontal_spring": 1e5}, "contact": {"friction": 0.3, "pairs": 21}}
    analysis = {
        "cycle": {"moment": [20.0, 200.0], "steps": 60},
        "response": {"count": 11},
        "reduced": {"amplitudes": 8, "steps": 60},
        "harmonic": {"frequencies": [30, 31], "harmonics": 1},
    }
    usual = run(parse_joint(document(**pinned, port=[], load={"moment": 1.0}, analysis=analysis)))
    ends = {"name": "ends", "kind": "moment", "at": "both"}
    load = {"port": "ends", "moment": 1.0}
    named = run(parse_joint(document(**pinned, port=[ends], load=load, analysis=analysis)))
    assert named.prepared.drive == "ends"
    assert named.assembly.opening_moment == pytest.approx(usual.assembly.opening_moment, rel=1e-9)
    for one, other in zip(usual.cycles["moment"], named.cycles["moment"], strict=True):
        assert other.dissipated == pytest.approx(one.dissipated, rel=1e-9)
        port = usual.model.port("moment"), named.model.port("ends")
        here, there = other.output[:, port[1]], one.output[:, port[0]]
        np.testing.assert_allclose(here, there, rtol=1e-9, atol=1e-9 * np.abs(there).max())
    one, other = usual.response.sel(moment=1.0), named.response.sel(moment=1.0)
    np.testing.assert_allclose(other.frequency, one.frequency, rtol=1e-9)
    np.testing.assert_allclose(other.outputs["tip"], one.outputs["tip"], rtol=1e-9)
    for one, other in zip(usual.harmonic[0].points, named.harmonic[0].points, strict=True):
        assert other.amplitude == pytest.approx(one.amplitude, rel=1e-9)
    assert summary(named)["response"][0]["moment_n"] == 1.0


def test_without_friction_the_tip_answers_as_every_degree_of_freedom_does():
    """Reduced model and harmonic balance against the matrices themselves, normal motion bonded."""
    sections = STOCKY | {"contact": {"friction": 0.0, "pairs": 31}}
    damping = {"beta": "20 us"}
    first = assemble(parse_joint(document(**sections))).mode.sliding_frequency
    frequency = [0.9 * first, first, 1.1 * first]
    analysis = {
        "response": {"from": frequency[0], "to": frequency[2], "count": 3},
        "harmonic": {"frequencies": frequency, "harmonics": 1},
    }
    load = {"port": "tip", "force": 0.01}
    described = document(**sections, damping=damping, load=load, analysis=analysis)
    found = run(parse_joint(described))
    s, joint = found.structure, found.joint
    basis = bonding(s.interface.relative, found.prestress.bonded(1))
    beta = joint.damping.beta
    expected = []
    for f in frequency:
        w = 2 * np.pi * f
        stiff = (basis.T @ ((1 + 1j * w * beta) * s.stiffness - w**2 * s.mass) @ basis).tocsc()
        moved = spla.spsolve(stiff, basis.T @ s.loads["tip"].astype(complex))
        expected.append(s.loads["output tip"] @ (basis @ moved))
    response = found.response.sel(force=0.01)
    np.testing.assert_allclose(response.frequency, frequency, rtol=1e-12)
    for got, exact in zip(response.outputs["tip"] / 0.01, expected, strict=True):
        assert abs(got - exact) < 0.005 * abs(exact)
    port = found.model.port("output tip")
    for point, exact in zip(found.harmonic.sel(force=0.01).points, expected, strict=True):
        assert abs(point.output[1, port] / 0.01 - exact) < 0.005 * abs(exact)


def test_a_force_at_the_tip_opens_the_joint_where_the_contact_is_pulled_to_its_edge():
    """Of the upper beam: (P - F) L_o = F (L - L_o), the tip pulled away from the lower one."""
    joint = parse_joint(document(load={"port": "tip", "force": 1.0}))
    assert assemble(joint).opening_moment == pytest.approx(1e6 * HALF / LENGTH, rel=1e-9)
    cycles = {"force": [1e6], "steps": 20}
    with pytest.raises(InputError, match=r"load: F = 1e\+05 N/m opens the joint.* 6.25e\+04 N/m"):
        assemble(parse_joint(document(load={"port": "tip", "force": 1e5})))
    wide = run(
        parse_joint(document(load={"port": "tip", "force": 1.0}, analysis={"cycle": cycles}))
    )
    (failure,) = wide.failures
    assert "F = 1e+06 N/m" in failure.where


def test_a_load_that_opens_nothing_has_a_scale():
    """Both ends built in: each beam stands by itself. The stuck joint's reactions change in proportion to the
    load, by as much as the largest of the preload under its scale."""
    sides = {"left": "clamped", "right": "clamped"}
    port = {"name": "shaker", "kind": "base"}
    load = {"port": "shaker", "acceleration": 1.0}
    asked = {"cycle": {"drives": ["load", "mode"], "steps": 20}}
    found = run(parse_joint(document(support=sides, port=port, load=load, analysis=asked)))
    scale = load_scale(found.prepared, "shaker")
    assert found.moments["load"][-1] == pytest.approx(0.85 * scale, rel=1e-12)
    stuck = quasi_static_cycle(found.prepared.with_friction(10.0), "shaker", 1e-5 * scale, steps=20)
    change = np.abs(stuck.r - found.prestress.solution.r).max()
    assert change == pytest.approx(1e-5 * found.prestress.largest_reaction, rel=1e-3)
    assert summary(found)["model"]["opening_acceleration_m_per_s2"] is None


def test_results_are_named_after_the_load():
    analysis = {
        "cycle": {"count": 4, "steps": 40, "drives": ["load", "mode"]},
        "response": {"count": 11},
        "reduced": {"amplitudes": 8, "steps": 60},
        "time": {"frequencies": [20.0], "steps": 60, "max_cycles": 3},
        "history": [{"signal": "sine", "frequency": 20.0, "cycles": 1, "force": 0.5, "steps": 30}],
    }
    load = {"port": "tip", "force": 0.5}
    found = run(parse_joint(document(**STOCKY, load=load, analysis=analysis)))
    tree = dataset(found)
    assert tree["response"]["force"].attrs["units"] == "N/m"
    assert tree["response"]["output_per_force"].attrs["units"] == "output_unit / (N/m)"
    assert tree["cycles_load"]["load"].attrs["units"] == "N/m"
    assert tree["cycles_load"]["port_tip"].attrs["units"] == "m"
    assert tree["time_domain"]["force"].values.tolist() == [0.5]
    assert tree["history/sine"]["load"].attrs["units"] == "N/m"
    assert tree["model"]["opening_force"].attrs["units"] == "N/m"
    assert found.response.sel(force=0.5) is found.responses[0]
    assert not any("moment" in name for group in tree.subtree for name in group.variables)
    assert not any("M = " in str(failure) for failure in found.failures)
    rows = summary(found)
    for key in ("cycles", "response", "time_domain", "history"):
        assert all("force_n_per_m" in row for row in rows[key])
        assert not any("moment" in name for row in rows[key] for name in row)
    cycle, mode = found.cycles["load"][-1], found.cycles["mode"][-1]
    assert cycle.amplitude == pytest.approx(0.85 * found.assembly.opening_moment)
    assert mode.port == "sliding"

"""Beams with free ends: what friction alone holds, and modes that only move them on weak springs."""

from __future__ import annotations

import numpy as np
import pytest

from microslip.analyses.prepared.prestress import slides_from
from microslip.analyses.prepared.scales import load_scale
from microslip.analyses.statics.cycle import quasi_static_cycle
from microslip.describe.reading import parse_joint
from microslip.errors import ContactError
from microslip.pipeline.estimate import estimate
from microslip.pipeline.prepare import assemble
from microslip.pipeline.run import run
from microslip.results.summary import summary

CLAMP, FRICTION = 8e5, 0.3


def beams(left, right, *, pull=False, spring=None, **analysis):
    """Two beams of 320 mm by 10 mm on an overlap of 100 mm."""
    support = {"left": left, "right": right}
    if spring is not None:
        support["horizontal_spring"] = spring
    given = {
        "beams": {"length": 0.32, "thickness": 0.01, "overlap_half_length": 0.05},
        "material": {"youngs_modulus": 210e9, "poissons_ratio": 0.3, "density": 7850.0},
        "contact": {"friction": FRICTION, "pairs": 41},
        "clamp": {"force": CLAMP, "half_length": 0.03},
        "damping": {"beta": 1e-6},
        "support": support,
        "load": {"moment": [40.0]},
        "analysis": analysis or {"response": {}},
    }
    if pull:
        given["port"] = [{"name": "pull", "kind": "force", "at": "right", "direction": "x"}]
        given["load"] = {"port": "pull", "force": [1e5]}
    return parse_joint(given)


def test_a_beam_with_a_free_end_is_held_along_by_coulombs_force():
    joint = assemble(beams("clamped", "free", pull=True, cycle={"force": [1e5]})).prepared
    found = slides_from(joint.model, joint.prestress, "pull", FRICTION)
    assert found == pytest.approx(FRICTION * CLAMP, rel=1e-6)
    assert load_scale(joint, "pull") == found
    below = quasi_static_cycle(joint, "pull", 0.99 * found, steps=80)
    assert below.residual.max() < 1e-9
    for beyond in (1.01, 3.0):
        with pytest.raises(ContactError, match="slides bodies away that friction alone holds"):
            quasi_static_cycle(joint, "pull", beyond * found, steps=80)


def test_a_spring_that_holds_it_lets_it_slip_by_what_friction_does_not_carry():
    """Coulomb's force is passed on, the rest is carried by the spring: the loop is closed."""
    stiffness, load = 1e7, 2.6e5
    joint = beams("clamped", "pinned", pull=True, spring=stiffness, cycle={"force": [load]})
    joint = assemble(joint).prepared
    assert slides_from(joint.model, joint.prestress, "pull", FRICTION) == np.inf
    cycle = quasi_static_cycle(joint, "pull", load, steps=160)
    slip = 2 * (load - FRICTION * CLAMP) / stiffness
    # elastic beams give way by a share of that before they slip
    assert cycle.dissipated == pytest.approx(2 * FRICTION * CLAMP * slip, rel=0.1)


def test_what_slides_it_is_in_the_summary():
    done = run(beams("clamped", "free", pull=True, cycle={"force": [1e5, 2.5e5]}))
    assert len(done.failures) == 1
    model = summary(done)["model"]
    assert model["slides_from_force_n_per_m"] == pytest.approx(FRICTION * CLAMP, rel=1e-6)
    held = run(beams("pinned", "pinned", cycle={"moment": [10.0]}))
    assert not any(key.startswith("slides_from") for key in summary(held)["model"])


@pytest.mark.parametrize(
    ("left", "right"),
    [("free", "free"), ("pinned", "free"), ("free", "pinned"), ("clamped", "free")],
)
def test_the_resonance_is_of_bending_not_of_weak_springs(left, right):
    """Beam theory and finite elements look for the same mode, each in its own way."""
    joint = beams(left, right)
    mode, said = assemble(joint).mode, estimate(joint)
    assert said.sliding_frequency == pytest.approx(mode.sliding_frequency, rel=0.02)
    assert said.stuck_frequency == pytest.approx(mode.stuck_frequency, rel=0.02)

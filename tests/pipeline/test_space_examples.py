"""The examples in space: equilibrium and opening by statics, beam theory, the plane joint again."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from conftest import ROOT

from microslip import load_joint
from microslip.analyses.prepared.prestress import opening_load, sliding_load
from microslip.analyses.statics.cycle import quasi_static_cycle
from microslip.contact.pairs import normal, tangential_vectors
from microslip.pipeline.prepare import assemble

EXAMPLES = ROOT / "examples"


@pytest.fixture(scope="module")
def beam():
    return assemble(load_joint(EXAMPLES / "half_lap_beam.toml"))


def test_bolts_press_the_laps_and_nothing_else(beam):
    """Three bolts of 12 kN; a flat interface has no tangential force without friction."""
    r = beam.prestress.solution.r
    assert normal(r, 3).sum() == pytest.approx(36e3, rel=1e-8)
    assert np.abs(tangential_vectors(r)).max() < 1e-8 * np.abs(r).max()


def test_the_beam_opens_where_statics_says(beam):
    """It turns about the end of the laps, 60 mm from the middle of the bolts: M = 36 kN · 60 mm."""
    assert beam.opening_moment == pytest.approx(36e3 * 0.060, rel=1e-6)


def test_what_opens_the_beam_is_not_a_matter_of_rounding(beam):
    """Tangential reactions of a flat interface do no work on motions across it, whatever is left of them."""
    bodies = beam.model.bodies
    noise = np.random.default_rng(1).standard_normal(bodies.v.shape)
    shaken = replace(bodies, v=bodies.v + 1e-14 * np.abs(bodies.v).max() * noise)
    model = replace(beam.model, bodies=shaken)
    found = opening_load(model, beam.prestress, "bending")
    assert found == pytest.approx(beam.opening_moment, rel=1e-6)


@pytest.mark.parametrize(("port", "limit"), [("bending", 36e3 * 0.060), ("bolt_2", 36e3)])
def test_loads_across_the_interface_of_a_free_beam_open_it_and_do_not_slide_it(beam, port, limit):
    """Moments about the end of the laps; the middle bolt turned to pull as hard as all three press."""
    friction = beam.prepared.law.friction
    for held in (opening_load, sliding_load):
        found = held(beam.model, beam.prestress, port, friction)
        assert found == pytest.approx(limit, rel=1e-6)


def test_the_free_beam_vibrates_below_a_solid_one(beam):
    """22.37 sqrt(EI/(rho A L⁴)) of a beam without laps; motions without stiffness are not taken for it."""
    solid = 22.3733 / (2 * np.pi) * np.sqrt(210e9 * 0.0254**2 / (12 * 7850)) / 0.72**2
    mode = beam.mode
    assert 0.3 * solid < mode.sliding_frequency < mode.stuck_frequency < solid


def test_half_cycles_of_the_beam_mirror_each_other(beam):
    """A half turn about y takes the beam onto itself and its moments into opposite ones."""
    cycle = quasi_static_cycle(beam.prepared, "bending", 100.0, steps=32, max_cycles=6)
    turn = cycle.output[:, beam.model.port("bending")]
    # only the choice of the surface with the pairs is not symmetric
    assert np.abs(turn[:17] + turn[16:]).max() < 0.01 * np.abs(turn).max()


@pytest.fixture(scope="module")
def plane_and_extruded():
    plane = load_joint(EXAMPLES / "lap_joint.toml")
    contact = plane.contact.model_copy(update={"pairs": 49})
    plane = plane.model_copy(update={"contact": contact})
    return assemble(plane), assemble(load_joint(EXAMPLES / "extruded_joint.toml"))


def test_extruded_joint_has_the_frequencies_of_the_plane_one(plane_and_extruded):
    plane, extruded = plane_and_extruded
    for name in ("sliding_frequency", "stuck_frequency"):
        assert getattr(extruded.mode, name) == pytest.approx(getattr(plane.mode, name), rel=0.005)
    assert extruded.opening_moment == pytest.approx(plane.opening_moment, rel=1e-6)


@pytest.mark.parametrize("share", [0.05, pytest.param(0.4, marks=pytest.mark.validate)])
def test_extruded_joint_has_the_cycles_of_the_plane_one(plane_and_extruded, share):
    plane, extruded = (
        quasi_static_cycle(each.prepared, "moment", share * each.opening_moment, steps=100)
        for each in plane_and_extruded
    )
    assert extruded.dissipated == pytest.approx(plane.dissipated, rel=0.01)


@pytest.mark.parametrize(
    ("name", "opening"),
    [
        ("bolted_plates", 24e3 * 20 / 120),
        pytest.param("flange_sector", None, marks=pytest.mark.validate),
    ],
)
def test_bolts_press_the_interface(name, opening):
    """What the bolts press is what the contact carries; the plate turns about the far end of the lap."""
    found = assemble(load_joint(EXAMPLES / f"{name}.toml"))
    held = sum(each.force for each in found.joint.preload)
    assert normal(found.prestress.solution.r, 3).sum() == pytest.approx(held, rel=1e-6)
    if opening is not None:
        assert found.opening_moment == pytest.approx(opening, rel=1e-6)

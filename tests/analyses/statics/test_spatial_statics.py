"""Spatial prestress, cycles and load paths: a planar joint turned in its plane is the same joint."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from spatial_twin import lift, spatial_joint

from microslip.analyses.prepared.joint import PreparedJoint, flexibility_of
from microslip.analyses.prepared.prestress import prestress
from microslip.analyses.statics.cycle import quasi_static_cycle
from microslip.analyses.statics.held import hold_mode
from microslip.analyses.statics.loading import load_path
from microslip.analyses.statics.prescribed import prescribed_cycle
from microslip.contact.law import contact_law
from microslip.contact.pairs import tangential_vectors

ANGLE = 0.7
ALIKE = 1e-9
"""Of the largest; both solve to 1e-10 of the largest reaction."""


@pytest.fixture(scope="module")
def planar(small_reference) -> PreparedJoint:
    """Without the half turn, which only planar joints use."""
    joint = small_reference.joint
    return replace(joint, model=replace(joint.model, image=None))


@pytest.fixture(scope="module")
def spatial(planar) -> PreparedJoint:
    return spatial_joint(planar, ANGLE)


def close(found, expected, size=None):
    size = np.abs(expected).max() if size is None else size
    assert np.abs(np.asarray(found) - expected).max() <= ALIKE * size


def test_prestress_is_that_of_the_planar_joint(planar, spatial):
    close(spatial.prestress.pressure, planar.prestress.pressure)
    assert np.array_equal(spatial.prestress.touching, planar.prestress.touching)


@pytest.mark.parametrize("share", [0.3, 0.8])
def test_cycle_is_that_of_the_planar_joint(planar, spatial, share, small_reference):
    moment = share * 0.0014 * small_reference.moment
    one = quasi_static_cycle(planar, "moment", moment, steps=60)
    other = quasi_static_cycle(spatial, "moment", moment, steps=60)
    E = lift(planar.model.pairs, ANGLE)
    close(other.r, one.r @ E.T)
    close(other.output, one.output)
    assert other.dissipated == pytest.approx(one.dissipated, rel=1e-8)
    taken = other.dissipated + other.normal_work
    assert other.external_work == pytest.approx(taken, rel=1e-7)
    way = np.array([np.cos(ANGLE), np.sin(ANGLE)])
    close(other.traction, one.traction[..., None] * way)
    close(other.slip, one.slip[..., None] * way)
    close(other.gap, one.gap, np.abs(one.v).max())
    assert other.fallbacks.steps == other.cycles * 60
    assert other.residual.max() <= 1e-9


def test_behind_a_compliance_as_well(planar):
    give = np.tile([1e-13, 2e-13], planar.model.pairs) / np.repeat(planar.model.area, 2)
    law = contact_law(planar.model.pairs, 0.3, give)
    model = planar.model
    flexibility = flexibility_of(model, law)
    start = prestress(model, flexibility, planar.prestress.preload)
    flat = replace(planar, law=law, flexibility=flexibility, prestress=start)
    one = quasi_static_cycle(flat, "moment", 200.0, steps=40)
    other = quasi_static_cycle(spatial_joint(flat, ANGLE), "moment", 200.0, steps=40)
    close(other.r, one.r @ lift(model.pairs, ANGLE).T)


def test_prescribed_cycle_is_that_of_the_planar_joint(planar, spatial):
    mode = planar.principal()
    omega = 0.5 * (mode.sliding_omega + mode.stuck_omega)
    one, other = (
        prescribed_cycle(hold_mode(joint, omega), 1e-3, steps=60, cycles=10, closure=1e-10)
        for joint in (planar, spatial)
    )
    assert other.force == pytest.approx(one.force, rel=1e-8)
    assert other.dissipated == pytest.approx(one.dissipated, rel=1e-7)


def test_load_path_is_that_of_the_planar_joint(planar, spatial):
    there = np.linspace(0, 300, 20)
    load = {"moment": np.r_[there, there[::-1], -there]}
    one, other = load_path(planar, load), load_path(spatial, load)
    close(other.output, one.output)
    close(other.dissipated, one.dissipated)


def test_a_second_direction_takes_friction_from_the_first(planar):
    """Under a steady pull across, pairs slip earlier along: of their limit b, ``sqrt(b² - t²)`` is left."""
    spatial = spatial_joint(planar, 0.0)
    model = spatial.model
    across = np.zeros((3 * model.pairs, 1))
    tangential_vectors(across.T)[0, :, 1] = 1e-7
    wider = replace(
        model,
        ports=(*model.ports, "across"),
        port_modes=np.hstack([model.port_modes, np.zeros((len(model.omega), 1))]),
        port_v=np.hstack([model.port_v, across]),
        port_port=np.pad(model.port_port, ((0, 1), (0, 1))),
        bodies=replace(
            model.bodies, ports=np.vstack([model.bodies.ports, 0 * model.bodies.ports[:1]])
        ),
    )
    joint = spatial.with_model(wider)
    there = np.linspace(0, 1, 25)
    moment = 300 * np.r_[np.zeros(25), there, there[::-1]]
    pull = np.r_[there, np.ones(50)]
    with_pull = load_path(joint, {"moment": moment, "across": pull})
    without = load_path(joint, {"moment": moment, "across": 0 * pull})
    more = with_pull.dissipated[-1] - with_pull.dissipated[24]
    less = without.dissipated[-1]
    assert more > less > 0

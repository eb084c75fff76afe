"""Two pressed layers against the semi-analytic solution of their receding contact."""

from __future__ import annotations

import numpy as np
import pytest
from conftest import GEOMETRY, MATERIAL, SPRING

from microslip.analyses.prepared.prestress import prestress
from microslip.contact.pairs import normal
from microslip.model.flexibility import static_flexibility
from microslip.model.joint import Reducer
from microslip.model.lap import lap_joint_structure
from microslip.model.lap_mesh import LapGeometry, MeshControl

THICKNESS = GEOMETRY.thickness


@pytest.fixture(scope="module", params=[0, 1], ids=["b=h", "b=2h"])
def layers(request, published):
    """Layers that overlap over |x| <= 4.5 h, well beyond the contact, and end there."""
    table = published["receding_contact"]
    b, a, p0 = (table[key][request.param] for key in ("b_over_h", "a_over_h", "p0_h_over_P"))
    geometry = LapGeometry(9 * THICKNESS, THICKNESS, 4.5 * THICKNESS, b * THICKNESS)
    structure = lap_joint_structure(
        geometry, MATERIAL, MeshControl(contact_pairs=145, max_layer=0.1), horizontal_spring=SPRING
    )
    model = Reducer(structure, 20, (0.0, 0.0)).model(structure.loads)
    return model, static_flexibility(model), a, p0


def test_contact_half_length(layers):
    model, flexibility, a, _ = layers
    start = prestress(model, flexibility, {"clamp": 1e6})
    x = model.position / THICKNESS
    spacing = np.diff(x).max()
    ends = x[start.touching][[0, -1]]
    assert np.abs(np.abs(ends) - a).max() <= spacing
    assert np.array_equal(
        np.diff(np.flatnonzero(start.touching)), np.ones(start.touching.sum() - 1)
    )


def test_central_pressure(layers):
    model, flexibility, _, p0 = layers
    start = prestress(model, flexibility, {"clamp": 1e6})
    centre = np.argmin(np.abs(model.position))
    assert start.pressure[centre] * THICKNESS / 1e6 == pytest.approx(p0, rel=5e-3)


def test_pressure_carries_the_clamp(layers):
    """All but what the springs at the ends take: their stiffness is 1e-6 of a layer's."""
    model, flexibility, _, _ = layers
    start = prestress(model, flexibility, {"clamp": 1e6})
    assert SPRING / MATERIAL.youngs_modulus < 2e-6
    assert normal(start.solution.r).sum() == pytest.approx(1e6, rel=2e-6)
    assert start.pressure == pytest.approx(start.pressure[::-1], abs=1e-9 * start.pressure.max())


@pytest.mark.parametrize("clamp", [3.7e2, 2.9e9])
def test_contact_does_not_depend_on_the_clamp_force(layers, clamp):
    model, flexibility, _, _ = layers
    one, other = (prestress(model, flexibility, {"clamp": p}) for p in (1e6, clamp))
    assert np.array_equal(one.touching, other.touching)
    difference = np.abs(one.pressure / 1e6 - other.pressure / clamp).max()
    assert difference < 1e-10 * one.pressure.max() / 1e6

"""Pressed cantilevers against Goodman & Klumpp's dissipation per cycle."""

from __future__ import annotations

import numpy as np
import pytest
from goodman_klumpp import pressed_cantilevers

from microslip.analyses.prepared.joint import prepare_joint
from microslip.analyses.statics.cycle import quasi_static_cycle
from microslip.contact.law import contact_law
from microslip.model.elasticity import Material
from microslip.model.joint import Reducer

PRESSURE = 1e6


@pytest.fixture(scope="module")
def cantilevers(published):
    table = published["goodman_klumpp"]
    structure = pressed_cantilevers(
        table["L"], table["h"], Material(table["E"], 0.3, 7800.0, "stress"), 40, 4
    )
    model = Reducer(structure, 20, (0.0, 0.0)).model(structure.loads)
    law = contact_law(model.pairs, table["mu_p"] / PRESSURE)
    return prepare_joint(model, law, {"clamp": PRESSURE * table["L"]}, "tip")


def drive(cantilevers, table, ratio, steps=240):
    slip_load = 4 / 3 * table["mu_p"] * table["h"]
    return quasi_static_cycle(cantilevers, "tip", ratio * slip_load, steps=steps)


def test_pressure_of_contact_is_even(cantilevers):
    assert cantilevers.prestress.pressure == pytest.approx(PRESSURE, rel=1e-5)


@pytest.mark.parametrize("case", range(3))
def test_dissipation_per_cycle(cantilevers, published, case):
    table = published["goodman_klumpp"]
    cycle = drive(cantilevers, table, table["P_over_P_slip"][case])
    assert table["b"] * cycle.dissipated == pytest.approx(table["D"][case], rel=5e-3)
    assert cycle.external_work == pytest.approx(cycle.dissipated, rel=1e-9)


def test_bending_leaves_the_normal_pressure_alone(cantilevers, published):
    """Bending is odd about the plane of contact, pressure is even."""
    cycle = drive(cantilevers, published["goodman_klumpp"], 2.0)
    assert np.abs(cycle.pressure / PRESSURE - 1).max() < 1e-5


def test_below_the_slip_load_nearly_nothing_is_dissipated(cantilevers, published):
    """Beam theory has none at all; only the ends slip, less than a hundredth of one P_slip more."""
    table = published["goodman_klumpp"]
    per_slip_load = table["D"][1]
    cycle = drive(cantilevers, table, 0.8)
    assert abs(table["b"] * cycle.dissipated) < 0.01 * per_slip_load


def test_tables_follow_the_formula(published):
    """D = 8 mu p L³/(E h²) (P - P_slip), with the forces of the full width b."""
    t = published["goodman_klumpp"]
    slip_load = 4 / 3 * t["mu_p"] * t["b"] * t["h"]
    rate = 8 * t["mu_p"] * t["L"] ** 3 / (t["E"] * t["h"] ** 2)
    for ratio, dissipation in zip(t["P_over_P_slip"], t["D"], strict=True):
        assert rate * (ratio - 1) * slip_load == pytest.approx(dissipation, rel=1e-4)

"""Prestress under several ports, and what every analysis makes of a preload that is shared out."""

from __future__ import annotations

from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest
from conftest import CLAMP, FRICTION, GEOMETRY, MATERIAL, RAYLEIGH, joint_structure

from microslip.analyses.harmonic.problem import harmonic_problem
from microslip.analyses.harmonic.raising import raise_load
from microslip.analyses.prepared.joint import prepare_joint, with_principal_mode
from microslip.analyses.prepared.prestress import opening_load, prestress
from microslip.analyses.statics.cycle import quasi_static_cycle
from microslip.analyses.statics.held import hold_mode
from microslip.analyses.statics.prescribed import prescribed_cycle
from microslip.analyses.time.scheme import time_scheme
from microslip.analyses.time.steady import steady_state
from microslip.contact.law import contact_law
from microslip.contact.pairs import BACKWARD, FORWARD, SEPARATED, STICK, normal, tangential
from microslip.errors import ContactError
from microslip.model.elasticity import elastic_body
from microslip.model.joint import Reducer

CLOSE = 1e-9
"""Of the largest value: rounding of the loads, and the certificate of the solver."""


@pytest.fixture(scope="module")
def structure():
    """The reference joint with the clamp also as two ports: what it does right and left of x = 0."""
    joint = joint_structure(51)
    nodes = np.hstack([elastic_body(mesh, material).nodes for mesh, material in parts(joint)])
    x = np.repeat(nodes[0], 2)[joint.free]
    share = 0.5 + 0.5 * np.sign(np.round(x, 12))
    clamp = joint.loads["clamp"]
    ports = {"right": share * clamp, "left": (1 - share) * clamp}
    return replace(joint, loads={**joint.loads, **ports})


def parts(structure):
    return [(mesh, MATERIAL) for mesh in structure.meshes]


@pytest.fixture(scope="module")
def model(structure):
    return Reducer(structure, 40, RAYLEIGH).model(structure.loads)


def pressed(model, preload):
    law = contact_law(model.pairs, FRICTION)
    return with_principal_mode(prepare_joint(model, law, preload, "moment"))


@pytest.fixture(scope="module")
def whole(model):
    return pressed(model, {"clamp": CLAMP})


@pytest.fixture(scope="module")
def shared(model):
    """The same clamp from both halves."""
    return pressed(model, {"left": CLAMP, "right": CLAMP})


def close(one, other):
    return np.abs(one - other).max() <= CLOSE * np.abs(other).max()


def test_both_halves_press_as_the_clamp_does(whole, shared):
    one, other = whole.prestress, shared.prestress
    assert np.array_equal(one.touching, other.touching)
    assert close(other.solution.r, one.solution.r)
    assert close(other.solution.v, one.solution.v)
    assert close(other.pressure, one.pressure)
    assert other.preload == {"left": CLAMP, "right": CLAMP}
    assert shared.held.tolist() == [0, 0, 0, 0, CLAMP, CLAMP, 0, 0]


def test_order_of_the_ports_does_not_matter(model, shared):
    other = pressed(model, {"right": CLAMP, "left": CLAMP})
    assert np.array_equal(other.prestress.solution.r, shared.prestress.solution.r)


def test_clamp_may_be_shared_between_itself_and_its_halves(model, whole):
    """A third of the clamp and two thirds of each half."""
    mixed = pressed(model, {"clamp": CLAMP / 3, "left": 2 / 3 * CLAMP, "right": 2 / 3 * CLAMP})
    assert close(mixed.prestress.solution.r, whole.prestress.solution.r)


def test_one_half_alone_presses_its_side(model, whole):
    """The resultant is half of the clamp and lies on that side."""
    start = pressed(model, {"right": CLAMP}).prestress
    r, x = normal(start.solution.r), model.position
    assert r.sum() == pytest.approx(CLAMP / 2, rel=1e-4)
    assert x[start.touching].min() > x[whole.prestress.touching].min()
    # moments of the lower beam about its support, whatever that carries: pressed evenly from 0 to
    # L_p, up to the element around x = 0, whose middle node is shared by both halves
    support = GEOMETRY.overlap_half_length - GEOMETRY.length
    middle = GEOMETRY.clamp_half_length / 2
    assert r @ (x - support) == pytest.approx(CLAMP / 2 * (middle - support), rel=1e-4)
    assert (tangential(start.solution.r) == 0).all()


def test_force_is_the_sum_of_what_is_held(whole, shared):
    assert whole.prestress.force == CLAMP
    assert shared.prestress.force == 2 * CLAMP


def test_start_of_other_analyses_is_read_off(whole):
    """Largest reaction, states of rest and bonded components, from the solution itself."""
    start = whole.prestress
    touching = normal(start.solution.r) > 0
    assert start.largest_reaction == max(start.solution.r.max(), -start.solution.r.min())
    assert start.status.tolist() == [STICK if t else SEPARATED for t in touching]
    places = np.flatnonzero(touching)
    assert start.bonded(1).tolist() == [2 * i for i in places]
    assert start.bonded(2).tolist() == [c for i in places for c in (2 * i, 2 * i + 1)]
    # frictionless: pairs slide as they like, either way, and none sticks
    assert set(start.solution.status[touching]) <= {FORWARD, BACKWARD}


def test_opening_load_is_the_same(whole, shared):
    one, other = (opening_load(j.model, j.prestress, "moment") for j in (whole, shared))
    assert other == pytest.approx(one, rel=1e-9)


def test_quasi_static_cycles_are_the_same(whole, shared):
    one, other = (
        quasi_static_cycle(j, "moment", 1e3, steps=60, max_cycles=2) for j in (whole, shared)
    )
    assert close(other.r, one.r)
    assert close(other.slip, one.slip)
    assert other.dissipated == pytest.approx(one.dissipated, rel=1e-8)


def test_prescribed_cycles_are_the_same(whole, shared):
    """Where the first port of the preload carries all of it."""
    mode = whole.principal()
    middle = 0.5 * (mode.sliding_omega + mode.stuck_omega)
    one, other = (
        prescribed_cycle(hold_mode(j, middle), 5e-3, steps=60, cycles=2) for j in (whole, shared)
    )
    assert other.force == pytest.approx(one.force, rel=1e-8)
    assert other.dissipated == pytest.approx(one.dissipated, rel=1e-8)


def test_vibrations_are_the_same(whole, shared):
    """In time, and by harmonic balance: both hold the preload, whatever it is made of."""
    load, frequency = 50.0, 176.0
    one, other = (
        steady_state(time_scheme(j, 1 / (100 * frequency)), frequency, load, max_cycles=3)
        for j in (whole, shared)
    )
    assert close(other.cycle.r, one.cycle.r)
    problems = [harmonic_problem(j, harmonics=3) for j in (whole, shared)]
    assert all(p.half_turn for p in problems)
    a, b = (raise_load(p, frequency, load)[0] for p in problems)
    assert np.abs(b - a).max() <= 1e-7 * whole.prestress.largest_reaction


@pytest.mark.parametrize("wrong", [0.0, -1.0, np.nan, np.inf])
def test_every_port_must_press(model, whole, wrong):
    with pytest.raises(ContactError, match=r"'left' is .*: it must be positive"):
        prestress(model, whole.flexibility, {"clamp": CLAMP, "left": wrong})


def test_a_preload_that_pulls_is_refused(structure):
    """A port whose load opens the contact, though its amplitude is positive."""
    pulling = Reducer(structure, 20, RAYLEIGH).model({"clamp": -structure.loads["clamp"]})
    law = contact_law(pulling.pairs, FRICTION)
    with pytest.raises(ContactError):
        prepare_joint(pulling, law, {"clamp": CLAMP}, "clamp")


@pytest.mark.parametrize("dimension", [2, 3])
@pytest.mark.parametrize(("of_jamming", "held"), [(0.9, 1.5), (1.1, np.inf)])
def test_a_hinged_body_opens_unless_friction_jams_it(dimension, of_jamming, held):
    """A plate that turns about a hinge at height h below its interface, pressed down at b by P.

    A moment lifts it where ``M = P b``, and never where friction ``mu > x / h`` jams the pair at x, the
    nearest to the hinge."""
    x, h, b, P = np.array([1.0, 1.5, 2.0]), 2.0, 1.5, 1.0
    turn = np.zeros((3, dimension))
    turn[:, 0], turn[:, 1] = -x, -h  # approach, and sideways
    ports = np.array([[-P * b], [1.0]])
    model = SimpleNamespace(
        bodies=SimpleNamespace(v=turn.reshape(-1, 1), ports=ports),
        dimension=dimension,
        pairs=3,
        port=["press", "lift"].index,
        amplitudes=lambda preload: np.array([preload["press"], 0.0]),
    )
    start = SimpleNamespace(preload={"press": 1.0}, force=1.0)
    friction = of_jamming * x[0] / h
    assert opening_load(model, start, "lift", friction) == pytest.approx(held, rel=1e-9)

"""A prepared joint: what may be changed of it, its mode, and its way to another process."""

from __future__ import annotations

import multiprocessing
import pickle
import subprocess
import sys
from dataclasses import fields, replace

import numpy as np
import pytest
from conftest import CLAMP, FRICTION, RAYLEIGH

from microslip.analyses.harmonic.problem import harmonic_problem
from microslip.analyses.harmonic.raising import raise_load
from microslip.analyses.prepared.joint import prepare_joint, with_principal_mode
from microslip.analyses.statics.cycle import Cycle, quasi_static_cycle
from microslip.analyses.time.scheme import time_scheme
from microslip.analyses.time.steady import steady_state
from microslip.contact.law import contact_law
from microslip.contact.pairs import tangential
from microslip.errors import ContactError, ModelError
from microslip.model.joint import Reducer

LOAD = 4e-3
"""M/(P L): the tips of the overlap touch again, so that every state occurs."""


@pytest.fixture(scope="module")
def joint(small_reference):
    return small_reference.joint


@pytest.fixture(scope="module")
def plain(small_reference):
    """The same joint, knowing no mode."""
    structure = small_reference.structure
    model = Reducer(structure, 40, RAYLEIGH).model(structure.loads)
    return prepare_joint(model, contact_law(model.pairs, FRICTION), {"clamp": CLAMP}, "moment")


def moment(reference):
    return LOAD * reference.moment


def same(one, other) -> bool:
    """All fields equal, arrays bit for bit."""
    if hasattr(one, "__dataclass_fields__"):
        return all(same(getattr(one, f.name), getattr(other, f.name)) for f in fields(one))
    if isinstance(one, np.ndarray):
        return one.dtype == other.dtype and np.array_equal(one, other)
    return one == other


# --- to another process


def test_a_copy_by_pickle_is_the_same(joint):
    data = pickle.dumps(joint)
    assert same(pickle.loads(data), joint)
    m, k, p = joint.model.pairs, len(joint.model.omega), len(joint.model.ports)
    # two matrices of (2 m)² numbers, the modes and ports at the pairs, and little else
    assert len(data) < 8 * (2 * (2 * m) ** 2 + 2 * m * (2 * k + 4 * p) + 100 * m + 20 * k * p)


def test_a_cycle_in_a_spawned_process_is_the_same(joint, small_reference):
    """A process that shares nothing with this one gets all that it needs."""
    here = quasi_static_cycle(joint, "moment", moment(small_reference), steps=60, max_cycles=2)
    with multiprocessing.get_context("spawn").Pool(1) as pool:
        there = pool.apply(
            quasi_static_cycle,
            (joint, "moment", moment(small_reference)),
            {"steps": 60, "max_cycles": 2},
        )
    assert isinstance(there, Cycle)
    assert same(there, here)


REMOTE = """
import pickle, sys
import numpy as np
from microslip.analyses.harmonic.raising import raise_load
from microslip.analyses.harmonic.problem import harmonic_problem
from microslip.analyses.time.scheme import time_scheme
from microslip.analyses.time.steady import steady_state

joint, load = pickle.load(sys.stdin.buffer)
steady = steady_state(time_scheme(joint, 1 / (176.0 * 100)), 176.0, load, max_cycles=3)
w, _ = raise_load(harmonic_problem(joint, harmonics=3), 176.0, load)
sys.stdout.buffer.write(pickle.dumps((steady.cycle.r, steady.cycle.output, w)))
"""


def test_vibration_in_a_new_interpreter_is_the_same(joint, small_reference):
    """Time steps and harmonic balance, from nothing but the pickled joint on standard input."""
    load = 0.05 * moment(small_reference)
    done = subprocess.run(
        [sys.executable, "-c", REMOTE],
        input=pickle.dumps((joint, load)),
        capture_output=True,
        check=True,
    )
    r, output, w = pickle.loads(done.stdout)
    steady = steady_state(time_scheme(joint, 1 / (176.0 * 100)), 176.0, load, max_cycles=3)
    assert np.array_equal(r, steady.cycle.r)
    assert np.array_equal(output, steady.cycle.output)
    assert np.array_equal(w, raise_load(harmonic_problem(joint, harmonics=3), 176.0, load)[0])


# --- other friction, preload, model


@pytest.mark.parametrize("friction", [0.4, "each"])
def test_other_friction_is_as_if_prepared_anew(joint, small_reference, friction):
    if friction == "each":
        friction = np.linspace(0.1, 0.5, joint.model.pairs)
    changed = joint.with_friction(friction)
    law = contact_law(joint.model.pairs, friction)
    anew = prepare_joint(joint.model, law, {"clamp": CLAMP}, "moment", joint.mode)
    assert same(changed, anew)
    load = moment(small_reference)
    one, other = (quasi_static_cycle(j, "moment", load, steps=60) for j in (changed, anew))
    assert same(one, other)
    assert one.dissipated != quasi_static_cycle(joint, "moment", load, steps=60).dissipated


@pytest.mark.parametrize("power", [-9, -1, 6])
def test_preload_times_a_power_of_two_scales_all_reactions(joint, power):
    """Exactly: no rounding can tell."""
    factor = 2.0**power
    scaled = joint.with_preload({"clamp": factor * CLAMP}).prestress
    start = joint.prestress
    assert scaled.force == factor * start.force
    assert scaled.preload == {"clamp": factor * CLAMP}
    for name in ("r", "v", "q"):
        one, other = getattr(start.solution, name), getattr(scaled.solution, name)
        assert np.array_equal(other, factor * one), name
    assert np.array_equal(scaled.pressure, factor * start.pressure)
    assert np.array_equal(scaled.touching, start.touching)
    assert scaled.largest_reaction == factor * start.largest_reaction


def test_a_cycle_scales_with_preload_and_load_together(joint, small_reference):
    load = moment(small_reference)
    one = quasi_static_cycle(joint, "moment", load, steps=60)
    halved = joint.with_preload({"clamp": CLAMP / 2})
    other = quasi_static_cycle(halved, "moment", load / 2, steps=60)
    for name in ("pressure", "traction", "slip", "gap"):
        assert np.array_equal(getattr(other, name), getattr(one, name) / 2), name


def test_another_model_keeps_the_contact(joint):
    """One more port adds its column and changes nothing else."""
    shape = np.eye(len(joint.model.omega))[7]
    wide = joint.with_model(joint.model.with_modal_ports({"seventh": shape}))
    assert wide.model.ports == (*joint.model.ports, "seventh")
    assert np.array_equal(wide.flexibility.W, joint.flexibility.W)
    assert wide.prestress is joint.prestress
    assert wide.held.tolist() == [*joint.held, 0.0]


def test_compliance_stays_where_it_is_written(plain):
    """On the diagonal of W, whatever else is changed; contact behind it is no shorter."""
    area = plain.model.area
    give = np.repeat(1 / (1e14 * area), 2)
    law = contact_law(plain.model.pairs, FRICTION, give)
    elastic = prepare_joint(plain.model, law, {"clamp": CLAMP}, "moment")
    expected = plain.flexibility.W + np.diag(give)
    for joint in (
        elastic,
        elastic.with_friction(0.1),
        elastic.with_preload({"clamp": 2 * CLAMP}),
        elastic.with_model(plain.model),
    ):
        assert np.array_equal(joint.flexibility.W, expected)
        assert np.array_equal(joint.law.compliance, give)
    assert elastic.prestress.touching.sum() >= plain.prestress.touching.sum()


# --- its mode


def test_principal_mode_is_that_of_the_structure(plain, small_reference):
    """To the error of the reduction: 1e-4 in frequency is asked of it."""
    states, structure = small_reference.states, small_reference.structure
    mode = with_principal_mode(plain).principal()
    assert mode.sliding_omega == pytest.approx(states.sliding_omega, rel=1e-4)
    assert mode.stuck_omega == pytest.approx(states.stuck_omega, rel=1e-4)
    assert mode.overlap == pytest.approx(states.overlap, abs=1e-4)
    for load in ("moment", "lift"):
        for found, shape in (
            (mode.load_on_sliding[load], states.sliding),
            (mode.load_on_stuck[load], states.stuck),
        ):
            work = structure.loads[load] @ shape
            assert found == pytest.approx(work, rel=1e-2), load


def test_principal_mode_is_mass_normalised_and_points_along_the_load(plain):
    for sign in (1.0, -1.0):
        model = plain.model
        column = model.port_modes.copy()
        column[:, model.port("moment")] *= sign
        turned = plain.with_model(replace(model, port_modes=column))
        mode = with_principal_mode(turned).principal()
        assert np.linalg.norm(mode.sliding) == pytest.approx(1, rel=1e-12)
        assert np.linalg.norm(mode.stuck) == pytest.approx(1, rel=1e-12)
        assert mode.sliding @ mode.stuck == pytest.approx(mode.overlap, rel=1e-12)
        assert mode.overlap > 0
        assert mode.load_on_sliding["moment"] > 0


def test_principal_mode_comes_with_its_ports(plain, small_reference):
    """The output of its port is the modal coordinate; the structure's own port says the same."""
    whole = with_principal_mode(plain)
    assert whole.model.ports == (*plain.model.ports, "sliding", "stuck")
    assert whole.coordinate == "sliding"
    assert plain.coordinate == "moment"
    load = moment(small_reference)
    one = quasi_static_cycle(whole, "moment", load, steps=60)
    other = quasi_static_cycle(small_reference.joint, "moment", load, steps=60)
    port = small_reference.model.port("sliding")
    q = other.output[:, port]
    assert one.output[:, whole.model.port("sliding")] == pytest.approx(q, abs=1e-3 * np.ptp(q))
    assert tangential(one.r) == pytest.approx(tangential(other.r), abs=1e-6 * CLAMP)


def test_a_joint_without_a_mode_says_so(plain):
    assert plain.mode is None
    with pytest.raises(ModelError, match="without a mode"):
        plain.principal()


# --- what is refused


@pytest.mark.parametrize("port", ["drive", "preload"])
def test_ports_that_do_not_exist_are_named(plain, port):
    held = {"clmap": CLAMP} if port == "preload" else {"clamp": CLAMP}
    drive = "moment" if port == "preload" else "torque"
    with pytest.raises(ModelError, match=r"no port '(clmap|torque)'; this model has clamp, moment"):
        prepare_joint(plain.model, plain.law, held, drive)


def test_a_joint_that_nothing_presses_is_refused(plain):
    with pytest.raises(ContactError, match="nothing presses"):
        plain.with_preload({})
    with pytest.raises(ContactError, match="'clamp' is -1: it must be positive"):
        plain.with_preload({"clamp": -1.0})


def test_a_joint_shows_itself_in_a_line(joint, plain):
    """Pairs, modes, preload, drive and frequencies."""
    assert (
        repr(plain) == "PreparedJoint(51 pairs, 40 modes, preload clamp 1e+06, driven at 'moment')"
    )
    assert "mode 17" in repr(joint)
    assert "Hz sliding" in repr(joint)
    assert len(repr(joint)) < 200

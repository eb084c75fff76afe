"""Which motions a held mode leaves without inertia: a body dragged by friction, in closed form.

A mass on a spring drags another by friction, ``m1, k1`` and ``m2`` on ``k2``, which hardly holds its place; a
third, ``m3`` on ``k3``, hangs on the first by a weak spring. The third's mode hardly moves the dragged mass.
Without the inertia of that mass the first two swing at ``sqrt(k1/m1)`` where they swing at
``sqrt(k1/(m1 + m2))`` with it, and where ``k3/m3`` is the former, the third's mode mixes with theirs.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from benchmarks_physics.den_hartog import MASS, OMEGA, oscillator
from scipy.linalg import eigh

from microslip.analyses.prepared.joint import prepare_joint, with_principal_mode
from microslip.analyses.prepared.joint_modes import joint_modes, walking_modes
from microslip.analyses.statics.cycle import quasi_static_cycle
from microslip.analyses.statics.held import LINKED, hold_mode, hold_port, resting
from microslip.analyses.statics.prescribed import prescribed_cycle
from microslip.contact.law import contact_law
from microslip.model.joint import JointModel
from microslip.model.loose import held, loose_modes

FIRST, DRAGGED, THIRD = 1.0, 0.5, 0.8
SPRING, HOLDING, LINK, GIVE = 1e4, 1e-4, 1.0, 1e-13


def chain(third_spring):
    """The three masses, driven by a force on the third; clamped with 1 kN, friction 0.5."""
    K = np.array([[SPRING + LINK, -LINK], [-LINK, third_spring + LINK]])
    squares, shapes = eigh(K, np.diag([FIRST, THIRD]))
    modes = np.zeros((3, 3))
    modes[0, 0], modes[1:, 1:] = 1 / np.sqrt(DRAGGED), shapes
    dragged, first, third = modes
    model = JointModel(
        position=np.zeros(1),
        area=np.ones(1),
        dimension=2,
        omega=np.sqrt(np.concatenate([[HOLDING / DRAGGED], squares])),
        equilibrium_modes=1,
        mode_v=np.array([np.zeros(3), first - dragged]),
        residual=np.diag([1e-6, GIVE]),
        ports=("clamp", "force"),
        port_modes=np.column_stack([np.zeros(3), third]),
        port_v=np.array([[1e-6, 0.0], [0.0, 0.0]]),
        port_port=np.zeros((2, 2)),
        rayleigh=(0.0, 0.0),
    )
    return with_principal_mode(prepare_joint(model, contact_law(1, 0.5), {"clamp": 1e3}, "force"))


def stuck_frequencies(third_spring, dragged):
    K = np.array([[SPRING + HOLDING + LINK, -LINK], [-LINK, third_spring + LINK]])
    return np.sqrt(eigh(K, np.diag([FIRST + dragged, THIRD]), eigvals_only=True))


MIXED = SPRING * THIRD / FIRST


@pytest.mark.parametrize(("third_spring", "felt"), [(MIXED, True), (4 * MIXED, False)])
def test_a_small_share_of_a_slide_counts_where_the_frequency_feels_it(third_spring, felt):
    joint = chain(third_spring)
    mode = joint.principal()
    assert mode.stuck[0] ** 2 < LINKED / 10
    own = stuck_frequencies(third_spring, DRAGGED)
    assert mode.stuck_omega == pytest.approx(own[1], rel=1e-7)
    change = np.abs(stuck_frequencies(third_spring, 0.0) / own[1] - 1).min()
    assert (change > LINKED) == felt
    np.testing.assert_array_equal(resting(joint, mode), [not felt, False, False])


def test_held_at_small_amplitude_it_swings_at_its_stuck_frequency():
    joint = chain(MIXED)
    mode = joint.principal()
    cycle = prescribed_cycle(hold_mode(joint, mode.stuck_omega), 1e-9, steps=40, cycles=2)
    found = np.sqrt(mode.sliding_omega**2 + (cycle.force / cycle.q).real)
    assert found == pytest.approx(mode.stuck_omega, rel=LINKED / 10)


def test_modes_of_a_lap_joint_that_slide_its_beams_do_so_with_their_inertia(small_reference):
    """Modes that are symmetric as the slide is have it in their shape; the others have not."""
    joint = small_reference.joint
    sliding = walking_modes(joint.model)
    modes = joint_modes(joint.model, joint.prestress, joint.law)[:4]
    slides = [float((mode.stuck[sliding] ** 2).sum()) > 1e-9 for mode in modes]
    assert [not resting(joint, mode).any() for mode in modes] == slides
    assert set(slides) == {True, False}


def test_motions_that_move_a_pair_by_rounding_are_no_unknowns():
    """Those of a joint as a whole: small cycles of an oscillator are the same with two of them beside it."""
    plain = oscillator(50.0, spring=1e7)
    model = plain.model
    rounding = 1e-13 * np.array([[1.0, -0.3], [0.4, 0.7]])
    free = replace(
        model,
        omega=np.concatenate([[1e-2, 1e-2], model.omega]),
        equilibrium_modes=2,
        mode_v=np.hstack([rounding, model.mode_v]),
        port_modes=np.pad(model.port_modes, ((2, 0), (0, 0))),
    )
    other = prepare_joint(free, plain.law, plain.prestress.preload, plain.drive)
    cycles = []
    for joint in (plain, other):
        own = hold_port(joint, "sliding", OMEGA, OMEGA)
        assert own.flexibility.stiffness.size == 0
        cycles.append(prescribed_cycle(own, 1e-9, steps=40, cycles=2))
    one, two = cycles
    assert two.force / two.q == pytest.approx(one.force / one.q, rel=1e-9)
    assert (one.force / one.q).real == pytest.approx(1e7 / MASS, rel=1e-9)


ELASTIC = 1e-9


def beside(masses):
    """A mass that rubs against the ground behind a contact spring, and others that rest on it."""
    pairs = 1 + masses
    tangential = np.diag(np.append(np.full(masses, 1 / np.sqrt(DRAGGED)), 1.0))
    mode_v = np.zeros((2 * pairs, pairs))
    mode_v[1::2] = tangential
    residual = np.zeros(2 * pairs)
    residual[::2], residual[1::2] = 1e-6, ELASTIC
    port_v = np.zeros((2 * pairs, 2))
    port_v[::2, 0] = 1e-6
    model = JointModel(
        position=np.arange(pairs, dtype=float),
        area=np.ones(pairs),
        dimension=2,
        omega=np.sqrt(np.append(np.full(masses, HOLDING / DRAGGED), SPRING)),
        equilibrium_modes=masses,
        mode_v=mode_v,
        residual=np.diag(residual),
        ports=("clamp", "sliding"),
        port_modes=np.outer(np.eye(pairs)[-1], [0.0, 1.0]),
        port_v=port_v,
        port_port=np.zeros((2, 2)),
        rayleigh=(0.0, 0.0),
    )
    return prepare_joint(model, contact_law(pairs, 0.5), {"clamp": 1e3}, "sliding")


def test_a_joint_that_is_free_as_a_whole_has_the_cycles_of_one_that_is_held():
    """Nothing holds two motions, and since they move no pair they are no unknowns."""
    plain = oscillator(50.0, spring=1e7)
    model = plain.model
    omega, _ = held(np.append(np.zeros(2), model.omega), 2)
    free = replace(
        model,
        omega=omega,
        equilibrium_modes=0,
        mode_v=np.hstack([1e-13 * np.array([[1.0, -0.3], [0.4, 0.7]]), model.mode_v]),
        port_modes=np.pad(model.port_modes, ((2, 0), (0, 0))),
    )
    assert (free.loose_motions, loose_modes(omega)) == (0, 2)
    other = prepare_joint(free, plain.law, plain.prestress.preload, plain.drive)
    one, two = (quasi_static_cycle(joint, "force", 80.0, steps=40) for joint in (plain, other))
    assert one.dissipated > 0
    assert two.dissipated == pytest.approx(one.dissipated, rel=1e-9)
    np.testing.assert_allclose(two.r, one.r, rtol=1e-9, atol=1e-9)


def test_bodies_at_rest_beside_it_may_be_the_most():
    """Four masses that friction alone holds, and one that vibrates: four of five motions are rigid ones.

    Their weak springs are unknowns of equilibrium: in the flexibility they would be 1e13 times what is
    elastic at a pair, and leave nothing of it.
    """
    cycles = []
    for masses in (0, 4):
        joint = beside(masses)
        own = hold_port(joint, "sliding", np.sqrt(SPRING), np.sqrt(SPRING))
        assert len(own.flexibility.stiffness) == masses
        cycles.append(prescribed_cycle(own, 1e-3, steps=40, cycles=2))
    one, two = cycles
    assert two.force / two.q == pytest.approx(one.force / one.q, rel=1e-9)
    assert two.dissipated == pytest.approx(one.dissipated, rel=1e-9)

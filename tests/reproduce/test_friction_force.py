"""Friction alone on the sliding mode: against the whole contact force, and its linearity."""

from __future__ import annotations

import numpy as np
import pytest

from microslip.analyses.reduced.table import equivalent_table
from microslip.analyses.statics.cycle import quasi_static_cycle
from microslip.contact.pairs import normal
from microslip.reproduce.friction_force import friction_modal_force, friction_table


def test_friction_alone_differs_from_the_whole_force_by_pressure_only(small_reference):
    """While no pair opens or closes the sliding mode has no normal motion for pressure to work on."""
    structure, states = small_reference.structure, small_reference.states
    joint = small_reference.joint
    load = 1e-6 * small_reference.moment * (structure.loads["moment"] @ states.sliding)
    cycle = quasi_static_cycle(joint, "sliding", load, steps=60)
    table = equivalent_table([cycle], joint, "mode")
    alone = friction_table(table, [cycle], structure.interface, states, joint)
    assert alone.k_eq[0] == pytest.approx(table.k_eq[0], rel=1e-4)


def test_friction_force_is_linear_in_the_reactions(small_reference):
    interface, states = small_reference.structure.interface, small_reference.states
    r = np.random.default_rng(1).normal(size=(3, 2 * interface.pairs))
    pushed = r.copy()
    normal(pushed)[:] += 5.0
    one = friction_modal_force(r, interface, states)
    np.testing.assert_allclose(friction_modal_force(pushed, interface, states), one, rtol=1e-13)
    np.testing.assert_allclose(friction_modal_force(2 * r, interface, states), 2 * one, rtol=1e-13)

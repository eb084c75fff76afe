"""Friction alone on the sliding mode: against the whole contact force, and its linearity."""

from __future__ import annotations

import numpy as np
import pytest
from microslip.analyses.statics.linear_states import linear_states

from microslip.analyses.reduced.table import equivalent_table
from microslip.analyses.statics.cycle import quasi_static_cycle
from microslip.reproduce.friction_force import friction_modal_force, friction_table


@pytest.fixture(scope="module")
def states(small_reference):
    pairs = np.flatnonzero(small_reference.start.touching)
    return linear_states(small_reference.structure, pairs, "moment")


def test_friction_alone_differs_from_the_whole_force_by_pressure_only(small_reference, states):
    """While no pair opens or closes the sliding mode has no normal motion for pressure to work on."""
    reference = small_reference
    cycle = quasi_static_cycle(
        reference.model,
        reference.flexibility,
        reference.start,
        "sliding",
        1e-6 * reference.moment * states.load_on_sliding["moment"],
        0.25,
        steps=60,
    )
    table = equivalent_table([cycle], reference.model, states, reference.start.clamp, "mode")
    alone = friction_table(table, [cycle], reference.model, reference.structure.interface, states)
    assert alone.k_eq[0] == pytest.approx(table.k_eq[0], rel=1e-4)


def test_friction_force_is_linear_in_the_reactions(small_reference, states):
    interface = small_reference.structure.interface
    r = np.random.default_rng(1).normal(size=(3, 2 * interface.pairs))
    pushed = r.copy()
    pushed[:, ::2] += 5.0
    one = friction_modal_force(r, interface, states)
    np.testing.assert_allclose(friction_modal_force(pushed, interface, states), one, rtol=1e-13)
    np.testing.assert_allclose(friction_modal_force(2 * r, interface, states), 2 * one, rtol=1e-13)

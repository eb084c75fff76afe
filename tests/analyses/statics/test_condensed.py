"""Fewer pairs: the answer of all of them, and an error where those left out would move."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from spatial_twin import spatial_joint

from microslip.analyses.statics.condensed import condensed
from microslip.analyses.statics.cycle import quasi_static_cycle
from microslip.contact.pairs import SLIP, components
from microslip.errors import ContactError


@pytest.fixture(scope="module", params=["planar", "spatial"])
def whole(request, small_reference):
    joint = replace(small_reference.joint, model=replace(small_reference.joint.model, image=None))
    return joint if request.param == "planar" else spatial_joint(joint, 0.7)


@pytest.fixture(scope="module")
def large(whole, small_reference):
    return quasi_static_cycle(whole, "moment", 8e-4 * small_reference.moment, steps=40)


@pytest.mark.parametrize("share", [0.5, 1.0])
def test_cycle_is_that_of_all_pairs(whole, large, share):
    """At the load it was condensed for and at less."""
    fewer = condensed(whole, large)
    d = whole.model.dimension
    assert len(fewer.kept) < whole.model.pairs
    assert len(fewer.bonded)
    assert (large.status[:, fewer.kept] == SLIP).any()
    one = quasi_static_cycle(whole, "moment", share * large.amplitude, steps=40)
    other = quasi_static_cycle(fewer.joint, "moment", share * large.amplitude, steps=40)
    size = np.abs(one.r).max()
    assert np.abs(other.r - one.r[:, components(fewer.kept, d)]).max() <= 1e-8 * size
    assert other.dissipated == pytest.approx(one.dissipated, rel=1e-7)
    column = whole.model.port("moment")
    assert other.output[:, column] == pytest.approx(
        one.output[:, column], rel=1e-7, abs=1e-8 * np.abs(one.output[:, column]).max()
    )
    r, v = fewer.left_out(other)
    assert np.abs(r - one.r[:, components(fewer.bonded, d)]).max() <= 1e-7 * size
    rows = components(fewer.open, d)
    assert np.abs(v - one.v[:, rows]).max(initial=0.0) <= 1e-7 * np.abs(one.v).max()
    assert 0 < fewer.check(other) < 1


def test_pairs_left_out_that_would_slip_are_an_error(whole, large):
    fewer = condensed(whole, large, 0.99)
    beyond = quasi_static_cycle(fewer.joint, "moment", 1.6 * large.amplitude, steps=40)
    with pytest.raises(ContactError, match="was left out and would"):
        fewer.check(beyond)


def test_modes_are_those_of_the_whole_joint(whole, large):
    """Sliding and stuck frequencies: bonding some pairs first is part of bonding all; to slide, it is not."""
    fewer = condensed(whole, large)
    from_all = whole.principal().stuck_frequency
    assert fewer.joint.principal().stuck_frequency == pytest.approx(from_all, rel=2e-3)


def test_where_nothing_moves_there_is_nothing_to_condense_for(whole, large):
    rest = whole.prestress.solution
    still = replace(large, r=np.tile(rest.r, (2, 1)), v=np.tile(rest.v, (2, 1)))
    with pytest.raises(ContactError, match="nothing to condense"):
        condensed(whole, still)

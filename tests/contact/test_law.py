"""The contact law: what it keeps, and what it says of coefficients that make no sense."""

from __future__ import annotations

import dataclasses

import numpy as np
import pytest

from microslip.contact.law import contact_law
from microslip.errors import ContactError


def test_one_coefficient_serves_all_pairs():
    law = contact_law(3, 0.25)
    assert law.friction.tolist() == [0.25, 0.25, 0.25]
    assert law.compliance.tolist() == [0.0] * 6
    assert law.exact
    assert not law.frictionless


def test_each_pair_may_have_its_own():
    law = contact_law(2, np.array([0.0, 0.4]), np.array([0.0, 1e-9, 0.0, 2e-9]))
    assert law.friction.tolist() == [0.0, 0.4]
    assert law.compliance.tolist() == [0.0, 1e-9, 0.0, 2e-9]
    assert not law.exact
    assert not law.frictionless
    assert contact_law(2, 0.0).frictionless


def test_spatial_pairs_have_three_components():
    assert contact_law(2, 0.1, dimension=3).compliance.shape == (6,)
    with pytest.raises(ContactError, match=r"shape \(4,\), not \(6,\)"):
        contact_law(2, 0.1, np.zeros(4), dimension=3)


def test_other_friction_leaves_the_compliance():
    law = contact_law(2, 0.1, np.arange(4.0))
    other = law.with_friction(np.array([0.3, 0.5]))
    assert other.friction.tolist() == [0.3, 0.5]
    assert other.compliance.tolist() == [0.0, 1.0, 2.0, 3.0]
    assert law.friction.tolist() == [0.1, 0.1]


def test_a_law_does_not_change_with_the_arrays_it_was_made_of():
    friction, compliance = np.array([0.1, 0.2]), np.ones(4)
    law = contact_law(2, friction, compliance)
    friction[:], compliance[:] = 9.0, 9.0
    assert law.friction.tolist() == [0.1, 0.2]
    assert law.compliance.tolist() == [1.0] * 4
    with pytest.raises(dataclasses.FrozenInstanceError):
        law.friction = friction


@pytest.mark.parametrize("friction", [-0.1, np.nan, np.inf, np.array([0.1, -1e-9])])
def test_impossible_friction_is_refused(friction):
    with pytest.raises(ContactError, match="friction must be finite and not negative"):
        contact_law(2, friction)
    with pytest.raises(ContactError, match="friction must be finite and not negative"):
        contact_law(2, 0.1).with_friction(friction)


def test_friction_of_other_pairs_is_refused():
    with pytest.raises(ContactError, match=r"friction has shape \(3,\), not \(2,\)"):
        contact_law(2, np.array([0.1, 0.2, 0.3]))


@pytest.mark.parametrize("compliance", [-1e-9, np.nan, np.inf])
def test_impossible_compliance_is_refused(compliance):
    with pytest.raises(ContactError, match="compliance of the contact must be finite"):
        contact_law(1, 0.1, np.array([0.0, compliance]))


def test_compliance_of_other_pairs_is_refused():
    with pytest.raises(ContactError, match=r"compliance has shape \(2,\), not \(4,\)"):
        contact_law(2, 0.1, np.zeros(2))

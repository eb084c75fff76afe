"""Contact fields against values worked out by hand, with their signs."""

from __future__ import annotations

import numpy as np
import pytest

from microslip.contact.fields import contact_extent, contact_fields

AREA = np.array([2.0, 0.5])
REST = np.array([0.0, 1e-6, -3e-6, 2e-6])


def test_fields_of_two_pairs():
    """One pressed pair that has slipped forward against friction, and one that is open."""
    r = np.array([8.0, 2.0, 0.0, 0.0])
    v = np.array([0.0, 5e-6, -4e-6, -1e-6])
    found = contact_fields(r, v, REST, AREA)
    assert found.pressure.tolist() == [4.0, 0.0]  # 8 N/m over 2 m
    assert found.traction.tolist() == [-1.0, 0.0]  # it pulls the upper body back
    assert found.slip == pytest.approx([4e-6, -3e-6], rel=1e-15)
    assert found.gap.tolist() == [0.0, 4e-6]  # v_n < 0 is open


def test_steps_come_first():
    r = np.array([[1.0, -0.5, 2.0, 1.0], [2.0, 1.0, 4.0, -2.0], [0.0, 0.0, 6.0, 0.0]])
    found = contact_fields(r, np.zeros((3, 4)), REST, AREA)
    assert np.array_equal(found.pressure, [[0.5, 4.0], [1.0, 8.0], [0.0, 12.0]])
    assert np.array_equal(found.traction, [[0.25, -2.0], [-0.5, 4.0], [0.0, 0.0]])
    assert np.array_equal(found.slip, np.tile([-1e-6, -2e-6], (3, 1)))
    assert np.array_equal(found.gap, np.zeros((3, 2)))


def test_tractions_add_up_to_the_forces(reference):
    """Over the pairs of a prestressed joint: what presses is what the clamp gives."""
    s = reference.start.solution
    found = contact_fields(s.r, s.v, s.v, reference.model.area)
    assert found.pressure @ reference.model.area == pytest.approx(reference.start.force, rel=1e-4)
    assert np.array_equal(found.pressure, reference.start.pressure)
    assert not found.slip.any()
    assert np.abs(found.gap[reference.start.touching]).max() < 1e-9 * found.gap.max()
    assert (found.gap[~reference.start.touching] > 0).all()


X = np.array([-3.0, -2.0, -1.0, 0.0, 1.0, 2.0, 3.0])


@pytest.mark.parametrize(
    ("touching", "ends"),
    [
        ("1111111", (-3.0, 3.0)),
        ("0011100", (-1.0, 1.0)),
        ("1001001", (0.0, 0.0)),  # patches at the tips do not count
        ("1100110", (1.0, 2.0)),  # the centre is open: the patch nearest to it
        ("1000000", (-3.0, -3.0)),
    ],
)
def test_extent_is_that_of_the_patch_in_the_middle(touching, ends):
    assert contact_extent(X, np.array([c == "1" for c in touching])) == ends


def test_nothing_touches():
    assert np.isnan(contact_extent(X, np.zeros(7, dtype=bool))).all()

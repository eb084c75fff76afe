"""What motions without stiffness are called: those of bodies held in part, in the plane and in space."""

from __future__ import annotations

import numpy as np
import pytest
import scipy.sparse as sp

from microslip.model.numbering import Numbering
from microslip.model.soundness import zero_modes

RNG = np.random.default_rng(5)


def body(d, known=True):
    """12 nodes at random places, and their degrees of freedom."""
    x = RNG.uniform(-1.0, 1.0, (12, d)) + 3.0
    labels = tuple((node, 1 + axis) for node in range(1, 13) for axis in range(d))
    return x, Numbering(labels, *(np.repeat(x, d, axis=0).T if known else ()))


def names(free, numbering):
    """Of a body whose stiffness is nothing along some motions, and one along all else."""
    basis = np.linalg.qr(np.column_stack(free))[0]
    n = len(basis)
    stiffness = sp.csc_matrix(np.eye(n) - basis @ basis.T)
    return zero_modes(stiffness, sp.eye(n, format="csc"), numbering).names


def turn(x, axis, point):
    """Displacements of a turn about a line in space, or a point in the plane."""
    if x.shape[1] == 2:
        arm = x - point
        return np.column_stack([-arm[:, 1], arm[:, 0]]).ravel()
    return np.cross(axis, x - point).ravel()


def test_a_hinge_turns_about_its_pin():
    x, numbering = body(2)
    assert names([turn(x, None, [0.3, -2.0])], numbering) == ("rotation of the structure",)


def test_in_space_a_door_turns_and_a_slide_slides():
    x, numbering = body(3)
    door = turn(x, [0.2, -0.5, 1.0], [4.0, 1.0, 0.0])
    slide = np.tile([1.0, 1.0, 0.0], 12)
    lift = np.tile([0.0, 0.0, 1.0], 12)
    assert names([door], numbering) == ("rotation of the structure",)
    assert names([door, slide, lift], numbering) == (
        "translation along z of the structure",
        "translation of the structure",
        "rotation of the structure",
    )


def test_what_no_rigid_body_does_is_a_mechanism():
    x, numbering = body(3)
    stretch = x.ravel() - x.mean()
    assert names([stretch], numbering) == ("a mechanism of the structure",)


@pytest.mark.parametrize("d", [2, 3])
def test_without_coordinates_a_rotation_is_guessed(d):
    x, numbering = body(d, known=False)
    found = names([turn(x, [1.0, 1.0, 1.0], np.zeros(d))], numbering)
    assert found == ("another motion of the structure, probably its rotation",)

"""Cycles marched by halves against the same cycles marched whole, and joints without the symmetry."""

from dataclasses import replace

import numpy as np
import pytest

from microslip.analyses.statics.half_turn import find_half_turn
from microslip.analyses.statics.held import hold_mode
from microslip.analyses.statics.prescribed import prescribed_cycle


@pytest.fixture(scope="module")
def held(small_reference):
    mode = small_reference.joint.principal()
    return hold_mode(small_reference.joint, 0.5 * (mode.sliding_omega + mode.stuck_omega), upper=2)


def test_reference_joint_is_its_own_image(held):
    signs = dict(zip(held.model.ports, held.half_turn.signs, strict=True))
    assert signs["clamp"] == 1
    assert signs["moment"] == -1
    assert signs[held.port] == -1


@pytest.mark.parametrize("amplitude", [1e-4, 3e-3, 1e-2])
def test_halves_are_the_whole_cycle(held, amplitude):
    """Both close to 1e-8 of the largest reaction; the sums over a cycle forget what is left."""
    ways = [held, replace(held, half_turn=None)]
    halves, whole = (
        prescribed_cycle(way, amplitude, steps=100, cycles=10, closure=1e-8, harmonics=3)
        for way in ways
    )
    assert halves.force == pytest.approx(whole.force, rel=1e-6)
    assert halves.dissipated == pytest.approx(whole.dissipated, rel=1e-6)
    assert halves.output == pytest.approx(whole.output, abs=1e-6 * np.abs(whole.output).max())
    assert halves.upper == pytest.approx(whole.upper, abs=1e-5 * np.abs(whole.upper).max())


def test_a_load_that_does_not_turn_is_marched_whole(held):
    """A second harmonic on a port that reverses: no image, and both ways are one."""
    order = 2 if held.half_turn.signs[-1] < 0 else 3
    push = {(1, order): 1e-3 * held.hold * 1e-3}
    ways = [held, replace(held, half_turn=None)]
    one, other = (prescribed_cycle(way, 1e-3, steps=60, cycles=3, upper=push) for way in ways)
    assert one.force == other.force


def test_uneven_friction_is_not_its_own_image(held):
    friction = held.friction.copy()
    friction[0] *= 1.01
    image, r = held.half_turn.pairs, held.prestress.solution.r
    assert find_half_turn(image, held.flexibility, friction, r) is None
    assert find_half_turn(None, held.flexibility, held.friction, r) is None

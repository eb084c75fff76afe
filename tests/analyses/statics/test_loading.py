"""Any path of loads: against the cycle, Masing's rules and the energy of the whole."""

from __future__ import annotations

import numpy as np
import pytest

import microslip
from microslip.analyses.statics.loading import load_path
from microslip.errors import JointOpensError, ModelError


@pytest.fixture(scope="module")
def joint():
    return microslip.prepare(microslip.reference_joint(pairs=41))


@pytest.fixture(scope="module")
def stuck(joint):
    """Friction that nothing overcomes."""
    return joint.with_friction(2.0)


def test_two_periods_of_a_sine_are_a_cycle(joint):
    """The second period is what the steady cycle is, by another way to it."""
    theta = 2 * np.pi * np.arange(1, 401) / 200
    found = load_path(joint, {"moment": 400 * np.sin(theta)})
    loop = microslip.cycle(joint, 400.0, steps=200, max_cycles=2, closure=1e-12)
    assert found.output[199:] == pytest.approx(loop.output, rel=1e-9, abs=1e-15)
    assert found.work[-1] - found.work[199] == pytest.approx(loop.friction_work, abs=1e-12)


def test_work_of_the_load_is_stored_or_dissipated(joint):
    """Over a closed path back to the same reactions; trapezoidal work, at second order."""
    errors = []
    for n in (100, 200):
        theta = 2 * np.pi * np.arange(1, 4 * n + 1) / n
        found = load_path(joint, {"moment": 2000 * np.sin(theta)})
        moment, rotation = (y[3 * n - 1 :] for y in found.of("moment"))
        work = 0.5 * (moment[1:] + moment[:-1]) @ np.diff(rotation)
        errors.append(abs(work / (found.dissipated[-1] - found.dissipated[3 * n - 1]) - 1))
    assert errors[1] < 5e-4


def test_more_steps_do_not_move_the_points(stuck):
    """Where hardly a pair changes, the way to a point does not matter."""
    path = np.array([0.1, -0.05, 0.2])
    one, many = (load_path(stuck, {"moment": path}, steps=n) for n in (1, 50))
    assert many.output[:, 1] == pytest.approx(one.output[:, 1], rel=1e-3)


def test_two_ports_at_once_add_up_where_nothing_slips(stuck):
    """Small loads on a stuck joint: superposition."""
    a, b = np.array([0.01, 0.02, 0.03]), np.array([0.5, -0.2, 0.1])
    both = load_path(stuck, {"moment": a, "lift": b})
    one, other = load_path(stuck, {"moment": a}), load_path(stuck, {"lift": b})
    for port in ("moment", "lift"):
        (_, whole), (_, first), (_, second) = (x.of(port) for x in (both, one, other))
        assert np.abs(whole - first - second).max() <= 1e-3 * np.abs(whole).max()


@pytest.mark.parametrize(
    ("loads", "words"),
    [
        ({}, "none"),
        ({"moment": [1.0], "lift": [1.0, 2.0]}, "as many of each"),
        ({"moment": [[1.0]]}, "a path is"),
        ({"moment": []}, "a path is"),
        ({"moment": [np.nan]}, "not finite"),
        ({"twist": [1.0]}, "no port 'twist'"),
    ],
)
def test_what_is_no_path_is_refused(joint, loads, words):
    with pytest.raises(ModelError, match=words):
        load_path(joint, loads)


def test_a_path_that_opens_the_joint_is_refused(joint):
    with pytest.raises(JointOpensError, match=r"holds less than 3\.75e"):
        load_path(joint, {"moment": [1.0, -4e4]})

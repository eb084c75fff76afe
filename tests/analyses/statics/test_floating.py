"""Motions with more inertia than support against a closed form, and against the stuck mode."""

from __future__ import annotations

import numpy as np
import pytest

from microslip.analyses.backbone.points import amplitude_scale
from microslip.analyses.prepared.joint_modes import joint_modes, with_mode_port
from microslip.analyses.statics.floating import Floating, balance
from microslip.analyses.statics.held import hold_port
from microslip.analyses.statics.prescribed import prescribed_cycle
from microslip.errors import ContactError

THETA = np.linspace(0, 2 * np.pi, 41)


def swinging(assumed: float) -> tuple[Floating, float, np.ndarray]:
    """A mass of 1 on a spring of 1, linked by a spring of 2 to ``0.1 sin``, at omega = 3, pushed by 0.5.

    Amplitude ``2 * 0.1 / (1 + 2 - 9)``, mean ``0.5 / (1 + 2)``. The link is taken for `assumed` where
    the search starts.
    """
    support, link, inertia, spring = 1.0, 2.0, 9.0, 400.0
    total = support + assumed - inertia + spring
    floating = Floating(
        spring=spring,
        inertia=np.array([[inertia]]),
        rest=np.array([0.7]),
        mean=np.eye(1),
        answer=np.array([[spring / total]]),
        driven=np.array([assumed / total]),
    )
    held = support + link - inertia + spring
    pushed = (0.5 + link * 0.1 * np.sin(THETA))[:, None] / held
    return floating, spring / held, pushed


@pytest.mark.parametrize("assumed", [2.0, 1.0, 30.0])
def test_a_body_swings_against_the_force_on_it(assumed):
    floating, give, pushed = swinging(assumed)
    seen = []

    def cycle(course):
        seen.append(0.7 + pushed + give * course)
        return seen[-1]

    balance(floating, 0.1, 0.1, 9.0, 1e-9, THETA, cycle)
    motion = seen[-1][:, 0] - 0.7
    # a force of 1e-5 of the mode's stiffness, 9 * 0.1, is let pass
    expected = 0.5 / 3 + 0.2 / (3 - 9) * np.sin(THETA)
    assert np.abs(motion - expected).max() <= 1e-5 * 0.9 / 3 * 1.01


def test_what_does_not_settle_is_named():
    floating, _, _ = swinging(2.0)
    noise = np.random.default_rng(1)
    with pytest.raises(ContactError, match="do not settle"):
        balance(floating, 0.1, 0.1, 9.0, 1e-9, THETA, lambda course: noise.normal(size=(41, 1)))


@pytest.mark.parametrize("number", [2, 3])
def test_a_stuck_joint_moves_as_its_stuck_mode(small_reference, number):
    """At its own frequency ``F_1/Q_1 = omega_st² - omega_sl²``, as the eigenvalue problem has it."""
    joint = small_reference.joint
    mode = joint_modes(joint.model, joint.prestress, joint.law)[number - 1]
    wide = joint.with_model(with_mode_port(joint.model, mode))
    static = np.zeros(len(joint.model.omega), bool)
    held = hold_port(
        wide, mode.port, mode.sliding_omega, mode.stuck_omega, static=static, floats=True
    )
    assert held.floating is not None
    assert (held.flexibility.stiffness >= 0).all()
    cycle = prescribed_cycle(held, 1e-5 * amplitude_scale(joint, mode), steps=40)
    expected = mode.stuck_omega**2 - mode.sliding_omega**2
    assert cycle.force / cycle.q == pytest.approx(expected, rel=1e-6)
    assert cycle.fallbacks.unsolved == 0

"""Stability of bodies that float: motions that store nothing neither grow nor decay."""

from __future__ import annotations

import numpy as np
import pytest

from microslip.analyses.time.scheme import time_scheme
from microslip.analyses.time.stability import stability_of
from microslip.analyses.time.steady import steady_state
from microslip.describe.reading import parse_joint
from microslip.pipeline.prepare import assemble

LOAD = 40.0


@pytest.fixture(scope="module")
def floating():
    """A lap joint without supports, which has soft springs that keep its place."""
    return assemble(
        parse_joint(
            {
                "beams": {"length": 0.32, "thickness": 0.01, "overlap_half_length": 0.05},
                "material": {"youngs_modulus": 210e9, "poissons_ratio": 0.3, "density": 7850.0},
                "contact": {"friction": 0.4, "pairs": 41},
                "clamp": {"force": 8e5, "half_length": 0.03},
                "damping": {"beta": 1e-6},
                "support": {"left": "free", "right": "free"},
                "load": {"moment": [LOAD]},
                "analysis": {"response": {}},
            }
        )
    ).prepared


@pytest.mark.parametrize("frequency", [190.0, 194.9])
@pytest.mark.parametrize("steps", [150, 300])
def test_a_joint_that_floats_is_not_unstable(floating, frequency, steps):
    """Its contact damps vibration, and does nothing to motions of both beams together.

    In a measure that takes these for as stiff as the load, a rate of one is 2 pi times its position a cycle
    later, and projections on single directions grew by a tenth to a third a cycle.
    """
    scheme = time_scheme(floating, 1 / (frequency * steps), frequency=frequency)
    steady = steady_state(scheme, frequency, LOAD, max_cycles=100)
    assert steady.converged
    found = stability_of(scheme, steady)
    assert found.verdict != "unstable"
    assert np.abs(found.values[found.vibration]).max() < 1 + 1e-3


def test_motions_of_both_beams_together_turn_as_on_their_springs_alone(floating):
    """Multipliers ``exp(i omega T)`` of the modes in which the beams move as one rigid body."""
    frequency = 190.0
    scheme = time_scheme(floating, 1 / (frequency * 150), frequency=frequency)
    steady = steady_state(scheme, frequency, LOAD, max_cycles=100)
    found = stability_of(scheme, steady)
    model = scheme.joint.model
    # up and down: both beams stand on equal springs, so that the pairs of modes have one frequency
    bounce = np.sqrt(model.omega[2] * model.omega[3])
    expected = np.exp(1j * bounce / frequency)
    assert np.abs(found.values - expected).min() < 2e-3

"""What a motion is said to be, against what is known of it otherwise."""

from __future__ import annotations

import numpy as np
import pytest

from microslip.analyses.time.classify import motion_of
from microslip.analyses.time.floquet import floquet_multipliers
from microslip.analyses.time.scheme import time_scheme
from microslip.analyses.time.steady import raised_state, steady_state

STEPS = 150


def sought(reference, ratio, **options):
    frequency = reference.joint.mode.sliding_frequency + 1
    scheme = time_scheme(reference.joint, 1 / (frequency * STEPS), frequency=frequency)
    return scheme, steady_state(scheme, frequency, ratio * reference.moment, **options)


def test_a_settled_motion_is_periodic(small_reference):
    scheme, steady = sought(small_reference, 1e-4)
    motion = motion_of(scheme, steady)
    assert motion.kind == "periodic"
    assert motion.period == 1
    assert motion.open_share == 0
    assert motion.said.startswith("periodic, changes by")


def test_marching_is_slowly_attracted_by_the_multiplier(small_reference):
    """Twenty cycles from rest in the sticking joint: the rest decays as its largest multiplier says."""
    scheme, steady = sought(small_reference, 1e-5)
    expected = floquet_multipliers(scheme, steady).largest
    scheme, short = sought(small_reference, 1e-5, accelerate=False, max_cycles=20)
    assert not short.converged
    motion = motion_of(scheme, short)
    print(f"{motion.said}; refined multiplier {expected:.4f}")
    assert motion.kind == "slowly attracting"
    assert motion.multiplier == pytest.approx(expected, abs=2e-3)


def test_raised_slowly_ends_near_the_steady_state(small_reference):
    """The start that is meant where none is given: the search from there is as good as over."""
    scheme, steady = sought(small_reference, 2e-4)
    start = raised_state(scheme, steady.frequency, steady.load, 60)
    again = steady_state(scheme, steady.frequency, steady.load, start=start)
    assert again.converged
    assert np.abs(again.amplitude / steady.amplitude - 1) < 1e-3
    assert again.history[0] < 0.1 * steady.history[0]

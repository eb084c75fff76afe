"""Deviations carried along a motion against differences of motions, and starts taken elsewhere."""

from __future__ import annotations

from dataclasses import fields, replace

import numpy as np
import pytest

from microslip.analyses.time.deviations import StateSpace
from microslip.analyses.time.scheme import State, march, time_scheme
from microslip.analyses.time.starts import placed
from microslip.analyses.time.steady import steady_state

STEPS = 150


def scheme_of(reference, shift, steps=STEPS):
    frequency = reference.joint.mode.sliding_frequency + shift
    return frequency, time_scheme(reference.joint, 1 / (frequency * steps), frequency=frequency)


@pytest.fixture(scope="module", params=[1e-5, 1e-4, 4e-4], ids="M/PL={:g}".format)
def found(request, small_reference):
    frequency, scheme = scheme_of(small_reference, 3.0)
    return scheme, steady_state(scheme, frequency, request.param * small_reference.moment)


def test_deviations_are_the_limit_of_differences(found):
    """The error of a difference falls with the deviation, down to rounding; several directions."""
    scheme, steady = found
    space = StateSpace(scheme, 2 * np.pi * steady.frequency)
    rows, x = space.deviations(()), steady.cycle.state
    exact = space.vibration(
        space.vector(march(scheme, x, steady.cycle.load, tangents=rows).tangents)
    )
    image = march(scheme, x, steady.cycle.load).state
    size = float(np.linalg.norm(space.vibration(space.vector(x))))
    z = space.vector(rows)
    for k in range(0, space.directions, 5):
        errors = []
        for share in (1e-5, 1e-7):
            # small before and after: the softest modes are held by contact alone
            step = share * size / max(np.linalg.norm(a) for a in (space.vibration(z[k]), exact[k]))
            moved = space.state(space.vector(x) + step * z[k], x)
            later = march(scheme, moved, steady.cycle.load).state
            change = space.vibration(space.vector(later) - space.vector(image)) / step
            errors.append(np.linalg.norm(change - exact[k]) / np.linalg.norm(exact[k]))
        print(f"direction {k}: {errors[0]:.1e}, {errors[1]:.1e}")
        assert errors[1] < max(0.1 * errors[0], 2e-3)


def test_a_gap_of_rounding_is_no_opening(small_reference):
    """Stuck at a vanishing load: nothing opens, and one solution a step is enough."""
    frequency, scheme = scheme_of(small_reference, 3.0)
    steady = steady_state(scheme, frequency, 1e-8 * small_reference.moment, tolerance=1e-6)
    assert steady.cycle.iterations[1:].max() == 1


def test_the_end_of_a_steady_state_is_its_own_start(found):
    """On the scheme it comes from: the same state, and nothing is left to search."""
    scheme, steady = found
    again = placed(steady.end, scheme, steady.frequency, steady.load)
    for name in (f.name for f in fields(State)):
        own = getattr(steady.cycle.state, name)
        size = max(float(np.abs(own).max()), 1e-300)
        assert np.abs(getattr(again, name) - own).max() <= 1e-6 * size, name
    warm = steady_state(scheme, steady.frequency, steady.load, start=steady.end)
    assert warm.converged
    assert warm.cycles <= 3
    assert warm.phase == steady.phase


@pytest.mark.parametrize(("shift", "steps"), [(3.25, 150), (3.0, 210)])
def test_a_neighbour_is_a_good_start(small_reference, shift, steps):
    """Another frequency, another number of steps: the state from rest, in fewer cycles."""
    frequency, scheme = scheme_of(small_reference, 3.0)
    load = 1e-4 * small_reference.moment
    first = steady_state(scheme, frequency, load)
    other, finer = scheme_of(small_reference, shift, steps)
    cold = steady_state(finer, other, load)
    warm = steady_state(finer, other, load, start=first.end)
    print(f"cold {cold.cycles} cycles, warm {warm.cycles}")
    assert warm.converged
    assert warm.cycles < cold.cycles
    # locked-in tractions differ with the past
    assert abs(warm.amplitude / cold.amplitude - 1) < 2e-3


def test_a_state_taken_apart_and_put_together(found):
    scheme, steady = found
    space = StateSpace(scheme, 2 * np.pi * steady.frequency)
    state = steady.cycle.state
    again = space.state(space.vector(state), replace(state, eta=0 * state.eta))
    assert (again.eta == state.eta).all()
    assert (again.v == state.v).all()

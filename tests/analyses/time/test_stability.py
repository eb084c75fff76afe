"""Stability as a by-product of the search against Arnoldi's method and marching; stated errors."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from microslip.analyses.time.deviations import StateSpace
from microslip.analyses.time.floquet import floquet_multipliers
from microslip.analyses.time.point import Request
from microslip.analyses.time.points import solve_request
from microslip.analyses.time.scheme import march, time_scheme
from microslip.analyses.time.stability import settling_error, stability_of
from microslip.analyses.time.steady import steady_state
from microslip.errors import MicroslipError

STEPS = 150
FOLD = 7.28e-4
"""Moment over P L under which the response has three states between 170.4 and 171 Hz."""


def sought(reference, ratio, shift=1.0, **options):
    frequency = reference.joint.mode.sliding_frequency + shift
    scheme = time_scheme(reference.joint, 1 / (frequency * STEPS), frequency=frequency)
    return scheme, steady_state(scheme, frequency, ratio * reference.moment, **options)


@pytest.mark.parametrize("ratio", [1e-5, 1e-4, 2e-4, 4e-4], ids="M/PL={:g}".format)
def test_the_largest_multiplier_is_that_of_arnoldi(small_reference, ratio):
    """Two projections of the map on other directions; both say how well they know it."""
    scheme, steady = sought(small_reference, ratio)
    found, other = stability_of(scheme, steady), floquet_multipliers(scheme, steady)
    print(f"{found.largest:.5f} in {found.cycles} cycles, {other.largest:.5f} in {other.cycles}")
    known = max(m.residual[m.vibration][0] for m in (found, other))
    assert found.largest == pytest.approx(other.largest, abs=2 * max(known, 1e-3))
    assert found.verdict == "stable"
    assert found.cycles < other.cycles


def test_without_the_directions_of_a_search(small_reference):
    """A state that was marched to has none: those of the soft modes are marched once."""
    scheme, steady = sought(small_reference, 1e-4)
    found = stability_of(scheme, replace(steady, directions=steady.directions[:0]))
    assert found.largest == pytest.approx(stability_of(scheme, steady).largest, abs=2e-3)


def test_negative_damping(small_reference):
    """The multiplier of a mode whose damping is negative, ``exp(-alpha T/2)`` of the sliding one."""
    reference = small_reference
    alpha, beta = -20.0, reference.model.rayleigh[1]
    joint = reference.joint.with_model(replace(reference.model, rayleigh=(alpha, beta)))
    joint = joint.with_friction(0.0)
    frequency = joint.mode.sliding_frequency + 1
    scheme = time_scheme(joint, 1 / (frequency * STEPS))
    steady = steady_state(scheme, frequency, 1e-8 * reference.moment, tolerance=1e-7)
    found = stability_of(scheme, steady)
    damping = alpha + beta * joint.mode.sliding_omega**2
    assert found.verdict == "unstable"
    assert found.largest == pytest.approx(np.exp(-0.5 * damping / frequency), rel=1e-3)


@pytest.mark.parametrize("ratio", [1e-5, 2e-4], ids="M/PL={:g}".format)
def test_the_error_is_no_smaller_than_the_distance(small_reference, ratio):
    """A state known roughly, and the one that a search from it ends in far below."""
    scheme, rough = sought(small_reference, ratio, tolerance=1e-4)
    fine = steady_state(scheme, rough.frequency, rough.load, start=rough.end, tolerance=1e-8)
    space = StateSpace(scheme, 2 * np.pi * rough.frequency)
    # the cycle that ended in it is one more
    apart = space.change(space.vector(fine.cycle.state), space.vector(rough.cycle.state))
    error = settling_error(rough, stability_of(scheme, rough))
    print(f"change {rough.change:.1e}, apart {apart:.1e}, stated {error:.1e}")
    assert fine.change < 0.1 * rough.change
    assert apart <= 1.5 * error


def test_a_lightly_damped_joint_is_sought_on(small_reference):
    """Stuck, a tenth of the damping: the state is known to a hundred times the tolerance all the same."""
    reference = small_reference
    model = replace(reference.model, rayleigh=(0.0, 0.1 * reference.model.rayleigh[1]))
    joint = reference.joint.with_model(model)
    frequency = joint.mode.stuck_frequency
    request = Request(0.0, frequency, 1e-6 * reference.moment, None, 0j, STEPS)
    point = solve_request(joint, request)
    assert point.settled
    assert point.error <= 100 * request.tolerance
    rough = solve_request(joint, replace(request, stability=False)).steady
    print(f"cycles {rough.cycles} and {point.steady.cycles}, error {point.error:.1e}")
    assert point.steady.change <= rough.change


def test_an_unstable_motion_is_left_for_a_stable_one(small_reference):
    """Between two branches: the middle one is found by its guess, said to be unstable, and not the answer."""
    reference = small_reference
    load = FOLD * reference.moment
    # a guess between the branches may settle on a stable one at once: by rounding, one or the other
    frequencies = (170.75, 170.5, 170.625, 170.875, 171.0)
    requests = (Request(0.8, f, load, None, 0.1 * np.exp(-1j), STEPS) for f in frequencies)
    points = (solve_request(reference.joint, request) for request in requests)
    point = next(point for point in points if point.left is not None)
    left, frequency = point.left, point.steady.frequency
    assert point.settled
    assert point.verdict == "stable"
    assert left.verdict == "unstable"
    assert left.stability.largest > 1.01
    assert abs(point.steady.amplitude) < 0.2 * abs(left.steady.amplitude)
    print(f"amplitude {abs(point.steady.amplitude):.5f}, after {abs(left.steady.amplitude):.5f}")
    # a motion beside the unstable one goes away from it as fast as its multiplier says
    scheme = time_scheme(reference.joint, 1 / (frequency * STEPS), frequency=frequency)
    space = StateSpace(scheme, 2 * np.pi * frequency)
    orbit = left.steady.cycle.state
    x = space.vector(orbit)
    push = left.stability.direction * 1e-3 * np.linalg.norm(space.vibration(x))
    push /= np.linalg.norm(space.vibration(left.stability.direction))
    motions, apart = [orbit, space.state(x + push, orbit)], []
    for _ in range(21):
        motions = [march(scheme, state, left.steady.cycle.load).state for state in motions]
        one, other = (space.vibration(space.vector(state)) for state in motions)
        apart.append(float(np.linalg.norm(other - one)))
    rate = (apart[-1] / apart[0]) ** (1 / 20)
    print(f"multiplier {left.stability.largest:.4f}, marched {rate:.4f}")
    assert rate == pytest.approx(left.stability.largest, abs=0.01)


def test_unsettled_state_is_refused(small_reference):
    scheme, early = sought(small_reference, 1e-4, max_cycles=3)
    with pytest.raises(MicroslipError, match=r"not converged \(last change"):
        stability_of(scheme, early)

"""A joint drawn at random that bounces: no level between a few harmonics and 51 is within 0.3 %."""

from __future__ import annotations

import tomllib

import numpy as np
import pytest

import microslip
from microslip.analyses.harmonic.adaptive import Adaptive
from microslip.analyses.harmonic.over_time import OverTime, state_from_point
from microslip.analyses.harmonic.points import distance
from microslip.analyses.harmonic.problem import harmonic_problem
from microslip.analyses.harmonic.response import frequency_response
from microslip.analyses.time.scheme import time_scheme
from microslip.analyses.time.steady import steady_state

JOINT = """
[beams]
length = "0.0788256 m"
thickness = "0.00396611 m"
overlap_half_length = "0.02857 m"
[material]
youngs_modulus = "7e+10 Pa"
poissons_ratio = 0.3311
density = "2700 kg/m^3"
[contact]
friction = 0.06894
pairs = 51
[clamp]
force = "238247 N/m"
half_length = "0.00946594 m"
[support]
horizontal_spring = "4357.71 N/m/m"
[damping]
beta = "5.6593e-06 s"
[load]
moment_over_clamp_force_length = [0.00147243]
[analysis.response]
"""

LOAD = 0.00147243 * 238247 * 0.0788256
"""N m per metre: of clamp force times length."""

LARGEST, BEFORE, BELOW = 769.722, 751.145, 713.991
"""Hz: of the largest motion, of one half as large, and below the band."""

STEPS = 4000
"""Per cycle. The amplitude of 2,000 is 1e-4 off it."""


@pytest.fixture(scope="module")
def bouncing():
    joint = microslip.prepare(microslip.parse_joint(tomllib.loads(JOINT)))
    response = frequency_response(
        harmonic_problem(joint, harmonics=5),
        LOAD,
        [BELOW, BEFORE, LARGEST],
        adaptive=Adaptive(),
        over_time=OverTime(joint, LOAD),
    )
    return joint, response


@pytest.mark.validate
@pytest.mark.parametrize("frequency", [BEFORE, LARGEST])
def test_a_bouncing_joint_against_fine_steps(bouncing, frequency, finding):
    """From the state of the response, whose bodies stand where they do: next to it, as near as it states."""
    joint, response = bouncing
    points = [point for point in response.points if point.frequency == frequency]
    assert points
    for point in points:
        scheme = time_scheme(joint, 1 / (frequency * STEPS), frequency=frequency)
        start = state_from_point(scheme, point)
        steady = steady_state(scheme, frequency, LOAD, start=start, max_cycles=400)
        assert steady.converged
        off = distance(point.amplitude, steady.amplitude)
        print(f"{frequency} Hz, H = {point.harmonics}: off by {off:.1e}, stated {point.error:.1e}")
        finding("bouncing joint: harmonic balance against 4,000 steps", off, at_most=3e-3)
        assert np.isfinite(point.error)
        assert off <= point.error

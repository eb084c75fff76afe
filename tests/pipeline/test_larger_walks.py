"""Walks of larger motions, to which raising the load does not lead: against one marched from rest."""

from __future__ import annotations

import tomllib
from types import SimpleNamespace

import numpy as np
import pytest

import microslip
from microslip.analyses.time.offset import HORIZON
from microslip.analyses.time.scheme import time_scheme
from microslip.analyses.time.starts import end_of
from microslip.analyses.time.steady import RAISED, raised_state, steady_state
from microslip.analyses.time.watching import watched
from microslip.pipeline import choosing
from microslip.pipeline.marched import raised_and_marched
from microslip.pipeline.search import Search
from microslip.pipeline.targets import STEPS, TOLERANCE, Found, Target
from microslip.pipeline.walk import _Seeking, seek
from microslip.pipeline.walked import kicked, rested_soon

JOINT = """
[beams]
length = "0.113949 m"
thickness = "0.00913759 m"
overlap_half_length = "0.0174094 m"
[material]
youngs_modulus = "1.1e+11 Pa"
poissons_ratio = 0.3548
density = "4430 kg/m^3"
[contact]
friction = 0.74469
pairs = 11
[clamp]
force = "2.73742e+06 N/m"
half_length = "0.00690361 m"
[support]
horizontal_spring = "772639 N/m/m"
[damping]
beta = "1.0911e-06 s"
[load]
moment_over_clamp_force_length = [0.00411076]
"""
"""Drawn at random: its larger motion walks for some 5000 cycles, by which it grows by 2 %."""

FREQUENCY, GUESS = 502.82, 0.0507 * np.exp(-2j)


@pytest.fixture(scope="module")
def joint():
    return microslip.parse_joint(tomllib.loads(JOINT))


@pytest.fixture(scope="module")
def walk(joint):
    """The joint, its load, the larger motion marched from rest: amplitudes, and its state half-way."""
    prepared = microslip.prepare(joint)
    (load,) = joint.load_amplitudes()
    scheme = time_scheme(prepared, 1 / (FREQUENCY * STEPS), frequency=FREQUENCY)
    begun = kicked(scheme, load, GUESS)
    Q, states = watched(scheme, load, begun, int(HORIZON))
    half = end_of(states[len(states) // 2], 0.0, scheme, FREQUENCY)
    return SimpleNamespace(joint=prepared, scheme=scheme, load=load, Q=Q, half=half)


def target(walk, guess):
    """The motion, known half-way."""
    size = abs(walk.Q[-1])
    starts = (((walk.half, 1.0),),)
    return Target(
        0, FREQUENCY, walk.load, guess, starts, cold=False, expected=size, most=size, steps=STEPS
    )


def off(found, walk):
    return abs(abs(found.amplitude) / abs(walk.Q[-1]) - 1)


def test_what_begins_at_rest_has_the_velocity_of_the_motion(walk):
    """It is past its middle when the load is, as the motion is, and one cycle later in phase with it."""
    assert abs(np.angle(walk.Q[0] / GUESS)) < 0.3
    assert abs(walk.Q[0]) == pytest.approx(abs(GUESS), rel=0.3)


def test_a_larger_motion_walks_from_rest(walk):
    """Raising leads to another; the search begins where bodies are after 2000 cycles."""
    raised = raised_state(walk.scheme, FREQUENCY, walk.load, RAISED)
    assert abs(watched(walk.scheme, walk.load, raised, 50)[0][-1]) < 0.5 * abs(walk.Q[-1])
    assert abs(walk.Q[400] / walk.Q[-1]) < 0.995, "the walk tells"
    found = seek(walk.joint, target(walk, 0j))
    assert off(found, walk) <= found.doubt < 2e-3


def test_it_does_where_it_was_found_later(walk):
    """By a search for it that began half-way; from there it would be that of a longer walk."""
    steady = steady_state(walk.scheme, FREQUENCY, walk.load, start=walk.half, tolerance=TOLERANCE)
    found = Found(steady.amplitude, steady.change, 1e-4, walk.half, 10)
    search = _Seeking(walk.scheme, target(walk, 0j))
    there = search.at_rest(found)
    assert off(there, walk) <= there.doubt < 2e-3
    longer = rested_soon(walk.scheme, steady, walk.half)
    assert off(longer.steady, walk) > 2e-3


def test_it_does_where_it_is_marched(walk):
    """From rest with its velocity; from where its bodies have been it would be that of a longer walk."""
    (found,) = raised_and_marched(walk.joint, [target(walk, walk.Q[-1])])
    assert off(found, walk) <= found.doubt < 2e-3
    (later,) = raised_and_marched(walk.joint, [target(walk, 0j)])
    assert off(later, walk) > 2e-3


@pytest.mark.parametrize("rest", [None, np.zeros(1)])
def test_what_is_known_to_walk_begins_at_rest(rest):
    """What does not is marched from its own state, with what is locked in there."""
    base = SimpleNamespace(frequency=np.array([100.0]), load=1.0)
    search = Search(None, base, 10)
    search.found[0] = Found(2j, 0.0, 1e-4, "", 10, rest=rest)
    assert choosing._marched_target(search, 0).guess == (0j if rest is None else 2j)

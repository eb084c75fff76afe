"""Motions that vary from cycle to cycle for good, with more steps, against the same marched alone."""

import tomllib
from dataclasses import replace

import numpy as np
import pytest
from unstable_joint import LOAD, UNSTABLE

import microslip
from microslip.analyses.reduced.anchors import Anchor
from microslip.analyses.time.resting import at_phase_0
from microslip.analyses.time.scheme import time_scheme
from microslip.analyses.time.starts import end_of, placed
from microslip.analyses.time.steady import steady_state
from microslip.analyses.time.watching import watched
from microslip.pipeline import more_steps as module
from microslip.pipeline.doubts import as_doubtful, by_themselves, doubt_with, doubted, variation
from microslip.pipeline.more_steps import with_more_steps
from microslip.pipeline.stepping import Stepping
from microslip.pipeline.targets import Found, More, Stepped

FREQUENCY, GUESS, STEPS = 430.0, -0.01578 - 0.01356j, 150
"""Where the larger motion of the joint beats by some per cent for good, Hz, and its first harmonic, m."""


@pytest.fixture(scope="module")
def beating():
    """The joint, and that motion with 150 steps: its mean and its state after 400 cycles."""
    joint = microslip.prepare(microslip.parse_joint(tomllib.loads(UNSTABLE)))
    scheme = time_scheme(joint, 1 / (FREQUENCY * STEPS), frequency=FREQUENCY)
    steady = steady_state(
        scheme, FREQUENCY, LOAD, guess=GUESS, tolerance=1e-6, max_cycles=300, halves=False
    )
    Q, states = watched(scheme, LOAD, at_phase_0(scheme, steady), 400)
    end = end_of(states[-1], 0.0, scheme, FREQUENCY)
    return joint, complex(Q[-200:].mean()), end


def test_what_varies_is_told_by_more_steps(beating):
    """Its mean, and how far sizes stray from that: against as many steps for 500 cycles."""
    joint, mean, end = beating
    more = with_more_steps(joint, LOAD, Stepped(FREQUENCY, mean, end, STEPS, varies=True))
    scheme = time_scheme(joint, 1 / (FREQUENCY * 4 * STEPS), frequency=FREQUENCY)
    start = placed(end, scheme, FREQUENCY, LOAD)
    sizes = np.abs(watched(scheme, LOAD, start, 500)[0][-250:])
    strays = np.abs(sizes / sizes.mean() - 1).max()
    assert 0.01 < strays < 0.1
    assert more.varies == more.strays == pytest.approx(strays, rel=0.2)
    assert abs(more.amplitude) == pytest.approx(sizes.mean(), rel=2e-3)
    assert more.drifts < 0.01


def test_what_creeps_does_not_vary_for_good(monkeypatch, beating):
    """Its mean goes on by more from block to block than it strays by in one: so it may for as long again."""
    joint, mean, end = beating
    blocks = iter(range(module.BLOCKS))

    def creeping(*given):
        ramp = np.linspace(0.0, 1.0, module.BLOCK) + next(blocks)
        return mean * (1 + 0.005 * ramp), ["later"]

    monkeypatch.setattr(module, "watched", creeping)
    more = with_more_steps(joint, LOAD, Stepped(FREQUENCY, mean, end, STEPS, varies=True))
    assert more.varies == 0
    assert more.drifts > 0.01


@pytest.mark.parametrize("phase", np.linspace(0, 2 * np.pi, 12, endpoint=False))
@pytest.mark.parametrize("period", [60, 100, 130, 160])
def test_the_mean_of_what_beats_slowly_with_more_steps_is_known(
    monkeypatch, beating, period, phase
):
    """Of a beat of 5 % in so many cycles, wherever it is looked at first."""
    joint, mean, end = beating
    blocks = iter(range(module.BLOCKS))

    def slowly(*given):
        n = np.arange(module.BLOCK) + module.BLOCK * next(blocks)
        return mean * (1 + 0.05 * np.cos(2 * np.pi * n / period + phase)), ["later"]

    monkeypatch.setattr(module, "watched", slowly)
    monkeypatch.setattr(module, "placed", lambda *given: end)
    more = with_more_steps(joint, LOAD, Stepped(FREQUENCY, mean, end, STEPS, varies=True))
    assert abs(abs(more.amplitude) / abs(mean) - 1) <= more.drifts


def test_what_leaves_with_more_steps_has_none(monkeypatch, beating):
    joint, mean, end = beating
    sizes, beat = iter([mean, 0.5 * mean]), 1 + 0.03 * np.cos(0.4 * np.arange(module.BLOCK))
    monkeypatch.setattr(module, "watched", lambda *given: (next(sizes) * beat, ["later"]))
    more = with_more_steps(joint, LOAD, Stepped(FREQUENCY, mean, end, STEPS, varies=True))
    assert more.amplitude is None
    assert more.strays == np.inf


@pytest.mark.parametrize(("grows", "varies"), [(1.0, True), (1.15, False), (0.0, False)])
def test_what_is_still_on_its_way_with_more_steps_does_not_vary_for_good(
    monkeypatch, beating, grows, varies
):
    """It strays all the same; and what repeats with more steps does neither."""
    joint, mean, end = beating
    beats = iter(0.03 * grows ** np.arange(1, 99))
    wave = np.cos(0.4 * np.arange(module.BLOCK))
    monkeypatch.setattr(module, "watched", lambda *given: (mean * (1 + next(beats) * wave), [end]))
    monkeypatch.setattr(module, "placed", lambda *given: end)
    more = with_more_steps(joint, LOAD, Stepped(FREQUENCY, mean, end, STEPS, varies=True))
    assert abs(more.amplitude) == pytest.approx(abs(mean), rel=2e-3)
    assert (more.varies > 0) == varies
    assert (more.strays >= 0.02) == (grows > 0)


def test_how_far_a_motion_varies_is_said_by_more_steps_where_they_tell():
    """It varies by 7 % with few steps, and its mean is known to 1 %."""
    found, stepping = Found(1 + 0j, 0.0, 0.08, "", 10, varies=0.07), Stepping()
    assert variation(stepping, 3, found) == 0.07
    assert doubt_with(stepping, 3, found) == pytest.approx(0.08)
    stepping.keep(3, More(1 + 0j, 10, 0.05, 0.002, varies=0.05))
    assert variation(stepping, 3, found) == 0.05
    assert doubt_with(stepping, 3, found) == pytest.approx(0.01 + 0.05)
    stepping.keep(3, More(1 + 0j, 10, 0.05, 0.02, varies=0.05))
    assert doubt_with(stepping, 3, found) == pytest.approx(0.02 + 0.05)
    stepping.keep(3, More(1 + 0j, 10, 0.05, 0.002))  # it has not been seen to go on
    assert doubt_with(stepping, 3, found) == pytest.approx(0.05)
    stepping.keep(3, More(None, 10))
    assert variation(stepping, 3, found) == 0.07


def test_what_rings_with_few_steps_is_no_doubt_where_more_have_told():
    """Where they have not, or have led elsewhere, it is one; so is what the place of rest is not known by."""
    found, stepping = Found(1 + 0j, 0.0, 0.021, "", 10, rings=0.02), Stepping()
    assert doubt_with(stepping, 3, found) == pytest.approx(0.021)
    stepping.keep(3, More(None, 10))
    assert doubt_with(stepping, 3, found) == pytest.approx(0.021)
    stepping.keep(3, More(1 + 0j, 10))
    assert doubt_with(stepping, 3, found) == pytest.approx(0.001)
    stepping.keep(3, More(1 + 0j, 10, strays=0.005, drifts=0.002, varies=0.004))
    assert doubt_with(stepping, 3, found) == pytest.approx(0.002 + 0.004)


def test_a_motion_beside_one_that_varies_may_vary_and_is_no_better_known():
    sure, vague = (
        Anchor(f, 1 + 0j, 0j, 0.0, doubt) for f, doubt in ((100.0, 0.001), (102.0, 0.03))
    )
    moving = Anchor(101.0, 1 + 0j, 0j, 0.0, 0.082, varies=0.08)
    one = as_doubtful(sure, moving)
    assert (one.varies, one.doubt) == pytest.approx((0.0, 0.082))
    other = as_doubtful(vague, moving)
    assert (other.varies, other.doubt) == pytest.approx((0.0, 0.11))
    less = as_doubtful(replace(moving, varies=0.03, doubt=0.04), moving)
    assert (less.varies, less.doubt) == pytest.approx((0.08, 0.09))
    between = as_doubtful(replace(moving, varies=0.01, doubt=0.011), moving, moving)
    assert (between.varies, between.doubt) == pytest.approx((0.03, 0.082))
    more = as_doubtful(moving, sure)
    assert (more.varies, more.doubt) == pytest.approx((0.08, 0.082))
    # a beat beside it that was not seen to go on is no error of its mean besides
    assert as_doubtful(moving, vague).doubt == pytest.approx(0.082)
    assert as_doubtful(replace(moving, varies=0.01, doubt=0.012), vague).doubt == pytest.approx(
        0.03
    )


def test_beside_a_jump_a_motion_is_as_well_known_as_those_of_its_own_branch():
    """The larger ones beat by 3 %; the smaller ones next to them are at rest as well, and do not."""
    anchors = {
        k: Anchor(100.0 + k, size + 0j, 0j, 0.0, 1e-4)
        for k, size in enumerate((2.0, 2.0, 2.0, 0.1, 0.1))
    }
    found = {
        k: Found(one.amplitude, 0.0, one.doubt, "", 10, scatter=0.0, rest=np.zeros(1))
        for k, one in anchors.items()
    }
    found[2] = replace(found[2], varies=0.03, doubt=0.031)
    anchors[2] = replace(anchors[2], doubt=0.031)
    stepping = Stepping()
    alone = by_themselves(anchors, found, set(found), 0.0, stepping)
    known = doubted(alone, found, (), stepping)
    assert [known[k].doubt for k in range(5)] == pytest.approx([1e-4, 0.031, 0.031, 1e-4, 1e-4])


def test_beside_a_mean_that_drifts_one_that_beats_is_no_better_known():
    """What is off by a beat that was not seen to go on says nothing of a mean; what drifts does."""
    anchors = {k: Anchor(100.0 + k, 1 + 0j, 0j, 0.0, 0.03) for k in range(2)}
    found = {k: Found(1 + 0j, 0.0, 1e-3, "", 10, scatter=0.0, rest=np.zeros(1)) for k in range(2)}
    for strays, drifts, mean in ((0.03, 0.0, 1e-3), (0.03, 0.03, 0.03)):
        stepping = Stepping()
        stepping.keep(0, More(1 + 0j, 10, 0.03, varies=0.029))
        stepping.keep(1, More(1 + 0j, 10, strays, drifts))
        alone = by_themselves(anchors, found, set(found), 0.0, stepping)
        known = doubted(alone, found, (), stepping)
        assert known[0].doubt - known[0].varies == pytest.approx(mean)

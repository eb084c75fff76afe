"""What is said of responses of harmonic balance whose bodies walk past each other."""

from __future__ import annotations

import tomllib

import pytest
from walking_joints import WEAKLY_DAMPED, better_held

from microslip.describe.reading import parse_joint
from microslip.pipeline.run import run
from microslip.results.summary import summary


def responses(joint=WEAKLY_DAMPED, **harmonic):
    """Cautions of harmonic balance and its responses at 466.48 Hz."""
    band = {"frequencies": [466.48, 475.0], "stability": False}
    described = tomllib.loads(joint) | {"analysis": {"harmonic": band | harmonic}}
    done = run(parse_joint(described))
    found = [row for row in summary(done)["harmonic"] if row["frequency_hz"] == 466.48]
    return [str(each) for each in done.cautions if each.stage == "harmonic"], found


@pytest.fixture(scope="module")
def fixed():
    return responses(harmonics=5)


@pytest.fixture(scope="module")
def adaptive():
    return responses(harmonics="adaptive")


def test_given_harmonics_walk_from_where_the_clamp_has_put_the_bodies(fixed):
    cautions, (row,) = fixed
    (said,) = (each for each in cautions if "walk past each other" in each)
    assert "in each cycle; the response is the one where they stand" in said
    assert 'harmonics = "adaptive" follows them' in said
    assert row["walked_m"] < 1e-6 < 1e3 * abs(row["walk_m_per_cycle"])


def test_adaptive_ones_follow_them(adaptive, fixed):
    """Farther than a thousand cycles at the speed from which they slow down."""
    cautions, (row,) = adaptive
    (said,) = (each for each in cautions if "walk past each other" in each)
    assert "or for 4000 cycles: the response is the one there" in said
    (before,) = fixed[1]
    first = abs(before["walk_m_per_cycle"])
    assert 1000 * first < row["walked_m"] < 4000 * first
    assert row["modal_amplitude"] > 1.01 * before["modal_amplitude"]


def test_bodies_that_rest_far_from_where_they_were_clamped_are_named_too():
    """Supports that are not soft hold them: nothing walks in the equations, but the place is another."""
    cautions, (row,) = responses(better_held(30.0), harmonics=5)
    (said,) = (each for each in cautions if "walk past each other" in each)
    assert "until soft supports hold them" in said
    assert row["walk_m_per_cycle"] == 0
    assert row["walked_m"] > 1e-5

"""Harmonics that are too few are said to be, where the contact makes more of them than are kept."""

from __future__ import annotations

from conftest import description

from microslip.describe.reading import parse_joint
from microslip.pipeline.run import run


def cautions(moment, **harmonic):
    band = {"frequencies": [172.0, 176.0], "stability": False}
    joint = description(21, 30, load={"moment": [moment]}, analysis={"harmonic": band | harmonic})
    done = run(parse_joint(joint))
    assert not done.failures
    return [str(each) for each in done.cautions if each.stage == "harmonic"]


def test_a_small_load_makes_one_harmonic_and_a_large_one_more():
    """So small that the joint sticks it is linear, and the first harmonic is all there is."""
    assert cautions(1e-4, harmonics=3) == []
    (said,) = cautions(60.0, harmonics=3)
    assert said.startswith("harmonic, M = 60 N m/m, 17")
    assert "the last two of 3 harmonics hold" in said
    assert 'take harmonics = "adaptive"' in said
    assert cautions(60.0, harmonics="adaptive", most=9) == []


def test_one_harmonic_shows_nothing_of_the_others():
    (said,) = cautions(60.0, harmonics=1)
    assert "with 1 harmonic nothing shows what is left out" in said

"""Beams that lie within their overlap: no section carries the moment alone, and stresses are not known."""

from __future__ import annotations

import math

import pytest

from microslip.describe.reading import parse_joint
from microslip.pipeline.estimate import estimate
from microslip.pipeline.judge import judge
from microslip.pipeline.run import run
from microslip.results.summary import summary


@pytest.fixture(scope="module")
def joint():
    return parse_joint(
        {
            "beams": {"length": 0.3, "thickness": 0.003, "overlap_half_length": 0.15},
            "material": {
                "youngs_modulus": 210e9,
                "poissons_ratio": 0.3,
                "density": 7850.0,
                "yield_stress": 5e6,
            },
            "contact": {"friction": 0.15, "pairs": 61},
            "clamp": {"force": 2e5, "half_length": 0.14},
            "damping": {"beta": 1e-6},
            "load": {"moment": [2.0]},
            "analysis": {"cycle": {"moment": [2.0, 20.0]}},
        }
    )


def test_no_stress_is_said_and_a_caution_says_so(joint):
    judged = judge(run(joint))
    assert math.isnan(judged.stress)
    assert judged.deflection > 0
    said = [str(caution) for caution in judged.cautions]
    assert sum("the bending stress is not known" in one for one in said) == 1
    assert not any("nan" in one for one in said)


def test_the_summary_has_none(joint):
    stress = summary(run(joint))["stress"]
    assert stress["largest_bending_stress_pa"] is None
    assert stress["where"].startswith("cycle, M/(PL) = 0.000333")


def test_nor_does_an_estimate_say_one(joint):
    assert math.isnan(estimate(joint).resonant_stress)

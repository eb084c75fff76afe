"""What cannot be is refused, what is unlikely is questioned, and a sound joint is neither."""

from __future__ import annotations

import math
import tomllib

import pytest
from conftest import ROOT
from wrong_inputs import RIGHT, put, puts

from microslip.describe.beam import bending_stiffnesses, first_frequency, surface_stress
from microslip.describe.keys import sections
from microslip.describe.lap import LapJoint
from microslip.describe.plausible import TABLE, mean_pressure, pairs_across_clamp, questions
from microslip.describe.reading import load_joint, parse_joint
from microslip.describe.reference import reference_joint
from microslip.errors import InputError


def asked(change) -> list[str]:
    """Questions about the right joint after a change."""
    return [str(q) for q in questions(parse_joint(tomllib.loads(change(RIGHT))))]


@pytest.mark.parametrize("file", sorted((ROOT / "examples").glob("*.toml")), ids=lambda f: f.name)
def test_examples_are_not_questioned(file):
    joint = load_joint(file)
    assert not isinstance(joint, LapJoint) or questions(joint) == ()


@pytest.mark.parametrize(
    ("path", "literal", "says"),
    [
        ("beams.thickness", '"2 m"', ["beams.thickness = 2 m", "usual is 100 µm to 500 mm"]),
        ("beams.thickness", "2", ["beams.thickness = 2 m", "a number without one is SI"]),
        ("beams.thickness", '"50 um"', ["beams.thickness = 50 µm"]),
        ("beams.length", '"25.15 m"', ["beams.length = 25.15 m", "usual is 5 mm to 20 m"]),
        ("material.youngs_modulus", "70e6", ["material.youngs_modulus = 70 MPa", "100 MPa"]),
        ("material.youngs_modulus", '"70000 GPa"', ["usual is 100 MPa to 1.3 TPa"]),
        ("material.density", "2.0", ["material.density = 2 kg/m^3", "50 kg/m^3 to 23000 kg/m^3"]),
        ("material.density", '"2000 g/cm^3"', ["material.density = 2e+06 kg/m^3"]),
        ("material.poissons_ratio", "0.499", ["does not change its volume"]),
        ("material.poissons_ratio", "-0.3", ["material.poissons_ratio = -0.3"]),
        ("material.yield_stress", '"250 Pa"', ["material.yield_stress = 250 Pa", "1 MPa to 5 GPa"]),
        ("contact.friction", "0.001", ["contact.friction = 0.001", "metals have 0.1 to 0.8"]),
        ("contact.friction", "1.9", ["contact.friction = 1.9"]),
        ("contact.pairs", "9", ["the number of pairs across the clamp is 5.33", "raise contact"]),
        ("clamp.force", '"1 GN/m"', ["the mean pressure", "per metre of width"]),
        ("clamp.half_length", '"100 um"', ["clamp.half_length = 100 µm", "an edge"]),
        ("support.horizontal_spring", '"1e13 N/m/m"', ["support.horizontal_spring = 1e+13"]),
        ("damping.beta", '"0.73 ms"', ["damping.beta = 730 µs", "the damping ratio", "0.73 us"]),
        ("damping.alpha", '"500 1/s"', ["damping.alpha = 500 1/s", "the damping ratio"]),
        ("load.moment", "1e-6", ["[load]", "moments are per metre of width"]),
    ],
)
def test_what_is_not_usual_is_asked_by_name(path, literal, says):
    found = "\n".join(asked(put(path, literal)))
    for words in says:
        assert words in found
    assert "input, " in found


def test_a_clamp_force_that_lost_its_unit():
    (said,) = asked(puts(clamp__force="50", load__moment="1e-3"))
    assert "clamp.force = 50 N/m: usual is 100 N/m to 1 GN/m" in said


def test_questions_stand_with_what_cannot_be():
    """Why it cannot be is often the other key."""
    with pytest.raises(InputError) as caught:
        parse_joint(tomllib.loads(put("material.youngs_modulus", "70")(RIGHT)))
    assert "clamp.force" in str(caught.value)
    assert "material.youngs_modulus = 70 Pa: usual is" in str(caught.value)


def test_frictionless_joints_and_free_ends_are_meant():
    assert asked(puts(contact__friction="0", support__horizontal_spring="0")) == []


def test_damping_is_judged_at_the_resonance():
    """beta omega/2 = alpha/(2 omega) = 1 at the first frequency of the beam, which is refused."""
    omega = 2 * math.pi * first_frequency(reference_joint())
    for path, critical in (("damping.beta", 2 / omega), ("damping.alpha", 2 * omega)):
        parse_joint(tomllib.loads(put(path, repr(0.999 * critical))(RIGHT)))
        with pytest.raises(InputError, match=path):
            parse_joint(tomllib.loads(put(path, repr(1.001 * critical))(RIGHT)))


def test_derived_numbers_of_the_reference_joint():
    joint = reference_joint()
    assert mean_pressure(joint) == pytest.approx(20e6)
    assert pairs_across_clamp(joint) == pytest.approx(200 * 25 / 37.5)
    assert bending_stiffnesses(joint)[0] == pytest.approx(70e9 / 0.91 * 0.0125**3 / 12)
    # M = sigma h²/6 per width
    assert surface_stress(joint, 60.0) * 0.0125**2 / 6 == pytest.approx(60.0)


@pytest.mark.parametrize("row", TABLE, ids=lambda row: row.quantity or row.key)
def test_every_range_says_what_to_do(row):
    assert row.low < row.high <= row.most or math.isinf(row.high)
    assert row.remedy
    assert row.key == "load" or row.key.rpartition(".")[0] in {s.path for s in sections()}
    assert not row.quantity or row.reason


def test_what_is_usual_does_not_depend_on_the_size_of_units():
    """The same joint, written in other units, is asked the same."""
    inches = puts(beams__thickness='"0.4921259842519685 inch"', clamp__force='"1000 kN/m"')
    assert asked(inches) == asked(lambda text: text) == []

"""Two different beams, clamps off the middle, and tables along x: what is read and what is refused."""

from __future__ import annotations

import pytest
from conftest import description

from microslip.describe.lap import WEAKEST_SPRING
from microslip.describe.profile import Profile
from microslip.describe.reading import parse_joint
from microslip.errors import InputError


def joint(**sections):
    document = description(21, 20, analysis={})
    for name, keys in sections.items():
        document[name] = {**document.get(name, {}), **keys}
    return parse_joint(document)


def test_the_upper_beam_has_what_it_says_and_else_what_the_lower_one_has():
    found = joint(beams={"upper": {"thickness": "8 mm"}}, material={"upper": {"density": 7850}})
    assert found.beams.lengths == (0.2515, 0.2515)
    assert found.beams.thicknesses == (0.0125, 0.008)
    assert found.material.densities == (2000.0, 7850.0)
    assert found.material.moduli == (70e9, 70e9)
    assert not found.symmetric


def test_a_ratio_of_zero_is_a_ratio():
    assert joint(material={"upper": {"poissons_ratio": 0}}).material.ratios == (0.3, 0.0)


def test_friction_is_a_number_or_a_table():
    table = joint(contact={"friction": [["-10 mm", 0.1], ["10 mm", 0.3]]})
    assert table.contact.friction == Profile((-0.01, 0.01), (0.1, 0.3))
    assert table.friction == pytest.approx(0.2)
    assert joint().friction == 0.25


def test_resultant_of_a_clamp():
    """Of a triangle that grows to the right: two thirds of the way."""
    clamp = {"half_length": "15 mm", "pressure": [["-15 mm", 0], ["15 mm", 2]], "centre": "2 mm"}
    found = joint(clamp=clamp)
    assert found.clamp.resultant == pytest.approx(0.002 - 0.015 + 2 / 3 * 0.03)
    assert found.opening_ratio == pytest.approx((0.0375 - 0.007) / 0.2515)


def test_a_spring_too_weak_to_matter_is_raised_and_no_other():
    beam = 70e9 * 0.0125 / 0.2515
    free = joint(support={"horizontal_spring": 0, "left": "free"})
    assert free.spring_used == free.weak_spring == pytest.approx(WEAKEST_SPRING * beam)
    assert joint(support={"horizontal_spring": 1e5}).spring_used == 1e5


@pytest.mark.parametrize(
    ("sections", "words"),
    [
        ({"beams": {"upper": {"length": "-1 m"}}}, ["beams.upper.length", "greater than 0"]),
        ({"beams": {"upper": {"lenght": "1 m"}}}, ["beams.upper.lenght", "length"]),
        (
            {"beams": {"upper": {"length": "60 mm"}}},
            ["overlap_half_length", "upper.length", "0.03"],
        ),
        ({"beams": {"upper": {"thickness": "1 nm"}}}, ["beams.upper.thickness", "20000"]),
        ({"material": {"upper": {"poissons_ratio": 0.5}}}, ["material.upper.poissons_ratio"]),
        ({"material": {"upper": {"plane": "stress"}}}, ["material.upper.plane"]),
        ({"clamp": {"centre": "13 mm"}}, ["clamp.centre", "0.0125 m"]),
        ({"clamp": {"centre": "13 N"}}, ["clamp.centre", "length"]),
        ({"clamp": {"pressure": "even"}}, ["clamp.pressure", '"uniform", "parabolic"']),
        ({"clamp": {"pressure": 3}}, ["clamp.pressure", '"uniform"']),
        ({"clamp": {"pressure": [[0, 1]]}}, ["clamp.pressure", "at least two points"]),
        ({"clamp": {"pressure": [[0, 1], 2]}}, ["clamp.pressure", "point 2"]),
        ({"clamp": {"pressure": [[0, 1], ["10 mm", -2]]}}, ["point 2", "greater than or equal"]),
        ({"clamp": {"pressure": [["5 mm", 1], [0, 2]]}}, ["point 2", "to the right"]),
        ({"clamp": {"pressure": [[0, 0], ["5 mm", 0]]}}, ["clamp.pressure", "nothing presses"]),
        ({"clamp": {"pressure": [["-26 mm", 1], [0, 2]]}}, ["clamp.half_length", "distances"]),
        (
            {"contact": {"friction": [[0, 0.1], ["5 mm", 3]]}},
            ["point 2", "less than or equal to 2"],
        ),
        ({"contact": {"friction": [["5 s", 0.1], ["5 mm", 1]]}}, ["point 1", "length"]),
        ({"contact": {"friction": []}}, ["contact.friction", "at least two points"]),
        ({"support": {"left": "welded"}}, ["support.left", "pinned", "clamped", "free"]),
    ],
)
def test_what_is_wrong_is_named(sections, words):
    with pytest.raises(InputError) as error:
        joint(**sections)
    for word in words:
        assert word in str(error.value)

"""What may be asked of a joint, and sections that come from outside."""

from __future__ import annotations

import itertools
import pickle

import pytest
from joint_files import EXAMPLE, example_document, refused
from pydantic import Field, model_validator

from microslip.describe.lap import LapJoint
from microslip.describe.quantities import Count, Length, Rule, Section
from microslip.describe.reading import load_joint, parse_joint
from microslip.describe.requests import Requests, add_section, remove_section


@pytest.fixture
def document() -> dict:
    return example_document()


def test_amplitudes_are_evenly_spaced_in_their_logarithm():
    amplitudes = load_joint(EXAMPLE).cycle_amplitudes()
    largest = 0.85 * 37.5 / 251.5
    assert (len(amplitudes), amplitudes[0]) == (25, 5e-5)
    assert amplitudes[-1] == pytest.approx(largest)
    ratios = [b / a for a, b in itertools.pairwise(amplitudes)]
    assert ratios == pytest.approx([(largest / 5e-5) ** (1 / 24)] * 24)


def test_listed_amplitudes(document):
    document["analysis"]["cycle"] = {"moment_over_clamp_force_length": [1e-3, 1e-4]}
    assert parse_joint(document).cycle_amplitudes() == (1e-4, 1e-3)


def test_frequencies_run_from_end_to_end(document):
    document["analysis"]["response"] = {"from": "0.17 kHz", "to": 180, "count": 5}
    response = parse_joint(document).analysis.response
    assert response is not None
    assert (response.from_, response.to, response.count) == (170.0, 180.0, 5)
    document["analysis"]["response"] = {"to": 180}
    response = parse_joint(document).analysis.response
    assert response is not None
    assert (response.from_, response.to) == (None, 180.0)


@pytest.mark.parametrize(
    ("table", "change", "part"),
    [
        (
            "cycle",
            {"smallest": 0.1, "largest": 0.05},
            "analysis.cycle.largest = 0.05: must be above smallest, 0.1",
        ),
        ("cycle", {"smallest": 0.14}, "analysis.cycle.smallest = 0.14: must be below the largest"),
        ("cycle", {"drives": []}, "analysis.cycle.drives = []: must be"),
        ("cycle", {"drives": ["mode", "mode"]}, "twice"),
        ("cycle", {"drives": ["modes"]}, "'moment' or 'mode'"),
        ("cycle", {"steps": 10}, "analysis.cycle.steps = 10"),
        ("cycle", {"moment_over_clamp_force_length": 0.01, "count": 3}, "remove count"),
        ("response", {"from": 120, "to": 100}, "analysis.response.to = 100: must be above"),
        ("response", {"from": "-1 Hz"}, 'analysis.response.from = "-1 Hz"'),
        ("response", {"from": "60 rpm"}, "angular frequency"),
        ("response", {"variants": ["other"]}, "'printed', 'consistent' or 'refined'"),
        ("reduced", {"variant": ["refined", "refined"]}, "names one thing twice"),
        ("reduced", {"amplitudes": 3}, "analysis.reduced.amplitudes = 3"),
    ],
)
def test_contradictory_analyses(document, table, change, part):
    document["analysis"][table] = change
    assert part in refused(document)


@pytest.mark.parametrize(
    ("change", "part"),
    [
        ({"from": 0, "to": 5, "count": 3}, "analysis.time.from = 0: must be greater than 0"),
        ({"frequencies": [170, -1]}, "analysis.time.frequencies[1] = -1: must be greater than 0"),
        ({"frequencies": 170, "steps": 19}, "analysis.time.steps = 19: must be greater than or"),
        ({"frequencies": 170, "positions": 1}, "analysis.time.positions = 1: 1 m lies off"),
        ({"frequencies": 170, "max_cycles": 1}, "analysis.time.max_cycles = 1"),
        ({}, "give a list of frequencies"),
    ],
)
def test_a_wrong_steady_state_analysis_is_named(document, change, part):
    document["analysis"]["time"] = change
    assert part in refused(document)


def test_what_is_asked_for(document):
    document["analysis"] = {"cycle": {}, "reduced": {"steps": 100}, "backbone": {}}
    assert parse_joint(document).analysis.asked == ("cycle", "backbone")
    document["analysis"] = {"history": {"signal": "sine", "frequency": 1, "cycles": 1, "moment": 1}}
    assert parse_joint(document).analysis.asked == ("history",)
    assert Requests().asked == ()


# A section that an analysis from outside brings with it.


class Wear(Section):
    """Wear after a number of cycles."""

    cycles: Count = Field(default=100, ge=1)
    depth: Length | None = Field(default=None, gt=0)
    start: int = Field(default=0, alias="from")

    @model_validator(mode="after")
    def _starts_before_the_end(self):
        if self.start >= self.cycles:
            raise Rule("from", f"must be below cycles, {self.cycles}")
        return self


@pytest.fixture
def wear():
    add_section("wear", Wear)
    yield Wear
    remove_section("wear")


def test_a_section_from_outside_is_read(document, wear):
    assert parse_joint(document).analysis.wear is None
    document["analysis"]["wear"] = {"depth": "2 um", "from": 3}
    joint = parse_joint(document)
    assert (joint.analysis.wear.cycles, joint.analysis.wear.start) == (100, 3)
    assert joint.analysis.wear.depth == pytest.approx(2e-6)
    assert joint.analysis.cycle is not None
    assert joint.analysis.asked == ("cycle", "response", "wear")
    document["analysis"]["wear"] = {}
    assert parse_joint(document).analysis.wear == Wear()


@pytest.mark.parametrize(
    ("section", "message"),
    [
        ({"cycles": 0}, "analysis.wear.cycles = 0: must be greater than or equal to 1"),
        ({"cycels": 5}, "analysis.wear.cycels is not a known key; the nearest in [analysis.wear]"),
        ({"xyzzy": 5}, "in [analysis.wear] there are cycles, depth, from"),
        ({"depth": "1 N"}, 'analysis.wear.depth = "1 N"'),
        ({"from": 200}, "analysis.wear.from = 200: must be below cycles, 100"),
        (3, "analysis.wear = 3: must be a section, [analysis.wear]"),
    ],
)
def test_mistakes_in_a_section_from_outside_are_named(document, wear, section, message):
    document["analysis"]["wear"] = section
    assert message in refused(document)


def test_its_name_is_proposed_where_it_was_misspelt(document, wear):
    document["analysis"]["waer"] = {}
    assert "the nearest in [analysis] is 'wear'" in refused(document)


def test_without_it_the_section_is_unknown(document):
    document["analysis"]["wear"] = {}
    assert "analysis.wear is not a known key" in refused(document)
    add_section("wear", Wear)
    assert parse_joint(document).analysis.wear == Wear()
    remove_section("wear")
    assert "analysis.wear is not a known key" in refused(document)
    del document["analysis"]["wear"]
    assert not hasattr(parse_joint(document).analysis, "wear")


def test_a_joint_with_a_section_from_outside_is_stored(document, wear):
    document["analysis"]["wear"] = {"cycles": 7}
    joint = parse_joint(document)
    for again in (
        pickle.loads(pickle.dumps(joint)),
        LapJoint.model_validate_json(joint.model_dump_json(by_alias=True, exclude_unset=True)),
        joint.model_copy(deep=True),
    ):
        assert again == joint
        assert again.analysis.wear.cycles == 7
    assert '"wear":{"cycles":7}' in joint.model_dump_json(exclude_unset=True)


def test_a_joint_read_before_asks_for_none_of_it(document):
    before = parse_joint(document)
    text = before.model_dump_json()
    add_section("wear", Wear)
    try:
        assert before.analysis.wear is None
        assert before.analysis.asked == ("cycle", "response")
        assert pickle.loads(pickle.dumps(before)).analysis.wear is None
    finally:
        remove_section("wear")
    assert before.model_dump_json() == text
    assert parse_joint(document) == before


def test_a_section_may_be_called_like_a_signal(document):
    add_section("measured", Wear)
    try:
        document["analysis"]["measured"] = {"cycels": 0}
        assert "nearest in [analysis.measured] is 'cycles'" in refused(document)
        document["analysis"]["measured"] = {"cycles": 0}
        document["analysis"]["history"] = [{"signal": "measured", "file": "no.csv", "colum": 1}]
        message = refused(document)
        assert "analysis.measured.cycles = 0: must be" in message
        assert "the nearest in [analysis.history[0]] is 'column'" in message
    finally:
        remove_section("measured")


@pytest.mark.parametrize("name", ["cycle", "history", "asked", "model_fields", "copy"])
def test_a_name_that_is_taken_is_refused(name):
    with pytest.raises(ValueError, match="already"):
        add_section(name, Wear)


@pytest.mark.parametrize("name", ["two words", "from", "_hidden", "", "3d"])
def test_a_name_that_cannot_be_an_attribute_is_refused(name):
    with pytest.raises(ValueError, match="cannot be the name"):
        add_section(name, Wear)


def test_only_what_was_added_can_be_removed(wear):
    with pytest.raises(ValueError, match="already"):
        add_section("wear", Wear)
    for name in ("cycle", "nothing"):
        with pytest.raises(ValueError, match="was added"):
            remove_section(name)

"""A load by its moment, its ratio to P L, or rho."""

from __future__ import annotations

import pytest
from joint_files import example_document, refused

from microslip.describe.amplitude import (
    LOAD_KEYS,
    RHO_CONSTANT,
    Amplitude,
    Load,
    OneAmplitude,
)
from microslip.describe.reading import parse_joint


@pytest.fixture
def document() -> dict:
    return example_document()


def test_one_moment_or_many(document):
    document["load"] = {"moment": "50 N*m/m"}
    assert parse_joint(document).load_amplitudes() == (50.0,)
    document["load"] = {"moment": [50, "0.1 kN*m/m"]}
    assert parse_joint(document).load_amplitudes() == (50.0, 100.0)
    document["load"] = {"moment_over_clamp_force_length": 2e-4}
    assert parse_joint(document).load_amplitudes() == pytest.approx((50.3,))


def test_rho_is_a_function_of_the_joint_alone(document):
    """``M = C mu P L / rho``, whatever is computed, how finely and by which model."""
    document["load"] = {"rho": [0, 2.4, 5]}
    by_hand = RHO_CONSTANT * 0.25 * 1e6 * 0.2515
    moments = parse_joint(document).load_amplitudes()
    assert moments == pytest.approx((by_hand / 2.4, by_hand / 5))
    for section, change in (
        ("contact", {"pairs": 51}),
        ("mesh", {"modes": 20, "max_layer": 0.4}),
        ("support", {"horizontal_spring": 1e3}),
        ("damping", {"beta": 1e-5}),
    ):
        document[section] = {**document.get(section, {}), **change}
        assert parse_joint(document).load_amplitudes() == moments
    for analysis in (
        {"cycle": {"count": 3, "steps": 50}, "response": {"variants": ["printed", "consistent"]}},
        {"response": {"from": 100, "to": 300, "count": 11}, "reduced": {"amplitudes": 8}},
        {"harmonic": {"frequencies": [170, 180]}},
    ):
        assert parse_joint({**document, "analysis": analysis}).load_amplitudes() == moments
    document["load"]["rho_scale"] = 3 * RHO_CONSTANT
    assert parse_joint(document).load_amplitudes() == pytest.approx([3 * m for m in moments])


@pytest.mark.parametrize(
    ("load", "key"),
    [
        ({}, "load: give exactly one of"),
        ({"moment": 50, "rho_scale": 1.0}, "load.rho_scale = 1.0: only belongs to load.rho"),
        ({"rho": 1, "greatest_damping_at": 2.4}, "load.greatest_damping_at"),
        ({"moment": 0}, "load.moment = 0: must be greater than 0"),
    ],
)
def test_contradictory_loads(document, load, key):
    document["load"] = load
    message = refused(document)
    assert key in message.replace("[load]", "load")


@pytest.mark.parametrize("key", LOAD_KEYS)
def test_one_key_gives_the_load(key):
    assert (Load(**{key: 3}).kind, Load(**{key: 3}).values) == (key, (3.0,))
    one = OneAmplitude(**{key: 3})
    assert (one.load_key, one.check_load(), getattr(one, key)) == (key, key, 3.0)


@pytest.mark.parametrize(
    ("given", "found"),
    [({}, "none"), ({"moment": 1, "rho": 2}, "moment and rho")],
)
def test_a_load_and_a_history_are_refused_in_the_same_words(given, found):
    message = (
        "give exactly one of moment, moment_over_clamp_force_length, rho, force, acceleration, "
        "pressure; found " + found
    )
    with pytest.raises(ValueError, match=message):
        Load(**given)
    with pytest.raises(ValueError, match=message):
        OneAmplitude(**given).check_load()
    assert OneAmplitude().load_key is None


def test_no_friction_is_a_load_but_no_history():
    """rho = 0 is the joint without friction, which [load] knows and a history cannot be."""
    assert Load(rho=0).values == (0.0,)
    with pytest.raises(ValueError, match="greater than 0"):
        OneAmplitude(rho=0)


def test_the_keys_are_those_of_every_section_with_a_load():
    for section in (Load, OneAmplitude):
        assert issubclass(section, Amplitude)
        assert [key for key in section.model_fields if key in LOAD_KEYS] == list(LOAD_KEYS)

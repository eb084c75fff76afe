"""A load by its moment, its ratio to P L, or rho."""

from __future__ import annotations

import pytest
from joint_files import example_document, refused

from microslip.describe.amplitude import LOAD_KEYS, Amplitude, Load, OneAmplitude
from microslip.describe.reading import parse_joint


@pytest.fixture
def document() -> dict:
    return example_document()


def test_one_moment_or_many(document):
    document["load"] = {"moment": "50 N*m/m"}
    assert parse_joint(document).load_moments() == (50.0,)
    document["load"] = {"moment": [50, "0.1 kN*m/m"]}
    assert parse_joint(document).load_moments() == (50.0, 100.0)
    document["load"] = {"moment_over_clamp_force_length": 2e-4}
    assert parse_joint(document).load_moments() == pytest.approx((50.3,))


@pytest.mark.parametrize(
    ("load", "key"),
    [
        ({}, "load: give exactly one of"),
        ({"moment": 50, "rho_scale": 1.0}, "load.rho_scale = 1.0: only belongs to load.rho"),
        ({"moment": 50, "greatest_damping_at": 2.4}, "load.greatest_damping_at = 2.4: only"),
        ({"rho": 1, "greatest_damping_at": 2.4, "rho_scale": 0.01}, "load.rho_scale = 0.01"),
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
    message = "give exactly one of moment, moment_over_clamp_force_length, rho; found " + found
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

"""Sections ``[[output]]``: what they may say, and what is said of mistakes."""

from __future__ import annotations

from typing import get_args

import pytest
from joint_files import example_document, refused

from microslip.describe.outputs import QUANTITIES, USUAL, AnyQuantityName, QuantityName
from microslip.describe.reading import parse_joint


def with_outputs(*outputs):
    return {**example_document(), "output": list(outputs)}


def test_without_any_the_usual_ones_are_reported():
    joint = parse_joint(example_document())
    assert joint.outputs == USUAL
    assert [o.quantity for o in joint.outputs] == ["deflection", "rotation", "slip"]


def test_every_quantity_can_be_written():
    assert set(get_args(AnyQuantityName)) == set(QUANTITIES)
    beams = get_args(QuantityName)
    outputs = [{"name": f"o{k}", "quantity": q} for k, q in enumerate(beams)]
    assert len(parse_joint(with_outputs(*outputs)).outputs) == len(beams)


@pytest.mark.parametrize("quantity", ["reaction", "reaction moment"])
def test_reactions_of_beams_are_of_an_end(quantity):
    said = refused(with_outputs({"name": "hold", "quantity": quantity}))
    assert 'output[0].x: a reaction is of a support: give "left end" or "right end"' in said


def test_positions_have_units_or_words():
    joint = parse_joint(
        with_outputs({"name": "a", "x": "-12.5 mm"}, {"name": "b", "x": "right end"})
    )
    assert [o.x for o in joint.outputs] == [-0.0125, "right end"]
    single = parse_joint({**example_document(), "output": {"name": "a"}})
    assert single.outputs[0].x == "middle"


@pytest.mark.parametrize(
    ("output", "said"),
    [
        ({}, "output[0].name is missing"),
        ({"name": "a b"}, 'output[0].name = "a b": must be a letter followed by'),
        ({"name": "a", "x": "tip"}, 'or one of "middle", "left end", "right end", "clamp edge"'),
        ({"name": "a", "x": "50 kg"}, "output[0].x"),
        ({"name": "a", "x": 0.5}, "0.5 m lies off the joint, which reaches from -0.214 to 0.214"),
        ({"name": "a", "beam": "upper", "x": -0.1}, "-0.1 m lies off the upper beam"),
        ({"name": "a", "quantity": "slip", "x": "0.1 m"}, "lies off the overlap"),
        ({"name": "a", "side": "contact", "x": "0.1 m"}, "lies off the overlap"),
        ({"name": "a", "quantity": "slip", "beam": "upper"}, "output[0].beam"),
        ({"name": "a", "quantity": "gap", "side": "top"}, "output[0].side"),
        ({"name": "a", "quantity": "rotation", "side": "top"}, "turns as a whole"),
        ({"name": "a", "quantity": "stress"}, "output[0].quantity"),
        ({"name": "a", "where": 1}, "output[0].where is not a known key"),
    ],
)
def test_mistakes(output, said):
    assert said in refused(with_outputs(output))


def test_two_of_one_name():
    assert "two outputs are called 'a'" in refused(with_outputs({"name": "a"}, {"name": "a"}))

"""Wrong values in any key: our words, never those of a library, and never a traceback."""

from __future__ import annotations

import copy
from typing import Any, get_args

import pytest
from hypothesis import given
from hypothesis import strategies as st
from joint_files import example_document, refused
from pydantic import BaseModel, TypeAdapter, ValidationError
from pydantic_core import core_schema

from microslip.describe.excitation import SIGNALS
from microslip.describe.lap import LapJoint
from microslip.describe.reading import allowed, parse_joint
from microslip.errors import InputError

FOREIGN = ("should", "Input", "Tuple", "validat", "pydantic", "Extra inputs", "Field required")
"""Words of the library, none of which is ours."""

LOAD = {"moment_over_clamp_force_length": 0.01}
HISTORIES: list[dict[str, Any]] = [
    {"signal": "sine", "frequency": 170, "cycles": 3, "name": "a", **LOAD},
    {"signal": "stepped_sine", "from": 170, "to": 180, "count": 3, "cycles": 3, **LOAD},
    {"signal": "swept_sine", "from": 170, "to": 180, "duration": 1, **LOAD},
    {"signal": "free_decay", "start": "mode", "modal_amplitude": 1e-3, "duration": 1},
    {"signal": "measured", "file": __file__},
]


def full_document() -> dict[str, Any]:
    """The reference joint with every section that there is."""
    found = example_document()
    band = {"from": "170 Hz", "to": "180 Hz", "count": 3}
    found["analysis"] = {
        "cycle": {},
        "response": {},
        "reduced": {},
        "backbone": {},
        "harmonic": dict(band),
        "time": dict(band),
        "history": copy.deepcopy(HISTORIES),
    }
    return found


def sections(model: type[BaseModel], place: tuple[str | int, ...] = ()) -> list[Any]:
    """Place and model of every section of a joint file."""
    found: list[Any] = [(place, model)]
    for name, info in model.model_fields.items():
        for choice in (info.annotation, *get_args(info.annotation)):
            if isinstance(choice, type) and issubclass(choice, BaseModel):
                found += sections(choice, (*place, info.alias or name))
    return found


def every_key() -> list[tuple[str | int, ...]]:
    """Place of every key of a joint file."""
    found = sections(LapJoint)
    found += [
        (("analysis", "history", k), SIGNALS[entry["signal"]]) for k, entry in enumerate(HISTORIES)
    ]
    return [
        (*place, info.alias or name)
        for place, model in found
        for name, info in model.model_fields.items()
    ]


KEYS = every_key()
WORDS = ["", "x", "nan", "12 mm", "-1 Hz", "1e400 m", "adaptive", "steady", "2 s", "rho", "a" * 300]
WORDS += ["\0", "5 parsec/fortnight", "mode", "1e-320 mm"]
NUMBERS = st.sampled_from([0, -1, 1, 2.5, 1e-300, 1e300, -1e300, 5e-324, 10**30, 10**400, 7])
LEAVES = (
    st.none()
    | st.booleans()
    | NUMBERS
    | st.integers()
    | st.floats()
    | st.sampled_from(WORDS)
    | st.text(max_size=8)
)
VALUES = LEAVES | st.lists(LEAVES, max_size=3) | st.dictionaries(st.text(max_size=4), LEAVES)


def put(document: dict[str, Any], place: tuple[str | int, ...], value: object) -> None:
    """Replace a value; where an earlier one took the section away there is nothing to replace."""
    target: Any = document
    for part in place[:-1]:
        try:
            target = target[part]
        except (KeyError, IndexError, TypeError):
            target = None
    if isinstance(target, dict):
        target[place[-1]] = value


def test_the_document_has_every_section():
    parse_joint(full_document())
    assert {key[:-1] for key in KEYS} >= {("beams",), ("analysis", "time"), ("load",)}


@given(st.lists(st.tuples(st.sampled_from(KEYS), VALUES), min_size=1, max_size=3))
def test_wrong_values_are_answered_in_our_words(changes):
    document = full_document()
    for place, value in changes:
        put(document, place, value)
    try:
        parse_joint(document, "my.toml")
    except InputError as error:
        message = str(error)
        written = [value for _, value in changes]
        for word in FOREIGN:
            assert word not in message or any(word in str(value) for value in written), message


@pytest.mark.parametrize("value", [float("nan"), [], {}, "a" * 300, 10**400, True, None, [[1]]])
@pytest.mark.parametrize("key", KEYS, ids=lambda key: ".".join(map(str, key)))
def test_every_key_answers_every_kind_of_value_in_our_words(key, value):
    document = full_document()
    put(document, key, value)
    try:
        parse_joint(document, "my.toml")
    except InputError as error:
        foreign = [word for word in FOREIGN if word in str(error)]
    else:
        foreign = []
    assert not foreign


@pytest.mark.parametrize("kind", [*get_args(core_schema.ErrorType)])
def test_every_error_of_the_library_has_our_words(kind):
    context = {"expected": "'a' or 'b'", "pattern": "^a$", "min_length": 1, "max_length": 2}
    context |= dict.fromkeys(("gt", "ge", "lt", "le", "multiple_of"), 3)
    said = allowed(kind, context)
    assert said.startswith(("must be ", "must have ", "must match ", "keys must ", "is of a kind"))
    assert not [word for word in FOREIGN if word in said]


@pytest.mark.parametrize(
    ("kind", "value"),
    [
        (dict[str, int], {1: 2}),
        (tuple[int, ...], 3),
        (set[int], 3),
        (bool, "x"),
        (bytes, 1.5),
    ],
)
def test_kinds_that_sections_from_outside_may_have(kind, value):
    with pytest.raises(ValidationError) as caught:
        TypeAdapter(kind).validate_python(value)
    for error in caught.value.errors():
        assert "cannot be used" not in allowed(error["type"], error.get("ctx", {}))


@pytest.mark.parametrize(
    ("key", "value", "said"),
    [
        (("contact", "pairs"), 5.5, "contact.pairs = 5.5: must be a whole number"),
        (("contact", "pairs"), 5003, "must be less than or equal to 5001"),
        (("material", "plane"), "flat", "must be 'strain' or 'stress'"),
        (("analysis", "harmonic", "stability"), 1, "stability = 1: must be true or false"),
        (("title",), 3, 'title = 3: must be text in quotation marks, "..."'),
        (("title",), "x" * 201, "must have at most 200 characters"),
        (("analysis", "backbone", "steps"), 30, "steps = 30: must be a multiple of 4"),
        (("analysis", "history", 0, "name"), "1 a", "must be a letter followed by letters"),
        (("analysis", "history", 0, "cycles"), 1e7, "must be less than or equal to 1000000"),
        (("analysis", "history", 4, "column"), "", "must have at least 1 character"),
        (("analysis", "history", 4, "file"), "a" * 300, "no such file"),
        (("beams", "thickness"), 5e-324, "too large or too small to compute with"),
    ],
)
def test_what_is_said(key, value, said):
    document = full_document()
    put(document, key, value)
    assert said in refused(document)

"""The input reference and the template: every key described, once, and what they say is so."""

from __future__ import annotations

import importlib.util
import json
import tomllib

import pytest
from conftest import ROOT
from joint_files import EXAMPLE, example_document
from pydantic import Field

from microslip.describe.keys import Key, key_of, sections
from microslip.describe.lap import LapJoint
from microslip.describe.matrices import MatricesJoint
from microslip.describe.mesh import MeshJoint
from microslip.describe.plausible import TABLE
from microslip.describe.quantities import Count, Section
from microslip.describe.reading import load_joint, parse_joint
from microslip.describe.requests import add_section, remove_section
from microslip.describe.saved_model import ModelJoint
from microslip.describe.template import commented, template
from microslip.errors import InputError

EVERY = [(section, key) for section in sections() for key in section.keys]
IDS = [f"{section.path}.{section.signal}.{key.name}" for section, key in EVERY]


@pytest.mark.parametrize(("section", "key"), EVERY, ids=IDS)
def test_every_key_says_what_it_means_and_where_it_matters(section, key):
    assert key.meaning
    assert key.matters
    assert key.allowed
    assert section.meaning


@pytest.mark.parametrize(("section", "key"), EVERY, ids=IDS)
def test_a_default_is_what_reading_a_file_gives(section, key):
    """The default, written out, changes nothing."""
    if key.default in ("", "–") or section.listed:
        return
    document = example_document()
    document["load"] = {"rho": [2.4]}
    band = {"frequencies": [170, 180]}
    document["analysis"] |= {"backbone": {}, "time": dict(band), "harmonic": dict(band)}
    if section.path == "analysis.harmonic":
        document["analysis"]["harmonic"]["harmonics"] = "adaptive"
        if key.name == "harmonics":
            return
    place = document
    for part in filter(None, section.path.split(".")):
        place = place.setdefault(part, {})
    place.pop(key.name, None)
    before = parse_joint(document)
    place[key.name] = json.loads(key.default)
    assert parse_joint(document) == before


def test_limits_are_those_that_the_file_is_held_to():
    found = {(s.path, k.name): k for s, k in EVERY}
    assert found["contact", "friction"].allowed == "number, 0 to 2; or a table along x"
    assert found["contact", "pairs"].allowed == "whole number, 5 to 5001"
    assert found["material", "poissons_ratio"].allowed == "number, above -1 and below 0.5"
    assert found["material", "plane"].allowed == '"strain" or "stress"'
    assert found["beams", "length"].unit == "m"
    for place, wrong in [("friction", 2.01), ("pairs", 5002), ("pairs", 4), ("friction", -0.01)]:
        document = example_document()
        document["contact"][place] = wrong
        with pytest.raises(InputError, match=f"contact.{place}"):
            parse_joint(document)


def test_a_section_from_outside_is_in_the_reference():
    class Wear(Section):
        """Wear of the surfaces."""

        count: Count = Field(default=3, ge=1)
        """How many. Nothing."""

    add_section("wear", Wear)
    try:
        found = next(s for s in sections() if s.path == "analysis.wear")
    finally:
        remove_section("wear")
    assert found.meaning == "Wear of the surfaces"
    assert found.keys == (
        Key("count", "", "3", "whole number, at least 1", "How many", "Nothing."),
    )


def test_a_key_without_a_word_about_it():
    class Silent(Section):
        count: Count = 3

    assert key_of("count", Silent.model_fields["count"]).meaning == ""


# -- template ----------------------------------------------------------------------------------


def test_template_is_the_example_with_every_default_written_out(tmp_path):
    (tmp_path / "joint.toml").write_text(template(), encoding="utf-8")
    assert load_joint(tmp_path / "joint.toml") == load_joint(EXAMPLE)


@pytest.mark.parametrize(("section", "key"), EVERY, ids=IDS)
def test_template_has_every_key_and_its_meaning(section, key):
    text = " ".join(template().replace("#", " ").split())
    assert f"{key.name} = " in text
    assert key.meaning in text or section.signal


def test_template_with_everything_in_use_is_understood(tmp_path):
    """Without the marks that comment keys out, each stands where it belongs."""
    lines = [
        line.removeprefix("# ") for line in template().splitlines() if not line.startswith("   ")
    ]
    entries = [line for line in lines if line.startswith("[") or " = " in line.partition("#")[0]]
    seen: set[str] = set()
    for line in entries:  # a key that stands twice in one section is an alternative
        tomllib.loads(line)
        seen.add(line.split(" ")[0])
    names = {name for s in sections() for name in (k.name for k in s.keys)}
    headings = {s.heading for s in sections()} - {""}
    assert seen == names | headings


def test_template_keeps_to_the_width_where_values_do():
    assert max(map(len, template().splitlines())) <= 101


@pytest.mark.parametrize(
    ("key", "value", "shown"),
    [
        ("horizontal_spring", '"1e5 N/m/m"', False),
        ("horizontal_spring", '"100 N/mm/m"', False),  # 100 / 1e-3
        ("horizontal_spring", "1e5", False),
        ("horizontal_spring", '"0.1 N/m/m"', True),
        ("horizontal_spring", '"0 N/m/m"', True),
        ("left", '"pinned"', False),
        ("left", '"clamped"', True),
    ],
)
def test_a_default_stands_beside_another_value_alone_in_whatever_units(key, value, shown):
    assert ("default" in commented(f"[support]\n{key} = {value}\n")) == shown


def test_a_template_with_a_key_that_there_is_not():
    with pytest.raises(LookupError, match="lenght"):
        commented('[beams]\nlenght = "1 m"\n')
    with pytest.raises(LookupError, match="bems"):
        commented("[bems]\n")


# -- documentation -----------------------------------------------------------------------------


def test_the_reference_lists_every_key():
    script = ROOT / "docs" / "_scripts" / "input_reference.py"
    spec = importlib.util.spec_from_file_location("input_reference", script)
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    text = module.page()
    for section, key in EVERY:
        assert f"| `{key.name}` | {key.unit} | " in text
        assert key.meaning in text
        assert section.heading in text
    keys, _, ranges = text.partition("## What is usual")
    assert all(f"| `{row.key}` | {row.quantity or 'itself'} | " in ranges for row in TABLE)
    rows = [line for line in keys.splitlines() if line.startswith("|")]
    assert {row.replace("\\|", "").count("|") for row in rows} == {7}
    assert LapJoint.model_fields["title"].description.split(".")[0] in text


# -- matrices and meshes -------------------------------------------------------------------------

SHARED = {section.keys for section in sections()}
OWN = [
    (kind, section.path, key)
    for kind, model in (
        ("matrices", MatricesJoint),
        ("mesh", MeshJoint),
        ("model", ModelJoint),
    )
    for section in sections(model)
    if section.keys not in SHARED
    for key in section.keys
]


@pytest.mark.parametrize(
    ("kind", "key"),
    [(kind, key) for kind, _, key in OWN],
    ids=[f"{kind}.{path}.{key.name}" for kind, path, key in OWN],
)
def test_template_of_other_joints_has_every_key_and_its_meaning(kind, key):
    assert key.meaning
    assert key.matters
    text = " ".join(template(kind).replace("#", " ").split())
    assert f"{key.name} = " in text
    assert key.meaning in text


def test_template_of_matrices_names_files_that_are_not_there(tmp_path):
    (tmp_path / "joint.toml").write_text(template("matrices"), encoding="utf-8")
    with pytest.raises(InputError) as caught:
        load_joint(tmp_path / "joint.toml")
    problems = str(caught.value).splitlines()[1:]
    assert problems
    assert all(line.endswith("no such file") for line in problems)

"""Pictures of the documentation: none without a recipe, none older than what it shows."""

from __future__ import annotations

import functools
import json
import sys
import tomllib

import pytest
from conftest import ROOT

sys.path.insert(0, str(ROOT / "tools"))
import pictures

from microslip import opening_load, parse_joint, prepare

JOINT = {"beams", "material", "contact", "clamp", "support", "damping", "mesh"}
"""Sections that say what the joint is, and not what is asked of it."""

DRAWN = {name: stamp for name, stamp in pictures.stamps().items() if stamp["joint"]}


def test_no_picture_is_older_than_what_it_shows():
    old = {name: why for name, why in pictures.stale().items() if why != pictures.UNSTAMPED}
    assert old == {}, "make pictures"


@functools.cache
def facts(described):
    """Of a joint, from its description."""
    joint = prepare(parse_joint(json.loads(described)))
    return {
        "sliding_frequency_hz": joint.principal().sliding_frequency,
        "stuck_frequency_hz": joint.principal().stuck_frequency,
        "opening": opening_load(joint),
    }


@pytest.mark.parametrize("name", DRAWN)
def test_the_joint_is_still_what_the_picture_shows(name):
    """Frequencies and opening moment, computed again."""
    document = tomllib.loads((ROOT / pictures.recipes()[name].joint).read_text("utf-8"))
    scale = parse_joint(document, folder=ROOT / "examples").clamp_force_length
    joint = {key: document[key] for key in sorted(JOINT & set(document))}
    found = facts(json.dumps(joint | {"analysis": {}}))
    shown = dict(DRAWN[name]["joint"])
    shown["opening"] = scale * shown.pop("opening_moment_over_clamp_force_length")
    assert shown == pytest.approx(found, rel=1e-6)


def test_a_change_of_a_value_is_noticed_and_a_comment_is_not(tmp_path):
    text = (ROOT / "examples" / "lap_joint.toml").read_text("utf-8")
    plain, commented, other = (tmp_path / f"{name}.toml" for name in ("plain", "comment", "other"))
    plain.write_text(text)
    commented.write_text("# said once more\n" + text)
    other.write_text(text.replace("friction = 0.25", "friction = 0.26"))
    assert pictures.meaning(plain) == pictures.meaning(commented) != pictures.meaning(other)


def test_a_change_of_drawing_code_is_noticed_and_a_docstring_is_not(tmp_path):
    plain, said, other = (tmp_path / f"{name}.py" for name in ("plain", "said", "other"))
    plain.write_text("def f(x):\n    return x\n")
    said.write_text('def f(x):\n    """Itself."""\n    return x  # as it is\n')
    other.write_text("def f(x):\n    return 2 * x\n")
    assert pictures.meaning(plain) == pictures.meaning(said) != pictures.meaning(other)


def test_every_example_is_in_the_gallery_with_its_picture():
    page = (ROOT / "docs" / "gallery.md").read_text("utf-8")
    sections = {part.split("\n")[0]: part for part in page.split("\n## ")[1:]}
    assert sorted(sections) == sorted(p.name for p in (ROOT / "examples").glob("*.toml"))
    for recipe in pictures.recipes().values():
        if recipe.joint:
            section = sections[recipe.joint.removeprefix("examples/")]
            assert any(f"(images/{file})" in section for file in recipe.figures)

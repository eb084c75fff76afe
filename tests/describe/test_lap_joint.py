"""Sections of a lap joint: what they say of the reference joint, and what they refuse."""

from __future__ import annotations

import xml.etree.ElementTree as ET

import pytest
from joint_files import EXAMPLE, example_document, refused

from microslip.describe.reading import load_joint, parse_joint
from microslip.errors import InputError


@pytest.fixture
def document() -> dict:
    return example_document()


def test_example_is_the_reference_joint():
    joint = load_joint(EXAMPLE)
    beams = joint.beams
    assert (beams.lengths, beams.thicknesses) == ((0.2515,) * 2, (0.0125,) * 2)
    assert beams.overlap_half_length == 0.0375
    assert joint.symmetric
    material = joint.material
    assert (material.youngs_modulus, material.poissons_ratio) == (70e9, 0.3)
    assert (material.density, material.plane) == (2000.0, "strain")
    assert (joint.contact.friction, joint.contact.pairs_used) == (0.25, 201)
    assert (joint.clamp.force, joint.clamp.half_length) == (1e6, 0.025)
    assert joint.support.horizontal_spring == 1e5
    assert (joint.damping.alpha, joint.damping.beta) == (0.0, 7.3e-7)
    assert joint.load is not None
    assert (joint.load.kind, joint.load.values) == ("moment", (10.0, 20.0, 50.0))
    assert joint.analysis.cycle is not None
    assert joint.analysis.response is not None


def test_a_joint_cannot_be_changed():
    joint = load_joint(EXAMPLE)
    with pytest.raises(ValueError, match="frozen"):
        joint.clamp.force = 2e6  # type: ignore[misc]


@pytest.mark.parametrize(("written", "used"), [(5, 5), (6, 7), (200, 201), (201, 201)])
def test_even_number_of_pairs_is_raised_by_one(document, written, used):
    document["contact"]["pairs"] = written
    contact = parse_joint(document).contact
    assert (contact.pairs, contact.pairs_used) == (written, used)


def test_without_analysis_everything_is_computed(document):
    with_empty_tables = parse_joint(document)
    del document["analysis"]
    assert parse_joint(document) == with_empty_tables


def test_cycles_alone_need_no_load(document):
    del document["analysis"]["response"], document["load"]
    joint = parse_joint(document)
    assert joint.load is None
    assert joint.load_amplitudes() == ()


@pytest.mark.parametrize(
    ("section", "key", "value", "parts"),
    [
        ("beams", "length", "-1 m", ['beams.length = "-1 m"', "greater than 0"]),
        ("beams", "thickness", 0, ["beams.thickness = 0", "greater than 0"]),
        ("beams", "overlap_half_length", "0.2 m", ['= "0.2 m"', "0.12575 m"]),
        ("beams", "thickness", "1 nm", ["beams.thickness", "20000", "beams.length"]),
        ("beams", "length", float("nan"), ["beams.length", "finite"]),
        ("beams", "length", "nan mm", ["beams.length", "finite"]),
        ("clamp", "force", float("inf"), ["clamp.force", "finite"]),
        ("clamp", "force", 0, ["clamp.force", "greater than 0"]),
        ("clamp", "force", "1 MN", ['"1 MN"', "per metre of width", "1 MN/m"]),
        ("clamp", "half_length", "40 mm", ['clamp.half_length = "40 mm"', "0.0375 m"]),
        (
            "material",
            "youngs_modulus",
            "70 GHz",
            ['material.youngs_modulus = "70 GHz"', "modulus of elasticity", '"70 GPa"'],
        ),
        ("material", "youngs_modulus", "70 GPA", ["not a known unit", '"70 GPa"']),
        ("material", "youngs_modulus", True, ["material.youngs_modulus = true", '"70 GPa"']),
        ("material", "poissons_ratio", 0.5, ["material.poissons_ratio = 0.5", "less than 0.5"]),
        ("material", "plane", "stres", ["material.plane", "'strain' or 'stress'"]),
        ("contact", "friction", -0.1, ["contact.friction = -0.1", "greater than or equal to 0"]),
        ("contact", "friction", 3, ["contact.friction = 3", "less than or equal to 2"]),
        ("contact", "friction", "0.25 mm", ["contact.friction", "a plain number"]),
        ("contact", "pairs", 3, ["contact.pairs = 3", "greater than or equal to 5"]),
        ("contact", "pairs", 200.5, ["contact.pairs = 200.5", "a whole number"]),
        ("contact", "pairs", "201", ["contact.pairs", "a whole number"]),
        ("contact", "law", "elastic", ["contact.tangential_stiffness", "1e13 Pa/m"]),
        ("contact", "tangential_stiffness", 1e13, ["contact.tangential_stiffness", "elastic"]),
        ("contact", "normal_stiffness", 1e13, ["contact.normal_stiffness", "elastic"]),
        ("damping", "beta", "0.73 Hz", ["damping.beta", '"0.73 us"']),
        ("load", "moment", 50, ["[load]: ", "exactly one of", "moment and rho"]),
        ("load", "rho", [], ["load.rho = []", "list of 1 to 1000"]),
        ("load", "rho", [1, "two"], ['load.rho[1] = "two"', "a plain number"]),
        ("load", "rho", -1, ["load.rho = -1", "greater than or equal to 0"]),
        ("load", "rho_scale", 0, ["load.rho_scale = 0"]),
    ],
)
def test_a_wrong_value_is_named(document, section, key, value, parts):
    document["load"] = {"rho": 2.4}
    document[section][key] = value
    message = refused(document)
    assert "\n" not in message
    for part in parts:
        assert part in message


@pytest.mark.parametrize(
    ("load", "key"),
    [
        ({"moment": "40 kN*m/m"}, "load.moment"),
        ({"moment_over_clamp_force_length": [0.01, 0.2]}, "load.moment_over_clamp_force_length"),
        ({"rho": [0, 0.5, 5], "rho_scale": 1.0}, "load.rho"),
    ],
)
def test_a_load_that_opens_the_joint_states_the_limit(document, load, key):
    document["load"] = load
    message = refused(document)
    assert message.startswith(f"my.toml: {key} = ")
    assert "opens the joint" in message
    assert "0.1491" in message


@pytest.mark.parametrize(
    "cycle", [{"largest": 0.15}, {"moment_over_clamp_force_length": [0.01, 37.5 / 251.5]}]
)
def test_a_cycle_that_opens_the_joint_states_the_limit(document, cycle):
    document["analysis"]["cycle"] = cycle
    message = refused(document)
    assert f"analysis.cycle.{next(iter(cycle))} = " in message
    assert "0.1491" in message


def test_rho_needs_friction(document):
    document["load"] = {"rho": 2.4}
    document["contact"]["friction"] = 0
    assert "load.rho" in refused(document)
    document["load"]["rho"] = 0
    assert parse_joint(document).contact.friction == 0


def test_a_response_needs_loads(document):
    del document["load"]
    assert "my.toml: load" in refused(document)


@pytest.mark.parametrize("variant", ["printed", "consistent"])
def test_models_of_the_cycles_need_cycles(document, variant):
    del document["analysis"]["cycle"]
    assert parse_joint(document).variants == ("refined",)
    document["analysis"]["response"] = {"variants": ["refined", variant]}
    message = refused(document)
    assert f"the {variant} model" in message
    assert "[analysis.cycle]" in message


def test_cycles_are_driven_by_what_is_needed(document):
    assert parse_joint(document).drives == ("moment",)
    document["analysis"]["response"] = {"variants": ["printed", "consistent"]}
    assert parse_joint(document).drives == ("moment", "mode")
    document["analysis"]["cycle"] = {"drives": "mode"}
    assert parse_joint(document).drives == ("mode",)
    del document["analysis"]["cycle"], document["analysis"]["response"]
    assert parse_joint(document).drives == ()


def test_variants_stand_in_one_place():
    document = example_document()
    document["analysis"]["reduced"] = {"variant": "refined"}
    assert parse_joint(document).variants == ("refined",)
    document["analysis"]["response"] = {"variants": ["printed"]}
    with pytest.raises(InputError, match="remove one of the two"):
        parse_joint(document)
    del document["analysis"]["response"]
    with pytest.raises(InputError, match=r"add a section \[analysis.response\]"):
        parse_joint(document)
    assert joint_without_response().variants == ()


def joint_without_response():
    document = example_document()
    del document["analysis"]["response"]
    return parse_joint(document)


def test_a_joint_is_one_line():
    joint = load_joint(EXAMPLE)
    line = "length 251.5 mm, thickness 12.5 mm, 201 pairs, analyses: cycle, response)"
    assert repr(joint) == str(joint) == f"LapJoint({joint.title!r}, {line}"
    bare = {key: value for key, value in example_document().items() if key != "title"}
    assert repr(parse_joint(bare)) == f"LapJoint({line}"


def test_a_notebook_shows_a_table_of_two_columns(document):
    document["title"] = "<b>steel & brass</b>"
    html = parse_joint(document)._repr_html_()
    table = ET.fromstring(html)  # well-formed, so nothing of the title became markup
    assert table.findtext("caption") == "<b>steel & brass</b>"
    rows = {row[0].text: row[1].text for row in table.findall("tr")}
    assert all(len(row) == 2 for row in table.findall("tr"))
    assert rows["length of a beam"] == "251.5 mm"
    assert rows["clamp force"] == "1 MN/m"
    assert rows["friction"] == "0.25"
    assert rows["load: moment"] == "10, 20, 50 N m/m"
    assert rows["analyses"] == "cycle, response"
    document["load"] = {"moment": ["50 N*m/m", "0.1 kN*m/m"]}
    assert "<td>load: moment</td><td>50, 100 N m/m</td>" in parse_joint(document)._repr_html_()
    assert "steel" not in "".join(rows)


@pytest.mark.parametrize("file", sorted(EXAMPLE.parent.glob("*.toml")), ids=lambda p: p.stem)
def test_a_stored_joint_is_the_joint(file):
    joint = load_joint(file)
    stored = joint.model_dump_json(by_alias=True, exclude_unset=True)
    assert type(joint).model_validate_json(stored) == joint


def test_a_joint_is_stored_as_it_always_was():
    """Keys that were written, in the order of the sections, quantities in SI; results.nc holds it."""
    document = {
        "beams": {"length": "0.25 m", "thickness": "12.5 mm", "overlap_half_length": 0.0375},
        "material": {"youngs_modulus": "70 GPa", "poissons_ratio": 0.3, "density": 2000},
        "contact": {"friction": 0.25},
        "clamp": {"force": 1e6, "half_length": 0.025},
        "load": {"rho_scale": 2e-3, "rho": 2.4},
        "analysis": {
            "time": {"steps": 100, "count": 3, "to": 180, "from": 170},
            "history": {
                "signal": "stepped_sine",
                "cycles": 3,
                "frequencies": 170,
                "moment": 5,
                "name": "dwell",
            },
            "cycle": {},
            "response": {"from": 160},
        },
    }
    assert parse_joint(document).model_dump_json(by_alias=True, exclude_unset=True) == (
        '{"beams":{"length":0.25,"thickness":0.0125,"overlap_half_length":0.0375},'
        '"material":{"youngs_modulus":70000000000.0,"poissons_ratio":0.3,"density":2000.0},'
        '"contact":{"friction":0.25},"clamp":{"force":1000000.0,"half_length":0.025},'
        '"load":{"rho":[2.4],"rho_scale":0.002},'
        '"analysis":{"cycle":{},"response":{"from":160.0},'
        '"time":{"from":170.0,"to":180.0,"count":3,"steps":100},'
        '"history":[{"name":"dwell","moment":5.0,"signal":"stepped_sine",'
        '"frequencies":[170.0],"cycles":3.0}]}}'
    )

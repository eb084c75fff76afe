"""Joint files: what is read, and what every mistake is answered with."""

from __future__ import annotations

import copy
import itertools
import math
import tomllib
from importlib import resources

import pytest
from conftest import ROOT
from hypothesis import given
from hypothesis import strategies as st
from pydantic import BaseModel

from microslip.describe import units
from microslip.describe.excitation import (
    FreeDecay,
    MeasuredSignal,
    Sine,
    SteppedSine,
    SweptSine,
    prepare_histories,
)
from microslip.describe.lap import (
    CycleAnalysis,
    HarmonicAnalysis,
    LapJoint,
    ResponseAnalysis,
    TimeAnalysis,
    load_joint,
    parse_joint,
)
from microslip.errors import InputError

EXAMPLE = ROOT / "examples" / "lap_joint.toml"


@pytest.fixture
def document() -> dict:
    return copy.deepcopy(tomllib.loads(EXAMPLE.read_text()))


def refused(document: dict) -> str:
    with pytest.raises(InputError) as caught:
        parse_joint(document, "my.toml")
    message = str(caught.value)
    assert message.startswith("my.toml: ")
    assert "pydantic" not in message
    return message


# -- units -----------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("kind", "text", "value"),
    [
        (units.LENGTH, "12.5 mm", 0.0125),
        (units.LENGTH, "12.5mm", 0.0125),
        (units.LENGTH, 0.0125, 0.0125),
        (units.LENGTH, "0.0125", 0.0125),
        (units.LENGTH, "1 inch", 0.0254),
        (units.MODULUS, "70 GPa", 70e9),
        (units.MODULUS, "70e3 N/mm^2", 70e9),
        (units.TIME, "0.73 us", 0.73e-6),
        (units.TIME, "0.73 µs", 0.73e-6),
        (units.DENSITY, "2 g/cm^3", 2000.0),
        (units.DENSITY, "2 g/cm³", 2000.0),
        (units.LINE_FORCE, "1 MN/m", 1e6),
        (units.LINE_STIFFNESS, "1e5 N/m/m", 1e5),
        (units.AREA_STIFFNESS, "1e13 Pa/m", 1e13),
        (units.FREQUENCY, "165 Hz", 165.0),
        (units.LINE_MOMENT, "150 N*m/m", 150.0),
        (units.LINE_MOMENT, "150 N·m/m", 150.0),
        (units.RATE, "5 1/s", 5.0),
        (units.NUMBER, "25 %", 0.25),
    ],
)
def test_quantities_as_people_write_them(kind, text, value):
    assert kind.parse(text) == value


@given(st.floats(1e-9, 1e9))
def test_millimetres_equal_metres(metres):
    # a decimal shift of the text, exact, so the two floats must be the same
    digits, exponent = f"{metres:.16e}".split("e")
    in_mm = f"{digits}e{int(exponent) + 3} mm"
    assert units.LENGTH.parse(in_mm) == units.LENGTH.parse(f"{metres:.16e} m") == metres


@given(st.floats(allow_nan=False, allow_infinity=False))
def test_plain_numbers_are_si(value):
    for kind in (units.LENGTH, units.MODULUS, units.FREQUENCY):
        assert kind.parse(value) == value
        assert kind.parse(repr(value)) == value


@given(st.text(max_size=30))
def test_any_text_parses_to_a_finite_number_or_is_refused(text):
    try:
        value = units.LENGTH.parse(text)
    except ValueError:
        return
    assert math.isfinite(value)


@pytest.mark.parametrize(
    "text",
    ["nan", "nan mm", "inf", "-inf m", "1e999 m", "", "mm", "1,5 mm", "5 m/", "5 m**9**9**9"],
)
def test_not_a_quantity(text):
    with pytest.raises(ValueError, match=r'a length, for example "12.5 mm"'):
        units.LENGTH.parse(text)


@pytest.mark.parametrize("value", [True, None, [1.0], {}, float("nan"), float("inf"), 10**400])
def test_not_a_number(value):
    with pytest.raises(ValueError, match="a length"):
        units.LENGTH.parse(value)


@pytest.mark.parametrize("text", ["60 rpm", "1000 rad/s"])
def test_angular_frequency_is_not_taken_for_hertz(text):
    with pytest.raises(ValueError, match=r"angular frequency.*165 Hz"):
        units.FREQUENCY.parse(text)


# -- the reference joint -----------------------------------------------------------------------


def test_example_is_the_reference_joint():
    joint = load_joint(EXAMPLE)
    assert joint.beams.model_dump() == {
        "length": 0.2515,
        "thickness": 0.0125,
        "overlap_half_length": 0.0375,
    }
    material = joint.material
    assert (material.youngs_modulus, material.poissons_ratio) == (70e9, 0.3)
    assert (material.density, material.plane) == (2000.0, "strain")
    assert (joint.contact.friction, joint.contact.pairs_used) == (0.25, 201)
    assert (joint.clamp.force, joint.clamp.half_length) == (1e6, 0.025)
    assert joint.support.horizontal_spring == 1e5
    assert (joint.damping.alpha, joint.damping.beta) == (0.0, 7.3e-7)
    assert joint.load is not None
    assert (joint.load.kind, joint.load.values) == ("rho", (0.0, 0.8, 2.4, 5.0))
    assert joint.load.greatest_damping_at == 2.4
    assert joint.analysis.cycle is not None
    assert joint.analysis.response is not None


@pytest.mark.parametrize("file", sorted(EXAMPLE.parent.glob("*.toml")), ids=lambda p: p.stem)
def test_every_example_is_valid_down_to_its_signals(file):
    joint = load_joint(file)
    for item in prepare_histories(joint.analysis.history, 174.9):
        assert len(item.load) > 1000


def test_template_is_the_example_with_every_default_written_out(tmp_path):
    template = resources.files("microslip").joinpath("templates", "lap.toml").read_text("utf-8")
    (tmp_path / "joint.toml").write_text(template, encoding="utf-8")
    assert load_joint(tmp_path / "joint.toml") == load_joint(EXAMPLE)


def test_template_names_every_key():
    template = resources.files("microslip").joinpath("templates", "lap.toml").read_text("utf-8")
    joint = load_joint(EXAMPLE)
    sections = [joint, *(getattr(joint, name) for name in type(joint).model_fields)]
    kinds = [type(section) for section in sections if isinstance(section, BaseModel)]
    kinds += [CycleAnalysis, ResponseAnalysis, HarmonicAnalysis, TimeAnalysis]
    kinds += [Sine, SteppedSine, SweptSine, FreeDecay, MeasuredSignal]
    for kind in kinds:
        for name, info in kind.model_fields.items():
            assert (info.alias or name) in template


def test_models_of_the_reference_joint():
    joint = load_joint(EXAMPLE)
    g = joint.geometry()
    assert (g.length, g.thickness, g.overlap_half_length, g.clamp_half_length) == (
        0.2515,
        0.0125,
        0.0375,
        0.025,
    )
    assert joint.material_model().plane_modulus() == pytest.approx(70e9 / 0.91)
    assert joint.mesh_control().contact_pairs == 201
    assert joint.clamp_force_length == pytest.approx(251.5e3)
    assert joint.opening_ratio == pytest.approx(37.5 / 251.5)


def test_a_joint_cannot_be_changed():
    joint = load_joint(EXAMPLE)
    with pytest.raises(ValueError, match="frozen"):
        joint.clamp.force = 2e6  # type: ignore[misc]


@pytest.mark.parametrize(("written", "used"), [(5, 5), (6, 7), (200, 201), (201, 201)])
def test_even_number_of_pairs_is_raised_by_one(document, written, used):
    document["contact"]["pairs"] = written
    contact = parse_joint(document).contact
    assert (contact.pairs, contact.pairs_used) == (written, used)


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
    assert response.frequencies() == (170.0, 172.5, 175.0, 177.5, 180.0)


def test_without_analysis_everything_is_computed(document):
    with_empty_tables = parse_joint(document)
    del document["analysis"]
    assert parse_joint(document) == with_empty_tables


def test_cycles_alone_need_no_load(document):
    del document["analysis"]["response"], document["load"]
    joint = parse_joint(document)
    assert joint.load is None
    assert joint.load_moments() == ()


def test_one_moment_or_many(document):
    document["load"] = {"moment": "50 N*m/m"}
    assert parse_joint(document).load_moments() == (50.0,)
    document["load"] = {"moment": [50, "0.1 kN*m/m"]}
    assert parse_joint(document).load_moments() == (50.0, 100.0)
    document["load"] = {"moment_over_clamp_force_length": 2e-4}
    assert parse_joint(document).load_moments() == pytest.approx((50.3,))


# -- mistakes ----------------------------------------------------------------------------------


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
        ("contact", "pairs", 200.5, ["contact.pairs = 200.5", "integer"]),
        ("contact", "pairs", "201", ["contact.pairs", "integer"]),
        ("contact", "law", "elastic", ["contact.tangential_stiffness", "1e13 Pa/m"]),
        ("contact", "tangential_stiffness", 1e13, ["contact.tangential_stiffness", "elastic"]),
        ("contact", "normal_stiffness", 1e13, ["contact.normal_stiffness", "elastic"]),
        ("damping", "beta", "0.73 Hz", ["damping.beta", '"0.73 us"']),
        ("load", "moment", 50, ["[load]: ", "exactly one of", "moment and rho"]),
        ("load", "rho", [], ["load.rho = []", "list of 1 to 1000"]),
        ("load", "rho", [1, "two"], ['load.rho[1] = "two"', "a plain number"]),
        ("load", "rho", -1, ["load.rho = -1", "greater than or equal to 0"]),
        ("load", "greatest_damping_at", 0, ["load.greatest_damping_at = 0"]),
    ],
)
def test_a_wrong_value_is_named(document, section, key, value, parts):
    document[section][key] = value
    message = refused(document)
    assert "\n" not in message
    for part in parts:
        assert part in message


@pytest.mark.parametrize(
    ("section", "key", "parts"),
    [
        ("contact", "fricton", ["contact.fricton", "'friction'"]),
        ("beams", "lenght", ["beams.lenght", "'length'"]),
        ("clamp", "friction", ["clamp.friction", "belongs in [contact]"]),
        ("damping", "xyzzy", ["damping.xyzzy", "alpha, beta"]),
    ],
)
def test_an_unknown_key_names_the_nearest(document, section, key, parts):
    document[section][key] = 1
    message = refused(document)
    for part in parts:
        assert part in message


def test_an_unknown_section_names_the_nearest(document):
    document["bems"] = {}
    assert "bems is not a known key; the nearest at the top of the file is 'beams'" in refused(
        document
    )


def test_an_unknown_key_of_an_analysis_names_the_nearest(document):
    document["analysis"]["response"]["form"] = 1
    assert "analysis.response.form" in (message := refused(document))
    assert "'from'" in message


def test_no_clamp_force(document):
    del document["clamp"]["force"]
    assert "clamp.force is missing: expected a force per metre of width" in refused(document)


def test_no_clamp_section(document):
    del document["clamp"]
    assert "[clamp] is missing: a section with force, half_length" in refused(document)


def test_a_section_that_is_a_number(document):
    document["clamp"] = 3
    assert "clamp = 3: must be a section, [clamp]" in refused(document)


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


def test_rho_needs_friction(document):
    document["contact"]["friction"] = 0
    assert "load.rho" in refused(document)
    document["load"]["rho"] = 0
    assert parse_joint(document).contact.friction == 0


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
        ("response", {"to": 100}, "analysis.response.to = 100: must be above"),
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


SINE = {"signal": "sine", "frequency": "170 Hz", "cycles": 5, "moment": 50}
DECAY = {"signal": "free_decay", "duration": "0.1 s"}


@pytest.mark.parametrize(
    ("change", "parts"),
    [
        ({"frequency": 0}, ["analysis.history[0].frequency = 0", "greater than 0"]),
        ({"frequency": "-3 Hz"}, ['analysis.history[0].frequency = "-3 Hz"', "greater than 0"]),
        ({"cycles": 0}, ["analysis.history[0].cycles = 0"]),
        ({"steps": 19}, ["analysis.history[0].steps = 19", "greater than or equal to 20"]),
        ({"time_step": "1 ms"}, ["time_step", "5.88 steps per cycle at 170 Hz", "0.000294 s"]),
        ({"steps": 50, "time_step": "1 us"}, ["time_step", "remove steps"]),
        ({"rho": 2.4}, ["exactly one of moment", "found moment and rho"]),
        ({"moment": "40 kN*m/m"}, ["moment", "opens the joint", "0.1491"]),
        ({"positions": ["25 mm", "40 mm"]}, ["positions", "0.04 m lies off the overlap"]),
        ({"drive": "clamp"}, ["drive", "'moment' or 'mode'"]),
        ({"name": "two words"}, ["name", "two words"]),
        ({"field_to": "1 ms", "field_from": "2 ms"}, ["field_to", "after field_from"]),
        ({"frequncy": 3}, ["analysis.history[0].frequncy", "'frequency'"]),
        ({"signal": "sin"}, ['signal = "sin"', "sine, stepped_sine, swept_sine, free_decay"]),
        (
            {"signal": "stepped_sine"},
            ["analysis.history[0].frequency is not a known key", "'frequencies'"],
        ),
    ],
)
def test_a_wrong_history_is_named(document, change, parts):
    document["analysis"]["history"] = [{**SINE, **change}]
    message = refused(document)
    for part in parts:
        assert part in message


@pytest.mark.parametrize(
    ("history", "part"),
    [
        ({"frequency": 1}, "analysis.history[0].signal is missing: one of sine"),
        ({**DECAY, "start": "mode"}, 'modal_amplitude: start = "mode" needs it'),
        ({**DECAY, "start": "steady", "moment": 5}, 'frequency: start = "steady" needs it'),
        ({**DECAY, "start": "static"}, "exactly one of moment"),
        ({**DECAY, "start": "mode", "modal_amplitude": 1e-3, "moment": 5}, "remove it"),
        (
            {**DECAY, "start": "static", "moment": 5, "frequency": 5},
            "frequency = 5: has no meaning",
        ),
        ({"signal": "measured", "file": "none.csv"}, "none.csv: no such file"),
        ({"signal": "measured", "file": 3}, "the name of a file"),
        (
            {"signal": "stepped_sine", "cycles": 3, "moment": 5, "from": 3},
            "give a list of frequencies, or from, to and count",
        ),
        (
            {"signal": "swept_sine", "from": 1, "to": 2, "moment": 5},
            "history[0].duration is missing",
        ),
        (3, "analysis.history[0]"),
    ],
)
def test_a_history_without_its_inputs_is_named(document, history, part):
    document["analysis"]["history"] = [history]
    assert part in refused(document)


def test_histories_that_are_no_list(document):
    document["analysis"]["history"] = 3
    assert "analysis.history = 3: must be sections, [[analysis.history]]" in refused(document)


def test_histories_are_told_apart_by_name(document):
    document["analysis"]["history"] = [SINE, SINE]
    message = refused(document)
    assert "two histories are called 'sine'" in message
    document["analysis"]["history"][1] = {**SINE, "name": "again"}
    labels = [h.label for h in parse_joint(document).analysis.history]
    assert labels == ["sine", "again"]


def test_rho_of_a_history_needs_its_constant(document):
    history = {**SINE, "rho": 2.4}
    del history["moment"]
    document["analysis"]["history"] = [history]
    assert parse_joint(document).analysis.history[0].label == "sine"
    del document["analysis"]["response"], document["analysis"]["cycle"]
    assert "needs load.rho_scale, or analysis.response" in refused(document)
    document["load"] = {"moment": 5}
    assert "needs the constant of load.rho" in refused(document)


def test_a_measured_signal_lies_beside_the_joint_file(document, tmp_path):
    (tmp_path / "load.csv").write_text("time [s], moment [kN*m/m]\n0, 0\n0.5, 1\n1, 0\n")
    text = EXAMPLE.read_text() + '[[analysis.history]]\nsignal = "measured"\nfile = "load.csv"\n'
    (tmp_path / "joint.toml").write_text(text)
    (history,) = load_joint(tmp_path / "joint.toml").analysis.history
    load = history.load(0.0, 1.0)
    assert (load[0], load[-1], load.max()) == (0.0, 0.0, 1000.0)
    assert len(load) == 151
    (tmp_path / "joint.toml").write_text(text + "dataset = 2\n")
    with pytest.raises(InputError, match="dataset = 2: is for universal files"):
        load_joint(tmp_path / "joint.toml")


def test_example_signals_agree():
    """The same blow as CSV in ms and kN m/m, and as a universal file in s and N m/m, half."""
    joint = load_joint(EXAMPLE.parent / "lap_joint_measured.toml")
    csv, universal = prepare_histories(joint.analysis.history, 174.9)
    assert csv.load.max() == pytest.approx(1500, rel=0.01)
    assert universal.load == pytest.approx(0.5 * csv.load, abs=0.05)


def test_steps_are_counted_at_the_highest_frequency(document):
    sweep = {"signal": "swept_sine", "from": 190, "to": 160, "duration": 1, "moment": 5}
    step = {"signal": "stepped_sine", "frequencies": [100, 250, 50], "cycles": 4, "moment": 5}
    decay = {**DECAY, "start": "mode", "modal_amplitude": 1e-3, "steps": 40}
    slow = {**SINE, "frequency": 10}
    document["analysis"]["history"] = [sweep, step, decay, slow]
    found = [h.resolution(174.0) for h in parse_joint(document).analysis.history]
    expected = [1 / (150 * 190), 1 / (150 * 250), 1 / (40 * 174), 1 / (150 * 174)]
    assert found == pytest.approx(expected)
    after = {**DECAY, "start": "steady", "frequency": 20, "moment": 5}
    document["analysis"]["history"] = [after]
    (history,) = parse_joint(document).analysis.history
    with pytest.raises(ValueError, match="150 per cycle at 20 Hz are fewer than 20 per cycle of"):
        history.resolution(174.0)
    finer = history.model_copy(update={"steps": 200})
    assert finer.resolution(174.0) == pytest.approx(1 / (200 * 20))


def test_a_step_too_long_for_the_joint_is_refused_once_its_frequency_is_known(document):
    decay = {**DECAY, "start": "mode", "modal_amplitude": 1e-3, "time_step": "1 ms"}
    document["analysis"]["history"] = [decay]
    (history,) = parse_joint(document).analysis.history
    with pytest.raises(ValueError, match=r"5\.75 steps per cycle at 174 Hz"):
        history.resolution(174.0)


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


def test_a_response_needs_loads_and_cycles(document):
    without_load = {**document}
    del without_load["load"]
    assert "my.toml: load" in refused(without_load)
    del document["analysis"]["cycle"]
    assert "[analysis.cycle]" in refused(document)


def test_many_mistakes_are_a_few_lines():
    message = refused({"beams": {"length": -1, "xyzzy": 1}, "clamp": {"force": "1 m"}})
    assert 3 < len(message.splitlines()) <= 7


# -- files -------------------------------------------------------------------------------------


def test_missing_file(tmp_path):
    with pytest.raises(InputError, match=r"none\.toml: no such file.*microslip new lap"):
        load_joint(tmp_path / "none.toml")


def test_folder_instead_of_file(tmp_path):
    with pytest.raises(InputError, match="is a folder"):
        load_joint(tmp_path)


def test_syntax_error_names_the_line(tmp_path):
    file = tmp_path / "bad.toml"
    file.write_text("[beams]\nlength = = 3\n")
    with pytest.raises(InputError, match=r"bad\.toml: not valid TOML: .*line 2"):
        load_joint(file)


def test_binary_file(tmp_path):
    file = tmp_path / "bad.toml"
    file.write_bytes(b"title = '\xff\xfe'")
    with pytest.raises(InputError, match="not UTF-8"):
        load_joint(file)


def test_empty_file(tmp_path):
    file = tmp_path / "empty.toml"
    file.write_text("")
    with pytest.raises(InputError, match=r"\[beams\] is missing"):
        load_joint(file)


@given(
    st.recursive(
        st.none() | st.booleans() | st.integers() | st.floats() | st.text(max_size=5),
        lambda inner: (
            st.lists(inner, max_size=3)
            | st.dictionaries(
                st.sampled_from([*LapJoint.model_fields, "cycle", "length", "force", "x"]), inner
            )
        ),
        max_leaves=8,
    ).filter(lambda value: isinstance(value, dict))
)
def test_any_document_is_refused_with_one_message(document):
    with pytest.raises(InputError) as caught:
        parse_joint(document)
    assert len(str(caught.value).splitlines()) <= 7


def test_variants_stand_in_one_place():
    document = tomllib.loads(EXAMPLE.read_text(encoding="utf-8"))
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
    document = tomllib.loads(EXAMPLE.read_text(encoding="utf-8"))
    del document["analysis"]["response"]
    return parse_joint(document)

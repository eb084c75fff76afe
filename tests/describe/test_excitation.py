"""Histories: what is refused, and the step that their signals need."""

from __future__ import annotations

import pytest
from joint_files import example_document, refused

from microslip.describe.amplitude import RHO_CONSTANT
from microslip.describe.reading import parse_joint


@pytest.fixture
def document() -> dict:
    return example_document()


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


def test_rho_of_a_history_is_that_of_the_loads(document):
    """It needs no load beside it; the constant of one counts for all."""
    history = {**SINE, "rho": 2.4}
    del history["moment"]
    document["analysis"] = {"history": [history]}
    document["load"] = {"rho": 2.4, "rho_scale": 3e-3}
    joint = parse_joint(document)
    assert joint.end_moment("rho", joint.analysis.history[0].rho) == joint.load_amplitudes()[0]
    del document["load"]
    alone = parse_joint(document)
    assert alone.says_rho
    assert alone.end_moment("rho", 2.4) == pytest.approx(RHO_CONSTANT * 0.25 * 251.5e3 / 2.4)
    document["analysis"]["history"] = [{**history, "rho": 1e-3}]
    assert "opens the joint" in refused(document)
    document["contact"]["friction"] = 0
    assert "without contact.friction rho is 0" in refused(document)


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

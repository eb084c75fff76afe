"""Outputs of a response put right by steady states, against time integration at other frequencies."""

import numpy as np
import pytest

import microslip
from microslip.pipeline.outputs import with_outputs
from microslip.results.dataset import dataset
from microslip.results.time import outputs_of
from microslip.show.plots.response import response_figure

FILE = {
    "beams": {"length": "200 mm", "thickness": "5 mm", "overlap_half_length": "30 mm"},
    "material": {"youngs_modulus": "70 GPa", "poissons_ratio": 0.3, "density": "2700 kg/m^3"},
    "contact": {"friction": 0.3, "pairs": 21},
    "clamp": {"force": "300 kN/m", "half_length": "18 mm"},
    "support": {"horizontal_spring": "1e8 N/m/m"},
    "damping": {"beta": "2 us"},
    "port": [{"name": "m", "kind": "moment", "at": "right"}],
    "load": {"port": "m", "moment": ["20 N*m/m"]},
    "output": [{"name": "rotation", "quantity": "rotation", "x": "right end"}],
}


OTHERS = [401.5, 406.3, 410.1, 411.6, 413.3, 415.1, 417.2, 418.9]


def ran(first, last, method, others=()):
    band = {"from": f"{first} Hz", "to": f"{last} Hz", "count": 201}
    analysis = {"response": {"method": method, "points": 60, "corrections": 16, **band}}
    if others:
        analysis["time"] = {"frequencies": [f"{f} Hz" for f in others], "steps": 300}
    return microslip.run(microslip.parse_joint({**FILE, "analysis": analysis}))


@pytest.mark.parametrize("method", ["corrected", pytest.param("auto", marks=pytest.mark.validate)])
def test_about_an_upper_mode_outputs_are_those_of_time_integration(method):
    """The reduced model alone has a rotation several times larger or smaller there."""
    done = ran(400, 420, method, OTHERS)
    (curve,) = done.responses
    refined = done.value("reduced")
    models = {"refined": (refined.model_of(done.assembly), refined.table)}
    plain = with_outputs(done.assembly, models, curve)
    at = [point.steady.frequency for point in done.value("time")]
    true = np.abs([outputs_of(done, point)["rotation"][1] for point in done.value("time")])

    def off(response):
        return np.interp(at, curve.frequency, np.abs(response.outputs["rotation"])) / true - 1

    said = np.interp(at, curve.frequency, curve.output_errors["rotation"])
    assert np.median(np.abs(off(plain))) > 0.5
    assert np.median(np.abs(off(curve))) < 0.005
    assert (np.abs(off(curve)) <= said).all()
    assert np.median(said) < 0.05


def test_an_output_that_is_not_known_as_well_as_the_amplitude_is_said():
    """Sixteen steady states do not tell all of what the upper mode does to the rotation."""
    done = ran(400, 420, "corrected")
    (curve,) = done.responses
    known = curve.error_indicator <= 0.01
    worse = known & ~(curve.output_errors["rotation"] <= 0.01)
    (said,) = [one.reason for one in done.cautions if 'output "rotation"' in one.reason]
    assert f"at {worse.sum()} of {known.sum()} frequencies" in said
    assert (curve.output_errors["rotation"] > curve.error_indicator)[worse].all()


@pytest.mark.parametrize("count", [2, 3])
def test_with_hardly_any_frequencies_nothing_is_bounded_and_the_figure_is_drawn(count):
    band = {"from": "96 Hz", "to": "104 Hz", "count": count}
    analysis = {"response": {"method": "corrected", **band}}
    done = microslip.run(microslip.parse_joint({**FILE, "analysis": analysis}))
    (curve,) = done.responses
    assert np.isinf(curve.output_errors["rotation"]).all()
    assert response_figure(done) is not None


def test_about_its_own_mode_the_rotation_is_as_good_as_the_amplitude():
    """The rotation of the end is that of the mode there."""
    done = ran(94, 104, "corrected")
    (curve,) = done.responses
    known = curve.error_indicator <= 0.01
    assert known.mean() > 0.5
    beside = curve.output_errors["rotation"][known] - curve.error_indicator[known]
    assert np.median(beside) < 0.002


def test_rates_and_reactions_are_those_of_time_integration_and_what_is_held_does_not_move():
    """Off the peak, where the past moves all of it; differences of 600 samples a cycle err by 4e-5."""
    outputs = [
        {"name": "held", "quantity": "velocity", "x": "right end"},
        {"name": "rate", "quantity": "acceleration", "x": "middle"},
        {"name": "slips", "quantity": "slip velocity", "x": "clamp edge"},
        {"name": "hold", "quantity": "reaction", "x": "left end", "direction": "x"},
    ]
    analysis = {
        "response": {"method": "corrected", "from": "94 Hz", "to": "104 Hz", "count": 201},
        "time": {"frequencies": ["95 Hz", "97 Hz", "101 Hz", "103 Hz"], "steps": 600},
    }
    done = microslip.run(microslip.parse_joint({**FILE, "output": outputs, "analysis": analysis}))
    (curve,) = done.responses
    for point in done.value("time"):
        k = int(np.argmin(np.abs(curve.frequency - point.steady.frequency)))
        true = outputs_of(done, point)
        for name in ("rate", "slips", "hold"):
            off = abs(curve.outputs[name][k]) / abs(true[name][1]) - 1
            assert abs(off) <= curve.output_errors[name][k] + 4e-5
            assert curve.output_errors[name][k] < 0.05
        assert curve.output_errors["held"][k] - curve.error_indicator[k] < 1e-3
        assert abs(curve.outputs["held"][k]) < 1e-8 * abs(curve.outputs["rate"][k])


def test_results_have_the_errors_of_outputs():
    done = ran(94, 104, "corrected")
    (curve,) = done.responses
    found = dataset(done)["response"]["output_error"]
    assert found.dims == ("curve", "output", "frequency")
    assert np.array_equal(found.values[0, 0], curve.output_errors["rotation"])

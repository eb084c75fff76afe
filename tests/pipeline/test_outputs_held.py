"""Outputs of a response against those of steady states that it goes through."""

import numpy as np
import pytest

import microslip
from microslip.pipeline.outputs_held import _off
from microslip.pipeline.targets import TOLERANCE
from microslip.results.time import outputs_of

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


def cautions_about(first, last, method, **more):
    band = {"from": f"{first} Hz", "to": f"{last} Hz", "count": 61}
    analysis = {"response": {"method": method, "points": 15, "corrections": 12, **band}, **more}
    done = microslip.run(microslip.parse_joint({**FILE, "analysis": analysis}))
    return done, [one.reason for one in done.cautions if 'output "rotation"' in one.reason]


@pytest.mark.parametrize("method", ["corrected", "auto"])
def test_about_an_upper_mode_it_is_said_that_outputs_are_not_bounded(method):
    """Time integration has a rotation several times larger or smaller there."""
    point = {"frequencies": ["413.28 Hz"], "steps": 150}
    done, said = cautions_about(400, 420, method, time=point)
    assert said
    (curve,) = done.responses
    (found,) = done.value("time")
    true = abs(outputs_of(done, found)["rotation"][1])
    shown = np.interp(413.28, curve.frequency, np.abs(curve.outputs["rotation"]))
    assert abs(shown / true - 1) > 0.5


def test_about_its_own_mode_the_rotation_is_as_good_as_the_amplitude():
    """The rotation of the end is that of the mode there: nothing is said."""
    done, said = cautions_about(94, 104, "corrected")
    (curve,) = done.responses
    assert sum(one.change <= TOLERANCE for one in curve.anchors) > 5  # states that were looked at
    assert not said


def test_a_small_size_is_compared_with_the_largest():
    off = _off(np.array([1.0, 2.2, 1e-3]), np.array([1.0, 2.0, 0.0]))
    assert off == pytest.approx([0.0, 0.1, 0.05])

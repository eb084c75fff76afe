"""Method "auto" of the forced response: what it states against time integration elsewhere."""

import numpy as np
import pytest

import microslip
from microslip.analyses.reduced.sweep import CONVERGED
from microslip.analyses.time.points import Request, steady_states
from microslip.errors import InputError
from microslip.pipeline import auto as method
from microslip.pipeline.walk import sought

FILE = {
    "beams": {"length": "0.5 m", "thickness": "15 mm", "overlap_half_length": "60 mm"},
    "material": {
        "youngs_modulus": "70 GPa",
        "poissons_ratio": 0.33,
        "density": "2700 kg/m^3",
    },
    "contact": {"friction": 0.35, "pairs": 41},
    "clamp": {"force": "4e5 N/m", "half_length": "40 mm"},
    "support": {"horizontal_spring": "1e5 N/m/m"},
    "damping": {"beta": "2e-6 s"},
    "load": {"moment": ["90 N*m/m"]},
}


def described(**response):
    return microslip.parse_joint({**FILE, "analysis": {"response": response}})


@pytest.fixture(scope="module")
def auto():
    return microslip.run(described(method="auto", points=24))


def test_one_curve_that_passes_through_its_steady_states(auto):
    (curve,) = auto.responses
    assert curve.variant == "auto"
    assert 5 <= len(curve.anchors) <= 24
    assert not auto.failures
    # a curve is read at its frequencies, an anchor is one of them
    near = [int(np.argmin(np.abs(curve.frequency - one.frequency))) for one in curve.anchors]
    size, found = np.abs(curve.amplitude[near]), np.abs([one.amplitude for one in curve.anchors])
    shown = size < 2 * found  # one that fell to the lower branch of a fold is not on the curve
    assert shown.mean() > 0.7
    np.testing.assert_allclose(size[shown], found[shown], rtol=0.02)


def test_the_stated_error_holds_against_time_integration(auto):
    """At frequencies that were not sought, with twice the time steps."""
    (curve,) = auto.responses
    sought = np.array([one.frequency for one in curve.anchors])
    free = np.flatnonzero(np.abs(curve.frequency[:, None] - sought).min(axis=1) > 0.05)
    chosen = free[np.linspace(0, len(free) - 1, 12).astype(int)]
    requests = [
        Request(np.nan, float(curve.frequency[k]), curve.load, None, curve.amplitude[k], steps=300)
        for k in chosen
    ]
    missed = []
    for k, found in zip(chosen, steady_states(auto.prepared, requests), strict=True):
        assert found.steady.converged
        right = abs(curve.amplitude[k])
        error = abs(right / abs(found.steady.amplitude) - 1)
        missed.append(error / curve.error_indicator[k])
        assert curve.flag[k] == CONVERGED
    assert np.mean(np.array(missed) <= 1) >= 0.9


def test_results_and_figures_carry_the_steady_states(auto, tmp_path):
    microslip.write_results(auto, tmp_path / "out")
    (curve,) = auto.responses
    with microslip.load_results(tmp_path / "out") as found:
        assert found.data["anchors"].sizes["anchor"] == len(curve.anchors)
    assert (tmp_path / "out" / "figures" / "response.png").exists()
    again = microslip.load_run(tmp_path / "out")
    assert again.responses[0].anchors == curve.anchors


def test_auto_needs_the_refined_model():
    with pytest.raises(InputError, match=r"analysis\.response\.method.*add it to variants"):
        described(method="auto", variants=["consistent"])


@pytest.mark.parametrize(("key", "value"), [("error", 0), ("error", 2), ("points", 3)])
def test_what_auto_cannot_do_is_said(key, value):
    with pytest.raises(InputError, match=rf"analysis\.response\.{key}"):
        described(method="auto", **{key: value})


def small(moment, **response):
    file = {**FILE, "contact": {"friction": 0.35, "pairs": 21}, "load": {"moment": moment}}
    analysis = {"response": {"method": "auto", "points": 8, **response}}
    return microslip.run(microslip.parse_joint({**file, "analysis": analysis}))


@pytest.mark.parametrize("moment", [1e-6, 1e-3])
def test_under_a_small_load_the_joint_sticks_and_is_linear(moment):
    """Amplitude over moment is that of the stuck joint, below the table and at its beginning."""
    done = small(moment)
    (curve,) = done.responses
    assert not done.failures
    assert (curve.flag == CONVERGED).all()
    assert len(curve.anchors) <= 8
    mode = done.mode
    lag = curve.frequency[np.argmax(np.abs(curve.amplitude))]
    assert lag == pytest.approx(mode.stuck_frequency, rel=3e-3)


def test_no_answer_lies_between_two_folds():
    """Where the larger branch is not claimed, the smaller one is shown, which rises with the load."""
    (low,) = small(255.0, **{"from": 42.8, "to": 43.1, "count": 40}).responses
    (high,) = small(260.0, **{"from": 42.8, "to": 43.1, "count": 40}).responses
    both = (low.flag == CONVERGED) & (high.flag == CONVERGED)
    sure = both & np.isfinite(low.error_indicator) & np.isfinite(high.error_indicator)
    grown = np.abs(high.amplitude[sure]) / np.abs(low.amplitude[sure])
    assert (grown > 1).mean() > 0.9


def test_what_is_known_at_ctrl_c_is_kept(monkeypatch):
    begun = []

    def interrupted(joint, targets):
        begun.append(len(targets))
        if len(begun) > 1:
            raise KeyboardInterrupt
        return sought(joint, targets)

    monkeypatch.setattr(method, "sought", interrupted)
    done = small([10.0, 20.0])
    (curve,) = done.responses
    assert done.interrupted
    assert 1 <= len(curve.anchors) <= begun[0]

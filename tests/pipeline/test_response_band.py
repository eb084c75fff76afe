"""The forced response with defaults: its band, its table, and what it says where there is no peak."""

from __future__ import annotations

from dataclasses import replace
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest
from conftest import description

from microslip.analyses.reduced.anchors import Anchor
from microslip.analyses.reduced.response import forced_response
from microslip.analyses.reduced.sweep import CONVERGED
from microslip.describe.reading import parse_joint
from microslip.errors import Caution
from microslip.pipeline import response
from microslip.pipeline.auto import Anchored
from microslip.pipeline.loads import frictionless_resonance, opening_amplitude
from microslip.pipeline.response import models_of
from microslip.pipeline.run import Run, run
from microslip.results.summary import summary

TABLE = {"amplitudes": 14, "steps": 80, "upper_modes": 0}
STOUT = {
    "beams": {"length": "0.16 m", "thickness": "16 mm", "overlap_half_length": "40 mm"},
    "material": {"youngs_modulus": "210 GPa", "poissons_ratio": 0.3, "density": "7850 kg/m^3"},
    "contact": {"friction": 0.5, "pairs": 31},
    "clamp": {"force": "0.2 MN/m", "half_length": "20 mm"},
    "damping": {"beta": "1 us"},
}


def asked(load: dict[str, Any], response: dict[str, Any] | None = None, **sections: Any) -> Run:
    """A coarse joint with a forced response alone."""
    analysis = {"response": {"count": 101, **(response or {})}, "reduced": TABLE}
    sections = {"contact": {"friction": 0.25, "pairs": 31}, **sections}
    return run(parse_joint({**description(31, 20), **sections, "load": load, "analysis": analysis}))


@pytest.fixture(scope="module")
def reference() -> Run:
    """Two loads and no band."""
    return asked({"moment": [20, 50]})


def test_cycles_are_not_needed(reference: Run) -> None:
    assert list(reference.outcomes) == ["reduced", "response"]
    assert not reference.failures


@pytest.mark.parametrize("sections", [{}, STOUT])
def test_every_peak_is_inside_whatever_the_joint(sections: dict[str, Any]) -> None:
    """Loads a hundredfold apart; the band holds the sliding and the stuck state too."""
    found = asked({"moment_over_clamp_force_length": [2e-6, 2e-5, 2e-4]}, **sections)
    assert not found.failures
    (band,) = summary(found)["response_band"]
    assert band["from_hz"] < found.mode.sliding_frequency
    assert found.mode.stuck_frequency < band["to_hz"]
    assert band["origin"] == "from the joint and its loads"
    for curve in found.responses:
        assert band["from_hz"] < curve.peak_frequency < band["to_hz"]
        assert len(curve.frequency) == band["points"] >= 101
        steps = np.abs(np.diff(curve.amplitude)) / np.abs(curve.amplitude).max()
        assert np.median(steps) < 0.05
    softened = [response.peak_frequency for response in found.responses]
    assert softened == sorted(softened, reverse=True)


def test_all_curves_share_one_list_of_frequencies(reference: Run) -> None:
    first, second = reference.responses
    assert first.frequency is second.frequency or (first.frequency == second.frequency).all()
    assert (reference.frictionless.frequency == first.frequency).all()  # type: ignore[union-attr]


def test_a_given_band_is_that_list_of_frequencies_to_the_bit() -> None:
    found = asked({"moment": 50}, {"from": 170, "to": 186})
    (response,) = found.responses
    assert (response.frequency == np.linspace(170, 186, 101)).all()
    model, table = models_of(found.assembly, found.outcomes)["refined"]
    alone = forced_response(model, table, np.linspace(170, 186, 101), 50.0)
    assert (response.amplitude == alone.amplitude).all()
    assert summary(found)["response_band"][0]["origin"] == "as given"


def test_one_end_may_be_given(reference: Run) -> None:
    found = asked({"moment": [20, 50]}, {"from": "150 Hz"})
    axis, free = found.value("response").axis, reference.value("response").axis
    assert (axis.low, axis.high) == (150, free.high)
    assert axis.origin == "'from' as given, the other end from the joint and its loads"
    wrong = asked({"moment": 50}, {"from": "2 kHz"})
    assert "analysis.response.from = 2000 Hz leaves no band" in str(wrong.failures[0])


@pytest.mark.parametrize(("reach", "moves"), [(0.0, 0), (0.05, 1), (0.1, 2), (1.0, 3)])
def test_a_band_holds_the_peak_that_motions_over_time_have(
    reference: Run, monkeypatch: pytest.MonkeyPatch, reach: float, moves: int
) -> None:
    """That goes on below the resonance of the model: by a share of its frequency."""
    low = reference.value("response").axis.low
    peak, known, interrupted_after = low * (1 - reach), list[Any](), 9

    def anchored(*given: Any) -> Anchored:
        base, before = given[3], given[-1]
        if len(known) == interrupted_after:
            raise KeyboardInterrupt
        known.append(before and before.number)
        rises = np.where(base.frequency < low, 10.0 - np.abs(base.frequency - peak) / low, 1.0)
        one = Anchor(low, 1e-3 + 0j, 0j, 0.0)
        error = np.zeros(len(rises))
        curve = replace(
            base,
            variant="auto",
            amplitude=rises * np.abs(base.amplitude).max() + 0j,
            flag=np.full(len(rises), CONVERGED),
            anchors=(one,),
            error_indicator=error,
        )
        if not reach:
            curve = replace(curve, amplitude=base.amplitude, flag=base.flag)
        of_this = SimpleNamespace(settled={}, number=len(known))
        return Anchored(curve, (), False, "", (), (), of_this)  # type: ignore[arg-type]

    monkeypatch.setattr(response, "anchored_response", anchored)
    found = asked({"moment": [50]}, {"method": "auto"})
    (curve,), axis = found.responses, found.value("response").axis
    assert known == [None, *range(1, moves + 1)]
    assert (curve.frequency == axis.frequency).all()
    assert (np.diff(axis.frequency) > 0).all()
    cut = [one for one in found.cautions if "beyond which its resonance may lie" in str(one)]
    assert len(cut) == (reach == 1.0)
    assert (curve.peak_frequency == axis.low) == (reach == 1.0)
    if 0 < reach < 1:
        assert axis.low < peak
    known.clear()
    interrupted_after = max(moves, 1)
    halted = asked({"moment": [50]}, {"method": "auto"}) if moves else found
    assert bool(moves) == halted.interrupted
    assert len(halted.responses) == 1  # over the band before the last
    assert (halted.value("response").axis.low > axis.low) == bool(moves)
    known.clear()
    interrupted_after = 9
    given = asked({"moment": [50]}, {"method": "auto", "from": low, "to": 190})
    assert given.responses[0].frequency[0] == low


@pytest.mark.parametrize(("band", "end"), [((120, 170), 170), ((186, 200), 186)])
def test_a_peak_at_the_edge_is_a_failure_with_a_remedy(band: tuple[int, int], end: int) -> None:
    found = asked({"moment": 50}, {"from": band[0], "to": band[1]})
    (failure,) = found.failures
    assert failure.reason == f"no peak in the band: the amplitude is largest at its edge, {end} Hz"
    assert "leave them out" in failure.remedy
    (row,) = summary(found)["response"]
    assert row["peak_at_edge"] is True
    assert row["peak_frequency_hz"] is None


def test_peaks_are_compared_with_the_true_frictionless_one() -> None:
    """In or out of the band."""
    frequency, ratios = 0.0, []
    for band in ({}, {"from": 176, "to": 182}):
        found = asked({"moment": 50}, band)
        frequency, unit = frictionless_resonance(found.assembly, 50.0)
        (row,) = summary(found)["response"]
        ratio = row["peak_amplitude_over_frictionless"]
        assert ratio == pytest.approx(row["peak_modal_amplitude"] / unit, rel=1e-12)
        ratios.append(ratio)
    assert frequency < 176
    assert ratios[0] == pytest.approx(ratios[1], rel=1e-3)


def opens_by(found: Run) -> Caution:
    """Of all cautions the one that says from which moment on the joint opens."""
    said = "its resonance opens the joint: from M = "
    (caution,) = [one for one in found.cautions if said in one.reason]
    return caution


def limit_of(found: Run) -> float:
    """Moment that the caution names; it is an answer, and no failure."""
    assert not found.failures
    caution = opens_by(found)
    (row,) = summary(found)["response"]
    named = float(caution.reason.split("from M = ")[1].split()[0])
    assert row["opens_from_load"] == pytest.approx(named, rel=1e-3)
    assert str(caution) in summary(found)["warnings"]
    return named


def test_a_resonance_that_opens_the_joint_says_from_which_moment_on() -> None:
    """Just below that moment everything has an answer; it grows with the clamp force."""
    over = asked({"moment": 200})
    limit = limit_of(over)
    opening = opening_amplitude(over.assembly)
    assert over.tables["prescribed"].amplitude[-1] == pytest.approx(0.97 * opening, rel=5e-3)
    below = asked({"moment": 0.95 * limit})
    assert not below.failures
    assert len(below.responses[0].unconverged) == 0
    assert summary(below)["response"][0]["opens_from_load"] is None
    assert not [caution for caution in below.cautions if "opens" in caution.reason]
    twice = asked({"moment": 400}, clamp={"force": "2 MN/m", "half_length": "25 mm"})
    assert limit_of(twice) == pytest.approx(2 * limit, rel=1e-3)
    assert "raise clamp.force more than" in opens_by(twice).remedy


def test_a_joint_without_friction_is_linear_until_it_opens() -> None:
    without = {"contact": {"friction": 0, "pairs": 31}}
    found = asked({"moment": [0.01, 0.02]}, **without)
    assert not found.failures
    first, second = found.responses
    assert second.amplitude == pytest.approx(2 * first.amplitude, rel=1e-9)
    frequency, amplitude = frictionless_resonance(found.assembly, 0.01)
    assert first.peak_frequency == pytest.approx(frequency, rel=1e-6)
    assert first.peak_amplitude == pytest.approx(amplitude, rel=1e-3)
    opened = asked({"moment": 50}, **without)
    assert not opened.failures
    (caution,) = opened.cautions
    assert "without friction the vibration opens the joint" in caution.reason
    limit = float(caution.remedy.split("below ")[1].split()[0])
    exact = opening_amplitude(opened.assembly) / frictionless_resonance(opened.assembly)[1]
    assert limit == pytest.approx(exact, rel=0.02)


def test_the_load_of_a_rho_does_not_depend_on_models_mesh_or_steps() -> None:
    moments = set()
    for pairs, steps, variants in ((21, 60, ["refined"]), (31, 80, ["consistent", "refined"])):
        document = {
            **description(pairs, 20),
            "load": {"rho": [2.4]},
            "analysis": {
                "cycle": {"count": 5, "steps": steps, "largest": 0.05},
                "response": {"count": 51, "variants": variants},
                "reduced": {**TABLE, "steps": steps},
            },
        }
        found = run(parse_joint(document))
        moments |= {response.load for response in found.responses}
    assert len(moments) == 1

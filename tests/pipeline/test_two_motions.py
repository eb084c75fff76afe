"""A response that folds has two motions, and both are motions of the full joint."""

from __future__ import annotations

import numpy as np
import pytest
from conftest import description

from microslip.analyses.time.scheme import time_scheme
from microslip.analyses.time.steady import raised_state, steady_state
from microslip.describe.reading import parse_joint
from microslip.pipeline.run import Run, run
from microslip.results.dataset import dataset
from microslip.results.summary import summary
from microslip.show.plots.response import response_figure

STEPS = 150


def asked(**response: float | str) -> Run:
    """A coarse joint under a load whose response folds by three hertz."""
    analysis = {
        "response": {"count": 61, **response},
        "reduced": {"amplitudes": 14, "steps": 80, "upper_modes": 0},
    }
    contact = {"friction": 0.25, "pairs": 31}
    load = {"moment": [20, 120]}
    document = {**description(31, 20), "contact": contact, "load": load, "analysis": analysis}
    return run(parse_joint(document))


@pytest.fixture(scope="module")
def folds() -> Run:
    return asked()


def test_time_integration_finds_both(folds: Run) -> None:
    """The smaller after the load was raised from rest, the larger from its own velocity."""
    curve = folds.responses[-1]
    assert curve.smaller is not None
    k = int(curve.folded[np.argmin(np.abs(curve.frequency[curve.folded] - 172.5))])
    larger, smaller = curve.amplitude[k], curve.smaller.amplitude[k]
    assert abs(larger) > 1.5 * abs(smaller)
    f = float(curve.frequency[k])
    scheme = time_scheme(folds.prepared, 1 / (f * STEPS), frequency=f)
    rest = raised_state(scheme, f, curve.load, 60)
    low = steady_state(scheme, f, curve.load, start=rest, tolerance=1e-4)
    high = steady_state(scheme, f, curve.load, guess=larger, tolerance=1e-4)
    assert low.converged
    assert high.converged
    assert abs(low.amplitude) == pytest.approx(abs(smaller), rel=0.05)
    assert abs(high.amplitude) == pytest.approx(abs(larger), rel=0.05)


def test_a_given_band_shows_the_larger_whichever_way_it_reaches(folds: Run) -> None:
    """Of two bands, one of which reaches further down, the other further up."""
    for low, high in ((165, 180), (171.2, 200)):
        curve = asked(**{"from": f"{low} Hz", "to": f"{high} Hz"}).responses[-1]
        whole = folds.responses[-1]
        inside = curve.frequency[curve.folded]
        assert len(inside) > 3
        known = np.interp(inside, whole.frequency, np.abs(whole.amplitude))
        assert np.abs(curve.amplitude[curve.folded]) == pytest.approx(known, rel=0.01)


def test_it_is_said_and_shown(folds: Run) -> None:
    single, double = folds.responses
    assert single.smaller is None
    assert double.smaller is not None
    said = [c for c in folds.cautions if "two steady motions" in c.reason]
    assert len(said) == 1
    assert "M = 120" in said[0].where
    rows = summary(folds)["response"]
    assert rows[0]["two_motions_from_hz"] is None
    span = [rows[1]["two_motions_from_hz"], rows[1]["two_motions_to_hz"]]
    assert span == list(double.frequency[double.folded][[0, -1]])
    kept = dataset(folds)["response"]["smaller_modal_amplitude"]
    assert not kept[0].notnull().any()
    assert kept[1].notnull().sum() == len(double.folded)
    figure = response_figure(folds)
    assert figure is not None
    (legend,) = figure.legends
    assert "smaller of two motions" in [text.get_text() for text in legend.get_texts()]

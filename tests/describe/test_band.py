"""Frequencies by a list or from, to and count."""

from __future__ import annotations

import itertools

import pytest
from hypothesis import given
from hypothesis import strategies as st

from microslip.describe.band import Band, evenly
from microslip.describe.excitation import SteppedSine
from microslip.describe.requests import HarmonicAnalysis, ResponseAnalysis, TimeAnalysis

DWELLS = {"signal": "stepped_sine", "cycles": 3, "moment": 1}


@given(st.floats(1, 1e4), st.floats(1, 1e4), st.integers(2, 50))
def test_evenly_meets_both_ends(start, stop, count):
    values = evenly(start, stop, count)
    assert (len(values), values[0], values[-1]) == (count, start, stop)
    steps = [b - a for a, b in itertools.pairwise(values)]
    assert steps == pytest.approx([(stop - start) / (count - 1)] * (count - 1), abs=1e-8)


@pytest.mark.parametrize("analysis", [TimeAnalysis, HarmonicAnalysis])
def test_an_analysis_visits_its_frequencies_upward_and_once(analysis):
    assert analysis(frequencies=[180, 170, 180]).band() == (170.0, 180.0)
    assert analysis(from_=170, to=172, count=5).band() == (170.0, 170.5, 171.0, 171.5, 172.0)


def test_a_stepped_sine_dwells_in_the_order_written():
    assert SteppedSine(frequencies=[180, 170, 180], **DWELLS).band() == (180.0, 170.0, 180.0)
    assert SteppedSine(from_=172, to=170, count=3, **DWELLS).band() == (172.0, 171.0, 170.0)


@pytest.mark.parametrize("section", [Band, TimeAnalysis, HarmonicAnalysis])
@pytest.mark.parametrize(
    ("given", "message"),
    [
        ({}, "give a list of frequencies, or from, to and count"),
        ({"from_": 1, "to": 2}, "give a list of frequencies, or from, to and count"),
        ({"frequencies": [1, 2], "count": 3}, "remove from, to and count"),
    ],
)
def test_half_a_band_or_two_are_refused(section, given, message):
    with pytest.raises(ValueError, match=message):
        section(**given)


@pytest.mark.parametrize(
    ("analysis", "name"),
    [(TimeAnalysis, "time"), (HarmonicAnalysis, "harmonic"), (ResponseAnalysis, "response")],
)
@pytest.mark.parametrize("to", [170, 160])
def test_a_band_that_does_not_rise_names_its_section(analysis, name, to):
    with pytest.raises(ValueError, match=rf"must be above analysis\.{name}\.from, 170 Hz"):
        analysis(from_=170, to=to, count=3)


def test_neighbouring_frequencies_alone_are_no_start():
    with pytest.raises(ValueError, match='add "raised", "rest" or "reduced", where those begin'):
        TimeAnalysis(frequencies=[170, 180], starts=["below", "above"])
    assert TimeAnalysis(frequencies=[170], starts=["rest", "below"]).starts == ("rest", "below")
    assert TimeAnalysis(frequencies=[170]).starts == ("raised",)

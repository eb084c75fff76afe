"""From a start to a response by small steps: the way begins at the start, and its end is the response."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from test_spatial_harmonic import block, solved

from microslip.analyses.harmonic import approach as approach_module
from microslip.analyses.harmonic.approach import Approach, approached
from microslip.analyses.harmonic.paths import CONTROL, FrequencyPath
from microslip.analyses.harmonic.points import describe
from microslip.analyses.harmonic.problem import with_harmonics
from microslip.analyses.harmonic.starts import start_from_point
from microslip.numerics.continuation import ContinuationError, solve_at

HERTZ, LOAD = 0.22, 1.5


@pytest.fixture(scope="module")
def way():
    """A start of five harmonics from an answer with three."""
    joint = block()
    point = solved(joint, HERTZ, LOAD, 3)
    problem = with_harmonics(point.problem, 5)
    return joint, FrequencyPath(problem, LOAD), start_from_point(problem, point)


def test_the_start_is_a_solution_at_the_beginning(way):
    _, path, start = way
    approach = Approach(path, start, HERTZ)
    assert np.abs(approach.at(start.w, 0.0).F).max() <= 1e-12
    whole, usual = approach.at(start.w, 1.0).F, path.at(start.w, HERTZ).F
    assert np.abs(usual).max() > 1e-4
    assert whole == pytest.approx(usual, abs=1e-12)


def test_derivative_over_the_way_by_differences(way):
    _, path, start = way
    approach, share, step = Approach(path, start, HERTZ), 0.3, 1e-6
    ahead, behind = (approach.at(start.w, share + side * step).F for side in (1, -1))
    slope = (ahead - behind) / (2 * step)
    assert approach.at(start.w, share).by_parameter() == pytest.approx(
        slope, abs=1e-5 * np.abs(slope).max()
    )


def test_the_end_is_the_response_that_raising_the_load_finds(way):
    joint, path, start = way
    _, equations, _ = solve_at(path, approached(path, start, HERTZ), HERTZ, CONTROL)
    raised = solved(joint, HERTZ, LOAD, 5)
    found = describe(equations, 0, 0.0)
    assert found.output == pytest.approx(raised.output, rel=1e-7, abs=1e-7)


def test_a_way_that_does_not_arrive_says_how_far_it_got(way, monkeypatch):
    _, path, start = way
    monkeypatch.setattr(approach_module, "STEPS", replace(approach_module.STEPS, max_points=2))
    with pytest.raises(ContinuationError, match="% of it"):
        approached(path, start, HERTZ)

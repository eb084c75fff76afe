"""A pair that sticks all cycle, met by Newton's method from far away on either side."""

from __future__ import annotations

import numpy as np
import pytest

from microslip.analyses.harmonic.paths import EquationsAt, LoadPath
from microslip.analyses.harmonic.problem import harmonic_problem, walking
from microslip.analyses.harmonic.raising import raise_load
from microslip.contact.pairs import tangential
from microslip.numerics.continuation import ContinuationError, StepControl, solve_at

FREQUENCY = 180.0
CONTROL = StepControl(tolerance=1e-10)


@pytest.fixture(scope="module")
def stuck(small_reference):
    """A joint that slips but for some pairs, its load, and the answer that the load is raised to."""
    problem = harmonic_problem(small_reference.joint, harmonics=3)
    load = 3.6e-4 * small_reference.moment
    return problem, load, raise_load(problem, FREQUENCY, load)[0]


def slid(problem, w, way):
    """The same reactions, the bodies slid past each other by `way`, m."""
    guess = w.copy()
    slide = tangential(problem.rigid_spread[:, -1])
    guess[-1] += way / np.abs(slide).max()
    return guess


@pytest.mark.parametrize("way", [1e-4, -1e-4])
def test_the_answer_is_found_from_either_side(stuck, way, monkeypatch):
    problem, load, w = stuck
    path = LoadPath(problem, FREQUENCY, load)
    found, _, steps = solve_at(path, slid(problem, w, way), load, CONTROL)
    cut = np.prod(problem.shape)
    assert np.abs(found - w)[:cut].max() < 1e-7 * problem.force_scale
    monkeypatch.setattr(EquationsAt, "corner", lambda self, beyond: None)
    try:
        blind = solve_at(path, slid(problem, w, way), load, CONTROL)[2]
    except ContinuationError:
        blind = CONTROL.max_iterations
    assert steps < blind


def test_the_step_ends_where_a_pair_has_stuck_from_the_beginning(stuck):
    """Displacements are linear in the unknowns: the share is exact."""
    problem, load, w = stuck
    path = LoadPath(problem, FREQUENCY, load)
    one, other = slid(problem, w, 2e-5), slid(problem, w, -1e-5)
    share = path.at(one, load).corner(path.at(other, load))
    assert share is not None
    assert 0 < share < 1
    there = path.at(one + share * (other - one), load)
    away = tangential(there.point.v[:, 0]) - problem.held[:, 0]
    assert np.abs(away).min() < 1e-9 * 1e-5


def test_a_joint_that_walks_has_no_such_corner(stuck):
    problem, load, w = stuck
    free, guess = walking(problem, slid(problem, w, 2e-5))
    path = LoadPath(free, FREQUENCY, load)
    assert path.at(guess, load).corner(path.at(slid(problem, guess, -1e-5), load)) is None

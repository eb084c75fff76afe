"""Responses that no branch leads to: those that time integration settles in from rest."""

from __future__ import annotations

from dataclasses import replace

import pytest

from microslip.analyses.harmonic.adaptive import Adaptive, Ladder
from microslip.analyses.harmonic.answers import Answers
from microslip.analyses.harmonic.over_time import OverTime
from microslip.analyses.harmonic.paths import CONTROL
from microslip.analyses.harmonic.points import describe, distance
from microslip.analyses.harmonic.problem import harmonic_problem
from microslip.analyses.harmonic.raising import follow_frequency
from microslip.analyses.harmonic.seeking import Search, Way
from microslip.errors import MicroslipError
from microslip.numerics.continuation import Branch, ContinuationError

FREQUENCY, BAND = 171.5, (170.0, 180.0)

ENOUGH = 17
"""Harmonics at most: of nine there are too few for what is asked of sizes here."""


@pytest.fixture(scope="module")
def whole(small_reference):
    """A light joint's branch from above its fold: two sheets, and on the way back a third."""
    load = 7.2e-4 * small_reference.moment
    problem = harmonic_problem(small_reference.joint)
    return follow_frequency(problem, load, BAND)


@pytest.fixture
def search(small_reference, whole):
    """Of the part of that branch which is not the one from rest, ended so."""
    path, branch = whole
    motions = OverTime(small_reference.joint, path.load)
    rest = motions.from_rest(FREQUENCY)
    turn = branch.folds[0] + 1

    def of(ended, over_time=motions):
        parts = (branch.points[:turn], branch.points[turn:])
        far = max(parts, key=lambda part: _apart(path, part, rest))
        ways = [Way(path, Branch(tuple(far), ended))]
        ladder = Ladder(path, CONTROL, Adaptive(most=ENOUGH), over_time)
        return Search(ladder, ways, BAND, lambda _: False), rest

    return of


def failing(error):
    """A function that raises it."""

    def fails(*_):
        raise error

    return fails


def _apart(path, points, rest):
    """How far the nearest point of a branch to the frequency is from a motion, relative."""
    near = min(points, key=lambda point: abs(point.p - FREQUENCY))
    return abs(describe(path.at(near.u, near.p), 0, 0.0).amplitude / rest.amplitude - 1)


def test_a_branch_that_ended_early_may_lack_the_motion_from_rest(search):
    found, rest = search("failed: a corner")
    found.at(FREQUENCY)
    sizes = [abs(point.amplitude) for _, _, point in found.points]
    assert len(sizes) > 1
    assert min(abs(size / abs(rest.amplitude) - 1) for size in sizes) < 5e-3
    assert not found.failures


def test_branches_that_were_followed_to_their_ends_are_believed(search):
    found, _ = search("range")
    found.at(FREQUENCY)
    assert len(found.points) == 1


def test_no_branch_at_all_is_not_all_of_them(whole):
    path, branch = whole
    ladder = Ladder(path, CONTROL, Adaptive())
    assert not Search(ladder, [], BAND, lambda _: False).complete
    assert Search(ladder, [Way(path, Branch(branch.points, "range"))], BAND, bool).complete


def test_a_motion_from_rest_without_a_response_is_said(search, monkeypatch):
    found, rest = search("failed: a corner")

    monkeypatch.setattr(Ladder, "solve_from_cycle", failing(MicroslipError("no harmonics")))
    found.at(FREQUENCY)
    assert len(found.points) == 1
    (failure,) = found.failures
    assert "from rest there is another motion, for which no response was found" in failure.reason
    found, _ = search("failed: a corner")
    unsettled = replace(rest, converged=False)
    monkeypatch.setattr(OverTime, "from_rest", lambda *_: unsettled)
    found.at(FREQUENCY)
    assert not found.failures


def test_a_motion_from_rest_whose_response_the_modes_alone_have(search, monkeypatch):
    found, rest = search("failed: a corner")

    monkeypatch.setattr(Answers, "from_start", failing(ContinuationError("none of all pairs")))
    found.at(FREQUENCY)
    modal = [point for _, _, point in found.points if point.modal]
    assert modal
    assert min(distance(point.amplitude, rest.amplitude) for point in modal) < 3e-3

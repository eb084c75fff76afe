"""What motions say of an amplitude that is shown: truths, other branches, and motions that do not settle."""

import sys

from conftest import ROOT

sys.path.insert(0, str(ROOT / "benchmarks" / "population"))

import numpy as np
import pytest
import truths
from truths import HORIZON, PART, SETTLED, End, Marched, judged, to_its_end

SMALL = End(0.1, 0.1, True)


def test_after_the_load_was_raised_its_motion_is_the_truth():
    found = judged(1.0, End(1.02, 1.02, True), [])
    assert found["settled"]
    assert found["raised"]
    assert abs(found["error"] - 0.02 / 1.02) < 1e-12


def test_on_another_branch_the_motion_beside_the_one_shown_is():
    found = judged(1.0, SMALL, [End(0.5, 0.5, True), End(0.99, 0.99, True)])
    assert found["settled"]
    assert not found["raised"]
    assert found["truth"] == 0.99


def test_a_motion_beside_the_one_shown_that_does_not_settle_is_no_error_of_another_branch():
    """The motion that the load raised from rest leads to is smaller, and none of this one."""
    found = judged(1.0, SMALL, [End(0.98, 1.01, False)])
    assert not found["settled"]
    assert abs(found["off"] - 0.02 / 0.98) < 1e-12


def test_what_nothing_stays_beside_is_wrong():
    found = judged(1.0, SMALL, [End(0.5, 0.9, False)])
    assert found["settled"]
    assert found["error"] == 9.0


def test_what_creeps_away_after_the_load_was_raised_has_no_truth():
    assert judged(1.0, End(0.5, 0.6, False), []) == {"settled": False, "off": None}
    assert judged(1.0, None, []) == {"settled": False, "off": None}


def marching(monkeypatch, size):
    """A motion whose first harmonic has that size after so many cycles; its state is how many."""

    def watched(scheme, load, state, cycles, phase):
        n = state + np.arange(1, cycles + 1)
        return size(n) + 0j, list(n)

    monkeypatch.setattr(truths, "watched", watched)


@pytest.mark.parametrize("rate", [5e-7, -3e-7])
def test_the_truth_of_bodies_that_walk_is_the_motion_after_as_many_cycles_as_are_shown(
    monkeypatch, rate
):
    """It drifts by less in a thousand cycles than a truth may, but not until then."""
    marching(monkeypatch, lambda n: 1 + rate * n)
    end, state, cycles = to_its_end(None, 1.0, 0, 0.0, HORIZON)
    assert end.settled
    assert cycles == state
    assert end.least == pytest.approx(1 + rate * HORIZON, abs=SETTLED)
    assert abs(end.least - (1 + rate * HORIZON)) <= end.left <= SETTLED


def test_a_transient_is_waited_for_and_a_motion_that_still_changes_then_is_no_truth(monkeypatch):
    marching(monkeypatch, lambda n: 1 + 0.1 * np.exp(-n / 300))
    end, _, cycles = to_its_end(None, 1.0, 0, 0.0, HORIZON)
    assert end.settled
    assert cycles < HORIZON
    assert abs(end.least - 1) <= end.left
    marching(monkeypatch, lambda n: 1 + 1e-5 * n)
    assert not to_its_end(None, 1.0, 0, 0.0, HORIZON).end.settled
    marching(monkeypatch, lambda n: 1 + 0.01 * np.sin(n / 5))
    end = to_its_end(None, 1.0, 0, 0.0, HORIZON).end
    assert not end.settled
    assert end.most - end.least == pytest.approx(0.02, rel=0.01)


def test_with_more_steps_what_was_marched_before_counts(monkeypatch):
    """After as many cycles as are shown there is no walk left to wait for."""
    marching(monkeypatch, lambda n: 1 + 2e-7 * n)
    later = to_its_end(None, 1.0, HORIZON, 0.0, 1000, HORIZON)
    sooner = to_its_end(None, 1.0, 500, 0.0, 1000, 500)
    assert later.end.settled
    assert later.cycles == 2 * PART
    assert sooner.end.settled
    assert abs(sooner.end.least - (1 + 2e-7 * HORIZON)) <= sooner.end.left


@pytest.mark.parametrize(
    ("few", "more", "expected"),
    [
        (End(0.09, 0.11, False), SMALL, SMALL),
        (End(0.96, 1.02, False), End(0.97, 1.03, False), End(0.97, 1.03, False)),
        (End(0.104, 0.105, False), SMALL, SMALL._replace(left=0.104 / 0.1 - 1)),
        (SMALL, End(0.101, 0.101, True), End(0.101, 0.101, True)),
        (SMALL, End(0.2, 0.2, False), End(0.2, 0.2, False)),
        (SMALL, End(0.1, 0.104, False), SMALL._replace(left=0.1 / 0.1 - 0.1 / 0.104)),
    ],
    ids=["few beat", "both do", "few creep", "both settle", "more lead elsewhere", "more beat"],
)
def test_a_motion_is_what_more_steps_make_of_it(monkeypatch, few, more, expected):
    """What beats with few steps may repeat with more, or the other way round."""
    ends = iter([Marched(few, 0, 100), Marched(more, 0, 100)])
    monkeypatch.setattr(truths, "to_its_end", lambda *given: next(ends))
    monkeypatch.setattr(truths, "_scheme", lambda *given: None)
    for name in ("end_of", "placed"):
        monkeypatch.setattr(truths, name, lambda *given: 0)
    end = truths.marched(None, 100.0, 1.0, 0)
    assert (end.least, end.most, end.settled) == expected[:3]
    assert end.left == pytest.approx(expected.left)

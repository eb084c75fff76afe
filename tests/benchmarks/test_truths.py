"""What motions say of an amplitude that is shown: truths, other branches, and motions that do not settle."""

import sys

from conftest import ROOT

sys.path.insert(0, str(ROOT / "benchmarks" / "population"))

from auto import End, judged

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

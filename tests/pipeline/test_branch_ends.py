"""Whether larger branches still have a motion where they are shown to end."""

import tomllib
from types import SimpleNamespace

import numpy as np
import pytest
from unstable_joint import LOAD, UNSTABLE

import microslip
from microslip.analyses.time.scheme import time_scheme
from microslip.analyses.time.steady import steady_state
from microslip.errors import ContactError
from microslip.pipeline import branch_ends as module
from microslip.pipeline.branch_ends import confirm_ends, is_there
from microslip.pipeline.targets import Stepped

STEPS = 150
LARGER = {400.2: -0.01745 - 0.01907j, 424.0: -0.01699 - 0.01344j}
"""First harmonics of the larger motion, m: motions leave it at the first frequency, and not at the other."""


@pytest.fixture(scope="module")
def joint():
    return microslip.prepare(microslip.parse_joint(tomllib.loads(UNSTABLE)))


def stepped(joint, f):
    scheme = time_scheme(joint, 1 / (f * STEPS), frequency=f)
    steady = steady_state(scheme, f, LOAD, guess=LARGER[f], max_cycles=300)
    assert abs(steady.amplitude) == pytest.approx(abs(LARGER[f]), rel=0.05)
    return Stepped(f, steady.amplitude, steady.end, STEPS)


@pytest.mark.parametrize("f", sorted(LARGER))
def test_a_motion_is_there_if_motions_stay_beside_it_with_more_steps(joint, f):
    there, cycles = is_there(joint, LOAD, stepped(joint, f))
    assert there == (f == 424.0)
    assert cycles >= 16


def test_what_settles_elsewhere_or_not_at_all_and_leaves_is_not_there(joint, monkeypatch):
    one = stepped(joint, 424.0)
    assert not is_there(joint, LOAD, one._replace(amplitude=1.2 * one.amplitude))[0]

    unsettled = SimpleNamespace(cycles=100)
    monkeypatch.setattr(module, "settled_with", lambda *given: (unsettled, None))
    for share, there in ((1.05, True), (0.5, False)):
        Q = one.amplitude * np.array([1.0, share])
        monkeypatch.setattr(module, "watched", lambda *given, Q=Q: (Q, []))
        assert is_there(joint, LOAD, one) == (there, 16 * 200)

    def fails(*given):
        raise ContactError("no solution")

    monkeypatch.setattr(module, "settled_with", fails)
    assert is_there(joint, LOAD, one) == (False, 0)


class Ends:
    """A search whose outermost motion is the first that has not been found gone."""

    def __init__(self):
        self.base, self.finer = SimpleNamespace(load=1.0), {7}
        self.settled = {k: Stepped(float(k), 1.0, None, STEPS) for k in (5, 6, 7, 8)}
        self.confirmed, self.spent = {}, 0

    def open_ends(self):
        first = next(k for k in self.settled if self.confirmed.get(k, True))
        return [first] if first not in self.confirmed else []


def test_the_next_motion_inward_is_asked_until_one_is_there(monkeypatch):
    """One that has the most steps already has been asked of before."""
    asked = []

    def gone(joint, load, one):
        asked.append(one.frequency)
        return False, 3

    monkeypatch.setattr(module, "is_there", gone)
    search = Ends()
    assert confirm_ends(None, search) == 2
    assert asked == [5.0, 6.0]
    assert search.confirmed == {5: False, 6: False, 7: True}
    assert search.spent == 6

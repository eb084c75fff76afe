"""Where bodies that walk are when a motion counts, against the motion marched alone."""

import tomllib
from types import SimpleNamespace

import numpy as np
import pytest

import microslip
from microslip.analyses.time import resting
from microslip.analyses.time.offset import Looked
from microslip.analyses.time.resting import rested
from microslip.analyses.time.scheme import time_scheme
from microslip.analyses.time.starts import end_of
from microslip.analyses.time.steady import RAISED, raised_state, steady_state
from microslip.analyses.time.watching import watched
from microslip.errors import ContactError
from microslip.pipeline import more_steps, walked
from microslip.pipeline.more_steps import with_more_steps
from microslip.pipeline.targets import TOLERANCE, More, Stepped
from microslip.pipeline.walked import after_raising, counted_from

WALKS = """
[beams]
length = "0.0327643 m"
thickness = "0.00381777 m"
overlap_half_length = "0.00990151 m"
[material]
youngs_modulus = "7e+10 Pa"
poissons_ratio = 0.3606
density = "2700 kg/m^3"
[contact]
friction = 0.77730
pairs = 11
[clamp]
force = "31589.4 N/m"
half_length = "0.00496613 m"
[support]
horizontal_spring = "4.39156e+06 N/m/m"
[damping]
beta = "2.6425e-07 s"
[load]
moment = 5.4323
"""
"""A joint drawn at random whose bodies walk for thousands of cycles."""

FREQUENCY, LATER, LOAD, STEPS = 3840.0, 3780.0, 5.4323, 150


def prepared(pairs):
    text = WALKS.replace("pairs = 11", f"pairs = {pairs}")
    return microslip.prepare(microslip.parse_joint(tomllib.loads(text)))


@pytest.fixture(scope="module")
def joint():
    return prepared(11)


def marched(joint, cycles, frequency=FREQUENCY, steps=STEPS):
    """A scheme, a state after the load was raised, the motion from there, and its state after each cycle."""
    scheme = time_scheme(joint, 1 / (frequency * steps), frequency=frequency)
    start = raised_state(scheme, frequency, LOAD, RAISED)
    return scheme, start, *watched(scheme, LOAD, start, cycles)


@pytest.fixture(scope="module")
def on_the_way(joint):
    """A motion whose bodies walk, first harmonics and end."""
    scheme, _, Q, states = marched(joint, 600)
    return Q, end_of(states[-1], 0.0, scheme, FREQUENCY)


@pytest.fixture(scope="module")
def long():
    """One marched for so long that it counts."""
    return marched(prepared(21), 4000, LATER)


def off(there, Q):
    """Of an amplitude, relative to that after 4000 cycles."""
    return abs(abs(there.steady.amplitude) / np.abs(Q[-100:]).mean() - 1)


def test_a_walk_is_counted_from_where_the_load_was_raised(long):
    """Its first motion is a tenth smaller than that after 4000 cycles, which the search leads to alone."""
    scheme, _, Q, _ = long
    size = float(np.abs(Q[-100:]).mean())
    assert np.abs(Q[200:300]).mean() < 0.9 * size
    error = off(counted_from(scheme, *after_raising(scheme, LOAD), size), Q)
    print(f"{error:.1e}")
    assert error <= 5e-3


def test_a_walk_is_counted_from_where_a_search_began(long):
    """One that has settled where the bodies are after 1200 cycles: counted from there they are too far."""
    scheme, start, Q, states = long
    steady = steady_state(scheme, LATER, LOAD, start=states[1200], tolerance=1e-4, max_cycles=16)
    assert steady.converged
    error, later = (
        off(rested(scheme, steady, TOLERANCE, begin=begin), Q) for begin in (start, states[1200])
    )
    print(f"{error:.1e} and {later:.1e}")
    assert error <= 5e-3
    assert later > 0.01


def test_a_walk_on_another_branch_is_none(joint, monkeypatch):
    """Nor is one that is not found; on the same branch that is an error."""
    start, steady = "after raising", SimpleNamespace(amplitude=1.0, converged=True)
    there = SimpleNamespace(steady=SimpleNamespace(amplitude=1.1))
    monkeypatch.setattr(walked, "rested_soon", lambda *known: there)
    assert counted_from(None, start, steady, 1.0) is there
    assert counted_from(None, start, steady, 3.0) is None
    monkeypatch.setattr(walked, "rested_soon", lambda *known: None)
    assert counted_from(None, start, steady, 1.0) is None
    steady.converged = False
    assert counted_from(None, start, steady, 3.0) is None
    with pytest.raises(resting.WalksOnError):
        counted_from(None, start, steady, 1.0)

    def walks_on(*known):
        raise resting.WalksOnError("on")

    monkeypatch.setattr(walked, "rested_soon", walks_on)
    assert counted_from(None, start, steady, 3.0) is None
    with pytest.raises(resting.WalksOnError):
        counted_from(None, start, steady, 1.0)


def looked(place, speed, size=1.0):
    offset, rate = np.full((3, 1), place), np.full((3, 1), speed)
    return Looked(offset, rate, size, np.array([place, 1.0]), np.array([speed, 0.0]))


def moved_by(after, place, swing=0.0):
    """Of a search that has begun with the bodies at a place, and in whose last cycle they swing so far."""
    v = np.zeros((3, 6))
    v[1, 1::2] = swing
    steady = SimpleNamespace(cycle=SimpleNamespace(v=v))
    return resting._moved_by(steady, after, SimpleNamespace(v=np.array([0.0, place] * 3)))


@pytest.mark.parametrize("moved", [2.0, -2.0])
def test_what_a_search_has_moved_bodies_by_is_taken_back(moved):
    """To where they were before it; the way there is as fast as they are."""
    after, asked = looked(5.0, 0.01), []

    def look(vector):
        asked.append(vector)
        return looked(vector[0], 0.02)

    cycles = moved_by(after, 5.0 - moved)
    assert cycles == pytest.approx(moved / 0.01)
    before = resting._before_the_search(after, cycles, look)
    assert before.offset.mean() == pytest.approx(5.0 - moved)
    assert before.way == pytest.approx([0.02, 0.0])
    assert len(asked) == 1


def test_what_they_walk_or_swing_meanwhile_is_not_taken_back():
    after, way = looked(5.0, 0.01), 0.01 * resting.IN_VAIN
    assert moved_by(after, 5.0 - 0.99 * way) == 0.0
    assert moved_by(after, 5.0 - 1.01 * way) > 0.0
    assert moved_by(after, 3.0, swing=2.1) == 0.0
    assert moved_by(after, 3.0, swing=1.9) > 0.0


def test_bodies_are_not_taken_back_to_another_motion():
    """Nor to where none is found, or none that walks the same way."""
    after = looked(5.0, 0.01)

    def fails(vector):
        raise ContactError("no steady motion at this offset")

    uneven = looked(3.0, 0.02)._replace(rate=np.array([[0.0], [0.02], [0.04]]))
    others = (looked(3.0, -0.02), looked(3.0, 0.02, size=0.5), uneven)
    for look in (fails, *((lambda vector, other=other: other) for other in others)):
        assert resting._before_the_search(after, 200.0, look) is None
    assert resting._before_the_search(after, 200.0, lambda vector: looked(3.0, 0.02)) is not None


def test_what_more_steps_do_to_a_walk_is_what_marching_says(joint, on_the_way):
    """A search moves the bodies: it leads to a motion that is 3 % larger, which marching does not."""
    Q, end = on_the_way
    one = Stepped(FREQUENCY, complex(Q[-1]), end, STEPS, marched=True, walks=True)
    more = with_more_steps(joint, LOAD, one)
    _, _, finer, _ = marched(joint, 600, steps=4 * STEPS)
    true = np.abs(finer[-50:]).mean() / np.abs(Q[-50:]).mean()
    own = abs(more.amplitude) / abs(Q[-1])
    print(f"{own - 1:+.1e} for {true - 1:+.1e}, stated {more.drifts:.1e}")
    assert abs(own / true - 1) <= more.drifts
    assert more.drifts <= 5e-3
    assert more.strays == 0.0
    sought = with_more_steps(joint, LOAD, one._replace(walks=False))
    assert sought.drifts + abs(abs(sought.amplitude) / abs(Q[-1]) - true) > 0.03


def test_what_falls_on_the_way_with_more_steps_leaves(joint, on_the_way, monkeypatch):
    """And where a step does not solve nothing is known of it but what motions do beside it."""
    Q, end = on_the_way
    one = Stepped(FREQUENCY, complex(Q[-1]), end, STEPS, marched=True, walks=True)
    method = "microslip.pipeline.more_steps."
    found = SimpleNamespace(amplitude=one.amplitude, cycles=9)
    stay = SimpleNamespace(amplitude=one.amplitude, strays=0.02, varies=0.01, cycles=9)
    monkeypatch.setattr(method + "_settled", lambda *known: (found, stay))

    def falls(scheme, load, state, cycles):
        few = scheme.steps == STEPS
        return np.full(cycles, 1.0 if few else 0.85, complex), [state] * cycles

    monkeypatch.setattr(method + "watched", falls)
    assert np.isinf(with_more_steps(joint, LOAD, one).strays)

    def fails(*known):
        raise ContactError("not solved")

    monkeypatch.setattr(method + "watched", fails)
    more = with_more_steps(joint, LOAD, one)
    assert more.amplitude is None
    assert (more.strays, more.varies) == (0.02, 0.01)


def test_a_walk_with_more_steps_is_counted_from_where_that_with_fewer_is(joint, monkeypatch):
    """Where raising the load leads elsewhere; from the same beginning both say the same."""
    scheme = time_scheme(joint, 1 / (FREQUENCY * STEPS), frequency=FREQUENCY)
    start, steady = after_raising(scheme, LOAD)
    there = counted_from(scheme, start, steady, abs(steady.amplitude))
    assert there.began is not None
    Q, end = there.steady.amplitude, end_of(there.steady.cycle.state, 0.0, scheme, FREQUENCY)
    one = Stepped(FREQUENCY, Q, end, STEPS, marched=True, walks=True, began=there.began)
    few = More(0.9 * Q, 100, drifts=0.1)
    raised = more_steps._walked_anew(joint, LOAD, one, few)
    assert raised.drifts < 0.01
    assert raised.cycles > 100

    def elsewhere(*known):
        return start, SimpleNamespace(amplitude=0.1 * Q, converged=True, cycles=9)

    def none(scheme, start, steady, size):
        return (
            None
            if abs(steady.amplitude) < 0.5 * size
            else counted_from(scheme, start, steady, size)
        )

    def fails(*known):
        raise ContactError("it opens")

    monkeypatch.setattr(more_steps, "counted_from", none)
    monkeypatch.setattr(more_steps, "after_raising", elsewhere)
    other = more_steps._walked_anew(joint, LOAD, one, few)
    monkeypatch.setattr(more_steps, "after_raising", fails)
    began = more_steps._walked_anew(joint, LOAD, one, few)
    assert began.drifts < 0.01
    apart = abs(abs(began.amplitude) / abs(raised.amplitude) - 1)
    assert apart <= began.drifts + raised.drifts
    assert began.amplitude == other.amplitude
    nowhere = more_steps._walked_anew(joint, LOAD, one._replace(began=None), few)
    assert nowhere == few

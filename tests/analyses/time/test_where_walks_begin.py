"""Where bodies that walk rest, from what a search has ended with: against marching alone."""

import tomllib
from dataclasses import replace

import numpy as np
import pytest
from walking_joints import FALLS, SOON_AT_REST, WEAKLY_DAMPED, better_held, marched_alone

import microslip
from microslip.analyses.time import offset as offset_module
from microslip.analyses.time import points, resting, walking_on
from microslip.analyses.time.offset import Looked, Rest, as_far
from microslip.analyses.time.point import Request, TimePoint
from microslip.analyses.time.points import steady_states
from microslip.analyses.time.resting import WalksOnError, followed, rested
from microslip.analyses.time.scheme import prestressed_state, time_scheme
from microslip.analyses.time.steady import raised_state, steady_state
from microslip.analyses.time.walking_on import WATCHED, marched_on
from microslip.analyses.time.watching import watched
from microslip.contact.pairs import mean_slip
from microslip.errors import ContactError
from microslip.pipeline.targets import STEPS
from microslip.pipeline.time import walking

FREQUENCY, LOAD = 466.48, 2.3224


@pytest.fixture(scope="module")
def point():
    """Of a joint whose walk changes its vibration so fast that no search settles."""
    joint = microslip.prepare(microslip.parse_joint(tomllib.loads(better_held(8.0))))
    (found,) = steady_states(joint, [Request(1.0, FREQUENCY, LOAD, None, 0j, past="raised")])
    assert isinstance(found, TimePoint)
    return found


@pytest.fixture(scope="module")
def fastest():
    """A scheme of one that is held still better, its raised state, and what a long search ends with."""
    joint = microslip.prepare(microslip.parse_joint(tomllib.loads(better_held(30.0))))
    scheme = time_scheme(joint, 1 / (FREQUENCY * STEPS), frequency=FREQUENCY)
    raised = raised_state(scheme, FREQUENCY, LOAD, 10)
    return scheme, raised, steady_state(scheme, FREQUENCY, LOAD, start=raised, max_cycles=50)


def test_points_are_where_marching_alone_leads(point):
    """The bodies stand where they do, though searches of 400 cycles have moved them elsewhere.

    Without looks on the way, where their speed falls, they are 7e-4 off.
    """
    size, offset = marched_alone(better_held(8.0), FREQUENCY, LOAD)
    assert abs(size[-1] / size[200] - 1) > 0.05, "it walks"
    assert point.settled
    assert abs(point.steady.amplitude) == pytest.approx(size[-40:].mean(), rel=3e-4)
    place = mean_slip(point.steady.cycle.v[0], 2)[0]
    assert place == pytest.approx(offset[-1], rel=0.02)
    assert point.ahead > 0.02, "and far on"


@pytest.mark.validate
def test_what_a_search_has_ended_with_need_not_have_settled(fastest):
    scheme, raised, steady = fastest
    assert not steady.converged
    assert rested(scheme, steady, 1e-5) is None
    rest = rested(scheme, steady, 1e-5, begin=raised)
    size, offset = marched_alone(better_held(30.0), FREQUENCY, LOAD)
    assert rest.steady.converged
    assert abs(rest.steady.amplitude) == pytest.approx(size[-40:].mean(), rel=3e-3)
    assert mean_slip(rest.steady.cycle.v[0], 2)[0] == pytest.approx(offset[-1], rel=0.03)


def test_a_vibration_that_changes_by_more_than_its_walk_has_not_settled(fastest, monkeypatch):
    scheme, raised, steady = fastest
    monkeypatch.setattr(resting, "_by_the_walk", lambda *_: 0.0)
    with pytest.raises(WalksOnError, match="the vibration changes by more"):
        rested(scheme, steady, 1e-5, begin=raised)


def test_where_rest_is_not_found_that_is_said(fastest, monkeypatch):
    scheme, raised, steady = fastest
    monkeypatch.setattr(resting, "come_to_rest", lambda *_, **__: None)
    with pytest.raises(WalksOnError, match="come to rest is not found"):
        rested(scheme, steady, 1e-5, begin=raised)


def test_a_motion_that_falls_on_the_way_is_the_one_that_it_falls_to():
    """Periodic and stable where a search leads, and a sixteenth of that where its bodies have walked to."""
    joint = microslip.prepare(microslip.parse_joint(tomllib.loads(FALLS)))
    frequency, load, larger = 391.9, 0.69237, 4.6e-4
    scheme = time_scheme(joint, 1 / (frequency * STEPS), frequency=frequency)
    start = prestressed_state(scheme, larger, 2 * np.pi * frequency)
    size = np.abs(watched(scheme, load, start, 2000, phase=np.pi / 2)[0])
    begins = steady_state(scheme, frequency, load, guess=-1j * larger)
    assert begins.converged
    assert abs(begins.amplitude) == pytest.approx(larger, rel=0.03)
    assert size[100:300] == pytest.approx(larger, rel=0.03)
    (point,) = steady_states(joint, [Request(1.0, frequency, load, None, -1j * larger)])
    assert isinstance(point, TimePoint)
    assert point.settled
    assert abs(point.steady.amplitude) == pytest.approx(size[-100:].mean(), rel=0.01)
    assert point.walked > 0
    assert 300 < point.lasts < resting.HORIZON


def test_where_no_search_finds_the_place_of_rest_marching_does(monkeypatch):
    """As the search leaves it the motion is 8e-5 off. Whether its rest is found hangs on rounding."""

    def not_found(*given, **options):
        raise WalksOnError("on")

    monkeypatch.setattr(points, "rested", not_found)
    joint = microslip.prepare(microslip.parse_joint(tomllib.loads(SOON_AT_REST)))
    frequency, load = 454.1638, 3200.2976
    scheme = time_scheme(joint, 1 / (frequency * STEPS), frequency=frequency)
    begin = raised_state(scheme, frequency, load, 10)
    first = steady_state(scheme, frequency, load, start=begin)
    size = np.abs(watched(scheme, load, begin, 1000)[0])
    assert abs(abs(first.amplitude) / size[-1] - 1) > 2e-5
    (point,) = steady_states(joint, [Request(1.0, frequency, load, None, 0j, past="raised")])
    assert point.settled
    assert abs(point.steady.amplitude) == pytest.approx(size[-1], rel=2e-6)
    assert 0 < point.lasts <= 300
    assert point.ahead == 0.0


@pytest.mark.parametrize("off", [1.0, 1.5])
def test_a_motion_that_no_search_ends_beside_is_as_it_was_marched(monkeypatch, off):
    """One of another size is another motion."""
    joint = microslip.prepare(microslip.parse_joint(tomllib.loads(WEAKLY_DAMPED)))
    scheme = time_scheme(joint, 1 / (FREQUENCY * STEPS), frequency=FREQUENCY)
    steady = steady_state(scheme, FREQUENCY, LOAD, start=raised_state(scheme, FREQUENCY, LOAD, 10))
    real = walking_on.sought_there

    def elsewhere(*given):
        found = real(*given)
        return replace(found, amplitude=off * found.amplitude)

    monkeypatch.setattr(walking_on, "sought_there", elsewhere)
    found = marched_on(scheme, steady, 1e-5, most=50)
    assert found.steady.converged is (off == 1.0)
    assert abs(found.steady.amplitude) == pytest.approx(abs(steady.amplitude), rel=2e-3)


@pytest.mark.parametrize("horizon", [100, 150])
def test_what_walks_on_is_known_where_it_is_then(horizon):
    """Marched on, a walk that soft supports stop after 50,000 cycles alone."""
    joint = microslip.prepare(microslip.parse_joint(tomllib.loads(WEAKLY_DAMPED)))
    scheme = time_scheme(joint, 1 / (FREQUENCY * STEPS), frequency=FREQUENCY)
    raised = raised_state(scheme, FREQUENCY, LOAD, 10)
    steady = steady_state(scheme, FREQUENCY, LOAD, start=raised)
    found = marched_on(scheme, steady, 1e-5, most=horizon)
    Q, states = watched(scheme, LOAD, steady.cycle.state, horizon + WATCHED, steady.phase)
    assert found.steady.converged
    assert abs(found.steady.amplitude) == pytest.approx(np.abs(Q).mean(), rel=1e-3)
    walked = mean_slip(states[-1].v, 2) - mean_slip(steady.cycle.state.v, 2)
    assert found.walked == pytest.approx(abs(walked[0]), rel=0.2)
    assert found.offset is None
    assert np.isinf(found.lasts)
    assert np.isnan(found.ahead)


def test_more_looks_at_a_walk_tell_better_where_it_is():
    """Of a speed that falls as a square does, u(n) = 1 - 1/(1 + c n); two ends alone are far off."""

    def look(u):
        rate = np.full((3, 1), 1e-4 * (1 - u) ** 2)
        return Looked(np.full((3, 1), u), rate, complex(1 + 0.2 * u), np.array([u]), rate[0])

    rest = Rest(1.2 + 0j, 0.0, np.array([1.0]), np.array([1.0]), 1e5, (look(0.0),))
    exact, missed = 1 - 1 / 1.4, []
    for _ in range(1 + resting.REFINED):
        vector, amplitude = rest.on_the_way(4000.0)
        assert abs(amplitude) == pytest.approx(1 + 0.2 * vector[0])
        missed.append(abs(vector[0] / exact - 1))
        here = look(float(vector[0]))
        rest = rest.knowing(here, look(float(rest.widest(here)[0])))
    assert missed[0] > 0.1
    assert missed[-1] < 1e-3
    offsets = [one.at(one.along) for one in rest.looked]
    assert offsets == sorted(offsets)


@pytest.mark.validate
def test_where_rest_is_not_found_it_is_as_far_as_was_looked(monkeypatch):
    """Three looks are enough for 4000 cycles of a walk that lasts 200,000."""
    monkeypatch.setattr(offset_module, "LOOKS", 3)
    joint = microslip.prepare(microslip.parse_joint(tomllib.loads(WEAKLY_DAMPED)))
    (found,) = steady_states(joint, [Request(1.0, FREQUENCY, LOAD, None, 0j, past="raised")])
    assert isinstance(found, TimePoint)
    size, offset = marched_alone(WEAKLY_DAMPED, FREQUENCY, LOAD)
    assert found.settled
    assert abs(found.steady.amplitude) == pytest.approx(size[-40:].mean(), rel=1e-3)
    assert mean_slip(found.steady.cycle.v[0], 2)[0] == pytest.approx(offset[-1], rel=0.02)
    assert np.isinf(found.lasts)
    (said,) = walking([found], 2)
    assert "cycles, after which the motion is shown: where they come to rest was not" in said.reason


@pytest.mark.parametrize(
    ("speed", "size", "said"),
    [
        (1e-4, 1.0, ""),
        (3e-4, 1.0, "where they are later is not found"),
        (1e-4, 0.5, "another branch"),
    ],
)
def test_bodies_on_the_way_are_where_further_looks_confirm_it(speed, size, said):
    """By looks at a walk as far as 0.45: by further ones they may be so fast as to be beyond that by then."""

    def look(u, speed=1e-4, size=1.0):
        rate = np.full((3, 1), speed)
        return Looked(np.full((3, 1), u), rate, complex(size), np.array([u]), rate[0])

    def further(vector):
        return look(float(vector[0]), speed, size)

    rest = as_far([look(0.0), look(0.2), look(0.45)])
    assert rest is not None
    if said:
        with pytest.raises(ContactError, match=said):
            followed(rest, further)
        return
    _, there, moved = followed(rest, further)
    assert there is not None
    assert there[0][0] == pytest.approx(0.4)
    assert moved == pytest.approx(0.0, abs=1e-9)


@pytest.mark.parametrize("off", [1.0, 1.02, 0.3])
def test_what_a_search_finds_at_rest_is_held_against_the_looks(monkeypatch, fastest, off):
    """Beside the end of a branch it may fall to another motion; what it is off is not known of it."""
    scheme, raised, steady = fastest
    known, real = rested(scheme, steady, 1e-5, begin=raised), resting.sought_there
    assert known is not None

    def elsewhere(*given):
        found = real(*given)
        return replace(found, amplitude=off * found.amplitude)

    monkeypatch.setattr(resting, "sought_there", elsewhere)
    if off < 0.5:
        with pytest.raises(WalksOnError, match="the motion is another"):
            rested(scheme, steady, 1e-5, begin=raised)
        return
    found = rested(scheme, steady, 1e-5, begin=raised)
    assert found is not None
    assert abs(found.steady.amplitude) == pytest.approx(off * abs(known.steady.amplitude), rel=1e-9)
    assert found.apart == pytest.approx(known.apart + off - 1, abs=2 * known.apart)


@pytest.mark.parametrize("last", ["back", "still", "another"])
def test_what_is_no_walk_of_the_same_motion_is_not_counted(last):
    def look(u, speed=1e-4, size=1.0):
        rate = np.full((3, 1), speed)
        return Looked(np.full((3, 1), u), rate, complex(size), np.array([u]), rate[0])

    bad = {"back": look(0.3), "still": look(0.9, 0.0), "another": look(0.9, size=0.5)}
    far = as_far([look(0.0), look(0.2), look(0.5), bad[last], look(0.95)])
    assert far is not None
    vector, _ = far.on_the_way(4000.0)
    assert vector[0] == pytest.approx(0.4)
    assert far.on_the_way(6000.0) is None, "not seen"
    assert as_far([look(0.0)]) is None

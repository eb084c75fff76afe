"""Where bodies that walk come to rest: against walks in closed form, and against marching alone."""

import tomllib

import numpy as np
import pytest
from walking_joints import ENDS_ON_THE_WAY, WEAKLY_DAMPED

import microslip
from microslip.analyses.time.deviations import StateSpace
from microslip.analyses.time.offset import HORIZON, LOOKS, Looked, as_far, come_to_rest
from microslip.analyses.time.point import Request, TimePoint
from microslip.analyses.time.points import steady_states
from microslip.analyses.time.resting import followed
from microslip.analyses.time.scheme import time_scheme
from microslip.analyses.time.steady import drift_of, raised_state, steady_state
from microslip.analyses.time.watching import watched
from microslip.contact.pairs import tangential_vectors
from microslip.pipeline import creep
from microslip.pipeline.brief_motion import patient_motion
from microslip.pipeline.creep import Walk, crept
from microslip.pipeline.more_steps import _at_another_speed as at_another_speed
from microslip.pipeline.targets import STEPS, Found, Target
from microslip.pipeline.time import walking
from microslip.pipeline.walk import seek


def moving(speed, size):
    """A look at motions whose one number is the offset: how fast it moves on, and their size."""

    def look(vector):
        look.seen += 1
        u = float(vector[0])
        rate = np.full((3, 1), speed(u))
        return Looked(np.full((3, 1), u), rate, complex(size(u)), vector, rate[0])

    look.seen = 0
    return look


@pytest.mark.parametrize("guess", [None, 0.7, 1.0, 1.4, -2.0])
@pytest.mark.parametrize("power", [1.0, 2.0])
def test_it_is_where_the_speed_falls_to_zero(guess, power):
    """However the speed falls, whatever is beyond, and whatever is known of others."""
    look = moving(lambda u: 1e-4 * max(1 - u, 0.0) ** power, lambda u: 1 + 0.2 * u)
    guess = None if guess is None else np.array([guess])
    rest = come_to_rest(look, look(np.array([0.0])), guess)
    assert rest is not None
    assert abs(abs(rest.amplitude) / 1.2 - 1) <= rest.apart <= 2e-3
    assert look.seen <= LOOKS + 1


@pytest.mark.parametrize("guess", [None, 0.7, 1.0, 1.4])
@pytest.mark.parametrize("bend", [-0.5, 0.0, 2.0])
def test_it_is_where_they_would_walk_back_beyond(guess, bend):
    """A root of the speed like any other; the state there is one between two that were looked at."""
    look = moving(lambda u: 1e-4 * (1 - u) * (1 + bend * u * (1 - u)), lambda u: 1 + 0.2 * u)
    rest = come_to_rest(look, look(np.array([0.0])), None if guess is None else np.array([guess]))
    assert rest is not None
    assert abs(abs(rest.amplitude) / 1.2 - 1) <= rest.apart <= 1e-3
    assert abs(rest.vector[0] - 1.0) <= 7 * rest.apart  # the amplitude changes by a sixth of that
    assert look.seen <= 12


def test_what_creeps_on_unevenly_beyond_rest_does_not_walk():
    """Pairs that stick give way a little: no mean of that is a walk."""

    def look(vector):
        one = walked(vector)
        uneven = 1e-9 * np.array([[1.0], [0.2], [0.0]])
        return one if one.rate.any() else one._replace(rate=uneven)

    walked = moving(lambda u: 1e-4 * max(1 - u, 0.0), lambda u: 1 + 0.2 * u)
    rest = come_to_rest(look, look(np.array([0.0])), np.array([1.4]))
    assert rest is not None
    assert abs(abs(rest.amplitude) / 1.2 - 1) <= rest.apart


@pytest.mark.parametrize("top", [0.8, 0.9, 0.98])
def test_amplitudes_that_agree_by_chance_tell_nothing(top):
    """The largest of all lies beside the offset at which they rest: some beyond agree with some before."""
    look = moving(lambda u: 1e-4 * max(1 - u, 0.0), lambda u: 1.2 - 0.2 * (u - top) ** 2)
    rest = come_to_rest(look, look(np.array([0.0])), None)
    assert rest is not None
    assert abs(abs(rest.amplitude) / look(np.array([1.0])).amplitude.real - 1) <= rest.apart


def test_bodies_that_nothing_holds_do_not_come_to_rest():
    look = moving(lambda u: 1e-4, lambda u: 1 + 1e-3 * u)
    assert come_to_rest(look, look(np.array([0.0])), None) is None


@pytest.mark.parametrize("cycles", [300.0, 4000.0, 20000.0])
def test_on_the_way_a_walk_is_where_its_speed_has_led(cycles):
    """Of a speed that falls evenly: 1 - exp(-c n); at rest where no more than a thousandth is left."""
    look = moving(lambda u: 1e-4 * (1 - u), lambda u: 1 + 0.2 * u)
    rest = come_to_rest(look, look(np.array([0.0])))
    assert rest is not None
    vector, amplitude = rest.on_the_way(cycles)
    assert vector[0] == pytest.approx(1 - np.exp(-1e-4 * cycles), rel=1e-3)
    assert abs(amplitude) == pytest.approx(1 + 0.2 * vector[0], rel=1e-3)
    assert rest.on_the_way(60000.0) is None


@pytest.mark.parametrize("before", [0.0, 1000.0])
@pytest.mark.parametrize("rate", [1e-5, 1e-4, 1e-3])
def test_bodies_that_walk_faster_or_slower_are_as_far_elsewhere_as_is_said(rate, before):
    """Of a speed that falls evenly: no less than the amplitude changes by, and not much more."""

    def size(n):
        return 1 + 0.2 * (1 - np.exp(-rate * n))

    look = moving(lambda u: rate * (1 - u), lambda u: 1 + 0.2 * u)
    rest = come_to_rest(look, look(np.array([1 - np.exp(-rate * before)])))
    around = rest.around(before=before)
    changes = abs(size(0.5 * HORIZON) / size(HORIZON) - 1)
    assert around == pytest.approx(2 * changes, rel=0.1, abs=1e-4), "the steepest chord of all"
    few = np.array([rate * np.exp(-rate * HORIZON)])
    slope = 0.2 / size(HORIZON)
    for ratio in (0.5, 0.8, 1.2, 1.5):
        off = abs(size(ratio * HORIZON) / size(HORIZON) - 1)
        said = at_another_speed(few, ratio * few, slope, around)
        assert off <= said + 1e-4
        assert said <= 8 * off + 1e-4


def test_a_largest_size_on_the_way_is_not_missed():
    """It lies beside where they are, by a fifth of the cycles: the slope there counts, not that of half."""
    look = moving(lambda u: 2.5e-4, lambda u: 1.1 - 0.2 * abs(u - 0.8))
    far = as_far([look(np.array([u])) for u in (0.0, 0.8, 1.0, 2.0)])
    assert far.around() == pytest.approx(0.2 / 1.06, rel=1e-6)


def test_what_is_not_known_of_a_walk_is_said_so():
    look = moving(lambda u: 1e-4 * (1 - u), lambda u: 1 + 0.2 * u)
    rest = come_to_rest(look, look(np.array([0.5])))
    assert np.isnan(rest.around(before=0.6 * HORIZON)), "nothing is known of half as many"
    far = as_far([look(np.array([u])) for u in (0.0, 0.2, 0.4)])
    assert np.isnan(far.around()), "nor of twice as many"
    assert far.around(2000.0) > 0.01


@pytest.mark.parametrize("cycles", [1000.0, 4000.0])
def test_more_looks_on_the_way_know_where_bodies_are(cycles):
    """Of a speed that falls as a square, u = c n/(1 + c n), where another motion tells the place of rest."""
    rate = 2e-4
    look = moving(lambda u: rate * max(1 - u, 0.0) ** 2, lambda u: 1 + 0.2 * u**2)
    rest = come_to_rest(look, look(np.array([0.0])), np.array([1.0]))
    there = rate * cycles / (1 + rate * cycles)
    size = 1 + 0.2 * there**2
    assert abs(abs(rest.on_the_way(cycles)[1]) / size - 1) > 0.01, "few looks do not"
    rest, found, moved = followed(rest, look, cycles)
    assert abs(abs(found[1]) / size - 1) <= moved + 3e-3
    assert moved <= 3e-3
    assert abs(found[0][0] - there) < 0.02


def test_a_fall_to_another_branch_is_no_rest():
    look = moving(lambda u: 1e-4 * (1 - u), lambda u: 1.0 if u < 0.5 else 0.4)
    assert come_to_rest(look, look(np.array([0.0])), None) is None


@pytest.mark.parametrize("guess", [0.7, 1.4, 4.0])
@pytest.mark.parametrize("end", [1.02, 1.3])
def test_rest_beside_the_end_of_a_branch_is_found(guess, end):
    """Beyond that the motion is another: a guess, or a secant, that leads there is too far."""
    look = moving(
        lambda u: 1e-4 * (1 - u) if u < end else 0.0, lambda u: 1 - 0.1 * u if u < end else 0.3
    )
    rest = come_to_rest(look, look(np.array([0.0])), np.array([guess]))
    assert rest is not None
    assert abs(abs(rest.amplitude) / 0.9 - 1) <= rest.apart <= 1e-3


@pytest.mark.parametrize("hole", [(0.6, 0.8), (0.9, 1.05)])
@pytest.mark.parametrize("guess", [0.7, 0.75, 0.9, 1.0, 1.4])
def test_a_place_of_rest_beyond_where_the_branch_ends_is_none(guess, hole):
    """The bodies do not get to it: in between the motion is another. No look is made there again."""
    look = moving(lambda u: 1e-4 * (1 - u), lambda u: 0.3 if hole[0] < u < hole[1] else 1 - 0.1 * u)
    begin, seen = look(np.array([0.0])), []

    def looking(vector):
        seen.append(look(vector))
        return seen[-1]

    rest = come_to_rest(looking, begin, np.array([guess]))
    met = [i for i, one in enumerate(seen) if abs(one.amplitude) < 0.5]
    assert rest is None or not met
    places = [float(one.vector[0]) for one in seen]
    assert all(max(places[i + 1 :], default=0.0) < places[i] for i in met)


@pytest.mark.parametrize("end", [0.45, 0.9])
def test_a_branch_that_ends_on_the_way_is_known_as_far_as_it_goes(end):
    """Looks beyond its end are passed over: where bodies are before they get there is known all the same."""
    walked, seen = moving(lambda u: 1e-4 * (1 - u), lambda u: 1 - 0.1 * u if u < end else 0.3), []

    def look(vector):
        seen.append(walked(vector))
        return seen[-1]

    assert come_to_rest(look, look(np.array([0.0])), np.array([1.4])) is None
    far = as_far(seen)
    assert far is not None
    assert 0.9 * end <= float(far.offset[0]) < end
    there = far.on_the_way(4000.0)
    assert there is not None
    assert abs(there[1]) == pytest.approx(1 - 0.1 * (1 - np.exp(-0.4)), rel=1e-3)
    assert far.on_the_way(50000.0) is None, "it has fallen by then"


def test_bodies_that_rest_behind_where_they_walked_have_not_come_to_rest():
    walked = moving(lambda u: 1e-4 if u < 0.5 else 0.0, lambda u: 1 + 1e-6 * u)

    def look(vector):
        one = walked(vector)
        return one if one.rate.any() else one._replace(offset=one.offset - 2.0)

    assert come_to_rest(look, look(np.array([0.0])), None) is None


WALKS = """
[beams]
length = "49.4757 mm"
thickness = "3.77222 mm"
overlap_half_length = "17.4418 mm"
[material]
youngs_modulus = "7e+10 Pa"
poissons_ratio = 0.3256
density = "2700 kg/m^3"
[contact]
friction = 0.47170
pairs = 41
[clamp]
force = "18257 N/m"
half_length = "6.64149 mm"
[support]
horizontal_spring = "4.28664e7 N/m/m"
[damping]
beta = "8.6925e-06 s"
[load]
moment = "5.1 N*m/m"
"""
FREQUENCY, LOAD = 2137.6, 5.108109


@pytest.fixture(scope="module")
def alone():
    """A scheme, its raised state and a motion whose bodies walk, marched alone: sizes and offsets."""
    joint = microslip.prepare(microslip.parse_joint(tomllib.loads(WALKS)))
    scheme = time_scheme(joint, 1 / (FREQUENCY * STEPS), frequency=FREQUENCY)
    raised = raised_state(scheme, FREQUENCY, LOAD, 10)
    Q, states = watched(scheme, LOAD, raised, 2400)
    return (
        scheme,
        raised,
        np.abs(Q),
        np.array([tangential_vectors(one.v, 2).mean() for one in states]),
    )


def test_a_walk_ends_where_marching_alone_leads(alone):
    scheme, raised, size, offset = alone
    early, late, last = offset[[1599, 1999, 2399]]
    end = last + (last - late) ** 2 / ((late - early) - (last - late))
    assert abs(size[199] / size[-1] - 1) > 0.02, "it walks"
    found = crept(scheme, LOAD, raised, walk=Walk())
    assert found.rest is not None
    assert found.rest[0] == pytest.approx(end, rel=0.02)
    assert found.doubt < 2e-3
    assert abs(found.amplitude) == pytest.approx(size[-100:].mean(), rel=found.doubt + 1e-3)


def test_a_short_search_ends_where_marching_alone_leads(alone):
    scheme, _, size, offset = alone
    found = patient_motion(scheme.joint, LOAD, FREQUENCY, -1j * size[199])
    assert found.walk < 1e-4
    assert found.doubt < 0.01
    assert abs(found.amplitude) == pytest.approx(size[-100:].mean(), rel=found.doubt + 1e-3)
    assert found.walked == pytest.approx(abs(offset[-1] - offset[0]), rel=0.05)


def test_points_that_settle_while_the_bodies_walk_say_so(alone):
    """By how much in a cycle, against the offsets of the motion marched alone."""
    scheme, raised, _, offset = alone
    steady = steady_state(scheme, FREQUENCY, LOAD, start=raised, tolerance=1e-4)
    assert steady.converged
    at = tangential_vectors(steady.cycle.state.v, 2).mean()
    after = int(np.argmin(np.abs(offset - at)))
    marched = (offset[after + 10] - offset[after - 10]) / 20
    assert drift_of(steady, 2) == pytest.approx(marched, rel=0.05)
    (caution,) = walking([TimePoint(1.0, 0.5, steady)], 2)
    assert "walk past each other at 1 of 1 points" in caution.reason
    held = microslip.prepare(microslip.reference_joint(pairs=11))
    held_scheme = time_scheme(held, 1 / (182.0 * STEPS), frequency=182.0)
    sticks = steady_state(held_scheme, 182.0, 1e-3, tolerance=1e-6)
    assert not list(walking([TimePoint(1.0, 0.5, sticks)], 2))


@pytest.fixture(scope="module")
def rings():
    """A weakly damped joint whose bodies walk for 50,000 cycles: its scheme and raised state."""
    joint = microslip.prepare(microslip.parse_joint(tomllib.loads(WEAKLY_DAMPED)))
    scheme = time_scheme(joint, 1 / (457.66 * STEPS), frequency=457.66)
    return scheme, raised_state(scheme, 457.66, 2.3224, 10)


@pytest.mark.validate
def test_a_long_walk_is_where_marching_alone_is_at_the_horizon(rings):
    scheme, raised = rings
    found = crept(scheme, 2.3224, raised, walk=Walk())
    size = np.abs(watched(scheme, 2.3224, raised, int(HORIZON))[0])
    assert abs(size[-1] / size[200] - 1) > 0.03, "it walks"
    assert abs(found.amplitude) == pytest.approx(size[-40:].mean(), rel=found.doubt + 5e-4)
    assert found.ahead > 0.1, "and far on"
    for share in (0.5, 0.7, 0.9):
        middle = int(share * HORIZON)
        before = abs(size[middle - 20 : middle + 20].mean() / size[-40:].mean() - 1)
        assert before <= (1 - share) * found.around + found.doubt + 5e-4
    assert found.around <= 3 * abs(size[2000] / size[-1] - 1) / 0.5


@pytest.mark.validate
@pytest.mark.parametrize("frequency", [532.38, 533.46])
def test_a_walk_along_a_branch_that_ends_is_where_marching_alone_is_at_the_horizon(frequency):
    """Looks farther on lead to a motion of a third of the size, before bodies rest or beyond that."""
    joint = microslip.prepare(microslip.parse_joint(tomllib.loads(ENDS_ON_THE_WAY)))
    load, scheme = 20.001164763, time_scheme(joint, 1 / (frequency * STEPS), frequency=frequency)
    raised = raised_state(scheme, frequency, load, 10)
    found = crept(scheme, load, raised, walk=Walk())
    size = np.abs(watched(scheme, load, raised, int(HORIZON))[0])
    assert size[600:].max() / size[-1] > 1.02, "it walks"
    assert found.rest is not None
    assert abs(found.amplitude) == pytest.approx(size[-40:].mean(), rel=found.doubt + 5e-4)
    assert found.doubt < 5e-3


@pytest.mark.validate
def test_a_point_over_time_is_where_marching_alone_is_at_the_horizon(rings):
    joint = rings[0].joint
    request = Request(1.0, 466.48, 2.3224, None, 0j, past="raised")
    (point,) = steady_states(joint, [request])
    assert isinstance(point, TimePoint)
    assert point.settled
    scheme = time_scheme(joint, 1 / (466.48 * STEPS), frequency=466.48)
    raised = raised_state(scheme, 466.48, 2.3224, 10)
    size = np.abs(watched(scheme, 2.3224, raised, int(HORIZON))[0])
    assert abs(size[-1] / size[200] - 1) > 0.01, "it walks"
    assert abs(point.steady.amplitude) == pytest.approx(size[-40:].mean(), rel=1e-3)
    assert point.ahead > 0.02, "and far on"
    assert point.lasts > HORIZON


def test_a_search_along_a_response_ends_where_a_march_with_leaps_does(rings):
    """Both look at the walk by searches, but meet it elsewhere: after 200 cycles, and after a few."""
    scheme = time_scheme(rings[0].joint, 1 / (466.48 * STEPS), frequency=466.48)
    raised = raised_state(scheme, 466.48, 2.3224, 10)
    marched = crept(scheme, 2.3224, raised, walk=Walk())
    found = seek(scheme.joint, Target(0, 466.48, 2.3224, 0j))
    assert isinstance(found, Found)
    assert found.rest is not None
    assert marched.rest is not None
    assert found.rest[0] == pytest.approx(marched.rest[0], rel=0.02)
    assert found.ahead == pytest.approx(marched.ahead, rel=0.1)
    apart = found.doubt + marched.doubt + 5e-4
    assert abs(found.amplitude) == pytest.approx(abs(marched.amplitude), rel=apart)


def test_a_long_walk_ends_where_the_bodies_neither_walk_on_nor_back(rings, monkeypatch):
    """What the moves stir rings on; on either side of that place they walk towards it."""
    monkeypatch.setattr(creep, "HORIZON", np.inf)
    frequency, load = 457.66, 2.3224
    scheme, raised = rings
    before = np.abs(watched(scheme, load, raised, 240)[0])[-1]
    found = crept(scheme, load, raised, walk=Walk())
    assert found.rest is not None
    assert abs(abs(found.amplitude) / before - 1) > 0.2, "far from where a search would end"
    space = StateSpace(scheme, 2 * np.pi * frequency)
    early = watched(scheme, load, raised, 240)[1][-41:]
    way = (space.vector(early[-1]) - space.vector(early[0])) / 40
    speed = tangential_vectors(early[-1].v - early[0].v, 2).mean() / 40
    assert speed * found.rest[0] > 0
    rates, sizes = [], []
    for share in (-0.1, 0.0, 0.1):
        moved = space.vector(found.state) + share * found.rest[0] / speed * way
        Q, states = watched(scheme, load, space.state(moved, found.state), 400)
        rates.append(tangential_vectors(states[-1].v - states[-101].v, 2).mean() / 100)
        sizes.append(np.abs(Q[-100:]).mean())
    assert rates[0] > 0 > rates[2], "it walks there from both sides"
    beside = (
        rates[1] / (rates[0] - rates[2]) * (sizes[2] - sizes[0])
    )  # how far that is in amplitude
    assert abs(beside) <= found.doubt * sizes[1]
    assert sizes[1] == pytest.approx(abs(found.amplitude), rel=found.doubt + 1e-4)


def test_what_is_known_of_others_shortens_the_search(alone):
    scheme, raised, _, _ = alone
    first = crept(scheme, LOAD, raised, walk=Walk())
    again = crept(scheme, LOAD, raised, walk=Walk(first.rest))
    assert again.cycles < first.cycles
    apart = abs(abs(again.amplitude) / abs(first.amplitude) - 1)
    assert apart <= first.doubt + again.doubt


def test_a_motion_whose_bodies_rest_is_left_to_itself():
    joint = microslip.prepare(microslip.reference_joint(pairs=11))
    scheme = time_scheme(joint, 1 / (182.0 * STEPS), frequency=182.0)
    raised = raised_state(scheme, 182.0, 40.0, 10)
    plain, found = crept(scheme, 40.0, raised), crept(scheme, 40.0, raised, walk=Walk())
    assert found.rest is None
    assert abs(found.amplitude) == pytest.approx(abs(plain.amplitude), rel=plain.doubt + 1e-4)

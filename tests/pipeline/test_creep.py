"""Where a motion ends after the load was raised: marched with leaps, against searches and marching alone."""

import tomllib
from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest

import microslip
from microslip.analyses.time.scheme import time_scheme
from microslip.analyses.time.steady import raised_state, steady_state
from microslip.analyses.time.watching import watched
from microslip.errors import ContactError
from microslip.pipeline import creep, marched
from microslip.pipeline import ringing as module
from microslip.pipeline.brief_motion import patient_motion
from microslip.pipeline.creep import crept
from microslip.pipeline.marched import raised_and_marched
from microslip.pipeline.targets import STEPS, Found, Lost, Target
from microslip.pipeline.wandering import Wander, wander_of

LOAD, FREQUENCY = 40.0, 182.0


@pytest.fixture(scope="module")
def scheme():
    joint = microslip.prepare(microslip.reference_joint(pairs=11))
    return time_scheme(joint, 1 / (FREQUENCY * STEPS), frequency=FREQUENCY)


@pytest.fixture(scope="module")
def raised(scheme):
    return raised_state(scheme, FREQUENCY, LOAD, 10)


def test_it_ends_where_a_search_does_where_nothing_creeps(scheme, raised):
    found = crept(scheme, LOAD, raised)
    other = steady_state(scheme, FREQUENCY, LOAD, start=raised, tolerance=1e-7)
    assert other.converged
    assert abs(found.amplitude) == pytest.approx(abs(other.amplitude), rel=found.doubt + 1e-4)
    assert found.doubt <= creep.STILL


def test_the_state_is_one_of_the_motion(scheme, raised):
    found = crept(scheme, LOAD, raised)
    Q, _ = watched(scheme, LOAD, found.state, 5)
    np.testing.assert_allclose(np.abs(Q), abs(found.amplitude), rtol=found.doubt + 1e-6)


def drift(measure, before=None):
    """After 60 cycles, what is left of another."""
    own = creep._Drift(None, np.array(measure), np.array(measure), 1e-5)
    return own if before is None else own.after(before, 60.0)


def test_leaps_grow_while_the_drift_stays_and_end_where_it_turns():
    first = drift([1.0, 0.5])
    kept, settling = drift([0.8, 0.4], first), drift([0.1, 0.05], first)
    assert creep._next_leap(0.0, kept) == creep.LEAP
    assert creep._next_leap(100.0, kept) == 200.0
    assert creep._next_leap(creep.FARTHEST, kept) == creep.FARTHEST
    assert creep._next_leap(200.0, settling) == 100.0
    assert creep._next_leap(0.0, settling) == 0.0
    assert creep._next_leap(200.0, drift([-1.0, -0.5], first)) == 0.0


def test_a_leap_along_a_drift_that_decays_goes_as_far_as_that_does():
    """The sum of a geometric progression, from the middle of a block on; of a steady one, its length."""
    first = drift([1.0, 0.5])
    kept = drift([0.8, 0.4], first)
    every = 0.8 ** ((30.0 + np.arange(0.005, 120.0, 0.01)) / 60)
    assert kept.summed(120.0, 60) == pytest.approx(every.sum() * 0.01, rel=1e-6)
    assert drift([1.0, 0.5], first).summed(120.0, 60) == pytest.approx(120.0, rel=1e-6)


def ringing(decay, spent, beat=0.0):
    """Motions of size 1.001 about which cycles ring by 2 %, and lose so much of that in each."""

    def watched(scheme, load, state, cycles, memory=None):
        n = state + np.arange(1, cycles + 1)
        spent.append(cycles)
        return 1.001 * (
            1 + 0.02 * np.exp(-decay * n) * np.cos(0.9 * n) * np.cos(beat * n)
        ) + 0j, list(n)

    return watched


@pytest.mark.parametrize("beat", [0.0, 0.03])
@pytest.mark.parametrize("decay", [0.05, 0.005])
def test_what_rings_where_bodies_rest_rings_out(monkeypatch, decay, beat):
    """Also where it is of two frequencies, and strays more in some blocks than in those before."""
    spent = []
    monkeypatch.setattr(module, "watched", ringing(decay, spent, beat))
    _, state, doubt, cycles, varies, rings = module.rung_out(None, 40.0, 0, None, 1.0, 0.02)
    assert cycles == state == sum(spent) < 1000
    assert 1e-3 * 0.99 < doubt < 1e-3 + 2 * creep.STILL
    assert varies == 0.0
    assert rings <= creep.STILL


def test_what_does_not_decay_where_bodies_rest_is_doubted_and_left(monkeypatch):
    spent = []
    monkeypatch.setattr(module, "watched", ringing(0.0, spent))
    amplitude, _, doubt, cycles, varies, rings = module.rung_out(None, 40.0, 0, None, 1.0, 0.02)
    assert doubt >= 0.019
    assert varies == pytest.approx(0.02, rel=0.02)
    assert rings == 0.0
    assert amplitude == pytest.approx(1.001, rel=1e-3)
    assert cycles == sum(spent) <= 300


def test_what_decays_too_slowly_to_tell_rings(monkeypatch):
    """It may end: how far it strays is in the doubt, and told apart."""
    monkeypatch.setattr(module, "watched", ringing(6e-4, []))
    _, _, doubt, _, varies, rings = module.rung_out(None, 40.0, 0, None, 1.0, 0.02)
    assert varies == 0.0
    assert 2 * creep.STILL < rings < doubt <= rings + 1e-3 + creep.STILL


CREEPS = """
[beams]
length = "0.135344 m"
thickness = "14.4998 mm"
overlap_half_length = "20.3117 mm"
[material]
youngs_modulus = "1.1e11 Pa"
poissons_ratio = 0.384
density = "4430 kg/m^3"
[contact]
friction = 0.56267
pairs = 5
[clamp]
force = "444238 N/m"
half_length = "14.0827 mm"
[support]
horizontal_spring = "5.86897e7 N/m/m"
[damping]
beta = "8.5042e-07 s"
[load]
moment_over_clamp_force_length = [0.00134723]
"""


@pytest.fixture(scope="module")
def creeping():
    """A scheme, its raised state, sizes when marched alone, and where these lead.

    Three per cent in two thousand cycles, ever more slowly; the last third tells what is still to come.
    """
    frequency, load = 632.323, 81.002
    joint = microslip.prepare(microslip.parse_joint(tomllib.loads(CREEPS)))
    scheme = time_scheme(joint, 1 / (frequency * STEPS), frequency=frequency)
    raised = raised_state(scheme, frequency, load, 10)
    size = np.abs(watched(scheme, load, raised, 2100)[0])
    early, late, last = size[[699, 1399, 2099]]
    to_come = (last - late) ** 2 / ((late - early) - (last - late))
    assert abs(size[99] / last - 1) > 0.02, "it creeps"
    return scheme, raised, frequency, load, size, last + to_come


def test_a_motion_that_creeps_is_followed_to_where_marching_alone_leads(creeping):
    scheme, raised, _, load, size, end = creeping
    found = crept(scheme, load, raised)
    assert found.cycles < len(size) < found.reached
    assert found.doubt < 5e-3
    assert abs(found.amplitude) == pytest.approx(end, rel=found.doubt)
    assert abs(end - abs(found.amplitude)) < 0.1 * (size[-1] - size[99])


@pytest.mark.parametrize("share", [0.94, 1.0])
def test_a_short_motion_says_how_far_it_may_still_creep(creeping, share):
    scheme, _, frequency, load, _, end = creeping
    found = patient_motion(scheme.joint, load, frequency, share * end + 0j)
    assert abs(abs(found.amplitude) / end - 1) <= found.doubt < 0.1


class Counted:
    """States that are the number of cycles so far."""

    def __init__(self, *of):
        pass

    def vector(self, state):
        return np.array([state])

    def measure(self, vector):
        return np.asarray(vector)

    def state(self, vector, like):
        return float(vector[0])


def fake(monkeypatch, size, leaps=False):
    """`crept` of a motion whose size is known after every number of cycles; how far it came in each block.

    With leaps every block has the same drift, along which a leap is as many cycles as it is long.
    """
    ends = []

    def watched(scheme, load, state, cycles, memory=None):
        n = state + np.arange(1, cycles + 1)
        return size(n) + 0j, [float(one) for one in n]

    def looked(Q, states, space):
        ends.append(states[-1])
        way = np.array([1.0 if leaps else (-1.0) ** len(ends)])
        return SimpleNamespace(amplitude=complex(creep.TAPER @ Q[creep.STEP :]), way=way, rate=None)

    monkeypatch.setattr(creep, "StateSpace", Counted)
    monkeypatch.setattr(creep, "contact_memory", lambda scheme: None)
    monkeypatch.setattr(creep, "watched", watched)
    monkeypatch.setattr(creep, "_looked", looked)
    return crept(SimpleNamespace(frequency=1.0), 1.0, 0.0), ends


def uneven(scatter, beat):
    """Sizes that beat, while what they beat about scatters from block to block."""
    own = scatter * np.random.default_rng(3).standard_normal(4000)
    return lambda n: 1 + own[(n / 23).astype(int)] + beat * np.cos(0.9 * n)


def test_what_wanders_is_known_by_all_of_its_blocks(monkeypatch):
    """About one: its last drifts would make three per cent of it, and nothing of it drifts."""
    found, ends = fake(monkeypatch, uneven(2e-3, 0.004))
    assert found.cycles == found.reached == ends[-1] == 1800
    assert abs(abs(found.amplitude) - 1) < found.doubt - found.varies < 0.01
    assert abs(found.amplitude) == pytest.approx(
        uneven(2e-3, 0.0)(np.arange(600, 1801)).mean(), abs=3e-4
    )
    assert 0.004 < found.varies < 0.012
    assert 0 < found.drift < 1e-5
    middle = np.mean(60 * np.arange(11, 31))
    to_come = found.drift * (4000 - middle)
    assert found.doubt - found.varies == pytest.approx(to_come, rel=1e-6)
    monkeypatch.setattr(creep, "wander_of", lambda *of: None)
    assert fake(monkeypatch, uneven(2e-3, 0.004))[0].doubt > 0.03


@pytest.mark.parametrize("varies", [0.0, 1e-4])
def test_what_may_end_hides_a_drift(monkeypatch, varies):
    about = Wander(1 + 0j, 1e-9, 0.0, 1e-4, varies)
    monkeypatch.setattr(creep, "wander_of", lambda means, until: about)
    found, _ = fake(monkeypatch, uneven(2e-3, 0.0))
    assert found.drift == 1e-9 if varies else found.drift > 1e-7
    assert found.doubt == pytest.approx(1e-4, rel=1e-6)


def test_where_the_end_leaves_the_last_drifts_count(monkeypatch):
    own = uneven(2e-4, 0.003)
    found, _ = fake(monkeypatch, lambda n: own(n) * (1 - 0.02 * np.exp((n - 1800) / 60)))
    assert found.doubt > 0.1


def test_a_beat_of_a_creeping_motion_is_told_from_its_way(monkeypatch):
    """Also after leaps, which are where no drift has turned; and how far it goes on is in the doubt."""
    own = uneven(2e-5, 0.002)
    seen = []

    def noted(means, until):
        seen[:] = [one.reached for one in means]
        return wander_of(means, until)

    monkeypatch.setattr(creep, "wander_of", noted)
    found, ends = fake(monkeypatch, lambda n: own(np.minimum(n, 9e4)) * (1 + 1e-6 * n), leaps=True)
    assert found.reached > 2 * found.cycles
    assert found.reached == seen[-1] == pytest.approx(ends[-1])
    assert (np.diff(seen) >= 60).all()
    assert len(seen) < len(ends), "some leaps are taken back"
    assert found.varies == pytest.approx(0.002, rel=0.1)
    assert abs(1 + 1e-6 * ends[-1] - abs(found.amplitude)) < found.doubt


@pytest.mark.parametrize(("lasts", "blocks"), [(np.inf, 9), (1500.0, 30)])
def test_what_beats_by_much_is_left_where_it_stays_for_long(monkeypatch, lasts, blocks):
    """A ring-down that falls by a tenth in four blocks, or not at all in some, goes on falling."""
    found, _ = fake(
        monkeypatch,
        lambda n: 1 + 0.3 * np.exp(-60 * np.floor(n / 240) / lasts * 4) * np.cos(0.9 * n),
    )
    assert found.cycles == 60 * blocks
    assert found.varies == (pytest.approx(0.3, rel=0.02) if lasts == np.inf else 0.0)


def test_what_beats_by_much_is_shown_by_its_mean(monkeypatch):
    """Over the last four blocks, while what it beats about scatters by a hundredth."""
    own = uneven(0.01, 0.3)
    found, ends = fake(monkeypatch, own)
    last = np.arange(ends[-1] - 240, ends[-1]) + 1
    about = (own(last) - 0.3 * np.cos(0.9 * last)).mean()
    assert found.cycles == 540
    assert abs(found.amplitude) == pytest.approx(about, abs=3e-3)


def test_two_ramps_tell_how_well_an_end_is_known(scheme):
    target = Target(3, FREQUENCY, LOAD, 0j)
    found, other = raised_and_marched(scheme.joint, [target, target])
    assert isinstance(found, Found)
    assert 0 <= found.scatter < 1e-3
    assert isinstance(other, Found)
    assert np.isnan(other.scatter)


def test_where_raising_leads_elsewhere_a_motion_begins_at_rest_with_its_own_velocity(
    scheme, raised
):
    """It ends where a search from there does, whether or not the load was raised first."""
    settled = steady_state(scheme, FREQUENCY, LOAD, start=raised, tolerance=1e-7)
    Q = settled.amplitude
    state = next(marched._own_starts(scheme, aimed(Q, settled)))
    one = watched(scheme, LOAD, state, 1)[0][0]
    assert abs(one) == pytest.approx(abs(Q), rel=0.5)  # it moves with that velocity, in phase
    assert abs(np.angle(one / Q)) < 0.5
    for cold in (True, False):
        size = 3 * abs(Q) if cold else abs(Q)
        target = replace(aimed(Q, settled), cold=cold, expected=size, most=size)
        (found,) = raised_and_marched(scheme.joint, [target])
        assert found.own
        assert abs(found.amplitude) == pytest.approx(abs(Q), rel=found.doubt + 1e-3)


def test_two_motions_on_the_branch_scatter_by_their_difference(scheme, raised, monkeypatch):
    """Rest with a velocity leads to one, the state beside to another that is 2 % larger."""
    settled = steady_state(scheme, FREQUENCY, LOAD, start=raised, tolerance=1e-5)
    state = raised_state(scheme, FREQUENCY, LOAD, 2)
    ends = [creep.Crept(Q, 0.0, 1e-4, state, 60, 60.0) for Q in (1.0 + 0j, 1.02 + 0j)]
    monkeypatch.setattr(marched, "crept", lambda *arguments, **settings: ends.pop(0))
    target = replace(aimed(1.0 + 0j, settled), cold=False)
    (found,) = raised_and_marched(scheme.joint, [target])
    assert found.scatter == pytest.approx(0.02, rel=0.03)


def test_what_falls_from_its_branch_says_nothing_of_the_other(scheme, raised, monkeypatch):
    """Raising the load leads to a smaller motion, and so does the larger one, but with its bodies elsewhere:
    the former is the answer, marched to its end and not left as one of another branch."""
    settled = steady_state(scheme, FREQUENCY, LOAD, start=raised, tolerance=1e-5)
    passed = creep.Crept(0.9 + 0j, 0.0, 1e-4, raised, 60, 60.0)
    fallen = passed._replace(amplitude=0.92 + 0j, rest=np.array([1.0]), around=0.2)
    ended = passed._replace(amplitude=0.901 + 0j, around=0.3)
    met = []

    def marching(*arguments, sizes=(0.0, 0.0), **settings):
        met.append(sizes)
        return [passed, fallen, fallen, ended, ended][len(met) - 1]

    monkeypatch.setattr(marched, "crept", marching)
    target = replace(aimed(1.0 + 0j, settled), expected=10.0, most=10.0)
    (found,) = raised_and_marched(scheme.joint, [target])
    assert found.own
    assert found.amplitude == ended.amplitude
    assert found.around == ended.around
    assert met == [(10.0, 10.0), (0.0, 0.0), (0.0, 0.0), (0.0, 0.0), (0.0, 0.0)]
    assert found.cycles == 5 * 60 + 10 + 10 + 16


@pytest.mark.parametrize(("varies", "shown"), [(0.08, 1.0), (0.3, 0.9)])
def test_a_motion_that_varies_widely_gives_way_to_that_after_the_load_was_raised(
    scheme, raised, monkeypatch, varies, shown
):
    """Raising the load leads to a smaller motion, and the larger one varies for good."""
    settled = steady_state(scheme, FREQUENCY, LOAD, start=raised, tolerance=1e-5)
    small = creep.Crept(0.9 + 0j, 0.0, 1e-4, raised, 60, 60.0)
    large = small._replace(amplitude=1.0 + 0j, doubt=varies, varies=varies)
    ends = iter([small, large, large, small, small])
    monkeypatch.setattr(marched, "crept", lambda *arguments, **settings: next(ends))
    target = replace(aimed(1.0 + 0j, settled), expected=10.0, most=10.0)
    monkeypatch.setattr(marched, "elsewhere", lambda size, sizes: sizes[0] > 0 and size < 0.95)
    (found,) = raised_and_marched(scheme.joint, [target])
    assert found.own
    assert abs(found.amplitude) == shown
    assert found.varies == (varies if shown == 1.0 else 0.0)


def aimed(Q, settled):
    """A motion to be marched from the guess, else from a state."""
    return Target(
        3, FREQUENCY, LOAD, Q, starts=(((settled.end, 1.0),),), expected=abs(Q), most=abs(Q)
    )


def test_what_does_not_solve_is_said(scheme, monkeypatch):
    def unsolved(*arguments, **settings):
        raise ContactError("contact not solved at t = 1 s")

    monkeypatch.setattr(marched, "raised_state", unsolved)
    (found,) = raised_and_marched(scheme.joint, [Target(3, FREQUENCY, LOAD, 0j)])
    assert isinstance(found, Lost)
    assert "not solved" in found.reason

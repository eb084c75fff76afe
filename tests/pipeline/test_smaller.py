"""Smaller motions that repeat, shown where the larger of two does not."""

import tomllib
from dataclasses import replace
from itertools import pairwise

import numpy as np
import pytest
from folding_response import FOLD, branch, folding, held_to
from unstable_joint import LOAD, UNSTABLE

import microslip
from microslip.analyses.reduced.response import larger_within
from microslip.analyses.reduced.surface import contours, load_surface
from microslip.analyses.reduced.sweep import CONVERGED
from microslip.analyses.time.scheme import prestressed_state, time_scheme
from microslip.analyses.time.starts import mixed, placed
from microslip.analyses.time.steady import raised_state, steady_state
from microslip.analyses.time.watching import watched
from microslip.pipeline import choosing, smaller
from microslip.pipeline.search import Search
from microslip.pipeline.targets import Found, Lost, More, Target
from microslip.results.dataset import dataset
from microslip.results.summary import summary
from microslip.show.plots.response import response_figure

LOAD_OF_FOLD, EVERY, WANTED = 40.0, 4, 0.01

MOVES = range(60, 81)
"""Where the larger motion does not repeat, by index."""


@pytest.fixture(scope="module")
def refined():
    return folding()


def known(refined, moves=MOVES, varies=0.05):
    """A search that knows the larger branch, on which motions vary for good, or by too much to be shown."""
    model, table, base = refined
    search = Search(load_surface(model, table, FOLD, LOAD_OF_FOLD), base, 100)
    for k in range(0, len(FOLD), EVERY):
        search.keep(target_of(k), steady(k, varies=varies if k in moves and varies else 0.0))
        if k in moves and not varies:
            search.anchors.pop(k)
            search.found.pop(k)
            search.lost[k] = Lost("it varies too much", 10, left=True)
    return search


def target_of(k):
    return Target(k, float(FOLD[k]), LOAD_OF_FOLD, 0j)


def steady(k, name="larger", varies=0.0):
    Q = complex(branch(name)[k])
    return Found(Q, 1e-8, 1e-4 + varies, "", 10, scatter=0.0, past=0.0, varies=varies)


def of(name, doubt=0.0):
    """Motions that a search, or raising the load, leads to."""
    asked = []

    def ends(joint, targets):
        for target in targets:
            asked.append(target.point)
            found = steady(target.point, name)
            yield replace(found, doubt=found.doubt + doubt, varies=doubt)

    return ends, asked


def with_smaller(search, monkeypatch, raised, sought=None):
    monkeypatch.setattr(smaller, "raised_and_marched", raised)
    monkeypatch.setattr(smaller, "sought", sought or raised)
    monkeypatch.setattr(Search, "seek_on", lambda search, joint: None)
    guess = contours(search.surface, LOAD_OF_FOLD)
    return smaller.with_smaller(None, search, guess, WANTED, lambda count: None)


@pytest.mark.parametrize("varies", [0.05, 0.0])
def test_where_the_larger_does_not_repeat_the_smaller_is_shown(refined, monkeypatch, varies):
    search = known(refined, varies=varies)
    before = sorted(search.marks)
    instead, told = with_smaller(search, monkeypatch, of("smaller")[0])
    held = instead.held()
    inside = range(MOVES[0] - EVERY + 1, MOVES[-1] + EVERY)
    true = np.abs(branch("larger"))
    true[inside] = np.abs(branch("smaller"))[inside]
    assert (held.error[8:-8] <= WANTED).all()
    assert (np.abs(np.abs(held.amplitude) / true - 1) <= held.error).all()
    ((low, high, times),) = told
    assert [low, high] == [FOLD[inside[0]], FOLD[inside[-1]]]
    assert times == pytest.approx(5, rel=0.15) if varies else np.isnan(times)
    assert sorted(search.marks) == before
    assert not {id(instead.anchors), id(instead.found)} & {id(search.anchors), id(search.found)}
    assert not (search.held().error[MOVES] <= WANTED).any()


def test_motions_beside_those_that_vary_are_known_no_better_than_before(refined, monkeypatch):
    """Those at rest next to one that varies are no better known than that, and not without it either: the
    next may lie beyond others that have not settled."""
    search = known(refined)
    for k in (48, 52, 56, 84, 88, 92):
        search.anchors[k] = replace(search.anchors[k], change=1e-4)
    monkeypatch.setattr(smaller, "to_march_on", lambda search: [])
    for k in (44, *MOVES[::EVERY], 96):
        search.found[k] = replace(search.found[k], rest=np.zeros(1))
    before = search.doubted()
    assert before[44].doubt > WANTED
    assert before[96].doubt > WANTED
    instead, told = with_smaller(search, monkeypatch, of("smaller")[0])
    assert told
    now = instead.doubted()
    outside = [k for k in before if not told[0].low <= FOLD[k] <= told[0].high]
    assert all(now[k].doubt >= before[k].doubt for k in outside)
    assert not (instead.held().error[[44, 96]] <= WANTED).any()


@pytest.mark.parametrize(
    ("name", "doubt"), [("larger", 0.05), ("larger", 0.0), ("smaller", 0.02), (None, 0.0)]
)
def test_where_raising_leads_to_no_other_that_repeats_nothing_changes(
    refined, monkeypatch, name, doubt
):
    """To the larger itself, whether it seems to repeat or not, to one that is not known, or to none."""
    ends, asked = of(name or "smaller", doubt)
    if name is None:

        def ends(joint, targets):
            return [Lost("not solved", 10) for _ in targets]

    search = known(refined)
    instead, told = with_smaller(search, monkeypatch, ends)
    assert not told
    assert instead.anchors == search.anchors
    assert instead.anchors is not search.anchors
    assert len(asked) <= 3


def test_where_the_smaller_exists_on_a_part_alone_the_rest_stays(refined, monkeypatch):
    """As it was: the mean of the larger one, with how far it varies. Nothing else is said to be shown."""
    ends = 75

    def raised(joint, targets):
        for target in targets:
            small = target.point < ends
            # some of the larger seem to repeat
            repeats = small or target.point % 2
            yield steady(target.point, "smaller" if small else "larger", 0.0 if repeats else 0.05)

    search = known(refined)
    before = search.held()
    instead, told = with_smaller(search, monkeypatch, raised)
    now = instead.held()
    ((low, high, _),) = told
    assert low == FOLD[57]
    assert FOLD[70] <= high < FOLD[ends]
    shown, rest = (low <= FOLD) & (high >= FOLD), slice(ends + 5, MOVES[-1])
    assert (now.error[shown] <= WANTED).all()
    assert np.abs(now.amplitude[shown]) == pytest.approx(np.abs(branch("smaller"))[shown], rel=0.01)
    assert np.abs(now.amplitude[rest]) == pytest.approx(np.abs(before.amplitude[rest]), rel=0.01)
    assert np.isfinite(now.error[rest]).all()
    assert (now.error[rest] > WANTED).all()


def test_between_smaller_motions_what_is_not_known_of_them_stays_the_larger(refined, monkeypatch):
    """Three of them in the middle of the stretch are not found: the mean of the larger is shown there."""
    gap = range(66, 75)

    def raised(joint, targets):
        for target in targets:
            away = target.point in gap
            yield Lost("not solved", 10) if away else steady(target.point, "smaller")

    monkeypatch.setattr(smaller, "_seeds", lambda *ends: [60])
    search = known(refined)
    instead, told = with_smaller(search, monkeypatch, raised)
    assert len(told) == 2
    middle = [k for k in search.anchors if k in gap]
    assert middle
    sizes = np.abs(instead.held().amplitude[middle])
    assert sizes == pytest.approx(np.abs(branch("larger"))[middle], rel=1e-3)
    assert not any((one.low <= FOLD[70]) & (FOLD[70] <= one.high) for one in told)


def test_what_is_lost_between_smaller_motions_keeps_its_reason(refined, monkeypatch):
    def raised(joint, targets):
        for target in targets:
            small = target.point < 66
            yield steady(target.point, "smaller") if small else Lost("not solved", 10)

    monkeypatch.setattr(smaller, "_seeds", lambda *ends: [60])
    search = known(refined, varies=0.0)
    instead, told = with_smaller(search, monkeypatch, raised)
    assert len(told) == 1
    assert all(instead.lost[k] == search.lost[k] for k in set(instead.lost) & set(search.lost))
    assert set(instead.lost) >= {k for k in search.lost if FOLD[k] > told[0].high}


def test_smaller_motions_far_apart_are_looked_between(refined, monkeypatch):
    """However well they agree: a resonance may lie there."""
    moves, (ends, asked) = range(28, 113), of("smaller")
    instead, _ = with_smaller(known(refined, moves), monkeypatch, ends)
    assert np.diff(sorted(set(asked))).max() <= choosing.GAP * len(FOLD)
    assert choosing.unfilled(instead) == []


def leaves_with_more(refine, least=None):
    """What `Search.refine` does where motions leave with more steps what so few have made."""

    def refined(low, joint):
        if least is not None and low.steps >= least:
            return refine(low, joint)
        for k in [*low.anchors]:
            del low.anchors[k], low.found[k]
            low.lost[k] = Lost("it leaves", 0, left=True)

    return refined


def test_a_seed_that_motions_leave_with_more_steps_begins_nothing(refined, monkeypatch):
    """What would be sought beside it then begins from the refined model: the larger. Nor is the load raised
    elsewhere with so few steps: they matter there."""
    monkeypatch.setattr(Search, "refine", leaves_with_more(Search.refine))
    ends, asked = of("smaller")
    _, told = with_smaller(known(refined), monkeypatch, ends)
    assert not told
    assert asked == [70, 70]


def test_where_few_steps_lead_to_a_motion_that_is_left_more_are_taken(refined, monkeypatch):
    """They are what is shown then, and known to be of so many."""
    search = known(refined, varies=0.0)
    steps, stands_in = [], of("smaller")[0]

    def raised(joint, targets):
        steps.extend(one.steps for one in targets)
        return stands_in(joint, targets)

    few, more = search.steps, search.stepping.more
    monkeypatch.setattr(Search, "refine", leaves_with_more(Search.refine, more))
    instead, told = with_smaller(search, monkeypatch, raised)
    ((low, high, _),) = told
    assert steps == [few] + [more] * (len(steps) - 1)
    shown = {k for k in instead.anchors if low <= FOLD[k] <= high}
    assert shown
    assert {k for k in instead.anchors if instead.steps_at(k) == more} == shown
    sizes = np.abs(instead.held().amplitude)[sorted(shown)]
    assert sizes == pytest.approx(np.abs(branch("smaller"))[sorted(shown)], rel=1e-3)


def test_more_steps_are_not_taken_where_they_would_take_too_long(refined, monkeypatch):
    """As many times as long as there are more of them."""
    monkeypatch.setattr(Search, "refine", leaves_with_more(Search.refine))
    monkeypatch.setattr(smaller, "REFINEMENT", 1e12)
    ends, asked = of("smaller")
    with_smaller(known(refined), monkeypatch, ends)
    assert asked == [70]


def test_no_more_is_spent_than_a_share_of_the_search(refined, monkeypatch):
    """Where sizes scatter so that nothing between them is known, all would be asked for."""
    asked = []

    def scattered(joint, targets):
        for target in targets:
            asked.append(target.point)
            found = steady(target.point, "smaller")
            yield replace(found, amplitude=found.amplitude * (1 + 0.05 * np.cos(target.point**2)))

    monkeypatch.setattr(smaller, "SHARE", 0.06)
    with_smaller(known(refined, varies=0.0), monkeypatch, scattered)
    assert 6 <= len(asked) <= 6 + smaller.AT_A_TIME


def test_smaller_motions_are_not_shown_at_the_cost_of_more_that_is_known(refined, monkeypatch):
    """Beside the jump that they would make the larger branch is left, farther than they reach."""
    search, asked = known(refined), iter([[56]])

    def march_on(self, joint, marks):
        for k in [k for k in self.anchors if k <= 56]:
            del self.anchors[k], self.found[k]
            self.lost[k] = Lost("it leaves", 10, left=True)

    monkeypatch.setattr(Search, "march_on", march_on)
    monkeypatch.setattr(smaller, "to_march_on", lambda search: next(asked, []))
    instead, told = with_smaller(search, monkeypatch, of("smaller")[0])
    assert not told
    assert instead.anchors == search.anchors
    assert instead.lost == search.lost


def test_one_steady_motion_between_others_is_no_end_of_a_stretch(refined):
    """Of stretches that vary: the widest first, from the last steady motion to the next."""
    moves = {16, *MOVES} - {68}
    assert smaller.stretches(known(refined, moves), WANTED) == [(56, 84), (12, 20)]
    at_the_ends = {0, 4, 136, 140}
    assert smaller.stretches(known(refined, at_the_ends), WANTED) == [(-1, 8), (132, 141)]
    assert smaller.stretches(known(refined, ()), WANTED) == []


def test_larger_motions_that_turn_out_to_be_left_give_way_as_well(refined, monkeypatch):
    """Beside the jump that the smaller ones make: what motions leave there is asked for once more."""
    search, left = known(refined), []

    def march_on(self, joint, marks):
        left.extend(marks)
        self.passed.update(marks)
        for k in marks:
            del self.anchors[k], self.found[k]
            self.lost[k] = Lost("it leaves", 10, left=True)

    asked = iter([[56], [], []])
    monkeypatch.setattr(Search, "march_on", march_on)
    monkeypatch.setattr(smaller, "to_march_on", lambda search: next(asked, []))
    instead, told = with_smaller(search, monkeypatch, of("smaller")[0])
    assert left == [56]
    sizes = np.abs(instead.held().amplitude)
    assert sizes[56] == pytest.approx(np.abs(branch("smaller")[56]), rel=0.01)
    assert (instead.held().error[8:-8] <= WANTED).all()
    assert min(one.low for one in told) == FOLD[53]


def test_a_copy_of_a_search_shares_nothing_that_changes(refined):
    search = known(refined)
    search.origins = {60: {56}}
    other = search.copied()
    for name, value in vars(search).items():
        if isinstance(value, dict | set):
            assert getattr(other, name) == value
            assert getattr(other, name) is not value
    assert other.origins[60] is not search.origins[60]
    assert other.stepping is not search.stepping


def test_larger_motions_are_told_where_smaller_ones_are_shown_alone(refined):
    """By one in a hundred at least; where nothing is shown because they are left they are not."""
    _, _, base = refined
    amplitude, within = base.amplitude.copy(), np.zeros(len(FOLD), bool)
    amplitude[40:60] *= 0.2
    amplitude[60:70] = 0.0
    within[45:60] = True
    found = larger_within(base, amplitude, within)
    answered = base.flag == CONVERGED
    assert answered[45:60].any()
    assert ((found.flag == CONVERGED) == (within & answered)).all()
    assert larger_within(base, base.amplitude * 0.995, within) is None


@pytest.mark.validate
def test_smaller_motions_shown_are_those_of_the_raised_load_and_larger_ones_vary():
    """On a real joint: marched alone, with four times the steps, from rest and pushed off the larger one."""
    band = {"method": "auto", "from": "380 Hz", "to": "460 Hz", "count": 81}
    done = microslip.run(
        microslip.parse_joint({**tomllib.loads(UNSTABLE), "analysis": {"response": band}})
    )
    (curve,) = done.responses
    assert curve.larger is not None
    there = np.flatnonzero(curve.larger.flag == CONVERGED)
    assert len(there) >= 5
    for k in there[[0, len(there) // 2, -2]]:
        f = float(curve.frequency[k])
        scheme = time_scheme(done.prepared, 1 / (f * 600), frequency=f)
        state = raised_state(scheme, f, LOAD, 30)
        size = np.abs(watched(scheme, LOAD, state, 400)[0][-20:])
        assert np.ptp(size) <= 1e-4 * size.mean()
        assert abs(curve.amplitude[k]) == pytest.approx(
            size.mean(), rel=float(curve.error_indicator[k]) + 1e-3
        )
        mean = curve.larger.amplitude[k]
        found = steady_state(scheme, f, LOAD, guess=mean, tolerance=1e-5, max_cycles=300)
        own, still = found.end, prestressed_state(scheme)
        rest = replace(own, eta=still.eta, rate=0 * own.rate, r=still.r, v=still.v)
        pushed = placed(mixed(((own, 1.02), (rest, -0.02))), scheme, f, LOAD)
        beat = np.abs(watched(scheme, LOAD, pushed, 600, found.phase)[0][-300:])
        assert beat.mean() == pytest.approx(abs(mean), rel=0.02)
        assert np.abs(beat / beat.mean() - 1).max() > WANTED
    (row,) = summary(done)["response"]
    assert row["larger_does_not_repeat_from_hz"] == curve.frequency[there[0]]
    assert row["larger_does_not_repeat_to_hz"] == curve.frequency[there[-1]]
    kept = dataset(done)["response"]
    assert kept["larger_modal_amplitude"][0].notnull().sum() == len(there)
    assert (kept["larger_variation"][0][there] > 0).any()
    assert any("larger motions do not repeat" in one.reason for one in done.cautions)
    (legend,) = response_figure(done).legends
    assert "larger motion, does not repeat" in [text.get_text() for text in legend.get_texts()]


def test_what_a_response_shows_and_what_a_wider_band_begins_with(refined, monkeypatch):
    """The smaller in the curve, the larger beside it; a search over more of the band knows the larger."""

    def sought(joint, targets):
        for target in targets:
            yield steady(target.point, varies=0.05 if target.point in MOVES else 0.0)

    def more(joint, load, states):
        for k, one in states.items():
            strays = 0.05 if one.varies else 0.0
            yield k, More(one.amplitude, 10, strays, varies=strays)

    larger, small = of("larger", 0.05)[0], of("smaller")[0]
    found = held_to(sought, refined, monkeypatch, 100, larger, more, raised=small)
    curve = found.response
    inside = (curve.frequency >= found.outgrown[0].low) & (
        curve.frequency <= found.outgrown[-1].high
    )
    assert inside[MOVES].all()
    assert np.abs(curve.amplitude[inside]) == pytest.approx(
        np.abs(branch("smaller"))[inside], rel=0.01
    )
    assert (curve.error_indicator <= WANTED).all()
    shown = curve.larger.flag == CONVERGED
    assert (shown == inside).all()
    assert np.abs(curve.larger.amplitude[shown]) == pytest.approx(
        np.abs(branch("larger"))[shown], rel=0.01
    )
    assert (curve.larger.varies[MOVES[4:-4]] > 0.04).all()
    larger = [abs(one.amplitude) for k, one in found.search.anchors.items() if k in MOVES]
    assert min(larger) > 2 * np.abs(branch("smaller")).max()


def test_what_all_is_spent_before_is_not_bounded_between_smaller_motions(refined, monkeypatch):
    """However well they agree: between those farther apart than a sixteenth of the band."""
    moves = range(28, 113)

    def sought(joint, targets):
        for target in targets:
            yield steady(target.point, varies=0.05 if target.point in moves else 0.0)

    monkeypatch.setattr(smaller, "SHARE", 0.08)
    larger, small = of("larger", 0.05)[0], of("smaller")[0]
    found = held_to(sought, refined, monkeypatch, 100, larger, raised=small)
    own = np.searchsorted(FOLD, [one.frequency for one in found.response.anchors])
    pairs = [p for one in found.outgrown for p in pairwise(k for k in own if one.holds(FOLD[k]))]
    wide = [(a, b) for a, b in pairs if b - a > choosing.GAP * len(FOLD)]
    assert wide
    for a, b in wide:
        assert np.isinf(found.response.error_indicator[a + 1 : b]).all()

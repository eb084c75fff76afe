"""Steady states that are marched as they are unsure: to their end, or with more steps."""

from dataclasses import replace

import numpy as np
import pytest
from folding_response import FOLD, branch, folding

from microslip.analyses.reduced.anchors import Anchor
from microslip.analyses.reduced.surface import load_surface
from microslip.analyses.time.offset import HORIZON
from microslip.analyses.time.watching import known_mean
from microslip.pipeline import auto, choosing, more_steps, stepping
from microslip.pipeline.doubts import by_themselves, doubted
from microslip.pipeline.search import Search
from microslip.pipeline.stepping import Stepping
from microslip.pipeline.targets import Found, Lost, More, Stepped, Target

WANTED, EVERY, UNSURE = 0.01, 4, 60
RESTS = np.zeros(1)


@pytest.fixture(scope="module")
def refined():
    return folding()


def found_with(**known):
    return Found(1 + 0j, 0.0, known.pop("doubt", 1e-4), "", 10, scatter=0.0, **known)


def in_a_row(*found):
    """Steady states next to each other on a branch, by index."""
    anchors = {k: Anchor(100.0 + k, 1 + 0j, 0j, 0.0, one.doubt) for k, one in enumerate(found)}
    return anchors, dict(enumerate(found))


@pytest.mark.parametrize(
    ("change", "seen", "varies", "parts"),
    [
        (1e-8, "with more steps", 0.0, True),
        (5e-6, "to its end", 0.0, True),
        (5e-6, "for long", 0.0, True),
        (5e-6, "with more steps", 0.0, False),
        (1e-8, "with few", 0.0, False),
        (1e-8, "with more steps", 0.03, False),
        (1e-4, "to its end", 0.03, False),
    ],
)
def test_what_is_known_to_repeat_between_two_at_rest_parts_them(change, seen, varies, parts):
    """The second at rest is known to 3 %: so is the first, but for one between that repeats."""
    row = (found_with(rest=RESTS), found_with(varies=varies), found_with(rest=RESTS, doubt=0.03))
    anchors, found = in_a_row(*row)
    anchors[1] = replace(anchors[1], change=change)
    known, ended = Stepping(), {1} if seen == "to its end" else set()
    if seen != "with few":
        cycles = 600 if seen == "for long" else 0
        known.keep(1, More(1 + 0j, 10, varies, varies=varies, watched=cycles))
    alone = by_themselves(anchors, found, ended, 0.0, known)
    assert (doubted(alone, found, ended, known)[0].doubt < 0.03) == parts


@pytest.mark.parametrize("cycles", [200, 600])
@pytest.mark.parametrize("rate", [1e-7, -3e-7, 1e-6])
def test_a_drift_seen_with_more_steps_is_taken_to_go_on(cycles, rate):
    """Until bodies count an even drift comes to what is said at least, unless others have moved by less."""
    anchors, found = in_a_row(found_with(doubt=0.0))
    anchors[0] = replace(anchors[0], change=5e-6)
    mean, drifts = known_mean(1 + rate * np.arange(cycles))
    there = abs((1 + rate * HORIZON) / mean - 1)
    known = Stepping()
    known.keep(0, More(complex(mean), 10, 0.0, drifts, watched=cycles))
    said = by_themselves(anchors, found, (), 0.2, known)[0].doubt
    assert there <= said <= 1.3 * there
    assert by_themselves(anchors, found, (), 1e-6, known)[0].doubt == 1e-6
    # of what has not settled, or was not seen for long, as far as others have gone
    known.watched[0] = 0
    assert by_themselves(anchors, found, (), 0.2, known)[0].doubt == 0.2
    known.watched[0] = cycles
    anchors[0] = replace(anchors[0], change=1e-4)
    assert by_themselves(anchors, found, (), 0.2, known)[0].doubt == 0.2


def grown(times, start):
    """What is watched of sizes that beat, and grow by so many times in a cycle."""
    begun = [0]

    def watched(scheme, load, state, cycles, *rest):
        n = begun[0] + np.arange(cycles)
        begun[0] += cycles
        return 1 + start * times**n * np.cos(0.9 * n) + 0j, [None]

    return watched


@pytest.mark.parametrize(
    ("times", "start", "cycles"),
    [(1.0, 0.01, 200), (1.003, 5e-4, 0), (1.002, 1e-3, 0), (0.997, 0.01, 0), (1.0, 1e-5, 100)],
)
def test_what_grows_or_dies_away_was_not_seen(monkeypatch, times, start, cycles):
    """Only a beat that stays the same tells what a motion comes to, and what repeats."""
    monkeypatch.setattr(more_steps, "watched", grown(times, start))
    for name in ("time_scheme", "placed"):
        monkeypatch.setattr(more_steps, name, lambda *of, **known: None)
    more = more_steps.with_more_steps(None, 1.0, Stepped(100.0, 1 + 0j, None, 150, varies=True))
    assert more.watched == cycles


def test_what_was_not_seen_with_more_steps_is_no_better_known_for_it(monkeypatch):
    known = Stepping()
    known.keep(0, More(1 + 0j, 10, 0.05))
    for watched, strays in ((0, 0.05), (600, 0.003)):
        now = More(1 + 0j, 400, 0.003, 1e-4, watched=watched)
        monkeypatch.setattr(stepping, "more_steps", lambda *of, now=now: [(0, now)])
        known.march_on(None, 1.0, {0: Stepped(100.0, 1 + 0j, None, 150)})
        assert known.strays[0] == strays
    known.forget(0)
    assert not known.watched


def searched(refined, unsure):
    """A search that knows all of a branch well but one steady state, and has looked on with more steps."""
    model, table, base = refined
    search = Search(load_surface(model, table, FOLD, 40.0), base, 100)
    for k in range(0, len(FOLD), EVERY):
        Q = complex(branch("larger")[k])
        sure = Found(Q, 1e-8, 1e-5, "", 10, scatter=0.0, past=0.0, more=More(Q, 16))
        one = replace(unsure, amplitude=Q) if k == UNSURE else sure
        search.keep(Target(k, float(FOLD[k]), 40.0, 0j), one)
    search.before = 0, 0.0
    search.take_refined()
    return search


class Joint:
    """An assembly whose joint nothing asks of."""

    prepared = None


UNSETTLED = Found(0j, 1e-4, 0.05, "", 10, scatter=0.0, past=0.0)
MOVED = Found(0j, 5e-6, 1e-5, "", 10, scatter=0.0, past=0.0)
GROWS = Found(0j, 1e-8, 0.05, "", 10, scatter=0.0, past=0.0)


@pytest.mark.parametrize("unsure", [UNSETTLED, MOVED, GROWS], ids=["unsettled", "moved", "grows"])
@pytest.mark.parametrize("told", [True, False])
def test_what_a_motion_comes_to_is_marched(refined, monkeypatch, unsure, told):
    """Once, whether that tells or not; it counts for no more steady states, and takes nothing of the rest.
    What else is unsure stays."""
    if unsure is GROWS:
        Q = complex(branch("larger")[UNSURE])
        unsure = replace(unsure, more=More(Q, 16, 0.05))
    search, asked = searched(refined, unsure), []
    search.moved = 0.2 if unsure is MOVED else 0.0
    search.finer.add(UNSURE)
    doubtful = UNSURE + 3 * EVERY
    search.anchors[doubtful] = replace(search.anchors[doubtful], doubt=0.04)
    search.found[doubtful] = replace(search.found[doubtful], doubt=0.04)

    def ends(joint, targets):
        for target in targets:
            asked.append(target.point)
            Q = complex(branch("larger")[target.point])
            end = Found(Q, 0.0, 1e-4, "", 3000, scatter=0.0, past=0.0, rest=RESTS)
            yield end if told else Lost("a step does not solve", 3000)

    monkeypatch.setattr(auto, "raised_and_marched", ends)
    monkeypatch.setattr(
        stepping, "more_steps", lambda *of: ((k, More(of[2][k].amplitude, 400)) for k in of[2])
    )
    count, (cycles, seconds) = search.count, search.before
    left = search.cycles - cycles
    assert not search.held().error[UNSURE] <= WANTED
    assert auto._watch(Joint, search, WANTED) == 1
    assert (search.held().error[UNSURE] <= WANTED) == told
    assert (search.count, search.cycles - search.before[0]) == (count, left)
    assert search.before[1] - seconds == pytest.approx(search.watching) != 0.0
    assert auto._watch(Joint, search, WANTED) == 0
    assert asked == [UNSURE]
    assert doubtful in search.anchors
    assert not told or search.stepping.sought_on[UNSURE] is not None
    # it has the fewest steps then
    assert (UNSURE in search.finer) != told


@pytest.mark.parametrize("beats", [0.05, 0.002])
def test_what_does_not_settle_with_more_steps_is_marched_with_these(refined, monkeypatch, beats):
    """Else all is stated that these change those beside it by."""
    unsure = Found(0j, 1e-8, 1e-5, "", 10, scatter=0.0, past=0.0, more=More(None, 16))
    search, asked = searched(refined, unsure), []
    for k in (UNSURE - EVERY, UNSURE + EVERY):
        search.stepping.sought_on[k] *= 1.01
    search.take_refined()

    def marched(joint, load, states):
        for k, one in states.items():
            asked.append(k)
            assert one.varies
            yield k, More(one.amplitude, 2400, beats, 1e-5, beats, watched=600)

    monkeypatch.setattr(stepping, "more_steps", marched)
    count = search.count
    assert search.held().error[UNSURE] >= 0.0133
    while auto._watch(Joint, search, WANTED):
        pass
    assert asked == [UNSURE]
    assert search.count == count
    now = search.held()
    assert now.of_mean[UNSURE] <= 0.006
    assert beats <= now.error[UNSURE] <= beats + 0.006


def test_what_a_march_said_nothing_of_is_not_watched_once_more(refined, monkeypatch):
    """Nor what was marched to an end that is not its own."""
    unsure = Found(0j, 1e-8, 0.02, "", 10, scatter=0.0, past=0.0, more=More(None, 16))
    search = searched(refined, unsure)
    search.tried.add(UNSURE)
    assert choosing.to_watch(search, WANTED) == []
    search.ended.add(UNSURE)
    monkeypatch.setattr(stepping, "more_steps", lambda *of: [(k, More(None, 9)) for k in of[2]])
    assert auto._watch(Joint, search, WANTED) == 1
    assert auto._watch(Joint, search, WANTED) == 0


@pytest.mark.parametrize(
    "known",
    [
        {"more": More(1 + 0j, 16)},
        {"more": More(1 + 0j, 16, 0.01)},
        {"more": More(None, 16, 0.01)},
        {"more": More(None, 16), "change": 1e-4},
    ],
)
def test_what_is_unstable_or_settles_with_more_is_not_watched(refined, known):
    """Marched from where it is the former grows from nothing, and the latter does the same again."""
    search = searched(
        refined, Found(0j, 1e-8, 0.02, "", 10, scatter=0.0, past=0.0, more=known["more"])
    )
    search.anchors[UNSURE] = replace(search.anchors[UNSURE], change=known.get("change", 1e-8))
    assert UNSURE in choosing.vague(search, search.held(), WANTED)
    assert choosing.to_watch(search, WANTED) == []


def test_marching_what_is_unsure_has_its_own_time(refined):
    search = searched(refined, UNSETTLED)
    search.watching = auto.WATCHES * search.may_take
    assert [one.point for one in choosing.unended(search, WANTED)] == [UNSURE]
    assert auto._watch(Joint, search, WANTED) == 0


@pytest.mark.parametrize(
    ("more", "picked"),
    [
        (More(None, 16, 0.02), [UNSURE]),
        (More(1 + 0j, 16, 0.02), []),
        (More(None, 16), []),
    ],
)
def test_what_varies_where_more_steps_do_not_settle_is_marched_to_its_end(refined, more, picked):
    """Not where they tell, nor where it is stable: that is marched with more steps as it is."""
    search = searched(refined, Found(0j, 1e-8, 0.02, "", 10, scatter=0.0, past=0.0, more=more))
    assert UNSURE in choosing.vague(search, search.held(), WANTED)
    assert [one.point for one in choosing.unended(search, WANTED)] == picked

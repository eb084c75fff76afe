"""Steady states that are marched as they are unsure: to their end, or with more steps."""

from dataclasses import replace

import numpy as np
import pytest
from folding_response import FOLD, branch, folding

from microslip.analyses.reduced.anchors import Anchor
from microslip.analyses.reduced.surface import load_surface
from microslip.analyses.time.offset import HORIZON
from microslip.analyses.time.watching import known_mean
from microslip.pipeline import auto, choosing, stepping
from microslip.pipeline.doubts import by_themselves, doubt_with, doubted
from microslip.pipeline.search import Search
from microslip.pipeline.stepping import Stepping
from microslip.pipeline.targets import Found, More, Target

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


@pytest.mark.parametrize("how", ["ended", "watched", "neither"])
def test_what_was_marched_itself_is_as_well_known_as_it_was_seen(how):
    """The next one at rest beats by 3 %: it may as well, unless it was marched itself."""
    anchors, found = in_a_row(found_with(rest=RESTS), found_with(rest=RESTS))
    known = Stepping()
    known.keep(1, More(1 + 0j, 10, 0.03, 1e-4, 0.03, over=200))
    if how == "watched":
        known.keep(0, More(1 + 0j, 10, 0.0, 1e-4, over=200))
    ended = {0} if how == "ended" else set()
    alone = by_themselves(anchors, found, ended, 0.0, known)
    now = doubted(alone, found, ended, known)
    assert (now[0].doubt > 0.03) == (how == "neither")
    assert now[1].doubt == alone[1].doubt


@pytest.mark.parametrize(("change", "tells"), [(1e-8, True), (1e-4, False)])
def test_what_has_settled_between_two_at_rest_parts_them(change, tells):
    """Not what has not, as nothing is known of that."""
    row = (found_with(rest=RESTS), found_with(), found_with(rest=RESTS, doubt=0.03))
    anchors, found = in_a_row(*row)
    anchors[1] = replace(anchors[1], change=change)
    alone = by_themselves(anchors, found, (), 0.0, Stepping())
    assert (doubted(alone, found, (), Stepping())[0].doubt < 0.03) == tells


@pytest.mark.parametrize("cycles", [200, 600])
@pytest.mark.parametrize("rate", [1e-7, -3e-7, 1e-6])
def test_a_drift_seen_with_more_steps_is_taken_to_go_on(cycles, rate):
    """What is not known of a mean that drifts evenly is what it comes to until bodies count, at least."""
    mean, drifts = known_mean(1 + rate * np.arange(cycles))
    there = 1 + rate * HORIZON
    known = Stepping()
    known.keep(0, More(complex(mean), 10, 0.0, drifts, over=cycles))
    said = doubt_with(known, 0, found_with(doubt=0.05))
    assert abs(there / mean - 1) <= said <= 1.3 * abs(there / mean - 1)
    # never worse than it was known before
    assert doubt_with(known, 0, found_with(doubt=2 * drifts)) == pytest.approx(2 * drifts)
    # of bodies that are on the way that is known from elsewhere
    assert doubt_with(known, 0, found_with(doubt=0.05, ahead=0.1)) == pytest.approx(0.05)


@pytest.mark.parametrize(("over", "doubt"), [(0, 0.2), (600, 1e-4)])
def test_what_was_watched_is_not_as_unsure_as_others_have_moved(over, doubt):
    """Not settled to the last digit; the farthest that others have gone is a fifth."""
    anchors, found = in_a_row(found_with())
    anchors[0] = replace(anchors[0], change=5e-6)
    known = Stepping()
    known.keep(0, More(1 + 0j, 10, 0.0, 1e-6, over=over))
    assert by_themselves(anchors, found, (), 0.2, known)[0].doubt == doubt


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


def test_what_is_as_unsure_as_others_are_is_marched_to_its_end(refined, monkeypatch):
    """Once, whether that tells or not; it counts for no more steady states, and takes nothing of the rest."""
    search = searched(refined, Found(0j, 5e-6, 1e-5, "", 10, scatter=0.0, past=0.0))
    search.moved, asked = 0.2, []

    def ends(joint, targets):
        for target in targets:
            asked.append(target.point)
            Q = complex(branch("larger")[target.point])
            yield Found(Q, 0.0, 1e-4, "", 3000, scatter=0.0, past=0.0, rest=RESTS)

    monkeypatch.setattr(auto, "raised_and_marched", ends)
    monkeypatch.setattr(
        stepping, "more_steps", lambda *of: ((k, More(of[2][k].amplitude, 400)) for k in of[2])
    )
    count, left = search.count, search.cycles - search.before[0]
    assert not search.held().error[UNSURE] <= WANTED
    assert auto._watch(Joint, search, WANTED) == 1
    assert asked == [UNSURE]
    assert search.held().error[UNSURE] <= WANTED
    assert (search.count, search.cycles - search.before[0]) == (count, left)
    assert auto._watch(Joint, search, WANTED) == 0


@pytest.mark.parametrize("beside", [0.05, 0.002])
@pytest.mark.parametrize("own", [None, 0.04])
def test_what_is_unsure_itself_is_marched_with_more_steps(refined, monkeypatch, beside, own):
    """It does not settle with more, or what grows beside it is stated as five hundredths."""
    Q = None if own is None else complex(branch("larger")[UNSURE])
    before = More(Q, 16, own or 0.0)
    search = searched(refined, Found(0j, 1e-6, 0.05, "", 10, scatter=0.0, past=0.0, more=before))
    asked = []

    def marched(joint, load, states):
        for k, one in states.items():
            asked.append(k)
            assert one.varies
            yield k, More(one.amplitude, 2400, beside, 1e-5, beside, over=600)

    monkeypatch.setattr(stepping, "more_steps", marched)
    count, before_it = search.count, search.held().error[UNSURE]
    assert before_it >= 0.04
    while auto._watch(Joint, search, WANTED):
        pass
    assert asked == [UNSURE]
    assert search.count == count
    # the drift over 600 cycles, for as long as walks count, and what it varies by
    now = search.held().error[UNSURE]
    assert beside <= now <= beside + 1e-5 * 3 * HORIZON / 600 + 2e-3
    assert (now <= WANTED) == (beside < WANTED)


def test_what_more_steps_have_told_is_not_marched_again(refined):
    """Known to be off by what the steps do alone, or as others are: nothing more is to be seen."""
    search = searched(refined, Found(0j, 1e-8, 1e-5, "", 10, scatter=0.0, past=0.0))
    search.stepping.keep(UNSURE, More(complex(branch("larger")[UNSURE]), 16))
    search.take_refined()
    search.accuracy = np.where(np.arange(len(FOLD)) == UNSURE, 0.02, search.accuracy)
    assert choosing.vague(search, search.held(), WANTED) == {UNSURE}
    assert choosing.to_watch(search, WANTED) == []
    search.stepping.sought_on[UNSURE] = None
    assert choosing.to_watch(search, WANTED) == [UNSURE]


def test_marching_what_is_unsure_has_its_own_time(refined, monkeypatch):
    search = searched(refined, Found(0j, 1e-6, 0.05, "", 10, scatter=0.0, past=0.0))
    search.watching = auto.WATCHES * search.may_take
    assert choosing.to_watch(search, WANTED) == [UNSURE]
    assert auto._watch(Joint, search, WANTED) == 0

"""Method "auto" of the forced response: what it states against time integration elsewhere."""

from dataclasses import astuple, replace
from itertools import pairwise

import numpy as np
import pytest
from coupled_joint import coupled_document
from folding_response import BEGINS, ENDS, FOLD, branch, ends_nowhere, folding, held_to

import microslip
from microslip.analyses.reduced.anchors import Anchor
from microslip.analyses.reduced.missed import NEAREST
from microslip.analyses.reduced.response import forced_response
from microslip.analyses.reduced.surface import contours, load_surface
from microslip.analyses.reduced.sweep import CONVERGED
from microslip.analyses.time.point import Request
from microslip.analyses.time.points import steady_states
from microslip.errors import InputError
from microslip.pipeline import auto as method
from microslip.pipeline import choosing, stepping
from microslip.pipeline.forget import known_better_without, left_on_the_way
from microslip.pipeline.neighbours import leaving
from microslip.pipeline.search import LEAVES_IT, Search
from microslip.pipeline.stepping import ACCURACY, FARTHEST, More
from microslip.pipeline.targets import STEPS, Found, Lost, Target
from microslip.pipeline.walk import sought

FILE = coupled_document(41, load={"moment": ["90 N*m/m"]})


def described(**response):
    return microslip.parse_joint({**FILE, "analysis": {"response": response}})


@pytest.fixture(scope="module", params=[30, pytest.param(60, marks=pytest.mark.validate)])
def auto(request):
    response = {"response": {"method": "auto", "points": 60}}
    load = {"moment": [f"{request.param} N*m/m"]}
    document = coupled_document(31, load=load, analysis=response)
    return microslip.run(microslip.parse_joint(document))


def test_one_curve_that_passes_through_its_steady_states(auto):
    (curve,) = auto.responses
    assert curve.variant == "auto"
    assert 5 <= len(curve.anchors) <= 60
    assert (curve.flag == CONVERGED).mean() > 0.98
    # a curve is read at its frequencies, an anchor is one of them
    near = [int(np.argmin(np.abs(curve.frequency - one.frequency))) for one in curve.anchors]
    size, found = np.abs(curve.amplitude[near]), np.abs([one.amplitude for one in curve.anchors])
    shown = size < 2 * found  # one that fell to the lower branch of a fold is not on the curve
    assert shown.mean() > 0.7
    np.testing.assert_allclose(size[shown], found[shown], rtol=0.02)


def test_the_stated_error_holds_against_time_integration(auto):
    """At frequencies that were not sought, with twice the time steps."""
    (curve,) = auto.responses
    sought = np.array([one.frequency for one in curve.anchors])
    free = np.flatnonzero(np.abs(curve.frequency[:, None] - sought).min(axis=1) > 0.05)
    chosen = free[np.linspace(0, len(free) - 1, 12).astype(int)]
    requests = [
        Request(np.nan, float(curve.frequency[k]), curve.load, None, curve.amplitude[k], steps=300)
        for k in chosen
    ]
    missed = []
    for k, found in zip(chosen, steady_states(auto.prepared, requests), strict=True):
        assert found.steady.converged
        right = abs(curve.amplitude[k])
        error = abs(right / abs(found.steady.amplitude) - 1)
        missed.append(error / curve.error_indicator[k])
        assert curve.flag[k] == CONVERGED
    assert np.mean(np.array(missed) <= 1) >= 0.9


def test_results_and_figures_carry_the_steady_states(auto, tmp_path):
    microslip.write_results(auto, tmp_path / "out")
    (curve,) = auto.responses
    with microslip.load_results(tmp_path / "out") as found:
        assert found.data["anchors"].sizes["anchor"] == len(curve.anchors)
    assert (tmp_path / "out" / "figures" / "response.png").exists()
    again = microslip.load_run(tmp_path / "out")
    for read, one in zip(again.responses[0].anchors, curve.anchors, strict=True):
        np.testing.assert_equal(astuple(read), astuple(one))  # nan where a scatter was not measured


def test_auto_needs_the_refined_model():
    with pytest.raises(InputError, match=r"analysis\.response\.method.*add it to variants"):
        described(method="auto", variants=["consistent"])


@pytest.mark.parametrize(("key", "value"), [("error", 0), ("error", 2), ("points", 3)])
def test_what_auto_cannot_do_is_said(key, value):
    with pytest.raises(InputError, match=rf"analysis\.response\.{key}"):
        described(method="auto", **{key: value})


def small(moment, **response):
    file = {**FILE, "contact": {"friction": 0.35, "pairs": 21}, "load": {"moment": moment}}
    analysis = {"response": {"method": "auto", "points": 8, **response}}
    return microslip.run(microslip.parse_joint({**file, "analysis": analysis}))


@pytest.mark.parametrize("moment", [1e-6, 1e-3])
def test_under_a_small_load_the_joint_sticks_and_is_linear(moment):
    """Amplitude over moment is that of the stuck joint, below the table and at its beginning."""
    done = small(moment)
    (curve,) = done.responses
    assert not done.failures
    assert (curve.flag == CONVERGED).all()
    assert len(curve.anchors) <= 8
    mode = done.mode
    lag = curve.frequency[np.argmax(np.abs(curve.amplitude))]
    assert lag == pytest.approx(mode.stuck_frequency, rel=3e-3)


@pytest.mark.validate
def test_no_answer_lies_between_two_folds():
    """Every answer shown rises with the load, by little, on its branch: those between folds would fall.

    Where two motions exist raising the load may lead to either, at one load and not at the other: answers
    are compared on the larger and on the smaller branch, between the frequencies that each has.
    """
    band = {"from": 42.8, "to": 43.1, "count": 40, "points": 40}
    (low,) = small(255.0, **band).responses
    (high,) = small(260.0, **band).responses
    one, other = np.abs(low.amplitude), np.abs(high.amplitude)
    sizes = np.sort(np.log([*one[one > 0], *other[other > 0]]))
    widest = int(np.argmax(np.diff(sizes)))
    cut = np.exp(sizes[widest : widest + 2].mean())
    grown, unknown = [], []
    for branch_of in (lambda size: size > cut, lambda size: (size > 0) & (size <= cut)):
        a = np.isfinite(low.error_indicator) & branch_of(one)
        b = np.isfinite(high.error_indicator) & branch_of(other)
        if not a.any():
            continue
        f = low.frequency[a]
        b &= (high.frequency >= f.min()) & (high.frequency <= f.max())
        at = high.frequency[b]
        grown += list(other[b] / np.interp(at, f, one[a]))
        unknown += list(np.interp(at, f, low.error_indicator[a]) + high.error_indicator[b])
    grown, unknown = np.array(grown), np.array(unknown)
    print(f"{len(grown)} answers, grown by {grown.min() - 1:.3f} to {grown.max() - 1:.3f}")
    assert len(grown) >= 20
    assert ((grown > 1 - unknown) & (grown < 1.1)).mean() > 0.9


def test_what_is_known_at_ctrl_c_is_kept(monkeypatch):
    begun = []

    def interrupted(joint, targets):
        begun.append(len(targets))
        if len(begun) > 1:
            raise KeyboardInterrupt
        return sought(joint, targets)

    monkeypatch.setattr(method, "sought", interrupted)
    done = small([10.0, 20.0])
    (curve,) = done.responses
    assert done.interrupted
    assert 1 <= len(curve.anchors) <= begun[0]


@pytest.fixture(scope="module")
def refined():
    return folding()


def settled(anchors):
    return {k for k, one in anchors.items() if one.change <= 1e-5}


def test_what_has_not_settled_beside_a_jump_may_be_leaving():
    """Up to the first that has settled, on the larger side alone, and nowhere else."""
    sizes = [1.0, 1.01, 1.02, 1.03, 0.2, 0.19, 0.18]
    changes = [1e-7, 1e-3, 1e-4, 1e-3, 1e-3, 1e-7, 1e-3]

    def anchors(order):
        return {
            10 + k: Anchor(100.0 + k, complex(sizes[j]), 0j, changes[j])
            for k, j in enumerate(order)
        }

    bound = np.zeros(18)
    assert leaving(anchors(range(7)), bound, settled(anchors(range(7)))) == [11, 12, 13]
    assert leaving(anchors(range(6, -1, -1)), bound, settled(anchors(range(6, -1, -1)))) == [
        13,
        14,
        15,
    ]


def test_a_jump_may_lie_between_steady_states_that_are_no_neighbours():
    """What lies between those that may be leaving is not known either; a bound between is no jump."""
    sizes, changes = [1.0, 1.02, 1.03, 0.2], [1e-7, 1e-4, 1e-3, 1e-7]
    anchors = {
        10 + 3 * j: Anchor(100.0 + 3 * j, complex(size), 0j, change)
        for j, (size, change) in enumerate(zip(sizes, changes, strict=True))
    }
    bound = np.zeros(22)
    assert leaving(anchors, bound, settled(anchors)) == []
    bound[18] = np.inf
    assert leaving(anchors, bound, settled(anchors)) == [11, 12, 13, 14, 15, 16]


BUMP = 115
"""Where more steps change the response, by index: none of the states that are sought first."""


def test_beside_a_jump_what_has_stayed_is_known_from_the_next_on():
    """The first may linger; what has settled is known whatever lies before it."""
    sizes = [1.0, 1.01, 1.02, 1.03, 0.2, 0.19]
    anchors = {10 + k: Anchor(100.0 + k, complex(size), 0j, 1e-7) for k, size in enumerate(sizes)}
    bound = np.zeros(16)
    assert leaving(anchors, bound, set()) == list(range(14))
    assert leaving(anchors, bound, set(), {11, 12}) == [12, 13]
    assert leaving(anchors, bound, {14}, {12}) == list(range(14))
    assert leaving(anchors, bound, {12}, {11, 10}) == [13]


def beside_a_jump(refined, larger, more, every=8):
    """A search that knows smaller motions, all steady, and larger ones as given, and what these become."""
    model, table, base = refined
    search = Search(load_surface(model, table, FOLD, 40.0), base, 100)
    steady = replace(larger, change=1e-8, doubt=1e-5)
    for k in (*range(0, ENDS, 8), ENDS - 1):
        Q = complex(branch("smaller")[k])
        found = replace(steady, amplitude=Q, more=More(Q, 16))
        search.keep(Target(k, float(FOLD[k]), 40.0, 0j), found)
    for k in range(ENDS, len(FOLD), every):
        Q = complex(branch("larger")[k])
        found = replace(larger, amplitude=Q, more=more(Q))
        search.keep(Target(k, float(FOLD[k]), 40.0, 0j), found)
    search.before = 0, 0.0
    search.take_refined()
    return search


def marched_alone(monkeypatch, becomes):
    """Have motions marched with more steps become what is given, by index; which were asked for."""
    asked = []

    def marched(joint, load, states):
        for k, one in states.items():
            asked.append(k)
            assert one.varies
            yield k, becomes(k, one)

    monkeypatch.setattr(stepping, "more_steps", marched)
    return asked


def test_motions_at_rest_that_stay_with_more_steps_are_known_beside_a_jump(refined):
    """They do not settle with these, and stay three thousandths off; the first beside the jump may leave."""
    at_rest = Found(0j, 1e-8, 1e-5, "", 10, scatter=0.0, past=0.0, rest=np.zeros(1))
    search = beside_a_jump(refined, at_rest, lambda Q: More(None, 16, drifts=3e-3))
    error = search.held().error
    assert np.isinf(error[ENDS : ENDS + 8]).all()
    known = error[ENDS + 8 :: 8]
    assert (known >= 3e-3).all()
    assert (known <= 0.01).all()


@pytest.mark.parametrize("end", [0, 20, 36])
def test_beside_a_jump_motions_are_marched_on_until_two_stay(refined, monkeypatch, end):
    """None of the larger ones has settled; with more steps those within so many of the jump leave."""
    # that few steps settled once, before bodies walked on, says nothing
    unsettled = Found(0j, 1e-3, 1e-3, "", 10, scatter=0.0, past=0.0)
    search = beside_a_jump(refined, unsettled, lambda Q: More(Q, 16), every=4)

    def becomes(k, one):
        stays = k >= ENDS + end
        return More(one.amplitude, 400, 2e-3, 1e-4) if stays else More(None, 100, np.inf)

    asked = marched_alone(monkeypatch, becomes)
    assert np.isinf(search.held().error[ENDS:]).all()
    while marks := choosing.to_march_on(search):
        search.march_on(None, marks)
    error, stay = search.held().error, sorted(k for k in asked if k >= ENDS + end)
    larger = len(range(ENDS, len(FOLD), 4))
    print(f"{end}: marched {asked} of {larger}")
    assert len(asked) <= 3 + np.log2(larger)
    assert set(asked) - set(stay) == set(search.lost)
    assert {one.reason for one in search.lost.values()} == ({LEAVES_IT} if end else set())
    assert stay[:2] == [ENDS + end, ENDS + end + 4]
    assert np.isinf(error[ENDS : stay[1]]).all()
    assert (error[stay[1] :: 4] <= 0.01).all()


def test_motions_beyond_the_next_jump_are_not_marched_on(refined):
    """Of three branches none has settled, and one motion of the last is known to leave it: the largest,
    between two jumps, has its ends looked for."""
    model, table, base = refined
    search, ends = Search(load_surface(model, table, FOLD, 40.0), base, 100), (ENDS, ENDS + 24)
    for k in (*range(0, ENDS, 8), ENDS - 1, *range(ENDS, ENDS + 25, 4), *range(ENDS + 25, 141, 4)):
        Q = complex(branch("larger")[max(k, ENDS)]) * (1.0 if ends[0] <= k <= ends[1] else 0.5)
        found = Found(Q, 1e-3, 1e-3, "", 10, scatter=0.0, past=0.0)
        search.keep(Target(k, float(FOLD[k]), 40.0, 0j), found)
    search.lost[ENDS + 31] = Lost("it leaves", 10, left=True)
    search.before = 0, 0.0
    assert set(choosing.to_march_on(search)) == set(ends)


@pytest.mark.parametrize("stay", [0, 1, 3, 99])
def test_the_last_motions_of_a_branch_are_marched_until_one_stays(refined, monkeypatch, stay):
    """All have settled with more steps; with still more the first so many leave. Not more than some are."""
    settled = Found(0j, 1e-8, 1e-5, "", 10, scatter=0.0, past=0.0)
    search = beside_a_jump(refined, settled, lambda Q: More(Q, 16), every=2)

    def becomes(k, one):
        leaves = k < ENDS + 2 * stay
        return More(None, 100, np.inf) if leaves else More(one.amplitude, 400)

    asked = marched_alone(monkeypatch, becomes)
    assert (search.held().error[search.marks] <= 0.01).all()
    while marks := choosing.ends_to_march(search, 0.01):
        search.march_on(None, marks, ends=True)
    expected = [ENDS + 2 * i for i in range(min(stay + 1, choosing.ENDS))]
    assert asked == expected
    left = [k for k in asked if k < ENDS + 2 * stay]
    assert set(search.lost) == set(left)
    assert all(one.left for one in search.lost.values())
    assert search.steps == STEPS
    search.stepping.steps *= 4
    search.firm.clear()
    assert choosing.ends_to_march(search, 0.01) == []


@pytest.mark.parametrize("points", [100, 40])
def test_a_branch_ends_where_its_last_motions_leave_with_still_more_steps(
    refined, monkeypatch, points
):
    """Few steps and more have it begin at one frequency, still more four later; also where all is spent."""
    few, marched = branch("larger").copy(), []
    few[:ENDS] = branch("smaller")[:ENDS]

    def more(joint, load, states):
        for k, one in states.items():
            ends = one.steps > STEPS
            marched.extend([k] if ends else [])
            leaves = ends and ENDS <= k < ENDS + 4
            yield k, More(None, 100, np.inf) if leaves else More(complex(few[k]), 16)

    sought, _ = smooth(few)
    found = held_to(sought, refined, monkeypatch, points, more=more, ends=True).response
    known = (found.flag == CONVERGED) & (found.error_indicator <= 0.01)
    print(f"marched {marched}, {known.sum()} known of {len(known)}")
    assert marched[:-1] == [k for k in range(ENDS, ENDS + 4) if k in marched]
    assert marched[0] == ENDS
    assert marched[-1] >= ENDS + 4
    assert not (known & (np.abs(found.amplitude) > 1e-3))[ENDS : ENDS + 4].any()
    assert known[marched[-1] :].all()


def test_a_march_that_fails_says_nothing(refined, monkeypatch):
    """What was known of the motion stays, and the next one is marched."""
    settled = Found(0j, 1e-8, 1e-5, "", 10, scatter=0.0, past=0.0)
    search = beside_a_jump(refined, settled, lambda Q: More(None, 16, 8e-3))
    before, first = search.anchors[ENDS].doubt, choosing.to_march_on(search)
    assert first == [ENDS]
    monkeypatch.setattr(stepping, "more_steps", lambda *of: ((k, More(None, 9)) for k in of[2]))
    search.march_on(None, first)
    assert search.anchors[ENDS].doubt == before >= 8e-3
    assert choosing.to_march_on(search) == [ENDS + 8]


def bumped(height):
    """Amplitudes of few steps, smooth, and of many, of which a piece is larger by so much."""
    few = branch("larger")
    return few, few * (1 + height * np.exp(-(((np.arange(len(FOLD)) - BUMP) / 6) ** 2)))


def with_more_steps(true, sought=None, beyond=np.inf):
    """What states become with more steps; those asked for after so many fail as `sought` says."""
    asked = []

    def more(joint, load, states):
        for k in states:
            asked.append(k)
            yield k, sought if len(asked) > beyond else More(complex(true[k]), 16)

    return more, asked


def smooth(few, later=None, beyond=np.inf):
    """Steady states with few steps; those asked for after so many are as `later` has them."""
    asked = []

    def sought(joint, targets):
        for target in targets:
            asked.append(target.point)
            found = Found(complex(few[target.point]), 1e-6, 1e-5, "larger", 10)
            yield later(found) if later and len(asked) > beyond else found

    return sought, asked


@pytest.fixture(scope="module")
def began(refined):
    """How many steady states such a joint takes where more steps change nothing."""
    with pytest.MonkeyPatch.context() as patch:
        sought, asked = smooth(branch("larger"))
        held_to(sought, refined, patch, 100)
    return len(asked)


def test_between_states_that_more_steps_have_moved_others_are_sought(refined, monkeypatch, began):
    """With few steps the response is a smooth one; with more a piece of it is a fiftieth larger."""
    few, true = bumped(0.02)
    sought, asked = smooth(few)
    more, sought_on = with_more_steps(true)
    found = held_to(sought, refined, monkeypatch, 100, more=more).response
    off = np.abs(np.abs(found.amplitude) / np.abs(true) - 1)
    new = np.array(asked[began:])
    print(f"{began} and {len(new)} more, off by {off.max():.1e}")
    assert 0 < len(new) < began
    # what others miss of those next to the bump, and of the next, is in the median of nine about all of these
    first = np.sort(asked[:began])
    i = np.searchsorted(first, BUMP)
    assert (new > first[i - 2 - NEAREST // 2]).all()
    assert np.median(np.abs(new - BUMP)) < 10
    assert sorted(sought_on) == sorted(asked), "each once"
    assert (found.error_indicator <= 0.01).all()
    assert (off <= found.error_indicator).all()


@pytest.mark.parametrize("height", [0.06, 0.2])
def test_where_no_more_can_become_sure_none_are_sought(refined, monkeypatch, began, height):
    """All states move by so much with however many steps: what is left of their error is too much at each,
    and they are sought anew with more alone."""
    few = branch("larger")
    sought, asked = smooth(few)
    more, _ = with_more_steps((1 + height) * few)
    found = held_to(sought, refined, monkeypatch, 100, more=more).response
    assert len(set(asked)) == began
    # those that move too far to be the same motion say nothing of the steps: the search does not begin anew
    assert max(asked.count(k) for k in asked) == (3 if height < FARTHEST else 2)
    assert (found.error_indicator > 0.01).all()


def test_where_the_first_show_that_the_steps_err_all_have_more(refined, monkeypatch):
    """Few steps put all of the response off by a twentieth, four times as many by a two-hundredth."""
    true, asked = branch("larger"), []

    def size(k, steps):
        return complex(true[k] * (1 - 0.05 * STEPS / steps if steps < 16 * STEPS else 1.0))

    def sought(joint, targets):
        for target in targets:
            asked.append((target.point, target.steps))
            yield Found(size(target.point, target.steps), 1e-6, 1e-5, "larger", 10)

    def more(joint, load, states):
        return ((k, More(size(k, 4 * one.steps), 16)) for k, one in states.items())

    found = held_to(sought, refined, monkeypatch, 100, more=more)
    first = [k for k, steps in asked if steps == STEPS]
    assert 3 <= len(first) <= 5
    assert asked[len(first) : 2 * len(first)] == [(k, 4 * STEPS) for k in first]
    assert {steps for _, steps in asked[len(first) :]} == {4 * STEPS}
    assert f"of {4 * STEPS} steps" in found.spent
    off = np.abs(np.abs(found.response.amplitude) / np.abs(true) - 1)
    assert (found.response.error_indicator <= 0.01).all()
    assert (off <= found.response.error_indicator).all()


@pytest.mark.parametrize(
    "later",
    [
        lambda found: Lost("not steady", 10),
        lambda found: replace(found, change=1e-4, doubt=0.03),
    ],
)
def test_what_does_not_settle_between_them_is_passed_over(refined, monkeypatch, began, later):
    """Nothing is known less for it."""
    few, true = bumped(0.02)
    sought, asked = smooth(few, later, began)
    more, _ = with_more_steps(true)
    found = held_to(sought, refined, monkeypatch, 100, more=more)
    off = np.abs(np.abs(found.response.amplitude) / np.abs(true) - 1)
    assert len(asked) > began
    assert max(asked.count(k) for k in asked) == 2, "once with few steps, once with more"
    assert found.lost == ()
    assert np.isfinite(found.response.error_indicator).all()
    assert len(found.response.anchors) == began
    claimed = found.response.error_indicator <= 0.01
    assert not claimed.all()
    assert (off <= found.response.error_indicator).all()


def test_what_settles_with_few_steps_alone_is_passed_over(refined, monkeypatch, began):
    few, true = bumped(0.02)
    sought, asked = smooth(few)
    more, _ = with_more_steps(true, More(None, 400), began)
    found = held_to(sought, refined, monkeypatch, 100, more=more).response
    assert len(asked) > began
    assert len(found.anchors) == began


def test_what_is_known_with_more_steps_stays_when_the_search_is_interrupted(
    refined, monkeypatch, began
):
    """New states have few steps yet, and their error is that: larger than that of those with more."""
    few, true = bumped(0.02)
    sought, _ = smooth(few)
    truly, count = with_more_steps(true)[0], []

    def more(joint, load, states):
        for found in truly(joint, load, states):
            count.append(found)
            if len(count) > began:
                raise KeyboardInterrupt
            yield found

    found = held_to(sought, refined, monkeypatch, 100, more=more).response
    off = np.abs(np.abs(found.amplitude) / np.abs(true) - 1)
    print(f"off by {off.max():.1e}, there {found.error_indicator[off.argmax()]:.1e} said")
    assert len(found.anchors) > began
    assert (off <= found.error_indicator).all()


def err_by(share):
    """A joint whose steps put all of it off by so much in `STEPS`, in proportion to their length."""
    true = branch("larger")

    def size(k, steps):
        return complex(true[k] * (1 - share * STEPS / steps))

    def sought(joint, targets):
        for target in targets:
            yield Found(size(target.point, target.steps), 1e-6, 1e-5, "larger", 10)

    def more(joint, load, states):
        return ((k, More(size(k, 4 * one.steps), 16)) for k, one in states.items())

    return true, sought, more


@pytest.mark.parametrize("after", [0, 3, 20])
def test_what_the_first_have_shown_stays_when_the_search_anew_is_interrupted(
    refined, monkeypatch, after
):
    true, seek, more = err_by(0.06)
    count = []

    def sought(joint, targets):
        for target, found in zip(targets, seek(joint, targets), strict=True):
            if target.steps > STEPS:
                count.append(target)
            if len(count) > after:
                raise KeyboardInterrupt
            yield found

    found = held_to(sought, refined, monkeypatch, 100, more=more).response
    assert len(found.anchors) >= 3
    off = np.abs(np.abs(found.amplitude) / np.abs(true) - 1)
    known = np.isfinite(found.amplitude)
    assert known.any()
    assert (off <= found.error_indicator)[known].all()


@pytest.mark.parametrize("at_once", [True, False])
def test_what_motions_leave_is_not_shown_and_how_far_they_stray_is_the_error(
    refined, monkeypatch, at_once
):
    """Periodic everywhere, unstable on a piece: beside some of these motions beat, others they leave."""
    true, leave, beat = branch("larger"), range(60, 75), range(75, 90)
    marched, asked = [], []

    def more_of(k):
        strays = np.inf if k in leave else 0.03 if k in beat else 0.0
        return More(complex(true[k]) if k not in leave else None, 16, strays)

    def sought(joint, targets):
        """At once, as a search says it, or in the end."""
        for target in targets:
            asked.append(target.point)
            more = more_of(target.point) if at_once and target.point not in leave else None
            doubt = 1e-5 if more is None else max(more.strays, 1e-5)
            yield Found(complex(true[target.point]), 1e-6, doubt, "larger", 10, more=more)

    def more(joint, load, states):
        return ((k, more_of(k)) for k in states)

    def ends(joint, targets):
        marched.extend(target.point for target in targets)
        return ends_nowhere(joint, targets)

    found = held_to(sought, refined, monkeypatch, 100, ends, more)
    own = np.searchsorted(FOLD, [one.frequency for one in found.response.anchors])
    assert set(asked) & set(leave)
    assert set(own) & set(beat)
    assert not set(own) & set(leave)
    error = found.response.error_indicator
    assert (error[[k for k in own if k in beat]] >= 0.03).all()
    assert (error[[*range(50), *range(100, len(FOLD))]] <= 0.01).all()
    assert not set(marched) & {*leave, *beat}
    assert all("unstable" in one for one in found.lost)


def test_what_settles_with_no_more_steps_errs_as_the_first_have(refined, monkeypatch):
    true, sought, few = err_by(0.06)

    def more(joint, load, states):
        for k, found in few(joint, load, states):
            yield k, found if states[k].steps == STEPS else More(None, 400)

    found = held_to(sought, refined, monkeypatch, 100, more=more).response
    off = np.abs(np.abs(found.amplitude) / np.abs(true) - 1)
    assert (off > ACCURACY).all()
    assert (off <= found.error_indicator).all()


def test_where_few_states_may_be_sought_the_search_does_not_begin_anew(refined, monkeypatch):
    true, seek, more = err_by(0.06)
    asked = []

    def sought(joint, targets):
        asked.extend(target.steps for target in targets)
        return seek(joint, targets)

    found = held_to(sought, refined, monkeypatch, 12, more=more).response
    assert len(asked) <= 12
    assert len(found.anchors) > 5
    off = np.abs(np.abs(found.amplitude) / np.abs(true) - 1)
    assert (off <= found.error_indicator).all()


def test_what_leaves_its_branch_when_marched_is_not_brought_back(refined, monkeypatch):
    """Searches find motions that linger, with however many steps."""

    def sought(joint, targets):
        for target in targets:
            Q = complex(branch("larger")[target.point])
            yield Found(Q, 1e-6 if target.steps > STEPS else 1e-4, 1e-4, "larger", 10)

    def marched(joint, targets):
        for target in targets:
            Q = complex(branch("smaller")[target.point])
            yield Found(Q, 1e-4, np.inf, "smaller", 100, own=True)

    def more(joint, load, states):
        return ((k, More(one.amplitude, 16)) for k, one in states.items())

    found = held_to(sought, refined, monkeypatch, 60, marched, more)
    gone = [k for k in range(len(FOLD)) if any(f"{FOLD[k]:.6g} Hz" in one for one in found.lost)]
    assert gone
    assert not (found.response.error_indicator[gone] <= 0.01).any()


@pytest.mark.parametrize("share", [1.0, 0.2])
def test_what_more_steps_leave_unsure_is_sought_anew_with_them(refined, monkeypatch, share):
    """In the middle of a piece no search with more steps comes from the states with few to its end; from the
    beginning one does, or ends on another branch, which is not taken."""
    few, true = bumped(0.06)
    asked = []

    def sought(joint, targets):
        for target in targets:
            asked.append((target.point, target.steps))
            anew = target.steps > STEPS
            Q = complex(share * true[target.point] if anew else few[target.point])
            yield Found(Q, 1e-6, 1e-5, "larger", 10)

    def more(joint, load, states):
        for k, one in states.items():
            lost = one.steps == STEPS and abs(k - BUMP) < 6
            yield k, More(None if lost else complex(true[k]), 16)

    found = held_to(sought, refined, monkeypatch, 140, more=more).response
    anew = [k for k, steps in asked if steps == 4 * STEPS]
    off = np.abs(np.abs(found.amplitude) / np.abs(true) - 1)
    unsure = ~(found.error_indicator <= 0.01)
    print(f"{len(anew)} anew of {len(asked)}, off by {off.max():.1e}, {unsure.mean():.1%} unsure")
    assert len(anew) == len(set(anew)) > 0
    assert (np.abs(np.array(anew) - BUMP) < 20).all()
    assert (off[~unsure] <= found.error_indicator[~unsure]).all()
    inside = np.abs(np.arange(len(FOLD)) - BUMP) < 4
    assert unsure[inside].all() if share < 1 else not unsure.any()


@pytest.mark.parametrize("mirrored", [False, True])
def test_a_branch_that_ends_sooner_with_more_steps_is_not_claimed_beyond(
    refined, monkeypatch, mirrored
):
    """From its end with few steps to that with more the larger motion settles with few alone."""
    sooner = 6

    def size(k, steps):
        at = len(FOLD) - 1 - k if mirrored else k
        larger = at >= (ENDS if steps == STEPS else ENDS + sooner)
        return complex(branch("larger" if larger else "smaller")[k])

    def sought(joint, targets):
        for target in targets:
            yield Found(size(target.point, target.steps), 1e-6, 1e-5, "larger", 10)

    def more(joint, load, states):
        for k, one in states.items():
            Q = size(k, 4 * one.steps)
            yield k, More(Q if abs(Q / one.amplitude) > 0.5 else None, 16)

    found = held_to(sought, refined, monkeypatch, 141, more=more).response
    true = np.abs([size(k, 4 * STEPS) for k in range(len(FOLD))])
    off = np.abs(np.abs(found.amplitude) / true - 1)
    sure = found.error_indicator <= 0.01
    print(f"{sure.mean():.1%} sure")
    assert (off[sure] <= found.error_indicator[sure]).all()
    assert sure.mean() > 0.9


def joint_with_a_fold(asked):
    """What steady states such a joint would have: the branch that a start lies on, while it lasts."""

    def sought(joint, targets):
        for target in targets:
            asked.append(target.point)
            k = target.point
            begun = [max(m, key=lambda one: one[1])[0] for m in target.starts] or ["smaller"]
            name = "larger" if (begun[0] == "larger" and k >= ENDS) or k > BEGINS else "smaller"
            fell = begun[0] == "larger" and name == "smaller"
            yield Found(complex(branch(name)[k]), 1e-6, 1e-5, name, 10, fell)

    return sought


@pytest.mark.parametrize(("scatter", "past"), [(1e-5, 0.03), (0.03, 0.03), (1e-5, 1e-5)])
def test_another_past_is_said_and_flags_nothing(refined, monkeypatch, scatter, past):
    """What the raised load leaves open flags a frequency; what another past makes of it is said beside it."""

    def sought(joint, targets):
        for target in targets:
            Q = complex(branch("larger")[target.point])
            yield Found(Q, 1e-6, 1e-5, "larger", 10, scatter=scatter, past=past)

    found = held_to(sought, refined, monkeypatch, 30).response
    own = [one.frequency for one in found.anchors]
    unsure, said = method.unsure(found, 0.01), method.other_pasts(found, 0.01)
    assert np.isin(own, unsure).all() == (scatter > 0.01)
    assert np.isin(own, said).all() == (past > 0.01 > scatter)
    assert not np.isin(said, unsure).any()


def creeping(joint, targets):
    """Searches that stop anywhere on the way of a motion that creeps."""
    for target in targets:
        off = 0.97 + 0.02 * np.cos(7.0 * target.point)
        Q = complex(off * branch("larger")[target.point])
        yield Found(Q, 1e-4, 0.02, "larger", 10, scatter=0.02, past=0.0)


def ending(share):
    """Motions that end at so much of the larger branch."""

    def marched(joint, targets):
        for target in targets:
            Q = complex(share * branch("larger")[target.point])
            yield Found(Q, 1e-8, 1e-4, "larger", 100, scatter=1e-5, past=0.0)

    return marched


def test_where_motions_creep_the_response_is_where_they_end(refined, monkeypatch):
    found = held_to(creeping, refined, monkeypatch, 100, ending(1.0)).response
    assert len(method.unsure(found, 0.01)) <= 0.02 * len(FOLD)
    off = np.abs(np.abs(found.amplitude) / np.abs(branch("larger")) - 1)
    sure = found.error_indicator <= 0.01
    assert (off[sure] <= found.error_indicator[sure]).all()


def walking(joint, targets):
    """Motions whose bodies come to rest a tenth above where searches stop, and on the larger branch alone."""
    for target in targets:
        Q = complex(branch("larger")[target.point])
        rest = np.array([1e-5 * target.point])
        yield Found(Q, 0.0, 1e-4, "larger", 100, scatter=1e-4, past=0.0, rest=rest, lasts=5e4)


@pytest.mark.parametrize(("share", "change"), [(0.9, 1e-5), (1.1, 1e-4), (1.2, 1e-4)])
def test_where_bodies_walk_what_has_not_settled_is_doubted_by_as_much(
    refined, monkeypatch, share, change
):
    """Searches that say that they know it to a part in a thousand, and are off by a hundred times that.

    Where they lie above what has been marched they are no larger motions.
    """

    def sought(joint, targets):
        for target in targets:
            Q = complex(share * branch("larger")[target.point])
            doubt = 0.02 if target.point % 2 else 1e-3
            yield Found(Q, change, doubt, "larger", 10, scatter=1e-5, past=0.0)

    found = held_to(sought, refined, monkeypatch, 300, walking)
    off = np.abs(np.abs(found.response.amplitude) / np.abs(branch("larger")) - 1)
    sure = found.response.error_indicator <= 0.01
    assert sure.mean() > 0.9
    assert (off[sure] <= found.response.error_indicator[sure]).all()
    assert max(long for _, long in found.walks) == 5e4


@pytest.mark.parametrize(
    "fell",
    [
        0,
        pytest.param(7, marks=pytest.mark.validate),
        20,
        pytest.param(35, marks=pytest.mark.validate),
    ],
)
def test_a_branch_that_is_left_ends_where_motions_stay(refined, monkeypatch, fell):
    """Motions linger past the end of a branch; marched from where they are they leave it there."""

    def sought(joint, targets):
        for target in targets:
            lingers = target.point >= ENDS
            Q = complex(branch("larger" if lingers else "smaller")[target.point])
            change = 1e-4 if lingers else 1e-8
            yield Found(Q, change, 1e-4, "larger", 10, scatter=1e-5, past=0.0)

    def marched(joint, targets):
        for target in targets:
            stays = target.point >= ENDS + fell
            Q = complex(branch("larger" if stays else "smaller")[target.point])
            yield Found(Q, 1e-8, 1e-4, "larger", 100, scatter=1e-5, past=0.0, own=True)

    found = held_to(sought, refined, monkeypatch, 141, marched).response
    k = np.arange(len(FOLD))
    true = np.where(k >= ENDS + fell, branch("larger"), branch("smaller"))
    sure = found.error_indicator <= 0.01
    off = np.abs(np.abs(found.amplitude) / np.abs(true) - 1)
    assert (off[sure] <= found.error_indicator[sure]).all()
    assert sure[ENDS + fell + 2 :].mean() > 0.9
    # what has been seen to leave is not brought back
    own = np.searchsorted(FOLD, [one.frequency for one in found.anchors])
    assert (off[own] < 0.1).all()


def test_between_motions_that_may_be_leaving_there_is_an_answer_without_a_bound(refined):
    """They are shown beside a jump, and so is what lies between them."""
    model, table, base = refined
    search = Search(load_surface(model, table, FOLD, 40.0), base, 100)
    leaving = [ENDS, ENDS + 3, ENDS + 6, ENDS + 9]
    for k in (*range(0, ENDS, 8), ENDS - 1, *leaving, *range(ENDS + 12, len(FOLD), 8)):
        Q = complex(branch("larger" if k >= ENDS else "smaller")[k])
        change = 1e-4 if k in leaving else 1e-8
        search.keep(
            Target(k, float(FOLD[k]), 40.0, 0j),
            Found(Q, change, 1e-4, "", 10, scatter=1e-5, past=0.0),
        )
    found, between = method._response(search), np.setdiff1d(np.arange(ENDS, ENDS + 12), leaving)
    assert np.isinf(found.error_indicator[between]).all()
    assert (found.flag[between] == CONVERGED).all()
    assert np.abs(found.amplitude[between] / branch("larger")[between] - 1).max() < 0.01


def test_what_all_is_spent_before_is_not_bounded(refined, monkeypatch):
    """A dip between two steady states is not seen by these, whatever the model says between them."""

    def sought(joint, targets):
        for target in targets:
            Q = complex(branch("larger")[target.point])
            yield Found(Q, 1e-8, 1e-5, "", 10, scatter=1e-5, past=0.0)

    few = held_to(sought, refined, monkeypatch, 5).response
    marks = np.searchsorted(FOLD, [one.frequency for one in few.anchors])
    assert np.diff(marks).max() > len(FOLD) / 16
    for left, right in pairwise(marks):
        inside = few.error_indicator[left + 1 : right]
        assert np.isinf(inside).all() == (right - left > len(FOLD) / 16) or not len(inside)
    enough = held_to(sought, refined, monkeypatch, 100).response
    assert np.isfinite(enough.error_indicator).all()


def test_what_beats_is_not_forgotten_between_what_is_known(refined):
    """Where others were marched, which drops what is not known well between steady states that are."""
    model, table, base = refined
    search = Search(load_surface(model, table, FOLD, 40.0), base, 100)
    beat = range(72, 90, 4)
    for k in (*range(0, 72, 8), *beat, *range(92, len(FOLD), 8)):
        Q, strays = complex(branch("larger")[k]), 0.03 if k in beat else 0.0
        found = Found(Q, 1e-8, max(strays, 1e-5), "", 10, scatter=1e-5, past=0.0)
        search.keep(Target(k, float(FOLD[k]), 40.0, 0j), replace(found, more=More(Q, 16, strays)))
    left_on_the_way(search, 0.01)
    assert set(beat) <= set(search.anchors)
    assert (search.held().error[list(beat)] >= 0.03).all()


@pytest.mark.parametrize(("beat", "between"), [((72,), {68, 76}), ((72, 80), {68, 84})])
def test_what_others_alone_make_unsure_is_sought_beside(refined, beat, between):
    """Bodies are at rest, and where one motion beats those next to it may: others between them tell. But not
    between two that beat."""
    model, table, base = refined
    surface = load_surface(model, table, FOLD, 40.0)
    search = Search(surface, base, 100)
    for k in range(0, len(FOLD), 8):
        Q, strays = complex(branch("larger")[k]), 0.03 if k in beat else 0.0
        more = More(Q, 16, strays)
        found = Found(Q, 1e-8, 1e-5, "", 10, scatter=1e-5, past=0.0, rest=np.zeros(1), more=more)
        search.keep(Target(k, float(FOLD[k]), 40.0, 0j), found)
    search.take_refined()
    unsure = {k for k in search.anchors if search.held().of_mean[k] > 0.01}
    assert unsure == {beat[0] - 8, *beat, beat[-1] + 8}
    assert choosing.vague(search, search.held(), 0.01) == set(beat)
    picks = choosing.between_refined(search, contours(surface, 40.0), 0.01)
    assert between == {one.point for one in picks if min(beat) - 8 <= one.point <= max(beat) + 8}


@pytest.mark.parametrize(("right", "expected"), [(88, [84, 82, 86]), (83, [81, 82]), (82, [81])])
def test_beside_what_was_passed_over_the_halves_are_sought(refined, right, expected):
    """From 80 to 88 nothing is known where the middle says no more than is known: then 82, then 86."""
    model, table, base = refined
    surface = load_surface(model, table, FOLD, 40.0)
    search = Search(surface, base, 100)
    for k in (*range(0, 81, 8), right, *range(right + 8, len(FOLD), 8)):
        Q, off = complex(branch("larger")[k]), 0.009 if k == 80 else 1e-5
        found = Found(Q, 1e-8, off, "", 10, scatter=1e-5, past=0.0, more=More(Q, 16))
        search.keep(Target(k, float(FOLD[k]), 40.0, 0j), found)
    search.take_refined()
    assert (search.held().of_mean[81:right] > 0.01).any()
    sought = []
    while len(sought) < 9 and (
        picks := choosing.between_refined(search, contours(surface, 40.0), 0.01)
    ):
        sought += [one.point for one in picks if 80 <= one.point <= right]
        search.passed |= {one.point for one in picks}
    assert sought == expected


STRAYING = {"strays": 1.5e-2}
VARYING = {"strays": 1.4e-2, "varies": 1.4e-2}
ELSEWHERE = {"amplitude": None, "drifts": 2e-2}


@pytest.mark.parametrize(
    ("off", "seen", "more", "stays"),
    [
        (5e-5, {}, {}, False),
        (3e-3, {}, {}, True),
        (5e-5, {}, VARYING, True),
        (5e-5, {}, STRAYING, True),
        (5e-5, {}, ELSEWHERE, True),
        (5e-5, {"scatter": 3e-2}, {}, True),
        (5e-5, {"past": 3e-2}, {}, True),
        (5e-5, {"rest": np.zeros(1)}, {}, True),
    ],
)
def test_a_state_is_dropped_that_others_know_better(refined, off, seen, more, stays):
    """One of a doubt of 2 % among others; not where these disagree, nor where it tells what they do not.

    That it varies, that others leave it, that more steps lead elsewhere, or other pasts, or that it rests.
    """
    model, table, base = refined
    search, own = Search(load_surface(model, table, FOLD, 40.0), base, 100), ENDS + 24
    for k in range(ENDS, len(FOLD), 4):
        Q = complex(branch("larger")[k])
        found = Found(Q, 1e-8, 1e-5, "", 10, scatter=1e-5, past=0.0, more=More(Q, 16))
        if k == own:
            Q *= 1 + off
            found = replace(found, amplitude=Q, doubt=2e-2, **seen)
            found = replace(found, more=More(**{"amplitude": Q, "cycles": 16, **more}))
        search.keep(Target(k, float(FOLD[k]), 40.0, 0j), found)
    search.take_refined()
    before = (search.held().error <= 0.01).sum()
    known_better_without(search, 0.01)
    assert (own in search.anchors) == stays
    now = search.held()
    sure = now.error <= 0.01
    assert sure.sum() == before if stays else sure.sum() > before + 3
    off = np.abs(np.abs(now.amplitude) / np.abs(branch("larger")) - 1)
    assert (off <= now.error)[sure].all()


def varied(refined, points, own, varies, doubt):
    """A search that knows the larger branch but for some motions that have not settled, and is told where
    these end: at a mean of 1 % less, and by how much they vary about it."""
    model, table, base = refined
    search = Search(load_surface(model, table, FOLD, 40.0), base, 100)
    for k in range(ENDS, len(FOLD), 8):
        change = 1e-4 if k in points else 1e-8
        found = Found(complex(branch("larger")[k]), change, 1e-3, "", 10, scatter=1e-5, past=0.0)
        search.keep(Target(k, float(FOLD[k]), 40.0, 0j), found)
    for k in points:
        Q = 0.99 * complex(branch("larger")[k])
        end = Found(Q, 0.0, doubt, "", 100, scatter=0.0, past=0.0, own=own, varies=varies)
        search.keep_end(Target(k, float(FOLD[k]), 40.0, 0j), end)
    return search


MOVING = [ENDS + 24, ENDS + 32]


@pytest.mark.parametrize("own", [True, False])
def test_the_mean_of_a_motion_that_varies_for_good_is_known(refined, own):
    """It is shown, with how far the motion varies as its error and told apart; no more is sought there."""
    search = varied(refined, MOVING, own, varies=0.08, doubt=0.082)
    found, between = method._response(search), np.arange(MOVING[0], MOVING[1] + 1)
    assert np.abs(found.amplitude[MOVING] / branch("larger")[MOVING]) == pytest.approx(0.99)
    assert (found.error_indicator[between] >= 0.08).all()
    assert found.varies[between] == pytest.approx(0.08)
    assert found.varies[: MOVING[0] - 8].max(initial=0) == 0
    assert np.isin(found.frequency[MOVING], method.varying(found, 0.01)).all()
    assert not np.isin(found.frequency[: MOVING[0] - 8], method.varying(found, 0.01)).any()
    assert not search.blurred(0.01).intersection(MOVING)
    assert [one.varies for one in found.anchors if one.frequency in FOLD[MOVING]] == [0.08, 0.08]


def test_a_mean_that_is_not_known_is_none_of_a_motion_that_varies(refined):
    """With 4 % that is left to come beside what it varies by."""
    search = varied(refined, MOVING, True, varies=0.05, doubt=0.09)
    found = method._response(search)
    assert found.error_indicator[MOVING] == pytest.approx(0.09, abs=0.005)
    assert not np.isin(found.frequency[MOVING], method.varying(found, 0.01)).any()
    assert search.blurred(0.01).issuperset(MOVING)


@pytest.mark.parametrize("own", [True, False])
def test_a_motion_that_varies_widely_is_no_steady_one(refined, own):
    """Whatever is known of its mean; and it is not marched again, nor what lies between two of them."""
    search = varied(refined, MOVING, own, varies=0.4, doubt=0.402)
    for k in MOVING:
        assert k not in search.anchors
        assert "varies from cycle to cycle, and for good, by up to 40%" in search.lost[k].reason
    between = set(range(MOVING[0], MOVING[1] + 1))
    assert search.unstable.issuperset(MOVING)
    sought = {one.point for one in choosing.to_march(search, 0.01)}
    assert not sought & between


def test_what_has_settled_stays_beside_a_motion_that_varies_after_the_load_was_raised(refined):
    model, table, base = refined
    search = Search(load_surface(model, table, FOLD, 40.0), base, 100)
    k, Q = MOVING[0], complex(branch("larger")[MOVING[0]])
    target = Target(k, float(FOLD[k]), 40.0, 0j)
    search.keep(target, Found(Q, 1e-8, 1e-4, "", 10))
    raised = Found(0.99 * Q, 0.0, 0.41, "", 100, scatter=0.0, past=0.0, varies=0.4)
    search.keep_end(target, raised)
    assert search.anchors[k].amplitude == Q
    search.keep_end(target, replace(raised, own=True))
    assert k in search.lost


def test_that_motions_leave_a_larger_one_does_not_cut_the_branch_below_it(refined):
    """Said once it is passed over; said again nothing is known there, and beside a jump at once."""
    model, table, base = refined
    search = Search(load_surface(model, table, FOLD, 40.0), base, 100)
    for k in (*range(0, ENDS, 8), *range(ENDS + 2, len(FOLD), 8)):
        Q = complex(branch("larger" if k >= ENDS else "smaller")[k])
        search.keep(Target(k, float(FOLD[k]), 40.0, 0j), Found(Q, 1e-8, 1e-4, "", 10))
    left = Lost("unstable", 10, left=True)
    for k, kept in ((12, False), (12, True), (ENDS - 1, True), (ENDS + 20, False)):
        search.keep(Target(k, float(FOLD[k]), 40.0, 0j), left)
        assert (k in search.lost) == kept


def test_a_motion_that_ends_on_another_branch_is_not_taken(refined, monkeypatch):
    found = held_to(creeping, refined, monkeypatch, 40, ending(0.2)).response
    own = [one.frequency for one in found.anchors]
    assert np.isin(own, method.unsure(found, 0.01)).all()
    size = np.abs([one.amplitude for one in found.anchors])
    true = np.abs(branch("larger"))[np.searchsorted(FOLD, own)]
    assert (size > 0.9 * true).all()


def test_between_motions_that_are_marched_others_start_from_them(refined, monkeypatch):
    """On a branch that goes up in stairs, and to which raising the load does not lead."""
    stairs = 1 + 0.03 * (np.arange(len(FOLD)) // 17)

    def size(k, name="larger"):
        return complex(stairs[k] * branch(name)[k])

    def sought(joint, targets):
        for target in targets:
            yield Found(size(target.point), 1e-4, 0.02, "larger", 10, past=0.0)

    def marched(joint, targets):
        for target in targets:
            begun = {name for start in target.starts for name, _ in start}
            name = "larger" if begun == {"larger"} else "smaller"
            Q = size(target.point, name)
            yield Found(Q, 1e-8, 1e-4, name, 100, scatter=1e-5, past=0.0, own=bool(begun))

    found = held_to(sought, refined, monkeypatch, 141, marched).response
    sure = found.error_indicator <= 0.01
    assert sure.mean() > 0.97
    true = np.abs([size(k) for k in range(len(FOLD))])
    off = np.abs(np.abs(found.amplitude) / true - 1)
    assert (off[sure] <= found.error_indicator[sure]).all()


def test_a_dip_is_followed_once_from_either_side(refined, monkeypatch):
    """One frequency that stays smaller than both beside it, from wherever it is begun."""
    asked, dip = [], 70

    def sought(joint, targets):
        for target in targets:
            asked.append(target.point)
            size = 0.8 if target.point == dip else 1.0
            Q = complex(size * branch("larger")[target.point])
            yield Found(Q, 1e-6, 1e-5, "larger", 10, scatter=1e-5, past=0.0)

    held_to(sought, refined, monkeypatch, 141)
    assert {dip - 1, dip + 1} <= set(asked)
    assert asked.count(dip) == 3


def test_a_branch_is_followed_to_its_end_whatever_the_search_from_rest_finds(refined, monkeypatch):
    asked = []
    fold = joint_with_a_fold(asked)
    found, lost, opens, spent, walks, *_ = held_to(fold, refined, monkeypatch, 141)
    k = np.arange(len(FOLD))
    true = np.where(k >= ENDS, branch("larger"), branch("smaller"))
    assert not lost
    assert not opens
    assert not walks
    assert spent.startswith(f"{len(asked)} steady states")
    assert {ENDS - 1, ENDS} <= set(asked)  # the jump lies between two steady states
    known = found.flag == CONVERGED
    assert known.mean() > 0.98
    off = np.abs(np.abs(found.amplitude) / np.abs(true) - 1)[known]
    assert (off <= found.error_indicator[known]).mean() > 0.97
    assert np.median(off) < 1e-3
    assert len(found.anchors) < len(FOLD)
    assert found.outgrown is None or not found.outgrown[ENDS:].any()


@pytest.mark.validate
def test_a_branch_that_marching_leads_to_is_followed_beside_others(refined, monkeypatch):
    """Above, searches from rest settle nowhere; motions that are marched end on the larger branch there."""
    asked = []

    def sought(joint, targets):
        for target in targets:
            k = target.point
            asked.append(k)
            larger = k >= ENDS and any(one == "larger" for m in target.starts for one, _ in m)
            if not larger and BEGINS < k < len(FOLD) - 1:
                yield Lost("not steady", 10)
                continue
            name = "larger" if larger or k > BEGINS else "smaller"
            yield Found(complex(branch(name)[k]), 1e-6, 1e-5, name, 10)

    def marched(joint, targets):
        for target in targets:
            name = "larger" if target.point > BEGINS else "smaller"
            Q = complex(branch(name)[target.point])
            yield Found(Q, 1e-8, 1e-4, name, 100, scatter=1e-5, past=0.0)

    found = held_to(sought, refined, monkeypatch, 300, marched)
    own = np.searchsorted(FOLD, [one.frequency for one in found.response.anchors])
    off = np.abs([one.amplitude for one in found.response.anchors]) / np.abs(branch("larger"))[own]
    print(f"{len(asked)} sought, {len(own)} anchors")
    np.testing.assert_allclose(off[own >= ENDS], 1.0)
    assert {ENDS - 1, ENDS} <= set(own)


def test_with_more_steps_branches_are_followed_as_well(refined, monkeypatch):
    """The search with few steps ends before it knows more than a few states; from rest every other frequency
    leads to the larger branch."""
    few, asked = 24, []

    def sought(joint, targets):
        for target in targets:
            k = target.point
            begun = [max(m, key=lambda one: one[1])[0] for m in target.starts]
            larger = k >= ENDS and ("larger" in begun[:1] or k % 2 or k > BEGINS)
            asked.append(k)
            name = "larger" if larger else "smaller"
            cost = 80 * 141 // few if len(asked) <= few else 10
            yield Found(complex(branch(name)[k]), 1e-6, 1e-5, name, cost, scatter=1e-5, past=0.0)

    def more(joint, load, states):
        return ((k, More(one.amplitude, 16)) for k, one in states.items())

    found = held_to(sought, refined, monkeypatch, 141, more=more).response
    own = np.searchsorted(FOLD, [one.frequency for one in found.anchors])
    off = np.abs([one.amplitude for one in found.anchors]) / np.abs(branch("larger"))[own]
    jumps = [
        k for i, k in enumerate(own[:-1]) if own[i + 1] == k + 1 and abs(off[i + 1] - off[i]) > 0.5
    ]
    print(f"{len(asked)} sought, {len(own)} anchors, jumps at {jumps}")
    assert len(asked) > few
    assert jumps in ([], [ENDS - 1])


@pytest.mark.parametrize(
    "cut", [slice(60, None), pytest.param(slice(30, 100), marks=pytest.mark.validate)]
)
def test_over_a_wider_band_what_is_known_is_not_sought_again(refined, monkeypatch, cut):
    """Of a band that begins on the larger branch: in a wider one that is followed to its end."""
    model, table, whole = refined
    asked = []

    def sought(joint, targets):
        for target in targets:
            k = int(np.argmin(np.abs(target.frequency - FOLD)))
            asked.append(k)
            begun = [max(m, key=lambda one: one[1])[0] for m in target.starts]
            larger = (k >= ENDS and "larger" in begun[:1]) or k > BEGINS
            name = "larger" if larger else "smaller"
            yield Found(complex(branch(name)[k]), 1e-6, 1e-5, name, 10, scatter=1e-5, past=0.0)

    def more(joint, load, states):
        return ((k, More(one.amplitude, 16)) for k, one in states.items())

    part = forced_response(model, table, FOLD[cut], whole.load)
    first = held_to(sought, (model, table, part), monkeypatch, 141, more=more)
    before, count = {one.frequency: one for one in first.response.anchors}, len(asked)
    found = held_to(sought, refined, monkeypatch, 141, more=more, known=first.search)
    after = {one.frequency: one for one in found.response.anchors}
    again = set(FOLD[asked[count:]]) & set(before)
    larger = np.where(np.arange(len(FOLD)) >= ENDS, branch("larger"), branch("smaller"))
    off = np.abs(np.abs(found.response.amplitude) / np.abs(larger) - 1)
    print(f"{count} and {len(asked) - count} more, {len(again)} of them again")
    assert set(before) <= set(after)
    assert all(abs(after[f].amplitude) >= abs(one.amplitude) for f, one in before.items())
    # what is sought again has become larger, or is beside the end of the branch
    grown = {f for f in again if abs(after[f].amplitude) > 2 * abs(before[f].amplitude)}
    assert again - grown <= {FOLD[ENDS - 1]}
    assert (found.response.error_indicator <= 0.01).all()
    assert (off <= found.response.error_indicator).all()
    assert found.spent.startswith(f"{len(asked)} steady states")


@pytest.mark.parametrize(("points", "share"), [(100, 0.25), (9, 0.25), (100, 0.0)])
def test_what_is_far_apart_is_filled_where_all_is_spent(refined, monkeypatch, points, share):
    """After the first few, on top of what a search may cost: else nothing bounds what lies between."""
    asked = []

    def steady(joint, targets):
        for target in targets:
            asked.append(target.point)
            yield Found(complex(branch("smaller")[target.point]), 1e-8, 0.0, "", 10)

    monkeypatch.setattr("microslip.pipeline.search.CYCLES_EACH", 0)
    monkeypatch.setattr(method, "FILLS", share)
    found = held_to(steady, refined, monkeypatch, points)
    widest = choosing.GAP * len(FOLD)
    far = np.diff(sorted(found.search.marks)) > widest
    assert len(asked) == len(set(asked)) <= points
    assert far.any() == (points == 9 or not share)
    unbounded = np.isinf(found.response.error_indicator)
    assert set(np.flatnonzero(unbounded)) >= set(choosing.unfilled(found.search))
    assert unbounded.any() == far.any()

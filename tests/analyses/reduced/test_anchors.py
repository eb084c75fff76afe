"""The refined model held to steady states: against its own iteration, a known flaw, and time integration."""

from dataclasses import replace

import numpy as np
import pytest

import microslip
from microslip.analyses.reduced.anchors import anchor_at, branches
from microslip.analyses.reduced.missed import correction, missed_by_others
from microslip.analyses.reduced.refined import load_offset, refined_table
from microslip.analyses.reduced.response import answers, forced_response
from microslip.analyses.reduced.surface import contours, load_surface
from microslip.analyses.reduced.through_anchors import held
from microslip.analyses.reduced.two_mode import two_mode_model
from microslip.analyses.statics.held import hold_mode
from microslip.errors import MicroslipError

FREQUENCY = np.linspace(160.0, 195.0, 71)
LOAD = 40.0


@pytest.fixture(scope="module")
def refined():
    """Joint, refined model and its table."""
    joint = microslip.prepare(microslip.reference_joint(pairs=41))
    mode = joint.principal()
    held = hold_mode(joint, 2 * np.pi * 179.0, upper=2)
    largest = 0.9 * microslip.opening_load(joint, mode.port) / mode.sliding_omega**2
    table, failures = refined_table(held, 1e-4 * largest, largest, 32, steps=120)
    assert not failures
    return joint, two_mode_model(joint, "refined", load_offset(held, 1e-4 * largest)), table


def largest_of(found, count):
    """Largest answer at every frequency."""
    out = np.zeros(count, complex)
    for k in np.argsort(found.size):
        out[found.point[k]] = found.amplitude[k]
    return out


def test_contours_of_the_surface_are_the_answers_of_the_iteration(refined):
    _, model, table = refined
    surface = load_surface(model, table, FREQUENCY)
    found = largest_of(contours(surface, LOAD), len(FREQUENCY))
    iterated = forced_response(model, table, FREQUENCY, LOAD)
    assert (iterated.flag == 0).all()
    # the surface is read between 700 amplitudes, a few per cent apart
    np.testing.assert_allclose(found, iterated.amplitude, rtol=1e-3)


def test_all_answers_of_a_fold_are_found(refined):
    _, model, table = refined
    surface = load_surface(model, table, FREQUENCY)
    for load in (10.0, LOAD, 120.0):
        found = contours(surface, load)
        for k in range(0, len(FREQUENCY), 10):
            own = np.sort(np.abs(found.amplitude[found.point == k]))
            inside = own[own < 0.99 * table.amplitude[-1]]
            every = np.sort(np.abs(answers(model, table, FREQUENCY[k], load)))
            np.testing.assert_allclose(inside, every[: len(inside)], rtol=1e-3)
            assert len(inside) >= (every < 0.98 * table.amplitude[-1]).sum()


def flaw(f):
    """What a true kappa would differ by from the table's, along a branch."""
    return 0.004 * np.cos(0.25 * f) + 0.003j * np.exp(-(((f - 178) / 6) ** 2))


@pytest.fixture(scope="module")
def flawed(refined):
    """The surface of the refined model, and the response of a joint that differs from it."""
    _, model, table = refined
    surface = load_surface(model, table, FREQUENCY)
    return surface, largest_of(contours(surface, LOAD, flaw(FREQUENCY)), len(FREQUENCY))


@pytest.mark.parametrize("count", [12, 24])
def test_a_model_with_a_known_flaw_is_put_right_within_its_bound(flawed, count):
    """The true kappa differs from the table's by a smooth function of the frequency."""
    surface, exact = flawed
    plain = largest_of(contours(surface, LOAD), len(FREQUENCY))
    chosen = np.linspace(0, len(FREQUENCY) - 1, count).astype(int)
    anchors = {int(k): anchor_at(surface, FREQUENCY[k], LOAD, exact[k]) for k in chosen}
    found = held(surface, LOAD, anchors)
    missed = np.abs(np.abs(found.amplitude) / np.abs(exact) - 1)
    before = np.abs(np.abs(plain) / np.abs(exact) - 1)
    assert before.max() > 0.03
    assert missed[chosen].max() < 1e-12  # passes through its anchors
    assert np.median(missed) < 0.1 * np.median(before)
    # one part in a thousand for reading the surface between amplitudes
    assert (missed <= found.error + 1e-3).mean() > 0.95


def test_the_bound_falls_with_more_anchors(flawed):
    surface, exact = flawed
    medians = []
    for every in (6, 3):
        anchors = {
            k: anchor_at(surface, FREQUENCY[k], LOAD, exact[k])
            for k in range(0, len(FREQUENCY), every)
        }
        error = held(surface, LOAD, anchors).error
        medians.append(np.median(error[np.isfinite(error)]))
    assert medians[1] < 0.5 * medians[0]


def bump(f):
    """A flaw that both flanks of a resonance know nothing of, on its lower side."""
    return 0.02 * np.exp(-(((f - 172.0) / 2.0) ** 4))


def test_what_the_table_misses_of_sizes_between_far_ones_is_not_known(flawed):
    """None of it at either end of a stretch over which the size doubles, and much in between."""
    surface, _ = flawed
    exact = largest_of(contours(surface, LOAD, bump(FREQUENCY)), len(FREQUENCY))
    chosen = np.flatnonzero(bump(FREQUENCY) < 1e-6)
    anchors = {int(k): anchor_at(surface, FREQUENCY[k], LOAD, exact[k]) for k in chosen}
    left, right = (
        chosen[np.diff(chosen, append=-1) > 1][0],
        chosen[np.diff(chosen, prepend=0) > 1][0],
    )
    assert np.log(abs(exact[right]) / abs(exact[left])) > 0.4
    found = held(surface, LOAD, anchors)
    between = np.arange(left + 1, right)
    off = np.abs(np.abs(found.amplitude) / np.abs(exact) - 1)[between]
    assert (off > 0.01).any()
    assert (found.error[between][off > 0.01] > 0.01).all()


def test_far_sizes_widen_the_bound_and_move_no_answer(flawed, monkeypatch):
    surface, exact = flawed
    chosen = np.linspace(0, len(FREQUENCY) - 1, 12).astype(int)
    anchors = {int(k): anchor_at(surface, FREQUENCY[k], LOAD, exact[k]) for k in chosen}
    far = held(surface, LOAD, anchors)
    monkeypatch.setattr("microslip.analyses.reduced.through_anchors.FAR", np.inf)
    near = held(surface, LOAD, anchors)
    np.testing.assert_array_equal(far.amplitude, near.amplitude)
    wider = far.error > near.error
    assert wider.any()
    step = np.abs(np.diff(np.log(np.abs(exact[chosen]))))
    stretch = np.searchsorted(chosen, np.flatnonzero(wider)) - 1
    assert (step[stretch] > 0.4).all()
    assert (far.error[wider] <= near.error[wider] + step[stretch]).all()
    assert (far.error >= near.error).all()


@pytest.mark.parametrize("shift", [0.0, -2.0])
def test_sizes_are_known_where_the_phase_scatters(flawed, shift):
    """As locked-in tractions make it on a resonance: the size is smooth, the phase known to a third of a
    radian; the second one passes half a turn."""
    surface, exact = flawed
    exact = exact * np.exp(1j * shift)
    turned = exact * np.exp(0.3j * np.random.default_rng(5).standard_normal(len(exact)))
    anchors = {
        k: replace(anchor_at(surface, FREQUENCY[k], LOAD, turned[k]), scatter=np.nan)
        for k in range(0, len(FREQUENCY), 2)
    }
    found = held(surface, LOAD, anchors)
    off = np.abs(np.abs(found.amplitude) / np.abs(exact) - 1)
    assert (off <= found.error).mean() >= 0.95
    assert np.median(found.error) < 0.01
    assert np.abs(np.angle(found.amplitude / exact)).max() < 1.2


def test_a_size_that_is_missed_by_little_by_chance_is_not_known_better(flawed):
    """Sizes beyond two anchors to either side are four per cent off, so that all others make of those two
    what they are."""
    surface, exact = flawed
    scattered = exact * np.exp(0.3j * np.random.default_rng(5).standard_normal(len(exact)))
    k, off = 30, np.zeros(len(exact))
    off[[k - 4, k + 6]] = 0.04
    anchors = {
        j: anchor_at(surface, FREQUENCY[j], LOAD, scattered[j] * (1 + off[j]))
        for j in range(0, len(FREQUENCY), 2)
    }
    assert held(surface, LOAD, anchors).error[k + 1] > 0.01


def test_above_the_table_the_steady_states_alone_tell(flawed):
    """A linear joint far above the table, of a stiffness that no table has: kappa is constant."""
    surface, _ = flawed
    load = 1e3 * LOAD
    omega = 2 * np.pi * FREQUENCY
    Z = surface.model.linear_stiffness(omega) + surface.model.omega**2 * (0.02 + 0.01j)
    exact = surface.push * load / Z - surface.model.offset[0] * load
    anchors = {
        k: anchor_at(surface, FREQUENCY[k], load, exact[k]) for k in range(0, len(FREQUENCY), 10)
    }
    assert not len(contours(surface, load).point)
    found = held(surface, load, anchors)
    np.testing.assert_allclose(found.amplitude, exact, rtol=1e-9)
    assert found.error.max() < 1e-9


def test_nothing_is_said_beside_a_motion_that_is_not_steady(flawed):
    surface, exact = flawed
    anchors = {
        k: anchor_at(surface, FREQUENCY[k], LOAD, exact[k])
        for k in range(0, len(FREQUENCY), 5)
        if k != 30
    }
    found = held(surface, LOAD, anchors, lost=[30])
    assert np.isinf(found.error[26:35]).all()
    assert np.isfinite(found.error[:26]).all()
    assert np.isfinite(found.error[35:]).all()


def test_a_jump_between_neighbours_parts_two_branches(flawed):
    surface, exact = flawed
    size = np.where(FREQUENCY < 175, 0.2, 1.0) * exact
    anchors = {k: anchor_at(surface, FREQUENCY[k], LOAD, size[k]) for k in (0, 9, 20, 29, 30, 50)}
    assert [run.tolist() for run in branches(anchors, [])] == [[0, 9, 20, 29], [30, 50]]
    assert [run.tolist() for run in branches(anchors, [15])] == [[0, 9], [20, 29], [30, 50]]


def test_nothing_is_claimed_between_steady_states_on_either_side_of_a_jump(refined):
    """A fold of the table itself: it errs nowhere, but where one of its motions ends it cannot tell."""
    _, model, table = refined
    frequency, load = np.linspace(168.0, 176.0, 161), 3 * LOAD
    surface = load_surface(model, table, frequency)
    found = contours(surface, load)
    count = np.bincount(found.point, minlength=len(frequency))
    several = np.flatnonzero(count > 1)
    assert len(several) > 10, "folded"
    order = np.argsort(found.size)
    larger, smaller = np.zeros((2, len(frequency)), complex)
    larger[found.point[order]] = found.amplitude[order]
    smaller[found.point[order[::-1]]] = found.amplitude[order[::-1]]
    # the larger motion ends, or the smaller begins, anywhere between two of those that were sought
    end = several[len(several) // 2]
    before, after = np.arange(end - 4, end - 24, -4)[::-1], np.arange(end + 4, end + 24, 4)
    assert before[0] >= 0
    for left, right in ((smaller, larger), (larger, smaller)):
        sizes = {**{k: left[k] for k in before}, **{k: right[k] for k in after}}
        anchors = {int(k): anchor_at(surface, frequency[k], load, Q) for k, Q in sizes.items()}
        error = held(surface, load, anchors).error
        assert np.isinf(error[before[-1] + 1 : after[0]]).all()
        assert np.isfinite(error[[*before, *after]]).all()


def test_the_doubt_of_an_anchor_is_part_of_the_error(flawed):
    surface, exact = flawed
    anchors = {
        k: anchor_at(surface, FREQUENCY[k], LOAD, exact[k], doubt=0.02 if k == 40 else 0.0)
        for k in range(0, len(FREQUENCY), 5)
    }
    error = held(surface, LOAD, anchors, accuracy=1e-3).error
    sure = held(surface, LOAD, {k: replace(one, doubt=0.0) for k, one in anchors.items()}).error
    np.testing.assert_allclose((error - sure)[36:45], 0.021, rtol=1e-9)
    np.testing.assert_allclose((error - sure)[10:30], 0.001, rtol=1e-9)


def test_no_bound_is_below_what_the_amplitudes_scatter_by(flawed):
    """Around an anchor that depends on how the load was raised, up to the second to either side."""
    surface, exact = flawed
    anchors = {
        k: anchor_at(surface, FREQUENCY[k], LOAD, exact[k]) for k in range(0, len(FREQUENCY), 5)
    }
    unsure = {**anchors, 35: replace(anchors[35], scatter=0.03, past=0.3)}
    before, after = (held(surface, LOAD, known).error for known in (anchors, unsure))
    assert (after[31:40] >= 0.03).all()
    np.testing.assert_array_equal(after[:20], before[:20])
    np.testing.assert_array_equal(after[51:], before[51:])
    # one draw of nine may be by chance, two are not: then no anchor about them is sure of its own
    both = {**unsure, 45: replace(anchors[45], scatter=0.02)}
    own = held(surface, LOAD, both).error[[25, 30, 40, 50]]
    assert (own >= 0.02).all()
    np.testing.assert_allclose(after[[25, 30, 40, 50]], 0.0, atol=1e-12)


def test_no_anchor_is_worse_known_than_what_is_laid_through_it(flawed):
    """Two of nine scatter by two per cent; what lies far from them is known well, and so are its ends."""
    surface, exact = flawed
    anchors = {
        k: anchor_at(surface, FREQUENCY[k], LOAD, exact[k]) for k in range(0, len(FREQUENCY), 5)
    }
    both = {k: replace(one, scatter=0.02 * (k in (35, 40))) for k, one in anchors.items()}
    error = held(surface, LOAD, both).error
    for k in (5, 10, 15, 20):
        assert error[k] <= error[[*range(k - 4, k), *range(k + 1, k + 5)]].max()
    assert error[:20].max() < 0.01
    assert error[[25, 30, 35, 40, 45]].min() >= 0.02


@pytest.mark.parametrize("seed", [7, 8, 9])
def test_steady_states_that_scatter_are_not_known_better_than_they_do(flawed, seed):
    """Every past another amplitude, by half a per cent; two of each are known, and a third is the truth."""
    surface, exact = flawed
    random = np.random.default_rng(seed)
    one, other, third = 1 + 5e-3 * random.standard_normal((3, len(FREQUENCY)))
    anchors = {}
    for k in range(0, len(FREQUENCY), 2):
        anchor = anchor_at(surface, FREQUENCY[k], LOAD, one[k] * exact[k])
        anchors[k] = replace(anchor, scatter=abs(other[k] / one[k] - 1))
    found = held(surface, LOAD, anchors)
    off = np.abs(np.abs(found.amplitude) / np.abs(third * exact) - 1)
    own = list(anchors)
    assert (off <= found.error).mean() >= 0.9
    assert (off[own] <= found.error[own]).mean() >= 0.85


def test_a_staircase_is_known_at_its_steady_states(flawed):
    """An amplitude that steps by two per cent, whatever the past: others miss it, and yet it is known."""
    surface, exact = flawed
    stairs = 1 + 0.02 * (np.arange(len(FREQUENCY)) % 5 < 2)
    anchors = {
        k: anchor_at(surface, FREQUENCY[k], LOAD, stairs[k] * exact[k])
        for k in range(0, len(FREQUENCY), 2)
    }
    found = held(surface, LOAD, anchors, accuracy=1e-3)
    own = list(anchors)
    np.testing.assert_allclose(found.error[own], 1e-3, rtol=1e-9)
    between = np.setdiff1d(np.arange(own[-1]), own)
    off = np.abs(np.abs(found.amplitude) / np.abs(stairs * exact) - 1)
    assert (off <= found.error)[between].mean() >= 0.9
    assert np.median(found.error[between]) > 5e-3


def test_a_steady_state_of_unknown_scatter_is_doubted_by_what_others_miss_of_it(flawed):
    """The same stairs, where nobody looked whether the amplitude hangs on the past."""
    surface, exact = flawed
    stairs = 1 + 0.02 * (np.arange(len(FREQUENCY)) % 5 < 2)
    anchors = {}
    for k in range(0, len(FREQUENCY), 2):
        anchor = anchor_at(surface, FREQUENCY[k], LOAD, stairs[k] * exact[k])
        anchors[k] = replace(anchor, scatter=np.nan)
    error = held(surface, LOAD, anchors, accuracy=1e-3).error[list(anchors)]
    assert np.isfinite(error).all()
    assert np.median(error) > 5e-3
    few = {k: anchors[k] for k in list(anchors)[:3]}
    assert np.isinf(held(surface, LOAD, few).error).all()


def test_one_motion_that_stopped_on_its_way_is_doubted_by_what_all_others_miss_of_it(flawed):
    """Two per cent too small among many that are right: what is usual about it would not tell."""
    surface, exact = flawed
    off, k = 0.98, 30
    anchors = {
        j: replace(anchor_at(surface, FREQUENCY[j], LOAD, exact[j]), scatter=np.nan)
        for j in range(len(FREQUENCY))
    }
    short = anchor_at(surface, FREQUENCY[k], LOAD, off * exact[k], change=1e-4)
    errors = [
        held(surface, LOAD, anchors | {k: replace(short, scatter=np.nan, change=change)}).error[k]
        for change in (1e-4, 1e-7)
    ]
    assert errors[0] > 0.9 * (1 / off - 1)
    assert errors[1] < 2e-3, "settled, it is a motion of its own"


def test_one_that_scatters_says_no_more_beside_others_of_which_it_is_not_known(flawed):
    """One in nine may by chance, whether the others between were looked at or not."""
    surface, exact = flawed
    every = range(0, len(FREQUENCY), 2)
    known = {k: anchor_at(surface, FREQUENCY[k], LOAD, exact[k]) for k in every}
    known = {k: replace(one, scatter=0.02 if k == 32 else 1e-4) for k, one in known.items()}
    error = held(surface, LOAD, known).error
    half = {k: replace(one, scatter=np.nan if k % 4 else one.scatter) for k, one in known.items()}
    fewer = held(surface, LOAD, half).error
    for found in (error, fewer):
        assert found[32] == 0.02
        assert found[[20, 24, 28, 36, 40]].max() < 1e-3


def test_what_is_rough_far_away_does_not_widen_the_bound_here(flawed):
    """Ripples of the correction above 185 Hz: nothing is added below 172 Hz that was not before."""
    surface, _ = flawed
    ripples = 3e-3 * np.where(FREQUENCY > 185, np.cos(2.5 * FREQUENCY), 0.0)
    errors = []
    for shift in (flaw(FREQUENCY), flaw(FREQUENCY) + ripples):
        exact = largest_of(contours(surface, LOAD, shift), len(FREQUENCY))
        anchors = {
            k: anchor_at(surface, FREQUENCY[k], LOAD, exact[k]) for k in range(0, len(FREQUENCY), 2)
        }
        errors.append(held(surface, LOAD, anchors).error)
    calm, rough = errors
    np.testing.assert_allclose(rough[:24], calm[:24], rtol=1e-6)
    assert np.median(rough[53::2]) > 2 * np.median(calm[53::2])


def test_one_anchor_corrects_by_a_constant():
    x, y = np.array([170.0]), np.array([0.1 - 0.2j])
    assert correction(x, y, np.array([160.0, 170.0])).tolist() == [0.1 - 0.2j] * 2


def test_anchors_on_a_straight_line_miss_nothing():
    x = np.array([-2.0, -1.0, 0.5, 1.0, 3.0])
    np.testing.assert_allclose(missed_by_others(x, 0.1 * x - 0.2j * x), 0.0, atol=1e-15)


def test_anchors_close_beyond_a_stretch_say_nothing_of_it(flawed):
    """A step between two anchors: a crowd beside either that agrees makes its bound no smaller."""
    surface, _ = flawed
    step = 0.002 * np.clip((FREQUENCY - 173.5) / 1.5, 0, 1)
    exact = largest_of(contours(surface, LOAD, step), len(FREQUENCY))

    def error(*marks):
        anchors = {k: anchor_at(surface, FREQUENCY[k], LOAD, exact[k]) for k in marks}
        return held(surface, LOAD, anchors).error[21:30]

    few = error(0, 5, 10, 20, 30, 40, 50, 60, 70)
    crowded = error(0, 5, 10, 18, 19, 20, 30, 31, 32, 40, 50, 60, 70)
    assert few.max() > 5e-3
    assert (crowded > 0.7 * few).all()


def test_few_anchors_bound_nothing_between_them(flawed):
    surface, exact = flawed
    assert np.isinf(held(surface, LOAD, {}).error).all()
    anchors = {k: anchor_at(surface, FREQUENCY[k], LOAD, exact[k]) for k in (10, 30, 50)}
    error = held(surface, LOAD, anchors).error
    assert np.flatnonzero(np.isfinite(error)).tolist() == [10, 30, 50]


def test_a_joint_at_rest_is_no_anchor(refined):
    _, model, table = refined
    surface = load_surface(model, table, FREQUENCY)
    offset = model.offset[0] * LOAD
    with pytest.raises(MicroslipError, match="does not move"):
        anchor_at(surface, 170.0, LOAD, -offset)

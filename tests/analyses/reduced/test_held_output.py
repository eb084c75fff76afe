"""Outputs through steady states, where what they are is known in closed form."""

import numpy as np
import pytest

from microslip.analyses.reduced.held_output import SMALL, held_output

F = np.linspace(1.0, 2.0, 201)
ALL = [np.arange(len(F))]
ONES = np.ones(len(F), complex)


def marked(true, count):
    """A curve at so many evenly spaced frequencies, both ends among them."""
    marks = np.linspace(0, len(F) - 1, count).round().astype(int)
    return {int(k): complex(true[k]) for k in marks}


def through(true, marks, models=(ONES, ONES), amplitude=ONES, runs=ALL):
    return held_output(F, amplitude, models, marks, runs)


def test_it_is_the_truth_at_steady_states_whatever_models_say():
    true = np.exp(2j * F) * (1 + 0.3 * F**2)
    amplitude = 5 / (1.5 - F + 0.1j)
    marks = marked(true, 7)
    found = through(true, marks, (3j * F, -F + 0j), amplitude)
    at = list(marks)
    assert found.value[at] == pytest.approx(true[at] * amplitude[at], rel=1e-12)


def test_between_them_it_converges_with_the_second_order_at_least_and_its_bound_with_the_first():
    """Monotone cubics do so where a curve does not turn; a share of its change stays unsure."""
    true = np.exp(F) + 1j * F**3
    off, said = [], []
    for count in (6, 11, 21, 41):
        found = through(true, marked(true, count))
        off.append(np.abs(np.abs(found.value / true) - 1).max())
        said.append(found.error.max())
    assert (np.log2(np.array(off[:-1]) / off[1:]) > 2).all()
    assert (np.log2(np.array(said[:-1]) / said[1:]) > 1).all()


def test_smooth_curves_are_within_the_bound():
    """Of 200 sums of a few waves at random, at steady states at random."""
    rng, kept = np.random.default_rng(7), []
    for _ in range(200):
        waves = rng.normal(size=(3, 2)) @ [1, 1j]
        rate = rng.uniform(1, 8, 3)
        true = 2 + waves @ np.exp(1j * np.outer(rate, F))
        inner = rng.choice(np.arange(1, len(F) - 1), 12, replace=False)
        marks = {int(k): complex(true[k]) for k in sorted({0, len(F) - 1, *inner})}
        found = through(true, marks)
        least = np.maximum(np.abs(true), SMALL * np.abs(true).max())
        off = np.abs(np.abs(found.value) - np.abs(true)) / least
        kept += list(off <= found.error + 1e-12)
    assert np.mean(kept) > 0.97


def test_a_resonance_that_one_model_has_is_followed():
    resonance = 0.01 / (1.52 - F + 0.004j)
    true = 1 + 0.2 * F + resonance
    found = through(true, marked(true, 9), (ONES, ONES + resonance))
    assert np.abs(found.value - true).max() < 1e-12


def test_a_resonance_between_two_steady_states_that_only_one_model_has_is_in_the_bound():
    """Neither is known to be right there, and what the others miss does not tell."""
    resonance = 1e-3 / (1.503 - F + 0.002j)
    marks = marked(ONES, 9)
    found = through(ONES, marks, (ONES, ONES + resonance))
    off = np.abs(np.abs(found.value) - 1)
    assert found.error.max() > 0.05
    assert (off <= found.error + 1e-9).all()


def test_nothing_is_said_beyond_steady_states_nor_of_too_few_nor_of_other_branches():
    true = 1 + 0.1 * F + 0j
    inner = {k: one for k, one in marked(true, 11).items() if 0 < k < 200}
    found = through(true, inner)
    outside = (np.arange(len(F)) < min(inner)) | (np.arange(len(F)) > max(inner))
    assert np.isinf(found.error[outside]).all()
    assert np.isfinite(found.error[~outside]).all()
    assert np.isinf(through(true, marked(true, 3)).error).all()
    half = through(true, marked(true, 21), runs=[np.arange(0, 101)])
    assert np.isinf(half.error[101:]).all()
    assert np.isfinite(half.error[:101]).all()


def test_where_there_is_no_answer_the_model_stays_and_is_not_bounded():
    amplitude = np.where(np.arange(len(F)) < 50, 0, 1 + 0j)
    true = 1 + 0.1 * F + 0j
    marks = {k: one for k, one in marked(true, 21).items() if k >= 50}
    found = through(true, marks, (7 * ONES, ONES), amplitude)
    assert (found.value[:50] == 7).all()
    assert np.isinf(found.error[:50]).all()


def test_where_an_output_vanishes_its_error_is_over_a_share_of_the_largest():
    true = F - 1.5 + 0.05 * np.sin(9 * F) + 0j
    found = through(true, marked(true, 14))
    off = np.abs(np.abs(found.value) - np.abs(true))
    near = np.abs(true) < SMALL * np.abs(true).max() / 2
    assert near.any()
    assert np.isfinite(found.error[near]).all()
    assert (off <= found.error * np.maximum(np.abs(true), SMALL * np.abs(true).max()) + 1e-12).all()


def test_what_is_not_finite_is_not_bounded_and_makes_nothing_else_sure():
    true = 1 + 0.1 * np.sin(9 * F) + 0j
    plain = through(true, marked(true, 12))
    for wrong in (np.inf, np.nan, 1e9):
        model = ONES.copy()
        model[77] = wrong
        for models in ((model, ONES), (ONES, model)):
            found = through(true, marked(true, 12), models)
            others = np.arange(len(F)) != 77
            assert found.error[others] == pytest.approx(plain.error[others])
            assert not np.isnan(found.error).any()
        if not np.isfinite(wrong):
            assert np.isinf(through(true, marked(true, 12), (model, model)).error[77])


def test_what_is_nothing_but_rounding_is_known():
    noise = 1e-20 * np.random.default_rng(3).normal(size=(len(F), 2)) @ [1, 1j]
    marks = marked(noise, 21)
    assert held_output(F, ONES, (0 * ONES, 0 * ONES), marks, ALL, 1e-15).error.max() < 1e-3
    assert held_output(F, ONES, (0 * ONES, 0 * ONES), marks, ALL).error.max() > 1


def test_of_two_branches_neither_tells_of_the_other():
    left = np.arange(len(F)) < 100
    true = np.where(left, 1 + 0.1 * F, 3 - F**2) + 0j
    marks = marked(true, 21)
    runs = [np.arange(0, 96), np.arange(105, 201)]
    found = through(true, marks, runs=runs)
    alone = through(true, {k: y for k, y in marks.items() if k < 96}, runs=runs[:1])
    assert found.error[:96] == pytest.approx(alone.error[:96])
    assert np.isinf(found.error[96:105]).all()

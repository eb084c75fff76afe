"""The refined model held to steady states: against its own iteration, a known flaw, and time integration."""

import numpy as np
import pytest

import microslip
from microslip.analyses.reduced.anchors import (
    Anchor,
    anchor_at,
    corrected_answers,
    correction,
    missed_by_others,
)
from microslip.analyses.reduced.refined import load_offset, refined_table
from microslip.analyses.reduced.response import answers, forced_response
from microslip.analyses.reduced.surface import load_surface
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
    found = largest_of(corrected_answers(surface, LOAD, []), len(FREQUENCY))
    iterated = forced_response(model, table, FREQUENCY, LOAD)
    assert (iterated.flag == 0).all()
    # the surface is read between 700 amplitudes, a few per cent apart
    np.testing.assert_allclose(found, iterated.amplitude, rtol=1e-3)


def test_all_answers_of_a_fold_are_found(refined):
    _, model, table = refined
    surface = load_surface(model, table, FREQUENCY)
    for load in (10.0, LOAD, 120.0):
        found = corrected_answers(surface, load, [])
        for k in range(0, len(FREQUENCY), 10):
            own = np.sort(np.abs(found.amplitude[found.point == k]))
            inside = own[own < 0.99 * table.amplitude[-1]]
            every = np.sort(np.abs(answers(model, table, FREQUENCY[k], load)))
            np.testing.assert_allclose(inside, every[: len(inside)], rtol=1e-3)
            assert len(inside) >= (every < 0.98 * table.amplitude[-1]).sum()


def test_a_model_with_a_known_flaw_is_put_right_within_its_bound(refined):
    """The true kappa differs from the table's by a smooth function of the place."""
    _, model, table = refined
    surface = load_surface(model, table, FREQUENCY)

    def flaw(u):
        return 0.004 * np.cos(0.8 * u) + 0.003j * np.exp(-0.3 * u**2)

    truth = [Anchor(0.0, 0.0, u, complex(flaw(u)), 0.0) for u in np.linspace(-12, 12, 150)]
    exact = largest_of(corrected_answers(surface, LOAD, truth), len(FREQUENCY))
    plain = largest_of(corrected_answers(surface, LOAD, []), len(FREQUENCY))
    u = np.array(
        [anchor_at(surface, f, LOAD, q).place for f, q in zip(FREQUENCY, exact, strict=True)]
    )
    chosen = {int(np.argmin(np.abs(u - t))) for t in np.linspace(u.min(), u.max(), 12)}
    anchors = [anchor_at(surface, FREQUENCY[k], LOAD, exact[k]) for k in chosen]
    found = corrected_answers(surface, LOAD, anchors)
    right, error = largest_of(found, len(FREQUENCY)), np.zeros(len(FREQUENCY))
    for k in np.argsort(found.size):
        error[found.point[k]] = found.error[k]
    missed = np.abs(np.abs(right) / np.abs(exact) - 1)
    before = np.abs(np.abs(plain) / np.abs(exact) - 1)
    assert before.max() > 0.03
    assert missed[list(chosen)].max() < 1e-3  # passes through its anchors
    assert missed.max() < 0.1 * before.max()
    # one part in a thousand for reading the surface between amplitudes
    assert (missed <= error + 1e-3).mean() > 0.95


def test_an_anchor_takes_the_place_of_one_that_is_close():
    near = [Anchor(0, 0, 0.5, 1.0, 0.0), Anchor(0, 0, 0.5 + 1e-5, 2.0, 0.0)]
    assert correction(near, np.array([0.0, 1.0])).tolist() == [2.0, 2.0]


def test_anchors_on_a_straight_line_miss_nothing():
    line = [Anchor(0, 0, u, 0.1 * u - 0.2j * u, 0.0) for u in (-2.0, -1.0, 0.5, 1.0, 3.0)]
    u, missed = missed_by_others(line)
    assert u.tolist() == [-2.0, -1.0, 0.5, 1.0, 3.0]
    np.testing.assert_allclose(missed[1:-1], 0.0, atol=1e-15)


def test_few_anchors_bound_nothing(refined):
    _, model, table = refined
    surface = load_surface(model, table, FREQUENCY)
    assert np.isinf(corrected_answers(surface, LOAD, []).error).all()


def test_a_joint_at_rest_is_no_anchor(refined):
    _, model, table = refined
    surface = load_surface(model, table, FREQUENCY)
    offset = model.offset[0] * LOAD
    with pytest.raises(MicroslipError, match="does not move"):
        anchor_at(surface, 170.0, LOAD, -offset)

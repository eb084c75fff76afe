"""Time steps that begin from what they change, against steps that begin from the whole of it."""

from dataclasses import replace

import numpy as np
import pytest

from microslip.analyses.time.scheme import contact_memory, march, prestressed_state, time_scheme
from microslip.contact import tableau
from microslip.contact.products import add_rows, add_symmetric
from microslip.model.joint import bonded_modes

STEPS, CYCLES = 150, 6


def without_shapes(scheme):
    """Memories that are told nothing of the change."""
    pairs = scheme.joint.model.pairs
    return tableau.memory(pairs, 0), tableau.memory(pairs, 0)


@pytest.fixture(scope="module", params=["gentle", "opens", "coupled damping", "no friction"])
def case(request, small_reference):
    """A scheme and a load that is raised."""
    joint, ratio = small_reference.joint, 1.5e-4
    moment = small_reference.moment
    if request.param == "opens":
        ratio = 6.5e-4
    if request.param == "no friction":
        joint = joint.with_friction(0.0)
    if request.param == "coupled damping":
        _, shapes = bonded_modes(joint.model, joint.prestress.bonded(2))
        model = replace(joint.model, damping=25.0 * shapes @ shapes.T)
        joint = replace(joint, model=model)
    frequency = joint.mode.sliding_frequency + 2.0
    scheme = time_scheme(joint, 1 / (frequency * STEPS), frequency=frequency)
    turn = np.arange(CYCLES * STEPS + 1) / STEPS
    wave = ratio * moment * np.minimum(turn / 3, 1.0) * np.sin(2 * np.pi * turn)
    return scheme, wave


def test_steps_are_the_same_as_from_the_whole_change(case):
    scheme, wave = case
    memory = contact_memory(scheme)
    start = prestressed_state(scheme)
    told = march(scheme, start, wave, keep=True, memory=memory)
    plain = march(scheme, start, wave, keep=True, memory=without_shapes(scheme))
    assert memory[0].flags[tableau.ANSWERED], "the change was told"
    size = np.abs(plain.output).max()
    print(f"{np.abs(told.output - plain.output).max() / size:.1e}", plain.dissipative.sum())
    np.testing.assert_allclose(told.output, plain.output, rtol=0, atol=1e-9 * size)
    assert told.residual.max() < 3 * plain.residual.max() + 1e-13
    # as many states are tried: a start that is off would cost more
    assert told.iterations.sum() <= 1.01 * plain.iterations.sum()


def test_answers_follow_the_exchanges_of_the_tableau(case):
    """They are the tableau's answers to the shapes after thousands of its changes."""
    scheme, wave = case
    memory, _ = memories = contact_memory(scheme)
    march(scheme, prestressed_state(scheme), wave, memory=memories)
    held = memory.held
    fresh = (memory.shapes * held) @ memory.transposed + memory.shapes * ~held
    off = np.abs(memory.answers - fresh).max(axis=1)
    assert (off <= 1e-9 * np.abs(fresh).max(axis=1)).all()


def test_a_change_that_is_told_wrongly_is_put_right(case):
    """The certificate is that of the whole change."""
    scheme, wave = case
    memory, _ = memories = contact_memory(scheme)
    memory.shapes[:] *= 1.01
    start = prestressed_state(scheme)
    told = march(scheme, start, wave, memory=memories)
    plain = march(scheme, start, wave, memory=without_shapes(scheme))
    size = np.abs(plain.output).max()
    np.testing.assert_allclose(told.output, plain.output, rtol=0, atol=1e-9 * size)
    assert told.residual.max() < 1e-9


def test_small_loads_are_solved_as_well(small_reference):
    """Everything sticks: what rounding leaves at touching pairs does not add up over the steps."""
    joint = small_reference.joint
    frequency = joint.mode.stuck_frequency - 2
    scheme = time_scheme(joint, 1 / (frequency * STEPS), frequency=frequency)
    wave = 1e-9 * small_reference.moment * np.sin(2 * np.pi * np.arange(20 * STEPS + 1) / STEPS)
    start = prestressed_state(scheme)
    told = march(scheme, start, wave, memory=contact_memory(scheme))
    plain = march(scheme, start, wave, memory=without_shapes(scheme))
    print(f"residual {told.residual.max():.1e} and {plain.residual.max():.1e}")
    assert told.residual.max() < 3e-13


@pytest.mark.parametrize("n", [1, 7, 8, 9, 30])
@pytest.mark.parametrize("share", [0.0, 0.3, 0.8])
def test_products_with_a_symmetric_matrix_read_its_lower_triangle(n, share):
    rng = np.random.default_rng(n)
    full = rng.normal(size=(n, n))
    full = full + full.T
    x = np.where(rng.random(n) < share, 0.0, rng.normal(size=n))
    begin = rng.normal(size=n)
    out, rows = begin.copy(), begin.copy()
    add_symmetric(full, x, out)
    add_rows(full, x, rows)
    np.testing.assert_allclose(out, begin + full @ x, rtol=1e-12, atol=1e-12)
    np.testing.assert_allclose(rows, begin + full @ x, rtol=1e-12, atol=1e-12)
    if np.count_nonzero(x) * 2 >= n:
        lower = begin.copy()
        add_symmetric(np.tril(full), x, lower)
        np.testing.assert_array_equal(lower, out)

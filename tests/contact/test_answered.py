"""What a tableau answers to a few modes, known beforehand: against multiplying by all of it."""

from __future__ import annotations

import numpy as np
import pytest
from random_contact import plain, random_flexibility

from microslip.analyses.time.deviations import StateSpace
from microslip.analyses.time.half_period import Passage, half_period_of
from microslip.analyses.time.scheme import (
    contact_memory,
    march,
    no_tangents,
    prestressed_state,
    time_scheme,
)
from microslip.contact import tableau
from microslip.contact.answered import answer_by_modes, nothing_answered
from microslip.contact.pairs import BACKWARD, FORWARD, SEPARATED, STICK
from microslip.contact.solver import ContactSolver
from microslip.contact.tableau import answer

PAIRS, MODES, DEVIATIONS = 100, 5, 6
FRICTION = 0.3


@pytest.fixture
def held():
    """A problem, and a memory that fits random states of its pairs."""
    rng = np.random.default_rng(3)
    states = rng.choice([STICK, STICK, FORWARD, SEPARATED], PAIRS).astype(np.int8)
    W = random_flexibility(rng, PAIRS)
    problem = ContactSolver(plain(W), FRICTION, np.full(PAIRS, 100.0), states).problem
    modes = rng.standard_normal((MODES, 2 * PAIRS))
    memory = tableau.memory(PAIRS, 0, modes)
    tableau.restart(problem, memory, states)
    return rng, problem, memory, states, modes


def exchanged(memory, components):
    tableau.exchange(memory, np.array(components), np.zeros(2 * PAIRS))


def turned(problem, memory, pair, sign):
    tableau.turn(problem.friction, memory, pair, sign, np.zeros(2 * PAIRS))


def test_images_follow_the_tableau(held):
    _, problem, memory, states, modes = held
    sticking = np.flatnonzero(states == STICK)
    exchanged(memory, [2 * i + 1 for i in sticking[:7]])
    for i in sticking[7:12]:
        turned(problem, memory, i, -memory.sign[i])
    exchanged(memory, [2 * sticking[8] + 1, 2 * sticking[20], 2 * sticking[20] + 1])
    found = memory.images.copy()
    weights, x = memory.modes * memory.held, np.empty(memory.images.shape)
    answer(memory, memory.modes, weights, x)
    assert found == pytest.approx(x, rel=1e-10, abs=1e-12 * np.abs(x).max())
    tableau.renew_images(memory)
    assert memory.images == pytest.approx(x, rel=1e-12, abs=1e-13 * np.abs(x).max())
    assert memory.turned @ memory.modes == pytest.approx(modes)


def test_answers_by_modes_are_those_of_the_whole_tableau(held):
    """Over steps in which what stays, stays, few or many components change, and the tableau does."""
    rng, problem, memory, states, modes = held
    known = nothing_answered(DEVIATIONS, modes)
    stays = rng.standard_normal((DEVIATIONS, 2 * PAIRS))
    sticking = np.flatnonzero(states == STICK)
    for step in range(12):
        if step == 3:
            turned(problem, memory, sticking[0], -memory.sign[sticking[0]])
            turned(problem, memory, sticking[1], -memory.sign[sticking[1]])
        if step == 6:
            exchanged(memory, [2 * i + 1 for i in sticking[4:9]])
        if step == 8:
            turned(problem, memory, sticking[2], -memory.sign[sticking[2]])
            exchanged(memory, [2 * sticking[2] + 1])
        some = rng.integers(2 * PAIRS, size=90 if step == 9 else step % 3)
        stays[:, some] += rng.standard_normal((DEVIATIONS, len(some)))
        shares = 1e3 * rng.standard_normal((DEVIATIONS, MODES))
        w = shares @ modes + stays
        weights = np.where(memory.held, w, 0.0)
        whole, found = np.empty(w.shape), np.empty(w.shape)
        answer(memory, w, weights, whole)
        answer_by_modes(memory, problem.friction, modes, shares, w, weights, known, found)
        assert found == pytest.approx(whole, abs=1e-11 * np.abs(whole).max())


@pytest.mark.parametrize("pairs", [10, 75])
def test_where_little_is_multiplied_nothing_is_kept(pairs):
    assert nothing_answered(DEVIATIONS, np.ones((MODES, 2 * pairs))).rest.shape == (0, 0)


@pytest.fixture(scope="module", params=[1e-4, 3e-4], ids="M/PL={:g}".format)
def motion(request, reference):
    """Of 201 pairs: scheme, a state that vibrates, and the load of a cycle."""
    frequency, steps = reference.joint.mode.sliding_frequency + 3.0, 60
    scheme = time_scheme(reference.joint, 1 / (frequency * steps), frequency=frequency)
    wave = request.param * reference.moment * np.sin(2 * np.pi * np.arange(steps + 1) / steps)
    start = march(scheme, prestressed_state(scheme), np.tile(wave[1:], 3)).state
    return scheme, start, wave


def plain_memory(scheme):
    return tuple(tableau.memory(scheme.joint.model.pairs, 0) for _ in range(2))


def test_a_march_is_the_same_with_and_without(motion):
    scheme, start, wave = motion
    own = contact_memory(scheme)
    assert len(own[0].modes) > 0
    found = march(scheme, start, wave, memory=own, keep=True)
    other = march(scheme, start, wave, memory=plain_memory(scheme), keep=True)
    assert np.array_equal(found.status, other.status)
    size = np.abs(other.r).max()
    assert found.r == pytest.approx(other.r, abs=1e-9 * size)
    assert found.residual.max() < 1e-9


def test_halves_with_their_images_are_the_whole(motion):
    """Images are renewed where the memory is turned."""
    scheme, start, wave = motion
    passage = Passage(scheme, wave, contact_memory(scheme), half_period_of(scheme))
    second = passage.of(passage.of(start).state).state
    whole = march(scheme, start, wave, memory=plain_memory(scheme)).state
    space = StateSpace(scheme, 2 * np.pi * scheme.frequency)
    assert space.change(space.vector(whole), space.vector(second)) < 1e-9
    known = passage.memory[0].images.copy()
    tableau.renew_images(passage.memory[0])
    assert known == pytest.approx(passage.memory[0].images, abs=1e-9 * np.abs(known).max())


def test_deviations_of_many_pairs_are_the_limit_of_differences(motion):
    scheme, start, wave = motion
    space = StateSpace(scheme, 2 * np.pi * scheme.frequency)
    rows, x = space.deviations(()), space.vector(start)
    exact = space.vibration(space.vector(march(scheme, start, wave, tangents=rows).tangents))
    image = space.vector(march(scheme, start, wave).state)
    size, z = np.linalg.norm(space.vibration(x)), space.vector(rows)
    for k in range(0, space.directions, 4):
        step = 1e-7 * size / max(np.linalg.norm(a) for a in (space.vibration(z[k]), exact[k]))
        later = space.vector(march(scheme, space.state(x + step * z[k], start), wave).state)
        change = space.vibration(later - image) / step
        assert np.linalg.norm(change - exact[k]) < 2e-3 * np.linalg.norm(exact[k])


def test_few_deviations_are_those_among_many(motion):
    """Columns do not mix: what is kept of all of them is of each."""
    scheme, start, wave = motion
    rows = StateSpace(scheme, 2 * np.pi * scheme.frequency).deviations(())
    whole = march(scheme, start, wave, tangents=rows).tangents
    one = no_tangents(scheme, 1)
    for part, of_all in zip(one, rows, strict=True):
        part[0] = of_all[4]
    alone = march(scheme, start, wave, tangents=one).tangents
    for part, of_all in zip(alone, whole, strict=True):
        assert part[0] == pytest.approx(of_all[4], abs=1e-7 * np.abs(of_all[4]).max())


def test_a_pair_that_turns_keeps_its_sign_in_the_images(held):
    _, problem, memory, states, _ = held
    pair = int(np.flatnonzero(states == STICK)[0])
    turned(problem, memory, pair, -1.0)
    again = memory.images.copy()
    states[pair] = BACKWARD
    exchanged(memory, [2 * pair + 1])
    states[pair] = STICK
    exchanged(memory, [2 * pair + 1])
    assert memory.images == pytest.approx(again, abs=1e-11 * np.abs(again).max())

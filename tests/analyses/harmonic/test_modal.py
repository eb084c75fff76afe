"""Harmonic balance of the modes alone: its laws, its linear side, and other methods on the same responses."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from spatial_twin import lift, spatial_joint
from test_spatial_harmonic import ANGLE, block, solved

from microslip.analyses.harmonic.adaptive import Adaptive, Ladder
from microslip.analyses.harmonic.all_pairs import of_all_pairs, unfolded
from microslip.analyses.harmonic.answers import Answers
from microslip.analyses.harmonic.balances import SOFTEST, Balances
from microslip.analyses.harmonic.hill import exponents_of
from microslip.analyses.harmonic.modal import ModalEquations, with_modal_samples
from microslip.analyses.harmonic.modal_answers import described
from microslip.analyses.harmonic.modal_solver import ModalPath, Preconditioner
from microslip.analyses.harmonic.modal_solver import solved as modal_solution
from microslip.analyses.harmonic.operator import linear_operator
from microslip.analyses.harmonic.over_time import OverTime
from microslip.analyses.harmonic.paths import ACCEPTED, CONTROL, FrequencyPath
from microslip.analyses.harmonic.points import distance
from microslip.analyses.harmonic.problem import harmonic_problem, padded, walking, with_harmonics
from microslip.analyses.harmonic.response import frequency_response
from microslip.analyses.harmonic.starts import starts_from_cycle
from microslip.analyses.time.scheme import time_scheme
from microslip.analyses.time.steady import raised_state, steady_state
from microslip.contact import driven
from microslip.contact.pairs import by_pair, tangential
from microslip.numerics.continuation import ContinuationError, StepControl
from microslip.numerics.fourier import to_complex

FREQUENCY, LOAD = 174.0, 2.4e-4
"""Hz, and moment over P L: pairs that stick, slip and separate."""

CONVERGED = StepControl(max_iterations=40, tolerance=1e-9)


@pytest.fixture(scope="module")
def load(small_reference):
    return LOAD * small_reference.moment


@pytest.fixture(scope="module")
def few(small_reference, load):
    """An answer of all pairs with five harmonics."""
    problem = harmonic_problem(small_reference.joint, harmonics=5)
    return frequency_response(problem, load, [160.0, FREQUENCY]).points[-1]


@pytest.fixture(scope="module")
def answers(few, load):
    return Answers(FrequencyPath(few.problem, load), CONTROL)


@pytest.fixture(scope="module")
def beside(small_reference, few, load):
    """The motion over time next to it."""
    motion = OverTime(small_reference.joint, load).beside(few)
    assert motion is not None
    return motion


@pytest.fixture(scope="module")
def found(answers, beside):
    return answers.by_modes(beside.steady, 21, 0.0)


def equations(few, load, harmonics=9, softer=1.0):
    """The equations of all pairs, and unknowns next to a solution."""
    known, w = unfolded(few.problem, of_all_pairs(few.problem), few.w)
    whole = with_modal_samples(known, harmonics)
    made = ModalEquations(whole, 2 * np.pi * few.frequency, load, softer)
    return made, made.pack(made.motion_of(padded(known, whole, w)))


def test_solution_obeys_the_laws_at_every_sample_and_its_linear_side(few, load):
    made, z = equations(few, load)
    evaluation, _ = modal_solution(ModalPath(made), z, CONVERGED)
    problem, cycle = made.problem, evaluation.cycle
    r, v = by_pair(cycle.r), by_pair(cycle.v)
    force = problem.force_scale
    far = np.abs(cycle.v).max()
    assert -r[..., 0].min() < 1e-9 * force
    assert v[..., 0].max() < 1e-9 * far
    assert np.abs(r[..., 0] * v[..., 0]).max() < 1e-9 * force * far
    assert (np.abs(r[..., 1]) - problem.friction * r[..., 0]).max() < 1e-9 * force
    point = described(made, evaluation, few.frequency)
    operator = linear_operator(point.problem, 2 * np.pi * few.frequency)
    u, _ = point.problem.split(point.w)
    linear = operator.free(load) - operator.flexibility(u)
    linear[:, 0] += point.problem.rigid_spread @ point.problem.place(point.w[u.size :])
    left = 10 * CONVERGED.tolerance * made.contact.scale
    assert point.v[point.problem.rows] == pytest.approx(linear, abs=left)


def test_energy_of_the_load_goes_into_friction_and_material(found):
    spent = found.dissipated + found.material_work + found.normal_work
    assert spent == pytest.approx(found.external_work, rel=1e-7)
    assert abs(found.normal_work) < 5e-3 * found.dissipated


def test_derivative_by_differences(few, load):
    """And its preconditioner, which leaves out little."""
    made, z = equations(few, load, 5)
    evaluation, _ = modal_solution(ModalPath(made), z, CONVERGED)
    z = made.pack(evaluation.motion)
    tangent = made.contact.linearised(evaluation.cycle)
    direction = z * np.random.default_rng(0).standard_normal(len(z))
    step = 1e-6
    ahead, behind = (made.at(z + side * step * direction) for side in (1, -1))
    assert (ahead.cycle.status == behind.cycle.status).all()
    slope = (ahead.F - behind.F) / (2 * step)
    size = np.linalg.norm(slope)
    along = made.derivative_times(tangent, direction)
    assert np.linalg.norm(along - slope) < 1e-4 * size
    modal = np.zeros_like(z)
    modal[: made.modal_size] = direction[: made.modal_size]
    scaled = made.derivative_times(tangent, modal) / made.problem.force_scale
    back = Preconditioner(made, tangent).solve(scaled)
    assert back[: made.modal_size] == pytest.approx(
        modal[: made.modal_size], abs=1e-3 * np.abs(modal).max()
    )


def test_little_load_is_that_of_all_pairs(small_reference):
    """Where next to nothing slips, both are linear."""
    load = 1e-8 * small_reference.moment
    problem = harmonic_problem(small_reference.joint, harmonics=5)
    point = frequency_response(problem, load, [160.0, FREQUENCY]).points[-1]
    answer = Answers(FrequencyPath(problem, load), CONTROL).by_modes(point, 5, 0.0)
    assert answer.amplitude == pytest.approx(point.amplitude, rel=1e-6)


def test_answer_is_as_near_to_the_motion_over_time_as_it_should_be(found, beside, few):
    before, after = (distance(each.amplitude, beside.steady.amplitude) for each in (few, found))
    print(f"H = 21: {after:.1e}, five of all pairs {before:.1e}, time {beside.own:.1e}")
    assert found.residual <= ACCEPTED
    assert found.modal
    assert after < min(3e-3, before)


def test_left_out_flexibility_matters_less_with_more_harmonics(answers, beside):
    apart = []
    for harmonics in (5, 27):
        one, other = (answers.by_modes(beside.steady, harmonics, 0.0, s) for s in (1.0, 16.0))
        apart.append(distance(one.amplitude, other.amplitude))
    print("H = 5, 27:", apart)
    assert apart[1] < 0.5 * apart[0]


def test_from_an_answer_and_from_a_motion_over_time_is_the_same(answers, few, found):
    other = answers.by_modes(few, 21, 0.0)
    assert other.amplitude == pytest.approx(found.amplitude, rel=1e-3)


def test_slow_exponents_are_those_of_all_pairs(few, answers, beside, load):
    new = with_harmonics(few.problem, 13)
    known = answers.from_start(next(starts_from_cycle(new, beside.steady)), few.frequency, 0.0)
    modal = answers.by_modes(beside.steady, 13, 0.0)
    one, other = (np.sort_complex(exponents_of(each).exponents[:2]) for each in (known, modal))
    assert other == pytest.approx(one, rel=0.03)


def test_walk_is_nearer_to_the_motion_over_time_than_that_of_all_pairs(small_reference):
    """Wide slip: the bodies go on past each other in every cycle."""
    joint, load = small_reference.joint, 5 * LOAD * small_reference.moment
    point = solved(joint, FREQUENCY, load)
    problem, w = walking(point.problem, point.w)
    answers = Answers(FrequencyPath(problem, load), CONTROL)
    known = answers.newton(problem, w, FREQUENCY, 0.0)
    all_pairs = answers.from_point(replace(with_harmonics(problem, 21), walks=True), known, 0.0)
    assert all_pairs is not None
    modal = answers.by_modes(known, 21, 0.0)
    scheme = time_scheme(joint, 1 / (1200 * FREQUENCY), frequency=FREQUENCY)
    start = raised_state(scheme, FREQUENCY, load, 10)
    steady = steady_state(scheme, FREQUENCY, load, start=start, max_cycles=400)
    walk = float(tangential(steady.cycle.v[-1] - steady.cycle.v[0]).mean())
    for name, each in (("modes", modal), ("all pairs", all_pairs)):
        print(name, each.walk / walk - 1, distance(each.amplitude, steady.amplitude))
    assert modal.problem.walks
    assert abs(modal.walk - walk) < abs(all_pairs.walk - walk)
    assert distance(modal.amplitude, steady.amplitude) < 1e-3


def test_planar_joint_turned_out_of_its_plane(small_reference, load):
    joint = small_reference.joint
    answers = []
    for other in (joint, spatial_joint(joint, ANGLE)):
        problem = harmonic_problem(other, harmonics=3, half_turn=False)
        point = solved(other, FREQUENCY, load, 3, half_turn=False)
        answers.append(Answers(FrequencyPath(problem, load), CONTROL).by_modes(point, 5, 0.0))
    flat, spatial = answers
    E = lift(joint.model.pairs, ANGLE)
    assert spatial.amplitude == pytest.approx(flat.amplitude, rel=1e-6)
    assert np.abs(spatial.r - E @ flat.r).max() <= 1e-5 * np.abs(flat.r).max()


def test_spatial_block_tends_to_the_same_limit():
    """Pairs whose tractions turn: with more harmonics nearer to the other balance."""
    joint, hertz, load = block(), 0.22, 1.5
    limit = solved(joint, hertz, load, 13)
    apart = []
    for harmonics in (3, 9):
        answers = Answers(FrequencyPath(limit.problem, load), CONTROL)
        apart.append(distance(answers.by_modes(limit, harmonics, 0.0).amplitude, limit.amplitude))
    print("H = 3, 9:", apart)
    assert apart[1] < min(3e-3, apart[0])


def test_levels_without_other_ways_are_found(small_reference, few, load, monkeypatch):
    """As near to the motion over time as they state."""
    for way in ("_next", "_alongside", "_onward"):
        monkeypatch.setattr(Ladder, way, lambda *_: None)
    over_time = OverTime(small_reference.joint, load)
    ladder = Ladder(FrequencyPath(few.problem, load), CONTROL, Adaptive(1e-4, 27), over_time)
    grown = ladder.grown(few)
    beside = over_time.beside(grown)
    assert beside is not None
    assert grown.modal
    assert grown.harmonics > 13
    assert distance(grown.amplitude, beside.steady.amplitude) <= grown.error + beside.own


def test_stiffer_flexibilities_follow_from_the_softest(answers, beside, monkeypatch):
    """Where only that has an answer: to the same one that the flexibility as it is leads to at once."""
    direct = answers.by_modes(beside.steady, 17, 0.0)
    by_modes, tried = Answers.by_modes, []

    def softest_alone(self, known, harmonics, began, softer):
        tried.append((known is beside.steady, softer))
        if known is beside.steady and softer < SOFTEST:
            raise ContinuationError("stalled")
        return by_modes(self, known, harmonics, began, softer)

    monkeypatch.setattr(Answers, "by_modes", softest_alone)
    found = list(Balances(answers).softly(beside.steady, 17, 0.0))
    assert [softer for start, softer in tried if not start] == [16.0, 4.0, 1.0]
    assert len(found) == 3
    assert found[0].amplitude != pytest.approx(direct.amplitude, rel=1e-7)
    assert found[-1].amplitude == pytest.approx(direct.amplitude, rel=1e-8)


def test_an_answer_with_many_harmonics_follows_from_one_with_a_few_fewer(
    small_reference, few, load, monkeypatch
):
    """By four at a time, by one where there is none: nearer to time integration with 2400 steps."""
    tried, by_modes = [], Answers.by_modes

    def not_all(self, known, harmonics, began, softer=1.0):
        tried.append((known.harmonics, harmonics, softer))
        if harmonics == 17 or (harmonics, softer) == (22, 1.0):
            raise ContinuationError("stalled")
        return by_modes(self, known, harmonics, began, softer)

    monkeypatch.setattr(Answers, "by_modes", not_all)
    for way in ("_next", "_alongside"):
        monkeypatch.setattr(Ladder, way, lambda *_: None)
    over_time = OverTime(small_reference.joint, load)
    ladder = Ladder(FrequencyPath(few.problem, load), CONTROL, Adaptive(1e-6, most=26), over_time)
    for way in ("_by_modes", "_between_levels"):
        monkeypatch.setattr(Ladder, way, lambda *_: None)
    grown = ladder.grown(few)
    ways = [(5, 9, 1.0), (9, 13, 1.0), (13, 17, 1.0), (13, 17, 2.0), (13, 18, 1.0)]
    assert tried == [*ways, (18, 22, 1.0), (18, 22, 2.0), (22, 26, 1.0)]
    steps = 2400
    scheme = time_scheme(
        small_reference.joint, 1 / (few.frequency * steps), frequency=few.frequency
    )
    steady = steady_state(scheme, few.frequency, load)
    assert steady.converged
    off, before = (distance(each.amplitude, steady.amplitude) for each in (grown, few))
    print(f"H = {grown.harmonics}: {off:.1e}, states {grown.error:.1e}; five {before:.1e}")
    assert off <= grown.error
    assert off < 0.2 * before


def test_harmonics_are_added_no_longer_where_two_numbers_in_a_row_have_no_answer(
    small_reference, few, load, monkeypatch
):
    tried = []
    for way in ("_next", "_alongside", "_by_modes", "_between_levels"):
        monkeypatch.setattr(Ladder, way, lambda *_: None)
    monkeypatch.setattr(
        Balances, "onward", lambda _, last, harmonics, began: tried.append(harmonics)
    )
    over_time = OverTime(small_reference.joint, load)
    Ladder(FrequencyPath(few.problem, load), CONTROL, Adaptive(1e-6), over_time).grown(few)
    assert tried == [9, 10]
    tried.clear()
    # without a motion over time nothing tells whether more are better
    Ladder(FrequencyPath(few.problem, load), CONTROL, Adaptive(1e-6)).grown(few)
    assert tried == []


def test_after_a_level_without_a_balance_the_next_is_passed_over(
    small_reference, few, load, monkeypatch
):
    tried = []

    def none(self, known, harmonics, began):
        tried.append(harmonics)
        yield from ()

    for way in ("_next", "_alongside", "_onward"):
        monkeypatch.setattr(Ladder, way, lambda *_: None)
    monkeypatch.setattr(Balances, "softly", none)
    over_time = OverTime(small_reference.joint, load)
    Ladder(FrequencyPath(few.problem, load), CONTROL, Adaptive(1e-6), over_time).grown(few)
    assert tried == [17, 27, 41, 63]
    tried.clear()
    Ladder(FrequencyPath(few.problem, load), CONTROL, Adaptive(1e-6)).grown(few)
    assert tried == [17]


def test_a_number_of_harmonics_between_the_levels_is_found(small_reference, few, load, monkeypatch):
    """Where it is the only one that has an answer: as near to the motion over time as it states."""
    tried, at_once = [], Balances.at_once

    def one_alone(self, known, harmonics, began, softer):
        tried.append((softer, harmonics))
        if (softer, harmonics) == (2.0, 24):
            yield from at_once(self, known, harmonics, began, softer)

    for way in ("_next", "_alongside", "_onward"):
        monkeypatch.setattr(Ladder, way, lambda *_: None)
    monkeypatch.setattr(Balances, "softly", lambda *_: iter(()))
    monkeypatch.setattr(Balances, "at_once", one_alone)
    over_time = OverTime(small_reference.joint, load)
    ladder = Ladder(FrequencyPath(few.problem, load), CONTROL, Adaptive(1.5e-3), over_time)
    grown = ladder.grown(few)
    beside = over_time.beside(grown)
    assert beside is not None
    off = distance(grown.amplitude, beside.steady.amplitude)
    before = distance(few.amplitude, beside.steady.amplitude)
    print(f"H = 5: {before:.1e}, 24: {off:.1e}, states {grown.error:.1e}")
    assert tried == [*((1.0, H) for H in range(14, 42)), *((2.0, H) for H in range(14, 25))]
    assert grown.harmonics == 24
    assert off <= grown.error + beside.own
    assert grown.error <= 1.5e-3 < before


def test_modes_that_damping_couples_are_not_balanced(answers, few, beside, load):
    model = few.problem.model
    damped = replace(few.problem, model=replace(model, damping=np.eye(len(model.omega))))
    balances = Balances(Answers(FrequencyPath(damped, load), CONTROL))
    assert not balances.apply
    assert not list(balances.softly(beside.steady, 17, 0.0))
    assert balances.losses.sum == 0


def test_modes_that_damping_couples_are_refused(few, load):
    model = few.problem.model
    damped = replace(model, damping=np.eye(len(model.omega)))
    problem = replace(of_all_pairs(few.problem), model=damped)
    with pytest.raises(ContinuationError, match="damping couples the modes"):
        ModalEquations(problem, 2 * np.pi * FREQUENCY, load)


def test_samples_too_many_to_linearise_are_no_answer_and_no_crash(answers, few, monkeypatch):
    """What contact cannot do ends one way to an answer, and not the search for others."""
    monkeypatch.setattr(driven, "MOST_NUMBERS", 1)
    with pytest.raises(ContinuationError, match="too many to linearise"):
        answers.by_modes(few, 9, 0.0)


def test_tail_counts_the_last_harmonics(found):
    size = np.sum(np.abs(to_complex(found.r)[1:]) ** 2, axis=1)
    assert found.tail == pytest.approx(np.sqrt(size[-2:].sum() / size.sum()), rel=1e-12)

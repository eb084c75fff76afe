"""Harmonic balance against finite elements, the time domain, symmetries and its own derivative."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
import scipy.sparse as sp
import scipy.sparse.linalg as spla
from conftest import FRICTION

from microslip.analyses.harmonic.adaptive import Adaptive
from microslip.analyses.harmonic.condensed import eliminate, static_share
from microslip.analyses.harmonic.equations import (
    derivative_times,
    evaluate,
    frequency_derivative,
    load_derivative,
)
from microslip.analyses.harmonic.linear import HarmonicSolver
from microslip.analyses.harmonic.operator import linear_operator
from microslip.analyses.harmonic.paths import CONTROL, FrequencyPath, LoadPath
from microslip.analyses.harmonic.peaks import resonance_locus, resonance_peak
from microslip.analyses.harmonic.points import describe
from microslip.analyses.harmonic.problem import harmonic_problem, padded, with_harmonics
from microslip.analyses.harmonic.raising import follow_frequency, raise_load
from microslip.analyses.harmonic.response import amplitude_sweep, frequency_response
from microslip.analyses.prepared.joint import prepare_joint
from microslip.analyses.time.scheme import time_scheme
from microslip.analyses.time.steady import steady_state
from microslip.contact.law import contact_law
from microslip.contact.pairs import normal, tangential, tangential_rows
from microslip.errors import ContactError, MicroslipError
from microslip.numerics.continuation import (
    ContinuationError,
    StepControl,
    first_point,
    fold,
    solve_at,
    trace,
    turned,
)

LOAD = 2.4e-4
"""Moment over P L: widely slipping at resonance."""


@pytest.fixture(scope="module")
def problem(small_reference):
    return harmonic_problem(small_reference.joint, harmonics=3)


def solved(problem, frequency, load):
    w, _ = raise_load(problem, frequency, load)
    return describe(LoadPath(problem, frequency, load).at(w, load), 0, 0.0)


@pytest.fixture(scope="module")
def mixed(problem, small_reference):
    """Below resonance: pairs that stick, slip and separate."""
    return solved(problem, 174.0, LOAD * small_reference.moment)


def elastic(reference, **options):
    stiffness = 1e14 * reference.model.area
    compliance = np.repeat(1 / stiffness, 2)
    law = contact_law(reference.model.pairs, FRICTION, compliance)
    mode = reference.joint.mode
    joint = prepare_joint(reference.model, law, reference.start.preload, "moment", mode)
    return harmonic_problem(joint, stiffness=1 / compliance, **options)


@pytest.mark.parametrize("law", ["exact", "elastic"])
@pytest.mark.parametrize("half_turn", [True, False])
def test_derivatives_against_differences(small_reference, law, half_turn):
    """Of the residual by the unknowns, the frequency and the load; and the condensed inverse."""
    options = {"harmonics": 3, "half_turn": half_turn}
    if law == "elastic":
        problem = elastic(small_reference, **options)
    else:
        problem = harmonic_problem(small_reference.joint, **options)
    load = LOAD * small_reference.moment
    omega = 2 * np.pi * 176.0
    operator = linear_operator(problem, omega)
    w, _ = raise_load(problem, 176.0, 0.3 * load)
    rng = np.random.default_rng(3)
    w = w + 1e-4 * problem.force_scale * rng.standard_normal(len(w))
    point = evaluate(operator, load, w)
    assert (point.cycle.kind == 2).any()
    direction = rng.standard_normal(len(w)) * problem.force_scale
    step = 1e-9
    slope = evaluate(operator, load, w + step * direction).F
    slope = (slope - evaluate(operator, load, w - step * direction).F) / (2 * step)
    analytic = derivative_times(operator, point.cycle, direction)
    assert analytic == pytest.approx(slope, abs=1e-6 * np.abs(slope).max())
    h = 1e-5
    slope = evaluate(linear_operator(problem, omega + h), load, w).F
    slope = (slope - evaluate(linear_operator(problem, omega - h), load, w).F) / (2 * h)
    analytic = frequency_derivative(operator, point, load)
    assert analytic == pytest.approx(slope, abs=1e-5 * np.abs(slope).max())
    h = 1e-6 * load
    slope = (evaluate(operator, load + h, w).F - evaluate(operator, load - h, w).F) / (2 * h)
    assert load_derivative(operator, point) == pytest.approx(slope, abs=1e-6 * np.abs(slope).max())
    right = rng.standard_normal(len(w))
    solver = HarmonicSolver()
    z = solver.linear_solve(operator, point.cycle, right, 1e-9)
    assert solver.counts.krylov <= 24  # of random unknowns, which strain single precision
    back = derivative_times(operator, point.cycle, z)
    assert back == pytest.approx(right, abs=1e-7)


def test_sets_larger_than_needed_are_as_good(problem, small_reference, mixed):
    """What once changed and does not any more may stay coupled, and is let go where it is worth it."""
    operator = linear_operator(problem, 2 * np.pi * 174.0)
    wide = evaluate(operator, LOAD * small_reference.moment, mixed.w).cycle
    narrow = evaluate(operator, 0.0, problem.rest()).cycle
    sets = eliminate(problem, wide, static_share(problem))
    assert sets.holds(wide)
    assert not sets.spares(wide)
    assert sets.holds(narrow)
    assert sets.spares(narrow)
    right = np.random.default_rng(5).standard_normal(len(mixed.w))
    kept = HarmonicSolver()
    kept.linear_solve(operator, wide, right, 1e-3)
    z = kept.linear_solve(operator, narrow, right, 1e-11)
    fresh = HarmonicSolver().linear_solve(operator, narrow, right, 1e-11)
    assert z == pytest.approx(fresh, abs=1e-8 * np.abs(fresh).max())


@pytest.mark.parametrize(("friction", "directions"), [(0.0, 1), (50.0, 2)])
def test_small_loads_give_the_linear_response(small_reference, friction, directions):
    """Frictionless and stuck: the harmonic response of the finite elements, pairs bonded."""
    joint, frequency = small_reference.joint.with_friction(friction), 170.0
    load = 1e-7 * small_reference.moment
    problem = harmonic_problem(joint, harmonics=2)
    w, _ = raise_load(problem, frequency, load)
    path, tight = LoadPath(problem, frequency, load), StepControl(tolerance=1e-11)
    w, equations, iterations = solve_at(path, w, load, tight)
    found = describe(equations, iterations, 0.0)
    structure, omega = small_reference.structure, 2 * np.pi * frequency
    scale = np.abs(structure.stiffness).max()
    bonded = scale * structure.interface.relative[joint.prestress.bonded(directions)]
    beta = joint.model.rayleigh[1]
    dynamic = (1 + 1j * omega * beta) * structure.stiffness - omega**2 * structure.mass
    system = sp.bmat([[dynamic, bonded.T], [bonded, None]], format="csc")
    right = np.concatenate([load * structure.loads["moment"], np.zeros(bonded.shape[0])])
    x = spla.spsolve(system, right.astype(complex))[: structure.dofs]
    direct = small_reference.states.sliding @ (structure.mass @ x)
    print(f"{found.amplitude / direct - 1:.1e}")
    assert abs(found.amplitude / direct - 1) < 1e-5
    assert np.abs(found.output[2]).max() < 1e-6 * np.abs(found.output[1]).max()


def test_residual_and_energy_balance(mixed):
    """External work is friction plus material damping; every point is solved to 1e-8."""
    assert mixed.residual <= 1e-8
    assert (mixed.status == 1).any()
    assert (mixed.status == 4).any()
    assert (mixed.status == 2).any()
    assert mixed.dissipated > 0
    balance = mixed.external_work - mixed.dissipated - mixed.material_work
    assert abs(balance - mixed.normal_work) < 1e-5 * mixed.external_work
    assert abs(mixed.normal_work) < 2e-3 * mixed.external_work


def test_half_turn_halves_the_work_and_nothing_else(small_reference, problem, mixed):
    other = harmonic_problem(small_reference.joint, harmonics=3, half_turn=False)
    assert len(problem.pairs) == len(other.pairs) // 2 + 1
    whole = solved(other, 174.0, mixed.load)
    assert whole.amplitude == pytest.approx(mixed.amplitude, rel=1e-5)
    top = whole.friction_work.max()
    assert whole.friction_work == pytest.approx(mixed.friction_work, abs=1e-4 * top)
    assert whole.friction_work == pytest.approx(whole.friction_work[::-1], abs=1e-4 * top)
    assert np.mean(whole.status == mixed.status) > 0.999
    balance = whole.external_work - whole.dissipated - whole.material_work - whole.normal_work
    assert abs(balance) < 1e-8 * whole.external_work


def test_scaling_with_the_clamp(small_reference, mixed):
    """Twice the clamp force and twice the moment: twice the motion, four times the energy."""
    twice = small_reference.joint.with_preload({"clamp": 2 * small_reference.start.force})
    other = solved(harmonic_problem(twice, harmonics=3), 174.0, 2 * mixed.load)
    assert other.amplitude == pytest.approx(2 * mixed.amplitude, rel=1e-7)
    assert other.dissipated == pytest.approx(4 * mixed.dissipated, rel=1e-6)


def test_stuck_pairs_stay_where_the_clamp_put_them(small_reference, problem):
    point = solved(problem, 174.0, 0.02 * LOAD * small_reference.moment)
    stuck = (point.status == 1).all(axis=1)
    assert 0.5 < stuck.mean() < 1
    rest = tangential(small_reference.start.solution.v)
    slip = np.abs(point.v[tangential_rows()] - rest[:, None] * (np.arange(7) == 0))
    size = np.abs(small_reference.start.solution.v).max()
    assert slip[stuck].max() < 1e-10 * size


def time_domain(joint, frequency, load, guess, steps=600):
    scheme = time_scheme(joint, 1 / (frequency * steps), frequency=frequency)
    found = steady_state(scheme, frequency, load, guess=guess, tolerance=1e-5)
    assert found.converged
    return found


def test_amplitude_of_the_time_domain(small_reference):
    """Within 0.3 % off the steep flank, with the harmonics that the adaptive choice took."""
    joint, load = small_reference.joint, LOAD * small_reference.moment
    problem = harmonic_problem(joint, harmonics=5)
    response = frequency_response(problem, load, [172.0, 170.0, 165.0], adaptive=Adaptive())
    assert not response.failures
    for point in response.points:
        truth = time_domain(joint, point.frequency, load, point.amplitude)
        error = abs(point.amplitude) / abs(truth.amplitude) - 1
        print(f"{point.frequency} Hz, H = {point.harmonics}: {error:+.2e}, tail {point.tail:.3f}")
        assert abs(error) < 3e-3
        assert point.error <= Adaptive().tolerance


def test_walking_joint(small_reference):
    """At wide slip the bodies creep past each other, as in the time domain, and nothing holds them."""
    joint, load = small_reference.joint, 4e-4 * small_reference.moment
    frequency = joint.mode.sliding_frequency + 1.0
    problem = harmonic_problem(joint, harmonics=9)
    response = frequency_response(problem, load, [190.0, frequency])
    assert not response.failures
    held, walks = response.points
    assert held.walk == 0
    assert walks.pull == 0
    truth = time_domain(joint, frequency, load, walks.amplitude)
    walked = tangential(truth.cycle.v[-1] - truth.cycle.v[0]).mean()
    error = walks.amplitude / truth.amplitude - 1
    print(f"walk {walks.walk:.3e} against {walked:.3e} m per cycle; amplitude {error:.1e}")
    assert abs(error) < 3e-3
    assert walks.walk == pytest.approx(walked, rel=0.03)
    mean = walks.r[:, 0]
    assert abs(tangential(mean).sum()) < 1e-5 * FRICTION * normal(mean).sum()


def test_answer_forgets_the_augmentation_as_harmonics_grow(small_reference):
    load = LOAD * small_reference.moment
    spread = []
    for harmonics in (3, 7):
        found = []
        for factor in (1.0, 0.3):
            stiffness = factor / np.diag(small_reference.model.residual)
            problem = harmonic_problem(
                small_reference.joint, harmonics=harmonics, stiffness=stiffness
            )
            found.append(abs(solved(problem, 165.0, 0.3 * load).amplitude))
        spread.append(abs(found[0] / found[1] - 1))
    print(spread)
    assert spread[1] < 0.5 * spread[0]


def test_more_harmonics_start_from_fewer(problem, mixed):
    """Unknowns padded with zeros are the same motion."""
    more = with_harmonics(problem, 5)
    w = padded(problem, more, mixed.w)
    u, q = more.split(w)
    old, q_old = problem.split(mixed.w)
    assert (u[:, :7] == old).all()
    assert not u[:, 7:].any()
    assert q == pytest.approx(q_old)


def test_fold_and_back(small_reference, problem):
    """A light joint folds; the branch is the same from both ends, through the fold."""
    load = 3 * LOAD * small_reference.moment
    path, branch = follow_frequency(
        problem, load, (170.0, 180.0), observe=lambda point: point.p < 171.5 and point.tangent_p < 0
    )
    assert branch.ended == "stopped"
    assert len(branch.folds) == 1
    turn = fold(path, branch, branch.folds[0])
    assert turn.p > 172.0
    back = trace(path, turned(branch.points[-1]), (170.0, 180.0), CONTROL)
    again = fold(path, back, back.folds[0])
    print(f"fold at {turn.p:.5f} and {again.p:.5f} Hz, {len(branch.points)} points")
    assert again.p == pytest.approx(turn.p, rel=1e-5)
    assert back.points[-1].p == 170.0
    first = describe(path.at(branch.points[0].u, 170.0), 0, 0.0).amplitude
    last = describe(path.at(back.points[-1].u, 170.0), 0, 0.0).amplitude
    assert last == pytest.approx(first, rel=1e-6)


def test_peak_and_locus(small_reference, problem):
    """The peak is where amplitudes on either side are smaller; more load softens the joint."""
    loads = np.array([0.1, 0.3]) * LOAD * small_reference.moment
    peaks, failures = resonance_locus(problem, loads, (190.0, 177.0))
    assert not failures
    assert peaks[0].frequency > peaks[1].frequency
    assert abs(peaks[0].amplitude) < abs(peaks[1].amplitude)
    path = FrequencyPath(problem, float(loads[0]))
    top = peaks[0]
    for shift in (-0.05, 0.05):
        guess = first_point(path, top.w, top.frequency + shift, CONTROL)
        beside = describe(path.at(guess.u, guess.p), 0, 0.0)
        assert abs(beside.amplitude) < abs(top.amplitude)
    _, branch = follow_frequency(problem, float(loads[0]), (165.0, 166.0))
    with pytest.raises(ContinuationError, match="no resonance peak"):
        resonance_peak(path, branch)


def test_sweeps_agree(small_reference, problem, mixed):
    """Over load at one frequency, over frequency at one load: the same point."""
    sweep = amplitude_sweep(problem, 174.0, [0.5 * mixed.load, mixed.load])
    assert not sweep.failures
    response = frequency_response(problem, mixed.load, [170.0, 174.0])
    assert sweep.points[1].amplitude == pytest.approx(mixed.amplitude, rel=1e-6)
    assert response.points[1].amplitude == pytest.approx(mixed.amplitude, rel=1e-6)
    assert abs(sweep.points[0].amplitude) < abs(sweep.points[1].amplitude)


def test_failures_are_named_and_the_rest_kept(small_reference, problem):
    short = StepControl(first=0.02, largest=0.1, max_points=25)
    load = 0.01 * LOAD * small_reference.moment
    response = frequency_response(problem, load, [165.0, 165.5, 177.0, 189.0], control=short)
    assert [point.frequency for point in response.points] == [165.0, 165.5, 189.0]
    assert response.branch_of == (0, 0, 1)
    assert any(
        "177 Hz" in failure.where and "not on the branch" in failure.reason
        for failure in response.failures
    )


def test_bad_requests(small_reference):
    joint, model = small_reference.joint, small_reference.model
    with pytest.raises(ContactError, match="do not resolve"):
        harmonic_problem(joint, harmonics=40, samples=128)
    with pytest.raises(MicroslipError, match="no residual flexibility"):
        harmonic_problem(joint.with_model(replace(model, residual=0 * model.residual)))
    uneven = joint.with_friction(np.linspace(0.2, 0.3, model.pairs))
    with pytest.raises(MicroslipError, match="half turn"):
        harmonic_problem(uneven, half_turn=True)
    assert not harmonic_problem(uneven).half_turn
    turnless = joint.with_model(replace(model, image=None))
    with pytest.raises(MicroslipError, match="half turn"):
        harmonic_problem(turnless, half_turn=True)
    with pytest.raises(MicroslipError, match="coefficient of friction"):
        harmonic_problem(joint.with_friction(-0.1))
    with pytest.raises(MicroslipError, match="no port"):
        harmonic_problem(joint, port="torque")
    problem = harmonic_problem(joint)
    with pytest.raises(MicroslipError, match="must be positive"):
        linear_operator(problem, -1.0)
    with pytest.raises(MicroslipError, match="at least two"):
        frequency_response(problem, 1.0, [170.0])
    with pytest.raises(MicroslipError, match="above zero"):
        amplitude_sweep(problem, 170.0, [0.0])

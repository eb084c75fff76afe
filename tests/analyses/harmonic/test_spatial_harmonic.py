"""Harmonic balance with two tangential directions: the planar joint turned, axes turned, march, limits."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from conftest import build_reference
from contact.test_timestep_spatial import step
from spatial_twin import lift, spatial_joint

from microslip.analyses.backbone.extended_motion import harmonic_backbone
from microslip.analyses.backbone.points import amplitude_scale
from microslip.analyses.harmonic.equations import (
    derivative_times,
    evaluate,
    frequency_derivative,
    load_derivative,
)
from microslip.analyses.harmonic.hill import exponents_of, hill_exponents
from microslip.analyses.harmonic.linear import HarmonicSolver
from microslip.analyses.harmonic.operator import linear_operator
from microslip.analyses.harmonic.paths import CONTROL, LoadPath
from microslip.analyses.harmonic.points import describe
from microslip.analyses.harmonic.problem import harmonic_problem, walking
from microslip.analyses.harmonic.raising import raise_load
from microslip.analyses.prepared.joint import prepare_joint
from microslip.analyses.prepared.joint_modes import joint_modes
from microslip.analyses.time.scheme import prestressed_state, time_scheme
from microslip.contact.aft import CHANGING
from microslip.contact.law import contact_law
from microslip.contact.pairs import SLIP, by_pair, slip_history, touches
from microslip.contact.timestep import Motion
from microslip.errors import MicroslipError
from microslip.model.joint import JointModel
from microslip.numerics.continuation import solve_at

SAME = 1e-8
"""Of what is the same problem in other coordinates, solved to 1e-9."""

ANGLE = 0.7


def block(seed=1, pairs=6, modes=5, springs=(0.03, 0.04, 0.05), rayleigh=(0.02, 0.01)):
    """A block pressed onto ground on soft springs: two ways to slide, a turn, and modes of all kinds."""
    rng = np.random.default_rng(seed)
    place = rng.uniform(-1, 1, (pairs, 2))
    place -= place.mean(axis=0)
    slides = np.zeros((pairs, 3, 3))
    slides[:, 1, 0] = slides[:, 2, 1] = 1.0
    slides[:, 1, 2], slides[:, 2, 2] = -place[:, 1], place[:, 0]
    own = 0.5 * rng.standard_normal((pairs, 3, modes))
    psi = np.concatenate([slides, own], axis=2).reshape(3 * pairs, -1)
    A = rng.standard_normal((3 * pairs, 3 * pairs))
    residual = 0.1 * np.eye(3 * pairs) + 0.1 * A @ A.T / (3 * pairs)
    omega = np.concatenate([springs, np.sort(rng.uniform(1.0, 4.0, modes))])
    down = np.tile([1.0, 0.0, 0.0], pairs) * np.repeat(rng.uniform(0.7, 1.3, pairs), 3)
    ports = np.zeros((len(omega), 2))
    ports[:, 0] = psi.T @ down
    ports[:3, 0] = 0.0
    ports[:, 1] = np.concatenate([[1.0, 0.6, 0.3], rng.standard_normal(modes)])
    model = JointModel(
        position=np.arange(pairs, dtype=float),
        area=np.ones(pairs),
        dimension=3,
        omega=omega,
        equilibrium_modes=3,
        mode_v=psi,
        residual=residual,
        ports=("press", "drive"),
        port_modes=ports,
        port_v=np.column_stack([residual @ down, np.zeros(3 * pairs)]),
        port_port=np.array([[down @ residual @ down, 0.0], [0.0, 0.0]]),
        rayleigh=rayleigh,
    )
    return prepare_joint(model, contact_law(pairs, 0.4, None, 3), {"press": 1.0}, "drive")


def solved(joint, hertz, load, harmonics=5, **options):
    problem = harmonic_problem(joint, harmonics=harmonics, **options)
    w, _ = raise_load(problem, hertz, load)
    return describe(LoadPath(problem, hertz, load).at(w, load), 0, 0.0)


def turned(joint, angles):
    """The joint with the tangential axes of every pair turned by its own angle."""
    model = joint.model
    Q = np.zeros((3 * model.pairs, 3 * model.pairs))
    for i, a in enumerate(angles):
        own = slice(3 * i, 3 * i + 3)
        Q[own, own] = [[1, 0, 0], [0, np.cos(a), -np.sin(a)], [0, np.sin(a), np.cos(a)]]
    other = replace(
        model,
        mode_v=Q @ model.mode_v,
        residual=Q @ model.residual @ Q.T,
        port_v=Q @ model.port_v,
    )
    return prepare_joint(other, joint.law, joint.prestress.preload, joint.drive), Q


@pytest.mark.parametrize(("share", "walks"), [(0.3, False), (1.0, False), (5.0, True)])
def test_planar_joint_turned_out_of_its_plane(small_reference, share, walks):
    """Held by its supports and let go: response, walk, states; the third direction does nothing."""
    joint, hertz = small_reference.joint, 174.0
    load = share * 2.4e-4 * small_reference.moment
    flat = harmonic_problem(joint, harmonics=3, half_turn=False)
    spatial = harmonic_problem(spatial_joint(joint, ANGLE), harmonics=3)
    points = []
    for problem in (flat, spatial):
        w, _ = raise_load(problem, hertz, load)
        if walks:
            problem, w = walking(problem, w)
        path = LoadPath(problem, hertz, load)
        w, equations, _ = solve_at(path, w, load, CONTROL)
        points.append(describe(equations, 0, 0.0))
    one, other = points
    E = lift(joint.model.pairs, ANGLE)
    assert np.abs(other.r - E @ one.r).max() <= SAME * np.abs(one.r).max()
    assert np.abs(other.v - E @ one.v).max() <= SAME * np.abs(one.v).max()
    assert other.amplitude == pytest.approx(one.amplitude, rel=SAME)
    assert other.walk == pytest.approx(abs(one.walk), rel=SAME, abs=1e-16)
    assert other.friction_work == pytest.approx(
        one.friction_work, abs=SAME * one.friction_work.max()
    )
    slips = touches(one.status) & (one.status != 1)
    assert np.array_equal(other.status == SLIP, slips)
    nearest = exponents_of(one).exponents[:2], exponents_of(other).exponents[:2]
    if not walks:
        assert np.sort_complex(nearest[1]) == pytest.approx(np.sort_complex(nearest[0]), rel=1e-4)


def test_turned_axes_change_nothing():
    joint = block()
    angles = np.random.default_rng(2).uniform(0, 2 * np.pi, joint.model.pairs)
    other, Q = turned(joint, angles)
    hertz, load = 0.22, 2.0
    one, turned_one = (solved(each, hertz, load) for each in (joint, other))
    assert (one.status == SLIP).any()
    assert np.abs(turned_one.r - Q @ one.r).max() <= SAME * np.abs(one.r).max()
    assert np.abs(turned_one.v - Q @ one.v).max() <= SAME * np.abs(one.v).max()
    assert turned_one.pull == pytest.approx(one.pull, rel=1e-6)
    assert turned_one.amplitude == pytest.approx(one.amplitude, rel=SAME)


def test_turned_axes_do_not_change_a_walk():
    """Two ways and a turn, let go: the unknowns of one, turned, solve the other."""
    joint = block()
    angles = np.random.default_rng(2).uniform(0, 2 * np.pi, joint.model.pairs)
    other, Q = turned(joint, angles)
    hertz, load = 0.22, 2.0
    one = solved(joint, hertz, load)
    assert one.problem.slides == 3
    problem, w = walking(one.problem, one.w)
    w, equations, _ = solve_at(LoadPath(problem, hertz, load), w, load, CONTROL)
    found = describe(equations, 0, 0.0)
    assert found.walk > 0
    again = replace(harmonic_problem(other, harmonics=5), walks=True)
    p = np.linalg.lstsq(again.rigid_spread, Q @ problem.rigid_spread @ w[-3:], rcond=None)[0]
    mapped = np.concatenate([(Q @ found.r).ravel(), p])
    F = LoadPath(again, hertz, load).at(mapped, load).F
    assert np.abs(F).max() <= SAME


@pytest.mark.parametrize("walks", [False, True])
def test_derivatives_against_differences(walks):
    """Of the residual by the unknowns, the frequency and the load; and the condensed inverse."""
    joint = block(3)
    problem = harmonic_problem(joint, harmonics=3)
    load, omega = 1.5, 1.3
    w, _ = raise_load(problem, omega / (2 * np.pi), load)
    if walks:
        problem, w = walking(problem, w)
        w[-3:] = [0.02, -0.03, 0.04]
    rng = np.random.default_rng(5)
    w = w + 1e-3 * problem.force_scale * rng.standard_normal(len(w))
    operator = linear_operator(problem, omega)
    point = evaluate(operator, load, w)
    assert (point.cycle.kind == CHANGING).any()
    direction = rng.standard_normal(len(w)) * problem.force_scale
    step = 1e-8
    slope = evaluate(operator, load, w + step * direction).F
    slope = (slope - evaluate(operator, load, w - step * direction).F) / (2 * step)
    analytic = derivative_times(operator, point.cycle, direction)
    assert analytic == pytest.approx(slope, abs=1e-6 * np.abs(slope).max())
    slope = evaluate(linear_operator(problem, omega + step), load, w).F
    slope = (slope - evaluate(linear_operator(problem, omega - step), load, w).F) / (2 * step)
    analytic = frequency_derivative(operator, point, load)
    assert analytic == pytest.approx(slope, abs=1e-5 * np.abs(slope).max())
    slope = (evaluate(operator, load + step, w).F - evaluate(operator, load - step, w).F) / (
        2 * step
    )
    assert load_derivative(operator, point) == pytest.approx(slope, abs=1e-5 * np.abs(slope).max())
    right = rng.standard_normal(len(w))
    z = HarmonicSolver().linear_solve(operator, point.cycle, right, 1e-9)
    back = derivative_times(operator, point.cycle, z)
    assert back == pytest.approx(right, abs=1e-7 * np.abs(z).max())


def marched(joint, hertz, load, steps, cycles):
    """Outputs, friction work and states of the last of many cycles over time, from prestress."""
    dt = 1 / (hertz * steps)
    scheme = time_scheme(joint, dt, frequency=hertz)
    state = prestressed_state(scheme)
    motion = Motion(
        **{name: getattr(state, name).copy() for name in Motion._fields if name != "vt_old"},
        vt_old=slip_history(state.v, 3),
    )
    force = np.full(joint.model.pairs, joint.prestress.largest_reaction)
    sine = load * np.sin(2 * np.pi * np.arange(steps + 1) / steps)
    flexibilities = (scheme.W, scheme.W_dissipative)
    for _ in range(cycles):
        found = step(scheme.kernel, flexibilities, joint.law.friction, force, motion, sine)
    return found


@pytest.mark.parametrize(("hertz", "load"), [(0.22, 2.0), (0.35, 2.5)])
def test_against_the_march_over_time(hertz, load):
    """Pairs whose slip turns, some of which open: amplitude and dissipation of the settled cycle, 0.5 %."""
    joint = block(1, springs=(0.5, 0.6, 0.7), rayleigh=(0.05, 0.02))
    found = marched(joint, hertz, load, 400, 60)
    theta = 2 * np.pi * np.arange(400) / 400
    drive = joint.model.port("drive")
    first = 2j / 400 * np.exp(-1j * theta) @ found.output[:-1, drive]
    point = solved(joint, hertz, load, harmonics=15)
    print(f"amplitude {abs(point.output[1, drive] / first - 1):.1e}")
    print(f"dissipation {point.dissipated / found.friction_work.sum() - 1:.1e}")
    assert (found.status == SLIP).any()
    assert (point.status == SLIP).any()
    v = by_pair(found.v, 3)[..., 1:]
    areas = np.abs(np.einsum("ki,ki->i", v[:-1, :, 0], np.diff(v[..., 1], axis=0)))
    spans = np.ptp(v, axis=0).prod(axis=1)
    assert (areas > 0.1 * spans).any()
    assert abs(point.output[1, drive] / first - 1) <= 5e-3
    assert point.dissipated == pytest.approx(found.friction_work.sum(), rel=5e-3)


def test_energy_balances():
    """Work of the load is friction, material damping, and normal work, which truncation leaves over."""
    point = solved(block(2), 0.25, 2.0, harmonics=9)
    lost = point.dissipated + point.material_work + point.normal_work
    assert point.dissipated > 0.1 * lost
    assert point.external_work == pytest.approx(lost, rel=1e-7)


@pytest.mark.parametrize(("friction", "name"), [(50.0, "stuck_omega"), (0.0, "sliding_omega")])
def test_linear_limits_of_the_exponents(small_reference, friction, name):
    """A stuck or frictionless joint: -zeta omega_n ± i (omega_n - omega)."""
    joint = spatial_joint(small_reference.joint, ANGLE).with_friction(friction)
    natural = getattr(small_reference.joint.mode, name)
    hertz, load = natural / (2 * np.pi) - 0.4, 1e-7 * small_reference.moment
    problem = harmonic_problem(joint, harmonics=2)
    w, _ = raise_load(problem, hertz, load)
    found = hill_exponents(problem, hertz, load, w, count=4)
    expected = -0.5 * joint.model.rayleigh[1] * natural**2 + 1j * 0.4 * 2 * np.pi
    nearest = found.exponents[np.argmin(np.abs(found.exponents - expected))]
    assert nearest == pytest.approx(expected, rel=1e-3)


def test_backbone_of_the_planar_joint_turned():
    flat = build_reference(21, modes=40).joint
    flat = replace(flat, model=replace(flat.model, image=None))
    found = []
    for joint in (flat, spatial_joint(flat, ANGLE)):
        mode = joint_modes(joint.model, joint.prestress, joint.law)[0]
        sizes = np.array([0.05, 0.3, 0.8]) * amplitude_scale(joint, mode)
        backbone, failures = harmonic_backbone(joint, mode, sizes, harmonics=3)
        assert not failures
        found.append(backbone)
    one, other = found
    assert other.frequency == pytest.approx(one.frequency, rel=SAME)
    assert other.damping_ratio == pytest.approx(one.damping_ratio, rel=1e-6)


def test_augmentation_must_be_one_along_the_interface():
    joint = block()
    stiffness = np.ones(3 * joint.model.pairs)
    stiffness[1] = 2.0
    with pytest.raises(MicroslipError, match="one for the tangential directions"):
        harmonic_problem(joint, stiffness=stiffness)


@pytest.mark.validate
def test_answer_forgets_the_augmentation():
    """With more harmonics another augmentation gives the same response: it falls by half at least."""
    joint, apart = block(2), []
    for harmonics in (3, 9, 27):
        usual = harmonic_problem(joint, harmonics=harmonics).stiffness
        a, b = (
            solved(joint, 0.25, 2.0, harmonics, stiffness=factor * usual).output[1, 1]
            for factor in (1.0, 0.3)
        )
        apart.append(abs(a / b - 1))
    assert apart[1] < 0.5 * apart[0]
    assert apart[2] < 0.5 * apart[1]


@pytest.mark.validate
@pytest.mark.parametrize("seed", [131, 177, 192])
def test_load_is_raised_past_corners_of_a_walk_that_supports_stop(seed):
    """Where the branch from rest goes no further: a response under the whole load, whose energy balances."""
    rng = np.random.default_rng(1000 + seed)
    pairs, friction, modes = (
        int(rng.integers(3, 11)),
        rng.uniform(0.1, 0.8),
        int(rng.integers(2, 6)),
    )
    model = block(seed, pairs, modes).model
    law = contact_law(pairs, friction, None, 3)
    joint = prepare_joint(model, law, {"press": 1.0}, "drive")
    harmonics, hertz = int(rng.choice([3, 5, 9, 15])), rng.uniform(0.1, 0.5)
    load = float(friction * pairs * rng.uniform(0.3, 3))
    usual = harmonic_problem(joint, harmonics=harmonics).stiffness
    point = solved(joint, hertz, load, harmonics, stiffness=float(rng.choice([1.0, 0.3])) * usual)
    lost = point.dissipated + point.material_work + point.normal_work
    assert point.residual <= 1e-8
    assert point.dissipated > 0.1 * lost
    assert point.external_work == pytest.approx(lost, rel=1e-6)


def free_block(pushed=0.0):
    """The block with motions of the whole that nothing holds, one of them driven, and the driving of it."""
    joint, along = block(2), np.array([[0.0, 0.7], [pushed, 0.0]])
    model = joint.model
    free = replace(
        model,
        omega=np.concatenate([[0.0, 0.0], model.omega]),
        equilibrium_modes=model.equilibrium_modes + 2,
        mode_v=np.hstack([np.zeros((len(model.mode_v), 2)), model.mode_v]),
        port_modes=np.vstack([along, model.port_modes]),
    )
    held = joint.prestress
    solution = replace(held.solution, q=np.concatenate([[0.0, 0.0], held.solution.q]))
    return joint, replace(joint, model=free, prestress=replace(held, solution=solution))


def test_free_joint_has_the_inertia_of_the_whole():
    """Its contact feels nothing of it; g²/(i omega alpha - omega²) is added to its first harmonic alone."""
    joint, free = free_block()
    hertz, load = 0.25, 1.0
    held, loose = (solved(each, hertz, load, 3) for each in (joint, free))
    assert (held.status == SLIP).any()
    assert np.abs(loose.r - held.r).max() <= SAME * np.abs(held.r).max()
    omega = 2 * np.pi * hertz
    expected = np.zeros(4, dtype=complex)
    expected[1] = 0.7**2 * load / (1j * omega * joint.model.rayleigh[0] - omega**2)
    assert loose.output[:, 1] - held.output[:, 1] == pytest.approx(expected, abs=1e-8)
    point = LoadPath(loose.problem, hertz, load)
    assert exponents_of(loose).stable == exponents_of(held).stable
    assert point.problem.size == loose.w.size


def test_free_joint_that_is_pushed_is_refused():
    with pytest.raises(MicroslipError, match="its preload pushes it"):
        harmonic_problem(free_block(0.1)[1], harmonics=3)

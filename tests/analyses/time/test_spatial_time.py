"""Time integration with spatial contact: planar joints turned, rotations, derivatives, a slider by hand."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from scipy.integrate import solve_ivp
from spatial_twin import lift, spatial_joint

from microslip.analyses.prepared.joint import PreparedJoint, prepare_joint
from microslip.analyses.time.deviations import StateSpace
from microslip.analyses.time.energy import mechanical_energy
from microslip.analyses.time.floquet import floquet_multipliers
from microslip.analyses.time.history import Recording, run_history
from microslip.analyses.time.scheme import March, march, prestressed_state, time_scheme
from microslip.analyses.time.steady import CONFIRMED, steady_state, walk_of
from microslip.contact.law import contact_law
from microslip.contact.pairs import BACKWARD, SEPARATED, SLIP, STICK
from microslip.model.joint import JointModel

STEPS = 100


def rubbing_block(
    seed: int, pairs: int = 4, modes: int = 6, push: float = 0.4, drive: float = 1.0
) -> PreparedJoint:
    """Modes of a few Hz that move all pairs in both directions, pressed together, driven at all of them.

    Normal displacements of the modes are `push` of the tangential ones.
    """
    rng = np.random.default_rng(seed)
    shapes = rng.standard_normal((pairs, 3, modes))
    shapes[:, 0] *= push
    A = rng.standard_normal((3 * pairs, 3 * pairs))
    residual = 0.05 * A @ A.T / (3 * pairs) + 0.02 * np.eye(3 * pairs)
    pressed = np.zeros(3 * pairs)
    pressed[::3] = 1.0
    mode_v = shapes.reshape(3 * pairs, modes)
    model = JointModel(
        position=np.arange(pairs, dtype=float),
        area=np.ones(pairs),
        dimension=3,
        omega=np.sort(rng.uniform(4, 20, modes)),
        equilibrium_modes=0,
        mode_v=mode_v,
        residual=residual,
        ports=("press", "drive"),
        port_modes=np.column_stack([mode_v.T @ pressed, drive * np.ones(modes)]),
        port_v=np.column_stack([residual @ pressed, np.zeros(3 * pairs)]),
        port_port=np.diag([pressed @ residual @ pressed, 0.0]),
        rayleigh=(0.3, 0.0),
    )
    law = contact_law(pairs, np.linspace(0.2, 0.5, pairs), None, 3)
    return prepare_joint(model, law, {"press": 3.0}, "drive")


def turned(joint: PreparedJoint, seed: int) -> PreparedJoint:
    """The same joint with the tangential axes of every pair turned by an angle of its own."""
    model = joint.model
    Q = np.eye(3 * model.pairs)
    for i, a in enumerate(np.random.default_rng(seed).uniform(0, 2 * np.pi, model.pairs)):
        t = slice(3 * i + 1, 3 * i + 3)
        Q[t, t] = [[np.cos(a), np.sin(a)], [-np.sin(a), np.cos(a)]]
    other = replace(
        model, mode_v=Q @ model.mode_v, residual=Q @ model.residual @ Q.T, port_v=Q @ model.port_v
    )
    return prepare_joint(other, joint.law, joint.prestress.preload, joint.drive)


def wave(frequency: float, load: float, cycles: int = 1) -> np.ndarray:
    return load * np.sin(2 * np.pi * np.arange(cycles * STEPS + 1) / STEPS)


@pytest.fixture(scope="module")
def rubbing():
    """Scheme and steady state of a block whose slip turns."""
    joint = rubbing_block(3)
    scheme = time_scheme(joint, 1 / (1.1 * STEPS), frequency=1.1)
    steady = steady_state(scheme, 1.1, 4.0, tolerance=1e-8, max_cycles=300)
    assert steady.converged
    return scheme, steady


@pytest.mark.parametrize("ratio", [1e-4, 4e-4])
def test_steady_state_and_multipliers_are_those_of_the_planar_joint(small_reference, ratio):
    """The reference joint turned out of its plane, mostly stuck and in wide slip.

    Two searches end as far apart as their tolerance allows, ``change / (1 - |mu|)``; from the same state
    the cycles are the same.
    """
    joint, load = small_reference.joint, ratio * small_reference.moment
    frequency = small_reference.states.sliding_omega / (2 * np.pi) + 2
    found = []
    for one in (joint, spatial_joint(joint, 0.7)):
        scheme = time_scheme(one, 1 / (frequency * STEPS), frequency=frequency)
        steady = steady_state(scheme, frequency, load, tolerance=1e-6)
        assert steady.converged
        multipliers = floquet_multipliers(scheme, steady, count=4)
        found.append((scheme, steady, multipliers, walk_of(steady, scheme.joint.model.dimension)))
    (_, flat, stable, walk), (scheme, spatial, same, length) = found
    assert (spatial.cycle.status == SLIP).any()
    apart = 2 * CONFIRMED * 1e-6 / (1 - stable.largest)
    assert abs(spatial.amplitude - flat.amplitude) <= apart * abs(flat.amplitude)
    assert same.largest == pytest.approx(stable.largest, abs=1e-3)
    assert length == pytest.approx(abs(walk), abs=1e-4)
    state = flat.cycle.state
    E = lift(len(state.status), 0.7)
    lifted = replace(
        prestressed_state(scheme),
        eta=state.eta,
        rate=state.rate,
        acceleration=state.acceleration,
        taken=state.taken,
        status=np.where(state.status == BACKWARD, SLIP, state.status).astype(np.int8),
        **{name: E @ getattr(state, name) for name in ("residual_v", "residual_before", "r", "v")},
    )
    one = march(found[0][0], state, flat.cycle.load)
    two = march(scheme, lifted, flat.cycle.load)
    assert np.abs(two.output - one.output).max() <= 1e-8 * np.abs(one.output).max()
    assert two.dissipated == pytest.approx(one.dissipated, rel=1e-7)


def test_axes_of_the_pairs_do_not_matter(rubbing):
    """Tangential axes of every pair turned about its normal."""
    scheme, steady = rubbing
    other = time_scheme(turned(scheme.joint, 1), scheme.dt, frequency=steady.frequency)
    again = steady_state(other, steady.frequency, steady.load, tolerance=1e-8, max_cycles=300)
    assert abs(again.amplitude - steady.amplitude) <= 1e-6 * abs(steady.amplitude)
    load = wave(steady.frequency, steady.load, 3)
    one = march(scheme, prestressed_state(scheme), load)
    two = march(other, prestressed_state(other), load)
    assert np.abs(two.output - one.output).max() <= 1e-8 * np.abs(one.output).max()
    assert two.dissipated == pytest.approx(one.dissipated, rel=1e-8)


def test_energy_of_a_steady_cycle(rubbing):
    """The work of the load is what friction, material and closing pairs take."""
    _, steady = rubbing
    cycle = steady.cycle
    lost = cycle.dissipated + cycle.modal_damping + cycle.residual_damping + cycle.normal_work
    assert cycle.dissipated > 0.1 * cycle.external
    assert cycle.external == pytest.approx(lost, rel=1e-6)


def deviated(state, vector, space, size):
    return space.state(space.vector(state) + size * vector, state)


@pytest.mark.parametrize(("seed", "push", "load"), [(3, 0.0, 4.0), (5, 0.4, 6.0), (12, 1.5, 25.0)])
def test_deviations_are_limits_of_differences(seed, push, load):
    """Slip that turns, without and with motion across the interface, and pairs that open and close."""
    joint = rubbing_block(seed, push=push)
    scheme = time_scheme(joint, 1 / (1.1 * STEPS), frequency=1.1)
    space = StateSpace(scheme, 2 * np.pi * 1.1)
    begin = march(scheme, prestressed_state(scheme), wave(1.1, load)).state
    forced = wave(1.1, load, 2)[STEPS : STEPS + 60]
    base = march(scheme, begin, forced, keep=True)
    states = set(np.unique(base.status))
    assert {SLIP, STICK} <= states
    assert push < 1 or SEPARATED in states
    tangents = space.deviations(())
    found = space.vector(march(scheme, begin, forced, tangents=tangents).tangents)
    compared = 0
    for row, vector in zip(found, space.vector(tangents), strict=True):
        size = 1e-7 * np.abs(space.vector(begin)).max() / np.abs(vector).max()
        ends = [
            march(scheme, deviated(begin, vector, space, s), forced, keep=True)
            for s in (size, -size)
        ]
        if any(not np.array_equal(end.status, base.status) for end in ends):
            continue
        compared += 1
        wanted = (space.vector(ends[0].state) - space.vector(ends[1].state)) / (2 * size)
        assert np.abs(row - wanted).max() <= 1e-5 * np.abs(wanted).max()
    assert compared >= 3


def test_multipliers_are_eigenvalues_of_the_period_map(rubbing):
    """Of its derivative taken by differences, along the directions that Arnoldi's method finds slowest."""
    scheme, steady = rubbing
    found = floquet_multipliers(scheme, steady, count=4, max_cycles=40)
    assert found.residual[found.vibration][0] < 1e-3
    space = StateSpace(scheme, 2 * np.pi * steady.frequency)
    state, load = steady.cycle.state, steady.cycle.load
    rng = np.random.default_rng(0)
    push = rng.standard_normal(len(state.rate))
    size = 1e-6 * np.linalg.norm(state.rate)
    one = state
    other = replace(state, rate=state.rate + size * push / np.linalg.norm(push))
    apart = []
    for _ in range(40):
        one, other = march(scheme, one, load).state, march(scheme, other, load).state
        apart.append(np.linalg.norm(space.vibration(space.vector(other) - space.vector(one))))
    falls = (apart[-1] / apart[-21]) ** (1 / 20)
    assert falls == pytest.approx(found.largest, abs=0.03)
    assert found.verdict == "stable"


def slider(stiffness: float, alpha: float = 0.9) -> PreparedJoint:
    """A mass on springs of two lengths, rubbing through a spring on a plane, pushed across both."""
    model = JointModel(
        position=np.zeros(1),
        area=np.ones(1),
        dimension=3,
        omega=np.array([5.0, 8.0]),
        equilibrium_modes=0,
        mode_v=np.array([[0.0, 0.0], [1.0, 0.0], [0.0, 1.0]]),
        residual=np.diag([0.1, 1 / stiffness, 1 / stiffness]),
        ports=("press", "drive"),
        port_modes=np.array([[0.0, np.cos(alpha)], [0.0, np.sin(alpha)]]),
        port_v=np.array([[0.1, 0.0], [0.0, 0.0], [0.0, 0.0]]),
        port_port=np.diag([0.1, 0.0]),
        rayleigh=(0.2, 0.0),
    )
    return prepare_joint(model, contact_law(1, 0.4, None, 3), {"press": 1.0}, "drive")


BOUND = 0.4
"""Friction limit of the slider, N."""


def by_rates(stiffness: float, rates, velocity, z: np.ndarray, end: float) -> np.ndarray:
    """States ``z' = rates(t, z, r)`` and the force r of an elastic slider moved at ``velocity(t, z)``.

    Its rate equations, switched at their events: ``r' = k v`` where it sticks, and at the limit
    ``r' = k (v - r (r v)/r²)`` as long as ``r v > 0``.
    """
    own = len(z)

    def law(slips):
        def f(t, y):
            r = y[own:]
            grows = stiffness * velocity(t, y[:own])
            if slips:
                grows = grows - r * (r @ grows) / (r @ r)
            return np.concatenate([rates(t, y[:own], r), grows])

        return f

    def reaches(t, y):
        return y[own:] @ y[own:] - BOUND**2

    def stops(t, y):
        return y[own:] @ velocity(t, y[:own])

    reaches.terminal, reaches.direction = True, 1
    stops.terminal, stops.direction = True, -1
    t, y, slips = 0.0, np.concatenate([z, np.zeros(2)]), False
    while t < end:
        found = solve_ivp(
            law(slips),
            (t, end),
            y,
            method="DOP853",
            rtol=1e-11,
            atol=1e-13,
            events=stops if slips else reaches,
        )
        t, y = found.t[-1], found.y[:, -1]
        slips = not slips
    return y


def slider_by_rates(stiffness: float, load, end: float, alpha: float = 0.9) -> np.ndarray:
    """Position of the mass of `slider`, by rate equations."""
    push, omega = np.array([np.cos(alpha), np.sin(alpha)]), np.array([5.0, 8.0])

    def rates(t, z, r):
        x, v = z[:2], z[2:]
        return np.concatenate([v, push * load(t) - 0.2 * v - omega**2 * x - r])

    return by_rates(stiffness, rates, lambda t, z: z[2:], np.zeros(4), end)[:2]


def turned_through(found: March) -> np.ndarray:
    """Directions of the slip of one pair where it slips, unwrapped, rad."""
    slip = np.diff(found.v[:, 1:], axis=0)[found.status[1:, 0] == SLIP]
    return np.unwrap(np.arctan2(*slip.T[::-1]))


def rates_are_met(load, end: float, turns) -> None:
    """A mass that sticks, slips and turns: errors fall with the step, in proportion or faster."""
    joint, exact = slider(100.0), slider_by_rates(100.0, load, end)
    errors = []
    for steps in (2000, 4000, 8000):
        scheme = time_scheme(joint, end / steps)
        found = march(
            scheme, prestressed_state(scheme), load(scheme.dt * np.arange(steps + 1)), keep=True
        )
        assert {STICK, SLIP} <= set(np.unique(found.status))
        assert turns(turned_through(found))
        errors.append(np.abs(found.state.eta - exact).max() / np.abs(found.v[:, 1:]).max())
    assert errors[2] <= 0.6 * errors[1] <= 0.36 * errors[0]
    assert errors[2] <= 1e-3


def test_slider_on_a_turning_path_against_rate_equations():
    """A mass that goes round."""

    def load(t):
        return 6.0 * np.sin(4.0 * t) * np.cos(0.3 * t)

    rates_are_met(load, 4.0, lambda angle: np.ptp(angle) > 2)


def test_mass_on_a_figure_of_eight_against_rate_equations():
    """Loads of two frequencies, one near each spring's own: it goes round one way, then the other."""

    def load(t):
        return 5.0 * np.sin(4.5 * t) + 9.0 * np.sin(9.0 * t)

    def both_ways(angle):
        turn = np.diff(angle)
        return turn[turn > 0].sum() > 1 and turn[turn < 0].sum() < -1

    rates_are_met(load, 4.2, both_ways)


HEAVY = 1e-6
"""Displacement of the slider per amplitude of a mass so heavy that its friction does not slow it."""


@pytest.mark.parametrize("size", [1.5, 6.0])
def test_slider_led_along_a_figure_of_eight(size):
    """Two heavy masses swing along ``(sin t, sin 2t)``, exactly in every step; their slider sticks, slips and
    turns both ways. Its force against its rate equations: of first order, and 1e-6 extrapolated."""
    stiffness, end = 50.0, 4 * np.pi
    reach = size * BOUND / stiffness
    model = replace(
        slider(stiffness).model,
        omega=np.array([1.0, 2.0]),
        mode_v=HEAVY * slider(stiffness).model.mode_v,
        port_modes=np.zeros((2, 2)),
        rayleigh=(0.0, 0.0),
    )
    joint = prepare_joint(model, contact_law(1, BOUND, None, 3), {"press": 1.0}, "drive")

    def velocity(t, z):
        return reach * np.array([np.cos(t), 2 * np.cos(2 * t)])

    exact = by_rates(stiffness, lambda t, z, r: np.zeros(0), velocity, np.zeros(0), end)
    forces = []
    for steps in (4000, 8000, 16000):
        scheme = time_scheme(joint, end / steps)
        own = scheme.dt / scheme.kernel.mode_step
        start = replace(prestressed_state(scheme), rate=own * reach / HEAVY * model.omega)
        found = march(scheme, start, np.zeros(steps + 1), keep=True)
        assert {STICK, SLIP} <= set(np.unique(found.status))
        assert np.abs(HEAVY * found.state.eta).max() <= 1e-9 * reach
        turn = np.diff(turned_through(found))
        assert turn[turn > 0].sum() > 1
        assert turn[turn < 0].sum() < -1
        forces.append(found.r[-1, 1:])
    coarse, fine, finest = forces
    errors = [np.linalg.norm(r - exact) for r in forces]
    assert errors[2] <= 0.6 * errors[1] <= 0.36 * errors[0]
    once = 2 * fine - coarse, 2 * finest - fine
    limit = once[1] + (once[1] - once[0]) / 3
    assert np.linalg.norm(limit - exact) <= 1e-6 * BOUND


def test_history_of_spatial_pairs(rubbing):
    """Slip in two directions at the watched pairs; energies balance."""
    joint = rubbing[0].joint
    scheme = time_scheme(joint, rubbing[0].dt)
    watched, kept = np.array([0, 2]), np.arange(0, 301, 100)
    what = Recording("shake", "sine", "drive", watched, kept, STEPS)
    found = run_history(scheme, prestressed_state(scheme), wave(1.1, 3.0, 3), what)
    assert not found.failure
    assert found.complete
    assert found.slip.shape == (301, 2, 2)
    assert found.gap.shape == (301, 2)
    assert found.r.shape == (4, 12)
    e = found.energies
    gained = mechanical_energy(
        scheme, march(scheme, prestressed_state(scheme), found.load).state, 0.0
    )
    gained -= mechanical_energy(scheme, prestressed_state(scheme), 0.0)
    assert e.mechanical[-1] == pytest.approx(gained, rel=1e-6)
    assert np.abs(e.scheme).max() <= 1e-9 * np.abs(e.external).max()
    assert np.abs(found.slip[:, :, 1]).max() > 0

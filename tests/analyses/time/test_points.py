"""What is read off steady states, against linear theory and the balance of energy."""

from __future__ import annotations

import tomllib
from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest
import scipy.sparse.linalg as spla
from conftest import FRICTION

from microslip.analyses.time import poles
from microslip.analyses.time.point import Request
from microslip.analyses.time.points import solve_request, steady_states
from microslip.analyses.time.readings import (
    equivalent,
    harmonics_of,
    modal_force,
    opening_of,
    phases,
)
from microslip.analyses.time.scheme import time_scheme
from microslip.analyses.time.steady import thinned
from microslip.contact.pairs import normal_rows
from microslip.describe.reading import parse_joint
from microslip.errors import JointOpensError
from microslip.model.modes import bonding
from microslip.pipeline.prepare import assemble

STEPS = 150


def solved(reference, frequency, ratio, **options):
    """Steady state under an end moment over P L."""
    friction, guess = options.pop("friction", FRICTION), complex(options.pop("guess", 0.0))
    request = Request(0.0, frequency, ratio * reference.moment, friction, guess, STEPS, **options)
    return solve_request(reference.joint, request)


def equivalent_at(point, reference):
    return equivalent(point.steady, reference.joint)


def direct(reference, directions, frequency):
    """First harmonic of q per end moment of the full linear mesh, prestressed pairs bonded."""
    s, w = reference.structure, 2 * np.pi * frequency
    basis = bonding(s.interface.relative, reference.start.bonded(directions))
    stiffness, mass = basis.T @ s.stiffness @ basis, basis.T @ s.mass @ basis
    dynamic = (-(w**2) * mass + (1 + 1j * w * reference.model.rayleigh[1]) * stiffness).tocsc()
    force = (basis.T @ s.loads["moment"]).astype(complex)
    return (basis.T @ (s.mass @ reference.states.sliding)) @ spla.spsolve(dynamic, force)


def test_no_contact_force_without_friction(small_reference):
    """The sliding state is the linear part: what is left is a tenth of (omega dt)²/6, the error of
    steps whose poles are those of the modes and whose forces are not matched at the load."""
    frequency = small_reference.joint.mode.sliding_frequency + 1
    load = 3e-5 / abs(direct(small_reference, 1, frequency)) / small_reference.moment
    point = solved(small_reference, frequency, load, friction=0.0, tolerance=1e-7)
    found = equivalent_at(point, small_reference)
    of_the_step = (2 * np.pi / STEPS) ** 2 / 6
    print(f"kappa {found.k_eq:.1e} + {found.gamma_eq:.1e}i, step {of_the_step:.1e}")
    assert abs(found.k_eq + 1j * found.gamma_eq) < 0.1 * of_the_step


def test_everything_sticks_at_vanishing_load(small_reference):
    """Contact force of the linear stuck joint, from a direct solution of the full mesh."""
    mode = small_reference.joint.mode
    frequency = mode.stuck_frequency - 1
    guess = 1e-8 * small_reference.moment * direct(small_reference, 2, frequency)
    point = solved(small_reference, frequency, 1e-8, guess=guess, tolerance=1e-7)
    assert point.steady.converged
    Q = direct(small_reference, 2, frequency)
    w, w2 = 2 * np.pi * frequency, mode.sliding_omega**2
    linear = w2 - w**2 + 1j * w * small_reference.model.rayleigh[1] * w2
    expected = (mode.load_on_sliding["moment"] - linear * Q) / (w2 * Q)
    found = equivalent_at(point, small_reference)
    print(f"{found.k_eq:.6f} + {found.gamma_eq:.2e}i, direct {expected:.6f}")
    assert abs(found.k_eq + 1j * found.gamma_eq - expected) < 1e-3 * abs(expected)


@pytest.fixture(scope="module", params=[1e-4, 3e-4])
def point(request, small_reference):
    frequency = small_reference.joint.mode.sliding_frequency + 2
    return solved(small_reference, frequency, request.param, tolerance=1e-6)


def own_damping(point, reference, count):
    """Material damping of the sliding coordinate, sum of pi c omega h² |Q_h|²."""
    theta = phases(point.steady)
    q = point.steady.cycle.output[:, reference.model.port("sliding")]
    Q = harmonics_of(q, theta, count)[1:]
    order = np.arange(1, count + 1)
    w = 2 * np.pi * point.steady.frequency * order
    c = reference.model.rayleigh[1] * reference.states.sliding_omega**2
    return float(np.pi * np.sum(order * w * c * np.abs(Q) ** 2))


def work_through_sliding(point, mode):
    """Work of the end moment on the sliding coordinate, ``-pi f_M M Im Q``."""
    push = mode.load_on_sliding["moment"] * point.steady.load
    return -np.pi * push * point.steady.amplitude.imag


def test_loop_is_what_friction_takes(point, small_reference):
    """Loop + damping of the sliding coordinate + work past it = all that is lost in a cycle."""
    mode = small_reference.joint.mode
    found = equivalent_at(point, small_reference)
    c = point.steady.cycle
    lost = c.dissipated + c.modal_damping + c.residual_damping + c.normal_work
    own = own_damping(point, small_reference, 1)
    past = c.external - work_through_sliding(point, mode)
    print(
        f"loop {found.loop:.5g}, friction {c.dissipated:.5g}, material {c.modal_damping:.3g} of "
        f"which sliding {own:.3g}, work past the sliding coordinate {past:.3g}"
    )
    assert found.loop == pytest.approx(lost - own - past, rel=2e-3)
    assert found.loop == pytest.approx(c.dissipated, rel=0.03)
    assert found.stored == pytest.approx(
        0.5 * abs(point.steady.amplitude) ** 2 * found.k_eq * mode.sliding_omega**2
    )


def test_modal_force_is_the_equation_of_motion(point, small_reference):
    """Area of the sampled loop; its first harmonic is the equivalent force."""
    joint = small_reference.joint
    f = modal_force(point.steady, joint, 15)
    q = point.steady.cycle.output[:, joint.model.port("sliding")]
    area = np.sum(0.5 * (f[1:] + f[:-1]) * np.diff(q))
    expected = work_through_sliding(point, joint.mode) - own_damping(point, small_reference, 15)
    assert area == pytest.approx(expected, rel=2e-3)
    theta = phases(point.steady)
    kappa = (
        harmonics_of(f, theta, 1)[1] / harmonics_of(q, theta, 1)[1] / joint.mode.sliding_omega**2
    )
    found = equivalent_at(point, small_reference)
    assert kappa == pytest.approx(found.k_eq + 1j * found.gamma_eq, rel=1e-9)


def test_harmonics_rebuild_the_wave():
    theta = 0.7 + 2 * np.pi * np.arange(41) / 40
    y = 3 + 2 * np.sin(theta) - 0.5 * np.cos(3 * theta)
    found = harmonics_of(y, theta, 4)
    assert found == pytest.approx(np.array([3, 2, 0, -0.5j, 0]), abs=1e-12)


def test_stability_is_found_out_of_what_settled(small_reference):
    frequency = small_reference.joint.mode.sliding_frequency + 2
    found = solved(small_reference, frequency, 1e-4)
    assert found.stability.verdict == found.verdict == "stable"
    assert found.settled
    assert 0 < found.error < 1e-3
    early = solved(small_reference, frequency, 1e-4, max_cycles=3, classify=False)
    assert early.stability is None
    assert not early.settled
    assert solved(small_reference, frequency, 1e-4, stability=False).verdict == ""


# -- opening -----------------------------------------------------------------------------------


def march_of(status, normal):
    """As much of a march as the search for an opening reads."""
    status, normal = np.array(status, np.int8), np.array(normal, float)
    r = np.zeros((len(status), 2 * status.shape[1]))
    r[:, normal_rows()] = normal
    time = 0.5 * np.arange(len(status))
    return SimpleNamespace(status=status, r=r, time=time, load=10 * time)


X = np.array([-0.1, 0.0, 0.2])


def test_opening_names_time_and_the_last_pair():
    part = march_of(
        [[1, 2, 1], [4, 2, 1], [4, 4, 4], [1, 4, 4]], [[9, 9, 9], [0, 3, 7], [0] * 3, [5, 0, 0]]
    )
    message = opening_of(part, X, start=100.0)
    assert "opens at t = 101 s under load 10" in message
    assert "the last pair to separate is 2 at x = 0.2 m, which carried 7 N/m" in message


def test_opening_at_the_start_and_none_at_all():
    assert "no pair touches" in opening_of(march_of([[4, 4, 4], [1, 1, 1]], np.zeros((2, 3))), X)
    assert opening_of(march_of([[4, 4, 1], [1, 4, 4]], np.zeros((2, 3))), X) == ""


def test_resonance_that_opens_the_joint(small_reference):
    """Four times the moment that opens the joint when still."""
    frequency = small_reference.joint.mode.sliding_frequency - 20
    with pytest.raises(JointOpensError, match=r"opens at t = .* the last pair to separate is \d+"):
        solved(small_reference, frequency, 0.6, max_cycles=4)


def test_failed_and_unsteady_points_are_told_apart(small_reference):
    """One that opens the joint, one that is not steady in time, one that is."""
    f = small_reference.joint.mode.sliding_frequency + 3
    requests = [
        Request(1.0, f - 23, 0.6 * small_reference.moment, 0.25, 0.0, STEPS, 1e-5, 4),
        Request(2.0, f, 1e-4 * small_reference.moment, 0.25, 0.0, STEPS, 1e-5, 3, classify=False),
        Request(3.0, f, 1e-4 * small_reference.moment, 0.25, 0.0, STEPS, 1e-4),
    ]
    opened, early, steady = steady_states(small_reference.joint, requests)
    assert str(opened).startswith(f"time, rho = 1, {f - 23:g} Hz: the joint opens at t = ")
    assert not early.steady.converged
    assert early.steady.change > 1e-4
    assert steady.steady.converged


def test_modes_beyond_the_step_keep_their_inertia(small_reference):
    """A stuck joint in twenty steps per cycle: most modes act at once, with the inertia of one frequency.

    Left out, their inertia would be missed by up to ``(Omega/omega)²`` of what they give. What is left is the
    lag of their damping, stepped backward: Omega tau Omega dt/2.
    """
    joint = small_reference.joint
    frequency = 1.15 * joint.mode.stuck_frequency
    load = 1e-7 * small_reference.moment
    exact = load * direct(small_reference, 2, frequency)
    request = Request(0.0, frequency, load, 1e3, 0j, 20, tolerance=1e-8)
    found = solve_request(joint, request).steady.amplitude
    scheme = time_scheme(joint, 1 / (20 * frequency), frequency=frequency)
    cut = joint.model.omega[len(scheme.joint.model.omega)]
    missed = (2 * np.pi * frequency / cut) ** 2
    lag = np.pi / 20 * 2 * np.pi * frequency * joint.model.rayleigh[1]
    print(f"missed {missed:.1e}, error {abs(found / exact - 1):.1e}, of the lag {lag:.1e}")
    assert lag < 0.1 * missed
    assert abs(found / exact - 1) < lag


def test_a_motion_that_settles_while_it_is_looked_at(small_reference, monkeypatch):
    """A march that is stopped early; what it is, is periodic after the cycles that are marched to say so."""
    frequency = small_reference.joint.mode.sliding_frequency + 2
    found = solved(small_reference, frequency, 2e-4)
    early = {"max_cycles": 3, "accelerate": False}
    assert solved(small_reference, frequency, 2e-4, **early).motion.kind == "periodic"
    monkeypatch.setattr("microslip.analyses.time.point.LOOKED", 3)
    later = solved(small_reference, frequency, 2e-4, **early)
    assert later.settled
    assert later.motion is None
    assert later.steady.amplitude == pytest.approx(found.steady.amplitude, rel=1e-3)


def test_a_march_is_thinned_to_every_so_manieth_sample(small_reference):
    frequency = small_reference.joint.mode.sliding_frequency + 2
    cycle = solved(small_reference, frequency, 2e-4, stability=False).steady.cycle
    few = thinned(cycle, 3)
    assert (few.output == cycle.output[::3]).all()
    assert (few.status == cycle.status[::3]).all()
    assert len(few.time) == len(few.residual) == STEPS // 3 + 1
    assert few.residual.max() == cycle.residual.max()
    assert few.dissipated == cycle.dissipated


SHAKEN = """
[beams]
length = "0.464212 m"
thickness = "0.0126366 m"
overlap_half_length = "0.16988 m"
[material]
youngs_modulus = "1.1e+11 Pa"
poissons_ratio = 0.2352
density = "4430 kg/m^3"
[contact]
friction = 0.52909
pairs = 41
[clamp]
force = "134145 N/m"
half_length = "0.155945 m"
[support]
horizontal_spring = "8.34296e+07 N/m/m"
[damping]
beta = "1.5541e-07 s"
[load]
moment_over_clamp_force_length = [0.00180922]
"""


def test_reactions_that_alternate_do_not_shake_a_stable_motion():
    """A joint of little damping: stable in 150 steps as in 1,200, to an amplitude within half a per cent."""
    assembly = assemble(parse_joint(tomllib.loads(SHAKEN)))
    load = assembly.joint.load.moment_over_clamp_force_length[0] * assembly.moment_unit
    request = Request(float("nan"), 118.43, load, None, 0j, STEPS, finer=False, classify=False)
    coarse = solve_request(assembly.prepared, request)
    fine = solve_request(assembly.prepared, replace(request, steps=8 * STEPS))
    print(f"{coarse.stability.largest:.3f} in 150 steps, {fine.stability.largest:.3f} in 1,200")
    assert coarse.verdict == fine.verdict == "stable"
    assert coarse.steady.amplitude == pytest.approx(fine.steady.amplitude, rel=5e-3)


def test_steps_that_shake_a_stable_motion_are_made_shorter(monkeypatch):
    """The same joint without the damping of what alternates, which is unstable with 150 steps and with 300.

    It is found as if the finest had been asked for from the start; a multiplier far inside the circle.
    """
    monkeypatch.setattr(poles, "ALTERNATING", 0.0)
    assembly = assemble(parse_joint(tomllib.loads(SHAKEN)))
    joint, frequency = assembly.prepared, 118.43
    load = assembly.joint.load.moment_over_clamp_force_length[0] * assembly.moment_unit
    request = Request(float("nan"), frequency, load, None, 0j, STEPS)
    coarse = solve_request(joint, replace(request, finer=False, classify=False)).left
    assert coarse is not None
    assert coarse.verdict == "unstable"
    found = solve_request(joint, request)
    fine = solve_request(joint, replace(request, steps=8 * STEPS))
    print(
        f"{coarse.stability.largest:.3f} in 150 steps, {found.stability.largest:.3f} in {found.steps}"
    )
    assert found.verdict == fine.verdict == "stable"
    assert found.steps > STEPS
    assert len(found.steady.cycle.time) == STEPS + 1
    assert found.steady.amplitude == pytest.approx(fine.steady.amplitude, rel=1e-3)

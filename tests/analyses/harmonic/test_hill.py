"""Exponents of harmonic-balance responses: linear limits, folds, decay in the time domain."""

from __future__ import annotations

import numpy as np
import pytest

from microslip.analyses.harmonic.hill import hill_exponents
from microslip.analyses.harmonic.problem import harmonic_problem
from microslip.analyses.harmonic.raising import follow_frequency, raise_load
from microslip.analyses.time.scheme import march, time_scheme
from microslip.analyses.time.steady import steady_state
from microslip.model.modes import linear_modes


@pytest.mark.parametrize(("friction", "name"), [(50.0, "stuck_omega"), (0.0, "sliding_omega")])
@pytest.mark.parametrize("half_turn", [True, False])
def test_linear_limits(small_reference, friction, name, half_turn):
    """A stuck or frictionless joint: -zeta omega_n ± i (omega_n - omega)."""
    joint = small_reference.joint.with_friction(friction)
    natural = getattr(joint.mode, name)
    frequency = natural / (2 * np.pi) - 0.4
    problem = harmonic_problem(joint, harmonics=2, half_turn=half_turn)
    load = 1e-7 * small_reference.moment
    w, _ = raise_load(problem, frequency, load)
    found = hill_exponents(problem, frequency, load, w, count=4)
    expected = -0.5 * joint.model.rayleigh[1] * natural**2 + 1j * 0.4 * 2 * np.pi
    nearest = found.exponents[np.argmin(np.abs(found.exponents - expected))]
    print(f"{nearest:.5f} against {expected:.5f}")
    assert nearest == pytest.approx(expected, rel=1e-3)
    assert found.stable
    assert (np.abs(found.multipliers) < 1).all()


def test_stability_is_lost_at_the_fold(small_reference):
    """A real exponent passes zero where the branch turns round, and nowhere else."""
    problem = harmonic_problem(small_reference.joint, harmonics=3)
    path, branch = follow_frequency(
        problem,
        7.2e-4 * small_reference.moment,
        (170.0, 180.0),
        observe=lambda point: point.p < 172.0 and point.tangent_p < 0,
    )
    assert len(branch.folds) == 1
    for point in branch.points[-10:]:
        found = hill_exponents(problem, point.p, path.load, point.u, solver=path.solver)
        assert found.stable == (point.tangent_p > 0)
        if not found.stable:
            assert found.exponents[found.exponents.real > 0].imag == pytest.approx(0, abs=1e-6)


def test_decay_in_the_time_domain(small_reference):
    """A disturbed steady state returns at the rate, and with the beat, of the slowest exponent."""
    joint, frequency = small_reference.joint, 182.0
    load = 2.4e-4 * small_reference.moment
    problem = harmonic_problem(joint, harmonics=7)
    w, _ = raise_load(problem, frequency, load)
    s = hill_exponents(problem, frequency, load, w).exponents[0]
    steps = 300
    scheme = time_scheme(joint, 1 / (frequency * steps), frequency=frequency)
    steady = steady_state(scheme, frequency, load, tolerance=1e-6)
    wave = load * np.sin(2 * np.pi * np.arange(steps + 1) / steps)
    kernel = np.exp(-2j * np.pi * np.arange(steps) / steps) / steps
    place = joint.model.port("sliding")

    def amplitudes(state, cycles):
        found = []
        for _ in range(cycles):
            cycle = march(scheme, state, wave)
            state = cycle.state
            found.append(cycle.output[:-1, place] @ kernel)
        return np.array(found)

    start = steady.cycle.state
    pushed = type(start)(**{**vars(start), "rate": 1.01 * start.rate})
    deviation = amplitudes(pushed, 24) - amplitudes(start, 24)
    # the deviation is A e^{st} + B e^{conj(s) t}: two lags of a linear recursion
    d = deviation[3:]
    stacked = np.concatenate([d, d.conj()])
    count = len(d)
    rows = np.column_stack([stacked[1:-1], stacked[:-2]])
    keep = [i for i in range(len(rows)) if i not in (count - 2, count - 1)]
    share = np.linalg.lstsq(rows[keep], stacked[2:][keep], rcond=None)[0].real
    measured = np.log(np.roots([1, -share[0], -share[1]]).astype(complex)) * frequency
    measured = measured[np.argmin(np.abs(measured - s))]
    print(f"Hill {s:.3f}, time domain {measured:.3f}")
    assert measured == pytest.approx(s, abs=0.1 * abs(s))


@pytest.mark.parametrize("half_turn", [True, False])
@pytest.mark.parametrize("frequency", [170.0, 172.0])
def test_a_harmonic_near_a_mode_of_the_separate_beams(small_reference, frequency, half_turn):
    """Five times these all but meet 862 Hz, a mode of each beam alone and not one of the joint.

    Without friction every exponent is that of a linear mode, shifted by a multiple of i omega.
    """
    joint = small_reference.joint.with_friction(0.0)
    bonded = joint.prestress.bonded(1)
    modes = linear_modes(small_reference.structure, bonded, 16, align="moment")
    rate = 0.5 * joint.model.rayleigh[1] * modes.omega**2
    own = -rate + 1j * np.sqrt(np.maximum(modes.omega**2 - rate**2, 0))
    problem = harmonic_problem(joint, harmonics=9, half_turn=half_turn)
    load = 1e-8 * small_reference.moment
    w, _ = raise_load(problem, frequency, load)
    found = hill_exponents(problem, frequency, load, w)
    shifts = 2j * np.pi * frequency * np.arange(-40, 41)
    expected = (np.concatenate([own, own.conj()])[:, None] + shifts).ravel()
    print(np.round(found.exponents, 3))
    assert len(found.exponents) == 4
    for s in found.exponents:
        assert np.abs(expected - s).min() <= 0.01 * abs(s)
    assert found.stable

"""Den Hartog's oscillator over time, against exact amplitudes.

Exact amplitudes: Den Hartog (1931), to six digits from an event-driven simulation.
"""

from __future__ import annotations

import numpy as np
import pytest
from den_hartog import MASS, MU, OMEGA, P0, STIFFNESS, oscillator

from microslip.analyses.time.scheme import march, prestressed_state, time_scheme
from microslip.analyses.time.steady import steady_state
from microslip.analyses.time.turns import turning_cycle

RATIO = (0.7, 0.9, 1.1, 1.5)
"""omega / omega_n."""
EXACT = {
    0.2: (1.927775, 5.110040, 4.590925, 0.765942),
    0.4: (1.825167, 4.620342, 4.034744, 0.653197),
    0.6: (1.639948, 3.661416, 2.878094, 0.400000),
}
"""F/P0: X k/P0 at each RATIO."""


def marching(friction_force, dt):
    """The oscillator made ready for steps of dt; its slider is pressed with F/mu."""
    joint = oscillator(friction_force)
    pressed = friction_force / MU
    assert joint.prestress.solution.r == pytest.approx([pressed, 0.0], abs=1e-9 * pressed)
    return time_scheme(joint, dt)


def test_reads_the_displacement_of_the_mass():
    """Port force is conjugate to x, port sliding to sqrt(m) x."""
    scheme = marching(1e-9, 1e-3)
    marched = march(scheme, prestressed_state(scheme), P0 * np.ones(50))
    assert marched.output[:, 2] == pytest.approx(np.sqrt(MASS) * marched.output[:, 1], rel=1e-12)


def amplitude(ratio, r, steps):
    """Largest |x| k / P0 over the steady cycle, and the steady state."""
    frequency = r * OMEGA / (2 * np.pi)
    scheme = marching(ratio * P0, 1 / (frequency * steps))
    found = steady_state(scheme, frequency, P0, tolerance=1e-6)
    assert found.converged
    return np.abs(found.cycle.output[:, 1]).max() * STIFFNESS / P0, found


@pytest.mark.parametrize("ratio", [0.2, 0.4, 0.6])
@pytest.mark.parametrize("column", [1, 2, 3])
def test_tabulated_amplitudes_are_those_of_the_closed_form(ratio, column):
    """Motion without stops: (X k/P0)² = V² - (F U/P0)², V = 1/(1 - r²)."""
    r = RATIO[column]
    U = np.sin(np.pi / r) / (r * (1 + np.cos(np.pi / r)))
    closed = np.sqrt(1 / (1 - r**2) ** 2 - (ratio * U) ** 2)
    assert EXACT[ratio][column] == pytest.approx(closed, abs=6e-7)


@pytest.mark.parametrize("ratio", [0.2, 0.4, 0.6])
@pytest.mark.parametrize("column", range(4))
def test_exact_amplitude(ratio, column):
    """Within 0.1 % with fewer than 2,000 steps per cycle, stops included."""
    frequency = RATIO[column] * OMEGA / (2 * np.pi)
    found = turning_cycle(oscillator(ratio * P0), frequency, P0)
    assert found.converged
    size = np.abs(found.output[:, 1]).max() * STIFFNESS / P0
    exact = EXACT[ratio][column]
    print(
        f"F/P0 {ratio}, r {RATIO[column]}: {size / exact - 1:+.2e}, {found.steps} steps, "
        f"{found.cycles} cycles, {found.seconds:.1f} s"
    )
    assert found.steps < 2000
    assert size == pytest.approx(exact, rel=1e-3)


def test_error_falls_with_the_step():
    """A mass right on a slider: first order, as friction changes sign half a step late on average.

    The force of a slider behind a spring is continuous, and this error is absent there.
    """
    steps = np.array([150, 1000, 8000])
    for ratio, row in EXACT.items():
        for r, exact in zip(RATIO, row, strict=True):
            error = np.array([amplitude(ratio, r, n)[0] / exact - 1 for n in steps])
            assert (np.abs(error) < 15 / steps).all()


def test_free_decay_is_linear():
    """Peaks fall by 2 F/k per half cycle until the spring no longer overcomes friction."""
    force = 1.0
    steps = 2000
    scheme = marching(force, 2 * np.pi / OMEGA / steps)
    drop = 2 * force / STIFFNESS
    amplitude = 20.3 * drop
    load = np.zeros(12 * steps)
    state = prestressed_state(scheme, amplitude, OMEGA)
    x = march(scheme, state, load).output[:, 1]
    peaks = np.flatnonzero((np.diff(np.abs(x))[:-1] > 0) & (np.diff(np.abs(x))[1:] <= 0)) + 1
    size = np.abs(x[peaks])
    print(f"drops over 2F/k: {np.diff(size)[:3] / drop}, rest {x[-1] / drop}")
    assert len(size) >= 19
    assert -np.diff(size[:19]) == pytest.approx(np.full(18, drop), rel=1e-3)
    assert np.abs(x[-1]) <= 0.5 * drop * (1 + 1e-6)
    assert np.ptp(x[-steps:]) < 2e-5 * drop

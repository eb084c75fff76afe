"""Readings of histories whose decay or response is known."""

from __future__ import annotations

import numpy as np
import pytest

from microslip.analyses.time.decay import decay, dwell_response, extremes
from microslip.analyses.time.signals import stepped_sine


@pytest.mark.parametrize("offset", [0.0, 4.0])
def test_reading_of_viscous_decay(offset):
    """Closed form: damping ratio and damped frequency, whatever the offset."""
    zeta, frequency = 0.01, 7.0
    t = np.linspace(0, 2, 4001)
    w = 2 * np.pi * frequency
    q = offset + 2 * np.exp(-zeta * w * t) * np.cos(w * np.sqrt(1 - zeta**2) * t)
    found = decay(t, q, 286)
    # the parabola through three samples is off by (w dt)²/24 of a curvature at most
    assert found.damping == pytest.approx(np.full(len(found.damping), zeta), rel=2e-3)
    assert found.frequency == pytest.approx(
        np.full(len(found.time), frequency * np.sqrt(1 - zeta**2)), rel=1e-4
    )
    assert found.amplitude == pytest.approx(2 * np.exp(-zeta * w * found.time), rel=1e-3)
    assert np.abs(found.offset - offset).max() < 2e-3


def test_reading_of_coulomb_decay():
    """Amplitude falls by the same length every half cycle, about centres that alternate."""
    t = np.linspace(0, 10, 10001)
    half = np.floor(2 * t).astype(int)
    amplitude, centre = 21 - 1.0 * (2 * half + 1) / 2, 0.5 * (-1.0) ** half
    q = centre + amplitude * np.cos(2 * np.pi * t)
    found = decay(t, q, 1000)
    assert np.diff(found.amplitude) == pytest.approx(np.full(len(found.time) - 1, -1.0), abs=1e-3)
    assert found.frequency == pytest.approx(np.ones(len(found.time)), rel=1e-3)


def test_nothing_to_read():
    t = np.linspace(0, 1, 50)
    assert len(decay(t, t, 10).time) == 0
    assert len(extremes(t, np.zeros(50), 10)[0]) == 0
    assert len(extremes(t[:1], np.zeros(1), 10)[0]) == 0


def test_dwells_of_a_known_response():
    """Amplitude and phase that change from dwell to dwell, with an offset and a third harmonic."""
    frequencies, cycles, dt = [10.0, 14.0, 6.0], 3.5, 1e-4
    answers = [2.0 - 1j, -0.5j, 3.0]
    t, _ = stepped_sine(1.0, frequencies, cycles, dt)
    ends = np.cumsum(cycles / np.array(frequencies))
    begin, q = 0.0, np.full_like(t, 0.7)
    for k, (f, Y) in enumerate(zip(frequencies, answers, strict=True)):
        inside = (t > begin * (1 + 1e-12)) & (t <= ends[k] * (1 + 1e-12))
        phase = 2 * np.pi * (k * cycles + f * (t[inside] - begin))
        q[inside] = 0.7 + np.imag(Y * np.exp(1j * phase)) + 0.2 * np.sin(3 * phase)
        begin = ends[k]
    found = dwell_response(t, q, frequencies, cycles)
    assert found == pytest.approx(np.array(answers), rel=1e-9, abs=1e-9)
    cut = t <= ends[1]
    early = dwell_response(t[cut], q[cut], frequencies, cycles)
    assert np.isnan(early).tolist() == [False, False, True]

"""Harmonic balance on oscillators with closed forms: Den Hartog's, and one on a Jenkins element.

Den Hartog's mass sits right on a rigid slider: W has no flexibility of its own there, and the
augmentation eps stands for a stiff spring in front of the slider. Its error falls with the square root
of 1/eps (the time the spring takes to turn round), so three values in the ratio 1 : 4 : 16 give the
limit of a rigid slider.
"""

from __future__ import annotations

import numpy as np
import pytest
from den_hartog import MASS, OMEGA, P0, STIFFNESS, oscillator

from microslip.analyses.harmonic.paths import LoadPath
from microslip.analyses.harmonic.points import describe
from microslip.analyses.harmonic.problem import harmonic_problem
from microslip.analyses.harmonic.raising import raise_load
from microslip.numerics.continuation import StepControl, solve_at

CONTROL = StepControl(
    first=0.1, smallest=1e-7, largest=0.5, good_iterations=8, max_iterations=40, tolerance=1e-9
)
SOFTEST = 1e6
"""Augmentation that every search starts with, N/m."""


def response(ratio, r, harmonics, samples, stiffnesses):
    """First harmonic and largest value of x k/P0 for every augmentation."""
    joint = oscillator(ratio * P0)
    frequency = r * OMEGA / (2 * np.pi)
    theta = 2 * np.pi * np.arange(4096) / 4096
    w, found = None, []
    for stiffness in [SOFTEST, *stiffnesses]:
        problem = harmonic_problem(joint, harmonics=harmonics, samples=samples, stiffness=stiffness)
        path = LoadPath(problem, frequency, P0)
        if w is None:
            w, _ = raise_load(problem, frequency, P0, CONTROL)
        w, equations, iterations = solve_at(path, w, P0, CONTROL)
        x = describe(equations, iterations, 0.0).output[:, 2] / np.sqrt(MASS)
        wave = sum((X * np.exp(1j * h * theta)).imag for h, X in enumerate(x) if h > 0)
        found.append((np.abs(x[1]), np.abs(wave + x[0].real).max()))
    return np.array(found[1:]) * STIFFNESS / P0


def rigid_limit(ratio, r, harmonics, samples=16384, top=4.0**5 * SOFTEST):
    """Quadratic extrapolation in the square root of 1/eps."""
    values = response(ratio, r, harmonics, samples, [top / 16, top / 4, top])
    return (values[0] - 6 * values[1] + 8 * values[2]) / 3


@pytest.mark.parametrize("column", range(4))
def test_one_harmonic_of_den_hartog(published, column):
    """The closed one-term form to four digits."""
    data = published["den_hartog"]
    first, _ = rigid_limit(0.2, data["r"][column], 1)
    expected = data["one_harmonic_F02"][column]
    print(f"r = {data['r'][column]}: {first:.6f} against {expected}, {first / expected - 1:+.1e}")
    assert first == pytest.approx(expected, rel=5e-5)


def converges(data, ratio, column, finding):
    """Errors of the largest displacement fall as 1/(H + 1), and tend to the exact value.

    Coulomb's force jumps, so its harmonics fall as 1/h only.
    """
    exact = data[f"exact_F0{round(10 * ratio)}"][column]
    r = data["r"][column]
    errors = np.array([rigid_limit(ratio, r, H)[1] / exact - 1 for H in (1, 5, 9)])
    limit = errors[2] - (errors[1] - errors[2]) / (1 / 6 - 1 / 10) / 10
    print(f"F/P0 {ratio}, r {r}: errors {np.round(errors, 5)}, limit {limit:+.1e}")
    assert (np.diff(np.abs(errors)) < 0).all()
    what = "Den Hartog: limit of many harmonics against the exact solution, over the error of five"
    finding(what, abs(limit / errors[1]), at_most=0.1)


@pytest.mark.parametrize(("ratio", "column"), [(0.2, 0), (0.4, 0)])
def test_harmonics_of_den_hartog(published, ratio, column, finding):
    converges(published["den_hartog"], ratio, column, finding)


@pytest.mark.validate
@pytest.mark.parametrize("ratio", [0.2, 0.4, 0.6])
@pytest.mark.parametrize("column", range(4))
def test_all_harmonics_of_den_hartog(published, ratio, column, finding):
    converges(published["den_hartog"], ratio, column, finding)


@pytest.mark.parametrize("r", [0.7, 0.95, 1.02, 1.2])
@pytest.mark.parametrize("spring", [2e3, 1e4])
def test_oscillator_on_a_jenkins_element(r, spring):
    """An elastic contact with its own spring as augmentation: the one-term closed form."""
    force = 0.05 * P0
    joint = oscillator(force, spring)
    frequency = r * OMEGA / (2 * np.pi)
    problem = harmonic_problem(joint, harmonics=1, samples=4096, stiffness=np.array([1.0, spring]))
    w, _ = raise_load(problem, frequency, P0, CONTROL)
    point = describe(LoadPath(problem, frequency, P0).at(w, P0), 0, 0.0)
    X = point.output[1, 2] / np.sqrt(MASS)
    size = np.abs(X)
    assert spring * size > force
    angle = np.arccos(1 - 2 * force / (spring * size))
    stored = spring / np.pi * (angle - 0.5 * np.sin(2 * angle))
    lost = 4 * force * (size - force / spring) / (np.pi * size**2)
    balance = (STIFFNESS - MASS * (r * OMEGA) ** 2 + stored + 1j * lost) * X
    assert balance == pytest.approx(P0, rel=1e-5)
    assert point.dissipated == pytest.approx(np.pi * lost * size**2, rel=1e-5)

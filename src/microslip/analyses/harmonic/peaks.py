"""Resonance peaks of periodic responses, and the amplitude along a branch."""

from __future__ import annotations

import time as clock
from collections.abc import Sequence

import numpy as np

from microslip.analyses.harmonic.operator import linear_operator
from microslip.analyses.harmonic.paths import CONTROL, FrequencyPath
from microslip.analyses.harmonic.points import HarmonicPoint, describe
from microslip.analyses.harmonic.problem import HarmonicProblem
from microslip.analyses.harmonic.raising import follow_frequency
from microslip.errors import Failure
from microslip.numerics.continuation import (
    Branch,
    BranchPoint,
    ContinuationError,
    StepControl,
    locate,
)
from microslip.typing import Array, Complex


def resonance_peak(
    path: FrequencyPath, branch: Branch, control: StepControl = CONTROL
) -> HarmonicPoint:
    """The point of largest amplitude on a branch: where it stops growing along the arc.

    Raises
    ------
    ContinuationError
        Where the branch has no peak between its ends.
    """
    slopes = [_growth_of_amplitude(path, point) for point in branch.points]
    peaks = [i for i in range(len(slopes) - 1) if slopes[i] > 0 >= slopes[i + 1]]
    if not peaks:
        low, high = branch.parameters.min(), branch.parameters.max()
        raise ContinuationError(f"no resonance peak between {low:.6g} and {high:.6g} Hz")
    best = max(peaks, key=lambda i: abs(_amplitude(path, branch.points[i])))
    began = clock.perf_counter()
    peak = locate(
        path,
        branch.points[best],
        branch.points[best + 1],
        lambda point: _growth_of_amplitude(path, point),
        control,
    )
    return describe(path.at(peak.u, peak.p), peak.iterations, clock.perf_counter() - began)


def resonance_locus(
    problem: HarmonicProblem,
    loads: Sequence[float] | Array,
    band: tuple[float, float],
    control: StepControl = CONTROL,
) -> tuple[list[HarmonicPoint], list[Failure]]:
    """Peaks of the frequency responses under several loads, and the loads that failed."""
    peaks, failures = [], []
    for load in loads:
        try:
            path, branch = follow_frequency(problem, float(load), band, control=control)
            peaks.append(resonance_peak(path, branch, control))
        except ContinuationError as error:
            failures.append(Failure("harmonic", f"load {load:.4g}", str(error)))
    return peaks, failures


def outputs_along(problem: HarmonicProblem, load: float, branch: Branch) -> Complex:
    """First harmonics of the outputs of all ports at every point of a branch over frequency, (n, p)."""
    path = FrequencyPath(problem, load)
    return np.array([_first_harmonics(path, point) for point in branch.points])


def _amplitude(path: FrequencyPath, point: BranchPoint) -> complex:
    """Of the modal coordinate."""
    return complex(_first_harmonics(path, point)[path.problem.model.port(path.problem.coordinate)])


def _first_harmonics(path: FrequencyPath, point: BranchPoint) -> Complex:
    operator = linear_operator(path.problem, 2 * np.pi * point.p)
    return operator.outputs(*path.problem.split(point.u), path.load)[1]


def _growth_of_amplitude(path: FrequencyPath, point: BranchPoint) -> float:
    """Slope of the amplitude along the branch, by a small step of its tangent."""
    step = 1e-6
    u, p = point.u + step * point.tangent_u, point.p + step * point.tangent_p
    ahead = BranchPoint(u, p, point.tangent_u, point.tangent_p, point.step, 0, 0.0)
    return (abs(_amplitude(path, ahead)) - abs(_amplitude(path, point))) / step

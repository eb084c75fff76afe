"""Harmonic balance against the time domain on the reference joint: twelve frequencies, six loads.

    python docs/evidence/harmonic_balance.py [rho ...]

End moments are ``M = 2.03e-3 mu P L / rho``; rho = 0 is the joint without friction under the moment of
rho = 2000, whose peak stays small. The number of harmonics grows until the estimated error of the
amplitude is 0.15 %, 21 at most. Time integration takes 300 steps per cycle and
starts from the answer of harmonic balance. An hour on two cores.
"""

from __future__ import annotations

import sys
from pathlib import Path

import numpy as np
from threadpoolctl import threadpool_limits

from microslip import Failure, load_joint
from microslip.analyses.harmonic.adaptive import Adaptive
from microslip.analyses.harmonic.points import HarmonicPoint
from microslip.analyses.harmonic.problem import harmonic_problem
from microslip.analyses.harmonic.response import frequency_response
from microslip.analyses.time.point import Request, TimePoint
from microslip.analyses.time.points import steady_states
from microslip.pipeline.prepare import Assembly, assemble

EXAMPLE = Path(__file__).parents[2] / "examples" / "lap_joint.toml"
C = 2.03e-3
GENTLE = 2000.0
"""rho whose moment the joint without friction gets."""
STEPS = 300
CHOICE = Adaptive(tolerance=1.5e-3, most=21)
BANDS: dict[float, tuple[float, ...]] = {
    0.0: (165, 168, 170, 172, 174, 174.7, 175, 176, 178, 181, 185, 190),
    0.8: (165, 167, 169, 170, 171, 172, 173, 174, 176, 180, 185, 190),
    1.6: (165, 168, 170, 172, 173, 174, 175, 176, 177, 180, 185, 190),
    2.4: (165, 170, 172, 174, 176, 177, 177.5, 178, 179, 182, 186, 190),
    3.2: (165, 170, 173, 175, 177, 178, 178.5, 179, 180, 182, 186, 190),
    5.0: (165, 170, 174, 177, 179, 180, 180.5, 181, 182, 184, 187, 190),
}
"""Frequencies of each load, Hz: the band, and closer around its resonance."""


def friction(a: Assembly, rho: float) -> float:
    """Coefficient of friction of a load: none for rho = 0."""
    return a.joint.contact.friction if rho else 0.0


def balance(a: Assembly, rho: float, frequencies: tuple[float, ...]) -> tuple[HarmonicPoint, ...]:
    """Responses of one load, and what was not found on stderr."""
    problem = harmonic_problem(a.prepared.with_friction(friction(a, rho)))
    found = frequency_response(problem, moment(a, rho), frequencies, adaptive=CHOICE)
    for failure in found.failures:
        print(f"rho {rho}: {failure}", file=sys.stderr)
    return found.points


def moment(a: Assembly, rho: float) -> float:
    """End moment of a load, N m per metre of width."""
    return C * a.joint.contact.friction * a.moment_unit / (rho or GENTLE)


def truth(a: Assembly, rho: float, points: tuple[HarmonicPoint, ...]) -> list[TimePoint | Failure]:
    """Steady states in the time domain, each from the answer it is to judge."""
    mu = friction(a, rho)
    requests = [Request(rho, p.frequency, p.load, mu, p.amplitude, STEPS) for p in points]
    return list(steady_states(a.prepared, requests))


def row(point: HarmonicPoint, steady: TimePoint | Failure) -> str:
    """Line of the table: errors of amplitude and phase, harmonics, seconds."""
    start = f"{point.frequency:7.2f}  {abs(point.amplitude):9.3e}"
    if isinstance(steady, Failure):
        return f"{start}  {steady}"
    ratio = point.amplitude / steady.steady.amplitude
    state = "" if steady.steady.converged else f"  not steady ({steady.steady.change:.0e})"
    dissipated = steady.steady.cycle.dissipated
    loss = 100 * (point.dissipated / dissipated - 1) if steady.friction else 0.0
    return (
        f"{start}  {100 * (abs(ratio) - 1):+7.3f} %  {np.angle(ratio):+8.4f} rad  {loss:+7.3f} %  "
        f"{point.harmonics:2d} harmonics, tail {point.tail:.3f}, {point.seconds:5.1f} s  "
        f"{steady.steady.cycles:3d} cycles, {steady.steady.seconds:5.1f} s{state}"
    )


def main() -> None:
    wanted = [float(word) for word in sys.argv[1:]] or list(BANDS)
    a = assemble(load_joint(EXAMPLE))
    for rho in wanted:
        points = balance(a, rho, BANDS[rho])
        print(f"rho = {rho}, M = {moment(a, rho):.4g} N m/m: amplitude, phase, dissipation")
        for point, steady in zip(points, truth(a, rho, points), strict=True):
            print(row(point, steady), flush=True)


if __name__ == "__main__":
    with threadpool_limits(1):
        main()

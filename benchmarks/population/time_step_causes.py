"""What makes the error of the steps, and what does not: the reference joint and random lap joints.

python benchmarks/population/time_step_causes.py [--seed 47] [--joints 6 7] [--pairs 41]

Each at its largest answer, every motion sought from the end of the one in 1,200 steps (`time_steps.py`):

- frequencies of the joint with all touching pairs stuck: by which share the steps distort them. With
  K = Psi^T W_res^-1 Psi of the stuck pairs, x a mode of ``diag(omega²) + K`` and D the lags of the residual
  part, to first order ``(x^T diag((omega_j² - O_j²)/g_j) x + (1 + Re D) x^T K x) / (2 omega²)``;
- which share of ``dt²/6 Psi Psi^T`` may be taken from the residual flexibility, so that it stays positive
  definite: with the whole of it, and gains of the modes raised by (omega dt)²/6, all harmonics of a
  linear motion would be right to the fourth order;
- errors of the amplitude at 75, 150 and 300 steps: as it is; of 1,200 steps with the modes alone that so few
  can follow; without second differences on the residual part; marched instead of sought; and over the
  two counts on either side, the least and largest error, and work of normal contact over dissipation.
"""

from __future__ import annotations

import argparse
import tomllib
from contextlib import AbstractContextManager, nullcontext
from unittest.mock import patch

import numpy as np
from lap_joints import joints
from time_points import frequencies
from time_steps import COUNTS, FINEST, REFERENCE

from microslip import prepare, reference_joint
from microslip.analyses.prepared.joint import PreparedJoint
from microslip.analyses.time import poles
from microslip.analyses.time.scheme import time_scheme
from microslip.analyses.time.starts import Start
from microslip.analyses.time.steady import SteadyState, steady_state
from microslip.describe.reading import parse_joint
from microslip.errors import MicroslipError
from microslip.pipeline.prepare import assemble

HARMONICS = 12.0
"""Coupled frequencies up to so many times that of the load."""

NEIGHBOURS = (-2, -1, 0, 1, 2)
"""Steps more or fewer."""


def coupled(joint: PreparedJoint, frequency: float, steps: int) -> list[tuple[float, float]]:
    """Frequencies with all touching pairs stuck, over that of the load, and their distortions."""
    scheme = time_scheme(joint, 1 / (frequency * steps), frequency=frequency)
    model, kernel = scheme.joint.model, scheme.kernel
    stuck = np.asarray(joint.prestress.bonded(1))
    psi = model.mode_v[stuck]
    K = psi.T @ np.linalg.solve(model.residual[np.ix_(stuck, stuck)], psi)
    values, modes = np.linalg.eigh(np.diag(model.omega**2) + K)
    found = []
    for value, x in zip(values, modes.T, strict=True):
        omega = np.sqrt(max(value, 0.0))
        ratio = omega / (2 * np.pi * frequency)
        if not 1 < ratio < HARMONICS:
            continue
        z = np.exp(-1j * omega * scheme.dt)
        lag = float((kernel.lags @ [1, z, z**2]).real)
        seen = 2 / kernel.mode_step * np.tan(0.5 * omega * scheme.dt)
        lacking = x @ ((model.omega**2 - seen**2) / kernel.mode_gain * x) + (1 + lag) * (x @ K @ x)
        found.append((float(ratio), float(lacking / (2 * value))))
    return found


def compensated(joint: PreparedJoint, frequency: float, steps: int) -> float:
    """The share of ``dt²/6 Psi Psi^T`` that may be taken from the residual flexibility."""
    scheme = time_scheme(joint, 1 / (frequency * steps), frequency=frequency)
    model = scheme.joint.model
    root = np.linalg.cholesky(model.residual)
    return float(6 / np.linalg.norm(np.linalg.solve(root, model.mode_v) * scheme.dt, 2) ** 2)


def with_modes(most: int) -> AbstractContextManager[object]:
    """Steps follow no more modes than that."""
    whole = poles.within_reach
    return patch.object(poles, "within_reach", lambda omega, dt: min(whole(omega, dt), most))


def found(
    joint: PreparedJoint,
    frequency: float,
    load: float,
    steps: int,
    start: Start | None = None,
    accelerate: bool = True,
) -> SteadyState | None:
    """Steady state, or None."""
    scheme = time_scheme(joint, 1 / (frequency * steps), frequency=frequency)
    steady = steady_state(
        scheme,
        frequency,
        load,
        start=start,
        tolerance=1e-6,
        accelerate=accelerate,
        max_cycles=200 if accelerate else 600,
    )
    return steady if steady.converged else None


def study(name: str, joint: PreparedJoint, frequency: float, load: float) -> None:
    """Print the lines of one joint."""
    first = found(joint, frequency, load, COUNTS[1])
    limit = found(joint, frequency, load, FINEST, first.end) if first else None
    if limit is None:
        print(f"{name}: not steady", flush=True)
        return

    def error(steady: SteadyState | None) -> str:
        if steady is None:
            return "not steady"
        return f"{abs(steady.amplitude) / abs(limit.amplitude) - 1:+.1e}"

    def varied(steps: int, way: AbstractContextManager[object], **options: bool) -> str:
        with way:
            return error(found(joint, frequency, load, steps, limit.end, **options))

    work = limit.cycle.normal_work / limit.cycle.dissipated
    print(f"{name}, {frequency:.5g} Hz, work in {FINEST} steps {work:+.0e}", flush=True)
    for steps in COUNTS:
        shifts = ", ".join(f"{e:+.0e} at {h:.3g}" for h, e in coupled(joint, frequency, steps))
        share = compensated(joint, frequency, steps)
        modes = poles.within_reach(joint.model.omega, 1 / (frequency * steps))
        beside = [found(joint, frequency, load, steps + n, limit.end) for n in NEIGHBOURS]
        settled = [steady for steady in beside if steady is not None]
        sizes = [abs(s.amplitude) / abs(limit.amplitude) - 1 for s in settled]
        works = [s.cycle.normal_work / s.cycle.dissipated for s in settled]
        print(f"  {steps}: coupled frequencies {shifts}; {100 * share:.1f} % of the correction")
        print(
            f"       as it is {error(beside[2])}, its modes alone "
            f"{varied(FINEST, with_modes(modes))}, no second differences "
            f"{varied(steps, patch.object(poles, 'ALTERNATING', 0.0))}, marched "
            f"{varied(steps, nullcontext(), accelerate=False)}; counts beside "
            f"{min(sizes):+.1e} to {max(sizes):+.1e}, work {min(works):+.0e} to {max(works):+.0e}",
            flush=True,
        )


def main() -> None:
    """Print all joints."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--seed", type=int, default=47)
    parser.add_argument("--joints", type=int, nargs="*", default=[6, 7])
    parser.add_argument("--pairs", type=int, default=41)
    asked = parser.parse_args()
    reference = prepare(reference_joint(pairs=asked.pairs))
    for ratio, frequency in REFERENCE:
        study(f"reference {ratio:g}", reference, frequency, ratio * 1e6 * 0.2515)
    texts = list(joints(asked.seed, max(asked.joints, default=-1) + 1, asked.pairs))
    for number in asked.joints:
        name = f"{asked.seed}/{number:03d}"
        try:
            a = assemble(parse_joint(tomllib.loads(texts[number])))
            load = a.joint.load.moment_over_clamp_force_length[0] * a.moment_unit
            study(name, a.prepared, frequencies(a.prepared, load)[1], load)
        except MicroslipError as error:
            print(f"{name}: left out: {error}", flush=True)


if __name__ == "__main__":
    main()

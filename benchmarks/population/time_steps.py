"""Amplitude of steady states against the number of time steps, on the reference joint and random lap joints.

python benchmarks/population/time_steps.py [--seed 21] [--count 30] [--wanted 10] [--pairs 101]

Every joint at its largest answer under its own load (`time_points.py`); errors of 75,
150 and 300 steps per cycle against 1,200, each sought from the end of the finest, so that all have
the same tractions locked in; and the root mean square over five counts within a tenth of each. Joints
whose motion does not settle to 1e-6, or opens, are left out and named.
"""

from __future__ import annotations

import argparse
import tomllib

import numpy as np
from lap_joints import joints
from time_points import frequencies

from microslip import prepare, reference_joint
from microslip.analyses.prepared.joint import PreparedJoint
from microslip.analyses.time.scheme import time_scheme
from microslip.analyses.time.starts import Start
from microslip.analyses.time.steady import SteadyState, steady_state
from microslip.contact.pairs import touches
from microslip.describe.reading import parse_joint
from microslip.errors import MicroslipError
from microslip.pipeline.prepare import assemble

COUNTS, FINEST = (75, 150, 300), 1200
AROUND = (0.9, 0.95, 1.0, 1.05, 1.1)
"""Other counts over one of them."""

REFERENCE = ((1e-4, 181.0), (1.5e-4, 178.5), (2e-4, 179.0), (3e-4, 176.0))
"""M/(PL) and Hz of the reference joint."""


def found(
    joint: PreparedJoint, frequency: float, load: float, steps: int, start: Start | None = None
) -> SteadyState:
    """Steady state; raises where it has none."""
    scheme = time_scheme(joint, 1 / (frequency * steps), frequency=frequency)
    steady = steady_state(scheme, frequency, load, start=start, tolerance=1e-6, max_cycles=250)
    if not steady.converged:
        raise MicroslipError(f"{steps} steps: not steady, last change {steady.change:.0e}")
    if not touches(steady.cycle.status).any(axis=1).all():
        raise MicroslipError("opens altogether")
    return steady


def errors(joint: PreparedJoint, frequency: float, load: float) -> list[float]:
    """Relative errors of the amplitude at `COUNTS` steps, and their root mean squares around."""
    first = found(joint, frequency, load, COUNTS[1])
    limit = found(joint, frequency, load, FINEST, first.end)
    size, at, around = abs(limit.amplitude), [], []
    for count in COUNTS:
        counts = [round(count * share) for share in AROUND]
        e = [abs(found(joint, frequency, load, n, limit.end).amplitude) / size - 1 for n in counts]
        at.append(e[AROUND.index(1.0)])
        around.append(float(np.sqrt(np.mean(np.square(e)))))
    return at + around


def main() -> None:
    """Print the table and its worst and median."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--seed", type=int, default=21)
    parser.add_argument("--count", type=int, default=30)
    parser.add_argument("--wanted", type=int, default=10)
    parser.add_argument("--pairs", type=int, default=101)
    asked = parser.parse_args()
    rows = []
    reference = prepare(reference_joint(pairs=asked.pairs))
    for ratio, f in REFERENCE:
        e = errors(reference, f, ratio * 1e6 * 0.2515)
        rows.append(e)
        print(f"reference {ratio:g}, {f:g} Hz  " + "  ".join(f"{x:+.1e}" for x in e), flush=True)
    others = 0
    for number, text in enumerate(joints(asked.seed, asked.count, asked.pairs)):
        if others == asked.wanted:
            break
        try:
            a = assemble(parse_joint(tomllib.loads(text)))
            load = a.joint.load.moment_over_clamp_force_length[0] * a.moment_unit
            f = frequencies(a.prepared, load)[1]
            e = errors(a.prepared, f, load)
        except MicroslipError as error:
            print(f"{asked.seed}/{number:03d}  left out: {error}", flush=True)
            continue
        rows.append(e)
        others += 1
        print(
            f"{asked.seed}/{number:03d}, {f:.5g} Hz  " + "  ".join(f"{x:+.1e}" for x in e),
            flush=True,
        )
    size = np.abs(rows)
    print("median " + "  ".join(f"{x:.1e}" for x in np.median(size, axis=0)))
    print("worst  " + "  ".join(f"{x:.1e}" for x in size.max(axis=0)))


if __name__ == "__main__":
    main()

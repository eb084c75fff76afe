"""What the past makes of a steady state: the same load from several starts.

python benchmarks/population/time_pasts.py [--seeds 40 41 42] [--count 2] [--pairs 41]

The reference joint at three loads, and random lap joints at their largest answer and on the flank above it.
Against the state after a load raised over thirty cycles: raised over ten, the whole load at once,
prestress and the velocity of an answer that is right, of one a third too large, and of one whose phase
is wrong by a right angle. Complex amplitude, dissipation, and cycles marched.
"""

from __future__ import annotations

import argparse
import tomllib
from collections.abc import Iterator

import numpy as np
from lap_joints import joints
from time_points import frequencies

from microslip import prepare, reference_joint
from microslip.analyses.prepared.joint import PreparedJoint
from microslip.analyses.time.scheme import time_scheme
from microslip.analyses.time.steady import raised_state, steady_state
from microslip.describe.reading import parse_joint
from microslip.errors import MicroslipError
from microslip.pipeline.prepare import assemble

STEPS, TOLERANCE, CYCLES = 150, 3e-6, 150
REFERENCE = ((1e-4, 181.0), (2e-4, 179.0), (3e-4, 176.0))
"""M/(PL) and Hz of the reference joint."""

STARTS = ("raised 30", "raised 10", "rest", "guess", "guess + 33 %", "guess at 90°")

Case = tuple[str, PreparedJoint, float, float]


def compared(joint: PreparedJoint, frequency: float, load: float) -> list[str]:
    """Differences of amplitude and dissipation from the first start, and cycles of every search."""
    scheme = time_scheme(joint, 1 / (frequency * STEPS), frequency=frequency)

    def found(**start):
        return steady_state(
            scheme, frequency, load, tolerance=TOLERANCE, max_cycles=CYCLES, **start
        )

    def raised(cycles):
        return found(start=raised_state(scheme, frequency, load, cycles))

    first = raised(30)
    if not first.converged:
        raise MicroslipError(f"not settled, last change {first.change:.0e}")
    Q, lost = first.amplitude, first.cycle.dissipated
    others = [raised(10), found(), *(found(guess=share * Q) for share in (1.01, 1.33, 1j))]
    cells = [f"{first.cycles} cycles"]
    for one in others:
        apart = f"{abs(one.amplitude / Q - 1):.0e}, {one.cycle.dissipated / lost - 1:+.0e}"
        cells.append(f"{apart}, {one.cycles}{'' if one.converged else ', not settled'}")
    return cells


def cases(seeds: list[int], count: int, pairs: int) -> Iterator[Case]:
    """Name, joint, frequency and load."""
    reference = prepare(reference_joint(pairs=pairs))
    for ratio, f in REFERENCE:
        yield f"reference, M/(PL) = {ratio:g}", reference, f, ratio * 1e6 * 0.2515
    for seed in seeds:
        for number, text in enumerate(joints(seed, count, pairs)):
            try:
                a = assemble(parse_joint(tomllib.loads(text)))
                load = a.joint.load.moment_over_clamp_force_length[0] * a.moment_unit
                for f in frequencies(a.prepared, load)[1:]:
                    yield f"{seed}/{number:03d}", a.prepared, f, load
            except MicroslipError as error:
                print(f"{seed}/{number:03d}: {error}", flush=True)


def main() -> None:
    """Print a row of a table for every case."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--seeds", type=int, nargs="+", default=[40, 41, 42])
    parser.add_argument("--count", type=int, default=2)
    parser.add_argument("--pairs", type=int, default=41)
    asked = parser.parse_args()
    print("| joint, Hz | " + " | ".join(STARTS) + " |")
    print("|---" * (len(STARTS) + 1) + "|")
    largest = np.zeros(0)
    for name, joint, f, load in cases(asked.seeds, asked.count, asked.pairs):
        try:
            cells = compared(joint, f, load)
        except MicroslipError as error:
            print(f"| {name}, {f:.5g} | {error} |", flush=True)
            continue
        print(f"| {name}, {f:.5g} | " + " | ".join(cells) + " |", flush=True)
        sizes = [float(c.split(",")[0]) if "not" not in c else np.nan for c in cells[1:]]
        largest = np.vstack([largest, sizes]) if largest.size else np.array([sizes])
    print("median amplitude: " + "  ".join(f"{x:.0e}" for x in np.nanmedian(largest, axis=0)))
    print("largest amplitude: " + "  ".join(f"{x:.0e}" for x in np.nanmax(largest, axis=0)))


if __name__ == "__main__":
    main()

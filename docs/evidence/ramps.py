"""What the way in which a load is raised makes of a steady state, on a resonance where it makes much of it.

    python docs/evidence/ramps.py

Joint 2 of population 60 (41 pairs) under its own load: the amplitude after the load was raised from rest over
so many cycles, and after rest under the whole load, against that after thirty, in per cent; `-` where the
search has not settled in 60 cycles. Then the amplitudes at neighbouring frequencies, ten cycles and thirty.
"""

from __future__ import annotations

import sys
import tomllib
from pathlib import Path

import numpy as np

from microslip import parse_joint
from microslip.analyses.prepared.joint import PreparedJoint
from microslip.analyses.time.scheme import time_scheme
from microslip.analyses.time.steady import raised_state, steady_state
from microslip.pipeline.loads import loads_of_file
from microslip.pipeline.prepare import assemble
from microslip.pipeline.targets import STEPS
from microslip.pipeline.walk import TOLERANCE

sys.path.insert(0, str(Path(__file__).parents[2] / "benchmarks" / "population"))

from lap_joints import joints

CYCLES = (30, 40, 22, 16, 10, 0)
RESONANCE = (212.98, 213.70, 214.60, 215.77, 216.40, 218.20)
STAIRS = 219.82 + 0.09 * np.arange(12)


def size(joint: PreparedJoint, frequency: float, load: float, cycles: int) -> float:
    """Amplitude after the load was raised over so many cycles; nan where it has not settled."""
    scheme = time_scheme(joint, 1 / (frequency * STEPS), frequency=frequency)
    start = raised_state(scheme, frequency, load, cycles) if cycles else None
    found = steady_state(scheme, frequency, load, start=start, tolerance=TOLERANCE, max_cycles=60)
    return abs(found.amplitude) if found.converged else np.nan


def main() -> None:
    """Both tables."""
    assembly = assemble(parse_joint(tomllib.loads(list(joints(60, 3, 41))[2])))
    (load,) = loads_of_file(assembly)
    print("| Hz | " + " | ".join(f"{n} cycles" if n else "at once" for n in CYCLES[1:]) + " |")
    print("|---" * len(CYCLES) + "|")
    for f in RESONANCE:
        sizes = np.array([size(assembly.prepared, f, load.amplitude, n) for n in CYCLES])
        off = 100 * (sizes[1:] / sizes[0] - 1)
        print(f"| {f:.2f} | " + " | ".join("-" if np.isnan(x) else f"{x:+.2f}" for x in off) + " |")
    for n in (10, 30):
        sizes = [size(assembly.prepared, float(f), load.amplitude, n) for f in STAIRS]
        print(
            f"{n} cycles, {STAIRS[0]:.2f} to {STAIRS[-1]:.2f} Hz:",
            *(f"{1e3 * a:.2f}" for a in sizes),
        )


if __name__ == "__main__":
    main()

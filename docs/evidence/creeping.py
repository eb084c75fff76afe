"""Motions that creep: the load raised over 10, 16 and 30 cycles, marched without a search, and the end.

    python docs/evidence/creeping.py

Three lap joints at random (41 pairs) under their own loads, at a frequency of their resonance: amplitudes
after so many cycles, over that where `microslip.pipeline.creep` says that the motion ends.
"""

from __future__ import annotations

import sys
import tomllib
from pathlib import Path

import numpy as np

from microslip import parse_joint
from microslip.analyses.time.scheme import time_scheme
from microslip.analyses.time.steady import raised_state
from microslip.analyses.time.watching import watched
from microslip.pipeline.creep import crept
from microslip.pipeline.loads import loads_of_file
from microslip.pipeline.prepare import assemble
from microslip.pipeline.targets import STEPS

sys.path.insert(0, str(Path(__file__).parents[2] / "benchmarks" / "population"))

from lap_joints import joints

POINTS = ((69, 0, 621.06), (68, 9, 215.90), (68, 5, 197.02))
RAMPS = (10, 16, 30)
CYCLES = (100, 400, 800)


def main() -> None:
    """A row for each joint and ramp."""
    print("| joint, Hz | ramp | " + " | ".join(map(str, CYCLES)) + " | end, of them marched |")
    print("|---" * (len(CYCLES) + 3) + "|")
    for seed, number, f in POINTS:
        assembly = assemble(parse_joint(tomllib.loads(list(joints(seed, number + 1, 41))[number])))
        (load,) = loads_of_file(assembly)
        scheme = time_scheme(assembly.prepared, 1 / (f * STEPS), frequency=f)
        whole = 0.0
        for ramp in RAMPS:
            state = raised_state(scheme, f, load.amplitude, ramp)
            end = crept(scheme, load.amplitude, state)
            whole = whole or abs(end.amplitude)
            size = np.abs(watched(scheme, load.amplitude, state, CYCLES[-1])[0]) / whole
            cells = [f"{size[n - 1]:.4f}" for n in CYCLES]
            cells.append(f"{abs(end.amplitude) / whole:.4f} ± {end.doubt:.4f}, {end.cycles}")
            print(
                f"| {seed}/{number:03d}, {f:.2f} | {ramp} | " + " | ".join(cells) + " |", flush=True
            )


if __name__ == "__main__":
    main()

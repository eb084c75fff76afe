"""Motions that wander: what is known of their mean, and what marching them for 4000 cycles says.

    python docs/evidence/wandering.py

Lap joints at random (41 pairs) under their own loads, 150 steps per cycle, the load raised from rest.
*Marched*: mean of the last thousand of 4000 cycles without a leap, and what cycles stray from it by.
*Creeps*: what is stated by the last three drifts alone; *wanders*: by the line through the means
(`microslip.pipeline.wandering`); both with what cycles stray by, and what the mean is off by beside.
"""

from __future__ import annotations

import sys
import tomllib
from pathlib import Path

import numpy as np

from microslip import parse_joint
from microslip.analyses.time.scheme import time_scheme
from microslip.analyses.time.steady import raised_state
from microslip.analyses.time.watching import mean_of, watched
from microslip.pipeline import creep
from microslip.pipeline.loads import loads_of_file
from microslip.pipeline.prepare import assemble
from microslip.pipeline.targets import STEPS
from microslip.pipeline.wandering import wander_of

sys.path.insert(0, str(Path(__file__).parents[2] / "benchmarks" / "population"))

from lap_joints import joints

POINTS = {
    (14, 198): (201.28, 206.32, 229.84, 233.20, 250.0),
    (14, 208): (45.72, 45.82),
    (14, 213): (268.32, 280.96),
    (14, 161): (42.5,),
}
CYCLES, LAST = 4000, 1000


def main() -> None:
    """A row for each motion."""
    head = ("joint, Hz", "marched", "strays", "creeps", "off", "wanders", "off", "cycles")
    print("| " + " | ".join(head) + " |")
    print("|---" * len(head) + "|")
    for (seed, number), frequencies in POINTS.items():
        assembly = assemble(parse_joint(tomllib.loads(list(joints(seed, number + 1, 41))[number])))
        (load,) = loads_of_file(assembly)
        for f in frequencies:
            scheme = time_scheme(assembly.prepared, 1 / (f * STEPS), frequency=f)
            state = raised_state(scheme, f, load.amplitude, 10)
            size = np.abs(watched(scheme, load.amplitude, state, CYCLES)[0][-LAST:])
            mean = mean_of(size)
            cells = [f"{seed}/{number:03d}, {f:.2f}", f"{mean:.4e}"]
            cells.append(f"{100 * np.abs(size / mean - 1).max():.2f} %")
            for seen in (lambda *_: None, wander_of):
                creep.wander_of = seen
                end = creep.crept(scheme, load.amplitude, state)
                off = abs(abs(end.amplitude) / mean - 1)
                cells += [f"{100 * end.doubt:.2f} %", f"{100 * off:.3f} %"]
            print("| " + " | ".join([*cells, str(end.cycles)]) + " |", flush=True)


if __name__ == "__main__":
    main()

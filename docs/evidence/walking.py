"""Bodies that walk past each other: the offset at which they come to rest, and marching alone.

    python docs/evidence/walking.py

Two lap joints at random (41 pairs) under their own loads, raised over ten cycles, at frequencies at which all
pairs move on alike: offsets looked at, by how much they grow in a cycle there, amplitudes; then the motion
marched alone for so many cycles.
"""

from __future__ import annotations

import sys
import tomllib
from pathlib import Path

import numpy as np

from microslip import parse_joint
from microslip.analyses.time.offset import come_to_rest
from microslip.analyses.time.scheme import time_scheme
from microslip.analyses.time.steady import raised_state
from microslip.analyses.time.watching import watched
from microslip.contact.pairs import tangential_vectors
from microslip.pipeline import creep
from microslip.pipeline.loads import loads_of_file
from microslip.pipeline.prepare import assemble
from microslip.pipeline.targets import STEPS

sys.path.insert(0, str(Path(__file__).parents[2] / "benchmarks" / "population"))

from lap_joints import joints

POINTS = ((81, 1, 618.44), (82, 1, 2137.6))
CYCLES = 2400


def told(look, begin, guess):
    """The search, with a row for each offset."""

    def row(one):
        u, g = one.offset.mean(), one.rate.mean()
        print(f"| {u:.4e} | {g:.2e} | {abs(one.amplitude):.5e} |", flush=True)
        return one

    row(begin)
    return come_to_rest(lambda vector: row(look(vector)), begin, guess)


def main() -> None:
    """A table for each joint, and where marching alone leads."""
    creep.come_to_rest = told
    for seed, number, f in POINTS:
        assembly = assemble(parse_joint(tomllib.loads(list(joints(seed, number + 1, 41))[number])))
        (load,) = loads_of_file(assembly)
        scheme = time_scheme(assembly.prepared, 1 / (f * STEPS), frequency=f)
        state = raised_state(scheme, f, load.amplitude, 10)
        print(
            f"{seed}/{number:03d}, {f:.2f} Hz\n\n| offset, m | per cycle | amplitude |\n|---|---|---|"
        )
        end = creep.crept(scheme, load.amplitude, state, walk=creep.Walk())
        Q, states = watched(scheme, load.amplitude, state, CYCLES)
        print(f"\nend {abs(end.amplitude):.5e} ± {end.doubt:.1e}, {end.cycles} cycles; marched")
        print(
            f"alone {abs(Q[-1]):.5e} at {np.mean(tangential_vectors(states[-1].v, 2)):.4e} after {CYCLES}\n"
        )


if __name__ == "__main__":
    main()

"""What the refined table lacks on joints drawn at random, one ingredient after another made exact.

python docs/evidence/table_causes.py [--seed 21] [--joints 3 4 6] [--pairs 41]

At steady states of time integration, by how much the load is off that a model needs for the motion found:
the table; a quasi-static cycle of the same amplitude with the inertia of the frequency itself; the same with
the load in the cycle; and with the inertia of the upper modes put in once, at every harmonic.
"""

from __future__ import annotations

import argparse
import sys
import tomllib
from pathlib import Path

import numpy as np

sys.path.insert(0, str(Path(__file__).parents[2] / "benchmarks" / "population"))

from lap_joints import joints

from microslip.analyses.reduced.refined import HIGHEST, load_offset
from microslip.analyses.reduced.surface import contours, load_surface, stiffness
from microslip.analyses.reduced.two_mode import two_mode_model
from microslip.analyses.statics.held import hold_mode
from microslip.analyses.statics.prescribed import cycle_at, prescribed_cycle
from microslip.analyses.time.scheme import time_scheme
from microslip.analyses.time.steady import steady_state
from microslip.describe.reading import parse_joint
from microslip.errors import ContactError
from microslip.pipeline.run import Run, run

DETUNINGS = (-2.0, -0.9, 0.0, 0.9, 2.0)

UPPER, STEPS, TIME_STEPS, CYCLES = 4, 200, 150, 60


def off_at(done: Run, detuning: float) -> tuple[float, list[float]]:
    """Frequency, and relative errors of the load, four of them."""
    joint, curve, refined = done.prepared, done.responses[0], done.value("reduced")
    model = two_mode_model(joint, "refined", refined.offset)
    f = np.linspace(curve.frequency[0], curve.frequency[-1], 2001)
    surface = load_surface(model, refined.table, f, curve.load)
    guess = contours(surface, curve.load)
    k = int(np.argmin(np.abs(guess.detuning - detuning)))
    frequency, M = float(f[guess.point[k]]), curve.load
    scheme = time_scheme(joint, 1 / (frequency * TIME_STEPS), frequency=frequency)
    steady = steady_state(
        scheme, frequency, M, guess=complex(guess.amplitude[k]), max_cycles=CYCLES
    )
    Q, w, p = steady.amplitude, 2 * np.pi * frequency, model.force[0]
    D, (alpha, beta) = complex(model.linear_stiffness(w)), model.rayleigh

    def by_offset(Z: complex, c: float) -> float:
        return float(((Z * (Q + c * M) - D * c * M) / (p * M)).real - 1)

    def lossy(force: complex) -> complex:
        return force.real * (1 + 1j * w * beta) + 1j * force.imag

    def by_force(force: complex) -> float:
        return float(((D * abs(Q) + lossy(force)) * Q / abs(Q) / (p * M)).real - 1)

    c = model.offset[0]
    of_table = stiffness(
        model, surface.curve, surface.preload, np.array(abs(Q + c * M)), np.array(w)
    )
    found = [by_offset(complex(of_table), c)]
    held = hold_mode(joint, w, upper=UPPER)
    own = load_offset(held, refined.table.amplitude[0])
    cycle = cycle_at(held, abs(Q + own * M), steps=STEPS, cycles=4)
    found.append(by_offset(D + lossy(cycle.force / cycle.q), own))
    load = M * abs(Q) / Q
    cycle = prescribed_cycle(held, abs(Q), steps=STEPS, load=load, harmonics=HIGHEST)
    found.append(by_force(cycle.force))
    pushes = {}
    for n, top in enumerate(held.upper_omega):
        for h in range(2, HIGHEST + 1):
            more = (h * w) ** 2 - w**2 - 1j * h * w * (alpha + beta * top**2)
            pushes[n, h] = more * cycle.upper[n, h - 1] / (1 - more / (top**2 - w**2))
    cycle = prescribed_cycle(held, abs(Q), steps=STEPS, load=load, upper=pushes, start=cycle.state)
    return frequency, [*found, by_force(cycle.force)]


def main() -> int:
    """Print the table."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--seed", type=int, default=21)
    parser.add_argument("--joints", type=int, nargs="+", default=[3, 4, 6])
    parser.add_argument("--pairs", type=int, default=41)
    asked = parser.parse_args()
    print("| joint, Hz | table | own inertia | and the load | and upper harmonics |")
    print("|---|---|---|---|---|")
    for number, text in enumerate(joints(asked.seed, max(asked.joints) + 1, asked.pairs)):
        if number not in asked.joints:
            continue
        described = tomllib.loads(text) | {"analysis": {"response": {"count": 201}}}
        done = run(parse_joint(described))
        seen = set()
        for detuning in DETUNINGS:
            try:
                frequency, found = off_at(done, detuning)
            except ContactError as error:
                print(f"| {asked.seed}/{number:03d}, detuning {detuning:g} | {error} | | | |")
                continue
            if frequency in seen:
                continue
            seen.add(frequency)
            shares = " | ".join(f"{100 * one:.1f} %" for one in found)
            print(f"| {asked.seed}/{number:03d}, {frequency:.1f} | {shares} |", flush=True)
    return 0


if __name__ == "__main__":
    sys.exit(main())

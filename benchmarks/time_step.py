"""Speed of the time domain: steps, growth, a band, acceleration. Some ten minutes.

Steps and the triangular solve they are compared with are in processor seconds of the one thread
that works (``time.thread_time``), which other work on the machine lengthens less than wall time,
but does lengthen: caches and memory are shared. A step is a march over whole steady cycles near
resonance, over its steps; the median of the cycles. The band is in wall time.
Writes ``benchmarks/time_step.json`` and prints tables.

    python benchmarks/time_step.py            everything
    python benchmarks/time_step.py --quick    step and triangular solve only
"""

from __future__ import annotations

import argparse
import json
import platform
import statistics
import subprocess
import sys
import time
from pathlib import Path

import numpy as np
from threadpoolctl import threadpool_limits

from microslip import Failure, load_joint
from microslip.analyses.time.floquet import floquet_multipliers
from microslip.analyses.time.point import Request
from microslip.analyses.time.points import steady_states
from microslip.analyses.time.scheme import march, time_scheme
from microslip.analyses.time.steady import steady_state
from microslip.contact.pairs import STICK, touches
from microslip.model.modes import factorise, spectral_shift
from microslip.numerics import execute
from microslip.pipeline.prepare import assemble

ROOT = Path(__file__).resolve().parent.parent
EXAMPLE = ROOT / "examples" / "lap_joint.toml"
C = 2.33e-3
"""rho = C mu P L / M of the reference joint."""
STEPS = 150
RHO, FREQUENCY = 2.4, 178.5
BAND = np.linspace(165.0, 190.0, 26)
CYCLES_TIMED = 15


def assembled(pairs=201, modes=60):
    joint = load_joint(EXAMPLE)
    mesh = joint.mesh.model_copy(update={"modes": modes})
    contact = joint.contact.model_copy(update={"pairs": pairs})
    return assemble(joint.model_copy(update={"mesh": mesh, "contact": contact}))


def moment(a, rho):
    return C * a.joint.contact.friction * a.moment_unit / rho


def processor_median(work, repeats):
    """Median processor seconds of this thread over calls of `work()`, after one to warm up."""
    work()
    times = []
    for _ in range(repeats):
        start = time.thread_time()
        work()
        times.append(time.thread_time() - start)
    return statistics.median(times)


def triangular_solve(a):
    s = a.structure
    solve = factorise(s.stiffness + spectral_shift(s) * s.mass).solve
    rhs = np.sin(np.arange(s.dofs, dtype=float))
    return processor_median(lambda: solve(rhs), 21)


def step(a, rho=RHO, frequency=FREQUENCY):
    """Milliseconds of a step in the steady state, and what it takes on the way."""
    scheme = time_scheme(a.prepared, 1 / (frequency * STEPS))
    found = steady_state(scheme, frequency, moment(a, rho))
    state, load = found.cycle.state, found.cycle.load
    seconds = processor_median(lambda: march(scheme, state, load), CYCLES_TIMED)
    return {
        "ms": 1e3 * seconds / STEPS,
        "iterations": float(found.cycle.iterations[1:].mean()),
        "changes": float((np.diff(found.cycle.status, axis=0) != 0).sum() / STEPS),
        "touching": float(touches(found.cycle.status).sum(axis=1).mean()),
    }


def growth_point(pairs, modes):
    with threadpool_limits(1):
        a = assembled(pairs, modes)
        found = {
            "pairs": a.prepared.model.pairs,
            "modes": modes,
            "dofs": a.structure.dofs,
            **step(a),
        }
        return {**found, "triangular_solve_ms": 1e3 * triangular_solve(a)}


def growth(points):
    """Each in a process of its own, so that memory is given back."""
    rows = []
    for pairs, modes in points:
        code = (
            "import json, sys; sys.path.insert(0, 'benchmarks'); import time_step; "
            f"print(json.dumps(time_step.growth_point({pairs}, {modes})))"
        )
        done = subprocess.run(
            [sys.executable, "-c", code], check=True, capture_output=True, text=True, cwd=ROOT
        )
        rows.append(json.loads(done.stdout.splitlines()[-1]))
        print(rows[-1], flush=True)
    return rows


def band(a, rho, threads=2):
    """Wall seconds of 26 accelerated steady states from rest."""
    friction = a.joint.contact.friction
    asked = [Request(rho, f, moment(a, rho), friction, 0.0, max_cycles=120) for f in BAND]
    start = time.perf_counter()
    found = list(steady_states(a.prepared, asked, executor=execute.threads(threads)))
    seconds = time.perf_counter() - start
    points = [p for p in found if not isinstance(p, Failure)]
    return {
        "rho": rho,
        "seconds": seconds,
        "threads": threads,
        "converged": sum(p.steady.converged for p in points),
        "failed": [str(p) for p in found if isinstance(p, Failure)],
        "cycles": sum(p.steady.cycles for p in points),
    }


ACCELERATION = {"sticking": (1e-5, 2800), "mixed": (1e-4, 500), "slipping": (4e-4, 500)}
"""Moment over P L, cycles marched; 3 Hz above the sliding frequency."""


def acceleration(a):
    """Cycles to a change of 1e-5, accelerated and marched, and how far the answers differ."""
    frequency = a.mode.sliding_frequency + 3
    scheme = time_scheme(a.prepared, 1 / (frequency * STEPS))
    rows = []
    for name, (ratio, cycles) in ACCELERATION.items():
        load = ratio * a.moment_unit
        fast = steady_state(scheme, frequency, load, tolerance=1e-5)
        strict = steady_state(scheme, frequency, load, tolerance=1e-6)
        slow = steady_state(
            scheme, frequency, load, accelerate=False, tolerance=0.0, max_cycles=cycles
        )
        reached = slow.history < 1e-5
        refined = floquet_multipliers(scheme, fast)

        def apart(one, other=slow):
            return abs(one.amplitude - other.amplitude) / abs(other.amplitude)

        rows.append(
            {
                "case": name,
                "moment_over_clamp_force_length": ratio,
                "stick_share": float(np.mean(fast.cycle.status == STICK)),
                "cycles": fast.cycles,
                "cycles_strict": strict.cycles,
                "cycles_marched": int(np.argmax(reached)) + 1 if reached.any() else None,
                "amplitude_difference": apart(fast),
                "amplitude_difference_strict": apart(strict),
                "dissipation_difference": abs(fast.cycle.dissipated / slow.cycle.dissipated - 1),
                "multiplier_by_product": float(abs(fast.multipliers[0])),
                "multiplier": refined.largest,
                "multiplier_cycles": refined.cycles,
            }
        )
        print(rows[-1], flush=True)
    return rows


def exponent(rows, variable):
    """Slope of log(ms) against log(variable) over the upper half of the range."""
    half = rows[len(rows) // 2 - 1 :]
    return float(
        np.polyfit(np.log([r[variable] for r in half]), np.log([r["ms"] for r in half]), 1)[0]
    )


def main():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--quick", action="store_true", help="step and triangular solve only")
    options = parser.parse_args()
    found = {"machine": platform.processor() or platform.machine()}
    with threadpool_limits(1):
        a = assembled()
        found["triangular_solve_ms"] = 1e3 * triangular_solve(a)
        found["step"] = [
            {"rho": rho, "frequency_hz": f, **step(a, rho, f)}
            for rho, f in ((5.0, 180.5), (RHO, FREQUENCY), (0.8, 175.0))
        ]
        for row in found["step"]:
            row["over_triangular_solve"] = row["ms"] / found["triangular_solve_ms"]
        print(json.dumps(found, indent=1), flush=True)
        if options.quick:
            return
        found["band"] = [band(a, rho) for rho in (0.8, 2.4, 5.0)]
        print(found["band"], flush=True)
        found["acceleration"] = acceleration(assembled(101))
    found["growth_pairs"] = growth([(n, 60) for n in (51, 101, 201, 401, 801)])
    found["growth_modes"] = growth([(201, k) for k in (20, 40, 60, 80, 120)])
    found["growth_exponents"] = {
        "pairs": exponent(found["growth_pairs"], "pairs"),
        "modes": exponent(found["growth_modes"], "modes"),
    }
    (ROOT / "benchmarks" / "time_step.json").write_text(json.dumps(found, indent=1) + "\n")
    print(found["growth_exponents"])


if __name__ == "__main__":
    main()

"""Steady states over time of random lap joints: what each motion is.

python benchmarks/population/time_points.py [--seeds 61 62 63] [--count 17] [--out FILE]

Every joint under its own load at three frequencies of its band (from below the sliding to above
the stuck frequency, fifteen rough searches): that of the largest answer and the two flanks where
it is half as large, or the ends of the band. From rest, the load raised over ten cycles, 150
steps per cycle, 101 pairs (`--pairs`); at most 400 cycles of search. Every periodic motion has its largest
Floquet multiplier and its error; one that is unstable is left for a stable one; what does not end in
a periodic motion is classified. Lines in FILE (JSON, one a point) are not computed again.
"""

from __future__ import annotations

import argparse
import sys
import time
import tomllib
from collections import Counter
from collections.abc import Callable, Sequence
from pathlib import Path

import numpy as np
from lap_joints import joints
from resumed import keep_row, kept_rows

from microslip.analyses.prepared.joint import PreparedJoint
from microslip.analyses.time.classify import motion_of
from microslip.analyses.time.point import Request
from microslip.analyses.time.points import solve_request
from microslip.analyses.time.scheme import time_scheme
from microslip.analyses.time.steady import steady_state
from microslip.describe.reading import parse_joint
from microslip.errors import JointOpensError, MicroslipError
from microslip.pipeline.prepare import assemble

STEPS, CYCLES = 150, 400

FLANKS = ((-1, "below"), (0, "peak"), (1, "above"))


def frequencies(joint: PreparedJoint, load: float) -> list[float]:
    """Peak and the flanks where the answer is half as large, from fifteen rough searches."""
    low, high = sorted((joint.principal().sliding_frequency, joint.principal().stuck_frequency))
    band = np.linspace(low - 0.5 * (high - low), high + 0.1 * (high - low), 15)
    size = []
    for f in band:
        scheme = time_scheme(joint, 1 / (f * 60), frequency=f)
        found = steady_state(scheme, f, load, tolerance=1e-2, max_cycles=15)
        size.append(abs(found.amplitude))
    size = np.array(size)
    top = int(np.argmax(size))
    half = size > 0.5 * size[top]
    below = next((i for i in range(top, -1, -1) if not half[i]), 0)
    above = next((i for i in range(top, len(band)) if not half[i]), len(band) - 1)
    return [float(band[i]) for i in (below, top, above)]


def raised(frequency: float, load: float, refinement: int = 1) -> Request:
    """A point of a population, from rest with the load raised."""
    return Request(
        rho=float("nan"),
        frequency=frequency,
        load=load,
        friction=None,
        guess=0j,
        steps=STEPS,
        max_cycles=CYCLES,
        refinement=refinement,
        past="raised",
    )


def point(joint: PreparedJoint, frequency: float, load: float) -> dict:
    """Search, its stability and error, and classification of what it ends in."""
    began = time.perf_counter()
    request = raised(frequency, load)
    try:
        found = solve_request(joint, request)
    except JointOpensError as error:
        return {"kind": "opens", "said": str(error), "seconds": time.perf_counter() - began}
    steady, left = found.steady, found.left
    scheme = time_scheme(joint, 1 / (frequency * STEPS), frequency=frequency)
    motion = found.motion or motion_of(scheme, steady)
    return {
        "kind": motion.kind,
        "said": motion.said,
        "settled": found.settled,
        "verdict": found.verdict,
        "multiplier": found.stability.largest if found.stability else None,
        "error": found.error,
        "steps": found.steps,
        "left": left.stability.largest if left and left.stability else None,
        "cycles": steady.cycles,
        "change": motion.change,
        "size": motion.size,
        "open_share": motion.open_share,
        "walk": motion.walk,
        "amplitude": abs(steady.amplitude),
        "dissipative_steps": int(steady.cycle.dissipative.sum()),
        "normal_over_dissipated": steady.cycle.normal_work / max(steady.cycle.dissipated, 1e-300),
        "unsolved": steady.unsolved,
        "seconds": time.perf_counter() - began,
    }


def report(rows: list[dict]) -> None:
    """Counts of kinds and verdicts, how many unstable motions were left, errors, cycles and seconds."""
    print(dict(Counter(row["kind"] for row in rows)), "of", len(rows))
    settled = [row for row in rows if row.get("settled")]
    if not settled:
        return
    print("settled:", len(settled), dict(Counter(row["verdict"] for row in settled)))
    print("with more steps:", sum(row["steps"] > STEPS for row in settled))
    print("unstable motions left:", sum(row["left"] is not None for row in rows if "left" in row))
    for name in ("error", "multiplier", "cycles", "seconds"):
        values = np.array([row[name] for row in settled if row[name] is not None], float)
        print(f"{name}: median {np.nanmedian(values):.2g}, largest {np.nanmax(values):.3g}")


def every_point(
    title: str,
    row_of: Callable[[PreparedJoint, float, float], dict],
    seeds: Sequence[int],
    out: Path,
) -> list[dict]:
    """Rows of all points of the populations asked for; what the file has is not computed again.

    `row_of` has joint, frequency and load, and gives a row in which ``said`` is a line to print.
    """
    parser = argparse.ArgumentParser(description=title.splitlines()[0])
    parser.add_argument("--seeds", type=int, nargs="+", default=seeds)
    parser.add_argument("--count", type=int, default=17)
    parser.add_argument("--pairs", type=int, default=101)
    parser.add_argument("--out", type=Path, default=out)
    asked = parser.parse_args()
    done = {(row["joint"], row["where"]): row for row in kept_rows(asked.out)}
    for seed in asked.seeds:
        for number, text in enumerate(joints(seed, asked.count, asked.pairs)):
            name = f"{seed}/{number:03d}"
            if (name, "above") in done:
                continue
            try:
                a = assemble(parse_joint(tomllib.loads(text)))
                load = a.joint.load.moment_over_clamp_force_length[0] * a.moment_unit
                wanted = frequencies(a.prepared, load)
            except MicroslipError as error:
                wanted, said = [float("nan")] * 3, str(error)
            for f, (_, where) in zip(wanted, FLANKS, strict=True):
                row = {"joint": name, "where": where, "frequency": f}
                try:
                    if not np.isfinite(f):
                        raise MicroslipError(said)
                    row |= row_of(a.prepared, f, load)
                except MicroslipError as error:
                    row |= {"kind": "failed", "said": str(error)}
                done[name, where] = row
                keep_row(asked.out, row)
                print(name, where, f"{f:.5g} Hz", row["said"][:150], row.get("cycles"), flush=True)
    return list(done.values())


def main() -> int:
    """Compute what is missing and print the counts."""
    report(every_point(__doc__, point, [61, 62, 63], Path("time-points.jsonl")))
    return 0


if __name__ == "__main__":
    sys.exit(main())

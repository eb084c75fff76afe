"""What the steps of time integration do to steady states, and what is said of it: random lap joints.

python benchmarks/population/step_refinement.py [--seeds 80 83] [--count 17] [--pairs 101] [--out FILE]

Every joint under its own load at the three frequencies of `time_points.py`. Each settled point is found
as `[analysis.time]` finds it, with 150 steps per cycle and sought on with 1,200, and with 2,400 and 4,800
where that changes it; the limit is the same motion with 9,600 steps, from there. Then, from the end of that,
so that all have the same tractions locked in, with 75, 150 and 300 steps, alone and sought on in the same
way. Lines in FILE are not computed again.
"""

from __future__ import annotations

import sys
from dataclasses import replace
from pathlib import Path

import numpy as np
from time_points import STEPS, every_point, raised

from microslip.analyses.prepared.joint import PreparedJoint
from microslip.analyses.time.point import Request, TimePoint
from microslip.analyses.time.points import solve_request
from microslip.analyses.time.scheme import time_scheme
from microslip.analyses.time.starts import Start
from microslip.analyses.time.steady import SteadyState, steady_state
from microslip.analyses.time.step_refinement import REFINEMENT, with_finer_steps

COUNTS, FINEST = (75, 150, 300), 9600

ASKED = {75: 1e-3, 150: 3e-4, 300: 1e-4}
"""Errors of the amplitude asked for."""

ROUNDING = 3e-5
"""What a search to 1e-5 leaves open counts for no error of a statement."""


def sought(
    joint: PreparedJoint, request: Request, steps: int, start: Start, tolerance: float
) -> SteadyState | None:
    """The steady state beside a start with so many steps, or None."""
    f = request.frequency
    scheme = time_scheme(joint, 1 / (f * steps), frequency=f)
    found = steady_state(scheme, f, request.load, start=start, tolerance=tolerance, max_cycles=100)
    return found if found.converged else None


def sought_on(joint: PreparedJoint, request: Request, alone: SteadyState) -> SteadyState:
    """A motion of the steps of a request as a point shows it: with more of them, where it settles so."""
    nan = float("nan")
    found = TimePoint(nan, nan, alone, error=alone.change, steps=request.steps)
    return with_finer_steps(joint, request, found).steady


def point(joint: PreparedJoint, request: Request) -> dict:
    """One point, its limit, and the same motion with other steps."""
    plain = solve_request(joint, replace(request, refinement=1))
    if not plain.settled:
        return {"settled": False}
    found = solve_request(joint, request)
    row = {
        "settled": found.settled,
        "steps": found.steps,
        "steps_error": found.steps_error,
        "settling": found.error,
        "seconds": found.steady.seconds,
        "seconds_plain": plain.steady.seconds,
        "walked": found.walked,
    }
    limit = sought(joint, request, FINEST, found.steady.end, 2e-6)
    if limit is None:
        return row
    Q = limit.amplitude

    def off(steady: SteadyState | None) -> tuple[float, float] | None:
        """Relative errors of amplitude and of the first harmonic."""
        if steady is None:
            return None
        apart = abs(steady.amplitude - Q) / abs(Q)
        return abs(steady.amplitude) / abs(Q) - 1, apart

    row |= {"plain": off(plain.steady), "refined": off(found.steady)}
    for count in COUNTS:
        alone = sought(joint, request, count, limit.end, 5e-6)
        row[f"alone_{count}"] = off(alone)
        row[f"on_{count}"] = alone and off(sought_on(joint, replace(request, steps=count), alone))
    return row


def report(rows: list[dict]) -> None:
    """Errors, what is said of them, and how many points hold what is asked."""
    known = [row for row in rows if row.get("refined")]
    print(f"{len(rows)} points, {sum(bool(row.get('settled')) for row in rows)} settled, ", end="")
    finer = np.mean([row["steps"] > REFINEMENT * STEPS for row in known])
    print(f"{100 * finer:.0f} % with more than {REFINEMENT * STEPS} steps, ", end="")
    longer = np.median([row["seconds"] / row["seconds_plain"] for row in known])
    print(f"{len(known)} with a limit, {longer:.2f} times as long in the median")
    for name in ("plain", "refined"):
        e = np.abs([row[name][0] for row in known])
        print(
            f"{name}: median {np.median(e):.1e}, within 3e-4 {100 * np.mean(e <= 3e-4):.1f} %, "
            f"within 3e-3 {100 * np.mean(e <= 3e-3):.1f} %, worst {e.max():.1e}"
        )
    said = [row for row in known if np.isfinite(row["steps_error"])]
    for what, k in (("amplitude", 0), ("first harmonic", 1)):
        held = [abs(row["refined"][k]) <= row["steps_error"] + ROUNDING for row in said]
        print(f"{what} within what is said: {100 * np.mean(held):.1f} % of {len(held)}")
    stated = np.array([row["steps_error"] for row in said])
    print(
        f"said: median {np.median(stated):.1e}, beyond 1e-2 {100 * np.mean(stated > 1e-2):.1f} %, "
        f"not known at {len(known) - len(said)}"
    )
    for way in ("alone", "on"):
        for count, asked in ASKED.items():
            e = np.array(
                [abs(row[f"{way}_{count}"][0]) for row in known if row.get(f"{way}_{count}")]
            )
            print(
                f"{way} {count}: median {np.median(e):.1e}, worst {e.max():.1e}, "
                f"within {asked:g}: {100 * np.mean(e <= asked):.1f} % of {len(e)}"
            )


def row_of(joint: PreparedJoint, frequency: float, load: float) -> dict:
    """A row of the study, with a line that says it."""
    row = point(joint, raised(frequency, load, REFINEMENT))
    return row | {"said": f"steps_error {row.get('steps_error')}, off by {row.get('refined')}"}


def main() -> int:
    """Compute what is missing and print the counts."""
    report(every_point(__doc__, row_of, [80, 83], Path("step-refinement.jsonl")))
    return 0


if __name__ == "__main__":
    sys.exit(main())

"""Harmonic balance on random lap joints, against time integration on the same branch.

python benchmarks/population/harmonic.py [--seeds 31 32 33] [--count 20] [--out FILE] [--page FILE]

Every joint under its own load: harmonic balance with adaptive harmonics at the frequency of its largest
answer, at the two flanks where it is half as large, and at the ends of its band (from below the sliding to
above the stuck frequency; `time_points.frequencies`). Every response at the three is integrated over time
from its own state, 500 steps per cycle, and twice as many up to 4,000 until the motion stays with it and the
amplitude changes by less than 5e-4: where it settles next to it, the two are compared; where it leaves a
response, Hill's exponents say whether it is unstable. With the finest of these steps it is integrated from
the state of the response once more: by how much the two differ is what the truth leaves open, as motions with
another past may lock in other tractions. Beside that, time integration from rest, the load
raised over ten cycles: does harmonic balance have the motion that it settles in? Lines in FILE (JSON, one a
joint) are not computed again.
"""

from __future__ import annotations

import sys
import time
import tomllib
from functools import partial

import numpy as np
from resumed import answered, drawn_joints, study
from time_points import frequencies

from microslip.analyses.harmonic.adaptive import Adaptive
from microslip.analyses.harmonic.hill import exponents_of
from microslip.analyses.harmonic.over_time import OverTime, state_from_point
from microslip.analyses.harmonic.points import HarmonicPoint, distance
from microslip.analyses.harmonic.problem import harmonic_problem
from microslip.analyses.harmonic.response import HarmonicResponse, frequency_response
from microslip.analyses.prepared.joint import PreparedJoint
from microslip.analyses.time.resting import WalksOnError, rested
from microslip.analyses.time.scheme import time_scheme
from microslip.analyses.time.starts import Start
from microslip.analyses.time.steady import SteadyState, raised_state, steady_state
from microslip.describe.reading import parse_joint
from microslip.errors import MicroslipError
from microslip.pipeline.prepare import assemble

STEPS, RAISED, CYCLES = 500, 10, 400

TOLERANCE = 1e-5
"""Change per cycle of a motion whose bodies have been brought on."""

FINEST, SURE = 4000, 5e-4
"""Steps per cycle at most, and change of the amplitude from half as many at which they are enough."""

NEAR = 0.03
"""Relative distance of amplitudes (`points.distance`) within which two motions count as the same one."""

ASKED = 0.003

PAGE = """# Harmonic balance on lap joints at random

Lap joints of populations that it was not developed on, each under the load that it was drawn with: harmonic
balance with adaptive harmonics at its peak and its two flanks, and time integration from the state that
harmonic balance gives (`python benchmarks/population/harmonic.py`), 500 steps per cycle, and twice as many up
to 4,000 until the motion stays with the response and the amplitude changes by less than 5e-4. *Settled*: the
state changes by at most 3e-5 per cycle within 400 cycles, next to the response; its bodies stand where those
of the response do, so that differences say nothing of that place. *Left*: it settles elsewhere, or nowhere.

"""


def over_time(joint: PreparedJoint, point: HarmonicPoint) -> tuple[SteadyState, float]:
    """Time integration from the state of a response; what twice the steps have changed of its amplitude last.

    Where it leaves the response or does not settle, finer steps start from its state again: coarse ones can
    leave what finer ones do not. Where finer steps than those of a motion that has settled do not settle, or
    settle elsewhere, those before count.
    """
    first: SteadyState | None = None
    near: SteadyState | None = None
    changed, steps = np.inf, STEPS
    while changed > SURE and steps <= FINEST:
        finer = settled(joint, point, steps, None if near is None else near.end)
        first = finer if first is None else first
        if near is None:
            near = finer if beside(point, finer) else None
        elif finer.converged and distance(finer.amplitude, near.amplitude) <= NEAR:
            changed = abs(abs(finer.amplitude) / abs(near.amplitude) - 1)
            near = finer
        else:
            break
        steps *= 2
    assert first is not None
    return (first if near is None else near), changed


def settled(
    joint: PreparedJoint, point: HarmonicPoint, steps: int, start: Start | None = None
) -> SteadyState:
    """Where time integration settles from the state of a response, or from a start."""
    scheme = time_scheme(joint, 1 / (point.frequency * steps), frequency=point.frequency)
    begin = state_from_point(scheme, point) if start is None else start
    return steady_state(scheme, point.frequency, point.load, start=begin, max_cycles=CYCLES)


def left_open(joint: PreparedJoint, point: HarmonicPoint, found: SteadyState) -> float | None:
    """Difference from the motion with the same steps from the response's own state; None without one."""
    if not beside(point, found) or found.steps == STEPS:
        return None
    own = settled(joint, point, found.steps)
    if not beside(point, own):
        return None
    return float(abs(abs(own.amplitude) / abs(found.amplitude) - 1))


def beside(point: HarmonicPoint, found: SteadyState) -> bool:
    """Whether a motion has settled next to a response, in phase as well."""
    return bool(found.converged and distance(point.amplitude, found.amplitude) <= NEAR)


def from_rest(joint: PreparedJoint, frequency: float, load: float) -> SteadyState:
    """Time integration from rest, the load raised slowly; bodies that walk at rest or on by 4000 cycles."""
    scheme = time_scheme(joint, 1 / (frequency * STEPS), frequency=frequency)
    start = raised_state(scheme, frequency, load, RAISED)
    found = steady_state(scheme, frequency, load, start=start, max_cycles=CYCLES)
    try:
        at_rest = rested(scheme, found, TOLERANCE, begin=start)
    except WalksOnError:
        return found
    return found if at_rest is None else at_rest.steady


def compared(joint: PreparedJoint, point: HarmonicPoint) -> dict:
    """A response beside the motion that time integration makes of it."""
    found, changed = over_time(joint, point)
    error = abs(abs(point.amplitude) / abs(found.amplitude) - 1)
    row = {
        "frequency": point.frequency,
        "amplitude": abs(point.amplitude),
        "harmonics": point.harmonics,
        "tail": point.tail,
        "stated": point.error,
        "walk": point.walk,
        "seconds": point.seconds,
        "settled": bool(found.converged),
        "cycles": found.cycles,
        "change": found.change,
        "error": float(error),
        "steps": found.steps,
        "changed": float(changed),
        "open": left_open(joint, point, found),
        "near": beside(point, found),
        "stable": None,
    }
    if not row["near"]:
        try:
            row["stable"] = exponents_of(point).stable
        except MicroslipError as said:
            row["said"] = str(said)
    return row


def balance(
    joint: PreparedJoint, load: float, wanted: list[float], harmonics: int
) -> HarmonicResponse:
    """Responses at the wanted frequencies and at the ends of the band."""
    low, high = sorted((joint.principal().sliding_frequency, joint.principal().stuck_frequency))
    ends = (low - 0.5 * (high - low), high + 0.1 * (high - low))
    return frequency_response(
        harmonic_problem(joint, harmonics=harmonics),
        load,
        sorted({*wanted, *ends}),
        adaptive=Adaptive(),
        over_time=OverTime(joint, load),
    )


def measured(joint: PreparedJoint, load: float) -> dict:
    """What one joint says of the method."""
    wanted = sorted(set(frequencies(joint, load)))
    began = time.process_time()
    response = balance(joint, load, wanted, 5)
    seconds = time.process_time() - began
    points = [compared(joint, point) for point in response.points if point.frequency in wanted]
    rest = []
    for frequency in wanted:
        found = from_rest(joint, frequency, load)
        sizes = [p["amplitude"] for p in points if p["frequency"] == frequency]
        misses = [abs(size / abs(found.amplitude) - 1) for size in sizes]
        rest.append(
            {
                "frequency": frequency,
                "settled": bool(found.converged),
                "amplitude": abs(found.amplitude),
                "nearest": min(misses, default=None),
            }
        )
    return {
        "wanted": wanted,
        "balance_seconds": seconds,
        "branches": [branch.ended for branch in response.branches],
        "points": points,
        "rest": rest,
        "failures": [str(failure) for failure in response.failures],
    }


def page(rows: dict[str, dict]) -> str:
    """The table as Markdown."""
    found = [row for row in rows.values() if "points" in row]
    populations = sorted({name.partition("/")[0] for name in rows})
    points = [p for row in found for p in row["points"]]
    near = [p for p in points if p["near"]]
    left = [p for p in points if not p["near"]]
    rest = [r for row in found for r in row["rest"] if r["settled"]]
    missed = [r for r in rest if r["nearest"] is None or r["nearest"] > NEAR]
    error = np.array([p["error"] for p in near])
    stated = np.array([p["stated"] for p in near], dtype=float)
    open_ = np.array([p.get("open") or 0.0 for p in near])
    seconds = [row["balance_seconds"] for row in found]
    sure = stated <= Adaptive().tolerance

    def share(true: np.ndarray) -> str:
        return f"{100 * np.mean(true):.1f} % of {len(true)}" if len(true) else "–"

    asked = sum(len(set(row["wanted"])) for row in found)
    answered = sum(len({p["frequency"] for p in row["points"]}) for row in found)
    lines = [
        f"| | {len(found)} joints of population {', '.join(populations)} |",
        "|---|---|",
        f"| points asked for that have a response | {answered} of {asked} |",
        f"| responses | {len(points)} |",
        f"| beside which time integration settles | {len(near)} |",
        f"| of these, with steps that change the amplitude by less than {SURE:g} | "
        f"{sum(p['changed'] <= SURE for p in near)} |",
        f"| left by it, unstable by Hill's exponents | {sum(p['stable'] is False for p in left)} |",
        f"| left by it, not unstable | {sum(p['stable'] is not False for p in left)} |",
        f"| difference at most {100 * ASKED:g} % | {share(error <= ASKED)} |",
        f"| difference at most {100 * ASKED:g} % and what the truth leaves open | "
        f"{share(error <= ASKED + open_)} |",
        f"| stated error at most {100 * Adaptive().tolerance:g} % | {share(sure)} |",
        f"| of these, difference at most {100 * ASKED:g} % | {share(error[sure] <= ASKED)} |",
        f"| difference at most the stated error | {share(error <= stated)} |",
        f"| the same, and what the truth leaves open | {share(error <= stated + open_)} |",
        f"| the truth leaves open more than {SURE:g} | {share(open_ > SURE)} |",
        f"| difference, median | {np.median(error):.1e} |",
        f"| harmonics, median and most | {np.median([p['harmonics'] for p in near]):.0f}, "
        f"{max(p['harmonics'] for p in near)} |",
        f"| motions from rest that settle | {len(rest)} of {asked} |",
        f"| of these, not among the responses | {len(missed)} |",
        f"| processor time of a joint, median and most | {np.median(seconds):.1f} s, "
        f"{max(seconds):.1f} s |",
    ]
    failed = [f"| {name} | {row['failed']} |" for name, row in rows.items() if "failed" in row]
    if failed:
        lines += ["", "| joint | failed |", "|---|---|", *failed]
    wrong = [
        f"| {name} | {p['frequency']:.5g} | {100 * p['error']:.2f} % | {100 * p['stated']:.2f} % | "
        f"{100 * (p.get('open') or 0.0):.2f} % | {p['harmonics']} | {p['tail']:.3f} |"
        for name, row in rows.items()
        for p in row.get("points", [])
        if p["near"] and p["error"] > ASKED
    ]
    if wrong:
        lines += ["", f"Beyond {100 * ASKED:g} %:", ""]
        lines += [
            "| joint | Hz | difference | stated | left open | harmonics | tail |",
            "|---|---|---|---|---|---|---|",
        ]
        lines += wrong
    return PAGE + "\n".join(lines) + "\n"


def row_of(text: str) -> dict:
    """What one joint says under its own load, or why it says nothing."""
    began = time.perf_counter()
    try:
        a = assemble(parse_joint(tomllib.loads(text)))
        load = a.joint.load.moment_over_clamp_force_length[0] * a.moment_unit
        row = measured(a.prepared, load)
    except MicroslipError as error:
        row = {"failed": str(error)}
    return {"wall": time.perf_counter() - began, **row}


def told(row: dict) -> str:
    """Difference, stated error and harmonics of every response of a joint."""
    points = [
        f"{100 * p['error']:.2f}%({100 * p['stated']:.2f}%,{p['harmonics']})"
        + ("" if p["near"] else " left")
        for p in row.get("points", [])
    ]
    return " ".join([*points, row.get("failed", "")])


def main() -> int:
    """Compute what is missing and print the table."""
    asked = study(__doc__, [31, 32, 33], 51, "population-harmonic.jsonl").parse_args()
    cases = ((name, partial(row_of, text)) for name, _, text in drawn_joints(asked))
    return answered(asked, cases, page, told)


if __name__ == "__main__":
    sys.exit(main())

"""Outputs of responses that steady states put right, against time integration that knows nothing of them.

python benchmarks/population/outputs.py [--seeds 11] [--first 0] [--count 20] [--pairs 41]
    [--method corrected] [--out FILE] [--page FILE]

Every joint has the three outputs of a file that names none: deflection, rotation and slip. Each is looked
at in the band that the method chooses, and above the joint's own mode, from 1.3 to 3 times its stuck
frequency, where upper modes are. At the peak of a response, at its flanks and at five frequencies at random a
steady state is sought with twice the time steps, from rest with the velocity of the amplitude that is shown,
and its outputs are read from a cycle of it.

Lines in FILE (JSON, one a band) are not computed again.
"""

from __future__ import annotations

import sys
import time
import tomllib
from functools import partial

import numpy as np
from auto import frequencies
from resumed import answered, drawn_joints, study

from microslip.analyses.reduced.response import Response
from microslip.analyses.time.offset import BRANCH
from microslip.analyses.time.scheme import time_scheme
from microslip.analyses.time.steady import steady_state
from microslip.describe.reading import parse_joint
from microslip.errors import MicroslipError
from microslip.numerics.execute import each, threads
from microslip.numerics.fourier import harmonic, without_drift
from microslip.pipeline.outputs import harmonics_by_name, with_outputs
from microslip.pipeline.prepare import prepare
from microslip.pipeline.run import Run, run

STEPS, CYCLES, SETTLED = 300, 400, 1e-5
"""Per cycle of a truth, cycles at most, and change over one."""

ASKED, SMALL = 0.01, 0.01
"""The error that is asked for, and the share of the largest size of an output that
errors are relative to where its own is smaller."""

ABOVE, POINTS = (1.3, 3.0), 301
"""Band above the own mode, over its stuck frequency, and frequencies in it."""

BANDS = {False: "## About the own mode", True: "## Above it, where upper modes are"}

HEAD = """# Outputs on lap joints at random

Lap joints at random that it was not developed on, under the loads that they were drawn with: the
outputs of responses by `method = "{method}"`, defaults, at the peak, the flanks and five frequencies at
random, against a cycle of a steady state that is sought from rest with twice the time steps
(`python benchmarks/population/outputs.py`, {pairs} contact pairs). *Model*: what the reduced model
makes of the same amplitude. *Shown*: put right by steady states. Errors are relative to the size, or to a
hundredth of the largest in the band. *Claimed*: at most 1 % is stated.
"""


def measured(done: Run, seconds: float, rng: np.random.Generator) -> dict:
    """Errors of every output at some frequencies."""
    curve = done.responses[0]
    refined = done.value("reduced")
    model = refined.model_of(done.assembly)
    plain = with_outputs(done.assembly, {"refined": (model, refined.table)}, curve)
    points = [
        found
        for found in each(
            lambda k: _point(done, curve, plain, k), frequencies(curve, rng), threads()
        )
        if found is not None
    ]
    return {"seconds": seconds, "states": len(curve.anchors), "points": points}


def _point(done: Run, curve: Response, plain: Response, k: int) -> dict | None:
    """Errors at a frequency; None where no steady state of the branch shown is found."""
    f, Q = float(curve.frequency[k]), complex(curve.amplitude[k])
    scheme = time_scheme(done.prepared, 1 / (f * STEPS), frequency=f)
    try:
        end = steady_state(scheme, f, curve.load, guess=Q, tolerance=SETTLED, max_cycles=CYCLES)
    except MicroslipError:
        return None
    if not end.converged or abs(np.log(abs(end.amplitude / Q))) > BRANCH:
        return None
    theta = end.phase + np.linspace(0, 2 * np.pi, len(end.cycle.output))
    motion = harmonic(without_drift(end.cycle.output, theta), theta)
    true = harmonics_by_name(done.assembly, motion, 2 * np.pi * f)
    found = {}
    for name, y in true.items():
        least = max(abs(y), SMALL * float(np.abs(curve.outputs[name]).max()))
        off = [abs(abs(one.outputs[name][k]) - abs(y)) / least for one in (plain, curve)]
        found[name] = [*map(float, off), float(curve.output_errors[name][k])]
    return {"frequency": f, "amplitude": float(curve.error_indicator[k]), "outputs": found}


def page(rows: dict[str, dict], method: str) -> str:
    """The page as Markdown."""
    pairs = " and ".join(map(str, sorted({row["pairs"] for row in rows.values()})))
    lines = [HEAD.format(method=method, pairs=pairs)]
    for above, title in BANDS.items():
        mine = {name: row for name, row in rows.items() if row["above"] == above}
        points = [point for row in mine.values() for point in row["points"]]
        if points:
            some = ", ".join(dict.fromkeys(name.partition("/")[0] for name in mine))
            lines += [
                title,
                "",
                f"{len(mine)} joints of population {some}, {len(points)} points.",
                "",
            ]
            lines += [*table(points), ""]
    return "\n".join(lines)


def table(points: list[dict]) -> list[str]:
    """Lines of what outputs are off by at points."""
    lines = [
        "| output | model: median, worst | shown: median, worst | stated, median | shown <= 1 % | claimed "
        "| claims <= 1 % | error <= stated |",
        "|---|---|---|---|---|---|---|---|",
    ]
    for name in dict.fromkeys(name for point in points for name in point["outputs"]):
        model, shown, stated = np.array([point["outputs"][name] for point in points]).T
        claimed = stated <= ASKED
        right = f"{np.mean(shown[claimed] <= ASKED):.1%}" if claimed.any() else "-"
        lines.append(
            f"| {name} | {np.median(model):.2%}, {model.max():.2%} "
            f"| {np.median(shown):.2%}, {shown.max():.2%} "
            f"| {np.median(stated):.2%} | {np.mean(shown <= ASKED):.1%} | {np.mean(claimed):.1%} | {right} "
            f"| {np.mean(shown <= stated):.1%} |"
        )
    return lines


def row_of(text: str, seed: int, pairs: int, method: str, above: bool) -> dict:
    """A joint's row."""
    began = time.perf_counter()
    asked = {"method": method}
    if above:
        own = prepare(parse_joint(tomllib.loads(text))).mode.stuck_omega / (2 * np.pi)
        low, high = (f"{share * own:.6g} Hz" for share in ABOVE)
        asked |= {"from": low, "to": high, "count": POINTS}
    done = run(parse_joint(tomllib.loads(text) | {"analysis": {"response": asked}}))
    seconds = time.perf_counter() - began
    found = (
        measured(done, seconds, np.random.default_rng(seed))
        if done.responses and done.responses[0].output_errors
        else {"seconds": seconds, "states": 0, "points": []}
    )
    return {"pairs": pairs, "above": above, "wall": time.perf_counter() - began, **found}


def main() -> int:
    """Compute what is missing and print the table."""
    parser = study(__doc__, [11], 41, "population-outputs.jsonl")
    parser.add_argument("--method", choices=("corrected", "auto"), default="corrected")
    asked = parser.parse_args()
    cases = (
        (
            name + (" above" if above else ""),
            partial(row_of, text, seed, asked.pairs, asked.method, above),
        )
        for name, seed, text in drawn_joints(asked)
        for above in BANDS
    )
    return answered(asked, cases, lambda rows: page(rows, asked.method))


if __name__ == "__main__":
    sys.exit(main())

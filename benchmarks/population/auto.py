"""Method "auto" on random lap joints, against time integration that knows nothing of it.

python benchmarks/population/auto.py [--seeds 21 22 23] [--count 20] [--pairs 101]
    [--loads 1 0.3] [--out FILE] [--page FILE]

Every joint under its own load, or shares of it: the response by method "auto" with its defaults, then
steady states at the peak, at the flanks where it is half as large, and at five frequencies at random, each
after the load was raised from rest over 30 cycles, with a finer tolerance: the past that is meant, but more
slowly than the method ever raises it. Where that lands on another branch of a fold, it is sought from rest
with the velocity of the motion shown, and that failing the branch shown is followed from the side, in small
steps. The plain refined model is measured at the same points. Lines in FILE (JSON, one a joint) are not
computed again: stop it at any time, and go on with the same command.
"""

from __future__ import annotations

import sys
import time
import tomllib

import numpy as np
from resumed import joints_left, keep_row, kept_rows, study

from microslip.analyses.prepared.joint import PreparedJoint
from microslip.analyses.reduced.response import Response
from microslip.analyses.reduced.surface import contours, load_surface
from microslip.analyses.reduced.sweep import CONVERGED
from microslip.analyses.reduced.two_mode import two_mode_model
from microslip.analyses.time.points import Request, steady_states
from microslip.analyses.time.scheme import time_scheme
from microslip.analyses.time.steady import SteadyState, raised_state, steady_state
from microslip.describe.reading import parse_joint
from microslip.errors import Failure, MicroslipError
from microslip.numerics.execute import each, threads
from microslip.pipeline.run import Run, run

AT_RANDOM = 5

STEPS, CYCLES, TOLERANCE = 150, 400, 3e-6

RAISED = 30
"""Cycles over which the load is raised from rest."""

SETTLED = 3e-5
"""Change over the last cycle at which a steady state is a truth: what the time domain's default accepts."""

ASKED = 0.01

ELSEWHERE = 0.05
"""A steady state from rest that is off by more may be that of another branch."""

ASIDE, CLOSER = 24, 3
"""A branch is followed from so many frequencies to the side, in steps of so many."""

ON_THE_WAY = 60
"""Cycles at most at each of them."""

CAUSES = (
    "no periodic motion",
    "amplitude wanders or depends on the past",
    "nothing bounds it",
    "bound too wide",
)

PAGE = """# Method "auto" on lap joints at random

Lap joints of populations that it was not developed on, each under the load that it was drawn with: the
forced response by `method = "auto"`, defaults, against steady states of time integration at its peak, its
flanks and five frequencies at random, each after the load was raised from rest, with a finer tolerance
(`python benchmarks/population/auto.py`, {pairs} contact pairs). *Claimed*: the response states an error of at
most 1 %; the rest is *flagged*. A steady state that did not settle within 400 cycles is no truth, and is
counted apart.

"""


def frequencies(curve: Response, rng: np.random.Generator) -> list[int]:
    """Peak, both flanks and some at random, by index."""
    size = np.where(curve.flag == CONVERGED, np.abs(curve.amplitude), 0.0)
    top = int(np.argmax(size))
    half = np.flatnonzero(size < 0.5 * size[top])
    below, above = half[half < top], half[half > top]
    chosen = [top, *below[-1:], *above[:1]]
    known = np.flatnonzero(curve.flag == CONVERGED)
    chosen += list(rng.choice(known, min(AT_RANDOM, len(known)), replace=False))
    return [int(k) for k in dict.fromkeys(chosen) if curve.flag[k] == CONVERGED]


def raised(joint: PreparedJoint, curve: Response, k: int) -> SteadyState | None:
    """Steady state at a frequency after the load was raised from rest; None where it is not that shown."""
    f = float(curve.frequency[k])
    scheme = time_scheme(joint, 1 / (f * STEPS), frequency=f)
    try:
        start = raised_state(scheme, f, curve.load, RAISED)
        found = steady_state(
            scheme, f, curve.load, start=start, tolerance=TOLERANCE, max_cycles=CYCLES
        )
    except MicroslipError:
        return None
    own = abs(curve.amplitude[k])
    same = found.change <= SETTLED and abs(own / abs(found.amplitude) - 1) <= ELSEWHERE
    return found if same else None


def followed(joint: PreparedJoint, curve: Response, k: int, side: int) -> SteadyState | None:
    """Steady state at a frequency, on the branch that is followed from one side of it."""
    path = [j for j in range(k + side * ASIDE, k, -side * CLOSER) if 0 <= j < len(curve.frequency)]
    path = [j for j in path if curve.flag[j] == CONVERGED]
    steady = None
    for j in [*path, k]:
        f = float(curve.frequency[j])
        scheme = time_scheme(joint, 1 / (f * STEPS), frequency=f)
        steady = steady_state(
            scheme,
            f,
            curve.load,
            guess=complex(curve.amplitude[j]),
            start=None if steady is None else steady.end,
            tolerance=TOLERANCE,
            max_cycles=CYCLES if j == k else ON_THE_WAY,
        )
    return steady


def measured(done: Run, seconds: float, rng: np.random.Generator) -> dict:
    """What one joint says of the method."""
    curve, refined = done.responses[0], done.value("reduced")
    model = two_mode_model(done.prepared, "refined", refined.offset)
    stated = curve.error_indicator
    chosen = frequencies(curve, rng)
    after = list(each(lambda k: raised(done.prepared, curve, k), chosen, threads()))
    others = [k for k, found in zip(chosen, after, strict=True) if found is None]
    requests = [
        Request(
            np.nan,
            float(curve.frequency[k]),
            curve.load,
            None,
            complex(curve.amplitude[k]),
            steps=STEPS,
            tolerance=TOLERANCE,
            max_cycles=CYCLES,
            classify=False,
        )
        for k in others
    ]
    begun = dict(zip(others, steady_states(done.prepared, requests), strict=True))
    surface = load_surface(model, refined.table, curve.frequency[chosen], curve.load)
    plain = contours(surface, curve.load)
    points = []
    for i, (k, state) in enumerate(zip(chosen, after, strict=True)):
        point = {"frequency": float(curve.frequency[k]), "stated": float(stated[k])}
        points.append(point)
        own, truths = abs(curve.amplitude[k]), [state]
        if state is None:
            found = begun[k]
            if isinstance(found, Failure):
                point |= {"settled": False, "said": str(found)}
                continue
            truths = [found.steady]
            if abs(own / abs(found.steady.amplitude) - 1) > ELSEWHERE:
                truths += [followed(done.prepared, curve, k, side) for side in (1, -1)]
        truths = [one for one in truths if one is not None and one.change <= SETTLED]
        point["settled"] = bool(truths)
        if not truths:
            continue
        truth = min((abs(one.amplitude) for one in truths), key=lambda a: abs(own / a - 1))
        model_says = np.abs(plain.amplitude[plain.point == i])
        point |= {
            "error": float(abs(own / truth - 1)),
            "branches": len(truths),
            "raised": state is not None,
            "plain": float(min(abs(model_says / truth - 1), default=np.inf)),
        }
    answered = curve.flag == CONVERGED
    return {
        "seconds": seconds,
        "steady_states": len(curve.anchors),
        "flagged": float(np.mean(~(answered & (stated <= ASKED)))),
        "causes": causes(curve),
        "stated": float(np.median(stated)),
        "opens": bool(np.isfinite(curve.opening_load)),
        "points": points,
    }


def causes(curve: Response) -> dict[str, float]:
    """Shares of the frequencies that are flagged, by cause."""
    stated, answered = curve.error_indicator, curve.flag == CONVERGED
    flagged = answered & ~(stated <= ASKED)
    sought = np.isin(curve.frequency, [one.frequency for one in curve.anchors])
    shares = (
        ~answered,
        flagged & sought,
        flagged & ~sought & np.isinf(stated),
        flagged & ~sought & np.isfinite(stated),
    )
    return {name: float(np.mean(share)) for name, share in zip(CAUSES, shares, strict=True)}


def page(rows: dict[str, dict]) -> str:
    """The table as Markdown."""
    found = [row for row in rows.values() if "points" in row]
    populations = sorted({name.partition("/")[0] for name in rows})
    points = [p for row in found for p in row["points"]]
    settled = [p for p in points if p["settled"]]
    error, stated, plain = (
        np.array([p[key] for p in settled]) for key in ("error", "stated", "plain")
    )
    claimed = stated <= ASKED
    seconds, worked = ([row[key] for row in found] for key in ("seconds", "processor"))

    def share(true: np.ndarray) -> str:
        return f"{100 * np.mean(true):.1f} %" if len(true) else "–"

    lines = [
        f"| | {len(found)} joints of population {', '.join(populations)} |",
        "|---|---|",
        f"| steady states for comparison, settled | {len(settled)} of {len(points)} |",
        f"| of them after the load was raised, the others on another branch than that leads to | "
        f"{sum(p['raised'] for p in settled)} |",
        f"| claimed | {share(claimed)} |",
        f"| error at most 1 %, of all settled | {share(error <= ASKED)} |",
        f"| error at most 1 %, of those claimed | {share(error[claimed] <= ASKED)} |",
        f"| error below what is stated, of all settled | {share(error <= stated)} |",
        f"| error below what is stated, of those claimed | {share((error <= stated)[claimed])} |",
        f"| median of what is stated | {np.median(stated):.2g} |",
        f"| the refined model alone: error at most 1 % | {share(plain <= ASKED)} |",
        f"| frequencies of all responses that are flagged, mean | "
        f"{100 * np.mean([row['flagged'] for row in found]):.1f} % |",
        *(
            f"| of them: {name} | {100 * np.mean([row['causes'][name] for row in found]):.1f} % |"
            for name in CAUSES
        ),
        f"| responses with at most 2 % flagged | {sum(row['flagged'] <= 0.02 for row in found)} |",
        f"| joints whose resonance opens the clamp | {sum(row['opens'] for row in found)} |",
        f"| steady states per response, median | "
        f"{np.median([row['steady_states'] for row in found]):.0f} |",
        f"| time per response, median and most | {np.median(seconds):.0f} s, {max(seconds):.0f} s |",
        f"| processor time per run, median and most | {np.median(worked):.0f} s, {max(worked):.0f} s |",
    ]
    failed = [f"| {name} | {row['failed']} |" for name, row in rows.items() if "failed" in row]
    if failed:
        lines += ["", "| joint | failed |", "|---|---|", *failed]
    wrong = [
        f"| {name} | {p['frequency']:.5g} | {p['error']:.2g} | {p['stated']:.2g} |"
        for name, row in rows.items()
        for p in row.get("points", [])
        if p["settled"] and p["stated"] <= ASKED and p["error"] > ASKED
    ]
    if wrong:
        lines += ["", "Claimed and wrong by more than 1 %:", ""]
        lines += ["| joint | Hz | error | stated |", "|---|---|---|---|", *wrong]
    pairs = sorted({row["pairs"] for row in rows.values()})
    return PAGE.format(pairs=" and ".join(map(str, pairs))) + "\n".join(lines) + "\n"


def row_of(text: str, load: float, rng: np.random.Generator, method: str = "auto") -> dict:
    """What one joint says under a share of its own load, or why it says nothing."""
    described = tomllib.loads(text) | {"analysis": {"response": {"method": method}}}
    key = "moment_over_clamp_force_length"
    described["load"][key] = [load * value for value in described["load"][key]]
    began, worked = time.perf_counter(), time.process_time()
    try:
        done = run(parse_joint(described))
        worked = time.process_time() - worked
        if not done.responses:
            raise MicroslipError("; ".join(map(str, done.failures)))
        row = {**measured(done, done.timings["response"], rng), "processor": worked}
    except MicroslipError as error:
        row = {"failed": str(error)}
    return {"wall": time.perf_counter() - began, **row}


def main() -> int:
    """Compute what is missing and print the table."""
    parser = study(__doc__, [21, 22, 23], 101, "population-auto.jsonl")
    parser.add_argument("--loads", type=float, nargs="+", default=[1.0], help="over its own")
    asked = parser.parse_args()
    rows = {row["joint"]: row for row in kept_rows(asked.out)}
    for load in asked.loads:
        for name, seed, text in joints_left(asked, rows, "" if load == 1 else f" load x {load:g}"):
            found = row_of(text, load, np.random.default_rng(seed))
            rows[name] = {"joint": name, "pairs": asked.pairs, **found}
            keep_row(asked.out, rows[name])
            print(name, f"{rows[name]['wall']:.1f} s", flush=True)
    table = page(rows)
    print(table[table.index("| |") :])
    if asked.page:
        asked.page.write_text(table)
    return 0


if __name__ == "__main__":
    sys.exit(main())

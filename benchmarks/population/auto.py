"""Method "auto" on random lap joints, against time integration that knows nothing of it.

python benchmarks/population/auto.py [--seeds 21 22 23] [--count 20] [--pairs 101]
    [--loads 1 0.3] [--out FILE] [--page FILE]

Every joint under its own load, or shares of it: the response by method "auto" with its defaults, then
steady states at the peak, at the flanks where it is half as large, and at five frequencies at random, each
after the load was raised from rest over 30 cycles, the past that is meant, but more slowly than the method
ever raises it, and marched alone, without a search, until its amplitude no longer drifts, or for the 4000
cycles after which motions of bodies that walk are shown, and then with eight times the steps until it does
not again. Where that lands on another branch of a fold, it is sought from rest with the velocity of the
motion shown, and that failing the branch shown is followed from the side, in small steps, and what is found
is sought on with eight times the steps, pushed off by a hundredth of its size, as motions leave unstable
ones, and marched as well; where none of it is that shown, the branch is swept to by marching. A motion beside
the one shown that stays there for as long as it is marched, and does not settle, is no truth; how far its
amplitude then is from that shown is counted apart. At two of the frequencies where motions are said to vary
from cycle to cycle for good it is asked whether they do, and at two without an answer whether what the load
leads to that is raised from rest settles. The plain refined model is measured at the same points. Lines in
FILE (JSON, one a joint) are not computed again: stop it at any time, and go on with the same command.
"""

from __future__ import annotations

import argparse
import sys
import time
import tomllib
from collections.abc import Iterator
from functools import partial
from itertools import chain

import numpy as np
from resumed import answered, drawn_joints, study
from truths import PART, elsewhere, judged, marched, varies

from microslip.analyses.reduced.response import Response
from microslip.analyses.reduced.surface import contours, load_surface
from microslip.analyses.reduced.sweep import CONVERGED
from microslip.analyses.reduced.two_mode import two_mode_model
from microslip.describe.reading import parse_joint
from microslip.errors import MicroslipError
from microslip.numerics.execute import each, threads
from microslip.pipeline.auto import varying
from microslip.pipeline.run import Run, run

AT_RANDOM, MOVING = 5, 2

ASKED = 0.01

CAUSES = (
    "motion varies from cycle to cycle for good, its mean is known",
    "no periodic motion",
    "the joint opens",
    "not settled beside a jump",
    "several motions, as the load is raised",
    "amplitude wanders or creeps",
    "nothing bounds it",
    "bound too wide",
)

SLIGHT = 2e-3
"""What is no variation from cycle to cycle."""

PAGE = """# Method "auto" on lap joints at random

Lap joints of populations that it was not developed on, each under the load that it was drawn with: the
forced response by `method = "auto"`, defaults, against steady states of time integration at its peak, its
flanks and five frequencies at random, each after the load was raised from rest, and marched until its
amplitude no longer drifts, in 150 and then in 1,200 steps per cycle
(`python benchmarks/population/auto.py`, {pairs} contact pairs). *Claimed*: the
response states an error of at most 1 %; the rest is *flagged*. A motion that has not settled within 4000
cycles, nor then in 1,200 steps, is no truth, but what is shown of bodies that walk is the motion after so
many; where it has stayed beside the one shown, how far from that its last hundred cycles are is counted
apart. Where motions are said to vary from cycle to cycle for good, two of the frequencies are marched to as
well.

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


def measured(done: Run, seconds: float, rng: np.random.Generator) -> dict:
    """What one joint says of the method."""
    curve, refined = done.responses[0], done.value("reduced")
    model = two_mode_model(done.prepared, "refined", refined.offset)
    stated = curve.error_indicator
    chosen = frequencies(curve, rng)
    after = each(
        lambda k: marched(done.prepared, float(curve.frequency[k]), curve.load, None),
        chosen,
        threads(),
    )
    surface = load_surface(model, refined.table, curve.frequency[chosen], curve.load)
    plain = contours(surface, curve.load)
    points = []
    for i, (k, end) in enumerate(zip(chosen, after, strict=True)):
        own = abs(curve.amplitude[k])
        # a motion that creeps after the load was raised has no truth, whatever others there are
        others = end is not None and end.settled and not end.near(own)
        point = {"frequency": float(curve.frequency[k]), "stated": float(stated[k])}
        point |= judged(own, end, elsewhere(done.prepared, curve, k) if others else [])
        if point["settled"]:
            model_says = np.abs(plain.amplitude[plain.point == i])
            point["plain"] = float(min(abs(model_says / point["truth"] - 1), default=np.inf))
        points.append(point)
    moving = some(np.isin(curve.frequency, varying(curve, ASKED)), rng)
    moves = each(lambda k: moving_at(done, curve, k), moving, threads())
    answered = curve.flag == CONVERGED
    silent = each(lambda k: silent_at(done, curve, k), some(~answered, rng), threads())
    return {
        "seconds": seconds,
        "steady_states": len(curve.anchors),
        "flagged": float(np.mean(~(answered & (stated <= ASKED)))),
        "causes": causes(curve),
        "stated": float(np.median(stated)),
        "opens": bool(np.isfinite(curve.opening_load)),
        "checks": [check.error for check in curve.checks],
        "points": points,
        "moving": list(moves),
        "silent": list(silent),
    }


def some(there: np.ndarray, rng: np.random.Generator) -> list[int]:
    """Of what is there, by index, `MOVING` at random."""
    every = np.flatnonzero(there)
    return [int(k) for k in rng.choice(every, min(MOVING, len(every)), replace=False)]


def moving_at(done: Run, curve: Response, k: int) -> dict:
    """What time integration says where the motion is said to vary for good."""
    end, own = varies(done.prepared, curve, k), abs(curve.amplitude[k])
    found = {"frequency": float(curve.frequency[k]), "stated": float(curve.error_indicator[k])}
    if end is None or not end.near(own):
        return found | {"spread": None}
    return found | {"spread": end.spread, "off": end.off(own), "settled": end.settled}


def silent_at(done: Run, curve: Response, k: int) -> dict:
    """What time integration says, from rest, where there is no answer."""
    end = marched(done.prepared, float(curve.frequency[k]), curve.load, None)
    found = {"frequency": float(curve.frequency[k]), "settled": end is not None and end.settled}
    return found | {"spread": None if end is None else end.spread}


def causes(curve: Response) -> dict[str, float]:
    """Shares of the frequencies that are flagged, by cause."""
    stated, answered = curve.error_indicator, curve.flag == CONVERGED
    flagged = answered & ~(stated <= ASKED)
    at = np.array([one.frequency for one in curve.anchors])
    sought = np.isin(curve.frequency, at)
    several = np.isin(curve.frequency, at[[one.scatter > one.doubt for one in curve.anchors]])
    endless = np.isinf(stated)
    moves = np.isin(curve.frequency, varying(curve, ASKED))
    flagged &= ~moves
    opens = bool(np.isfinite(curve.opening_load))
    shares = (
        moves,
        ~answered & (not opens),
        ~answered & opens,
        flagged & sought & endless,
        flagged & sought & ~endless & several,
        flagged & sought & ~endless & ~several,
        flagged & ~sought & endless,
        flagged & ~sought & ~endless,
    )
    return {name: float(np.mean(share)) for name, share in zip(CAUSES, shares, strict=True)}


def page(rows: dict[str, dict]) -> str:
    """The table as Markdown."""
    found = [row for row in rows.values() if "points" in row]
    populations = sorted({name.partition("/")[0] for name in rows})
    points = [p for row in found for p in row["points"]]
    settled = [p for p in points if p["settled"]]
    staying = [p for p in points if p.get("off") is not None]
    sure = [p for p in staying if p["stated"] <= ASKED]
    error, stated, plain = (
        np.array([p[key] for p in settled]) for key in ("error", "stated", "plain")
    )
    open_ = np.array([p.get("left", 0.0) for p in settled])
    claimed, within = stated <= ASKED, error <= stated + open_
    seconds, worked = ([row[key] for row in found] for key in ("seconds", "processor"))

    otherwise = [row["flagged"] - row["causes"].get(CAUSES[0], 0.0) for row in found]
    moves = [p for row in found for p in row.get("moving", [])]
    seen = [p for p in moves if p["spread"] is not None]
    silent = [p for row in found for p in row.get("silent", [])]

    def share(true: np.ndarray) -> str:
        return f"{100 * np.mean(true):.1f} %" if len(true) else "–"

    lines = [
        f"| | {len(found)} joints of population {', '.join(populations)} |",
        "|---|---|",
        f"| steady states for comparison, settled | {len(settled)} of {len(points)} |",
        f"| not settled, marched to the end beside what is shown | {len(staying)} |",
        f"| of these claimed, and all of the last {PART} cycles within 1 % | "
        f"{sum(p['off'] <= ASKED for p in sure)} of {len(sure)} |",
        f"| of the settled after the load was raised, the others on another branch than that leads to | "
        f"{sum(p['raised'] for p in settled)} |",
        f"| claimed | {share(claimed)} |",
        f"| error at most 1 %, of all settled | {share(error <= ASKED)} |",
        f"| error at most 1 %, of those claimed | {share(error[claimed] <= ASKED)} |",
        f"| error below what is stated, and the truth leaves open, of all settled | {share(within)} |",
        f"| the same, of those claimed | {share(within[claimed])} |",
        f"| median of what is stated | {np.median(stated):.2g} |",
        f"| the refined model alone: error at most 1 % | {share(plain <= ASKED)} |",
        f"| frequencies of all responses that are flagged, mean | "
        f"{100 * np.mean([row['flagged'] for row in found]):.1f} % |",
        *(
            f"| of them: {name} | {100 * np.mean([row['causes'].get(name, 0.0) for row in found]):.1f} % |"
            for name in CAUSES
        ),
        f"| flagged otherwise than the first of them, mean | {100 * np.mean(otherwise):.1f} % |",
        f"| responses with at most 2 % flagged, and flagged otherwise | "
        f"{sum(row['flagged'] <= 0.02 for row in found)}, {sum(one <= 0.02 for one in otherwise)} |",
        f"| looked at where the motion is said to vary for good: found there | {len(seen)} of {len(moves)} |",
        f"| of these, vary from cycle to cycle by more than {100 * SLIGHT:g} % | "
        f"{sum(p['spread'] > SLIGHT for p in seen)} |",
        f"| of these, all of the last {PART} cycles within what is stated | "
        f"{sum(p['off'] <= p['stated'] for p in seen)} |",
        f"| looked at where there is no answer: settles from rest | "
        f"{sum(p['settled'] for p in silent)} of {len(silent)} |",
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
    wandering = [
        f"| {name} | {p['frequency']:.5g} | {p['off']:.2g} | {p['stated']:.2g} |"
        for name, row in rows.items()
        for p in row.get("points", [])
        if p.get("off") is not None and p["stated"] <= ASKED < p["off"]
    ]
    if wrong:
        lines += ["", "Claimed and wrong by more than 1 %:", ""]
        lines += ["| joint | Hz | error | stated |", "|---|---|---|---|", *wrong]
    if wandering:
        lines += [
            "",
            "Claimed, and a motion beside it that does not settle strays by more than 1 %:",
        ]
        lines += ["", "| joint | Hz | at most | stated |", "|---|---|---|---|", *wandering]
    pairs = sorted({row["pairs"] for row in rows.values()})
    return PAGE.format(pairs=" and ".join(map(str, pairs))) + "\n".join(lines) + "\n"


def row_of(text: str, seed: int, pairs: int, method: str = "auto", load: float = 1.0) -> dict:
    """What one joint says under a share of its own load, or why it says nothing."""
    rng = np.random.default_rng(seed)
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
    return {"pairs": pairs, "wall": time.perf_counter() - began, **row}


def cases_of(asked: argparse.Namespace, method: str, load: float = 1.0) -> Iterator[tuple]:
    """Every joint of the populations under a share of its own load, and what computes its row."""
    case = "" if load == 1 else f" load x {load:g}"
    for name, seed, text in drawn_joints(asked):
        yield name + case, partial(row_of, text, seed, asked.pairs, method, load)


def main() -> int:
    """Compute what is missing and print the table."""
    parser = study(__doc__, [21, 22, 23], 101, "population-auto.jsonl")
    parser.add_argument("--loads", type=float, nargs="+", default=[1.0], help="over its own")
    asked = parser.parse_args()
    cases = chain.from_iterable(cases_of(asked, "auto", load) for load in asked.loads)
    return answered(asked, cases, page)


if __name__ == "__main__":
    sys.exit(main())

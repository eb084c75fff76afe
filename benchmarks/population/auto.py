"""Method "auto" on random lap joints, against time integration that knows nothing of it.

python benchmarks/population/auto.py [--seeds 21 22 23] [--count 20] [--pairs 101]
    [--loads 1 0.3] [--out FILE] [--page FILE]

Every joint under its own load, or shares of it: the response by method "auto" with its defaults, then
steady states at the peak, at the flanks where it is half as large, and at five frequencies at random, each
after the load was raised from rest over 30 cycles, the past that is meant, but more slowly than the method
ever raises it, and marched alone, without a search, until its amplitude no longer drifts, and then with eight
times the steps until it does not again. Where that lands on another branch of a fold, it is sought from rest
with the velocity of the motion shown, and that failing the branch shown is followed from the side, in small
steps, and what is found is sought on with eight times the steps, pushed off by a hundredth of its size, as
motions leave unstable ones, and marched as well. A motion beside the one shown that stays there for as long
as it is marched, and does not settle, is no truth; how far its amplitude then is from that shown is counted
apart. The plain refined model is measured at the same points.
Lines in FILE (JSON, one a joint) are not computed again: stop it at any time, and go on with the same
command.
"""

from __future__ import annotations

import argparse
import sys
import time
import tomllib
from collections.abc import Iterator
from dataclasses import replace
from functools import partial
from itertools import chain
from typing import NamedTuple

import numpy as np
from resumed import answered, drawn_joints, study

from microslip.analyses.prepared.joint import PreparedJoint
from microslip.analyses.reduced.response import Response
from microslip.analyses.reduced.surface import contours, load_surface
from microslip.analyses.reduced.sweep import CONVERGED
from microslip.analyses.reduced.two_mode import two_mode_model
from microslip.analyses.time.scheme import (
    State,
    TimeScheme,
    prestressed_state,
    time_scheme,
)
from microslip.analyses.time.starts import end_of, mixed, placed
from microslip.analyses.time.steady import SteadyState, raised_state, steady_state
from microslip.analyses.time.watching import watched
from microslip.describe.reading import parse_joint
from microslip.errors import MicroslipError
from microslip.numerics.execute import each, threads
from microslip.pipeline.run import Run, run

AT_RANDOM = 5

STEPS, CYCLES, TOLERANCE = 150, 400, 3e-6

RAISED = 30
"""Cycles over which the load is raised from rest."""

SETTLED = 1e-3
"""What an amplitude may still drift by, relative, over twice as many cycles as it has been marched, and vary
by in the last part of them, where it is a truth."""

PART, MOST = 100, 4000
"""Cycles between which the drift is taken, and at most."""

FINER, MOST_FINER = 1200, 1000
"""Steps per cycle with which it is then marched on, and for so many cycles at most."""

ASKED = 0.01

ELSEWHERE = 0.05
"""A steady state from rest that is off by more may be that of another branch."""

ASIDE, CLOSER = 24, 3
"""A branch is followed from so many frequencies to the side, in steps of so many."""

ON_THE_WAY = 60
"""Cycles at most at each of them."""

PUSH = 0.01
"""Share of its own size that a motion is pushed off by that a search has found."""

CAUSES = (
    "no periodic motion",
    "not settled beside a jump",
    "several motions, as the load is raised",
    "amplitude wanders or creeps",
    "nothing bounds it",
    "bound too wide",
)

PAGE = """# Method "auto" on lap joints at random

Lap joints of populations that it was not developed on, each under the load that it was drawn with: the
forced response by `method = "auto"`, defaults, against steady states of time integration at its peak, its
flanks and five frequencies at random, each after the load was raised from rest, and marched until its
amplitude no longer drifts, in 150 and then in 1,200 steps per cycle
(`python benchmarks/population/auto.py`, {pairs} contact pairs). *Claimed*: the
response states an error of at most 1 %; the rest is *flagged*. A motion that has not settled within 4000
cycles is no truth, but what is shown of bodies that walk is the motion after so many; where it has stayed
beside the one shown, how far from that its last hundred cycles are is counted apart.

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


class End(NamedTuple):
    """Where a motion is after it was marched: sizes of its last cycles, and whether it has settled."""

    least: float
    most: float
    settled: bool

    def off(self, own: float) -> float:
        """Largest relative difference of a size to these."""
        return max(abs(own / self.least - 1), abs(own / self.most - 1))

    def near(self, own: float) -> bool:
        """Whether a size is that of this motion, for all that is known."""
        return bool(self.off(own) <= ELSEWHERE)


def marched(
    joint: PreparedJoint, f: float, load: float, state: State | None, phase: float = 0.0
) -> End | None:
    """Where a motion ends, marched from a state at a phase of the load; None where a step does not solve.

    Without a state from rest, after the load was raised. What has settled is marched on with more steps;
    where it does not settle with these, it stays the truth as it is.
    """
    scheme = time_scheme(joint, 1 / (f * STEPS), frequency=f)
    finer = time_scheme(joint, 1 / (f * FINER), frequency=f)
    try:
        state = raised_state(scheme, f, load, RAISED) if state is None else state
        end, state = to_its_end(scheme, load, state, phase, MOST)
    except MicroslipError:
        return None
    if not end.settled:
        return end
    try:
        state = placed(end_of(state, phase, scheme, f), finer, f, load)
        better = to_its_end(finer, load, state, phase, MOST_FINER)[0]
    except MicroslipError:
        return end
    return better if better.settled else end


def to_its_end(
    scheme: TimeScheme, load: float, state: State, phase: float, most: int
) -> tuple[End, State]:
    """Where a motion is once its amplitude no longer drifts, or after so many cycles; and its state."""
    before = np.inf
    for count in range(1, most // PART + 1):
        Q, states = watched(scheme, load, state, PART, phase)
        size, state = np.abs(Q), states[-1]
        left = 2 * count * abs(size.mean() / before - 1) + np.ptp(size) / size.mean()
        if left <= SETTLED:
            return End(float(size[-1]), float(size[-1]), True), state
        before = size.mean()
    return End(float(size.min()), float(size.max()), False), state


def elsewhere(joint: PreparedJoint, curve: Response, k: int) -> list[End]:
    """Other motions at a frequency: from rest with the velocity of that shown, and followed."""
    f, own = float(curve.frequency[k]), abs(curve.amplitude[k])
    scheme = time_scheme(joint, 1 / (f * STEPS), frequency=f)
    settings = {"tolerance": TOLERANCE, "max_cycles": CYCLES}
    found: list[End] = []
    for side in (0, 1, -1):
        try:
            steady = (
                followed(joint, curve, k, side)
                if side
                else steady_state(
                    scheme, f, curve.load, guess=complex(curve.amplitude[k]), **settings
                )
            )
        except MicroslipError:
            continue
        end = steady and pushed(joint, f, curve.load, steady)
        found += [end] if end else []
        if end and end.settled and end.near(own):
            break
    return found


def pushed(joint: PreparedJoint, f: float, load: float, steady: SteadyState) -> End | None:
    """Where the motion beside a periodic one ends, marched with more steps, and larger by `PUSH` at first.

    With the steps that it has, where it does not settle with more.
    """
    scheme = time_scheme(joint, 1 / (f * FINER), frequency=f)
    settings = {"tolerance": TOLERANCE, "max_cycles": CYCLES}
    try:
        finer = steady_state(scheme, f, load, start=steady.end, **settings)
        if finer.converged and abs(abs(finer.amplitude) / abs(steady.amplitude) - 1) <= ELSEWHERE:
            return to_its_end(scheme, load, larger(scheme, finer), finer.phase, MOST_FINER)[0]
    except MicroslipError:
        return None
    return marched(joint, f, load, steady.cycle.state, steady.phase)


def larger(scheme: TimeScheme, steady: SteadyState) -> State:
    """The state of a motion a little larger than a periodic one: `PUSH` more of all that moves."""
    own, still = steady.end, prestressed_state(scheme)
    rest = replace(own, eta=still.eta, rate=0 * own.rate, r=still.r, v=still.v)
    mixture = mixed(((own, 1 + PUSH), (rest, -PUSH)))
    return placed(mixture, scheme, steady.frequency, steady.load)


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


def judged(own: float, after: End | None, others: list[End]) -> dict:
    """What motions say of an amplitude that is shown.

    Parameters
    ----------
    own : float
    after : End or None
        Where the motion ends after the load was raised.
    others : list of End
        Where others do that were sought about the one shown, where the former is on another branch.
    """
    ends = [one for one in (after, *others) if one is not None]
    beside = [one for one in ends if one.near(own)]
    settled = [one for one in beside or ends if one.settled]
    if after is None or not settled:
        # what stays beside that shown, and does not settle, is its motion, and no truth
        off = min((one.off(own) for one in beside), default=None)
        return {"settled": False, "off": off}
    truth = min(settled, key=lambda one: one.off(own))
    return {
        "settled": True,
        "truth": truth.least,
        "error": truth.off(own),
        "branches": len(settled),
        "raised": after.near(own),
    }


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
    answered = curve.flag == CONVERGED
    return {
        "seconds": seconds,
        "steady_states": len(curve.anchors),
        "flagged": float(np.mean(~(answered & (stated <= ASKED)))),
        "causes": causes(curve),
        "stated": float(np.median(stated)),
        "opens": bool(np.isfinite(curve.opening_load)),
        "checks": [check.error for check in curve.checks],
        "points": points,
    }


def causes(curve: Response) -> dict[str, float]:
    """Shares of the frequencies that are flagged, by cause."""
    stated, answered = curve.error_indicator, curve.flag == CONVERGED
    flagged = answered & ~(stated <= ASKED)
    at = np.array([one.frequency for one in curve.anchors])
    sought = np.isin(curve.frequency, at)
    several = np.isin(curve.frequency, at[[one.scatter > one.doubt for one in curve.anchors]])
    endless = np.isinf(stated)
    shares = (
        ~answered,
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
    claimed = stated <= ASKED
    seconds, worked = ([row[key] for row in found] for key in ("seconds", "processor"))

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

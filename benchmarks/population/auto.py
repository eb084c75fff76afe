"""Method "auto" on random lap joints, against time integration at frequencies that it has not seen.

python benchmarks/population/auto.py [--seeds 21 22 23] [--count 20] [--out FILE] [--page FILE]

Every joint under its own load: the response by method "auto" with its defaults, then steady states at
the peak, at the flanks where it is half as large, and at five frequencies at random, from its answers, with
the same time steps. Where a response folds, the nearest of its answers counts. The plain refined model is
measured at the same points. Lines in FILE (JSON, one a joint) are not computed again.
"""

from __future__ import annotations

import argparse
import json
import sys
import time
import tomllib
from pathlib import Path

import numpy as np
from lap_joints import joints

from microslip.analyses.reduced.anchors import corrected_answers
from microslip.analyses.reduced.response import Response
from microslip.analyses.reduced.surface import load_surface
from microslip.analyses.reduced.sweep import CONVERGED
from microslip.analyses.reduced.two_mode import two_mode_model
from microslip.analyses.time.points import Request, steady_states
from microslip.describe.reading import parse_joint
from microslip.errors import Failure, MicroslipError
from microslip.pipeline.run import Run, run

AT_RANDOM = 5

STEPS, CYCLES = 150, 400

ASKED = 0.01

PAGE = """# Method "auto" on lap joints at random

Lap joints of populations that it was not developed on, each under the load that it was drawn with: the
forced response by `method = "auto"`, defaults, against steady states of time integration at its peak, its
flanks and five frequencies at random, none of which it has seen
(`python benchmarks/population/auto.py`). *Claimed*: the response states an error of at most 1 %. A steady
state that did not settle within 400 cycles is no truth, and is counted apart.

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
    return [int(k) for k in dict.fromkeys(chosen)]


def measured(done: Run, seconds: float, rng: np.random.Generator) -> dict:
    """What one joint says of the method."""
    curve, refined = done.responses[0], done.value("reduced")
    model = two_mode_model(done.prepared, "refined", refined.offset)
    stated = curve.error_indicator
    chosen = [k for k in frequencies(curve, rng) if curve.flag[k] == CONVERGED]
    requests = [
        Request(
            np.nan,
            float(curve.frequency[k]),
            curve.load,
            None,
            complex(curve.amplitude[k]),
            steps=STEPS,
            max_cycles=CYCLES,
            classify=False,
        )
        for k in chosen
    ]
    points = []
    for k, found in zip(chosen, steady_states(done.prepared, requests), strict=True):
        if isinstance(found, Failure):
            points.append({"settled": False, "said": str(found)})
            continue
        truth = abs(found.steady.amplitude)
        surface = load_surface(model, refined.table, np.array([found.steady.frequency]))
        sizes = [
            np.abs(corrected_answers(surface, curve.load, anchors).amplitude)
            for anchors in (curve.anchors, ())
        ]
        near, plain = (min(abs(size / truth - 1), default=np.inf) for size in sizes)
        points.append(
            {
                "settled": bool(found.steady.converged),
                "frequency": float(curve.frequency[k]),
                "error": float(near),
                "stated": float(stated[k]),
                "plain": float(plain),
            }
        )
    return {
        "seconds": seconds,
        "steady_states": len(curve.anchors),
        "answered": float(np.mean(curve.flag == CONVERGED)),
        "claimed": float(np.mean((curve.flag == CONVERGED) & (stated <= ASKED))),
        "stated": float(np.median(stated)),
        "opens": bool(np.isfinite(curve.opening_load)),
        "points": points,
    }


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

    def share(true: np.ndarray) -> str:
        return f"{100 * np.mean(true):.1f} %" if len(true) else "–"

    lines = [
        f"| | {len(found)} joints of population {', '.join(populations)} |",
        "|---|---|",
        f"| steady states for comparison, settled | {len(settled)} of {len(points)} |",
        f"| claimed | {share(claimed)} |",
        f"| error at most 1 %, of all settled | {share(error <= ASKED)} |",
        f"| error at most 1 %, of those claimed | {share(error[claimed] <= ASKED)} |",
        f"| error below what is stated, of all settled | {share(error <= stated)} |",
        f"| error below what is stated, of those claimed | {share((error <= stated)[claimed])} |",
        f"| median of what is stated | {np.median(stated):.2g} |",
        f"| the refined model alone: error at most 1 % | {share(plain <= ASKED)} |",
        f"| frequencies of all responses that are claimed, mean | "
        f"{100 * np.mean([row['claimed'] for row in found]):.1f} % |",
        f"| joints whose resonance opens the clamp | {sum(row['opens'] for row in found)} |",
        f"| steady states per response, median | "
        f"{np.median([row['steady_states'] for row in found]):.0f} |",
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
    return PAGE + "\n".join(lines) + "\n"


def main() -> int:
    """Compute what is missing and print the table."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--seeds", type=int, nargs="+", default=[21, 22, 23])
    parser.add_argument("--count", type=int, default=20)
    parser.add_argument("--out", type=Path, default=Path("population-auto.jsonl"))
    parser.add_argument("--page", type=Path)
    asked = parser.parse_args()
    rows = {}
    if asked.out.is_file():
        rows = {row["joint"]: row for row in map(json.loads, asked.out.read_text().splitlines())}
    for seed in asked.seeds:
        for number, text in enumerate(joints(seed, asked.count)):
            name = f"{seed}/{number:03d}"
            if name in rows:
                continue
            described = tomllib.loads(text) | {"analysis": {"response": {"method": "auto"}}}
            began = time.perf_counter()
            try:
                done = run(parse_joint(described))
                if not done.responses:
                    raise MicroslipError("; ".join(map(str, done.failures)))
                rng = np.random.default_rng(1000 * seed + number)
                row = measured(done, done.timings["response"], rng)
            except MicroslipError as error:
                row = {"failed": str(error)}
            rows[name] = {"joint": name, "wall": time.perf_counter() - began, **row}
            with asked.out.open("a") as file:
                file.write(json.dumps(rows[name]) + "\n")
            print(name, f"{rows[name]['wall']:.1f} s", flush=True)
    print(page(rows).removeprefix(PAGE))
    if asked.page:
        asked.page.write_text(page(rows))
    return 0


if __name__ == "__main__":
    sys.exit(main())

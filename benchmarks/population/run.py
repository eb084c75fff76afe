"""Random lap joints through the command line with defaults only: what became of each.

python benchmarks/population/run.py [--seeds 1 2 3 4 5] [--count 20] [--jobs 2] [--out FOLDER] [--page FILE]

Every joint is a process of its own, `microslip run FILE`, as a user has it. A joint passes where the exit
code is 0, the load that opens it is finite, and its largest answer lies inside the band. Results of joints
that are in FOLDER already are taken from there. With ``--page`` the table is written as a page of the docs.
"""

from __future__ import annotations

import argparse
import json
import math
import subprocess
import sys
import time
from collections import Counter
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass
from pathlib import Path

from lap_joints import joints

HEADER = "| joint | band, Hz | largest at, Hz | |"

PASSED, OPENS, FAILED = "peak inside its band", "its resonance opens it", "failed"

PAGE = """# Lap joints at random

A hundred lap joints drawn at random, each given to `microslip run` as it is: no band, no
amplitudes, nothing but defaults (`make population`). What is drawn is in
`benchmarks/population/lap_joints.py`: slenderness 8 to 40, three metals, friction 0.05 to 0.8,
supports from weak to stiff, loads over a decade and a half. A joint passes where the run ends with
exit code 0, the moment that opens it is finite, and its largest answer lies inside the band.

Loads that are small at rest may be large at resonance: where the resonance opens the joint, the run
says from which moment on and at which frequencies, and its amplitude beside them is a lower bound
([why](getting-started.md#when-the-resonance-opens-the-joint)). These have an answer, and are
counted apart.

"""


@dataclass(frozen=True)
class Found:
    """What became of one joint."""

    name: str
    kind: str
    code: int
    seconds: float
    band: tuple[float, float]
    frequency: float
    opening: float
    said: str


def judged(name: str, folder: Path, code: int, seconds: float, said: str) -> Found:
    """Read the summary of a joint and judge it."""
    file = folder / "summary.json"
    if not file.is_file():
        return Found(name, FAILED, code, seconds, (0.0, 0.0), math.nan, math.nan, said)
    found = json.loads(file.read_text())
    opening = found["model"]["opening_moment_over_clamp_force_length"]
    rows, bands = found["response"], found["response_band"]
    if code or not rows or not bands or opening is None:
        said = "; ".join(found["failures"]) or said
        return Found(name, FAILED, code, seconds, (0.0, 0.0), math.nan, math.nan, said)
    row, band = rows[0], (bands[0]["from_hz"], bands[0]["to_hz"])
    at = row["largest_at_hz"]
    inside = at is not None and band[0] < at < band[1] and not row["peak_at_edge"]
    opens = row["opens_from_load"]
    kind = FAILED if not inside else PASSED if opens is None else OPENS
    note = "" if opens is None else f"from {opens:.4g} N m/m on, loaded by {row['moment_n']:.4g}"
    return Found(name, kind, code, seconds, band, at or math.nan, opening, note)


def one(seed: int, number: int, text: str, out: Path) -> Found:
    """Run one joint, unless its results are there."""
    name = f"{seed}/{number:03d}"
    file = out / f"joint_{seed}_{number:03d}.toml"
    folder, log = file.with_suffix(""), file.with_suffix(".log")
    done = file.with_suffix(".done")
    file.write_text(text)
    if not done.is_file():
        start = time.perf_counter()
        command = [sys.executable, "-m", "microslip", "run", str(file), "--out", str(folder)]
        command += ["--force", "--quiet", "--threads", "1", "--format", "png"]
        ran = subprocess.run(command, capture_output=True, text=True)
        log.write_text(ran.stdout + ran.stderr)
        done.write_text(f"{ran.returncode} {time.perf_counter() - start:.1f}")
    code, seconds = done.read_text().split()
    lines = log.read_text().splitlines()
    return judged(name, folder, int(code), float(seconds), lines[-1] if lines else "")


def page(found: list[Found]) -> str:
    """The table as Markdown."""
    kinds = Counter(joint.kind for joint in found)
    lines = [f"| | joints of {len(found)} |", "|---|---|"]
    lines += [f"| {kind} | {kinds[kind]} |" for kind in (PASSED, OPENS, FAILED)]
    seconds = sorted(joint.seconds for joint in found)
    lines += [
        "",
        f"A run took {seconds[len(seconds) // 2]:.0f} s (median, one thread, figures included).",
    ]
    for kind in (FAILED, OPENS):
        chosen = [joint for joint in found if joint.kind == kind]
        if chosen:
            lines += [
                "",
                f"## {kind.capitalize()}",
                "",
                "| joint | band, Hz | largest at, Hz | |",
                "|---|---|---|---|",
            ]
            lines += [row(joint) for joint in chosen]
    return PAGE + "\n".join(lines) + "\n"


def row(joint: Found) -> str:
    """A joint in the table."""
    band = f"{joint.band[0]:.5g} to {joint.band[1]:.5g}"
    return f"| {joint.name} | {band} | {joint.frequency:.5g} | {joint.said} |"


def main() -> int:
    """Run the populations; the exit code is 0 where at least 97 of 100 joints pass."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--seeds", type=int, nargs="+", default=[1, 2, 3, 4, 5])
    parser.add_argument("--count", type=int, default=20)
    parser.add_argument("--jobs", type=int, default=2)
    parser.add_argument("--out", type=Path, default=Path("population-output"))
    parser.add_argument("--page", type=Path)
    asked = parser.parse_args()
    asked.out.mkdir(parents=True, exist_ok=True)
    work = [
        (seed, number, text)
        for seed in asked.seeds
        for number, text in enumerate(joints(seed, asked.count))
    ]
    found = []
    with ThreadPoolExecutor(asked.jobs) as pool:
        for joint in pool.map(lambda job: one(*job, asked.out), work):
            found.append(joint)
            print(
                f"{joint.name}  {joint.kind:24} {joint.seconds:5.1f} s  {joint.said}"[:160],
                flush=True,
            )
    kinds = Counter(joint.kind for joint in found)
    print(
        ", ".join(f"{kinds[kind]} {kind}" for kind in (PASSED, OPENS, FAILED)), f"of {len(found)}"
    )
    if asked.page:
        asked.page.write_text(page(found))
    return 0 if kinds[FAILED] <= 0.03 * len(found) else 1


if __name__ == "__main__":
    sys.exit(main())

"""Random bolted joints in space through the command line, and what is independent beside it.

python benchmarks/population/meshes.py [--seeds 11 12 13] [--count 10] [--out FILE] [--page FILE]

Every joint of `meshed_joints.py` is written as a user has it, a joint file and a mesh, and run: prestress,
quasi-static cycles, backbones of the mode that its load drives by all three methods, table and response of
the refined model under a load of its own (what resonates at a share of opening), then harmonic balance and
time integration at the frequency of its largest answer. Beside that: what the load and friction did over
closed cycles, the supports against the load, backbones against each other where the joint sticks and where
it slips, harmonic balance and the response against time integration, and the whole mesh turned by 35° about
the normal of its interfaces. Lines in FILE (JSON, one a joint) are not computed again."""

from __future__ import annotations

import argparse
import math
import sys
import tempfile
import time
from collections import Counter
from collections.abc import Iterable, Iterator
from functools import partial
from pathlib import Path

import numpy as np
from harmonic import compared
from meshed_joints import MeshedJoint, joints
from resumed import answered, study

import microslip
from microslip.analyses.backbone.points import amplitude_scale
from microslip.errors import MicroslipError
from microslip.pipeline.prepare import Assembly, assemble
from microslip.pipeline.run import Run, run

TURNED = 35.0
"""Degrees about the normal of the interfaces."""

CLOSED = 1e-4
"""Change of reactions over the last cycle up to which its energies are compared."""

NEAR = 0.05
"""Relative distance within which two motions are of one branch."""

ENOUGH = {"stuck": 1e-3, "turned": 1e-8, "reactions": 1e-8, "energy": 1e-2, "harmonic": 1e-2}
"""What counts as agreement; of energies while `CLOSED`."""

OFF = "stuck joint: the resonance"
"""What the run says where the refined model misses the stuck joint."""

SOUND, REFUSED, PARTLY, FAILED = "ran clean", "refused in words", "some of it failed", "failed"

BALANCED = ("force", "moment")
"""Loads whose resultant is known without the mesh."""

FIRST = """
[load]
port = "drive"
{key} = [{load!r}]
[analysis.cycle]
count = 4
steps = 60
smallest = 2e-3
largest = 0.6
[analysis.reduced]
amplitudes = 10
steps = 60
[analysis.response]
count = 201
[analysis.backbone]
modes = [{mode}]
methods = ["quasi_static", "prescribed", "harmonic"]
count = 3
smallest = 1e-5
largest = 0.03
steps = 60
harmonics = 3
"""

ALONE = "\n[analysis.cycle]\n"

SECOND = """
[analysis.harmonic]
frequencies = [{low!r}, {peak!r}]
harmonics = 7
stability = false
[analysis.time]
frequencies = [{peak!r}]
max_cycles = 150
"""

PAGE = """# Bolted joints in space at random

Joints in space drawn at random, none of which anything was developed on, each written as a joint file and a
mesh and run as `microslip run` does (`python benchmarks/population/meshes.py`). What is drawn is in
`benchmarks/population/meshed_joints.py`: laps, forks and straps of two or three bodies with one to three
bolts, described in five ways; bricks, wedges and tetrahedra, linear and quadratic, matching or not;
interfaces flat, inclined, arched, crowned or with gaps; friction 0.1 to 0.8, unlike metals, five kinds of
supports, forces, moments, pressures and moving bases. Loads are what resonates at 2 to 50 % of what opens
the joint. Harmonic balance has seven harmonics here, whatever its points would need. *Refused in words*: the
run ends with one message that says what is wrong; one joint in twelve is drawn to be none, and the others
refused are listed. *Some of it failed*: the run gives an answer and says
of some points that there is none. *Cautioned*: the run says that the refined model misses the resonance of
the stuck joint, and to take method "corrected", or backbones by prescribed cycles.

"""


def held_directions(joint: MeshedJoint) -> list[str]:
    """Outputs that are reactions of all supports."""
    return [
        line.split('"')[1] for line in joint.text.splitlines() if line.startswith('name = "hold_')
    ]


def scaled_load(a: Assembly, joint: MeshedJoint) -> float:
    """Load that resonates at its share of opening, with a hundredth of damping beside the material's."""
    mode = a.mode
    alpha, beta = a.model.rayleigh
    ratio = 0.01 + (alpha + beta * mode.stuck_omega**2) / (2 * mode.stuck_omega)
    size = joint.share * amplitude_scale(a.prepared, mode)
    work = abs(mode.load_on_stuck[a.prepared.drive])
    load = 2 * ratio * mode.stuck_omega**2 * size / work
    return float(min(load, 0.5 * a.opening_moment))


def number_of(a: Assembly) -> int:
    """Number of the mode that the load drives, as backbones count."""
    modes = microslip.joint_modes(a.model, a.prestress, a.prepared.law)
    return 1 + int(np.argmax([abs(m.stuck @ a.mode.stuck) for m in modes]))


def energies(done: Run) -> dict:
    """By how much the work of the load and of friction differ over cycles that are closed."""
    cycles = [c for drive in done.cycles.values() for c in drive]
    closed = [c for c in cycles if c.closure <= CLOSED and c.dissipated > 1e-9 * _stored(c)]
    return {
        "cycles": len(cycles),
        "closed": sum(c.closure <= CLOSED for c in cycles),
        "energy": max((c.imbalance for c in closed), default=None),
    }


def _stored(cycle: microslip.Cycle) -> float:
    """Size of the work of the load in a quarter of a cycle."""
    return cycle.amplitude * float(np.ptp(cycle.output).max(initial=0.0))


def reactions(done: Run, joint: MeshedJoint) -> float | None:
    """What the supports leave of the load in a quasi-static cycle, over it; None where springs help."""
    holds, port = held_directions(joint), next(p for p in done.joint.port if p.name == "drive")
    cycles = done.cycles.get("load", ())
    if not holds or done.joint.spring or port.kind not in BALANCED or not cycles:
        return None
    cycle, model = cycles[-1], done.model
    held = np.zeros((len(cycle.load), 3))
    for name in holds:
        held[:, "xyz".index(name[-1])] += cycle.output[:, model.port(f"output {name}")]
    given = np.zeros((len(cycle.load), 3))
    if port.kind == "force":
        given = np.outer(cycle.load, np.array(port.direction) / np.linalg.norm(port.direction))
    size = np.abs(cycle.load).max()
    if port.kind == "moment":
        size /= float(np.ptp(done.geometry.points, axis=0).max()) if done.geometry else 1.0
    return float(np.abs(held + given).max() / size)


def stuck_ends(done: Run) -> dict:
    """Where the joint sticks, the methods against its stuck mode; where it slips, against each other."""
    curves = {curve.method: curve for curve in done.backbones if len(curve.points)}
    found: dict = {"methods": sorted(curves)}
    mode = next(iter(curves.values())).mode if curves else done.mode
    found |= {
        "sliding_hz": mode.sliding_frequency,
        "stuck_hz": mode.stuck_frequency,
        "mac": mode.assurance,
    }
    exact = {k: v for k, v in curves.items() if k != "quasi_static"}
    misses = [abs(v.frequency[0] / mode.stuck_frequency - 1) for v in exact.values()]
    found["stuck"] = float(max(misses)) if misses else None
    if len(exact) == 2:
        two = exact["prescribed"], exact["harmonic"]
        at = [p.amplitude for p in two[0].points]
        beside = np.interp(at, two[1].amplitude, two[1].frequency, left=np.nan, right=np.nan)
        ratio = np.interp(at, two[1].amplitude, two[1].damping_ratio, left=np.nan, right=np.nan)
        known = np.isfinite(beside)
        if known.any():
            found["backbone_hz"] = float(np.abs(two[0].frequency / beside - 1)[known].max())
            found["backbone_damping"] = float(np.abs(two[0].damping_ratio / ratio - 1)[known].max())
    return found


def at_the_peak(done: Run, text: str, file: Path) -> dict:
    """Harmonic balance and the response against time integration."""
    if not len(done.responses):
        return {}
    curve = done.responses[0]
    k = curve.peak
    peak, shown = float(curve.frequency[k]), abs(curve.amplitude[k])
    stated = None if curve.error_indicator is None else float(curve.error_indicator[k])
    file.write_text(text + SECOND.format(low=0.97 * peak, peak=peak))
    again = run(microslip.load_joint(file), done=done.outcomes)
    found: dict = {
        "peak_hz": peak,
        "edge": curve.peak_at_edge,
        "opens": math.isfinite(curve.opening_load),
    }
    found["failed"] = [str(f) for f in again.failures if f.stage in ("harmonic", "time")]
    times = [abs(t.steady.amplitude) for t in again.time_domain if t.settled]
    points = [p for h in again.harmonic for p in h.points if abs(p.frequency / peak - 1) < 1e-9]
    misses = [abs(abs(p.amplitude) / t - 1) for p in points for t in times]
    if (not misses or min(misses) > NEAR) and points:
        beside = [compared(again.prepared, point) for point in points]
        found["other_branches"] = sum(one["near"] for one in beside)
        misses += [one["error"] for one in beside if one["near"]]
        times += [one["amplitude"] * (1 + one["error"]) for one in beside if one["near"]]
    found |= {"settled": bool(times), "points": len(points), "harmonic": min(misses, default=None)}
    if times:
        found |= {"reduced": float(min(abs(shown / t - 1) for t in times)), "stated": stated}
    return found


def turned_difference(a: Assembly, done: Run, twin: Assembly) -> float:
    """The largest relative difference of the same joint turned about the normal of its interfaces."""
    misses = [
        twin.mode.sliding_omega / a.mode.sliding_omega - 1,
        twin.mode.stuck_omega / a.mode.stuck_omega - 1,
        *(
            (_sorted(twin.prestress.pressure) - _sorted(a.prestress.pressure))
            / a.prestress.pressure.max()
        ),
    ]
    cycles = done.cycles.get("load", ())
    if cycles:
        own = cycles[len(cycles) // 2]
        other = microslip.cycle(twin.prepared, own.amplitude, steps=60, max_cycles=2)
        same = microslip.cycle(a.prepared, own.amplitude, steps=60, max_cycles=2)
        misses.append(
            np.abs(_sorted(other.pressure) - _sorted(same.pressure)).max() / same.pressure.max()
        )
        size = max(same.dissipated, 1e-3 * same.amplitude * float(np.ptp(same.output[:, 0])))
        misses.append((other.dissipated - same.dissipated) / size)
    return float(np.abs(misses).max())


def _sorted(pressure: np.ndarray) -> np.ndarray:
    """Pressures by size: pairs are numbered by their place, which turns."""
    return np.sort(pressure, axis=-1)


def row_of(joint: MeshedJoint, twin: MeshedJoint, folder: Path) -> dict:
    """What became of one joint."""
    file = joint.write(folder, "joint", ALONE)
    row: dict = {"unsound": joint.unsound, "key": joint.key}
    try:
        a = assemble(microslip.load_joint(file))
        load = scaled_load(a, joint)
        text = joint.text + FIRST.format(key=joint.key, load=load, mode=number_of(a))
        file.write_text(text)
        row |= {
            "dofs": a.structure.dofs,
            "pairs": a.model.pairs,
            "touching": int(a.prestress.touching.sum()),
            "share": joint.share,
        }
        done = run(microslip.load_joint(file))
    except MicroslipError as error:
        return row | {"kind": REFUSED, "said": str(error)}
    row["failed"] = [str(f) for f in done.failures]
    row["cautions"] = [str(c) for c in (*done.assembly.doubts, *done.cautions)]
    row["timings"] = {key: round(value, 2) for key, value in done.timings.items()}
    row |= energies(done)
    row["reactions"] = reactions(done, joint)
    row |= stuck_ends(done)
    try:
        peak = at_the_peak(done, text, file)
        row["failed"] += peak.pop("failed", [])
        row |= peak
        other = assemble(microslip.load_joint(twin.write(folder, "turned", ALONE)))
        row["turned"] = turned_difference(a, done, other)
    except MicroslipError as error:
        row["failed"].append(str(error))
    row["kind"] = PARTLY if row["failed"] else SOUND
    return row


def page(rows: dict[str, dict]) -> str:
    """The table as Markdown."""
    found = list(rows.values())
    kinds = Counter(row["kind"] for row in found)
    meant = sum(bool(row["unsound"]) and row["kind"] == REFUSED for row in found)
    populations = sorted({name.partition("/")[0] for name in rows}, key=int)
    seconds = [row["wall"] for row in found]
    ran = [row for row in found if "pairs" in row]

    def worst(key: str, within: float | None = None) -> str:
        values = [row[key] for row in ran if row.get(key) is not None]
        if not values:
            return "–"
        told = f"median {np.median(values):.1e}, most {max(values):.1e} of {len(values)}"
        if within is not None:
            told = f"{sum(v <= within for v in values)} of {len(values)} within {within:g}; " + told
        return told

    compared_ones = [row for row in ran if row.get("reduced") is not None]
    warned = [row for row in compared_ones if any(OFF in each for each in row["cautions"])]
    quiet = [row for row in compared_ones if row not in warned]

    def told(some: list[dict]) -> str:
        if not some:
            return "–"
        values = [row["reduced"] for row in some]
        return f"median {np.median(values):.1e}, most {max(values):.1e} of {len(values)}"

    lines = [
        f"| | {len(found)} joints of population {', '.join(populations)} |",
        "|---|---|",
        *(f"| {kind} | {kinds[kind]} |" for kind in (SOUND, PARTLY, REFUSED, FAILED)),
        f"| of those refused, drawn to be no joint | {meant} of {sum(bool(r['unsound']) for r in found)} |",
        f"| contact pairs | {_range(r['pairs'] for r in ran)} |",
        f"| degrees of freedom | {_range(r['dofs'] for r in ran)} |",
        f"| quasi-static cycles that closed | {sum(r.get('closed', 0) for r in ran)} of "
        f"{sum(r.get('cycles', 0) for r in ran)} |",
        f"| their energy: load against friction | {worst('energy', ENOUGH['energy'])} |",
        f"| supports against the load | {worst('reactions', ENOUGH['reactions'])} |",
        f"| the mesh turned by {TURNED:g}° | {worst('turned', ENOUGH['turned'])} |",
        f"| backbones where the joint sticks, against its stuck mode | {worst('stuck', ENOUGH['stuck'])} |",
        f"| prescribed against harmonic backbone: frequency | {worst('backbone_hz')} |",
        f"| the same: damping ratio | {worst('backbone_damping')} |",
        f"| harmonic balance against time integration | {worst('harmonic', ENOUGH['harmonic'])} |",
        f"| peak of the refined model against time integration, cautioned of the stuck joint | "
        f"{told(warned)} |",
        f"| the same, not cautioned | {told(quiet)} |",
        f"| of the latter below what it states | {sum(r['reduced'] <= r['stated'] for r in quiet)} of "
        f"{len(quiet)} |",
        f"| resonance opens the joint | {sum(bool(r.get('opens')) for r in ran)} |",
        f"| time of a joint, median and most | {np.median(seconds):.0f} s, {max(seconds):.0f} s |",
    ]
    for kind in (FAILED, REFUSED, PARTLY):
        chosen = [(name, row) for name, row in rows.items() if row["kind"] == kind]
        if chosen:
            lines += ["", f"## {kind.capitalize()}", "", "| joint | | |", "|---|---|---|"]
        for name, row in chosen:
            said = row.get("said") or "; ".join(row["failed"][:3])
            lines.append(
                f"| {name} | {row['unsound']} | {' '.join(said.split()).replace('|', '/')[:300]} |"
            )
    return PAGE + "\n".join(lines) + "\n"


def _range(values: Iterable[int]) -> str:
    found = list(values)
    return f"{min(found)} to {max(found)}" if found else "–"


def cases_of(asked: argparse.Namespace) -> Iterator[tuple]:
    """Every joint of the populations with the same joint turned, and what computes its row."""
    for seed in asked.seeds:
        both = zip(joints(seed, asked.count), joints(seed, asked.count, TURNED), strict=True)
        for number, (joint, twin) in enumerate(both):
            files = asked.files / f"{seed}_{number:03d}" if asked.files else None
            yield f"{seed}/{number:03d}", partial(counted, joint, twin, files)


def counted(joint: MeshedJoint, twin: MeshedJoint, files: Path | None) -> dict:
    """What one joint says; a fault of the program is counted, and the study goes on."""
    began = time.process_time()
    with tempfile.TemporaryDirectory() as spare:
        try:
            row = row_of(joint, twin, files or Path(spare))
        except Exception as error:
            said = f"{type(error).__name__}: {error}"
            row = {"unsound": joint.unsound, "kind": FAILED, "said": said}
    return {"wall": time.process_time() - began, **row}


def main() -> int:
    """Compute what is missing and print the table."""
    parser = study(__doc__, [11, 12, 13], 0, "population-meshes.jsonl")
    parser.set_defaults(count=10)
    parser.add_argument("--files", type=Path, help="keep joint files and meshes there")
    asked = parser.parse_args()
    return answered(
        asked, cases_of(asked), page, lambda row: f"{row['kind']} {row.get('said', '')[:200]}"
    )


if __name__ == "__main__":
    sys.exit(main())

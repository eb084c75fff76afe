"""Time and memory of every stage as meshes and interfaces grow, from a file to a backbone.

    python benchmarks/scale.py [--cases 24,24 12,12 8,6] [--steps 60] [--count 30] [--json FILE]
    python benchmarks/scale.py --case 8,6

Each case is the half-lap beam of ``examples`` meshed anew (the gmsh package), sizes of elements in the
contact and far from it in mm, in a process of its own. Stages are timed in processor seconds, which a busy
machine distorts less; memory is the largest resident set. Exponents are slopes of a straight line through
the logarithms, against degrees of freedom, or against contact pairs for what depends on these alone.
``OMP_NUM_THREADS=1`` for one thread.
"""

from __future__ import annotations

import argparse
import json
import resource
import subprocess
import sys
import tempfile
import time
from collections.abc import Callable
from pathlib import Path

import numpy as np

import microslip.model.described_mesh as described
import microslip.pipeline.prepare as preparing
from microslip import load_joint
from microslip.analyses.backbone.cycles import CycleControl, quasi_static_backbone
from microslip.analyses.backbone.points import amplitude_scale, geometric
from microslip.analyses.prepared.joint_modes import joint_modes, pick_mode
from microslip.analyses.statics.cycle import quasi_static_cycle
from microslip.contact.pairs import SLIP
from microslip.model.joint import Reducer
from microslip.pipeline.cost import base_seconds, memory

ROOT = Path(__file__).resolve().parent.parent
EXAMPLE = ROOT / "examples" / "half_lap_beam.toml"
MAKE = ROOT / "examples" / "meshes" / "make.py"

BY_PAIRS = ("prestress", "a step", "backbone")
"""Stages that see contact pairs alone."""


def timed(stages: dict[str, float], name: str, work: Callable) -> Callable:
    """A function that adds the processor seconds of another one to a stage."""

    def run(*given, **named):
        start = time.process_time()
        try:
            return work(*given, **named)
        finally:
            _add(stages, name, time.process_time() - start)

    return run


def _add(stages: dict[str, float], name: str, seconds: float) -> None:
    """Add to a stage, and say so: a large case takes long."""
    stages[name] = stages.get(name, 0.0) + seconds
    print(f"{name}: {stages[name]:.3g} s, {_resident() / 1e9:.2f} GB", file=sys.stderr, flush=True)


WATCHED = (
    (described, "read_mesh", "read"),
    (described, "couple", "pairs"),
    (described, "structure_from_mesh", "assemble"),
    (described, "zero_modes", "motions"),
    (Reducer, "__init__", "modes"),
    (Reducer, "model", "flexibility"),
    (preparing, "_prestress", "prestress"),
    (preparing, "linear_states", "linear states"),
)
"""Functions that are stages of what every analysis starts from."""


def measure(size: float, rest: float, steps: int, count: int) -> dict:
    """One case in this process."""
    with tempfile.TemporaryDirectory() as folder:
        (Path(folder) / "meshes").mkdir()
        command = [sys.executable, MAKE, "half_lap_beam", "--size", str(size), "--rest", str(rest)]
        command += ["--out", str(Path(folder) / "meshes")]
        subprocess.run(command, check=True, stdout=subprocess.DEVNULL)
        file = Path(folder) / EXAMPLE.name
        file.write_text(EXAMPLE.read_text("utf-8"))
        joint = load_joint(file)
        stages: dict[str, float] = {}
        for where, name, stage in WATCHED:
            setattr(where, name, timed(stages, stage, getattr(where, name)))
        began = time.process_time()
        assembly = preparing.assemble(joint)
        _add(stages, "before analyses", time.process_time() - began)
        found = {
            "size_mm": [size, rest],
            "dofs": assembly.structure.dofs,
            "pairs": assembly.model.pairs,
            "touching": int(assembly.prestress.touching.sum()),
            "seconds": stages,
            "bytes": _resident(),
            "said": {
                "seconds": base_seconds(joint, assembly.structure.dofs),
                "bytes": memory(joint, assembly.structure.dofs),
            },
        }
    return found | _analyses(assembly, stages, steps, count) if count else found


def _analyses(assembly, stages: dict[str, float], steps: int, count: int) -> dict:
    """A cycle and a backbone: their seconds into the stages, and what else is worth knowing."""
    prepared = assembly.prepared
    start = time.process_time()
    cycle = quasi_static_cycle(
        prepared, prepared.drive, 0.05 * assembly.opening_moment, steps=steps, max_cycles=2
    )
    _add(stages, "a step", (time.process_time() - start) / (steps * cycle.cycles))
    mode = pick_mode(joint_modes(assembly.model, assembly.prestress, prepared.law), 1)
    start = time.process_time()
    sizes = geometric(*(share * amplitude_scale(prepared, mode) for share in (1e-3, 0.8)), count)
    _, missed = quasi_static_backbone(prepared, mode, sizes, control=CycleControl(steps, 20))
    _add(stages, "backbone", time.process_time() - start)
    slipping = float(np.median((cycle.status == SLIP).sum(axis=1)))
    return {"slipping": slipping, "missed": len(missed)}


def _resident() -> float:
    return 1024.0 * resource.getrusage(resource.RUSAGE_SELF).ru_maxrss


def exponents(cases: list[dict]) -> dict[str, float]:
    """Slopes of the logarithms of seconds and bytes."""
    out = {}
    for name in cases[0]["seconds"]:
        by = "pairs" if name in BY_PAIRS else "dofs"
        out[name] = _slope([c[by] for c in cases], [c["seconds"][name] for c in cases])
    out["bytes"] = _slope([c["dofs"] for c in cases], [c["bytes"] for c in cases])
    return out


def _slope(x: list[float], y: list[float]) -> float:
    return float(np.polyfit(np.log(x), np.log(np.maximum(y, 1e-6)), 1)[0])


def table(cases: list[dict]) -> str:
    """Cases as columns, stages as rows."""
    columns = "|".join(f" {c['dofs']:,} dofs, {c['pairs']} pairs " for c in cases)
    lines = [f"| stage |{columns}| exponent |", "|---" * (len(cases) + 2) + "|"]
    slopes = exponents(cases) if len(cases) > 1 else {}
    for name in cases[0]["seconds"]:
        values = " | ".join(f"{c['seconds'][name]:.3g} s" for c in cases)
        lines.append(f"| {name} | {values} | {slopes.get(name, np.nan):.1f} |")
    values = " | ".join(f"{c['bytes'] / 1e9:.2f} GB" for c in cases)
    lines.append(f"| memory | {values} | {slopes.get('bytes', np.nan):.1f} |")
    said = " | ".join(
        f"{c['said']['seconds']:.3g} s, {c['said']['bytes'] / 1e9:.2f} GB" for c in cases
    )
    lines.append(f"| said before | {said} | |")
    return "\n".join(lines)


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--cases", nargs="+", default=["24,24", "12,12", "8,6", "9,4.5"])
    parser.add_argument("--case", help="one case, in this process; prints a line of JSON")
    parser.add_argument("--steps", type=int, default=60, help="load steps per cycle")
    parser.add_argument(
        "--count", type=int, default=30, help="amplitudes of the backbone; 0: no analyses"
    )
    parser.add_argument("--json", type=Path, help="write what was found to this file")
    asked = parser.parse_args()
    if asked.case:
        size, rest = map(float, asked.case.split(","))
        print(json.dumps(measure(size, rest, asked.steps, asked.count)))
        return
    found = []
    for case in asked.cases:
        command = [sys.executable, __file__, "--case", case]
        command += ["--steps", str(asked.steps), "--count", str(asked.count)]
        done = subprocess.run(command, check=False, capture_output=True, text=True)
        if done.returncode:
            print(f"{case}: {done.stderr.splitlines()[-1]}", file=sys.stderr)
            continue
        found.append(json.loads(done.stdout))
        print(table(found[-1:]), flush=True)
        if asked.json:
            asked.json.write_text(json.dumps({"cases": found}, indent=1) + "\n")
    if not found:
        raise SystemExit(1)
    found.sort(key=lambda case: case["dofs"])
    print("\n" + table(found))
    if asked.json:
        asked.json.write_text(
            json.dumps({"cases": found, "exponents": exponents(found)}, indent=1) + "\n"
        )


if __name__ == "__main__":
    main()

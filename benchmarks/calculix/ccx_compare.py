"""CalculiX beside microslip: seconds per load step and energy dissipated per quasi-static cycle.

    python benchmarks/calculix/ccx_compare.py [FILE] [--pairs N] [--out DIR]

Writes the deck of the joint, runs ``ccx`` (Debian: ``apt install calculix-ccx``), and prints its numbers
beside ours on the same mesh: on the same elements and contact points, on our own elements with the
same penalty, and with the exact law. Without ``ccx`` it says so and ends with status 0.
"""

from __future__ import annotations

import argparse
import json
import platform
import sys
import tempfile
import time
from dataclasses import asdict, dataclass
from pathlib import Path

import numpy as np
from ccx_deck import Loading, write_deck
from ccx_results import contact_points, find_ccx, iterations, read_path, run_deck
from linear_joint import linear_joint
from same_elements import ccx_points, gauss_points, matched_model, penalty_law
from threadpoolctl import threadpool_limits

from microslip import load_joint, prepare_joint
from microslip.analyses.statics.cycle import quasi_static_cycle
from microslip.contact.law import contact_law
from microslip.errors import MicroslipError
from microslip.model import lap
from microslip.model.joint import Reducer

ROOT = Path(__file__).resolve().parent.parent.parent
LOAD_SCALE = 1e-3
"""Clamp and moment are run this much smaller: both laws scale with the load.

ccx looks for contact in the deformed position. There, matching faces no longer match, and slivers of
neighbouring faces would double its contact points for nothing.
"""

MOST_POINTS = 800
"""Largest number of pairs that our dense flexibility is asked to take for the identical problem."""


@dataclass(frozen=True)
class Row:
    """One way of computing the last cycle; energy at the full clamp force.

    Attributes
    ----------
    name : str
    points : int
        Contact points of the model.
    dissipated : float
        Work of the end moment over the last cycle, J/m.
    rotation : float
        Half the range of the ends' relative rotation over the last cycle, rad.
    slip : float
        Largest range of the relative displacement of a pair, m.
    seconds_per_step : float
        Processor time of one thread, which a busy machine distorts less than wall time.
    once : float
        Seconds of processor time before the first step.
    """

    name: str
    points: int
    dissipated: float
    rotation: float
    slip: float
    seconds_per_step: float
    once: float


def arguments(argv):
    """Command line."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("file", nargs="?", type=Path, default=ROOT / "examples" / "lap_joint.toml")
    parser.add_argument("--pairs", type=int, help="contact pairs (default: those of the file)")
    parser.add_argument("--moment", type=float, default=2e-3, help="M/(PL)")
    parser.add_argument("--steps", type=int, default=60, help="load steps per cycle")
    parser.add_argument("--cycles", type=int, default=2, help="cycles; the last is compared")
    parser.add_argument("--normal-stiffness", type=float, default=1e15, help="penalty, N/m³")
    parser.add_argument("--tangential-stiffness", type=float, default=1e15, help="N/m³")
    parser.add_argument(
        "--force-tolerance", type=float, default=1e-5, help="of ccx, over the mean force"
    )
    parser.add_argument("--out", type=Path, help="keep the files of ccx in this folder")
    parser.add_argument("--json", type=Path, help="write the table to this file as well")
    return parser.parse_args(argv)


def loading_of(joint, options):
    """What both programs impose."""
    clamp = joint.clamp.force * LOAD_SCALE
    return Loading(
        clamp=clamp,
        moment=options.moment * clamp * joint.beams.length,
        spring=joint.support.horizontal_spring,
        friction=joint.contact.friction,
        normal_stiffness=options.normal_stiffness,
        tangential_stiffness=options.tangential_stiffness,
        steps=options.steps,
        cycles=options.cycles,
        force_tolerance=options.force_tolerance,
    )


def run_ccx(ccx, folder, linear, material, loading):
    """Run the deck; the last cycle as a `Row`, the path, and iterations per load step."""
    seconds = run_deck(ccx, folder, "joint", write_deck(linear, material, loading))
    increments = 1 + loading.steps * loading.cycles
    path = read_path(folder / "joint.dat", linear, increments)
    last = slice(-loading.steps - 1, None)
    row = _row(
        "CalculiX, C3D8I, face-to-face penalty",
        int(contact_points(folder / "joint.cvg").max()),
        loading,
        path.rotation[last],
        np.ptp(path.slip[last], axis=0).max(),
        seconds / increments,
        0.0,
    )
    return row, path, float(iterations(folder / "joint.cvg")[1:].mean())


def _row(name, points, loading, rotation, slip, seconds_per_step, once):
    load = loading.moment * np.sin(2 * np.pi * np.arange(loading.steps + 1) / loading.steps)
    work = float(0.5 * (load[1:] + load[:-1]) @ np.diff(rotation))
    return Row(
        name,
        points,
        work / LOAD_SCALE**2,
        float(np.ptp(rotation)) / 2 / LOAD_SCALE,
        float(slip) / LOAD_SCALE,
        seconds_per_step,
        once,
    )


def run_ours(name, reduced, loading):
    """Our last cycle as a `Row`; `reduced` makes model and contact law.

    The slip is returned as well: (steps + 1, m).
    """
    start = time.process_time()
    model, law = reduced()
    joint = prepare_joint(model, law, {"clamp": loading.clamp}, "moment")
    once = time.process_time() - start
    seconds = []
    for _ in range(4):
        start = time.process_time()
        cycle = quasi_static_cycle(
            joint,
            joint.drive,
            loading.moment,
            steps=loading.steps,
            max_cycles=loading.cycles,
            closure=0.0,
        )
        seconds.append(time.process_time() - start)
    row = _row(
        name,
        model.pairs,
        loading,
        cycle.output[:, model.port(joint.drive)],
        np.ptp(cycle.slip, axis=0).max(),
        float(np.median(seconds[1:])) / (loading.steps * loading.cycles),
        once,
    )
    return row, cycle.slip


def compare(joint, loading, ccx, folder):
    """All rows, and what else is worth saying: iterations of ccx, slip profile."""
    material, control = lap.materials(joint)[0], lap.mesh_control(joint)
    linear = linear_joint(lap.geometry(joint), control)

    def same(points):
        model = matched_model(linear, material, loading.spring, points)
        return model, penalty_law(model, loading)

    def shipped(exact):
        structure = lap.lap_joint_structure(
            lap.geometry(joint), material, control, horizontal_spring=loading.spring
        )
        model = Reducer(structure, joint.mesh.modes, (0.0, 0.0)).model(structure.loads)
        if exact:
            return model, contact_law(model.pairs, loading.friction)
        return model, penalty_law(model, loading)

    own, slip = run_ours("microslip, own elements, same penalty", lambda: shipped(False), loading)
    exact, _ = run_ours("microslip, own elements, exact law", lambda: shipped(True), loading)
    reference, path, per_step = run_ccx(ccx, folder, linear, material, loading)
    rows = [reference]
    rules = {"2 points a face": gauss_points(2)}
    if len(linear.lower_faces) * len(ccx_points()[0]) <= MOST_POINTS:
        rules = {"its contact points": ccx_points(), **rules}
    for name, points in rules.items():
        rows.append(
            run_ours(f"microslip, same elements, {name}", lambda p=points: same(p), loading)[0]
        )
    rows += [own, exact]
    ranges = [np.ptp(s, axis=0) for s in (slip, path.slip[-loading.steps - 1 :])]
    return rows, {
        "nodes": len(linear.nodes),
        "elements": len(linear.quads),
        "ccx_iterations_per_step": per_step,
        "slip_profile_difference": float(np.abs(ranges[0] - ranges[1]).max() / ranges[1].max()),
    }


def report(rows, notes):
    """The table as text."""
    reference = rows[0]
    lines = [
        "| | contact points | dissipated, J/m | to CalculiX | rotation, rad | largest slip, µm "
        "| per step | once |",
        "|---|---|---|---|---|---|---|---|",
    ]
    for row in rows:
        difference = f"{row.dissipated / reference.dissipated - 1:+.1e}"
        lines.append(
            f"| {row.name} | {row.points} | {row.dissipated:.6f} | "
            f"{'' if row is reference else difference} | {row.rotation:.6e} | "
            f"{row.slip * 1e6:.3f} | {1e3 * row.seconds_per_step:.4g} ms | {row.once:.1f} s |"
        )
    lines.append("")
    lines.append(
        f"{notes['nodes']} nodes and {notes['elements']} elements in the plane; ccx took "
        f"{notes['ccx_iterations_per_step']:.1f} iterations per step. Slip range over the overlap, own "
        f"elements against CalculiX: within {notes['slip_profile_difference']:.1e} of the largest."
    )
    return "\n".join(lines)


def main(argv=None):
    """Entry point; returns the exit status."""
    options = arguments(argv)
    ccx = find_ccx()
    if ccx is None:
        return 0
    try:
        joint = load_joint(options.file)
        if options.pairs:
            contact = joint.contact.model_copy(update={"pairs": options.pairs})
            joint = joint.model_copy(update={"contact": contact})
        loading = loading_of(joint, options)
        with threadpool_limits(1), tempfile.TemporaryDirectory() as temporary:
            folder = options.out or Path(temporary)
            folder.mkdir(parents=True, exist_ok=True)
            rows, notes = compare(joint, loading, ccx, folder)
    except MicroslipError as error:
        print(f"CalculiX comparison failed: {error}", file=sys.stderr)
        return 1
    print(report(rows, notes))
    if options.json:
        record = {
            "python": platform.python_version(),
            "pairs": joint.contact.pairs_used,
            "moment_over_clamp_force_length": options.moment,
            "loading": asdict(loading),
            "load_scale": LOAD_SCALE,
            **notes,
            "rows": [asdict(row) for row in rows],
        }
        options.json.write_text(json.dumps(record, indent=1) + "\n")
    return 0


if __name__ == "__main__":
    sys.exit(main())

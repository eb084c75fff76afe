"""CalculiX beside microslip on a beam with three bolts: frequencies, and one quasi-static cycle.

    python benchmarks/calculix/half_lap_beam.py [FILE] [--moment 20] [--steps 24] [--out DIR] [--json FILE]

Both take the mesh of the joint file. Frequencies are those of the two halves tied over the whole interface,
free in space. For the cycle both have the same nodal forces and penalty; the halves are clamped
without friction, the moment goes up to its amplitude and once round. Without ``ccx`` it says so and ends with
status 0.
"""

from __future__ import annotations

import argparse
import io
import json
import os
import resource
import shutil
import subprocess
import sys
import tempfile
import time
from pathlib import Path

import numpy as np
from ccx_deck import MM, NEVER, Loading, controls, interaction, listed
from ccx_results import contact_points, iterations, read_displacements
from threadpoolctl import threadpool_limits

from microslip import load_joint
from microslip.analyses.prepared.prestress import opening_load
from microslip.analyses.statics.cycle import quasi_static_cycle
from microslip.errors import ContactError, MicroslipError
from microslip.model.described_mesh import read_described_mesh
from microslip.model.mesh.read import read_mesh
from microslip.model.modes import linear_modes
from microslip.pipeline.prepare import assemble

ROOT = Path(__file__).resolve().parent.parent.parent
LOAD_SCALE = 1e-3
"""Of bolts and moment in the deck, as in `ccx_compare.py`: contact is searched in the deformed position."""

SOFT = 1e-10
"""Springs on the loaded nodes that hold the free beam in place in CalculiX, over the largest stiffness of a
node: together some N/m, of which a beam bent by a millimetre feels less than a thousandth of its moment."""

MODES = 12
"""Frequencies that are compared, beyond the six rigid motions."""


def arguments(argv):
    """Command line."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument(
        "file", nargs="?", type=Path, default=ROOT / "examples" / "half_lap_beam.toml"
    )
    parser.add_argument("--moment", type=float, default=100.0, help="N m")
    parser.add_argument(
        "--steps", type=int, default=24, help="load steps per cycle, a multiple of 4"
    )
    parser.add_argument("--stiffness", type=float, default=1e14, help="penalty, N/m³, both ways")
    parser.add_argument(
        "--force-tolerance", type=float, default=1e-4, help="of ccx, over the mean force"
    )
    parser.add_argument("--frequencies", action="store_true", help="frequencies alone")
    parser.add_argument("--out", type=Path, help="keep the files of ccx in this folder")
    parser.add_argument("--json", type=Path, help="write what was found to this file as well")
    return parser.parse_args(argv)


def with_penalty(joint, stiffness):
    """The joint with contact stiffness, Pa/m."""
    both = {"normal_stiffness": stiffness, "tangential_stiffness": stiffness}
    interfaces = tuple(i.model_copy(update=both) for i in joint.interface)
    return joint.model_copy(update={"interface": interfaces})


def write_mesh(out, mesh, interface):
    """Nodes, elements, material and the two contact surfaces, in mm and N."""
    print("*HEADING\nHalf-lap beam; N, mm, tonnes\n*NODE, NSET=ALL", file=out)
    for k, point in enumerate(mesh.points * MM, 1):
        print(f"{k}, " + ", ".join(f"{c:.12g}" for c in point), file=out)
    (block,) = mesh.blocks
    print("*ELEMENT, TYPE=C3D10, ELSET=BODIES", file=out)
    for k, nodes in enumerate(block.nodes + 1, 1):
        print(", ".join(map(str, (k, *nodes))), file=out)
    for name, surface in zip(("SLAVE", "MASTER"), interface, strict=True):
        faces = mesh.surfaces[surface]
        print(f"*SURFACE, NAME={name}, TYPE=ELEMENT", file=out)
        for element, face in zip(faces.elements + 1, faces.faces + 1, strict=True):
            print(f"{element}, S{face}", file=out)
    (metal,) = mesh.materials.values()
    print(
        f"*MATERIAL, NAME=METAL\n*ELASTIC\n{metal.youngs_modulus / MM**2:.12g}, "
        f"{metal.poissons_ratio:.12g}\n*DENSITY\n{metal.density / MM**4:.12g}\n"
        "*SOLID SECTION, ELSET=BODIES, MATERIAL=METAL",
        file=out,
    )


def frequency_deck(mesh, interface):
    """Deck of the tied beam, free in space."""
    out = io.StringIO()
    write_mesh(out, mesh, interface)
    print("*TIE, NAME=LAPS, POSITION TOLERANCE=0.01\nSLAVE, MASTER", file=out)
    print(f"*STEP\n*FREQUENCY\n{MODES + 6}\n*END STEP", file=out)
    return out.getvalue()


def cycle_deck(mesh, interface, structure, loading, bolts, port, factors):
    """Deck of the clamped beam and its cycle; what `loading` says of load steps is not used."""
    out = io.StringIO()
    write_mesh(out, mesh, interface)
    _springs(out, mesh, structure)
    interaction(out, loading)
    watched = np.unique(np.flatnonzero(structure.loads[port]) // 3)
    print("*NSET, NSET=WATCH", file=out)
    listed(out, watched + 1)
    for k, factor in enumerate([0.0, *factors]):
        print("*STEP, NLGEOM=NO, INC=1000\n*STATIC\n1., 1., 1e-4, 1.", file=out)
        controls(out, loading)
        if k:
            print("*CHANGE FRICTION, INTERACTION=JOINT\n*FRICTION", file=out)
            print(f"{loading.friction:.12g}, {loading.tangential_stiffness / MM**3:.12g}", file=out)
        # forces of the same node and direction replace those of the step before: all of them every time
        forces = bolts + factor * loading.moment * structure.loads[port]
        print("*CLOAD", file=out)
        for dof in np.flatnonzero((bolts != 0) | (structure.loads[port] != 0)):
            print(f"{dof // 3 + 1}, {dof % 3 + 1}, {forces[dof]:.12g}", file=out)
        print(f"*NODE PRINT, NSET=WATCH, FREQUENCY={NEVER}\nU\n*END STEP", file=out)
    return out.getvalue()


def _springs(out, mesh, structure):
    """Soft springs to ground at the loaded nodes, in all directions."""
    stiffness = SOFT * structure.stiffness.diagonal().max() / MM
    number = mesh.elements + 1
    nodes = np.unique(np.flatnonzero(sum(abs(load) for load in structure.loads.values())) // 3)
    for axis in (1, 2, 3):
        print(f"*ELEMENT, TYPE=SPRING1, ELSET=SPRING{axis}", file=out)
        for node in nodes + 1:
            print(f"{number}, {node}", file=out)
            number += 1
        print(f"*SPRING, ELSET=SPRING{axis}\n{axis}\n{stiffness:.12g}", file=out)


def run_ccx(ccx, folder, name, text):
    """Run a deck; processor seconds."""
    for old in folder.glob(f"{name}.*"):
        old.unlink()
    (folder / f"{name}.inp").write_text(text)
    start = resource.getrusage(resource.RUSAGE_CHILDREN).ru_utime
    with (folder / f"{name}.log").open("w") as log:
        done = subprocess.run(
            [ccx, "-i", name],
            cwd=folder,
            stdout=log,
            stderr=log,
            check=False,
            env={**os.environ, "OMP_NUM_THREADS": "1"},
        )
    if done.returncode:
        said = (folder / f"{name}.log").read_text(errors="replace").split("*ERROR")[-1]
        raise ContactError(
            f"ccx ended with status {done.returncode}: {' '.join(said.split())[:300]}"
        )
    return resource.getrusage(resource.RUSAGE_CHILDREN).ru_utime - start


def read_frequencies(dat):
    """Natural frequencies in Hz: the fourth column of the table of eigenvalues."""
    rows = [line.split() for line in dat.read_text(encoding="ascii").splitlines()]
    numbered = [row for row in rows if len(row) == 5 and row[0].isdigit()]
    return np.array([float(row[3]) for row in numbered])[: MODES + 6]


def compare_frequencies(ccx, folder, mesh, interface, joint):
    """Frequencies of the tied beam beyond the rigid motions, CalculiX first."""
    run_ccx(ccx, folder, "tied", frequency_deck(mesh, interface))
    theirs = read_frequencies(folder / "tied.dat")[6:]
    structure = read_described_mesh(joint).structure
    everything = np.arange(structure.interface.relative.shape[0])
    ours = linear_modes(structure, everything, MODES + 6).frequency[6:]
    return theirs, ours


def path_of(steps):
    """Factors of the moment at the end of each load step: straight up, and once round from there."""
    up = np.linspace(0, 1, steps // 4 + 1)[1:]
    theta = np.pi / 2 + 2 * np.pi * np.arange(1, steps + 1) / steps
    return np.concatenate([up, np.sin(theta)])


def our_cycle(joint, moment, steps):
    """One cycle after the first loading, and seconds of a step."""
    assembly = assemble(joint)
    port = joint.driven.name
    start = time.process_time()
    cycle = quasi_static_cycle(
        assembly.prepared, port, moment, steps=steps, phase=np.pi / 2, max_cycles=1, closure=0.0
    )
    seconds = (time.process_time() - start) / (1.25 * steps)
    return cycle, assembly, seconds


def compare_cycles(ccx, folder, mesh, interface, joint, options):
    """What both find of the cycle: dissipated energy and half the range of the rotation."""
    exact = assemble(joint)
    port = joint.driven.name
    opening = opening_load(exact.model, exact.prestress, port)
    moment = options.moment
    structure = exact.structure
    if structure.dofs != mesh.points.size:
        raise ContactError("the deck has neither supports nor ties: take them out of the joint")
    bolts = sum(structure.loads[each.name] * each.force for each in joint.preload)
    loading = Loading(
        clamp=0.0,
        moment=moment * LOAD_SCALE,
        spring=0.0,
        friction=joint.interface[0].friction,
        normal_stiffness=options.stiffness,
        tangential_stiffness=options.stiffness,
        force_tolerance=options.force_tolerance,
    )
    factors = path_of(options.steps)
    # displacements in mm: the load vector of a moment does its work on metres
    text = cycle_deck(mesh, interface, structure, loading, bolts * LOAD_SCALE, port, factors)
    rows = []
    for name, own in (
        ("exact law", joint),
        ("same penalty", with_penalty(joint, options.stiffness)),
    ):
        cycle, assembly, seconds = our_cycle(own, moment, options.steps)
        rotation = cycle.output[:, assembly.model.port(port)]
        rows.append(_row(f"microslip, {name}", rotation, moment, cycle.load / moment, seconds))
        rows[-1]["contact points"] = assembly.model.pairs
    used = run_ccx(ccx, folder, "cycle", text)
    times, fields = read_displacements(folder / "cycle.dat")
    if len(times) != len(factors) + 1:
        raise ContactError(f"ccx finished {len(times)} of {len(factors) + 1} steps")
    load = structure.loads[port].reshape(-1, 3)
    watched = np.flatnonzero(load.any(axis=1))
    rotation = [sum(load[k] @ u[k + 1] for k in watched) / MM / LOAD_SCALE for u in fields]
    last = slice(-options.steps - 1, None)
    row = _row("CalculiX", np.array(rotation[last]), moment, factors[last], used / len(times))
    row["contact points"] = int(contact_points(folder / "cycle.cvg").max())
    row["iterations a step"] = float(iterations(folder / "cycle.cvg").mean())
    return opening, moment, [row, *rows]


def _row(name, rotation, moment, factors, seconds):
    mean = 0.5 * (factors[1:] + factors[:-1])
    return {
        "name": name,
        "dissipated": float(moment * mean @ np.diff(rotation)),
        "rotation": float(np.ptp(rotation)) / 2,
        "seconds a step": seconds,
    }


def main(argv=None):
    """Entry point; returns the exit status."""
    options = arguments(argv)
    ccx = shutil.which("ccx")
    if ccx is None:
        print("CalculiX comparison skipped: no ccx on the path (Debian: apt install calculix-ccx)")
        return 0
    try:
        joint = load_joint(options.file)
        mesh = read_mesh(Path(joint.mesh.file), length=1e-3)
        interface = joint.interface[0].first, joint.interface[0].second
        with threadpool_limits(1), tempfile.TemporaryDirectory() as temporary:
            folder = options.out or Path(temporary)
            folder.mkdir(parents=True, exist_ok=True)
            theirs, ours = compare_frequencies(ccx, folder, mesh, interface, joint)
            print("| mode | CalculiX, Hz | microslip, Hz | difference |\n|---|---|---|---|")
            for k, (a, b) in enumerate(zip(theirs, ours, strict=True), 1):
                print(f"| {k} | {a:.3f} | {b:.3f} | {b / a - 1:+.2%} |", flush=True)
            record = {"calculix_hz": theirs.tolist(), "microslip_hz": ours.tolist()}
            if not options.frequencies:
                opening, moment, rows = compare_cycles(ccx, folder, mesh, interface, joint, options)
                record |= {"opening": opening, "moment": moment, "rows": rows}
                print(f"\nmoment {moment:.4g} N m; {opening:.4g} N m open the joint\n")
                print(
                    "| | contact points | dissipated, J | to CalculiX | rotation, rad | to CalculiX | "
                    "per step |\n|---|---|---|---|---|---|---|"
                )
                for row in rows:
                    energy, turn = (row[k] / rows[0][k] - 1 for k in ("dissipated", "rotation"))
                    print(
                        f"| {row['name']} | {row['contact points']} | {row['dissipated']:.6g} | "
                        f"{energy:+.2%} | {row['rotation']:.6e} | {turn:+.3%} | "
                        f"{row['seconds a step']:.3g} s |"
                    )
    except MicroslipError as error:
        print(f"CalculiX comparison failed: {error}", file=sys.stderr)
        return 1
    if options.json:
        options.json.write_text(json.dumps(record, indent=1) + "\n")
    return 0


if __name__ == "__main__":
    sys.exit(main())

"""CalculiX beside microslip on a beam with three bolts: frequencies, and one quasi-static cycle.

    python benchmarks/calculix/half_lap_beam.py [FILE] [--mesh FILE] [--moment 100] [--steps 24]
    python benchmarks/calculix/half_lap_beam.py --frequencies
    python benchmarks/calculix/half_lap_beam.py --trend 4 12 24 60

Both take the mesh of the joint file, or another one of the same beam. Frequencies are those of the two halves
tied over the whole interface, free in space. For the cycle both have the same nodal forces and penalty; the
halves are clamped without friction, the moment goes up to its amplitude and once round. `--trend` is ours
alone, with what CalculiX does to pairs that open and without. Without ``ccx`` the others say so and end with
status 0.
"""

from __future__ import annotations

import argparse
import io
import json
import sys
import tempfile
import time
from pathlib import Path

import numpy as np
from ccx_deck import MM, NEVER, Loading, controls, interaction, listed
from ccx_results import contact_points, find_ccx, iterations, read_displacements, run_deck
from same_faces import cycle_of_ccx, point_interface, prepared_points
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

DEGREE = 2
"""Of our quadrature on the pieces that faces share: three points each."""

MOST_POINTS = 1200
"""Largest number of points of the faces that our dense flexibility is asked to take."""


def arguments(argv):
    """Command line."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument(
        "file", nargs="?", type=Path, default=ROOT / "examples" / "half_lap_beam.toml"
    )
    parser.add_argument("--mesh", type=Path, help="another mesh of the beam, in mm")
    parser.add_argument("--moment", type=float, default=100.0, help="N m")
    parser.add_argument(
        "--steps", type=int, default=24, help="load steps per cycle, a multiple of 4"
    )
    parser.add_argument("--stiffness", type=float, default=1e14, help="penalty, N/m³, both ways")
    parser.add_argument(
        "--force-tolerance", type=float, default=1e-4, help="of ccx, over the mean force"
    )
    parser.add_argument("--frequencies", action="store_true", help="frequencies alone")
    parser.add_argument(
        "--trend", type=int, nargs="+", metavar="STEPS", help="our cycle with these steps; no ccx"
    )
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


def read_frequencies(dat):
    """Natural frequencies in Hz: the fourth column of the table of eigenvalues."""
    rows = [line.split() for line in dat.read_text(encoding="ascii").splitlines()]
    numbered = [row for row in rows if len(row) == 5 and row[0].isdigit()]
    return np.array([float(row[3]) for row in numbered])[: MODES + 6]


def compare_frequencies(ccx, folder, mesh, interface, joint):
    """Frequencies of the tied beam beyond the rigid motions, CalculiX first."""
    run_deck(ccx, folder, "tied", frequency_deck(mesh, interface))
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


def our_cycle(prepared, port, moment, steps):
    """One cycle after the first loading as a row."""
    start = time.process_time()
    cycle = quasi_static_cycle(
        prepared, port, moment, steps=steps, phase=np.pi / 2, max_cycles=1, closure=0.0
    )
    seconds = (time.process_time() - start) / (1.25 * steps)
    rotation = cycle.output[:, prepared.model.port(port)]
    return _row(rotation, moment, cycle.load / moment, seconds, prepared.model.pairs)


def our_rows(mesh, interface, joint, options):
    """Our cycles by name: Coulomb's law on pairs at nodes, exact and with the penalty, and at points of the
    faces; and at those with what ccx does to a pair that opens."""
    port, moment, steps = joint.driven.name, options.moment, options.steps
    exact = assemble(joint)
    opening = opening_load(exact.model, exact.prestress, port)
    same = assemble(with_penalty(joint, options.stiffness)).prepared
    rows = {
        "same penalty": our_cycle(same, port, moment, steps),
        "exact law": our_cycle(exact.prepared, port, moment, steps),
    }
    points = point_interface(mesh, *interface, DEGREE)
    if points.pairs > MOST_POINTS:
        print(f"{points.pairs} points of the faces are too many for a dense flexibility: left out")
        return opening, rows
    prepared = prepared_points(exact.structure, points, joint, options.stiffness, port)
    start = time.process_time()
    rotation = cycle_of_ccx(prepared, port, moment, path_of(steps))
    seconds = (time.process_time() - start) / len(rotation)
    last = slice(-steps - 1, None)
    dragged = _row(rotation[last], moment, path_of(steps)[last], seconds, points.pairs)
    coulomb = our_cycle(prepared, port, moment, steps)
    ours = {
        "points of the faces, reopened pairs as in ccx": dragged,
        "points of the faces": coulomb,
    }
    return opening, ours | rows


def trend(joint, options):
    """Print energies of our cycles with ever more steps: Coulomb's law, and reopened pairs as in ccx."""
    prepared = assemble(with_penalty(joint, options.stiffness)).prepared
    port, moment = joint.driven.name, options.moment
    print("| steps | Coulomb, J | reopened pairs as in ccx, J | difference |\n|---|---|---|---|")
    for steps in options.trend:
        coulomb = our_cycle(prepared, port, moment, steps)["dissipated"]
        rotation = cycle_of_ccx(prepared, port, moment, path_of(steps))
        last = slice(-steps - 1, None)
        dragged = _row(rotation[last], moment, path_of(steps)[last], 0.0, 0)["dissipated"]
        print(
            f"| {steps} | {coulomb:.6g} | {dragged:.6g} | {dragged / coulomb - 1:+.2%} |",
            flush=True,
        )


def ccx_row(ccx, folder, mesh, interface, joint, structure, options):
    """The cycle of CalculiX as a row."""
    moment, port = options.moment, joint.driven.name
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
    text = cycle_deck(mesh, interface, structure, loading, bolts * LOAD_SCALE, port, factors)
    used = run_deck(ccx, folder, "cycle", text)
    times, fields = read_displacements(folder / "cycle.dat")
    if len(times) != len(factors) + 1:
        raise ContactError(f"ccx finished {len(times)} of {len(factors) + 1} steps")
    load = structure.loads[port].reshape(-1, 3)
    watched = np.flatnonzero(load.any(axis=1))
    # displacements in mm: the load vector of a moment does its work on metres
    rotation = [sum(load[k] @ u[k + 1] for k in watched) / MM / LOAD_SCALE for u in fields]
    last = slice(-options.steps - 1, None)
    points = int(contact_points(folder / "cycle.cvg").max())
    row = _row(np.array(rotation[last]), moment, factors[last], used / len(times), points)
    return row | {"iterations a step": float(iterations(folder / "cycle.cvg").mean())}


def compare_cycles(ccx, folder, mesh, interface, joint, options):
    """Moment that opens the joint, and what all find of the cycle by name, CalculiX first."""
    structure = read_described_mesh(joint).structure
    if structure.dofs != mesh.points.size:
        raise ContactError("the deck has neither supports nor ties: take them out of the joint")
    opening, ours = our_rows(mesh, interface, joint, options)
    theirs = ccx_row(ccx, folder, mesh, interface, joint, structure, options)
    return opening, {"CalculiX": theirs} | ours


def _row(rotation, moment, factors, seconds, points):
    """Energy is that of the polygon through the load steps, half the range of the rotation beside it."""
    mean = 0.5 * (factors[1:] + factors[:-1])
    return {
        "contact points": points,
        "dissipated": float(moment * mean @ np.diff(rotation)),
        "rotation": float(np.ptp(rotation)) / 2,
        "seconds a step": seconds,
    }


def report(rows):
    """Print rows beside the first."""
    first = next(iter(rows.values()))
    print(
        "| | contact points | dissipated, J | to CalculiX | rotation, rad | to CalculiX | per step |\n"
        "|---|---|---|---|---|---|---|"
    )
    for name, row in rows.items():
        energy, turn = (row[k] / first[k] - 1 for k in ("dissipated", "rotation"))
        print(
            f"| {name} | {row['contact points']} | {row['dissipated']:.6g} | {energy:+.2%} | "
            f"{row['rotation']:.6e} | {turn:+.3%} | {row['seconds a step']:.3g} s |",
            flush=True,
        )


def compare(ccx, joint, options, folder):
    """Print frequencies and, unless these alone are asked for, the cycle; returns what was found."""
    mesh = read_mesh(Path(joint.mesh.file), length=1e-3)
    interface = joint.interface[0].first, joint.interface[0].second
    theirs, ours = compare_frequencies(ccx, folder, mesh, interface, joint)
    print("| mode | CalculiX, Hz | microslip, Hz | difference |\n|---|---|---|---|")
    for k, (a, b) in enumerate(zip(theirs, ours, strict=True), 1):
        print(f"| {k} | {a:.3f} | {b:.3f} | {b / a - 1:+.2%} |", flush=True)
    record = {"calculix_hz": theirs.tolist(), "microslip_hz": ours.tolist()}
    if options.frequencies:
        return record
    opening, rows = compare_cycles(ccx, folder, mesh, interface, joint, options)
    print(f"\nmoment {options.moment:.4g} N m; {opening:.4g} N m open the joint\n")
    report(rows)
    asked = {key: getattr(options, key) for key in ("moment", "steps", "stiffness")}
    return record | asked | {"opening": opening, "rows": rows}


def main(argv=None):
    """Entry point; returns the exit status."""
    options = arguments(argv)
    ccx = None if options.trend else find_ccx()
    if ccx is None and not options.trend:
        return 0
    try:
        joint = load_joint(options.file)
        if options.mesh:
            mesh = joint.mesh.model_copy(update={"file": str(options.mesh.resolve())})
            joint = joint.model_copy(update={"mesh": mesh})
        with threadpool_limits(1), tempfile.TemporaryDirectory() as temporary:
            if options.trend:
                trend(joint, options)
                return 0
            folder = options.out or Path(temporary)
            folder.mkdir(parents=True, exist_ok=True)
            record = compare(ccx, joint, options, folder)
    except MicroslipError as error:
        print(f"CalculiX comparison failed: {error}", file=sys.stderr)
        return 1
    if options.json:
        options.json.write_text(json.dumps(record, indent=1) + "\n")
    return 0


if __name__ == "__main__":
    sys.exit(main())

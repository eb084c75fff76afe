"""What CalculiX does to a pair that opens: two cubes of 1 mm, pressed, lifted, moved aside and put down.

    python benchmarks/calculix/lifted_pair.py

Coulomb's friction has no memory of a contact that was lost: a cube put down straight has no traction.
"""

from __future__ import annotations

import sys
import tempfile
from pathlib import Path

import numpy as np
from ccx_deck import MM
from ccx_results import find_ccx, run_deck

from microslip.errors import MicroslipError

PRESSED, LIFTED, ASIDE = -1e-7, 1e-7, 1e-7
"""How far the top is moved, m."""

PATHS = {
    "put down aside": [(0, PRESSED), (0, LIFTED), (ASIDE, LIFTED), (ASIDE, PRESSED)],
    "put down where it was": [(0, PRESSED), (0, LIFTED), (0, PRESSED)],
    "pulled aside": [(0, PRESSED), (ASIDE, PRESSED)],
}
"""Motions of the top along the plane of contact and away from it, m."""


def lifted_pair(ccx, folder, path, *, friction=0.3, stiffness=1e14):
    """What friction and pressure do to the upper cube at the end of each step, N.

    Parameters
    ----------
    ccx : str
    folder : pathlib.Path
    path : sequence of (float, float)
        Displacement of its top along the plane of contact and away from it, m.
    friction : float
    stiffness : float
        Penalty both ways, N/m³.

    Returns
    -------
    (s, 2) array
        Friction, and pressure, which is positive.
    """
    corners = [(0, 0), (1, 0), (1, 1), (0, 1)]
    nodes = [(x, y, z) for base in (-1, 0) for z in (base, base + 1) for x, y in corners]
    penalty = f"{stiffness / MM**3:.12g}"
    lines = ["*NODE, NSET=ALL"]
    lines += [f"{k}, {x}, {y}, {z}" for k, (x, y, z) in enumerate(nodes, 1)]
    lines += [
        "*ELEMENT, TYPE=C3D8I, ELSET=CUBES\n1, 1, 2, 3, 4, 5, 6, 7, 8",
        "2, 9, 10, 11, 12, 13, 14, 15, 16",
        "*NSET, NSET=TOP\n13, 14, 15, 16\n*NSET, NSET=BOTTOM\n1, 2, 3, 4",
        "*SURFACE, NAME=SLAVE, TYPE=ELEMENT\n1, S2\n*SURFACE, NAME=MASTER, TYPE=ELEMENT\n2, S1",
        "*MATERIAL, NAME=STEEL\n*ELASTIC\n2e5, 0.\n*SOLID SECTION, ELSET=CUBES, MATERIAL=STEEL",
        "*SURFACE INTERACTION, NAME=JOINT\n*SURFACE BEHAVIOR, PRESSURE-OVERCLOSURE=LINEAR",
        f"{penalty}\n*FRICTION\n{friction}, {penalty}",
        "*CONTACT PAIR, INTERACTION=JOINT, TYPE=SURFACE TO SURFACE\nSLAVE, MASTER",
        "*BOUNDARY\nBOTTOM, 1, 3",
    ]
    for along, away in path:
        lines += [
            "*STEP, NLGEOM=NO, INC=1000\n*STATIC\n1., 1., 1e-4, 1.\n*BOUNDARY",
            f"TOP, 1, 1, {along * MM:.12g}\nTOP, 2, 2, 0.\nTOP, 3, 3, {away * MM:.12g}",
            "*NODE PRINT, NSET=TOP, TOTALS=ONLY\nRF\n*END STEP",
        ]
    run_deck(ccx, folder, "lifted", "\n".join(lines) + "\n")
    rows = [line.split() for line in (folder / "lifted.dat").read_text().splitlines()]
    held = np.array([row for row in rows if len(row) == 3], dtype=float)
    return -held[:, [0, 2]]


def main():
    """Entry point; returns the exit status."""
    ccx = find_ccx()
    if ccx is None:
        return 0
    print("| the upper cube is | friction, N | pressure, N |\n|---|---|---|")
    try:
        with tempfile.TemporaryDirectory() as folder:
            for name, path in PATHS.items():
                friction, pressure = lifted_pair(ccx, Path(folder), path)[-1]
                print(f"| {name} | {friction:.4f} | {pressure:.4f} |")
    except MicroslipError as error:
        print(f"CalculiX comparison failed: {error}", file=sys.stderr)
        return 1
    return 0


if __name__ == "__main__":
    sys.exit(main())

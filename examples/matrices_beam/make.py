"""Matrices of two overlapping steel beams from CalculiX: ``python make.py`` writes every file beside it.

The deck is ``beam.inp``, two rows of quadratic plane-strain elements that share no node; ``ccx`` stores
``beam.sti``, ``beam.mas`` and ``beam.dof`` (``*FREQUENCY, SOLVER=MATRIXSTORAGE``). Millimetres, newtons and
tonnes; the section is 1 mm wide.
"""

from __future__ import annotations

import subprocess
from pathlib import Path

OVERLAP, LENGTH, THICKNESS = 30.0, 150.0, 8.0
CLAMP = 15.0
SIZES = [15.0] * 6 + [7.5] * 8
"""Lengths of the elements of a beam, from its far end to its tip."""


def beam(side: int, first: int) -> tuple[dict[int, tuple[float, float]], list[list[int]]]:
    """Nodes and elements of the lower (-1) or the upper (1) beam, numbered from `first`."""
    x = [side * (LENGTH - OVERLAP)]
    for size in SIZES:
        x += [x[-1] - side * size / 2, x[-1] - side * size]
    x.sort()
    levels = (-THICKNESS, -THICKNESS / 2, 0.0) if side < 0 else (0.0, THICKNESS / 2, THICKNESS)
    nodes, number = {}, {}
    for j, y in enumerate(levels):
        for i, place in enumerate(x):
            if i % 2 and j % 2:
                continue  # elements have no node in their middle
            number[i, j] = first + len(nodes)
            nodes[number[i, j]] = (place, y)
    corners = [(0, 0), (2, 0), (2, 2), (0, 2), (1, 0), (2, 1), (1, 2), (0, 1)]
    elements = [[number[2 * k + a, b] for a, b in corners] for k in range(len(SIZES))]
    return nodes, elements


LOWER, LOWER_ELEMENTS = beam(-1, 1)
UPPER, UPPER_ELEMENTS = beam(1, 101)
NODES = LOWER | UPPER


def on_face(nodes: dict[int, tuple[float, float]], y: float, reach: float) -> list[int]:
    """Nodes of a face within `reach` of the middle, from left to right."""
    found = [n for n, p in nodes.items() if abs(p[1] - y) < 1e-9 and abs(p[0]) <= reach + 1e-9]
    return sorted(found, key=lambda n: nodes[n][0])


PAIRS = list(zip(on_face(LOWER, 0.0, OVERLAP), on_face(UPPER, 0.0, OVERLAP), strict=True))


def shares(nodes: list[int]) -> list[float]:
    """Length that each node of a row of quadratic edges stands for (Simpson's rule)."""
    found = [0.0] * len(nodes)
    for k in range(0, len(nodes) - 2, 2):
        size = NODES[nodes[k + 2]][0] - NODES[nodes[k]][0]
        for place, share in ((k, 1 / 6), (k + 1, 4 / 6), (k + 2, 1 / 6)):
            found[place] += share * size
    return found


def deck(solver: str = ", SOLVER=MATRIXSTORAGE", ties: str = "", modes: int = 4) -> str:
    """The input of CalculiX; `ties` are equations between the two sides."""
    lines = ["*NODE"]
    lines += [f"{n}, {x:.10g}, {y:.10g}, 0" for n, (x, y) in NODES.items()]
    lines += ["*ELEMENT, TYPE=CPE8, ELSET=BEAMS"]
    elements = enumerate(LOWER_ELEMENTS + UPPER_ELEMENTS, start=1)
    lines += [", ".join(map(str, (k, *nodes))) for k, nodes in elements]
    lines += ["*MATERIAL, NAME=STEEL", "*ELASTIC", "210000, 0.3", "*DENSITY", "7.85e-9"]
    lines += ["*SOLID SECTION, ELSET=BEAMS, MATERIAL=STEEL", "1"]
    lines += ["*BOUNDARY"]
    lines += [f"{n}, 1, 2" for n, p in LOWER.items() if p[0] < OVERLAP - LENGTH + 1e-9]
    lines += [ties] if ties else []
    lines += ["*STEP", f"*FREQUENCY{solver}", str(modes), "*END STEP"]
    return "\n".join(lines) + "\n"


def tied(pairs: list[tuple[int, int]], directions: str) -> str:
    """Equations that hold the two sides of pairs together along directions, ``"12"`` or ``"2"``."""
    return "\n".join(
        f"*EQUATION\n2\n{upper}, {d}, 1, {lower}, {d}, -1"
        for lower, upper in pairs
        for d in directions
    )


def write(folder: Path) -> None:
    """Write the tables, and have CalculiX write the matrices."""
    (folder / "beam.inp").write_text(deck())
    subprocess.run(["ccx", "beam"], cwd=folder, check=True, stdout=subprocess.DEVNULL)
    for ending in ("12d", "cvg", "dat", "frd", "sta"):
        (folder / f"beam.{ending}").unlink(missing_ok=True)
    table = ["node,x,y", *(f"{n},{x:.10g},{y:.10g}" for n, (x, y) in NODES.items())]
    (folder / "nodes.csv").write_text("\n".join(table) + "\n")
    areas = shares([lower for lower, _ in PAIRS])
    table = ["position,area,first,second,nx,ny"]
    for (lower, upper), area in zip(PAIRS, areas, strict=True):
        table.append(f"{LOWER[lower][0]:.10g},{area:.10g},{lower},{upper},0,1")
    (folder / "pairs.csv").write_text("\n".join(table) + "\n")
    table = ["node,direction,value"]
    for nodes, y, sign in ((LOWER, -THICKNESS, 1), (UPPER, THICKNESS, -1)):
        pressed = on_face(nodes, y, CLAMP)
        for node, share in zip(pressed, shares(pressed), strict=True):
            table.append(f"{node},y,{sign * share / (2 * CLAMP):.10g}")
    (folder / "clamp.csv").write_text("\n".join(table) + "\n")


if __name__ == "__main__":
    write(Path(__file__).resolve().parent)

"""Mesh of two steel plates under one bolt: ``python make.py`` writes ``plates.inp`` beside it.

Plates of 95 mm by 20 mm by 5 mm overlap by 30 mm; head and nut press on 10 mm by 8 mm. Hexahedra with
incompatible modes, whose nodes do not match on the interface. Millimetres, newtons and tonnes.
"""

from __future__ import annotations

from collections.abc import Callable
from itertools import product
from pathlib import Path

Point = tuple[float, float, float]
Pieces = list[tuple[float, float, int]]

LOWER: list[Pieces] = [
    [(-80, -15, 5), (-15, -5, 2), (-5, 5, 3), (5, 15, 2)],
    [(-10, -4, 1), (-4, 4, 2), (4, 10, 1)],
    [(-5, 0, 2)],
]
UPPER: list[Pieces] = [
    [(-15, -5, 2), (-5, 5, 4), (5, 15, 2), (15, 80, 5)],
    [(-10, -4, 1), (-4, 4, 3), (4, 10, 1)],
    [(0, 5, 2)],
]
"""Of each plate along x, y and z: from, to, elements."""

CORNERS = [
    (0, 0, 0),
    (1, 0, 0),
    (1, 1, 0),
    (0, 1, 0),
    (0, 0, 1),
    (1, 0, 1),
    (1, 1, 1),
    (0, 1, 1),
]
FACES = {"S1": (0, 1, 2, 3), "S2": (4, 5, 6, 7), "S4": (1, 2, 6, 5), "S6": (0, 3, 7, 4)}
"""Faces below, above, to the right and to the left, by their corners."""


def coordinates(pieces: Pieces) -> list[float]:
    """Corners of the elements along one axis."""
    found = [float(pieces[0][0])]
    for start, stop, count in pieces:
        found += [start + (stop - start) * (k + 1) / count for k in range(count)]
    return found


def plate(pieces: list[Pieces], first: int) -> tuple[dict[int, Point], dict[int, list[int]]]:
    """Nodes and elements, both numbered from `first`."""
    axes = [coordinates(each) for each in pieces]
    number, nodes = {}, {}
    for place in product(*(range(len(axis)) for axis in axes)):
        number[place] = first + len(nodes)
        i, j, k = place
        nodes[number[place]] = (axes[0][i], axes[1][j], axes[2][k])
    elements: dict[int, list[int]] = {}
    for i, j, k in product(*(range(len(axis) - 1) for axis in axes)):
        elements[first + len(elements)] = [number[i + a, j + b, k + c] for a, b, c in CORNERS]
    return nodes, elements


def surface(
    nodes: dict[int, Point],
    elements: dict[int, list[int]],
    face: str,
    inside: Callable[[Point], bool],
) -> list[int]:
    """Elements all corners of whose face lie inside."""
    return [
        element
        for element, own in elements.items()
        if all(inside(nodes[own[k]]) for k in FACES[face])
    ]


def deck() -> str:
    """The whole file."""
    (low, low_elements), (up, up_elements) = plate(LOWER, 1), plate(UPPER, 1001)
    lines = ["*HEADING", "Two steel plates that overlap by 30 mm; N, mm, tonnes", "*NODE"]
    lines += [f"{n}, {x:.6g}, {y:.6g}, {z:.6g}" for n, (x, y, z) in (low | up).items()]
    for name, elements in (("LOWER", low_elements), ("UPPER", up_elements)):
        lines.append(f"*ELEMENT, TYPE=C3D8I, ELSET={name}")
        lines += [f"{e}, " + ", ".join(map(str, own)) for e, own in elements.items()]
    washer: Callable[[Point], bool] = lambda p: abs(p[0]) <= 5 and abs(p[1]) <= 4  # noqa: E731
    surfaces = (
        ("LOWER_CONTACT", "S2", low, low_elements, lambda p: p[2] == 0 and abs(p[0]) <= 15),
        ("UPPER_CONTACT", "S1", up, up_elements, lambda p: p[2] == 0 and abs(p[0]) <= 15),
        ("NUT", "S1", low, low_elements, lambda p: p[2] == -5 and washer(p)),
        ("HEAD", "S2", up, up_elements, lambda p: p[2] == 5 and washer(p)),
        ("WALL", "S6", low, low_elements, lambda p: p[0] == -80),
        ("TIP", "S4", up, up_elements, lambda p: p[0] == 80),
    )
    for name, face, nodes, elements, inside in surfaces:
        lines.append(f"*SURFACE, NAME={name}, TYPE=ELEMENT")
        lines += [f"{element}, {face}" for element in surface(nodes, elements, face, inside)]
    lines += ["*MATERIAL, NAME=STEEL", "*ELASTIC", "210000., 0.3", "*DENSITY", "7.85E-9"]
    lines += [f"*SOLID SECTION, ELSET={name}, MATERIAL=STEEL" for name in ("LOWER", "UPPER")]
    return "\n".join(lines) + "\n"


if __name__ == "__main__":
    Path(__file__).with_name("plates.inp").write_text(deck())

"""Bodies meshed by gmsh, and the deck that they are written to: Abaqus and CalculiX, in mm, N and tonnes.

The gmsh package is an extra: ``pip install 'microslip[gmsh]'``. Its library opens no window and still wants
those of the screen: on Debian ``apt install libglu1-mesa libxcursor1 libxft2 libxinerama1``.
"""

from __future__ import annotations

import sys
from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Any

import numpy as np

STEEL = (210000.0, 0.3, 7.85e-9)
"""Young's modulus in MPa, Poisson's ratio, density in tonnes per mm³."""

ORDER = {
    "C3D10": [0, 1, 2, 3, 4, 5, 6, 7, 9, 8],
    "C3D20": [0, 1, 2, 3, 4, 5, 6, 7, 8, 11, 13, 9, 16, 18, 19, 17, 10, 12, 14, 15],
}
"""Place in gmsh of each node of an element."""

FACES = {
    "C3D10": [(0, 1, 2), (0, 1, 3), (1, 2, 3), (0, 2, 3)],
    "C3D20": [
        (0, 1, 2, 3),
        (4, 5, 6, 7),
        (0, 1, 4, 5),
        (1, 2, 5, 6),
        (2, 3, 6, 7),
        (0, 3, 4, 7),
    ],
}
"""Corners of the faces S1, S2, ..."""

RING = ((0, 1), (1, 2), (2, 3), (3, 0))
SIDES = {
    "C3D10": [(0, 1), (1, 2), (2, 0), (0, 3), (1, 3), (2, 3)],
    "C3D20": [*RING, *((a + 4, b + 4) for a, b in RING), *((k, k + 4) for k in range(4))],
}
"""Corners beside each of the other nodes."""

KINDS = {11: "C3D10", 17: "C3D20"}
"""Types of elements by their numbers in gmsh."""


@dataclass(frozen=True)
class Body:
    """One meshed body.

    Attributes
    ----------
    name : str
        Of its elements.
    kind : str
        ``C3D10`` or ``C3D20``.
    points : (n, 3) array
        mm.
    cells : (e, k) int array
        Points of each element, in the order of the deck.
    surfaces : mapping of str to (f, 2) int array
        Element and number of the face, from 1.
    node_sets : mapping of str to int array
        Points.
    """

    name: str
    kind: str
    points: np.ndarray
    cells: np.ndarray
    surfaces: Mapping[str, np.ndarray]
    node_sets: Mapping[str, np.ndarray] = field(default_factory=dict)

    def turned(self, name: str, names: Mapping[str, str], about: str = "y") -> Body:
        """The body after half a turn about an axis, its surfaces renamed."""
        signs = np.where(np.arange(3) == "xyz".index(about), 1.0, -1.0)
        surfaces = {names[old]: faces for old, faces in self.surfaces.items()}
        sets = {names[old]: points for old, points in self.node_sets.items()}
        points = self.points * signs
        return replace(self, name=name, points=points, surfaces=surfaces, node_sets=sets)

    def with_nodes(self, **sets: np.ndarray) -> Body:
        """The body with more node sets, each of the points where a mask is true."""
        found = {name: np.flatnonzero(mask) for name, mask in sets.items()}
        return replace(self, node_sets={**self.node_sets, **found})


def loaded() -> Any:
    """The gmsh package; the program ends with a word where it cannot be loaded."""
    try:
        import gmsh
    except (ImportError, OSError) as error:
        print(
            f"gmsh cannot be loaded ({error}): pip install 'microslip[gmsh]'; where a library is missing, on "
            "Debian: apt install libglu1-mesa libxcursor1 libxft2 libxinerama1",
            file=sys.stderr,
        )
        raise SystemExit(1) from None
    return gmsh


@contextmanager
def session(name: str) -> Iterator[Any]:
    """A model of gmsh with quadratic elements, silent."""
    gmsh = loaded()
    gmsh.initialize(interruptible=False)
    try:
        gmsh.option.setNumber("General.Terminal", 0)
        gmsh.option.setNumber("Mesh.ElementOrder", 2)
        gmsh.option.setNumber("Mesh.SecondOrderIncomplete", 1)
        # middles on the sides: holes become polygons, and no element is curved
        gmsh.option.setNumber("Mesh.SecondOrderLinear", 1)
        gmsh.option.setNumber("Mesh.Optimize", 1)
        gmsh.option.setNumber("Mesh.MeshSizeExtendFromBoundary", 0)
        gmsh.option.setNumber("Mesh.MeshSizeFromPoints", 0)
        gmsh.model.add(name)
        yield gmsh
    finally:
        gmsh.finalize()


def sized(gmsh: Any, fine: float, coarse: float, boxes: Sequence[Sequence[float]]) -> None:
    """Elements of one size inside boxes (x0, x1, y0, y1, z0, z1), growing to another outside."""
    found = []
    for box in boxes:
        number = gmsh.model.mesh.field.add("Box")
        for key, value in zip(("XMin", "XMax", "YMin", "YMax", "ZMin", "ZMax"), box, strict=True):
            gmsh.model.mesh.field.setNumber(number, key, value)
        gmsh.model.mesh.field.setNumber(number, "VIn", fine)
        gmsh.model.mesh.field.setNumber(number, "VOut", coarse)
        gmsh.model.mesh.field.setNumber(number, "Thickness", 3 * coarse)
        found.append(number)
    least = gmsh.model.mesh.field.add("Min")
    gmsh.model.mesh.field.setNumbers(least, "FieldsList", found)
    gmsh.model.mesh.field.setAsBackgroundMesh(least)


Place = Callable[[np.ndarray, np.ndarray], bool]
"""Whether a face is meant, by the lower and the upper corner of its bounding box."""


def within(**limits: tuple[float, float]) -> Place:
    """Faces whose bounding boxes lie between limits: ``within(x=(0, 1), z=(2, 2))``."""

    def inside(low: np.ndarray, high: np.ndarray) -> bool:
        return all(
            low["xyz".index(axis)] >= a - 1e-4 and high["xyz".index(axis)] <= b + 1e-4
            for axis, (a, b) in limits.items()
        )

    return inside


def body_of(gmsh: Any, name: str, volumes: Sequence[int], places: Mapping[str, Place]) -> Body:
    """A meshed body of one or more volumes, with the faces at some places as surfaces.

    Raises
    ------
    ValueError
        Where a place has no face.
    """
    cells = []
    for volume in volumes:
        (number,), _, nodes = gmsh.model.mesh.getElements(3, volume)
        kind = KINDS[number]
        order = ORDER[kind]
        cells.append(np.asarray(nodes[0], dtype=np.int64).reshape(-1, len(order))[:, order])
    tags = np.vstack(cells)
    used, rows = np.unique(tags, return_inverse=True)
    rows = rows.reshape(tags.shape)
    number, coordinates, _ = gmsh.model.mesh.getNodes()
    found = np.argsort(number)
    at = found[np.searchsorted(number, used, sorter=found)]
    points = _straight(np.asarray(coordinates).reshape(-1, 3)[at], rows, kind)
    outside = {tag for _, tag in gmsh.model.getBoundary([(3, v) for v in volumes], oriented=False)}
    boxes = {tag: np.array(gmsh.model.getBoundingBox(2, tag)).reshape(2, 3) for tag in outside}
    surfaces = {}
    for label, place in places.items():
        faces = [tag for tag in sorted(outside) if place(*boxes[tag])]
        if not faces:
            raise ValueError(f"{name}: there is no face at {label}")
        corners = [_corners(gmsh, tag) for tag in faces]
        surfaces[label] = _faces(rows, kind, np.searchsorted(used, np.vstack(corners)))
    return Body(name, kind, points, rows, surfaces)


def _straight(points: np.ndarray, cells: np.ndarray, kind: str) -> np.ndarray:
    """Points with corners rounded, and middles of sides that are so in every digit that is written."""
    out = np.round(points, 5)
    for k, (a, b) in enumerate(SIDES[kind], max(map(max, SIDES[kind])) + 1):
        out[cells[:, k]] = 0.5 * (out[cells[:, a]] + out[cells[:, b]])
    return out


def _corners(gmsh: Any, surface: int) -> np.ndarray:
    numbers, _, nodes = gmsh.model.mesh.getElements(2, surface)
    size, corners = {9: (6, 3), 16: (8, 4)}[numbers[0]]
    return np.asarray(nodes[0], dtype=np.int64).reshape(-1, size)[:, :corners]


def _faces(cells: np.ndarray, kind: str, wanted: np.ndarray) -> np.ndarray:
    """Elements and faces with given corners; three of them tell a face."""
    base = int(cells.max()) + 1

    def key(corners: np.ndarray) -> np.ndarray:
        least = np.sort(corners, axis=1)[:, :3]
        return (least[:, 0] * base + least[:, 1]) * base + least[:, 2]

    keys = np.concatenate([key(cells[:, list(face)]) for face in FACES[kind]])
    order = np.argsort(keys, kind="stable")
    at = order[np.searchsorted(keys, key(wanted), sorter=order)]
    return np.column_stack([at % len(cells), 1 + at // len(cells)])


def write_deck(path: Path, heading: str, bodies: Sequence[Body], material: Any = STEEL) -> None:
    """Write bodies of one material; nodes and elements are numbered from 1 through all of them."""
    nodes, elements, surfaces, names = [], [], [], []
    first_node = first_element = 1
    for body in bodies:
        nodes += [
            f"{first_node + k}, " + ", ".join(f"{c:.10g}" for c in np.round(point, 6) + 0.0)
            for k, point in enumerate(body.points)
        ]
        elements.append(f"*ELEMENT, TYPE={body.kind}, ELSET={body.name}")
        elements += [
            f"{first_element + k}, " + _wrapped(row)
            for k, row in enumerate((body.cells + first_node).tolist())
        ]
        for name, faces in body.surfaces.items():
            surfaces.append(f"*SURFACE, NAME={name}, TYPE=ELEMENT")
            surfaces += [f"{first_element + e}, S{f}" for e, f in faces.tolist()]
        for name, points in body.node_sets.items():
            surfaces.append(f"*NSET, NSET={name}")
            surfaces += [str(first_node + k) for k in points.tolist()]
        names.append(body.name)
        first_node += len(body.points)
        first_element += len(body.cells)
    youngs_modulus, poissons_ratio, density = material
    lines = ["*HEADING", heading, "*NODE", *nodes, *elements, *surfaces]
    lines += [
        "*MATERIAL, NAME=METAL",
        "*ELASTIC",
        f"{youngs_modulus:g}, {poissons_ratio:g}",
        "*DENSITY",
        f"{density:g}",
    ]
    lines += [f"*SOLID SECTION, ELSET={name}, MATERIAL=METAL" for name in names]
    path.write_text("\n".join(lines) + "\n")


def _wrapped(numbers: Sequence[int]) -> str:
    """Numbers of an element, 15 of them on its first line."""
    parts = [numbers[:15], numbers[15:]]
    return ",\n".join(", ".join(map(str, part)) for part in parts if part)

"""Bodies cut from boxes, meshed without a mesher, and the files they are written to.

A body is a box with lines along three axes, whose cells are bricks, halved into wedges or divided into six
tetrahedra along their diagonal, linear or with nodes on the middles of sides. Cells may be left out: holes,
and the space around a shank. Places of its outside are found by where they are in the box, whatever is done
to its nodes afterwards."""

from __future__ import annotations

from collections import Counter
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from itertools import pairwise, permutations

import numpy as np

BRICK = np.array(
    [(0, 0, 0), (1, 0, 0), (1, 1, 0), (0, 1, 0), (0, 0, 1), (1, 0, 1), (1, 1, 1), (0, 1, 1)]
)
WEDGES = ((0, 1, 2, 4, 5, 6), (0, 2, 3, 4, 6, 7))
"""Corners of a brick that its two halves have."""

FACES = {
    "hex": ((0, 1, 2, 3), (4, 7, 6, 5), (0, 4, 5, 1), (1, 5, 6, 2), (2, 6, 7, 3), (3, 7, 4, 0)),
    "wedge": ((0, 1, 2), (3, 5, 4), (0, 3, 4, 1), (1, 4, 5, 2), (2, 5, 3, 0)),
    "tet": ((0, 1, 2), (0, 3, 1), (1, 3, 2), (2, 3, 0)),
}
"""Faces S1, S2, ... of an element by their corners, as Abaqus and CalculiX number them."""

SIDES = {
    "hex": tuple(
        zip((0, 1, 2, 3, 4, 5, 6, 7, 0, 1, 2, 3), (1, 2, 3, 0, 5, 6, 7, 4, 4, 5, 6, 7), strict=True)
    ),
    "wedge": tuple(zip((0, 1, 2, 3, 4, 5, 0, 1, 2), (1, 2, 0, 4, 5, 3, 3, 4, 5), strict=True)),
    "tet": ((0, 1), (1, 2), (2, 0), (0, 3), (1, 3), (2, 3)),
}
"""Sides in the order in which the nodes on their middles follow."""

OF_GMSH = {
    "hex": ((0, 1), (0, 3), (0, 4), (1, 2), (1, 5), (2, 3), (2, 6), (3, 7), (4, 5), (4, 7), (5, 6), (6, 7)),
    "wedge": ((0, 1), (0, 2), (0, 3), (1, 2), (1, 4), (2, 5), (3, 4), (3, 5), (4, 5)),
    "tet": ((0, 1), (1, 2), (2, 0), (0, 3), (2, 3), (1, 3)),
}  # fmt: skip
"""The same in the order of Gmsh."""

ABAQUS = {
    ("hex", False): "C3D8I",
    ("hex", True): "C3D20",
    ("wedge", False): "C3D6",
    ("wedge", True): "C3D15",
    ("tet", True): "C3D10",
}
GMSH = {
    ("hex", False): 5,
    ("hex", True): 17,
    ("wedge", False): 6,
    ("wedge", True): 18,
    ("tet", True): 11,
}
FACE_OF_GMSH = {(3, False): 2, (4, False): 3, (3, True): 9, (4, True): 16}

Box = tuple[tuple[float, float], tuple[float, float], tuple[float, float]]
"""From and to along x, y and z, where the body was a box; a plane where both are the same."""


@dataclass(frozen=True)
class Body:
    """A meshed body.

    Attributes
    ----------
    name : str
    shape : str
        ``hex``, ``wedge`` or ``tet``.
    quadratic : bool
        Sides have nodes on their middles, which the files get.
    place : (n, 3) array
        Of the corners, where the body was a box.
    points : (n, 3) array
        Of the corners, in its length unit.
    cells : (c, k) int array
    surfaces : mapping of str to list of (int, int)
        Cell and number of its face.
    """

    name: str
    shape: str
    quadratic: bool
    place: np.ndarray
    points: np.ndarray
    cells: np.ndarray
    surfaces: Mapping[str, list[tuple[int, int]]]

    def moved(self, how: Callable[[np.ndarray], np.ndarray]) -> Body:
        """The same with its corners elsewhere."""
        return replace(self, points=how(self.points))

    @property
    def sides(self) -> list[tuple[int, int]]:
        """Sides that have nodes on their middles, by their ends; these nodes come after the corners."""
        if not self.quadratic:
            return []
        found = {_side(cell, side) for cell in self.cells for side in SIDES[self.shape]}
        return sorted(found)

    def connectivity(self, order: Sequence[tuple[int, int]]) -> list[list[int]]:
        """Nodes of every cell from 0, those on the middles of sides in the given order."""
        number = {side: len(self.points) + k for k, side in enumerate(self.sides)}
        middles = order if self.quadratic else ()
        return [
            [int(n) for n in cell] + [number[_side(cell, side)] for side in middles]
            for cell in self.cells
        ]

    def nodes(self) -> np.ndarray:
        """Corners, then the middles of sides."""
        ends = np.array(self.sides, dtype=int).reshape(-1, 2)
        return np.vstack([self.points, self.points[ends].mean(axis=1)])

    def face(self, cell: int, face: int) -> list[int]:
        """Nodes of a face from 0, corners first."""
        number = {side: len(self.points) + k for k, side in enumerate(self.sides)}
        corners = [int(self.cells[cell][k]) for k in FACES[self.shape][face]]
        if not self.quadratic:
            return corners
        around = zip(corners, [*corners[1:], corners[0]], strict=True)
        return corners + [number[min(a, b), max(a, b)] for a, b in around]


def _side(cell: np.ndarray, side: tuple[int, int]) -> tuple[int, int]:
    a, b = int(cell[side[0]]), int(cell[side[1]])
    return min(a, b), max(a, b)


def lines(marks: Sequence[float], size: float) -> np.ndarray:
    """Coordinates with lines at the marks and pieces of about a size at most between them."""
    found = [float(marks[0])]
    for low, high in pairwise(marks):
        count = max(1, int(np.ceil((high - low) / size - 1e-9)))
        found += [low + (high - low) * (k + 1) / count for k in range(count)]
    return np.array(found)


def box(
    name: str,
    shape: str,
    quadratic: bool,
    axes: Sequence[np.ndarray],
    places: Mapping[str, Box],
    without: Callable[[np.ndarray], bool] = lambda centre: False,
    cuts: Mapping[str, Box] | None = None,
) -> Body:
    """A body.

    Parameters
    ----------
    axes : three arrays
        Lines along x, y and z.
    places : mapping of str to Box
        Surfaces: outside faces all of whose corners lie inside.
    without : callable
        Of the middle of a brick: whether it is left out.
    cuts : mapping of str to Box, optional
        Surfaces inside: faces of the cells below.
    """
    count = [len(axis) for axis in axes]
    grid = np.stack(np.meshgrid(*axes, indexing="ij"), axis=-1).reshape(-1, 3)

    def node(place: np.ndarray) -> int:
        return int((place[0] * count[1] + place[1]) * count[2] + place[2])

    bricks = []
    for place in np.ndindex(*(n - 1 for n in count)):
        corners = [node(np.array(place) + corner) for corner in BRICK]
        if not without(grid[corners].mean(axis=0)):
            bricks.append(corners)
    cells = np.array([cell for brick in bricks for cell in _divided(brick, shape)])
    used = np.unique(cells)
    number = np.full(len(grid), -1)
    number[used] = np.arange(len(used))
    cells, place = number[cells], grid[used]
    shared = Counter(_key(cell, face) for cell in cells for face in FACES[shape])
    surfaces: dict[str, list[tuple[int, int]]] = {key: [] for key in (*places, *(cuts or {}))}
    for c, cell in enumerate(cells):
        for f, face in enumerate(FACES[shape]):
            corners = place[cell[list(face)]]
            if shared[_key(cell, face)] == 1:
                for key, where in places.items():
                    if _inside(corners, where):
                        surfaces[key].append((c, f))
            for key, where in (cuts or {}).items():
                if _inside(corners, where) and place[cell].mean(axis=0)[2] < where[2][0]:
                    surfaces[key].append((c, f))
    return Body(name, shape, quadratic, place, place.copy(), cells, surfaces)


def _divided(brick: list[int], shape: str) -> list[list[int]]:
    """Cells of a brick."""
    if shape == "hex":
        return [brick]
    if shape == "wedge":
        return [[brick[k] for k in half] for half in WEDGES]
    found = []
    for order in permutations(range(3)):
        steps = np.zeros((4, 3), dtype=int)
        for k, axis in enumerate(order):
            steps[k + 1 :, axis] += 1
        own = [brick[int(np.flatnonzero((step == BRICK).all(axis=1))[0])] for step in steps]
        even = order in ((0, 1, 2), (1, 2, 0), (2, 0, 1))
        found.append(own if even else [own[0], own[2], own[1], own[3]])
    return found


def _key(cell: np.ndarray, face: Sequence[int]) -> tuple[int, ...]:
    return tuple(sorted(int(cell[k]) for k in face))


def _inside(points: np.ndarray, where: Box) -> bool:
    low, high = np.array(where).T
    return bool(((points >= low - 1e-9) & (points <= high + 1e-9)).all())


def deck(bodies: Sequence[Body], node_sets: Mapping[str, tuple[str, Box]]) -> str:
    """An Abaqus and CalculiX deck; node sets are the corners of a body inside a box."""
    nodes, elements, rest = ["*NODE"], [], []
    first = element = 0
    for body in bodies:
        number = [f"{first + k + 1}" for k in range(len(body.nodes()))]
        nodes += [
            f"{n}, " + ", ".join(f"{x:.17g}" for x in point)
            for n, point in zip(number, body.nodes(), strict=True)
        ]
        kind = ABAQUS[body.shape, body.quadratic]
        elements.append(f"*ELEMENT, TYPE={kind}, ELSET={body.name}")
        for k, own in enumerate(body.connectivity(SIDES[body.shape])):
            words = [f"{element + k + 1}", *(number[n] for n in own)]
            rows = [words[i : i + 12] for i in range(0, len(words), 12)]
            elements += [", ".join(row) + ("," if row is not rows[-1] else "") for row in rows]
        for name, faces in body.surfaces.items():
            rest.append(f"*SURFACE, NAME={name}, TYPE=ELEMENT")
            rest += [f"{element + c + 1}, S{f + 1}" for c, f in faces]
        for name, (owner, where) in node_sets.items():
            if owner == body.name:
                rest.append(f"*NSET, NSET={name}")
                rest += [n for n, p in zip(number, body.place, strict=False) if _inside(p, where)]
        first += len(number)
        element += len(body.cells)
    return "\n".join([*nodes, *elements, *rest]) + "\n"


def gmsh_file(bodies: Sequence[Body], node_sets: Mapping[str, tuple[str, Box]]) -> str:
    """The same as a file of Gmsh, format 2.2."""
    names: dict[str, tuple[int, int]] = {}
    nodes, elements, first = [], [], 0

    def group(name: str, dimension: int) -> int:
        return names.setdefault(name, (dimension, len(names) + 1))[1]

    def add(kind: int, tag: int, own: Sequence[int]) -> None:
        words = (len(elements) + 1, kind, 2, tag, tag, *(first + n + 1 for n in own))
        elements.append(" ".join(map(str, words)))

    for body in bodies:
        found = body.nodes()
        nodes += [" ".join(f"{x:.17g}" for x in point) for point in found]
        for own in body.connectivity(OF_GMSH[body.shape]):
            add(GMSH[body.shape, body.quadratic], group(body.name, 3), own)
        for name, faces in body.surfaces.items():
            for cell, face in faces:
                own = body.face(cell, face)
                corners = len(FACES[body.shape][face])
                add(FACE_OF_GMSH[corners, body.quadratic], group(name, 2), own)
        for name, (owner, where) in node_sets.items():
            if owner == body.name:
                for n in np.flatnonzero([_inside(p, where) for p in body.place]):
                    add(15, group(name, 0), [int(n)])
        first += len(found)
    return "\n".join(
        [
            *("$MeshFormat", "2.2 0 8", "$EndMeshFormat", "$PhysicalNames", f"{len(names)}"),
            *(f'{dimension} {tag} "{name}"' for name, (dimension, tag) in names.items()),
            *("$EndPhysicalNames", "$Nodes", f"{len(nodes)}"),
            *(f"{k} {point}" for k, point in enumerate(nodes, 1)),
            *("$EndNodes", "$Elements", f"{len(elements)}", *elements, "$EndElements"),
        ]
    ) + "\n"  # fmt: skip

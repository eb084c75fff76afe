"""Degrees of freedom by node and direction: what a row of a foreign matrix is."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass, field

import numpy as np

from microslip.brief import Brief
from microslip.errors import InputError
from microslip.model.readers.files import Table
from microslip.model.readers.found import DIRECTIONS, NAMES, Label
from microslip.typing import Array, Indices

OUT_OF_PLANE = (DIRECTIONS["z"], DIRECTIONS["rx"], DIRECTIONS["ry"])


@dataclass(frozen=True, repr=False)
class Numbering(Brief):
    """Node and direction of every degree of freedom.

    Attributes
    ----------
    labels : tuple of (int, int)
        Node, and the number of the direction: 1 to 3 along x, y, z, 4 to 6 about them.
    x, y, z : (n,) arrays, optional
        Coordinates of the node of each, in the unit of the matrices.
    """

    labels: tuple[Label, ...]
    x: Array | None = None
    y: Array | None = None
    z: Array | None = None
    places: dict[Label, int] = field(init=False, compare=False)

    def __post_init__(self) -> None:
        object.__setattr__(self, "places", {label: k for k, label in enumerate(self.labels)})

    @property
    def spatial(self) -> bool:
        """Whether nodes move along z."""
        return bool((self.direction == DIRECTIONS["z"]).any())

    def coordinates(self, dimension: int) -> Array | None:
        """(n, d) coordinates of the node of each degree of freedom; None where one is not known."""
        known = [c for c in (self.x, self.y, self.z)[:dimension] if c is not None]
        return np.column_stack(known) if len(known) == dimension else None

    @property
    def direction(self) -> Indices:
        """(n,) numbers of the directions."""
        return np.array([direction for _, direction in self.labels])

    def row(self, node: int, direction: str, where: str) -> int:
        """Degree of freedom of a node.

        Raises
        ------
        InputError
            Where the node or its direction is not among them: says what may be the reason.
        """
        found = self.places.get((node, DIRECTIONS[direction]))
        if found is not None:
            return found
        nodes = sorted({n for n, _ in self.labels})
        there = [NAMES.get(d, str(d)) for n, d in self.labels if n == node]
        if there:
            raise InputError(
                f"{where}: node {node} has no degree of freedom {direction}, only "
                f"{', '.join(there)}: is it held by a support? What is held is not in the matrices, "
                "and nothing can act or be measured there"
            )
        shifted = node + 1 if node + 1 == nodes[0] else node - 1 if node - 1 == nodes[-1] else None
        hint = (
            ": is it held by supports in all directions, or is one numbering from 0 and the other from 1?"
            if shifted is not None
            else ": is it held by supports in all directions, or of another numbering?"
        )
        raise InputError(
            f"{where}: there is no node {node} among the degrees of freedom, whose nodes are "
            f"{nodes[0]} to {nodes[-1]}{hint}"
        )

    def held(self, nodes: Iterable[int], direction: str) -> bool:
        """Whether all nodes are known, and none of them moves in a direction."""
        return all(
            (node, DIRECTIONS[direction]) not in self.places
            and any((node, other) in self.places for other in NAMES)
            for node in nodes
        )

    def translation(self, direction: str) -> Array:
        """Displacement of every degree of freedom under a unit translation."""
        return (self.direction == DIRECTIONS[direction]).astype(float)

    def rotations(self) -> list[Array]:
        """Displacements under unit turns about the origin: about z, in space about x and y first; without
        those of which coordinates are not known."""
        axes = ("x", "y", "z")
        of_node = dict(zip(axes, (self.x, self.y, self.z), strict=True))
        found = []
        for about in axes if self.spatial else axes[2:]:
            along, across = (axes[(axes.index(about) + k) % 3] for k in (1, 2))
            first, second = of_node[along], of_node[across]
            if first is None or second is None:
                continue
            own = [self.direction == DIRECTIONS[name] for name in (along, across, f"r{about}")]
            found.append(np.select(own, [-second, first, 1.0], 0.0))
        return found


def numbering_of_table(table: Table, source: str, dofs: int) -> Numbering:
    """Degrees of freedom from a table with columns node and direction, and x, y and z where known.

    Raises
    ------
    InputError
        Where a column is missing, a row is there twice, or there are not as many as in the matrices.
    """
    for column in ("node", "direction"):
        if column not in table:
            there = ", ".join(table)
            raise InputError(f"{source}: the column {column} is missing; there is {there}")
    nodes, directions = table["node"], table["direction"]
    if (nodes != nodes.round()).any() or not np.isin(directions, (0, *NAMES)).all():
        raise InputError(
            f"{source}: nodes are whole numbers, and directions x, y, z, rx, ry, rz or 1 to 6"
        )
    labels = tuple(zip(nodes.astype(int).tolist(), directions.astype(int).tolist(), strict=True))
    check_count(len(labels), source, dofs)
    if len(set(labels)) < len(labels):
        raise InputError(f"{source}: a node and direction is there twice")
    return Numbering(labels, table.get("x"), table.get("y"), table.get("z"))


HIDDEN = (
    ", as more are not: CalculiX writes the incompatible modes of C3D8I as nodes of their own, and such "
    "matrices cannot be used; take C3D20, C3D20R or C3D10 there"
)
"""What nodes may be that no table has."""


def with_coordinates(numbering: Numbering, table: Table, source: str) -> Numbering:
    """The numbering with coordinates from a table of nodes, with columns node, x and y, and z in space.

    Raises
    ------
    InputError
        Where a column or a node is missing.
    """
    for column in ("node", "x", "y"):
        if column not in table:
            there = ", ".join(table)
            raise InputError(f"{source}: the column {column} is missing; there is {there}")
    place = {int(node): k for k, node in enumerate(table["node"])}
    missing = [node for node, _ in numbering.labels if node not in place]
    if missing:
        raise InputError(
            f"{source}: node {missing[0]} has degrees of freedom and is not among the "
            f"{len(place)} nodes of the table{HIDDEN if len(set(missing)) > 1 else ''}"
        )
    rows = [place[node] for node, _ in numbering.labels]
    z = table.get("z")
    return Numbering(
        numbering.labels, table["x"][rows], table["y"][rows], None if z is None else z[rows]
    )


def check_count(rows: int, source: str, dofs: int) -> None:
    """Raise `InputError` where a list of degrees of freedom is not as long as the matrices are large."""
    if rows == dofs:
        return
    why = (
        "degrees of freedom that supports hold are not in the matrices and must not be in the list"
        if rows > dofs
        else "the list must name every row of the matrices, in their order"
    )
    raise InputError(
        f"{source}: {rows} degrees of freedom, and the stiffness is {dofs} by {dofs}: {why}"
    )

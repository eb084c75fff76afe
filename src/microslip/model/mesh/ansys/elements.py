"""Element types of ANSYS that are solids, and the shapes that they have where nodes repeat.

A brick whose nodes repeat is a wedge or a tetrahedron, a quadrilateral a triangle. Nodes have the letters of
the manual, `LETTERS` in their order.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

from microslip.model.mesh.finite_elements import FULL, INCOMPATIBLE

LETTERS = "IJKLMNOPQRSTUVWXYZAB"
"""Of the nodes of a brick: corners, middles of the sides below, above and between."""


@dataclass(frozen=True)
class Shape:
    """One shape of an element type.

    Attributes
    ----------
    kind : str
        Name of the `ElementType`.
    same : tuple of str
        Letters of nodes that are one; in no other shape before it in the list.
    nodes : str
        Those that are taken, in the order of the `ElementType`.
    """

    kind: str
    same: tuple[str, ...]
    nodes: str


LINEAR_SOLID = (
    Shape("tet4", ("KL", "MNOP"), "IJKM"),
    Shape("wedge6", ("KL", "OP"), "IJKMNO"),
    Shape("hex8", (), LETTERS[:8]),
)
QUADRATIC_SOLID = (
    Shape("tet10", ("KL", "MNOP"), "IJKMQRTYZA"),
    Shape("wedge15", ("KL", "OP"), "IJKMNOQRTUVXYZA"),
    Shape("hex20", (), LETTERS),
)
LINEAR_PLANE = (Shape("tri3", ("KL",), "IJK"), Shape("quad4", (), LETTERS[:4]))
QUADRATIC_PLANE = (Shape("tri6", ("KL",), "IJKMNP"), Shape("quad8", (), LETTERS[:8]))


@dataclass(frozen=True)
class Routine:
    """An element type by its number.

    Attributes
    ----------
    shapes : tuple of Shape
    size, corners : int
        Number of nodes where none is left out, and of those at corners.
    plane : int
        Key option that says plane stress or strain; 0 of solids.
    options : mapping of int to set of int
        Values of other key options that are understood; all others must be 0.
    remark : str
        What is computed otherwise than ANSYS does; empty where nothing is.
    """

    shapes: tuple[Shape, ...]
    size: int
    corners: int
    plane: int = 0
    options: Mapping[int, tuple[int, ...]] | None = None
    remark: str = ""


STRAINS = "linear bricks and quadrilaterals are computed with incompatible modes"
FULLY = "reduced integration is not used: integrated fully"

TETRAHEDRON = (Shape("tet10", (), LETTERS[:10]),)

ROUTINES = {
    42: Routine(LINEAR_PLANE, 4, 4, plane=3, options={2: (0, 1)}, remark=STRAINS),
    45: Routine(LINEAR_SOLID, 8, 8, options={1: (0, 1), 2: (0, 1)}, remark=STRAINS),
    82: Routine(QUADRATIC_PLANE, 8, 4, plane=3, remark=FULLY),
    92: Routine(TETRAHEDRON, 10, 4),
    95: Routine(QUADRATIC_SOLID, 20, 8, options={11: (0, 1)}, remark=FULLY),
    182: Routine(LINEAR_PLANE, 4, 4, plane=3, options={1: (0, 1, 2, 3)}, remark=STRAINS),
    183: Routine(QUADRATIC_PLANE, 8, 4, plane=3, remark=FULLY),
    185: Routine(LINEAR_SOLID, 8, 8, options={2: (0, 1, 2, 3)}, remark=STRAINS),
    186: Routine(QUADRATIC_SOLID, 20, 8, options={2: (0, 1)}, remark=FULLY),
    187: Routine(TETRAHEDRON, 10, 4),
}
"""Solids by their numbers: PLANE42, 82, 182 and 183, SOLID45, 92, 95, 185, 186 and 187."""

CONTACT = range(169, 179)
"""Targets and contact elements: the joint file says what touches."""

PLANES = {0: "stress", 2: "strain"}
"""Plane stress and strain by their key option."""


def formulation(kind: str) -> str:
    """How elements of a kind are computed.

    Examples
    --------
    >>> formulation("hex8"), formulation("tet4")
    ('incompatible', 'full')
    """
    return INCOMPATIBLE if kind in ("hex8", "quad4") else FULL


def shape_of(routine: Routine, nodes: tuple[int, ...]) -> Shape | None:
    """The shape that an element has with its nodes; None where it is none that is known.

    Examples
    --------
    >>> shape_of(ROUTINES[185], (1, 2, 3, 3, 4, 5, 6, 6)).kind
    'wedge6'
    """
    by_letter = dict(zip(LETTERS, nodes, strict=False))
    corners = set(nodes[: routine.corners])
    for shape in routine.shapes:
        if all(len({by_letter[letter] for letter in group}) == 1 for group in shape.same):
            taken = [by_letter[letter] for letter in shape.nodes]
            different = len(set(taken)) == len(taken) and 0 not in taken
            return shape if different and corners <= set(taken) else None
    return None

"""Elements that lie on bodies and are none: programs write the faces of bodies so that a group has names.

Gmsh writes physical surfaces of solids as plane elements. Where all nodes of such elements are nodes of
bodies and no section is given to them they are left out, and their element sets name surfaces.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from microslip.errors import Caution, InputError, ModelError
from microslip.model.mesh.abaqus.scopes import Element
from microslip.model.mesh.boundary import faces_at, surface_of_cells
from microslip.model.mesh.element_types import element_type
from microslip.model.mesh.finite_elements import Block, Surface
from microslip.typing import Array, Indices


@dataclass(frozen=True)
class Placed:
    """An element in its instance, with the rows of its nodes."""

    instance: str
    label: int
    element: Element
    rows: tuple[int, ...]


def parted(elements: Sequence[Placed]) -> tuple[list[Placed], list[Placed]]:
    """Elements of bodies, and those that lie on them.

    Raises
    ------
    InputError
        Where there are no bodies, or what is none of them has nodes of its own.
    """
    solid = any(e.element.solid.plane is None and not e.element.solid.skin for e in elements)
    on = [e for e in elements if e.element.solid.skin or (solid and e.element.solid.plane)]
    if not on:
        return list(elements), []
    left = {id(e) for e in on}
    bodies = [e for e in elements if id(e) not in left]
    known = {row for each in bodies for row in each.rows}
    for each in on:
        if not known.issuperset(each.rows):
            beside = "solid (C3D)" if solid else "plane (CPS, CPE)" if bodies else "no"
            raise InputError(
                f"{each.element.where}: element {each.label} of type {each.element.type} stands beside "
                f"{beside} elements and has nodes that are none of theirs: bodies of one dimension alone are "
                "read. Take such elements out of the deck, or write the body of the others"
            )
    return bodies, on


def cautions_of(skins: Sequence[Placed]) -> list[Caution]:
    """A word for each type that is left out."""
    kinds: dict[str, list[Placed]] = {}
    for each in skins:
        kinds.setdefault(each.element.type, []).append(each)
    return [
        Caution(
            "mesh",
            f"{found[0].element.where}, {len(found)} elements {kind}",
            "left out: they lie on bodies and have no section; their element sets name surfaces",
        )
        for kind, found in kinds.items()
    ]


def surfaces_of_sets(
    blocks: Sequence[Block],
    sets: Mapping[str, Sequence[Placed]],
    points: Array,
) -> tuple[dict[str, Surface], list[Caution]]:
    """Faces on which the elements of each set lie; a word where there are none.

    Parameters
    ----------
    blocks : sequence of Block
        Of the bodies.
    sets : mapping of str to sequence of Placed
        All of elements that lie on them.
    points : (n, d) array
    """
    wide = {
        name: cells
        for name, members in sets.items()
        if (cells := _corners(members, blocks[0].type.dimension - 1)) is not None
    }
    if not wide:
        return {}, []
    found, counts = faces_at(blocks, np.vstack(list(wide.values())))
    out: dict[str, Surface] = {}
    cautions, start = [], 0
    for name, cells in wide.items():
        own = slice(start, start + len(cells))
        start = own.stop
        if (counts[own] == 1).all():
            keys = np.unique(np.column_stack([found.elements[own], found.faces[own]]), axis=0)
            out[name] = Surface(keys[:, 0], keys[:, 1])
            continue
        try:
            out[name] = surface_of_cells(blocks, cells, name, points)
        except ModelError as error:
            cautions.append(
                Caution("mesh", f"element set {name!r}", f"it names no surface: {error}")
            )
    return out, cautions


def _corners(members: Sequence[Placed], dimension: int) -> Indices | None:
    """(c, 4) corners, -1 where there are fewer; None of elements that are no faces."""
    out = np.full((len(members), 4), -1)
    for k, each in enumerate(members):
        shape = element_type(each.element.solid.kind)
        if shape.dimension != dimension:
            return None
        out[k, : shape.corners] = each.rows[: shape.corners]
    return out

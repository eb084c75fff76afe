"""Faces on the outside of bodies, and surfaces from nodes or from cells of a lower dimension."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace

import numpy as np

from microslip.errors import ModelError
from microslip.model.mesh.finite_elements import Block, FiniteElementMesh, Surface
from microslip.typing import Array, Indices


def all_faces(blocks: Sequence[Block]) -> tuple[Surface, Indices]:
    """Every face of every element, and its sorted corners (f, 4), -1 where it has fewer."""
    elements, faces, corners = [], [], []
    start = 0
    for block in blocks:
        for face, loop in enumerate(block.type.loops):
            own = np.full((block.count, 4), -1)
            own[:, : len(loop)] = block.nodes[:, list(loop)]
            corners.append(np.sort(own, axis=1))
            elements.append(start + np.arange(block.count))
            faces.append(np.full(block.count, face))
        start += block.count
    return Surface(np.concatenate(elements), np.concatenate(faces)), np.concatenate(corners)


def boundary(blocks: Sequence[Block]) -> tuple[Surface, Indices]:
    """Faces that belong to one element alone, and their sorted corners.

    Examples
    --------
    >>> block = Block("quad4", np.array([[0, 1, 4, 3], [1, 2, 5, 4]]), np.array([1, 2]))
    >>> len(boundary([block])[0].elements)
    6
    """
    surface, corners = all_faces(blocks)
    _, inverse, counts = np.unique(corners, axis=0, return_inverse=True, return_counts=True)
    free = counts[inverse.ravel()] == 1
    return Surface(surface.elements[free], surface.faces[free]), corners[free]


def faces_at(blocks: Sequence[Block], cells: Indices) -> tuple[Surface, Indices]:
    """A face with the corners of each cell (c, 4), and how many there are: one on the outside, two inside.

    Examples
    --------
    >>> block = Block("quad4", np.array([[0, 1, 4, 3], [1, 2, 5, 4]]), np.array([1, 2]))
    >>> found, count = faces_at([block], np.array([[2, 5, -1, -1], [4, 1, -1, -1]]))
    >>> int(found.elements[0]), int(found.faces[0]), count.tolist()
    (1, 1, [1, 2])
    """
    surface, corners = all_faces(blocks)
    both = np.concatenate([np.sort(cells, axis=1), corners])
    _, number = np.unique(both, axis=0, return_inverse=True)
    number = number.ravel()
    mine, theirs = number[: len(cells)], number[len(cells) :]
    counts = np.bincount(theirs, minlength=int(number.max(initial=0)) + 1)
    first = np.zeros(len(counts), dtype=np.int64)
    first[theirs[::-1]] = np.arange(len(theirs))[::-1]
    at = first[mine]
    return Surface(surface.elements[at], surface.faces[at]), counts[mine]


def surface_of_nodes(blocks: Sequence[Block], nodes: Indices) -> Surface:
    """Outside faces all of whose corners are among nodes."""
    surface, corners = boundary(blocks)
    inside = (np.isin(corners, nodes) | (corners < 0)).all(axis=1)
    return Surface(surface.elements[inside], surface.faces[inside])


def surface_of_cells(
    blocks: Sequence[Block], cells: Indices, name: str, points: Array | None = None
) -> Surface:
    """Faces that cells of a lower dimension lie on.

    Where all cells lie between two elements, as of a section through a body, they are the faces of the
    elements on one side of the plane through the first cell.

    Parameters
    ----------
    blocks : sequence of Block
    cells : (c, k) int array
        Corners of each cell.
    name : str
        Of the surface, for messages.
    points : (n, d) array, optional
        Of the mesh; without them no cell may lie inside a body.

    Raises
    ------
    ModelError
        Where a cell lies on no face, or some inside a body and others not.
    """
    wanted = np.full((len(cells), 4), -1)
    wanted[:, : cells.shape[1]] = cells
    wanted = np.sort(wanted, axis=1)
    surface, corners = all_faces(blocks)
    known: dict[bytes, list[int]] = {}
    for k, key in enumerate(corners):
        known.setdefault(key.tobytes(), []).append(k)
    found = [known.get(key.tobytes(), []) for key in wanted.astype(corners.dtype)]
    lost = sum(len(each) == 0 for each in found)
    inside = sum(len(each) > 1 for each in found)
    if points is not None and len(cells) and inside == len(cells):
        return _below(blocks, cells, surface, np.array(found), points)
    if lost or inside:
        raise ModelError(
            f"surface {name!r}: {lost} of its {len(cells)} cells lie on no element and {inside} between two; "
            "a surface is made of outside faces"
        )
    at = np.array([each[0] for each in found])
    return Surface(surface.elements[at], surface.faces[at])


def _below(
    blocks: Sequence[Block], cells: Indices, faces: Surface, at: Indices, points: Array
) -> Surface:
    """Of two faces at each cell (c, 2) those whose elements lie below the plane of the first cell."""
    corners = points[cells[0][cells[0] >= 0]]
    across = np.linalg.svd(corners - corners.mean(axis=0))[2][-1]
    middle = np.concatenate([points[block.nodes].mean(axis=1) for block in blocks])
    height = (middle[faces.elements[at]] - corners.mean(axis=0)) @ across
    chosen = at[np.arange(len(at)), np.argmin(height, axis=1)]
    return Surface(faces.elements[chosen], faces.faces[chosen])


def with_surfaces(mesh: FiniteElementMesh, surfaces: Mapping[str, Surface]) -> FiniteElementMesh:
    """The mesh with more surfaces."""
    return replace(mesh, surfaces={**mesh.surfaces, **surfaces})


def joined(first: FiniteElementMesh, second: FiniteElementMesh) -> FiniteElementMesh:
    """Two meshes as one; sets and surfaces of the same name become one.

    Labels are those of the parts. Sections and what ties nodes together are not joined.

    Examples
    --------
    >>> block = Block("quad4", np.array([[0, 1, 2, 3]]), np.array([1]))
    >>> square = np.array([[0.0, 0.0], [1.0, 0.0], [1.0, 1.0], [0.0, 1.0]])
    >>> mesh = FiniteElementMesh(square, np.arange(4), (block,), node_sets={"all": np.arange(4)})
    >>> len(joined(mesh, mesh).node_sets["all"])
    8
    """
    n, e = len(first.points), first.elements
    blocks = tuple(replace(b, nodes=b.nodes + n) for b in second.blocks)
    surfaces = {k: Surface(s.elements + e, s.faces) for k, s in second.surfaces.items()}
    return replace(
        first,
        points=np.vstack([first.points, second.points]),
        node_labels=np.concatenate([first.node_labels, second.node_labels]),
        blocks=first.blocks + blocks,
        node_sets=_merged(first.node_sets, {k: v + n for k, v in second.node_sets.items()}),
        element_sets=_merged(
            first.element_sets, {k: v + e for k, v in second.element_sets.items()}
        ),
        surfaces={
            name: _both(first.surfaces.get(name), surfaces.get(name))
            for name in (*first.surfaces, *surfaces)
        },
    )


def _both(first: Surface | None, second: Surface | None) -> Surface:
    parts = [part for part in (first, second) if part is not None]
    return Surface(
        np.concatenate([part.elements for part in parts]),
        np.concatenate([part.faces for part in parts]),
    )


def _merged(first: Mapping[str, Indices], second: Mapping[str, Indices]) -> dict[str, Indices]:
    empty = np.zeros(0, dtype=np.int64)
    names = (*first, *second)
    return {k: np.concatenate([first.get(k, empty), second.get(k, empty)]) for k in names}

"""Meshes of Gmsh and VTK, read by meshio.

Cells of the highest dimension are elements, cells one dimension below them are faces of surfaces, what is
lower still gives node sets. Groups with a name keep it: physical groups of Gmsh, of which a cell may have
several, and ``array=value`` of integer data of cells and points in VTK. Quadratic wedges meshio does not
know; decks have them.
"""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np

from microslip.errors import InputError
from microslip.model.mesh.boundary import surface_of_cells
from microslip.model.mesh.element_types import CORNERS
from microslip.model.mesh.finite_elements import (
    FULL,
    INCOMPATIBLE,
    Block,
    FiniteElementMesh,
    Surface,
)
from microslip.typing import Indices, Mask

CELLS = {
    "triangle": "tri3",
    "triangle6": "tri6",
    "quad": "quad4",
    "quad8": "quad8",
    "quad9": "quad9",
    "tetra": "tet4",
    "tetra10": "tet10",
    "hexahedron": "hex8",
    "hexahedron20": "hex20",
    "hexahedron27": "hex27",
    "wedge": "wedge6",
}
"""Elements by meshio's name of the cell."""

LOWER = {"vertex": 0, "line": 1, "line3": 1}
"""Cells that are never elements, and their dimension."""

ENDINGS = (".msh", ".vtk", ".vtu")
"""Files that are read here."""

PHYSICAL = "gmsh:physical"
"""Data of cells that number the physical groups of Gmsh."""


def read_foreign(path: Path, *, length: float = 1.0) -> FiniteElementMesh:
    """Mesh and groups of a file of Gmsh (``.msh``) or VTK (``.vtk``, ``.vtu``).

    Linear quadrilaterals and hexahedra get incompatible modes. Nodes and elements are numbered from 1 in
    the order of the file, elements type by type.

    Parameters
    ----------
    path : Path
    length : float
        Unit of length of the file in m.

    Raises
    ------
    InputError
        Where the file cannot be read, or has cells that are no elements here.
    """
    import meshio

    if path.suffix.lower() not in ENDINGS:
        raise InputError(f"{path.name}: the ending must be one of {', '.join(ENDINGS)} or .inp")
    # by name: meshio.read prints beside what it raises
    reader = {".msh": meshio.gmsh, ".vtk": meshio.vtk, ".vtu": meshio.vtu}[path.suffix.lower()]
    try:
        with open(path, "rb") as opened:
            if not opened.read(1):
                raise InputError(f"{path.name}: the file is empty")
        found = reader.read(path)
    except OSError as error:
        raise InputError(f"{path}: cannot be read: {error.strerror or error}") from error
    except KeyError as error:
        raise InputError(f"{path.name}: meshio knows no cells {error}") from error
    except InputError:
        raise
    except (Exception, SystemExit) as error:
        raise InputError(
            f"{path.name}: meshio cannot read it: {error or type(error).__name__}"
        ) from error
    return _mesh(found, path.name, length)


def _mesh(found: Any, file: str, length: float) -> FiniteElementMesh:
    for cells in found.cells:
        if cells.type not in CELLS and cells.type not in LOWER:
            raise InputError(
                f"{file}: {len(cells.data)} cells {cells.type!r} are not understood; those are "
                f"{', '.join((*CELLS, *LOWER))}"
            )
    dimension = max((_dimension(cells.type) for cells in found.cells), default=0)
    if dimension < 2:
        raise InputError(f"{file}: there are no elements; does the file save its volumes or areas?")
    points = np.asarray(found.points, dtype=float)
    if dimension == 2:
        if points.shape[1] == 3 and np.ptp(points[:, 2]) > 1e-9 * np.ptp(points, axis=0).max():
            raise InputError(
                f"{file}: plane elements must lie in a plane z = constant; for solids the file must have the "
                "cells of the volumes"
            )
        points = points[:, :2]
    blocks, of_list = _blocks(found.cells, dimension)
    element_sets, node_sets, surfaces = _groups(found, blocks, of_list, dimension)
    return FiniteElementMesh(
        points=length * points,
        node_labels=1 + np.arange(len(points)),
        blocks=tuple(blocks),
        node_sets=node_sets,
        element_sets=element_sets,
        surfaces=surfaces,
    )


def _dimension(cell: str) -> int:
    if cell in LOWER:
        return LOWER[cell]
    return 2 if CELLS[cell].startswith(("tri", "quad")) else 3


def _blocks(cells: Any, dimension: int) -> tuple[list[Block], dict[int, Indices]]:
    """Blocks, and the elements that each list of cells is.

    A cell that is in several lists, as one of several groups is in a file of Gmsh 2.2, is one element.
    """
    blocks: list[Block] = []
    elements: dict[int, Indices] = {}
    count = 0
    for cell in dict.fromkeys(each.type for each in cells if _dimension(each.type) == dimension):
        kind = CELLS[cell]
        formulation = INCOMPATIBLE if kind in ("quad4", "hex8") else FULL
        lists = [k for k, each in enumerate(cells) if each.type == cell and len(each.data)]
        if not lists:
            continue
        data = [np.asarray(cells[k].data, dtype=np.int64) for k in lists]
        starts = np.cumsum([0, *map(len, data)])
        first = _first_of_each(np.vstack(data))
        new = first == np.arange(len(first))
        number = (count + np.cumsum(new) - 1)[first]
        for k, rows, start in zip(lists, data, starts, strict=False):
            own = slice(start, start + len(rows))
            elements[k] = number[own]
            if new[own].any():
                labels = 1 + number[own][new[own]]
                blocks.append(Block(kind, rows[new[own]], labels, formulation))
        count += int(new.sum())
    return blocks, elements


def _first_of_each(rows: Indices) -> Indices:
    """(n,) where each set of nodes is first."""
    _, first, same = np.unique(
        np.sort(rows, axis=1), axis=0, return_index=True, return_inverse=True
    )
    return np.asarray(first[same.ravel()])


def _groups(
    found: Any, blocks: list[Block], of_list: dict[int, Indices], dimension: int
) -> tuple[dict[str, Indices], dict[str, Indices], dict[str, Surface]]:
    elements: dict[str, list[Indices]] = {}
    nodes: dict[str, list[Indices]] = {}
    faces: dict[str, list[Indices]] = {}
    for name, k, chosen in _named_cells(found):
        cells = found.cells[k]
        rows = np.asarray(cells.data, dtype=np.int64)[chosen]
        if not len(rows):
            continue
        own = _dimension(cells.type)
        if own == dimension:
            elements.setdefault(name, []).append(of_list[k][chosen])
            continue
        nodes.setdefault(name, []).append(rows.ravel())
        if own == dimension - 1:
            corners = 2 if own == 1 else CORNERS[CELLS[cells.type].rstrip("0123456789")]
            wide = np.full((len(rows), 4), -1)
            wide[:, :corners] = rows[:, :corners]
            faces.setdefault(name, []).append(wide)
    points = np.asarray(found.points, dtype=float)[:, :dimension]
    for name, values in found.point_data.items():
        data = np.asarray(values)
        if data.ndim == 1 and np.issubdtype(data.dtype, np.integer):
            for value in np.unique(data[data != 0]):
                nodes.setdefault(f"{name}={value}", []).append(np.flatnonzero(data == value))
    return (
        {name: np.unique(np.concatenate(parts)) for name, parts in elements.items()},
        {name: np.unique(np.concatenate(parts)) for name, parts in nodes.items()},
        {
            name: surface_of_cells(blocks, np.vstack(parts), name, points)
            for name, parts in faces.items()
        },
    )


def _named_cells(found: Any) -> Iterator[tuple[str, int, Mask]]:
    """Name of a group, list of cells, and which of them are in it."""
    physical = {(int(tag), int(dim)): name for name, (tag, dim) in found.field_data.items()}
    # where the file says which lists of cells a group has, its data of cells name one group of each alone
    in_sets = {name: lists for name, lists in found.cell_sets.items() if name in found.field_data}
    for name, lists in in_sets.items():
        for k, rows in enumerate(lists):
            if rows is not None and len(rows):
                yield name, k, np.isin(np.arange(len(found.cells[k].data)), rows)
    for array, lists in found.cell_data.items():
        if array.startswith("gmsh:") and array != PHYSICAL:
            continue
        for k, values in enumerate(lists):
            data = np.asarray(values)
            if data.ndim != 1 or not np.issubdtype(data.dtype, np.integer):
                continue
            for value in np.unique(data):
                if array == PHYSICAL:
                    name = physical.get((int(value), _dimension(found.cells[k].type)))
                    if value != 0 and (name is None or name not in in_sets):
                        yield name or f"physical {value}", k, data == value
                else:
                    yield f"{array}={value}", k, data == value

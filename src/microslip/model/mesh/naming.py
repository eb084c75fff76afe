"""What bodies of a mesh are called."""

from __future__ import annotations

import numpy as np

from microslip.model.mesh.finite_elements import FiniteElementMesh
from microslip.typing import Indices


def named_bodies(mesh: FiniteElementMesh) -> list[tuple[str, Indices]]:
    """Bodies by the element set that is all of each, else by number; and their nodes.

    Examples
    --------
    >>> from microslip.model.mesh.finite_elements import Block
    >>> square = np.array([[0.0, 0.0], [1.0, 0.0], [1.0, 1.0], [0.0, 1.0]])
    >>> block = Block("quad4", np.array([[0, 1, 2, 3], [4, 5, 6, 7]]), np.array([1, 2]))
    >>> mesh = FiniteElementMesh(
    ...     np.vstack([square, square + 5.0]), np.arange(8), (block,), element_sets={"LUG": np.array([1])}
    ... )
    >>> [name for name, _ in named_bodies(mesh)]
    ['body 1', 'LUG']
    """
    sets = {name: np.unique(elements) for name, elements in mesh.element_sets.items()}
    out = []
    for k, nodes in enumerate(mesh.bodies):
        own = elements_at(mesh, nodes)
        alone = [n for n, e in sets.items() if len(e) == len(own) and np.isin(own, e).all()]
        out.append((alone[0] if alone else f"body {k + 1}", nodes))
    return out


def elements_at(mesh: FiniteElementMesh, nodes: Indices) -> Indices:
    """Elements whose first node is among some."""
    inside = np.zeros(len(mesh.points), dtype=bool)
    inside[nodes] = True
    first = np.concatenate([block.nodes[:, 0] for block in mesh.blocks])
    return np.flatnonzero(inside[first])

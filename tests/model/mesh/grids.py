"""Small meshes of every element type: boxes, moved at random inside, for the tests of meshes."""

from __future__ import annotations

from itertools import product

import numpy as np

from microslip.model.mesh.element_types import TYPES
from microslip.model.mesh.finite_elements import Block, FiniteElementMesh

TETS = ((0, 1, 2, 6), (0, 2, 3, 6), (0, 3, 7, 6), (0, 7, 4, 6), (0, 4, 5, 6), (0, 5, 1, 6))
SPLIT = {
    "tri": ((0, 1, 2), (0, 2, 3)),
    "quad": ((0, 1, 2, 3),),
    "tet": TETS,
    "hex": (tuple(range(8)),),
    "wedge": ((0, 1, 2, 4, 5, 6), (0, 2, 3, 4, 6, 7)),
}


def box(kind, axes, move=None, formulation="full"):
    """A box of elements with corners at the products of `axes`; `move` maps (n, d) corners."""
    shape = TYPES[kind]
    d = len(axes)
    grid = np.array(list(product(*axes)))
    number = {k: i for i, k in enumerate(product(*(range(len(a)) for a in axes)))}
    unit = TYPES["quad4" if d == 2 else "hex8"].nodes
    offsets = ((unit + 1) / 2).astype(int)
    cells = []
    for corner in product(*(range(len(a) - 1) for a in axes)):
        own = [number[tuple(np.array(corner) + o)] for o in offsets]
        cells += [[own[k] for k in split] for split in SPLIT[shape.family]]
    corners = grid if move is None else move(grid)
    points, nodes = list(corners), []
    known = {}
    weights = TYPES[LINEAR[shape.family]].shapes(shape.nodes)
    for cell in cells:
        own = list(cell)
        for w in weights[len(cell) :]:
            key = tuple(sorted(np.array(cell)[w > 1e-9]))
            if key not in known:
                known[key] = len(points)
                points.append(w @ corners[cell])
            own.append(known[key])
        nodes.append(own)
    block = Block(kind, np.array(nodes), 100 + np.arange(len(nodes)), formulation)
    return FiniteElementMesh(np.array(points), 1 + np.arange(len(points)), (block,))


LINEAR = {"tri": "tri3", "quad": "quad4", "tet": "tet4", "hex": "hex8", "wedge": "wedge6"}


def shaken(axes, seed, size=0.15):
    """Corners off the boundary of a box moved at random by a part of its least spacing."""
    rng = np.random.default_rng(seed)
    least = size * min(np.diff(a).min() for a in axes)
    low, high = np.array([[a[0], a[-1]] for a in axes]).T

    def move(points):
        inner = ((points > low + 1e-9) & (points < high - 1e-9)).all(axis=1, keepdims=True)
        return points + inner * least * rng.uniform(-1, 1, points.shape)

    return move

"""Two bodies one above the other whose nodes do not match, for the tests of interfaces."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from grids import box

from microslip.model.mesh.boundary import boundary, joined, with_surfaces
from microslip.model.mesh.element_types import TYPES
from microslip.model.mesh.finite_elements import Surface


def block(kind, side, n, *, size=1.0, tilt=0.0, shake=0.0, seed=0, bend=None):
    """A body below (side 0) or above (side 1) ``z = tilt (x - 0.3)`` or the surface ``z = bend(x)``."""
    d = TYPES[kind].dimension
    inset = 0.5 * (1 - size)
    flat = [np.linspace(inset, inset + size, k + 1) for k in ((n,), (n, n - 1))[d - 2]]
    axes = [*flat, np.linspace(side - 1.0, side, 3)]
    rng = np.random.default_rng(seed)

    def move(p):
        out = p.copy()
        for k in range(d - 1):
            edge = (np.abs(p[:, k] - axes[k][0]) < 1e-9) | (np.abs(p[:, k] - axes[k][-1]) < 1e-9)
            out[:, k] += shake / n * ~edge * rng.uniform(-1, 1, len(p))
        height = tilt * (out[:, 0] - 0.3) if bend is None else bend(out)
        out[:, -1] += height * (1 - np.abs(p[:, -1]))
        return out

    mesh = box(kind, axes, move)
    if bend is not None:
        mesh = curved(mesh, bend)
    return with_surfaces(mesh, named(mesh, side))


def curved(mesh, bend):
    """Middle nodes of the interface moved onto it."""
    points = mesh.points.copy()
    corners = np.unique(mesh.blocks[0].nodes[:, : mesh.blocks[0].type.corners])
    middle = np.setdiff1d(np.arange(len(points)), corners)
    near = middle[np.abs(points[middle, -1] - bend(points[middle])) < 0.1]
    points[near, -1] = bend(points[near])
    return replace(mesh, points=points)


def named(mesh, side):
    """``touch0`` or ``touch1``, the face towards the other body, and ``rest``."""
    faces, _ = boundary(mesh.blocks)
    own = mesh.blocks[0]
    local = [list(nodes) for _, nodes in own.type.faces]
    number = 2 if mesh.dimension == 2 else 3
    low, high = mesh.points.min(axis=0), mesh.points.max(axis=0)
    touch = []
    for e, f in zip(faces.elements, faces.faces, strict=True):
        x = mesh.points[own.nodes[e][local[f][:number]]]
        at_low, at_high = (np.abs(x - edge).max(axis=0)[:-1] < 1e-9 for edge in (low, high))
        beside = (at_low | at_high).any()
        outer = np.abs(np.abs(x[:, -1]) - 1.0).max() < 1e-9
        touch.append(not beside and not outer)
    own = np.array(touch)
    return {
        f"touch{side}": Surface(faces.elements[own], faces.faces[own]),
        f"rest{side}": Surface(faces.elements[~own], faces.faces[~own]),
    }


def two_blocks(lower, upper, counts=(3, 4), sizes=(1.0, 1.0), turn=0.0, **options):
    """Both, turned about the origin in the plane of the first and the last coordinate."""
    mesh = joined(
        *(
            block(kind, side, n, size=size, seed=side, **options)
            for side, (kind, n, size) in enumerate(zip((lower, upper), counts, sizes, strict=True))
        )
    )
    return replace(mesh, points=mesh.points @ rotation(mesh.dimension, turn).T)


def rotation(d, turn):
    c, s = np.cos(turn), np.sin(turn)
    R = np.eye(d)
    R[0, 0], R[0, -1], R[-1, 0], R[-1, -1] = c, -s, s, c
    return R

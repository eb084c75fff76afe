"""Bodies that overlap away from where they touch: a mistake of the mesh, found before anything is computed.

A node of one body lies in another where it lies on the inner side of all faces of one of its elements. How
deep is its distance to the nearest outside face. Faces that a contact or a tie names may be entered: the
coupling says how deep. Elements count as the polyhedra of their corners. Where no node does, as of bars that
cross, the same is asked of the points half way between the places where edges of outside faces, and the
diagonals that cut them into simplices, pass through those of the other body.
"""

from __future__ import annotations

from collections.abc import Collection
from dataclasses import dataclass

import numpy as np
import scipy.spatial

from microslip.brief import Brief
from microslip.errors import ModelError
from microslip.model.mesh.boundary import boundary
from microslip.model.mesh.crossings import midway
from microslip.model.mesh.finite_elements import FiniteElementMesh
from microslip.model.mesh.naming import named_bodies
from microslip.typing import Array, Indices, Mask

DEEP = 0.1
"""Of the size of the face that is entered: deeper is an overlap. Facets of curved surfaces that fit each
other cut into each other by less."""

ACROSS = 0.26
"""Of the length of an edge that is inside: deeper in its middle is an overlap. One that cuts off a corner of
a pin with n sides is ``sin(180°/n) / 2`` deep, a quarter where there are six; one across a bar a half."""

SLIGHT = 0.01
"""Of the breadth of the faces that an edge passes through: less deep is rounding of their corners."""

NEAREST = 8
"""So many outside faces near a node are looked at for the one that it is nearest to, at first."""


ROUNDING = 1e-9
"""Of the size of an element: so far outside a point still is on its face."""


@dataclass(frozen=True, repr=False)
class _Outside(Brief):
    """Outside faces of all bodies.

    Attributes
    ----------
    pieces : (f, d, d) array
        Corners of the simplices that faces are cut into.
    body : (f,) int array
    named : (f,) bool array
        Whether a contact or a tie may enter it.
    middle : (f, d) array
    size : (f,) array
        Largest distance of a corner from the middle, doubled.
    """

    pieces: Array
    body: Indices
    named: Mask
    middle: Array
    size: Array


def check_apart(mesh: FiniteElementMesh, surfaces: Collection[str] = ()) -> None:
    """Raise `ModelError` where two bodies overlap, naming both, the deepest node or edge and where it is.

    Parameters
    ----------
    mesh : FiniteElementMesh
    surfaces : collection of str
        Named surfaces that another body may enter.

    Examples
    --------
    >>> from microslip.model.mesh.finite_elements import Block
    >>> square = np.array([[0.0, 0.0], [1.0, 0.0], [1.0, 1.0], [0.0, 1.0]])
    >>> block = Block("quad4", np.array([[0, 1, 2, 3], [4, 5, 6, 7]]), np.array([1, 2]))
    >>> check_apart(FiniteElementMesh(np.vstack([square, square + 1.0]), np.arange(8), (block,)))
    >>> mesh = FiniteElementMesh(np.vstack([square, square + 0.7]), np.arange(8), (block,))
    >>> try:
    ...     check_apart(mesh)
    ... except ModelError as error:
    ...     print(str(error)[:81])
    body 1 and body 2 overlap where they are not said to touch: node 2 of body 1 lies
    """
    body = _body_of_nodes(mesh)
    boxes = np.array(
        [(mesh.points[nodes].min(axis=0), mesh.points[nodes].max(axis=0)) for nodes in mesh.bodies]
    )
    outside = None
    worst: tuple[float, int, int] | None = None
    for own, other in _near_pairs(boxes):
        nodes = _inside(mesh, body, int(own), int(other), boxes)
        if not len(nodes):
            continue
        outside = _outside(mesh, body, surfaces) if outside is None else outside
        depth, at = _deepest(mesh.points[nodes], outside, int(other))
        node = int(nodes[at])
        if depth > (0.0 if worst is None else worst[0]):
            worst = depth, node, int(other)
    if worst is None:
        _check_edges(
            mesh, body, boxes, _outside(mesh, body, surfaces) if outside is None else outside
        )
        return
    depth, node, other = worst
    names = [name for name, _ in named_bodies(mesh)]
    inner = names[body[node]]
    pair = " and ".join(names[k] for k in sorted((int(body[node]), other)))
    place = ", ".join(f"{c:.4g}" for c in mesh.points[node])
    raise ModelError(
        f"{pair} overlap where they are not said to touch: node {mesh.node_labels[node]} of {inner} lies "
        f"{depth:.3g} m inside {names[other]}, at ({place}) m; move one of them, or name the surfaces as an "
        "interface or a tie"
    )


def _check_edges(mesh: FiniteElementMesh, body: Indices, boxes: Array, outside: _Outside) -> None:
    """Raise `ModelError` where an edge of one body passes through another, none of whose nodes are in it."""
    d = mesh.dimension
    ends = [(i, j) for i in range(d) for j in range(i + 1, d)]
    worst: tuple[float, int, int, Array] | None = None
    for own, other in _near_pairs(boxes):
        low, high = _common(boxes, int(own), int(other))
        of_own, of_other = (
            outside.pieces[
                (outside.body == k)
                & (outside.pieces.max(axis=1) >= low).all(axis=1)
                & (outside.pieces.min(axis=1) <= high).all(axis=1)
            ]
            for k in (own, other)
        )
        edges = np.concatenate([of_own[:, list(pair)] for pair in ends])
        x, length = midway(edges, of_other)
        inside = _in_elements(mesh, body, int(other), x, low, high)
        x, length = x[inside], length[inside]
        if not len(x):
            continue
        depth, at = _deepest(
            x, outside, int(other), np.maximum(ACROSS * length, SLIGHT * _breadth(of_other))
        )
        if depth > (0.0 if worst is None else worst[0]):
            worst = depth, int(own), int(other), x[at]
    if worst is None:
        return
    depth, own, other, point = worst
    names = [name for name, _ in named_bodies(mesh)]
    pair = " and ".join(names[k] for k in sorted((own, other)))
    place = ", ".join(f"{c:.4g}" for c in point)
    raise ModelError(
        f"{pair} overlap where they are not said to touch: an edge of {names[own]} passes through "
        f"{names[other]}, {depth:.3g} m inside at ({place}) m; move one of them, or name the surfaces as an "
        "interface or a tie"
    )


def _breadth(pieces: Array) -> float:
    """Least length of segments (f, 2, 2), or height of triangles (f, 3, 3)."""
    sides = [
        np.linalg.norm(pieces[:, i] - pieces[:, j], axis=1)
        for i in range(pieces.shape[1])
        for j in range(i)
    ]
    longest = np.max(sides, axis=0)
    if pieces.shape[2] == 2:
        return float(longest.min())
    normal = np.cross(pieces[:, 1] - pieces[:, 0], pieces[:, 2] - pieces[:, 0])
    return float((np.linalg.norm(normal, axis=1) / longest).min())


def _common(boxes: Array, own: int, other: int) -> tuple[Array, Array]:
    """Low and high corner of what the boxes of two bodies have in common."""
    return (
        np.maximum(boxes[own, 0], boxes[other, 0]),
        np.minimum(boxes[own, 1], boxes[other, 1]),
    )


def _body_of_nodes(mesh: FiniteElementMesh) -> Indices:
    """(n,) number of the body of every node, -1 of those that belong to no element."""
    out = np.full(len(mesh.points), -1)
    for k, nodes in enumerate(mesh.bodies):
        out[nodes] = k
    return out


def _near_pairs(boxes: Array) -> Indices:
    """(p, 2) bodies, both ways, whose boxes have a volume in common."""
    low, high = boxes[:, 0], boxes[:, 1]
    common = np.minimum(high[:, None], high) - np.maximum(low[:, None], low)
    thick = 1e-9 * (high - low).max()
    meet = (common > thick).all(axis=2)
    np.fill_diagonal(meet, False)
    return np.argwhere(meet)


def _inside(mesh: FiniteElementMesh, body: Indices, own: int, other: int, boxes: Array) -> Indices:
    """Nodes of a body in elements of another."""
    low, high = _common(boxes, own, other)
    nodes = mesh.bodies[own]
    x = mesh.points[nodes]
    nodes = nodes[((x >= low) & (x <= high)).all(axis=1)]
    return nodes[_in_elements(mesh, body, other, mesh.points[nodes], low, high)]


def _in_elements(
    mesh: FiniteElementMesh, body: Indices, other: int, x: Array, low: Array, high: Array
) -> Mask:
    """Whether points (n, d) are in elements of a body that meet a box."""
    hit = np.zeros(len(x), dtype=bool)
    if not len(x):
        return hit
    tree = scipy.spatial.cKDTree(x)
    for block in mesh.blocks:
        corners = block.nodes[body[block.nodes[:, 0]] == other][:, : block.type.corners]
        at = mesh.points[corners]
        meets = ((at.max(axis=1) >= low) & (at.min(axis=1) <= high)).all(axis=1)
        at = at[meets]
        if not len(at):
            continue
        middle = at.mean(axis=1)
        reach = np.linalg.norm(at - middle[:, None], axis=2).max(axis=1)
        found = tree.query_ball_point(middle, reach)
        count = np.array([len(each) for each in found])
        element = np.repeat(np.arange(len(at)), count)
        node = np.concatenate([np.asarray(each, dtype=np.int64) for each in found])
        hit[node[_within(x[node], at[element], middle[element], block.type.loops)]] = True
    return hit


def _within(x: Array, corners: Array, middle: Array, loops: tuple[tuple[int, ...], ...]) -> Mask:
    """Whether points (k, d) lie on the inner side of all faces of elements (k, c, d), or on them."""
    out = np.ones(len(x), dtype=bool)
    for loop in loops:
        face = corners[:, list(loop)]
        normal = _across(face)
        centre = face.mean(axis=1)
        side = np.einsum("kd,kd->k", x - centre, normal)
        inner = np.einsum("kd,kd->k", middle - centre, normal)
        out &= side * np.sign(inner) >= -ROUNDING * np.abs(inner)
    return out


def _across(face: Array) -> Array:
    """Vectors (k, d) across faces with corners (k, c, d)."""
    if face.shape[2] == 2:
        along = face[:, 1] - face[:, 0]
        return np.stack([along[:, 1], -along[:, 0]], axis=1)
    last = 2 if face.shape[1] == 3 else 3
    diagonal = face[:, 2] - face[:, 0], face[:, last] - face[:, 1]
    return np.asarray(np.cross(*diagonal))


def _outside(mesh: FiniteElementMesh, body: Indices, surfaces: Collection[str]) -> _Outside:
    faces, _ = boundary(mesh.blocks)
    most = 8  # faces of an element
    own = [mesh.surface(name) for name in surfaces]
    keys = [most * each.elements + each.faces for each in own]
    named = np.isin(most * faces.elements + faces.faces, np.concatenate([[-1], *keys]))
    d = mesh.dimension
    pieces, of = [], []
    for block, start in zip(mesh.blocks, mesh.starts[:-1], strict=True):
        mine = (faces.elements >= start) & (faces.elements < start + block.count)
        for k, loop in enumerate(block.type.loops):
            at = np.flatnonzero(mine & (faces.faces == k))
            nodes = block.nodes[faces.elements[at] - start]
            cuts = [loop] if len(loop) == d else [loop[:3], (loop[0], *loop[2:])]
            for cut in cuts:
                pieces.append(nodes[:, list(cut)])
                of.append(at)
    nodes, face = np.concatenate(pieces), np.concatenate(of)
    x = mesh.points[nodes]
    middle = x.mean(axis=1)
    size = 2 * np.linalg.norm(x - middle[:, None], axis=2).max(axis=1)
    return _Outside(x, body[nodes[:, 0]], named[face], middle, size)


def _deepest(
    x: Array, outside: _Outside, other: int, allowed: Array | None = None
) -> tuple[float, int]:
    """Depth, and which, of the point that lies deepest in a body in which it may not; 0 where none does.

    It may as far as `allowed`, (n,), else a part of the face that it is nearest to."""
    mine = np.flatnonzero(outside.body == other)
    tree = scipy.spatial.cKDTree(outside.middle[mine])
    near = mine[tree.query(x, k=min(NEAREST, len(mine)))[1].reshape(len(x), -1)]
    depth, face = _nearest(x, outside, near)
    may = DEEP * outside.size[face] if allowed is None else allowed
    doubtful = np.flatnonzero((depth > may) & ~outside.named[face])
    largest = float(outside.size[mine].max())
    best = 0.0, -1
    for k in doubtful[np.argsort(-depth[doubtful])]:
        if depth[k] <= best[0]:
            break
        # of faces of unlike sizes the nearest may have its middle farther away
        every = mine[tree.query_ball_point(x[k], depth[k] + 0.5 * largest)]
        (least,), (at,) = _nearest(x[[k]], outside, every[None])
        most = DEEP * outside.size[at] if allowed is None else allowed[k]
        if least > max(best[0], most) and not outside.named[at]:
            best = float(least), int(k)
    return best


def _nearest(x: Array, outside: _Outside, faces: Indices) -> tuple[Array, Indices]:
    """Distances of points (n, d) to the nearest of some faces (n, k) each, and which; one that is named where
    several are as near."""
    distance = _distances(x[:, None], outside.pieces[faces])
    least = distance.min(axis=1)
    among = distance <= least[:, None] * (1 + 1e-6)
    best = np.argmax(among * (1 + outside.named[faces]), axis=1)
    return least, faces[np.arange(len(x)), best]


def _dot(a: Array, b: Array) -> Array:
    return np.asarray(np.einsum("...d,...d->...", a, b))


def _distances(x: Array, pieces: Array) -> Array:
    """Distances (n, k) of points (n, 1, d) to segments (n, k, 2, 2) or triangles (n, k, 3, 3)."""
    if pieces.shape[-1] == 2:
        return _to_segments(x, pieces[..., 0, :], pieces[..., 1, :])
    a, b, c = (pieces[..., k, :] for k in range(3))
    normal = np.cross(b - a, c - a)
    height = _dot(x - a, normal) / np.sqrt(np.maximum(_dot(normal, normal), TINY))
    sides = ((a, b), (b, c), (c, a))
    above = np.all([_dot(np.cross(q - p, x - p), normal) >= 0 for p, q in sides], axis=0)
    edges = np.min([_to_segments(x, p, q) for p, q in sides], axis=0)
    return np.where(above, np.abs(height), edges)


def _to_segments(x: Array, start: Array, end: Array) -> Array:
    along = end - start
    share = np.clip(_dot(x - start, along) / np.maximum(_dot(along, along), TINY), 0.0, 1.0)
    return np.asarray(np.linalg.norm(x - start - share[..., None] * along, axis=-1))


TINY = 1e-300

"""Whether every contact pair looks the way its neighbours look.

The row of B that is the approach of a pair has, on the nodes of a side, the normal that points out of the
body this side is of. Pairs beside each other have nearly the same normal out of the same body.
Which sides are of one body is what the stiffness says: nodes that share elements, or are connected at all.
Whether first and second node were exchanged or the normal turned round does not matter: either is the
approach of the pair with the other sign.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
import scipy.sparse as sp
import scipy.sparse.csgraph as csgraph

from microslip.errors import InputError
from microslip.model.numbering import Numbering
from microslip.model.pair_table import Pairs
from microslip.model.readers.found import DIRECTIONS
from microslip.typing import Array, Indices

ASKED = 8
"""Pairs beside a pair that are asked, at most."""

BESIDE = 2.0
"""Of the distance of the nearest, how far those may be."""

SLOPE = 0.5
"""How far from the tangent plane of a pair, over its distance, one may lie that is beside it."""

ALIKE = 0.5
"""Cosine of the angle between two normals from which on they point the same way."""


ROUNDING = 1e-9
"""Share beyond which more pairs oppose one than do not."""


class Sides(NamedTuple):
    """Nodes and normals of pairs that have two sides.

    Attributes
    ----------
    pair : (k,) int array
        Which pairs these are.
    normal : (k, d) array
        Out of the body that `out` is of.
    out, into : (k,) int arrays
        Node that counts most on either side, by its place in `nodes`.
    nodes : (e,) int array
    """

    pair: Indices
    normal: Array
    out: Indices
    into: Indices
    nodes: Indices


def check_sense(
    relative: sp.csr_matrix,
    stiffness: sp.csc_matrix,
    numbering: Numbering,
    places: Array | None,
    pairs: Pairs,
    source: str,
) -> None:
    """Raise `InputError` for the pair whose normal opposes those of most pairs beside it.

    Parameters
    ----------
    relative : (d m, n) sparse
        B.
    stiffness : (n, n) sparse
    numbering : Numbering
    places : (n, d) array or None
        Coordinates of the degrees of freedom; without them pairs are beside each other whose nodes are
        strongly connected.
    pairs : Pairs
    source : str
        File that a message names.
    """
    d = relative.shape[0] // pairs.count
    sides = _sides(relative, numbering, d)
    if len(sides.pair) < 2:
        return
    rank = {int(node): k for k, node in enumerate(sides.nodes)}
    of_node = np.array([rank.get(node, -1) for node, _ in numbering.labels])
    bond = _bonds(stiffness, of_node, len(sides.nodes))
    body = _bodies(stiffness, of_node, len(sides.nodes))
    centre = None if places is None else _centres(sides, of_node, places)
    votes = [_opposing(k, sides, bond, body, centre) for k in range(len(sides.pair))]
    worst = max(range(len(votes)), key=lambda k: votes[k])
    if votes[worst][0] > ROUNDING:
        raise InputError(
            f"{source}: row {pairs.rows[sides.pair[worst]]}: the normal of this pair opposes those of the "
            "pairs beside it, which join the same bodies: it would open where they close; are its two "
            "sides exchanged, or its normal turned round?"
        )


def _sides(relative: sp.csr_matrix, numbering: Numbering, d: int) -> Sides:
    """What the rows of approach say; pairs that have one side alone are left out."""
    axis = np.full(len(numbering.labels), -1)
    for k, name in enumerate(("x", "y", "z")[:d]):
        axis[numbering.direction == DIRECTIONS[name]] = k
    pair, normal, out, into = [], [], [], []
    for k in range(relative.shape[0] // d):
        row = relative[d * k]
        parts: dict[int, Array] = {}
        for column, value in zip(row.indices, row.data, strict=True):
            if axis[column] >= 0:
                own = parts.setdefault(numbering.labels[column][0], np.zeros(d))
                own[axis[column]] += value
        if not parts:
            continue
        first = max(parts, key=lambda node: float(np.linalg.norm(parts[node])))
        n = parts[first] / np.linalg.norm(parts[first])
        second = min(parts, key=lambda node: float(parts[node] @ n))
        if parts[second] @ n < 0:
            pair.append(k)
            normal.append(n)
            out.append(first)
            into.append(second)
    nodes, place = np.unique(np.array([*out, *into], dtype=int), return_inverse=True)
    half = len(pair)
    return Sides(np.array(pair, dtype=int), np.array(normal), place[:half], place[half:], nodes)


def _bonds(stiffness: sp.csc_matrix, of_node: Indices, count: int) -> sp.csr_matrix:
    """(e, e) size of the stiffness between two nodes of pairs."""
    dofs = np.flatnonzero(of_node >= 0)
    ones = np.ones(len(dofs))
    pick = sp.csr_matrix((ones, (dofs, of_node[dofs])), shape=(len(of_node), count))
    return (pick.T @ abs(stiffness) @ pick).tocsr()


def _bodies(stiffness: sp.csc_matrix, of_node: Indices, count: int) -> Indices:
    """(e,) connected part that each node is of."""
    _, part = csgraph.connected_components(stiffness, directed=False)
    body = np.zeros(count, dtype=int)
    body[of_node[of_node >= 0]] = part[of_node >= 0]
    return body


def _opposing(
    k: int, sides: Sides, bond: sp.csr_matrix, body: Indices, centre: Array | None
) -> tuple[float, int]:
    """Share of the pairs beside one that oppose it, less the share of those that do not, by the strength of
    their connection; and how many do."""
    order, strength = _connected(k, sides, bond)
    beside = np.flatnonzero(strength > 0) if centre is None else _near(k, sides, centre)
    if centre is None:
        beside = beside[np.argsort(-strength[beside], kind="stable")[:ASKED]]
    if not strength[beside].any():
        order = _joined(k, sides, body)
        strength = np.abs(order)
    seen = order[beside] * (sides.normal[beside] @ sides.normal[k])
    weight = strength[beside] * (np.abs(seen) > ALIKE)
    if not weight.any():
        return 0.0, 0
    return float(-np.sign(seen) @ weight / weight.sum()), int(np.sum(seen < -ALIKE))


def _connected(k: int, sides: Sides, bond: sp.csr_matrix) -> tuple[Array, Array]:
    """By the elements they share with a pair: (m,) 1 where the sides of others are of the same bodies, -1
    where of the other ones; and how strong the weaker of both connections is."""
    own = bond[[sides.out[k], sides.into[k]]].toarray()
    same = np.minimum(own[0, sides.out], own[1, sides.into])
    crossed = np.minimum(own[0, sides.into], own[1, sides.out])
    order, strength = np.sign(same - crossed), np.maximum(same, crossed)
    strength[k] = 0.0
    return order, strength


def _joined(k: int, sides: Sides, body: Indices) -> Array:
    """The same order by the connected parts; 0 where these do not say."""
    a, b = body[sides.out], body[sides.into]
    same, other = (a == a[k]) & (b == b[k]), (a == b[k]) & (b == a[k])
    return np.where(a[k] != b[k], same * 1.0 - other * 1.0, 0.0)


def _centres(sides: Sides, of_node: Indices, places: Array) -> Array:
    """(m, d) middle between the two nodes of each pair."""
    where = np.zeros((len(sides.nodes), places.shape[1]))
    where[of_node[of_node >= 0]] = places[of_node >= 0]
    return 0.5 * (where[sides.out] + where[sides.into])


def _near(k: int, sides: Sides, centre: Array) -> Indices:
    """Pairs that lie beside one, along its tangent plane."""
    away = centre - centre[k]
    distance = np.linalg.norm(away, axis=1)
    along = (distance > 0) & (np.abs(away @ sides.normal[k]) <= SLOPE * distance)
    if not along.any():
        return np.zeros(0, dtype=int)
    found = np.flatnonzero(along & (distance <= BESIDE * distance[along].min()))
    return found[np.argsort(distance[found], kind="stable")[:ASKED]]

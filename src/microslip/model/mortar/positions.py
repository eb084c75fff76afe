"""Where the pairs of an interface lie along it: one coordinate each."""

from __future__ import annotations

from itertools import pairwise

import numpy as np

from microslip.model.mesh.facets import Facets
from microslip.typing import Array, Indices

LEVEL = 1e-6
"""Mean of unit tangents below which an interface has no mean direction."""

TURNS = 0.1
"""Cosine between a tangent and their mean below which an interface in the plane is measured along itself."""


def along(points: Array, tangents: Array) -> Array:
    """(m,) coordinate along the mean first tangent of an interface."""
    mean = tangents[:, 0].mean(axis=0)
    return np.asarray(points @ (mean / max(float(np.linalg.norm(mean)), LEVEL)))


def turns(tangents: Array) -> bool:
    """Whether an interface in the plane turns so far that its mean direction does not tell its pairs apart.

    As a bore, or the half of one.

    Parameters
    ----------
    tangents : (m, d - 1, d) array
    """
    if tangents.shape[2] != 2:
        return False
    mean = tangents[:, 0].mean(axis=0)
    return bool((tangents[:, 0] @ mean).min() <= TURNS * np.linalg.norm(mean))


def arc_length(own: Facets, nodes: Indices, tangents: Array) -> Array:
    """(m,) length along a surface in the plane, m, in the direction of the tangents, 0 in the middle.

    A closed one begins at its node of the smallest x, so that 0 is opposite; parts of a surface follow each
    other.

    Parameters
    ----------
    own : Facets
    nodes : (m,) int array
        Of the pairs.
    tangents : (m, 1, 2) array
    """
    after = dict(_steps(own))
    first = [node for node in after if node not in set(after.values())]
    chains: list[list[int]] = []
    left = dict(after)
    while left:
        start = first.pop(0) if first else min(left, key=lambda n: tuple(own.points[n]))
        chain = [start]
        while chain[-1] in left:
            chain.append(left.pop(chain[-1]))
        chains.append(chain)
    at: dict[int, float] = {}
    ways, length = {}, 0.0
    for chain in chains:
        for a, b in pairwise(chain):
            step = own.points[b] - own.points[a]
            at.setdefault(a, length)
            ways[a] = ways[b] = step
            length += float(np.linalg.norm(step))
        at.setdefault(chain[-1], length)
    position = np.array([at[n] for n in nodes])
    forward = sum(float(ways[n] @ t) for n, t in zip(nodes, tangents[:, 0], strict=True))
    closed = len(chains) == 1 and chains[0][0] == chains[0][-1]
    position -= 0.5 * (length if closed else position.min() + position.max())
    return position if forward >= 0 else -position


def _steps(own: Facets) -> list[tuple[int, int]]:
    """From every node of a surface in the plane to the next, midside nodes between the ends."""
    out: list[tuple[int, int]] = []
    for group in own.groups:
        a, b, *middle = group.nodes.T
        for one, other in pairwise((a, *middle, b)):
            out += zip(one.tolist(), other.tolist(), strict=True)
    return out

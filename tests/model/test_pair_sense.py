"""A single pair whose sides are exchanged is seen; interfaces that bend or face each other are not blamed."""

from __future__ import annotations

import numpy as np
import pytest
import scipy.sparse as sp

from microslip.errors import InputError
from microslip.model.numbering import Numbering
from microslip.model.pair_sense import check_sense
from microslip.model.pair_table import Pairs

DIRECTIONS = {2: (1, 2), 3: (1, 2, 3)}


def chain(edges, nodes, d, link=None):
    """Stiffness of springs between nodes, alike in all directions; `link` joins two nodes weakly."""
    K = 1e-3 * np.eye(nodes)
    for i, j in edges:
        K[np.ix_([i, j], [i, j])] += [[1, -1], [-1, 1]]
    if link is not None:
        K[np.ix_(link, link)] += 0.1 * np.array([[1, -1], [-1, 1]])
    return sp.csc_matrix(np.kron(K, np.eye(d)))


def asked(points, normals, first, second, K, *, known=True):
    d = points.shape[1]
    labels = tuple((n + 1, k) for n in range(len(points)) for k in DIRECTIONS[d])
    numbering = Numbering(labels)
    m = len(normals)
    B = np.zeros((d * m, d * len(points)))
    for k in range(m):
        B[d * k, d * first[k] : d * (first[k] + 1)] = normals[k]
        B[d * k, d * second[k] : d * (second[k] + 1)] = -normals[k]
    zero = np.zeros(m)
    pairs = Pairs(np.arange(float(m)), zero + 1, zero, None, {}, normals, np.arange(m) + 1)
    places = np.repeat(points, d, axis=0) if known else None
    check_sense(sp.csr_matrix(B), K, numbering, places, pairs, "pairs.csv")


def arc(count, angle, d=2, radius=1.0):
    """A pin in its bore: nodes of the pin, then of the bore; normals out of the pin."""
    at = np.linspace(0.0, angle, count)
    normals = np.column_stack([np.cos(at), np.sin(at)] + [0 * at] * (d - 2))
    edges = [(k, k + 1) for k in range(count - 1)] + [(count - 1, 0)] * (angle > np.pi)
    edges += [(count + i, count + j) for i, j in edges]
    return np.vstack([radius * normals] * 2), normals, edges


SHAPES = {"flat": 1e-6, "saddle": np.pi, "bore": 11 / 6 * np.pi}


@pytest.mark.parametrize("linked", [False, True])
@pytest.mark.parametrize("known", [False, True])
@pytest.mark.parametrize("d", [2, 3])
@pytest.mark.parametrize("shape", SHAPES)
@pytest.mark.parametrize("wrong", [None, 0, 3, 11])
@pytest.mark.parametrize("count", [12])
def test_one_pair_of_a_curved_interface(shape, d, known, linked, wrong, count):
    """Whether the two bodies are joined elsewhere, and whether coordinates are known."""
    points, normals, edges = arc(count, SHAPES[shape], d, 1.0 if shape != "flat" else 1e6)
    K = chain(edges, 2 * count, d, [0, count + count // 2] if linked else None)
    first, second = np.arange(count), count + np.arange(count)
    if wrong is None:
        asked(points, normals, first, second, K, known=known)
        return
    exchanged = first.copy(), second.copy()
    exchanged[0][wrong], exchanged[1][wrong] = second[wrong], first[wrong]
    turned = normals.copy()
    turned[wrong] *= -1
    for arguments in ((normals, *exchanged), (turned, first, second)):
        with pytest.raises(InputError, match=f"row {wrong + 1}: the normal of this pair opposes"):
            asked(points, *arguments, K, known=known)


@pytest.mark.parametrize("order", [1, -1])
@pytest.mark.parametrize("known", [False, True])
@pytest.mark.parametrize("thickness", [0.0, 0.1, 0.5, 2.0])
@pytest.mark.parametrize("staggered", [0.0, 0.5])
def test_a_tongue_in_a_groove_is_right(order, known, thickness, staggered):
    """Normals out of the tongue are opposite above and below; its two faces share its material."""
    n = 9
    x = np.arange(n) * 1.0
    above, below = np.column_stack([x, x * 0 + thickness]), np.column_stack([x + staggered, x * 0])
    points = np.vstack([above, below, above, below])  # tongue above, below; groove above, below
    normals = np.vstack([np.tile([0.0, 1.0], (n, 1)), order * np.tile([0.0, -1.0], (n, 1))])
    edges = [(b * n + k, b * n + k + 1) for b in range(4) for k in range(n - 1)]
    edges += [(k, n + k) for k in range(n)] + [(3 * n - 1, 4 * n - 1)]
    first, second = np.arange(2 * n), np.arange(2 * n, 4 * n)
    if order < 0:
        first[n:], second[n:] = second[n:].copy(), first[n:].copy()
    asked(points, normals, first, second, chain(edges, 4 * n, 2), known=known)


def test_rows_of_a_patch_in_space():
    """A field of pairs: one in the middle, one at a corner, one at an edge."""
    x, y = (g.ravel() for g in np.meshgrid(np.arange(5.0), np.arange(4.0), indexing="ij"))
    face = np.column_stack([x, y, 0 * x])
    n = len(x)
    near = np.argwhere(np.linalg.norm(face[:, None] - face[None], axis=2) < 1.5)
    edges = [(i, j) for i, j in near if i < j]
    edges += [(n + i, n + j) for i, j in edges]
    normals = np.tile([0.0, 0.0, 1.0], (n, 1))
    K = chain(edges, 2 * n, 3)
    first, second = np.arange(n), n + np.arange(n)
    asked(np.vstack([face, face]), normals, first, second, K)
    for wrong in (0, 2, 9):
        turned = normals.copy()
        turned[wrong] *= -1
        with pytest.raises(InputError, match=f"row {wrong + 1}:"):
            asked(np.vstack([face, face]), turned, first, second, K)

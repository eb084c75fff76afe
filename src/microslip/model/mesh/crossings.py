"""Where segments pass through simplices: edges of one body through the outside faces of another.

In d dimensions a segment from p to q meets a simplex with corners c_0 ... c_{d-1} where

    p + t (q - p) = c_0 + sum_k s_k (c_k - c_0),   0 <= t <= 1,   s_k >= 0,   sum s_k <= 1,

d equations for t and the s_k. Between two consecutive places an edge is inside the body or outside.
"""

from __future__ import annotations

import numpy as np
import scipy.spatial

from microslip.typing import Array, Indices

PARALLEL = 1e-12
"""Of the product of the lengths: a smaller determinant is that of a segment along a simplex."""

ROUNDING = 1e-9
"""Of a segment and a simplex: so far beyond its ends it still meets."""


def midway(segments: Array, pieces: Array) -> tuple[Array, Array]:
    """Points half way between the consecutive places where segments pass through simplices.

    Parameters
    ----------
    segments : (e, 2, d) array
    pieces : (f, d, d) array
        Corners of segments in the plane, of triangles in space.

    Returns
    -------
    (p, d) array, (p,) array
        The points, and how far the two places are apart.

    Examples
    --------
    >>> across = np.array([[[-2.0, 0.5], [2.0, 0.5]]])
    >>> walls = np.array([[[-1.0, 0.0], [-1.0, 1.0]], [[1.0, 0.0], [1.0, 1.0]]])
    >>> midway(across, walls)[0].tolist()
    [[0.0, 0.5]]
    """
    d = segments.shape[2]
    segment, piece = _near(segments, pieces)
    if not len(segment):
        return np.zeros((0, d)), np.zeros(0)
    start, along = segments[:, 0], segments[:, 1] - segments[:, 0]
    corner = pieces[piece, 0]
    sides = pieces[piece, 1:] - corner[:, None]
    system = np.concatenate([along[segment][:, None], -sides], axis=1).transpose(0, 2, 1)
    size = np.linalg.norm(along[segment], axis=1) * np.linalg.norm(sides, axis=2).prod(axis=1)
    across = np.abs(np.linalg.det(system)) > PARALLEL * size
    segment, system = segment[across], system[across]
    found = np.linalg.solve(system, (corner[across] - start[segment])[..., None])[..., 0]
    t, s = found[:, 0], found[:, 1:]
    meets = (t >= -ROUNDING) & (t <= 1 + ROUNDING)
    meets &= (s >= -ROUNDING).all(axis=1) & (s.sum(axis=1) <= 1 + ROUNDING)
    segment, t = segment[meets], t[meets]
    order = np.lexsort((t, segment))
    segment, t = segment[order], t[order]
    same = segment[1:] == segment[:-1]
    own = segment[1:][same]
    middle, length = 0.5 * (t[1:] + t[:-1])[same], (t[1:] - t[:-1])[same]
    return (
        start[own] + middle[:, None] * along[own],
        length * np.linalg.norm(along[own], axis=1),
    )


def _near(segments: Array, pieces: Array) -> tuple[Indices, Indices]:
    """Segments and simplices whose spheres meet, pair by pair."""
    none = np.zeros(0, dtype=np.int64)
    if not len(segments) or not len(pieces):
        return none, none
    middle, centre = segments.mean(axis=1), pieces.mean(axis=1)
    reach = 0.5 * np.linalg.norm(segments[:, 1] - segments[:, 0], axis=1)
    radius = np.linalg.norm(pieces - centre[:, None], axis=2).max(axis=1)
    tree = scipy.spatial.cKDTree(centre)
    found = tree.query_ball_point(middle, reach + radius.max())
    segment = np.repeat(np.arange(len(segments)), [len(each) for each in found])
    piece = np.concatenate([np.asarray(each, dtype=np.int64) for each in found])
    apart = np.linalg.norm(middle[segment] - centre[piece], axis=1)
    close = apart <= reach[segment] + radius[piece]
    return segment[close], piece[close]

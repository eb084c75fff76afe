"""What two lines, or two triangles, have in common: many at once."""

from __future__ import annotations

import numpy as np

from microslip.typing import Array, Indices

PART = 1e-10
"""Of its own size: what is shared to a smaller part is not shared."""


def common_intervals(first: Array, second: Array) -> tuple[Array, Indices]:
    """Intervals that pairs of intervals share.

    Parameters
    ----------
    first, second : (p, 2) arrays
        Ends in any order.

    Returns
    -------
    (s, 2, 1) array
        Ends of the shared ones.
    (s,) int array
        Pair of each.

    Examples
    --------
    >>> common_intervals(np.array([[0.0, 1.0], [0.0, 1.0]]), np.array([[3.0, 0.4], [1.0, 2.0]]))
    (array([[[0.4],
            [1. ]]]), array([0]))
    """
    low = np.maximum(first.min(axis=1), second.min(axis=1))
    high = np.minimum(first.max(axis=1), second.max(axis=1))
    pairs = np.flatnonzero(high - low > PART * np.ptp(first, axis=1))
    return np.stack([low, high], axis=1)[pairs][:, :, None], pairs


def common_triangles(first: Array, second: Array) -> tuple[Array, Indices]:
    """Triangles that what pairs of triangles share is made of.

    The second triangle is clipped by the sides of the first (Sutherland & Hodgman, Communications of
    the ACM 17 (1974) 32), and the polygon cut into triangles from its first corner.

    Parameters
    ----------
    first, second : (p, 3, 2) arrays
        Corners, counter-clockwise.

    Returns
    -------
    (s, 3, 2) array
    (s,) int array
        Pair of each.

    Examples
    --------
    >>> one = np.array([[[0.0, 0.0], [1.0, 0.0], [0.0, 1.0]]])
    >>> parts, pairs = common_triangles(one, np.array([[[0.5, -1.0], [2.0, -1.0], [0.5, 2.0]]]))
    >>> round(float(np.sum(twice_areas(parts)) / 2), 12)
    0.125
    """
    polygon, count = second, np.full(len(second), 3)
    for k in range(3):
        polygon, count = _clipped(polygon, count, first[:, k], first[:, (k + 1) % 3])
    parts, pairs = [], []
    whole = twice_areas(first)
    for k in range(1, polygon.shape[1] - 1):
        at = np.flatnonzero(count > k + 1)
        triangle = polygon[at][:, [0, k, k + 1]]
        large = twice_areas(triangle) > PART * whole[at]
        parts.append(triangle[large])
        pairs.append(at[large])
    return np.concatenate(parts), np.concatenate(pairs)


def _clipped(polygon: Array, count: Indices, start: Array, end: Array) -> tuple[Array, Indices]:
    """The part of polygons (p, v, 2), of which the first `count` corners count, left of lines."""
    p, v, _ = polygon.shape
    k = np.arange(v)
    following = np.where(k + 1 < count[:, None], k + 1, 0)
    to = np.take_along_axis(polygon, following[:, :, None], axis=1)
    side = _cross((end - start)[:, None], polygon - start[:, None])
    other = np.take_along_axis(side, following, axis=1)
    valid = k < count[:, None]
    keep = valid & (side >= 0)
    cut = valid & ((side >= 0) != (other >= 0))
    share = side / np.where(cut, side - other, 1.0)
    crossing = polygon + share[:, :, None] * (to - polygon)
    points = np.stack([polygon, crossing], axis=2).reshape(p, 2 * v, 2)
    mask = np.stack([keep, cut], axis=2).reshape(p, 2 * v)
    counts = mask.sum(axis=1)
    order = np.argsort(~mask, axis=1, kind="stable")[:, : max(int(counts.max(initial=0)), 3)]
    return np.take_along_axis(points, order[:, :, None], axis=1), counts


def _cross(a: Array, b: Array) -> Array:
    return np.asarray(a[..., 0] * b[..., 1] - a[..., 1] * b[..., 0])


def twice_areas(triangles: Array) -> Array:
    """Twice the signed areas of (p, 3, 2) triangles."""
    return _cross(triangles[:, 1] - triangles[:, 0], triangles[:, 2] - triangles[:, 0])

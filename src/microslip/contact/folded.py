"""Product of a symmetric matrix that is its own image with a vector, from half as many numbers.

Where a permutation S with S² = 1, as the half turn of a joint, leaves W = S W S as it is, the sums and the
differences of what S exchanges do not mix,

    (W r)_a = E (r_a + r_b) + O (r_a - r_b),      (W r)_b = E (r_a + r_b) - O (r_a - r_b),
    E = (W_aa + W_ab) / 2,      O = (W_aa - W_ab) / 2,

with a the first and b = S a the second of each two. What stays where it is counts among both, and so with
half of its row and of its column in E. Both are symmetric, and have together half of the entries of W.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from microslip.contact.compiled import jit
from microslip.contact.pairs import components
from microslip.contact.symmetric import symmetric_product
from microslip.numerics.alike import alike
from microslip.typing import Array, Indices

ROUNDING = 1e-13
"""Difference of a matrix and its image, over the largest entry, up to which they are the same."""

WIDE = 160
"""Rows from which on two small products are quicker than one: fewer fit the cache beside the core."""


class Folded(NamedTuple):
    """A matrix by what S does to its rows; nothing where it is not taken apart.

    Attributes
    ----------
    even, odd : (e, e) and (o, o) arrays
        E and O; e - o rows stay where they are.
    first, second : (e,) int arrays
        a and b, those that stay last.
    """

    even: Array
    odd: Array
    first: NDArray[np.int64]
    second: NDArray[np.int64]


@jit
def nothing_folded():
    """Of a matrix that is not taken apart."""
    return Folded(np.zeros((0, 0)), np.zeros((0, 0)), np.zeros(0, np.int64), np.zeros(0, np.int64))


NOT_FOLDED = nothing_folded()


def folded(W: Array, image: Indices | None) -> Folded:
    """A symmetric matrix taken apart, or `NOT_FOLDED` where it is not its own image or that does not pay.

    Parameters
    ----------
    W : (n, n) array
    image : (m,) int array or None
        Image of every pair, whose components are their own.

    Examples
    --------
    >>> W, swap = np.full((200, 200), 2.0) + np.eye(200), np.arange(100)[::-1]
    >>> half = folded(W, swap)
    >>> half.even.shape, half.odd.shape, float(half.even[0, 0]), float(half.odd[0, 1])
    ((100, 100), (100, 100), 2.5, 0.0)
    >>> len(folded(np.diag(np.arange(200.0)), swap).even)
    0
    """
    if image is None or len(W) < WIDE:
        return NOT_FOLDED
    rows, own = components(image, len(W) // len(image)), np.arange(len(W))
    if not alike(W, W[np.ix_(rows, rows)], ROUNDING):
        return NOT_FOLDED
    moved, alone = own[own < rows], own[own == rows]
    first = np.concatenate([moved, alone])
    second, k = rows[first], len(moved)
    share = np.where(np.arange(len(first)) < k, 1.0, 0.5)
    to_first, to_second = W[np.ix_(first, first)], W[np.ix_(first, second)]
    even = 0.5 * np.outer(share, share) * (to_first + to_second)
    odd = 0.5 * (to_first - to_second)[:k, :k]
    even, odd = (np.ascontiguousarray(0.5 * (M + M.T)) for M in (even, odd))
    return Folded(even, odd, first.astype(np.int64), second.astype(np.int64))


@jit
def product(W, parts, r, out):
    """``out = W @ r``, of a symmetric W by its parts where it has been taken apart."""
    n, k = parts.even.shape[0], parts.odd.shape[0]
    if n == 0:
        symmetric_product(W, r, out)
        return
    first, second = parts.first, parts.second
    added, taken = np.empty(n), np.empty(k)
    even, odd = np.empty(n), np.empty(k)
    for i in range(n):
        added[i] = r[first[i]] + r[second[i]]
    for i in range(k):
        taken[i] = r[first[i]] - r[second[i]]
    symmetric_product(parts.even, added, even)
    symmetric_product(parts.odd, taken, odd)
    for i in range(k):
        out[first[i]] = even[i] + odd[i]
        out[second[i]] = even[i] - odd[i]
    for i in range(k, n):
        out[first[i]] = 2.0 * even[i]

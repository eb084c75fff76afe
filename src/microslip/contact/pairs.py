"""Contact pairs in arrays: where a component stands, and the numbers of the contact states.

Relative displacements ``v`` and reactions ``r`` of m pairs are one vector of ``d m`` components,
pair by pair: the normal one first, then the ``d - 1`` tangential ones. ``v_n`` is positive where it
closes the gap (contact: ``v_n = 0``, separation: ``v_n < 0``), ``v_t`` is the tangential motion of
the upper body relative to the lower; ``r_n >= 0`` in compression. Time, load steps or coefficients
come before: ``(..., d m)``. Matrices whose rows are components are cut with `normal_rows` and
`tangential_rows`.

Functions without a parameter `dimension` are planar: d = 2, one tangential direction.
"""

from __future__ import annotations

from typing import TypeVar

import numpy as np
from numpy.typing import NDArray

from microslip.typing import Array, Indices, Mask, Status

STICK, FORWARD, BACKWARD, SEPARATED = 1, 2, 3, 4
"""Contact states, numbered as in the paper's figure 5."""

SLIP = FORWARD
"""Slip of a spatial pair, whatever its direction."""

T = TypeVar("T", bound=np.generic)


def normal_rows(dimension: int = 2) -> slice:
    """Where the normal components stand among all."""
    return slice(0, None, dimension)


def tangential_rows() -> slice:
    """Where the tangential components of planar pairs stand among all."""
    return slice(1, None, 2)


def normal(x: NDArray[T], dimension: int = 2) -> NDArray[T]:
    """Normal components, (..., m), of (..., d m); a view.

    Examples
    --------
    >>> normal(np.array([1.0, 10.0, 2.0, 20.0]))
    array([1., 2.])
    """
    return x[..., ::dimension]


def tangential(x: NDArray[T]) -> NDArray[T]:
    """Tangential components, (..., m), of planar pairs, (..., 2 m); a view.

    Examples
    --------
    >>> tangential(np.array([1.0, 10.0, 2.0, 20.0]))
    array([10., 20.])
    """
    return x[..., 1::2]


def tangential_vectors(x: NDArray[T], dimension: int = 3) -> NDArray[T]:
    """Tangential components, (..., m, d - 1), of (..., d m), of spatial pairs unless said; a view.

    Examples
    --------
    >>> tangential_vectors(np.array([1.0, 10.0, 20.0, 2.0, 30.0, 40.0]))
    array([[10., 20.],
           [30., 40.]])
    """
    return by_pair(x, dimension)[..., 1:]


def mean_slip(v: Array, dimension: int) -> Array:
    """Where bodies stand past each other, (d - 1,): mean over the pairs of relative displacements (d m,).

    Examples
    --------
    >>> mean_slip(np.array([0.0, 1.0, 0.0, 3.0]), 2)
    array([2.])
    """
    return np.asarray(tangential_vectors(v, dimension).mean(axis=0))


def slip_history(v: Array, dimension: int) -> Array:
    """Tangential displacements at which pairs stick, to be changed from step to step.

    (m,) of planar pairs, (m, 2) of spatial ones; a copy.
    """
    return (tangential(v) if dimension == 2 else tangential_vectors(v)).copy()


def by_pair(x: NDArray[T], dimension: int = 2) -> NDArray[T]:
    """(..., m, d) view of (..., d m): the components of each pair together."""
    return x.reshape(*x.shape[:-1], x.shape[-1] // dimension, dimension)


def components(pairs: Indices, dimension: int = 2) -> Indices:
    """Places of all components of the given pairs, in the order of the pairs.

    Examples
    --------
    >>> components(np.array([0, 2]))
    array([0, 1, 4, 5])
    """
    return np.asarray((dimension * np.asarray(pairs)[:, None] + np.arange(dimension)).ravel())


def normal_components(pairs: Indices, dimension: int = 2) -> Indices:
    """Places of the normal components of the given pairs."""
    return np.asarray(dimension * np.asarray(pairs))


def touches(status: Status) -> Mask:
    """Which pairs (or pairs and steps) are not separated."""
    return np.asarray(status != SEPARATED)


def at_rest(touching: Mask) -> Status:
    """States to start from: those that touch stick.

    Examples
    --------
    >>> at_rest(np.array([True, False])).tolist()
    [1, 4]
    """
    return np.where(touching, STICK, SEPARATED).astype(np.int8)

"""How often each fallback of the contact solvers acts."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import astuple, dataclass
from typing import TypeVar

import numpy as np
from numpy.typing import NDArray


@dataclass(frozen=True)
class Counts:
    """Numbers of contact problems or load steps by how they were solved, each by its dearest way."""

    plain: int = 0

    @property
    def steps(self) -> int:
        """All of them."""
        return sum(astuple(self))

    @property
    def hard(self) -> int:
        """Those that needed a fallback."""
        return self.steps - self.plain


@dataclass(frozen=True)
class Fallbacks(Counts):
    """Counts of the planar solver.

    Attributes
    ----------
    plain, worst, least_index : int
        By the active set: all violated pairs change state, the worst alone, the first alone.
    halved : int
        Load steps that were halved.
    lemke : int
        By Lemke's method.
    unsolved : int
    """

    worst: int = 0
    least_index: int = 0
    halved: int = 0
    lemke: int = 0
    unsolved: int = 0


@dataclass(frozen=True)
class SpatialFallbacks(Counts):
    """Counts of the spatial solver.

    Attributes
    ----------
    plain, rescaled : int
        By Newton's method, with the pairs' own scales or with others.
    parts, extragradient, proximal : int
        By Newton's method started from parts of the load, from extragradient iterations, from
        proximal points.
    halved : int
        Load steps that were halved.
    faceted : int
        By Newton's method started from cones of facets.
    unsolved : int
    """

    rescaled: int = 0
    parts: int = 0
    extragradient: int = 0
    proximal: int = 0
    halved: int = 0
    faceted: int = 0
    unsolved: int = 0


C = TypeVar("C", bound=Counts)


def fallbacks(count: NDArray[np.int64], dimension: int = 2) -> Counts:
    """Name counts that are numbered as the rules of `active_set.py`, or of `spatial.py`."""
    kind = Fallbacks if dimension == 2 else SpatialFallbacks
    return kind(*map(int, count))


def together(found: Iterable[C]) -> C:
    """Sum of several of one kind.

    Examples
    --------
    >>> together([Fallbacks(plain=5, lemke=1), Fallbacks(plain=2)]).steps
    8
    """
    counts = list(found)
    return type(counts[0])(*(sum(numbers) for numbers in zip(*map(astuple, counts), strict=True)))

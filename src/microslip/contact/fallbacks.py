"""How often each fallback of the contact solver acts."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import astuple, dataclass

import numpy as np
from numpy.typing import NDArray


@dataclass(frozen=True)
class Fallbacks:
    """Numbers of contact problems or load steps by how they were solved, each by its dearest way.

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

    plain: int = 0
    worst: int = 0
    least_index: int = 0
    halved: int = 0
    lemke: int = 0
    unsolved: int = 0

    @property
    def steps(self) -> int:
        """All of them."""
        return sum(astuple(self))

    @property
    def hard(self) -> int:
        """Those that needed a fallback."""
        return self.steps - self.plain


def fallbacks(count: NDArray[np.int64]) -> Fallbacks:
    """Name counts that are numbered as the rules of `active_set.py`."""
    return Fallbacks(*map(int, count))


def together(found: Iterable[Fallbacks]) -> Fallbacks:
    """Sum of several.

    Examples
    --------
    >>> together([Fallbacks(plain=5, lemke=1), Fallbacks(plain=2)]).steps
    8
    """
    return Fallbacks(*(sum(numbers) for numbers in zip(*map(astuple, found), strict=True)))

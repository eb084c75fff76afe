"""Whether two arrays are the same but for rounding."""

from __future__ import annotations

import numpy as np

from microslip.typing import Array


def alike(a: Array, b: Array, within: float) -> bool:
    """Whether the largest difference is at most `within` of the largest entry of the first.

    Parameters
    ----------
    a, b : arrays of one shape
    within : float

    Examples
    --------
    >>> alike(np.array([1.0, 100.0]), np.array([1.5, 100.0]), 0.01)
    True
    >>> alike(np.array([1.0, 100.0]), np.array([1.0, 102.0]), 0.01)
    False
    """
    return bool(np.abs(a - b).max(initial=0.0) <= within * np.abs(a).max(initial=0.0))

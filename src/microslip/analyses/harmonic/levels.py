"""Levels of harmonics, and the error of an amplitude by those up to it.

With ``d_k`` the change of the amplitude from one level H_k to the next (`points.distance`),

    e_k = max(d_k / ((H_k / H_{k-1})^p - 1), d_{k-1} / ((H_k / H_{k-2})^p - (H_k / H_{k-1})^p), s t_k)

the sum of all changes to come if they fall as ``H^-p``, from the last change and from the one before it;
and a share s of the tail t_k, what the last two harmonics hold of the vibrating reactions: while it is
large the amplitude may stand still far from its limit.
"""

from __future__ import annotations

from collections.abc import Sequence
from itertools import pairwise

from microslip.analyses.harmonic.points import distance

ADDED = 4
"""Harmonics added at a time, at least."""

GROWTH = 0.25
"""Share of the harmonics that is added at a time where that is more."""

ORDER = 1.5
"""Power p of 1/H that the estimate of the error supposes."""

TAIL_SHARE = 0.1
"""Share s of the tail that the estimate of the error is at least."""


def more_harmonics(harmonics: int) -> int:
    """Harmonics of the next level.

    Examples
    --------
    >>> levels = [5]
    >>> while levels[-1] < 45:
    ...     levels.append(more_harmonics(levels[-1]))
    >>> levels
    [5, 9, 13, 17, 21, 27, 33, 41, 51]
    """
    return harmonics + max(ADDED, 2 * round(0.5 * GROWTH * harmonics))


def estimated_error(levels: Sequence[tuple[int, complex]], tail: float = 0.0) -> float:
    """Relative error of the last amplitude of levels (H, amplitude); nan of a single one.

    Parameters
    ----------
    levels : sequence of (int, complex)
    tail : float
        Of the last level (`HarmonicPoint.tail`).

    Examples
    --------
    Errors that fall as the square of 1/H are less than the estimate:

    >>> levels = [(H, 1 + 1 / H**2) for H in (5, 9, 13)]
    >>> bool(1 / 13**2 < estimated_error(levels) < 3 / 13**2)
    True
    """
    window, last = levels[-3:], levels[-1][0]
    estimates = []
    for (H_0, A_0), (H_1, A_1) in pairwise(window):
        left = (last / H_0) ** ORDER - (last / H_1) ** ORDER
        estimates.append(distance(A_0, A_1) / left)
    return max([*estimates, TAIL_SHARE * tail]) if estimates else float("nan")

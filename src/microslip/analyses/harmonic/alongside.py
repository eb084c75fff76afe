"""A response with more harmonics by way of its neighbours on the branch.

At one frequency Newton's method may find no answer with more harmonics although there is one: too many
contact states change at once, even from a cycle over time. Along a branch few change from point to point.
So where the branch with few harmonics passes the frequency, its points farther and farther away are asked
until more harmonics have an answer there, and the branch with more harmonics is followed from it to the
frequency. Where it turns round before, it has no such response there.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, replace
from itertools import zip_longest

import numpy as np

from microslip.analyses.harmonic.paths import CONTROL, FrequencyPath
from microslip.brief import Brief
from microslip.numerics.continuation import (
    Branch,
    BranchPoint,
    ContinuationError,
    first_point,
    trace,
)
from microslip.typing import Array

STEPS = replace(CONTROL, first=0.1, smallest=2e-3, max_iterations=10, patience=4, max_points=50)
"""From a neighbour to the frequency: given up early, since there are other neighbours."""

NEAREST = 4
"""Points of the branch to the first neighbour: those next to the frequency have its states, too."""


@dataclass(frozen=True, repr=False)
class Place(Brief):
    """Where a branch with few harmonics passes a frequency.

    Attributes
    ----------
    path : FrequencyPath
    branch : Branch
    index : int
        Of the point before.
    frequency : float
        Hz.
    """

    path: FrequencyPath
    branch: Branch
    index: int
    frequency: float

    def neighbours(self) -> Iterator[BranchPoint]:
        """Points of the branch 4, 8, 16 ... points away on both sides, as far as it does not turn round.

        The last before it turns, or ends, too.
        """
        points = self.branch.points
        before, after = points[self.index :: -1], points[self.index + 1 :]
        for pair in zip_longest(self._ever_farther(before), self._ever_farther(after)):
            yield from (point for point in pair if point is not None)

    def _ever_farther(self, points: tuple[BranchPoint, ...]) -> Iterator[BranchPoint]:
        away = np.array([point.p - self.frequency for point in points])
        side = np.sign(away[np.argmax(away != 0)]) if len(away) else 1.0
        turned = np.flatnonzero(np.diff(side * away) <= 0)
        straight = int(turned[0]) + 1 if len(turned) else len(points)
        number = min(NEAREST, straight)
        while straight > 0:
            if away[number - 1] != 0:
                yield points[number - 1]
            if number == straight:
                break
            number = min(2 * number, straight)


def followed(path: FrequencyPath, w: Array, start: float, end: float) -> Array:
    """Unknowns at one frequency on the branch through an answer at another.

    Parameters
    ----------
    path : FrequencyPath
    w : (n,) array
        The answer.
    start, end : float
        Hz.

    Raises
    ------
    ContinuationError
        Where the branch does not get there.
    """
    first = first_point(path, w, start, STEPS, np.sign(end - start))
    branch = trace(path, first, (min(start, end), max(start, end)), STEPS)
    last = branch.points[-1]
    if last.p != end:
        turns = [f"{branch.points[index].p:.6g} Hz" for index in branch.folds]
        where = f"turns round at {turns[0]}" if turns else branch.ended
        raise ContinuationError(
            f"the branch from {start:.6g} Hz does not get to {end:.6g} Hz: {where}"
        )
    return last.u

"""Answers with many harmonics by a balance of the modes alone, for one response on its way to them.

The flexibility that harmonics left out are taken to have is tried as it is, and softer: with a softer one
contact is gentler and Newton's method gets farther.
"""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import suppress

from microslip.analyses.harmonic.answers import Answers
from microslip.analyses.harmonic.climb import Climb
from microslip.analyses.harmonic.losses import Losses
from microslip.analyses.harmonic.over_time import LEFT
from microslip.analyses.harmonic.points import HarmonicPoint, distance
from microslip.analyses.time.steady import SteadyState
from microslip.numerics.continuation import ContinuationError

SOFTER = (1.0, 16.0)
"""Of the flexibility that harmonics left out have, over what it is taken for."""

COSTLY = 41
"""Harmonics beyond which only the softest is tried, from which Newton's method gets farthest."""

MOST, USUAL = 24.0, 33
"""Balances under one load that may find nothing; harmonics up to which one counts as one."""


class Balances:
    """Balances of the modes under one load, and how many of them have found nothing.

    Parameters
    ----------
    answers : Answers
    """

    def __init__(self, answers: Answers) -> None:
        self.answers = answers
        self.losses = Losses(MOST, USUAL)

    def of(self, climb: Climb, harmonics: int, began: float) -> Iterator[HarmonicPoint]:
        """The same response with other harmonics, with each of the flexibilities that has one.

        From the motion over time, where there is one, and otherwise from the answer with most harmonics.
        """
        cycle = climb.cycle
        near = climb.last.amplitude if cycle is None else cycle.amplitude
        few = harmonics <= COSTLY
        for softer in SOFTER if few else SOFTER[-1:]:
            answer = None
            if cycle is not None:
                answer = self._tried(cycle, softer, near, harmonics, began)
            if answer is None and (few or cycle is None):
                answer = self._tried(climb.last, softer, near, harmonics, began)
            if answer is not None:
                yield answer

    def beside(self, steady: SteadyState, harmonics: int, began: float) -> Iterator[HarmonicPoint]:
        """Responses next to a cycle over time, with each of the flexibilities that has one."""
        for softer in SOFTER:
            answer = self._tried(steady, softer, steady.amplitude, harmonics, began)
            if answer is not None:
                yield answer

    def _tried(
        self,
        known: HarmonicPoint | SteadyState,
        softer: float,
        near: complex,
        harmonics: int,
        began: float,
    ) -> HarmonicPoint | None:
        """The response from a start; None where there is none, or another."""
        if not self.losses.allow(harmonics):
            return None
        with suppress(ContinuationError):
            answer = self.answers.by_modes(known, harmonics, began, softer)
            if distance(answer.amplitude, near) <= LEFT:
                return answer
        self.losses.add(harmonics)
        return None

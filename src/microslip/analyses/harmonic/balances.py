"""Answers with many harmonics by a balance of the modes alone, for one response on its way to them.

With a softer flexibility of the harmonics left out contact is gentler, and Newton's method gets farther. So
it is solved first, and taken to stiffer ones, each from the one before, down to the flexibility as it is. Or
one flexibility is asked alone: where contact is rough, chance decides what finds an answer. From an answer
with a few harmonics fewer the way is short: a cycle over time that is cut off is much farther from one.
"""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import suppress

from microslip.analyses.harmonic.answers import Answers, Known
from microslip.analyses.harmonic.losses import Losses
from microslip.analyses.harmonic.over_time import LEFT
from microslip.analyses.harmonic.points import HarmonicPoint, distance
from microslip.numerics.continuation import ContinuationError

SOFT, SOFTEST = 16.0, 64.0
"""Of the flexibility that harmonics left out have, over what it is taken for."""

STIFFER = (4.0, 1.0)
"""The same from there on."""

AT_ONCE = (1.0, 2.0)
"""Those from which an answer is looked for from the one before, and with every number of harmonics."""

MOST, USUAL = 60.0, 33
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

    @property
    def apply(self) -> bool:
        """Whether modes can be balanced alone: their damping does not couple them."""
        return self.answers.base.problem.model.damping is None

    def at_once(
        self, known: Known, harmonics: int, began: float, softer: float
    ) -> Iterator[HarmonicPoint]:
        """The response next to an answer or a cycle over time with one flexibility, if it has any."""
        if self.apply:
            answer = self._tried(known, softer, known.amplitude, harmonics, began)
            if answer is not None:
                yield answer

    def onward(self, answer: HarmonicPoint, harmonics: int, began: float) -> HarmonicPoint | None:
        """The response of an answer with some harmonics more, with the first flexibility that has it."""
        if self.apply:
            for softer in AT_ONCE:
                found = self._tried(answer, softer, answer.amplitude, harmonics, began)
                if found is not None:
                    return found
        return None

    def softly(self, known: Known, harmonics: int, began: float) -> Iterator[HarmonicPoint]:
        """The same with each of the flexibilities that has one.

        A soft one, or the softest and then that; stiffer ones, each from the one before.
        """
        if not self.apply:
            return
        near = known.amplitude
        answer = self._tried(known, SOFT, near, harmonics, began)
        if answer is None:
            softest = self._tried(known, SOFTEST, near, harmonics, began)
            if softest is not None:
                answer = self._tried(softest, SOFT, near, harmonics, began)
        for softer in STIFFER:
            if answer is None:
                return
            yield answer
            answer = self._tried(answer, softer, near, harmonics, began)
        if answer is not None:
            yield answer

    def _tried(
        self,
        known: Known,
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

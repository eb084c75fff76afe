"""Answers with many harmonics by way of rounded contact laws, for one response on its way to them."""

from __future__ import annotations

from contextlib import suppress

from microslip.analyses.harmonic.answers import Answers
from microslip.analyses.harmonic.climb import COMPARED, Climb
from microslip.analyses.harmonic.losses import Losses
from microslip.analyses.harmonic.points import HarmonicPoint
from microslip.analyses.harmonic.problem import HarmonicProblem, softened
from microslip.analyses.harmonic.rounded import RoundedAnswer
from microslip.analyses.harmonic.starts import augmentations, flexibility_of_cycle
from microslip.numerics.continuation import ContinuationError

AUGMENTATIONS = 2
"""Augmentations tried with many harmonics, the likeliest first."""


class Roundings:
    """Ways by rounded contact laws under one load, and how many of them have led nowhere.

    Parameters
    ----------
    answers : Answers
    """

    def __init__(self, answers: Answers) -> None:
        self.answers = answers
        self.losses = Losses()

    def of(self, climb: Climb) -> RoundedAnswer | None:
        """The best answer with few harmonics, the cheapest to round, with rounded laws.

        Only where there is a motion over time beside the response, which says what is best.
        """
        if climb.beside is not None and climb.unrounded:
            climb.unrounded = False
            few = [answer for answer in climb.answers if answer.harmonics <= COMPARED]
            least = min(few, key=climb.beside.error_of, default=climb.last)
            with suppress(ContinuationError):
                climb.rounded = self.answers.rounded(least)
        return climb.rounded

    def answer(self, new: HarmonicProblem, climb: Climb, began: float) -> HarmonicPoint | None:
        """The response with other harmonics, with the likeliest augmentations; None where none is found."""
        known = self.of(climb)
        if known is None:
            return None
        assert climb.cycle is not None
        factors = augmentations(flexibility_of_cycle(new, climb.cycle))[:AUGMENTATIONS]
        for factor in factors:
            if not self.losses.allow(1):
                break
            with suppress(ContinuationError):
                found = self.answers.from_rounded(
                    softened(new, factor), known, climb.last.frequency, began, climb.last
                )
                if not climb.left_by(found):
                    return found
            self.losses.add(1)  # once, whatever it costs
        return None

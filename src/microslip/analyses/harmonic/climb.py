"""One response on its way to more harmonics: what is known of it so far."""

from __future__ import annotations

from dataclasses import dataclass, replace

from microslip.analyses.harmonic.alongside import Place
from microslip.analyses.harmonic.answers import Known
from microslip.analyses.harmonic.over_time import LEFT, MotionBeside
from microslip.analyses.harmonic.points import HarmonicPoint, distance
from microslip.analyses.time.steady import SteadyState

COMPARED = 13
"""Harmonics that count as few: time integration that has left the response with the fewest is asked again
with these, and once more with the most."""

IN_VAIN = 2
"""Times without an answer after which a climb has no such patience any more."""


@dataclass
class Climb:
    """One response on its way to more harmonics.

    Attributes
    ----------
    answers : list of HarmonicPoint
        With more and more harmonics, at least one.
    beside : MotionBeside or None
        The motion that time integration makes of it.
    steady : SteadyState or None
        A cycle that the response was looked for from.
    place : Place or None
        On a branch with few harmonics; None as well once its neighbours have not led to more.
    neighbour : HarmonicPoint or None
        The point of that branch that has led to more, with as many.
    best : HarmonicPoint
        The answer with the smallest error.
    asked : int
        Harmonics of the answer whose motion over time that is.
    sure : int
        Harmonics of the answer that was found good enough beside motions from its own state; 0 before.
    missed : int
        Times that Newton's method has found no answer from any start.
    """

    answers: list[HarmonicPoint]
    beside: MotionBeside | None
    steady: SteadyState | None
    place: Place | None = None
    neighbour: HarmonicPoint | None = None

    def __post_init__(self) -> None:
        self.best = self.last
        self.asked = self.last.harmonics
        self.sure = self.missed = 0

    def add(self, answer: HarmonicPoint) -> None:
        """Take down an answer, in the order of harmonics."""
        self.answers.append(answer)
        self.answers.sort(key=lambda each: each.harmonics)

    @property
    def last(self) -> HarmonicPoint:
        """The answer with the most harmonics."""
        return self.answers[-1]

    @property
    def levels(self) -> list[tuple[int, complex]]:
        """Harmonics and amplitude of the answers."""
        return [(answer.harmonics, answer.amplitude) for answer in self.answers]

    @property
    def cycle(self) -> SteadyState | None:
        """Cycle to start other harmonics from."""
        return self.steady if self.beside is None else self.beside.steady

    @property
    def known(self) -> Known:
        """That cycle, or where there is none the answer with the most harmonics."""
        return self.last if self.cycle is None else self.cycle

    @property
    def patient(self) -> bool:
        """Whether Newton's method may take long from a start over time: where it has helped."""
        return self.beside is not None and self.missed < IN_VAIN

    @property
    def measurable(self) -> bool:
        """Whether a motion over time can tell that more harmonics are better than the best so far."""
        return self.beside is not None and self.beside.tells(self.best.amplitude)

    def stand_beside(self, answer: HarmonicPoint, motion: MotionBeside) -> None:
        """Take a motion for that of the response, and an answer for the best beside it."""
        self.beside, self.asked = motion, answer.harmonics
        self.best = replace(answer, error=motion.error_of(answer))

    def left_by(self, found: HarmonicPoint) -> bool:
        """Whether an answer is that of another response."""
        known = self.last.amplitude if self.cycle is None else self.cycle.amplitude
        return distance(found.amplitude, known) > LEFT

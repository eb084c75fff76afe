"""Answers of Newton's method with any number of harmonics, from starts of every kind.

Each number of harmonics, held or walking, has a path of its own, whose factorisations the next answer takes
over.
"""

from __future__ import annotations

import time as clock
from collections.abc import Iterator
from contextlib import suppress
from dataclasses import replace

from microslip.analyses.harmonic.all_pairs import of_all_pairs, unfolded
from microslip.analyses.harmonic.modal_answers import balanced
from microslip.analyses.harmonic.paths import EquationsAt, FrequencyPath
from microslip.analyses.harmonic.points import HarmonicPoint, describe
from microslip.analyses.harmonic.problem import HarmonicProblem, with_harmonics
from microslip.analyses.harmonic.starts import (
    Start,
    first_step,
    start_from_cycle,
    starts_from_point,
)
from microslip.analyses.time.steady import SteadyState
from microslip.numerics.continuation import ContinuationError, StepControl, solve_at
from microslip.typing import Array

Known = HarmonicPoint | SteadyState
"""What other harmonics are looked for from: an answer, or a cycle over time."""

Allowed = tuple[int, int]
"""Steps of Newton's method before a start is given up, and of these, those in which the residual has to fall
to a half."""

ELSEWHERE, BESIDE = (20, 5), (40, 12)
"""From a start whose contact states are known; from a motion over time beside the response, where states
change a few at a time for ten steps."""

BALANCING = (40, 15)
"""The same of the modes alone, whose steps cost less."""

KEPT = 12
"""Paths whose factorisations are kept."""


class Answers:
    """Answers under one load, each with what it cost since a moment `began` (``perf_counter``), s.

    Parameters
    ----------
    base : FrequencyPath
        Its load and scale are those of all paths; its factorisation is kept longest.
    control : StepControl
    """

    def __init__(self, base: FrequencyPath, control: StepControl) -> None:
        self.paths = {_key(base.problem): base}
        self.base = base
        self.control = control
        self.whole: HarmonicProblem | None = None

    def path(self, problem: HarmonicProblem) -> FrequencyPath:
        """The path of a problem, as it was left."""
        key = _key(problem)
        if key not in self.paths:
            if len(self.paths) > KEPT:
                del self.paths[next(old for old in self.paths if self.paths[old] is not self.base)]
            self.paths[key] = FrequencyPath(problem, self.base.load, self.base.parameter_scale)
        return self.paths[key]

    def newton(
        self,
        problem: HarmonicProblem,
        w: Array,
        frequency: float,
        began: float,
        before: HarmonicPoint | None = None,
        allowed: Allowed | None = None,
    ) -> HarmonicPoint:
        """Newton's method from unknowns; its steps are added to those of the answer `before`.

        Raises
        ------
        ContinuationError
        """
        control = self.control
        if allowed is not None:
            control = replace(control, max_iterations=allowed[0], patience=allowed[1])
        _, equations, iterations = solve_at(self.path(problem), w, frequency, control)
        assert isinstance(equations, EquationsAt)
        iterations += 0 if before is None else before.iterations
        return describe(equations, iterations, clock.perf_counter() - began)

    def from_start(
        self,
        start: Start,
        frequency: float,
        began: float,
        before: HarmonicPoint | None = None,
        allowed: Allowed = ELSEWHERE,
    ) -> HarmonicPoint:
        """Newton's method from a start, the first step with its contact states.

        Raises
        ------
        ContinuationError
        """
        w = first_step(self.path(start.problem), start, frequency)
        return self.newton(start.problem, w, frequency, began, before, allowed)

    def from_starts(
        self,
        starts: Iterator[Start],
        frequency: float,
        began: float,
        before: HarmonicPoint | None = None,
    ) -> Iterator[HarmonicPoint]:
        """Those of all starts that lead to one."""
        for start in starts:
            with suppress(ContinuationError):
                yield self.from_start(start, frequency, began, before)

    def by_modes(
        self, known: Known, harmonics: int, began: float, softer: float = 1.0
    ) -> HarmonicPoint:
        """The response with other harmonics by a balance of the modes alone (`modal.py`).

        From an answer, or from a cycle over time.

        Raises
        ------
        ContinuationError
        """
        if self.whole is None:
            self.whole = of_all_pairs(self.base.problem)
        problem, w = _unknowns(known, self.base.problem, harmonics)
        if problem.half_turn:
            problem, w = unfolded(problem, self.whole, w)
        control = replace(self.control, max_iterations=BALANCING[0], patience=BALANCING[1])
        at = known.frequency, self.base.load
        found = balanced(problem, w, harmonics, at, control, softer)
        return replace(found, seconds=clock.perf_counter() - began)

    def from_point(
        self, new: HarmonicProblem, point: HarmonicPoint, began: float
    ) -> HarmonicPoint | None:
        """The same with other harmonics; None where it has none, or one walks and the other does not."""
        if point.problem.walks != new.walks:
            return None
        starts = starts_from_point(new, point)
        return next(self.from_starts(starts, point.frequency, began, point), None)


def _unknowns(known: Known, base: HarmonicProblem, harmonics: int) -> tuple[HarmonicProblem, Array]:
    """Unknowns of an answer, or of a cycle over time, and the equations that they are of."""
    if isinstance(known, HarmonicPoint):
        return known.problem, known.w
    start = start_from_cycle(with_harmonics(base, harmonics), known)
    return start.problem, start.w


def _key(problem: HarmonicProblem) -> tuple[int, bool, float, bytes, bytes]:
    """What the problems of one response differ in."""
    places = problem.offset.tobytes(), problem.held.tobytes()
    return problem.harmonics, problem.walks, problem.spring, *places

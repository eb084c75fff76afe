"""How many harmonics a response needs: more until its amplitude has stopped changing.

The answers with H = 5, 9, 13, ... harmonics, and 24 samples per harmonic, tend to that of the exact contact
laws like a power of 1/H, not evenly: between some of them it hardly changes. From the changes and the tail
the error of the last level is estimated (`levels.py`). Where time integration stays beside the response, its
difference from that takes the place of the estimate (`over_time.py`).
"""

from __future__ import annotations

import time as clock
from collections.abc import Iterator
from contextlib import suppress
from dataclasses import dataclass, replace
from itertools import chain, islice

from microslip.analyses.harmonic.alongside import Place, followed
from microslip.analyses.harmonic.answers import BESIDE, ELSEWHERE, Allowed, Answers
from microslip.analyses.harmonic.balances import AT_ONCE, Balances
from microslip.analyses.harmonic.climb import COMPARED, Climb
from microslip.analyses.harmonic.levels import estimated_error, more_harmonics
from microslip.analyses.harmonic.losses import Losses
from microslip.analyses.harmonic.over_time import OWN, MotionBeside, OverTime, supported
from microslip.analyses.harmonic.paths import FrequencyPath
from microslip.analyses.harmonic.points import PULL, HarmonicPoint
from microslip.analyses.harmonic.problem import HarmonicProblem, walking, with_harmonics
from microslip.analyses.harmonic.starts import Start, starts_from_cycle, starts_from_point
from microslip.analyses.time.steady import SteadyState
from microslip.numerics.continuation import ContinuationError, StepControl
from microslip.typing import Array

UNMEASURED = 41
"""Harmonics at most where no motion over time can tell what more of them bring: these cost minutes."""

AIM = 0.9
"""Of the tolerance, at which an answer is good enough: errors are known no better than to the rest."""

ONWARD, IN_A_ROW = 4, 2
"""Harmonics more in the next balance of the modes from an answer; numbers in a row that may have none."""

MISSES = 1
"""Levels without an answer that are passed over on the way up, where there are other ways or no cycle."""


@dataclass(frozen=True)
class Adaptive:
    """Choice of the number of harmonics: more until the estimated error is small.

    Attributes
    ----------
    tolerance : float
        Of `HarmonicPoint.error`, the estimated relative error of the amplitude.
    most : int
        Harmonics at most.
    """

    tolerance: float = 3e-3
    most: int = 81


class Ladder:
    """Responses with more and more harmonics, held or walking.

    Parameters
    ----------
    path : FrequencyPath
        With the fewest harmonics.
    control : StepControl
    adaptive : Adaptive or None
        None leaves it at the fewest harmonics.
    over_time : OverTime, optional
        Says what the amplitudes are off by, where it can.
    """

    def __init__(
        self,
        path: FrequencyPath,
        control: StepControl,
        adaptive: Adaptive | None,
        over_time: OverTime | None = None,
    ) -> None:
        self.answers = Answers(path, control)
        self.base = path
        self.adaptive = adaptive
        self.over_time = over_time
        self.losses = Losses()
        self.balances, self.further = Balances(self.answers), Balances(self.answers)
        self.between = {softer: Balances(self.answers) for softer in AT_ONCE}
        self.climbed: list[tuple[MotionBeside, HarmonicPoint]] = []

    def solve(self, problem: HarmonicProblem, w: Array, frequency: float) -> HarmonicPoint:
        """`least`, and as many harmonics as needed."""
        return self.grown(self.least(problem, w, frequency))

    def least(self, problem: HarmonicProblem, w: Array, frequency: float) -> HarmonicPoint:
        """Solve the problem of a branch; let go a joint that walks.

        Where the second does not succeed, the point before it is returned; its `pull` says so.

        Raises
        ------
        ContinuationError
            Where the first does not succeed.
        """
        began = clock.perf_counter()
        point = self.answers.newton(problem, w, frequency, began)
        if point.pull > PULL:
            released, guess = walking(problem, point.w)
            with suppress(ContinuationError):
                point = self.answers.newton(released, guess, frequency, began, point)
        return point

    def grown(self, point: HarmonicPoint, place: Place | None = None) -> HarmonicPoint:
        """The same response with as many harmonics as needed; its `error` says so where that is not found.

        Parameters
        ----------
        point : HarmonicPoint
        place : Place, optional
            Where it stands on its branch.
        """
        return self._climb(point, clock.perf_counter() - point.seconds, place=place)

    def solve_from_cycle(self, steady: SteadyState) -> tuple[HarmonicPoint, HarmonicPoint]:
        """The response next to a steady cycle of time integration.

        Returns the answer with the fewest harmonics that have one, and that with as many as needed.

        Raises
        ------
        ContinuationError
            Where no number of harmonics has one.
        """
        began = clock.perf_counter()
        levels = list(self._levels(False))
        levels = [each for each in levels if each.harmonics <= UNMEASURED] or levels[:1]
        few = [each for each in levels if each.harmonics <= COMPARED] or levels[:1]
        many = levels[len(few) :]

        def newton(problem: HarmonicProblem) -> Iterator[HarmonicPoint]:
            starts = starts_from_cycle(problem, steady)
            return self.answers.from_starts(starts, steady.frequency, began)

        found = (
            *(newton(each) for each in few),
            *(self.balances.softly(steady, each.harmonics, began) for each in many),
            *(
                balances.at_once(steady, harmonics, began, softer)
                for balances, harmonics, softer in self._any_number()
            ),
            *(newton(each) for each in many),
        )
        for point in chain.from_iterable(found):
            return point, self._climb(point, began, steady)
        raise ContinuationError(f"none was found with up to {levels[-1].harmonics} harmonics")

    def _levels(self, walks: bool) -> Iterator[HarmonicProblem]:
        """The problem with the fewest harmonics, and with more as far as they may grow."""
        problem = replace(self.base.problem, walks=walks)
        yield problem
        most = 0 if self.adaptive is None else self.adaptive.most
        while (harmonics := more_harmonics(problem.harmonics)) <= most:
            problem = with_harmonics(problem, harmonics)
            yield problem

    def _climb(
        self,
        point: HarmonicPoint,
        began: float,
        steady: SteadyState | None = None,
        place: Place | None = None,
    ) -> HarmonicPoint:
        """Add harmonics until the error is small, they are too many, or no answer is found.

        From a cycle beside a motion that a climb has been beside there is nothing more to find.
        """
        if self.adaptive is None:
            return point
        climb = Climb([point], None, steady, place)
        self._ask(climb, began)
        begun = climb.beside
        if steady is not None and begun is not None:
            for motion, found in self.climbed:
                if begun.same_as(motion):
                    return found
        self._one_by_one(climb, began, COMPARED)
        self._onward(climb, began)
        last = climb.last
        self._one_by_one(climb, began, self.adaptive.most)
        if climb.beside is None and climb.last.harmonics > COMPARED:
            self._ask(climb, began)
            if climb.beside is not None:
                self._one_by_one(climb, began, self.adaptive.most)
        for answer in (climb.last, climb.best):
            self._beside_its_own(answer, climb)
        if climb.last is not last:
            self._onward(climb, began)
        self._by_modes(climb, began)
        self._between_levels(climb, began)
        self._confirmed(climb)
        if self.over_time is not None and climb.beside is None and supported(climb.best):
            # levels say nothing of where its bodies are going
            return replace(climb.best, error=float("nan"))
        if begun is not None:
            self.climbed.append((begun, climb.best))
        return climb.best

    def _one_by_one(self, climb: Climb, began: float, most: int) -> None:
        """Levels one after the other, by Newton's method or along the branch, until some have no answer.

        Up to so many harmonics. All levels where a motion over time is known and modes are not balanced
        alone: the more harmonics, the nearer is its cycle to an answer. Without one, what has none at one
        level has mostly none at the next. More than `UNMEASURED` only where there is no other way to them.
        """
        missed = 0
        for more in self._levels(climb.best.problem.walks):
            if more.harmonics > most or self._confirmed(climb):
                break
            if more.harmonics > UNMEASURED and (self.balances.apply or not climb.measurable):
                break
            if more.harmonics <= climb.levels[-1][0]:
                continue
            found = self._next(more, climb, began)
            found = self._alongside(more, climb, began) if found is None else found
            if found is not None:
                self._reached(climb, found, began)
                continue
            missed += 1
            if missed > MISSES and (climb.beside is None or self.balances.apply):
                break

    def _onward(self, climb: Climb, began: float) -> None:
        """A few harmonics more at a time, by a balance of the modes from the answer before.

        One more where there is none, until `IN_A_ROW` have none. Where more of them are better is told by
        a motion over time.
        """
        assert self.adaptive is not None
        last, wanted, missed = climb.last, climb.last.harmonics + ONWARD, 0
        while wanted <= self.adaptive.most and missed < IN_A_ROW:
            if self._confirmed(climb) or not climb.measurable:
                break
            found = self.further.onward(last, wanted, began)
            if found is None or climb.left_by(found):
                wanted, missed = wanted + 1, missed + 1
                continue
            self._reached(climb, found, began)
            last, wanted, missed = found, wanted + ONWARD, 0
        self._beside_its_own(last, climb)

    def _by_modes(self, climb: Climb, began: float) -> None:
        """Levels that Newton's method has not found, by a balance of the modes alone.

        After one that has no answer the next is passed over where a motion over time is known: the more
        harmonics, the nearer is its cycle to an answer.
        """
        found, missed = {answer.harmonics for answer in climb.answers}, False
        for more in self._levels(climb.best.problem.walks):
            harmonics = more.harmonics
            if harmonics <= COMPARED or harmonics in found:
                continue
            if self._confirmed(climb) or (harmonics > UNMEASURED and not climb.measurable):
                break
            if missed and climb.beside is not None:
                missed = False
                continue
            missed = True
            for answer in self.balances.softly(climb.known, harmonics, began):
                missed = False
                self._reached(climb, answer, began)
                if climb.beside is None:
                    self._ask(climb, began)
                self._beside_its_own(answer, climb)
                if climb.beside is None or self._confirmed(climb):
                    break
            if missed and (climb.beside is None or harmonics > UNMEASURED):
                break

    def _between_levels(self, climb: Climb, began: float) -> None:
        """Any number of harmonics that has not been found, where more of them than there are would help.

        Where the residual is as rough as chance, so is which numbers Newton's method finds.
        """
        found = {answer.harmonics for answer in climb.answers}
        for balances, harmonics, softer in self._any_number():
            if self._confirmed(climb) or not climb.measurable:
                break
            if harmonics in found:
                continue
            for answer in balances.at_once(climb.known, harmonics, began, softer):
                self._reached(climb, answer, began)
                if climb.best.harmonics == harmonics:
                    self._beside_its_own(answer, climb)

    def _any_number(self) -> Iterator[tuple[Balances, int, float]]:
        """Every number of harmonics beyond the few, with one flexibility after the other."""
        most = 0 if self.adaptive is None else min(UNMEASURED, self.adaptive.most)
        for softer, balances in self.between.items():
            for harmonics in range(COMPARED + 1, most + 1):
                yield balances, harmonics, softer

    def _beside_its_own(self, answer: HarmonicPoint, climb: Climb) -> None:
        """Where none is good enough, the motion from the state of an answer instead, if that is nearer.

        Motions with other tractions locked in differ in amplitude: one with many harmonics has its own.
        """
        if climb.beside is None or self._confirmed(climb) or answer.harmonics == climb.asked:
            return
        assert self.over_time is not None
        own = self.over_time.again(answer, climb.beside)
        if own.error_of(answer) < climb.best.error:
            climb.stand_beside(answer, own)

    def _reached(self, climb: Climb, found: HarmonicPoint, began: float) -> None:
        """Take down the answer of a level, with its error; it is the best where that is not larger."""
        climb.add(found)
        if climb.beside is None and found.harmonics == COMPARED:
            self._ask(climb, began)
            return
        found = self._measured(found, climb)
        if climb.beside is None or not climb.best.error <= found.error:
            climb.best = found

    def _ask(self, climb: Climb, began: float) -> None:
        """Time integration for the motion beside the last answer; which is the best beside that."""
        climb.beside, climb.asked = self._beside(climb.last), climb.last.harmonics
        self._bring_on(climb, began)
        known = climb.answers if climb.beside is not None else climb.answers[-1:]
        measured = [self._measured(answer, climb) for answer in known]
        climb.best = min(measured, key=lambda answer: answer.error)

    def _bring_on(self, climb: Climb, began: float) -> None:
        """Solve the last level once more where the bodies stand in the motion beside it."""
        if climb.beside is None or climb.beside.elsewhere(climb.last) <= OWN:
            return
        new = with_harmonics(self.base.problem, climb.last.harmonics)
        for start in starts_from_cycle(new, climb.beside.steady):
            found = self._tried(start, climb, began, BESIDE)
            if found is not None:
                climb.answers[-1] = found
                return

    def _confirmed(self, climb: Climb) -> bool:
        """Whether the best answer is good enough, also beside motions from its own state."""
        assert self.adaptive is not None
        enough = AIM * self.adaptive.tolerance
        if not climb.best.error <= enough:
            return False
        if climb.beside is not None and climb.sure != climb.best.harmonics:
            assert self.over_time is not None
            best, climb.sure = climb.best, climb.best.harmonics
            climb.stand_beside(best, self.over_time.again(best, climb.beside))
            climb.stand_beside(best, self.over_time.with_pasts(best, climb.beside))
        return climb.best.error <= enough

    def _beside(self, point: HarmonicPoint) -> MotionBeside | None:
        return None if self.over_time is None else self.over_time.beside(point)

    def _measured(self, point: HarmonicPoint, climb: Climb) -> HarmonicPoint:
        """With its error: by time integration, or by the levels up to it."""
        if climb.beside is None:
            return replace(point, error=estimated_error(climb.levels, point.tail))
        return replace(point, error=climb.beside.error_of(point))

    def _next(self, new: HarmonicProblem, climb: Climb, began: float) -> HarmonicPoint | None:
        """The same response with other harmonics, by Newton's method from all starts.

        With many harmonics from the likeliest of each kind. One that leads to another response is none.
        """
        for starts in self._starts(new, climb):
            for start in islice(starts, None if new.harmonics <= UNMEASURED else 1):
                patient = start.over_time and climb.patient
                found = self._tried(start, climb, began, BESIDE if patient else ELSEWHERE)
                if found is not None:
                    return found
        climb.missed += 1
        return None

    def _tried(
        self, start: Start, climb: Climb, began: float, allowed: Allowed
    ) -> HarmonicPoint | None:
        """The same response by Newton's method from a start; None where there is none, or another."""
        with suppress(ContinuationError):
            found = self.answers.from_start(start, climb.last.frequency, began, climb.last, allowed)
            if climb.cycle is None or not climb.left_by(found):
                return found
        return None

    def _alongside(self, new: HarmonicProblem, climb: Climb, began: float) -> HarmonicPoint | None:
        """The same response with other harmonics, on the branch through a neighbour that has them."""
        if climb.place is None:
            return None
        frequency = climb.last.frequency
        for least in self._neighbours(climb):
            if not self.losses.allow(new.harmonics):
                break
            there = self.answers.from_point(new, least, began)
            if there is None:
                continue
            path = self.answers.path(there.problem)
            try:
                w = followed(path, there.w, there.frequency, frequency)
                found = self.answers.newton(there.problem, w, frequency, began, climb.last)
            except ContinuationError:
                self.losses.add(new.harmonics)
                break
            if not climb.left_by(found):
                climb.neighbour = there
                return found
        climb.place = climb.neighbour = None
        return None

    def _neighbours(self, climb: Climb) -> Iterator[HarmonicPoint]:
        """That which has led to more harmonics before, and those with few that are not nearer.

        The latter where not many more are wanted: each costs as much as several points.
        """
        assert climb.place is not None
        frequency, least = climb.place.frequency, 0.0
        if climb.neighbour is not None:
            least = abs(climb.neighbour.frequency - frequency)
            yield climb.neighbour
            if climb.neighbour.harmonics >= COMPARED:
                return
        for point in climb.place.neighbours():
            if abs(point.p - frequency) >= least:
                with suppress(ContinuationError):
                    yield self.least(climb.place.path.problem, point.u, point.p)

    def _starts(self, new: HarmonicProblem, climb: Climb) -> Iterator[Iterator[Start]]:
        """Starts of other harmonics, from a cycle over time and from the last ones, the likeliest first.

        From the last ones not beyond levels that had no answer, where there is a cycle.
        """
        if climb.cycle is not None:
            yield starts_from_cycle(new, climb.cycle)
            if new.harmonics > more_harmonics(climb.last.harmonics):
                return
        yield starts_from_point(new, climb.last)

"""Responses at one frequency after another: on the branches that pass it, and beside motions over time.

Where no branch has an accurate response, and where one of them was not followed to its end, the motion that
time integration settles in from rest is asked for: it may be a response that no branch has led to.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace

import numpy as np

from microslip.analyses.harmonic.adaptive import Ladder
from microslip.analyses.harmonic.alongside import Place
from microslip.analyses.harmonic.over_time import LEFT
from microslip.analyses.harmonic.paths import FrequencyPath
from microslip.analyses.harmonic.points import PULL, HarmonicPoint, distance
from microslip.analyses.time.steady import SteadyState
from microslip.errors import Failure, MicroslipError
from microslip.numerics.continuation import (
    Branch,
    BranchPoint,
    ContinuationError,
    StepControl,
    crossings,
    first_point,
    inner,
    trace,
)
from microslip.numerics.through import trace_through
from microslip.typing import Array


@dataclass(frozen=True)
class Way:
    """A branch over frequency and what it was followed with."""

    path: FrequencyPath
    branch: Branch


def failed(where: str, reason: str) -> Failure:
    """What harmonic balance has not found."""
    return Failure("harmonic", where, reason)


class Search:
    """Responses at one frequency after another.

    Parameters
    ----------
    ladder : Ladder
    ways : list of Way
        The branches from the ends of the band; those through motions from rest are added.
    band : (float, float)
        Least and greatest frequency, Hz.
    tell : callable
        Called with every new point of a branch; it stops where that returns True.

    Attributes
    ----------
    points : list of (int, float, HarmonicPoint)
        Number of the branch, place along it, response.
    failures : list of Failure
    """

    def __init__(
        self,
        ladder: Ladder,
        ways: list[Way],
        band: tuple[float, float],
        tell: Callable[[BranchPoint], bool],
    ) -> None:
        self.ladder, self.ways, self.over_time = ladder, ways, ladder.over_time
        self.band, self.tell = band, tell
        self.points: list[tuple[int, float, HarmonicPoint]] = []
        self.failures: list[Failure] = []
        self.complete = bool(ways) and all(way.branch.ended == "range" for way in ways)

    def at(self, frequency: float) -> None:
        """Look for all responses at a frequency."""
        where = f"{frequency:.6g} Hz at load {self.ladder.base.load:.4g}"
        before, known = len(self.failures), len(self.points)
        self._on_branches(frequency, where)
        new = self.points[known:]
        if self.over_time is not None:
            if not any(self._accurate(point) for _, _, point in new):
                self._instead(frequency, where, before, known)
            elif self.ladder.adaptive is not None and not self.complete:
                self._besides(frequency, where, [item[2] for item in new])
        for _, _, point in self.points[known:]:
            self.failures += self._doubts(point, where)

    def _instead(self, frequency: float, where: str, before: int, known: int) -> None:
        """The response beside the motion from rest in place of those that are not accurate, from `known` on.

        With it go what was not found, from `before` on.
        """
        assert self.over_time is not None
        steady, new = self.over_time.from_rest(frequency), self.points[known:]
        if any(_beside(point, steady) for _, _, point in new):
            return
        del self.points[known:]
        try:
            self._from_rest(steady, [item[2] for item in new])
        except MicroslipError as error:
            reason = f"nor from a steady cycle of time integration: {error}"
            self.failures.append(failed(where, reason))
            self.points += new
            return
        del self.failures[before:]
        for item in new:
            if np.isfinite(item[2].error):
                self._keep(*item)

    def _besides(self, frequency: float, where: str, known: Sequence[HarmonicPoint]) -> None:
        """The response beside the motion from rest, where that is another than those that are known."""
        assert self.over_time is not None
        try:
            steady = self.over_time.from_rest(frequency)
            near = [distance(point.amplitude, steady.amplitude) for point in known]
            if steady.converged and min(near) > LEFT:
                self._from_rest(steady, known)
        except MicroslipError as error:
            reason = f"from rest there is another motion, for which no response was found: {error}"
            self.failures.append(failed(where, reason))

    def _on_branches(self, frequency: float, where: str) -> None:
        """Responses wherever the branches pass a frequency."""
        control = self.ladder.answers.control
        guesses = [
            (number, place, guess)
            for number, way in enumerate(self.ways)
            for guess, place in crossings(way.branch.points, frequency)
        ]
        if not guesses:
            self.failures.append(failed(where, "not on the branch found"))
        solved: list[HarmonicPoint] = []
        for number, place, guess in guesses:
            way = self.ways[number]
            try:
                try:
                    least = self.ladder.least(way.path.problem, guess, frequency)
                except ContinuationError:
                    nearer = _along(way.path, way.branch, place, frequency, control)
                    least = self.ladder.least(way.path.problem, nearer, frequency)
            except ContinuationError as error:
                self.failures.append(failed(where, str(error)))
                continue
            if any(_same(least, other) for other in solved):
                continue
            solved.append(least)
            share = abs(frequency - way.branch.points[place].p)
            here = Place(way.path, way.branch, place, frequency)
            self._keep(number, place + share / (share + 1), self.ladder.grown(least, here))

    def _from_rest(self, steady: SteadyState, known: Sequence[HarmonicPoint]) -> None:
        """The response next to a steady cycle of time integration, and the branch that it is on."""
        frequency = steady.frequency
        least, point = self.ladder.solve_from_cycle(steady)
        path = FrequencyPath(least.problem, least.load, self.ladder.base.parameter_scale)
        control = self.ladder.answers.control
        if least.modal:
            # no solution of the equations of all pairs, along which branches are followed
            still = np.zeros_like(least.w)
            start = BranchPoint(least.w, frequency, still, 1.0, control.first, 0, least.residual)
        else:
            start = first_point(path, least.w, frequency, control)
        branch, place = Branch((start,), "points"), 0
        few = least.harmonics == self.ladder.base.problem.harmonics
        if few and not self._followed(start) and not any(_same(point, old) for old in known):
            branch, place = trace_through(path, start, self.band, control, self.tell)
        self.ways.append(Way(path, branch))
        self._keep(len(self.ways) - 1, float(place), point)

    def _followed(self, start: BranchPoint) -> bool:
        """Whether a branch passes so close by that it is the one through a point."""
        for way in self.ways:
            if way.branch.points[0].u.shape != start.u.shape:
                continue
            for guess, _ in crossings(way.branch.points, start.p):
                away = guess - start.u
                if inner(way.path, away, 0.0, away, 0.0) < CLOSE**2:
                    return True
        return False

    def _keep(self, number: int, place: float, point: HarmonicPoint) -> None:
        for index, (_, _, old) in enumerate(self.points):
            if _same(point, old):
                if point.error < old.error:
                    self.points[index] = (number, place, point)
                return
        self.points.append((number, place, point))

    def _accurate(self, point: HarmonicPoint) -> bool:
        adaptive = self.ladder.adaptive
        return adaptive is None or point.error <= adaptive.tolerance

    def _doubts(self, point: HarmonicPoint, where: str) -> list[Failure]:
        """What is not right with a response."""
        doubts, adaptive = [], self.ladder.adaptive is not None
        if point.pull > PULL and not (adaptive and self._accurate(point)):
            doubts.append(
                failed(
                    where,
                    "the joint walks, and no steady walk was found; its supports hold it with "
                    f"{point.pull:.1e} of the friction",
                )
            )
        elif adaptive and np.isnan(point.error):
            said = (
                "the bodies walk past each other, and no motion over time stays beside the response: "
                "what its amplitude becomes as they move on is not known"
                if point.walks
                else f"the response with {point.harmonics} harmonics was not found with more"
            )
            doubts.append(failed(where, said))
        if not self._accurate(point) and np.isfinite(point.error):
            said = (
                f"with {point.harmonics} harmonics the estimated error of the amplitude is "
                f"{point.error:.1e}"
            )
            doubts.append(failed(where, said))
        return doubts


def _along(
    path: FrequencyPath, branch: Branch, place: int, frequency: float, control: StepControl
) -> Array:
    """Unknowns at a frequency that the branch passes after a point, in smaller steps than before.

    Raises
    ------
    ContinuationError
        Where those do not get there.
    """
    start = branch.points[place]
    near = replace(start, step=0.1 * start.step)
    bounds = (min(start.p, frequency), max(start.p, frequency))
    way = trace(path, near, bounds, control)
    if way.points[-1].p != frequency:
        raise ContinuationError(f"the branch after {start.p:.6g} Hz was not found again")
    return way.points[-1].u


CLOSE = 0.1
"""Distance from a branch within which a point is on it, in largest reactions of the prestress."""

SAME = 1e-4
"""Relative difference of two answers of the same response, beside what their errors allow."""


def _beside(point: HarmonicPoint, steady: SteadyState) -> bool:
    """Whether a steady motion is that of a response, as far as the error of that says."""
    return steady.converged and distance(point.amplitude, steady.amplitude) <= point.error


def _same(one: HarmonicPoint, other: HarmonicPoint) -> bool:
    """The same response, found twice."""
    if one.frequency != other.frequency:
        return False
    allowed = SAME + sum(e for e in (one.error, other.error) if np.isfinite(e))
    if one.harmonics == other.harmonics:
        size = np.abs(other.output[1]).max()
        return bool(np.abs(one.output[1] - other.output[1]).max() <= allowed * size)
    return bool(abs(one.amplitude - other.amplitude) <= allowed * abs(other.amplitude))

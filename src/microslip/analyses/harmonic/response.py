"""Periodic responses of a joint by harmonic balance, at given frequencies or loads.

The equations of `equations.py` are handed to `microslip.numerics.continuation` with the frequency (Hz) or
the load as parameter. A frequency response is begun by raising the load from zero at its first frequency;
then its branch is followed through folds; then the equations are solved at the frequencies asked for,
once for every time the branch passes them.
"""

from __future__ import annotations

import time as clock
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace

import numpy as np

from microslip.analyses.harmonic.adaptive import Adaptive, Ladder
from microslip.analyses.harmonic.alongside import Place
from microslip.analyses.harmonic.over_time import OverTime
from microslip.analyses.harmonic.paths import (
    CONTROL,
    EquationsAt,
    FrequencyPath,
    LoadPath,
    frequency_scale,
)
from microslip.analyses.harmonic.points import PULL, HarmonicPoint, describe, distance
from microslip.analyses.harmonic.problem import HarmonicProblem
from microslip.analyses.harmonic.raising import follow_frequency
from microslip.analyses.time.steady import SteadyState
from microslip.brief import Brief
from microslip.errors import Failure, MicroslipError
from microslip.numerics.continuation import (
    Branch,
    BranchPoint,
    ContinuationError,
    StepControl,
    crossings,
    first_point,
    fold,
    inner,
    solve_at,
    trace,
)
from microslip.numerics.through import trace_through
from microslip.typing import Array


@dataclass(frozen=True, repr=False)
class HarmonicResponse(Brief):
    """Responses along one branch, or several that do not meet in the range.

    Attributes
    ----------
    points : tuple of HarmonicPoint
        In order along the branches; where they fold, the same frequency comes more than once.
    branch_of : tuple of int
        Which branch each point is on.
    branches : tuple of Branch
        As they were followed, to restart from; parameter Hz or load.
    problems : tuple of HarmonicProblem
        What each branch was followed with.
    folds : tuple of HarmonicPoint
        Where the parameter turns round.
    failures : tuple of Failure
        What was not found, and why.
    """

    points: tuple[HarmonicPoint, ...]
    branch_of: tuple[int, ...]
    branches: tuple[Branch, ...]
    problems: tuple[HarmonicProblem, ...]
    folds: tuple[HarmonicPoint, ...]
    failures: tuple[Failure, ...]


@dataclass(frozen=True)
class _Way:
    """A branch over frequency and what it was followed with."""

    path: FrequencyPath
    branch: Branch


def frequency_response(
    problem: HarmonicProblem,
    load: float,
    frequencies: Sequence[float] | Array,
    *,
    adaptive: Adaptive | None = None,
    over_time: OverTime | None = None,
    control: StepControl = CONTROL,
    observe: Callable[[float], None] | None = None,
    solved: Callable[[float], None] | None = None,
    stop: Callable[[], bool] | None = None,
) -> HarmonicResponse:
    """Responses at given frequencies, on all branches that start at either end of them.

    Where no branch reaches a frequency, or harmonics beyond those of the branch show that it has no such
    response there, a steady cycle of time integration shows another, which is followed as well.

    Parameters
    ----------
    problem : HarmonicProblem
        Its harmonics are used for the branch, and for the points unless `adaptive`.
    load : float
        Amplitude of the driven port.
    frequencies : (n,) array
        Hz, at least two, ascending or descending; the first should be away from the resonance.
    adaptive : Adaptive, optional
        Grow the number of harmonics at each point.
    over_time : OverTime, optional
        Time integration under the same load. It measures the errors of `adaptive`, and finds what the
        branches do not reach; without it that is among the failures.
    observe : callable, optional
        Called with every frequency reached along the branch.
    solved : callable, optional
        Called with every frequency at which all responses were looked for.
    stop : callable, optional
        Asked at every point; once it says True, what has been found is returned.

    Raises
    ------
    ContinuationError
        Where neither the first nor the last frequency is solved and there is no `over_time`; other
        failures are in the result.
    """
    wanted = np.asarray(frequencies, dtype=float)
    if len(wanted) < 2 or not np.isfinite(wanted).all():
        raise MicroslipError("a frequency response needs at least two finite frequencies")

    def tell(point: BranchPoint) -> bool:
        if observe is not None:
            observe(point.p)
        return stopped()

    def stopped() -> bool:
        return stop is not None and stop()

    ways, failures = _ways(problem, load, wanted, control, tell, stopped)
    if not ways and over_time is None:
        raise ContinuationError("; ".join(failure.reason for failure in failures))
    path = ways[0].path if ways else FrequencyPath(problem, load, frequency_scale(wanted))
    ladder = Ladder(path, control, adaptive, over_time)
    search = _Search(ladder, ways)
    for frequency in map(float, wanted):
        if stopped():
            failures.append(_failure(f"load {load:.4g}", f"stopped before {frequency:.6g} Hz"))
            break
        search.at(frequency, (float(wanted.min()), float(wanted.max())), tell)
        if solved is not None:
            solved(frequency)
    points = sorted(search.points, key=lambda item: item[:2])
    folds, missed = _folds(ways, control)
    lost = search.failures or len({point.frequency for _, _, point in points}) < len(set(wanted))
    return HarmonicResponse(
        points=tuple(point for _, _, point in points),
        branch_of=tuple(number for number, _, _ in points),
        branches=tuple(way.branch for way in ways),
        problems=tuple(way.path.problem for way in ways),
        folds=tuple(folds),
        failures=(*(failures if lost else ()), *search.failures, *missed),
    )


def _failure(where: str, reason: str) -> Failure:
    return Failure("harmonic", where, reason)


def _ways(
    problem: HarmonicProblem,
    load: float,
    wanted: Array,
    control: StepControl,
    tell: Callable[[BranchPoint], bool],
    stopped: Callable[[], bool],
) -> tuple[list[_Way], list[Failure]]:
    """The branch from the first end, and that from the second where the first does not get there."""
    first, last = float(wanted[0]), float(wanted[-1])
    ways: list[_Way] = []
    failures: list[Failure] = []
    for begin, end in ((first, last), (last, first)):
        try:
            way = _Way(
                *follow_frequency(
                    problem, load, (begin, end), control=control, observe=tell, stops=wanted
                )
            )
        except ContinuationError as error:
            failures.append(_failure("", str(error)))
            continue
        ways.append(way)
        if way.branch.ended != "range":
            where = f"branch at load {load:.4g} from {begin:.6g} Hz"
            failures.append(_failure(where, way.branch.ended))
        if way.branch.points[-1].p == end or stopped():
            break
    return ways, failures


class _Search:
    """Responses at one frequency after another.

    Attributes
    ----------
    points : list of (int, float, HarmonicPoint)
        Number of the branch, place along it, response.
    failures : list of Failure
    """

    def __init__(
        self,
        ladder: Ladder,
        ways: list[_Way],
    ) -> None:
        self.ladder, self.ways, self.over_time = ladder, ways, ladder.over_time
        self.points: list[tuple[int, float, HarmonicPoint]] = []
        self.failures: list[Failure] = []

    def at(
        self, frequency: float, band: tuple[float, float], tell: Callable[[BranchPoint], bool]
    ) -> None:
        """Look for all responses at a frequency."""
        where = f"{frequency:.6g} Hz at load {self.ladder.base.load:.4g}"
        before, known = len(self.failures), len(self.points)
        self._on_branches(frequency, where)
        new = self.points[known:]
        if self.over_time is not None and not any(self._accurate(point) for _, _, point in new):
            steady = self.over_time.from_rest(frequency)
            if not any(_beside(point, steady) for _, _, point in new):
                del self.points[known:]
                try:
                    self._from_rest(steady, band, [item[2] for item in new], tell)
                except MicroslipError as error:
                    reason = f"nor from a steady cycle of time integration: {error}"
                    self.failures.append(_failure(where, reason))
                    self.points += new
                else:
                    del self.failures[before:]
                    for item in new:
                        if np.isfinite(item[2].error):
                            self._keep(*item)
        for _, _, point in self.points[known:]:
            self.failures += self._doubts(point, where)

    def _on_branches(self, frequency: float, where: str) -> None:
        """Responses wherever the branches pass a frequency."""
        control = self.ladder.control
        guesses = [
            (number, place, guess)
            for number, way in enumerate(self.ways)
            for guess, place in crossings(way.branch.points, frequency)
        ]
        if not guesses:
            self.failures.append(_failure(where, "not on the branch found"))
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
                self.failures.append(_failure(where, str(error)))
                continue
            if any(_same(least, other) for other in solved):
                continue
            solved.append(least)
            share = abs(frequency - way.branch.points[place].p)
            here = Place(way.path, way.branch, place, frequency)
            self._keep(number, place + share / (share + 1), self.ladder.grown(least, here))

    def _from_rest(
        self,
        steady: SteadyState,
        band: tuple[float, float],
        known: Sequence[HarmonicPoint],
        tell: Callable[[BranchPoint], bool],
    ) -> None:
        """The response next to a steady cycle of time integration, and the branch that it is on."""
        frequency = steady.frequency
        least, point = self.ladder.solve_from_cycle(steady)
        path = FrequencyPath(least.problem, least.load, self.ladder.base.parameter_scale)
        start = first_point(path, least.w, frequency, self.ladder.control)
        branch, place = Branch((start,), "points"), 0
        few = least.harmonics == self.ladder.base.problem.harmonics
        if few and not self._followed(start) and not any(_same(point, old) for old in known):
            branch, place = trace_through(path, start, band, self.ladder.control, tell)
        self.ways.append(_Way(path, branch))
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
                _failure(
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
            doubts.append(_failure(where, said))
        if not self._accurate(point) and np.isfinite(point.error):
            said = (
                f"with {point.harmonics} harmonics the estimated error of the amplitude is "
                f"{point.error:.1e}"
            )
            doubts.append(_failure(where, said))
        return doubts


def _folds(ways: Sequence[_Way], control: StepControl) -> tuple[list[HarmonicPoint], list[Failure]]:
    folds, failures = [], []
    for way in ways:
        for index in way.branch.folds:
            try:
                turn = fold(way.path, way.branch, index, control)
                folds.append(describe(way.path.at(turn.u, turn.p), turn.iterations, 0.0))
            except ContinuationError as error:
                near = way.branch.points[index].p
                failures.append(_failure(f"fold near {near:.6g} Hz", str(error)))
    return folds, failures


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


def amplitude_sweep(
    problem: HarmonicProblem,
    frequency: float,
    loads: Sequence[float] | Array,
    *,
    control: StepControl = CONTROL,
) -> HarmonicResponse:
    """Responses at one frequency under rising loads, all that the branch passes.

    Raises
    ------
    MicroslipError
        Where the loads are not positive.
    """
    wanted = np.asarray(loads, dtype=float)
    if len(wanted) < 1 or not (wanted > 0).all():
        raise MicroslipError("an amplitude sweep needs loads above zero")
    path = LoadPath(problem, frequency, float(wanted.max()))
    start = first_point(path, problem.rest(), 0.0, control)
    branch = trace(path, start, (0.0, float(wanted.max())), control)
    failures = []
    if branch.ended != "range":
        failures.append(_failure(f"branch at {frequency:.6g} Hz", branch.ended))
    points = []
    for load in wanted:
        guesses = crossings(branch.points, float(load))
        if not guesses:
            where = f"load {load:.4g} at {frequency:.6g} Hz"
            failures.append(_failure(where, "not on the branch found"))
        for guess, _ in guesses:
            began = clock.perf_counter()
            try:
                _, equations, iterations = solve_at(path, guess, float(load), control)
            except ContinuationError as error:
                failures.append(_failure(f"load {load:.4g} at {frequency:.6g} Hz", str(error)))
                continue
            assert isinstance(equations, EquationsAt)
            points.append(describe(equations, iterations, clock.perf_counter() - began))
    folds = [fold(path, branch, index, control) for index in branch.folds]
    return HarmonicResponse(
        points=tuple(points),
        branch_of=(0,) * len(points),
        branches=(branch,),
        problems=(problem,),
        folds=tuple(describe(path.at(turn.u, turn.p), turn.iterations, 0.0) for turn in folds),
        failures=tuple(failures),
    )

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

from microslip.analyses.harmonic.paths import (
    CONTROL,
    EquationsAt,
    FrequencyPath,
    LoadPath,
    follow_frequency,
)
from microslip.analyses.harmonic.points import HarmonicPoint, describe
from microslip.analyses.harmonic.problem import (
    HarmonicProblem,
    padded,
    walking,
    with_harmonics,
)
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
    solve_at,
    trace,
)
from microslip.typing import Array


@dataclass(frozen=True, repr=False)
class HarmonicResponse(Brief):
    """Responses along one branch, or two that do not meet in the range.

    Attributes
    ----------
    points : tuple of HarmonicPoint
        In order along the branches; where they fold, the same frequency comes more than once.
    branch_of : tuple of int
        Which branch each point is on.
    branches : tuple of Branch
        As they were followed, to restart from; parameter Hz or load.
    folds : tuple of HarmonicPoint
        Where the parameter turns round.
    failures : tuple of Failure
        What was not found, and why.
    """

    points: tuple[HarmonicPoint, ...]
    branch_of: tuple[int, ...]
    branches: tuple[Branch, ...]
    folds: tuple[HarmonicPoint, ...]
    failures: tuple[Failure, ...]


@dataclass(frozen=True)
class Adaptive:
    """Choice of the number of harmonics: four more until the last two are small.

    Attributes
    ----------
    tolerance : float
        Of `HarmonicPoint.tail`.
    most : int
        Harmonics at most.
    """

    tolerance: float = 0.03
    most: int = 21


ADDED = 4
"""Harmonics added at a time."""

PULL = 1e-4
"""`HarmonicPoint.pull` beyond which a joint is let go to walk."""


def frequency_response(
    problem: HarmonicProblem,
    load: float,
    frequencies: Sequence[float] | Array,
    *,
    adaptive: Adaptive | None = None,
    control: StepControl = CONTROL,
    observe: Callable[[float], None] | None = None,
    solved: Callable[[float], None] | None = None,
    stop: Callable[[], bool] | None = None,
) -> HarmonicResponse:
    """Responses at given frequencies, on all branches that start at either end of them.

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
    observe : callable, optional
        Called with every frequency reached along the branch.
    solved : callable, optional
        Called with every frequency at which all responses were looked for.
    stop : callable, optional
        Asked at every point; once it says True, what has been found is returned.

    Raises
    ------
    ContinuationError
        Where not even the first frequency is solved; later failures are in the result.
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

    path, branches, failures = _branches(problem, load, wanted, control, tell, stopped)
    ladder = _Ladder(path, control)
    points: list[tuple[int, float, HarmonicPoint]] = []
    for frequency in map(float, wanted):
        if stopped():
            failures.append(_failure(f"load {load:.4g}", f"stopped before {frequency:.6g} Hz"))
            break
        failures += _solve_at_frequency(ladder, branches, frequency, adaptive, points)
        if solved is not None:
            solved(frequency)
    points.sort(key=lambda item: item[:2])
    folds, missed = _folds(path, branches, control)
    return HarmonicResponse(
        points=tuple(point for _, _, point in points),
        branch_of=tuple(number for number, _, _ in points),
        branches=tuple(branches),
        folds=tuple(folds),
        failures=(*failures, *missed),
    )


def _failure(where: str, reason: str) -> Failure:
    return Failure("harmonic", where, reason)


def _branches(
    problem: HarmonicProblem,
    load: float,
    wanted: Array,
    control: StepControl,
    tell: Callable[[BranchPoint], bool],
    stopped: Callable[[], bool],
) -> tuple[FrequencyPath, list[Branch], list[Failure]]:
    """The branch from the first end, and that from the second where the first does not get there."""
    first, last = float(wanted[0]), float(wanted[-1])
    path, branch = follow_frequency(
        problem, load, (first, last), control=control, observe=tell, stops=wanted
    )
    branches, failures = [branch], []
    if branch.ended != "range":
        failures.append(_failure(f"branch at load {load:.4g} from {first:.6g} Hz", branch.ended))
    if branch.points[-1].p != last and not stopped():
        try:
            _, other = follow_frequency(
                problem, load, (last, first), control=control, observe=tell, stops=wanted
            )
        except ContinuationError as error:
            failures.append(_failure("", str(error)))
        else:
            if other.ended != "range":
                where = f"branch at load {load:.4g} from {last:.6g} Hz"
                failures.append(_failure(where, other.ended))
            branches.append(other)
    return path, branches, failures


def _solve_at_frequency(
    ladder: _Ladder,
    branches: Sequence[Branch],
    frequency: float,
    adaptive: Adaptive | None,
    points: list[tuple[int, float, HarmonicPoint]],
) -> list[Failure]:
    """Responses wherever the branches pass a frequency, into `points`; what was not found."""
    path, control = ladder.base, ladder.control
    where = f"{frequency:.6g} Hz at load {path.load:.4g}"
    failures = []
    guesses = [
        (number, place, guess)
        for number, way in enumerate(branches)
        for guess, place in crossings(way.points, frequency)
    ]
    if not guesses:
        failures.append(_failure(where, "not on the branch found"))
    for number, place, guess in guesses:
        try:
            try:
                point = ladder.solve(guess, frequency, adaptive)
            except ContinuationError:
                nearer = _along(path, branches[number], place, frequency, control)
                point = ladder.solve(nearer, frequency, adaptive)
        except ContinuationError as error:
            failures.append(_failure(where, str(error)))
            continue
        if any(_same(point, old) for _, _, old in points):
            continue
        if point.pull > PULL:
            failures.append(
                _failure(
                    where,
                    "the joint walks, and no steady walk was found; its supports hold it with "
                    f"{point.pull:.1e} of the friction",
                )
            )
        if adaptive is not None and point.tail > adaptive.tolerance:
            failures.append(
                _failure(
                    where,
                    f"with {point.harmonics} harmonics the last two still hold {point.tail:.1e} of "
                    "the vibrating reactions",
                )
            )
        share = abs(frequency - branches[number].points[place].p)
        points.append((number, place + share / (share + 1), point))
    return failures


def _folds(
    path: FrequencyPath, branches: Sequence[Branch], control: StepControl
) -> tuple[list[HarmonicPoint], list[Failure]]:
    folds, failures = [], []
    for way in branches:
        for index in way.folds:
            try:
                turn = fold(path, way, index, control)
                folds.append(describe(path.at(turn.u, turn.p), turn.iterations, 0.0))
            except ContinuationError as error:
                failures.append(_failure(f"fold near {way.points[index].p:.6g} Hz", str(error)))
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


def _same(one: HarmonicPoint, other: HarmonicPoint) -> bool:
    """The same response, found twice."""
    if one.frequency != other.frequency or one.harmonics != other.harmonics:
        return False
    size = np.abs(other.output[1]).max()
    return bool(np.abs(one.output[1] - other.output[1]).max() <= 1e-4 * size)


class _Ladder:
    """Paths with more and more harmonics, held or walking, each with its factorisation to reuse."""

    def __init__(self, path: FrequencyPath, control: StepControl) -> None:
        self.paths = {(path.problem.harmonics, False): path}
        self.base = path
        self.control = control

    def solve(self, w: Array, frequency: float, adaptive: Adaptive | None) -> HarmonicPoint:
        """Solve with the harmonics of the branch; let go a joint that walks; add harmonics.

        Where the second or the third does not succeed, the point before it is returned; its `pull`
        and its `tail` say so.
        """
        began = clock.perf_counter()
        problem = self.base.problem
        point = self._point(problem, w, frequency, 0, began)
        if point.pull > PULL:
            released, guess = walking(problem, point.w)
            try:
                point = self._point(released, guess, frequency, point.iterations, began)
            except ContinuationError:
                pass
            else:
                problem = released
        while adaptive is not None and point.tail > adaptive.tolerance:
            if problem.harmonics + ADDED > adaptive.most:
                break
            more = with_harmonics(problem, problem.harmonics + ADDED)
            guess = padded(problem, more, point.w)
            try:
                point = self._point(more, guess, frequency, point.iterations, began)
            except ContinuationError:
                break
            problem = more
        return point

    def _point(
        self, problem: HarmonicProblem, w: Array, frequency: float, before: int, began: float
    ) -> HarmonicPoint:
        key = (problem.harmonics, problem.walks)
        if key not in self.paths:
            self.paths[key] = FrequencyPath(problem, self.base.load, self.base.parameter_scale)
        path = self.paths[key]
        _, equations, iterations = solve_at(path, w, frequency, self.control)
        assert isinstance(equations, EquationsAt)
        return describe(equations, before + iterations, clock.perf_counter() - began)


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
        folds=tuple(describe(path.at(turn.u, turn.p), turn.iterations, 0.0) for turn in folds),
        failures=tuple(failures),
    )

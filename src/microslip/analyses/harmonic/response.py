"""Periodic responses of a joint by harmonic balance, at given frequencies or loads.

The equations of `equations.py` are handed to `microslip.numerics.continuation` with the frequency (Hz) or
the load as parameter. A frequency response is begun by raising the load from zero at its first frequency;
then its branch is followed through folds; then the equations are solved at the frequencies asked for,
once for every time the branch passes them.
"""

from __future__ import annotations

import time as clock
from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np

from microslip.analyses.harmonic.adaptive import Adaptive, Ladder
from microslip.analyses.harmonic.over_time import OverTime
from microslip.analyses.harmonic.paths import (
    CONTROL,
    EquationsAt,
    FrequencyPath,
    LoadPath,
    frequency_scale,
)
from microslip.analyses.harmonic.points import HarmonicPoint, describe
from microslip.analyses.harmonic.problem import HarmonicProblem
from microslip.analyses.harmonic.raising import follow_frequency
from microslip.analyses.harmonic.seeking import Search, Way, failed
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
    search = Search(ladder, ways, (float(wanted.min()), float(wanted.max())), tell)
    for frequency in map(float, wanted):
        if stopped():
            failures.append(failed(f"load {load:.4g}", f"stopped before {frequency:.6g} Hz"))
            break
        search.at(frequency)
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


def _ways(
    problem: HarmonicProblem,
    load: float,
    wanted: Array,
    control: StepControl,
    tell: Callable[[BranchPoint], bool],
    stopped: Callable[[], bool],
) -> tuple[list[Way], list[Failure]]:
    """The branch from the first end, and that from the second where the first does not get there."""
    first, last = float(wanted[0]), float(wanted[-1])
    ways: list[Way] = []
    failures: list[Failure] = []
    for begin, end in ((first, last), (last, first)):
        try:
            way = Way(
                *follow_frequency(
                    problem, load, (begin, end), control=control, observe=tell, stops=wanted
                )
            )
        except ContinuationError as error:
            failures.append(failed("", str(error)))
            continue
        ways.append(way)
        if way.branch.ended != "range":
            where = f"branch at load {load:.4g} from {begin:.6g} Hz"
            failures.append(failed(where, way.branch.ended))
        if way.branch.points[-1].p == end or stopped():
            break
    return ways, failures


def _folds(ways: Sequence[Way], control: StepControl) -> tuple[list[HarmonicPoint], list[Failure]]:
    folds, failures = [], []
    for way in ways:
        for index in way.branch.folds:
            try:
                turn = fold(way.path, way.branch, index, control)
                folds.append(describe(way.path.at(turn.u, turn.p), turn.iterations, 0.0))
            except ContinuationError as error:
                near = way.branch.points[index].p
                failures.append(failed(f"fold near {near:.6g} Hz", str(error)))
    return folds, failures


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
        failures.append(failed(f"branch at {frequency:.6g} Hz", branch.ended))
    points = []
    for load in wanted:
        guesses = crossings(branch.points, float(load))
        if not guesses:
            where = f"load {load:.4g} at {frequency:.6g} Hz"
            failures.append(failed(where, "not on the branch found"))
        for guess, _ in guesses:
            began = clock.perf_counter()
            try:
                _, equations, iterations = solve_at(path, guess, float(load), control)
            except ContinuationError as error:
                failures.append(failed(f"load {load:.4g} at {frequency:.6g} Hz", str(error)))
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

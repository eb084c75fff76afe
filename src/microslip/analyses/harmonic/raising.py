"""Where a branch over frequency begins: the load raised from zero at one frequency.

The branch of rest is followed over the load, through folds. Where a joint begins to walk its supports alone
hold it, and the branch has corners that follow one another within a millionth of the load: Newton's method
ends beyond them, or the branch is followed back the way it came. What is wanted is a response under the whole
load, not that piece, so the load is then raised past it, as on a test bench: from the point of largest load
the equations are solved under a little more of it, and the branch through that answer is followed on. Where
no little more has an answer, fewer harmonics, and other augmentations, which have their corners elsewhere,
are raised in the same way, and their answer is the start of all harmonics (`starts.py`, `approach.py`).
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from dataclasses import replace

import numpy as np

from microslip.analyses.harmonic.approach import approached
from microslip.analyses.harmonic.paths import CONTROL, FrequencyPath, LoadPath, frequency_scale
from microslip.analyses.harmonic.points import describe
from microslip.analyses.harmonic.problem import HarmonicProblem, softened
from microslip.analyses.harmonic.starts import Start, first_step, start_from_point
from microslip.contact.samples import sample_table
from microslip.errors import MicroslipError
from microslip.numerics.continuation import (
    Branch,
    BranchPoint,
    ContinuationError,
    StepControl,
    first_point,
    solve_at,
    trace,
)
from microslip.typing import Array

RAISED_BY = (1.0, 0.1)
"""Shares of the usual steps by which a load is raised, one after the other where it is not reached."""

LEAPS = (0.01, 0.03, 0.1, 0.3)
"""Shares of the load by which it is raised at once past a piece of the branch that is not passed."""

MOST_LEAPS = 10

LANDING = 30, 8
"""Newton steps of a leap at most; of these, those in which the residual has to fall to a half."""

FEWER = (3, 1)
"""Harmonics that are raised instead, where all of them are not."""

AUGMENTED = (1.0, 0.3, 0.1)
"""Augmentations of those, over that of the equations."""


def raise_load(
    problem: HarmonicProblem, frequency: float, load: float, control: StepControl = CONTROL
) -> tuple[Array, Branch]:
    """Raise the load from zero at one frequency; returns the unknowns and the last piece of the branch.

    Parameters
    ----------
    problem : HarmonicProblem
    frequency : float
        Hz.
    load : float
        Amplitude of the driven port.
    control : StepControl, optional

    Raises
    ------
    ContinuationError
        Where the load cannot be reached: names how far it got.
    """
    best = _raised(problem, frequency, load, control)
    for start in _with_fewer(problem, frequency, load, control, best):
        try:
            return _from_start(start, frequency, load, control)
        except ContinuationError:
            continue
    if best.points[-1].p != load:
        raise ContinuationError(
            f"harmonic balance at {frequency:.6g} Hz: the load got to {_top(best, load).p:.4g} of "
            f"{load:.4g} only ({best.ended}), nor did it with fewer harmonics; start farther from the "
            "resonance"
        )
    return best.points[-1].u, best


def _top(branch: Branch, load: float) -> BranchPoint:
    """The point of largest load."""
    return max(branch.points, key=lambda point: point.p / load if load else 0.0)


def _raised(
    problem: HarmonicProblem, frequency: float, load: float, control: StepControl
) -> Branch:
    """The branch that ends at the load, or got farthest."""
    path = LoadPath(problem, frequency, load)
    start = first_point(path, problem.rest(), 0.0, control)
    bounds = (min(0.0, load), max(0.0, load))
    for share in RAISED_BY:
        finer = replace(control, first=share * control.first, largest=share * control.largest)
        branch = trace(path, start, bounds, finer)
        if branch.points[-1].p == load:
            return branch
    for _ in range(MOST_LEAPS):
        beyond = _leapt(path, _top(branch, load), load, control)
        if beyond is None:
            break
        branch = Branch((beyond,), "range")
        if beyond.p != load:
            branch = trace(path, beyond, bounds, control)
        if branch.points[-1].p == load:
            break
    return branch


def _leapt(
    path: LoadPath, here: BranchPoint, load: float, control: StepControl
) -> BranchPoint | None:
    """A point under more of the load; None where none is found."""
    steps, patience = LANDING
    patient = replace(control, max_iterations=steps, patience=patience)
    for share in LEAPS:
        p = load * min(here.p / load + share, 1.0)
        ahead = np.zeros_like(here.u)
        if here.tangent_p * load > 0:
            ahead = (p - here.p) / here.tangent_p * here.tangent_u
        for guess in (here.u + ahead, here.u):
            try:
                return first_point(path, guess, p, patient, np.sign(load))
            except ContinuationError:
                continue
    return None


def _with_fewer(
    problem: HarmonicProblem, frequency: float, load: float, control: StepControl, best: Branch
) -> Iterator[Start]:
    """Starts from answers with fewer harmonics under the whole load; none where that is reached."""
    if best.points[-1].p == load:
        return
    for harmonics in FEWER:
        for factor in AUGMENTED if harmonics < problem.harmonics else ():
            table = sample_table(harmonics, problem.table.samples)
            fewer = softened(replace(problem, table=table), factor)
            try:
                branch = _raised(fewer, frequency, load, control)
            except ContinuationError:
                continue
            if branch.points[-1].p == load:
                there = LoadPath(fewer, frequency, load).at(branch.points[-1].u, load)
                yield start_from_point(problem, describe(there, 0, 0.0))


def _from_start(
    start: Start, frequency: float, load: float, control: StepControl
) -> tuple[Array, Branch]:
    """The response next to a start, by Newton's method or by small steps."""
    path = FrequencyPath(start.problem, load)
    try:
        w, _, _ = solve_at(path, first_step(path, start, frequency), frequency, control)
    except ContinuationError:
        w, _, _ = solve_at(path, approached(path, start, frequency), frequency, control)
    over_load = LoadPath(start.problem, frequency, load)
    return w, Branch((first_point(over_load, w, load, control, np.sign(load)),), "range")


def follow_frequency(
    problem: HarmonicProblem,
    load: float,
    band: tuple[float, float],
    *,
    start: BranchPoint | None = None,
    control: StepControl = CONTROL,
    observe: Callable[[BranchPoint], bool] | None = None,
    stops: Sequence[float] | Array = (),
) -> tuple[FrequencyPath, Branch]:
    """Follow the response from the first frequency of the band to the second, through folds.

    Parameters
    ----------
    problem : HarmonicProblem
    load : float
    band : (float, float)
        Hz; the branch is begun at the first, which may be the higher one.
    start : BranchPoint, optional
        Point of an earlier branch of the same problem to go on from.
    stops : sequence of float, optional
        Hz that the branch steps on where it can (`continuation.trace`).
    """
    first, last = band
    if not (first > 0 and last > 0 and first != last):
        raise MicroslipError(f"the band {first:g} to {last:g} Hz needs two positive frequencies")
    path = FrequencyPath(problem, load, frequency_scale(band))
    if start is None:
        w, _ = raise_load(problem, first, load, control)
        start = first_point(path, w, first, control, np.sign(last - first))
    return path, trace(path, start, (min(band), max(band)), control, observe, stops)

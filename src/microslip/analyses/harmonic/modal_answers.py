"""Answers of harmonic balance in the modes alone, as those of all pairs are."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from microslip.analyses.harmonic.modal import (
    ModalEquations,
    ModalEvaluation,
    with_modal_samples,
)
from microslip.analyses.harmonic.modal_solver import ModalPath, solved
from microslip.analyses.harmonic.points import HarmonicPoint, described_by
from microslip.analyses.harmonic.problem import HarmonicProblem, padded
from microslip.errors import ContactError
from microslip.numerics.continuation import ContinuationError, StepControl
from microslip.numerics.execute import one_thread
from microslip.typing import Array


def balanced(
    problem: HarmonicProblem,
    w: Array,
    harmonics: int,
    at: tuple[float, float],
    control: StepControl,
    softer: float = 1.0,
) -> HarmonicPoint:
    """The response with so many harmonics at a frequency under a load.

    Parameters
    ----------
    problem : HarmonicProblem
        Of all pairs, with any number of harmonics.
    w : (n,) array
        Unknowns of it to start from.
    harmonics : int
    at : (float, float)
        Frequency, Hz, and load.
    control : StepControl
    softer : float
        Of the flexibility that harmonics left out have, over `modal.py`'s, for modes below them.

    Raises
    ------
    ContinuationError
        Also where contact is not solved, or cannot be linearised.
    """
    frequency, load = at
    new = with_modal_samples(problem, harmonics)
    try:
        equations = ModalEquations(new, 2 * np.pi * frequency, load, softer)
        z = equations.pack(equations.motion_of(padded(problem, new, w)))
        with one_thread():
            found, iterations = solved(ModalPath(equations), z, control)
    except ContactError as error:
        raise ContinuationError(str(error)) from error
    return replace(described(equations, found, frequency), iterations=iterations)


def described(equations: ModalEquations, found: ModalEvaluation, frequency: float) -> HarmonicPoint:
    """A solution as a response."""
    problem = equations.problem
    v = (problem.table.projection @ found.cycle.v).T
    residual = float(np.abs(found.F).max()) / problem.force_scale
    point = described_by(
        equations.operator,
        (frequency, equations.load),
        (equations.unknowns(found), v, np.ascontiguousarray(found.cycle.status.T)),
        max(residual, found.cycle.residual),
    )
    return replace(point, modal=True)

"""Answers of harmonic balance in the modes alone, as those of all pairs are.

The flexibility that harmonics left out are taken to have is tried as it is, and softer: with a softer one
contact is gentler and Newton's method gets farther. From an answer with a softer one it then gets to those
with stiffer ones.
"""

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
from microslip.analyses.harmonic.problem import HarmonicProblem
from microslip.numerics.continuation import StepControl
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
    """
    frequency, load = at
    new = with_modal_samples(problem, harmonics)
    equations = ModalEquations(new, 2 * np.pi * frequency, load, softer)
    path, z = ModalPath(equations), equations.pack(equations.motion_of(w))
    with one_thread():
        found, iterations = solved(path, z, control)
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

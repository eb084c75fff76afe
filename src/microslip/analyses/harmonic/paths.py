"""Equations of harmonic balance as continuation takes them: over frequency, or over load."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from microslip.analyses.harmonic.equations import (
    Evaluation,
    evaluate,
    frequency_derivative,
    load_derivative,
)
from microslip.analyses.harmonic.linear import HarmonicSolver
from microslip.analyses.harmonic.operator import LinearOperator, linear_operator
from microslip.analyses.harmonic.problem import HarmonicProblem
from microslip.contact.pairs import tangential_vectors
from microslip.numerics.continuation import ContinuationError, Linearised, StepControl
from microslip.typing import Array

ACCEPTED = 1e-8
"""Residual of a solution, relative to the largest prestress reaction."""


CONTROL = StepControl(
    first=0.02, smallest=1e-6, largest=0.5, good_iterations=6, tolerance=0.1 * ACCEPTED
)
"""Steps along a response; a step of length one changes every reaction by the prestress's largest."""

STEP_IN_FREQUENCY = 1 / 175
"""Relative change of the frequency that counts as a step of length one."""


class EquationsAt:
    """Equations at one point, scaled, with their derivative (`continuation.Linearised`).

    Parameters
    ----------
    operator : LinearOperator
    frequency, load : float
        Hz, and amplitude of the driven port.
    w : (n,) array
        Unknowns.
    solver : HarmonicSolver
    parameter : str
        ``"frequency"`` or ``"load"``: what the branch is followed over.
    """

    def __init__(
        self,
        operator: LinearOperator,
        frequency: float,
        load: float,
        w: Array,
        solver: HarmonicSolver,
        parameter: str,
    ) -> None:
        self.operator = operator
        self.frequency = float(frequency)
        self.load = float(load)
        self.solver = solver
        self.parameter = parameter
        self.scale = operator.problem.force_scale
        self.point: Evaluation = evaluate(operator, load, w)

    @property
    def F(self) -> Array:
        """Residual over the largest prestress reaction."""
        return self.point.F / self.scale

    def solve(self, right: Array, tolerance: float, guess: Array | None = None) -> Array:
        """Solve with the derivative by the unknowns."""
        return self.solver.linear_solve(
            self.operator, self.point.cycle, right * self.scale, tolerance, guess
        )

    def corner(self, beyond: Linearised) -> float | None:
        """Share of a step at which a pair that sticks all cycle stands where it has stuck from the beginning.

        Soft springs alone hold a joint that hardly walks: a step slides it past there from one end of what
        friction holds to the other, and one back as far. Of pairs that are passed, that with the largest
        mean traction out of balance beyond.
        """
        assert isinstance(beyond, EquationsAt)
        problem = self.operator.problem
        if problem.walks or not problem.slides:
            return None
        d = problem.dimension
        v_0, v_1 = (tangential_vectors(each.point.v[:, 0], d) for each in (self, beyond))
        way = v_1 - v_0
        along = ((problem.held - v_0) * way).sum(axis=1)
        whole = (way**2).sum(axis=1)
        passed = (along > 0) & (along < whole)
        if not passed.any():
            return None
        F, _ = problem.split(beyond.point.F)
        rest = np.linalg.norm(tangential_vectors(F[:, 0], d), axis=1)
        pair = int(np.argmax(np.where(passed, rest, -1.0)))
        return float(along[pair] / whole[pair])

    def by_parameter(self) -> Array:
        """Derivative of the residual by frequency (Hz) or load."""
        if self.parameter == "load":
            return load_derivative(self.operator, self.point) / self.scale
        slope = frequency_derivative(self.operator, self.point, self.load)
        return slope * (2 * np.pi / self.scale)


class _Path:
    """What both parameters share (`continuation.Problem`)."""

    def __init__(self, problem: HarmonicProblem, scale: float) -> None:
        self.problem = problem
        self.solver = HarmonicSolver()
        reactions = np.full(problem.shape, 1 / (problem.force_scale**2 * len(problem.pairs)))
        self.weight = np.concatenate([reactions.ravel(), np.zeros(problem.rigid_modes.shape[1])])
        self.parameter_scale = scale


class FrequencyPath(_Path):
    """Response at a given load, the frequency (Hz) as parameter.

    Parameters
    ----------
    problem : HarmonicProblem
    load : float
    scale : float
        Hz that count as a step of length one.
    """

    def __init__(self, problem: HarmonicProblem, load: float, scale: float = 1.0) -> None:
        super().__init__(problem, scale)
        self.load = float(load)
        self._operator: LinearOperator | None = None

    def at(self, w: Array, frequency: float) -> EquationsAt:
        """Equations at a frequency."""
        if not frequency > 0:
            raise ContinuationError(f"frequency {frequency:g} Hz must be positive")
        omega = 2 * np.pi * frequency
        if self._operator is None or self._operator.omega != omega:
            self._operator = linear_operator(self.problem, omega)
        return EquationsAt(self._operator, frequency, self.load, w, self.solver, "frequency")


class LoadPath(_Path):
    """Response at a given frequency, the load as parameter.

    Parameters
    ----------
    problem : HarmonicProblem
    frequency : float
        Hz.
    scale : float
        Load that counts as a step of length one.
    """

    def __init__(self, problem: HarmonicProblem, frequency: float, scale: float) -> None:
        super().__init__(problem, scale)
        self.frequency = float(frequency)
        self.operator = linear_operator(problem, 2 * np.pi * frequency)

    def at(self, w: Array, load: float) -> EquationsAt:
        """Equations under a load."""
        return EquationsAt(self.operator, self.frequency, load, w, self.solver, "load")


def frequency_scale(frequencies: Sequence[float] | Array) -> float:
    """Change of the frequency, Hz, that counts as a step of length one on a branch over them.

    A share of their middle: what a joint does does not depend on the unit of time.

    Examples
    --------
    >>> frequency_scale([150.0, 200.0])
    1.0
    """
    return STEP_IN_FREQUENCY * 0.5 * float(np.min(frequencies) + np.max(frequencies))

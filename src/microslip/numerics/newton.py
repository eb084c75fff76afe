"""Newton's method at a given parameter or across a branch, and tangents, for `continuation.py`."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Protocol

import numpy as np

from microslip.errors import MicroslipError
from microslip.typing import Array


class ContinuationError(MicroslipError):
    """A point of a branch was not found."""


class Linearised(Protocol):
    """``F`` and its derivative at one point."""

    @property
    def F(self) -> Array:
        """Residual, (n,), in units in which the tolerance means something."""

    def solve(self, right: Array, tolerance: float, guess: Array | None = None) -> Array:
        """Solve ``J z = right`` to a relative residual, from a guess; raises `ContinuationError`."""

    def by_parameter(self) -> Array:
        """``F_p``, (n,)."""


class Problem(Protocol):
    """Equations ``F(u, p) = 0`` with a metric."""

    @property
    def weight(self) -> Array:
        """Weight of each unknown in the inner product, (n,)."""

    @property
    def parameter_scale(self) -> float:
        """Change of p that counts as a step of length one."""

    def at(self, u: Array, p: float) -> Linearised:
        """Evaluate; raises `ContinuationError` where p has no meaning."""


@dataclass(frozen=True)
class StepControl:
    """How far to step, and when a point counts as found.

    Attributes
    ----------
    first, smallest, largest : float
        Length of a step.
    good_iterations : int
        Newton steps at which the length stays as it is; more shrink it, fewer let it grow.
    max_iterations : int
        Newton steps until a step is given up and halved.
    tolerance : float
        Largest entry of F at a point.
    max_points : int
    patience : int
        A step is given up as well where so many Newton steps have not halved the residual; 0 waits on.
    """

    first: float = 0.05
    smallest: float = 1e-5
    largest: float = 1.0
    good_iterations: int = 5
    max_iterations: int = 15
    tolerance: float = 1e-8
    max_points: int = 500
    patience: int = 0


def inner(problem: Problem, u1: Array, p1: float, u2: Array, p2: float) -> float:
    """Inner product that lengths and angles are measured with."""
    return float(u1 @ (problem.weight * u2)) + p1 * p2 / problem.parameter_scale**2


def size(equations: Linearised) -> float:
    """Largest entry of the residual."""
    return float(np.abs(equations.F).max())


TANGENT_ACCURACY = 1e-5
STEP_ACCURACY = 1e-3


def unit_tangent(
    problem: Problem, equations: Linearised, old_u: Array, old_p: float, guess: Array | None
) -> tuple[Array, float]:
    """Unit tangent, on the side of the old one."""
    b = equations.solve(-equations.by_parameter(), TANGENT_ACCURACY, guess)
    length = np.sqrt(inner(problem, b, 1.0, b, 1.0))
    side = np.sign(inner(problem, b, 1.0, old_u, old_p)) or 1.0
    return side * b / length, float(side / length)


def newton(
    problem: Problem,
    u: Array,
    p: float,
    control: StepControl,
    across: tuple[Array, float] | None,
) -> tuple[Array, float, Linearised, int, Array | None]:
    """Newton's method at fixed p, or in the hyperplane through (u, p) across a direction.

    Of the steps 1, 1/2, 1/4 ... the first that makes the residual smaller is taken. Returns the last b, too.
    """
    equations = problem.at(u, p)
    b = across[0] / across[1] if across is not None and across[1] else None
    errors: list[float] = []
    for iteration in range(control.max_iterations + 1):
        error = size(equations)
        if not np.isfinite(error):
            break
        if error <= control.tolerance:
            return u, p, equations, iteration, b
        errors.append(error)
        if iteration == control.max_iterations or _stalls(errors, control.patience):
            break
        du = equations.solve(-equations.F, STEP_ACCURACY)
        dp = 0.0
        if across is not None:
            b = _direction(problem, equations, du, across, b)
            dp = -inner(problem, du, 0.0, *across) / inner(problem, b, 1.0, *across)
            du = du + dp * b
        before = float(np.linalg.norm(equations.F))
        length = 1.0
        for _ in range(6):
            trial = problem.at(u + length * du, p + length * dp)
            if np.linalg.norm(trial.F) < (1 - 0.1 * length) * before:
                break
            length *= 0.5
        else:
            length *= 2.0
        u, p, equations = u + length * du, p + length * dp, trial
    raise ContinuationError(
        f"no point near p = {p:.6g}: residual {error:.1e} after {iteration} Newton steps"
    )


def _stalls(errors: Sequence[float], patience: int) -> bool:
    return 0 < patience < len(errors) and errors[-1] > 0.5 * min(errors[:-patience])


def _direction(
    problem: Problem,
    equations: Linearised,
    du: Array,
    across: tuple[Array, float],
    guess: Array | None,
) -> Array:
    """``b`` with ``J b = -F_p``, so well that ``dp b`` leaves no more of F than ``du`` does."""
    slope = equations.by_parameter()
    tolerance = STEP_ACCURACY
    if guess is not None:
        dp = inner(problem, du, 0.0, *across) / inner(problem, guess, 1.0, *across)
        felt = abs(dp) * float(np.linalg.norm(slope))
        tolerance *= max(1.0, float(np.linalg.norm(equations.F)) / max(felt, 1e-300))
    return equations.solve(-slope, min(tolerance, 0.3), guess)

"""Newton's method at a given parameter or across a branch, and tangents, for `continuation.py`."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Protocol, runtime_checkable

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


@runtime_checkable
class Cornered(Protocol):
    """Equations that know where a step passes a corner too sharp for their derivative on either side."""

    def corner(self, beyond: Linearised) -> float | None:
        """Share of the step to a state beyond the corner at which it is passed; None without one."""


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
STEP_ACCURACY = 3e-4

LEAST_ACCURACY = 0.03
"""Relative residual of the linear equations of a step, where those of the steps before have not shrunk."""


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

    Of the steps 1, the one to a corner (`Cornered`), 1/2, 1/4 ... the first that makes the residual
    smaller is taken. Returns the last b, too.
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
        wanted = _accuracy(errors, control.tolerance) if across is None else STEP_ACCURACY
        du = equations.solve(-equations.F, wanted)
        dp = 0.0
        if across is not None:
            b = _direction(problem, equations, du, across, b)
            dp = -inner(problem, du, 0.0, *across) / inner(problem, b, 1.0, *across)
            du = du + dp * b
        length, equations = _shortened(problem, equations, (u, p), (du, dp))
        u, p = u + length * du, p + length * dp
    raise ContinuationError(
        f"no point near p = {p:.6g}: residual {error:.1e} after {iteration} Newton steps"
    )


def _stalls(errors: Sequence[float], patience: int) -> bool:
    return 0 < patience < len(errors) and errors[-1] > 0.5 * min(errors[:-patience])


HALVINGS = 5


def _shortened(
    problem: Problem, equations: Linearised, start: tuple[Array, float], step: tuple[Array, float]
) -> tuple[float, Linearised]:
    """The share of a step that is taken, and the equations there."""
    (u, p), (du, dp) = start, step
    before = float(np.linalg.norm(equations.F))

    def tried(length: float) -> tuple[Linearised, bool]:
        trial = problem.at(u + length * du, p + length * dp)
        return trial, bool(np.linalg.norm(trial.F) < (1 - 0.1 * length) * before)

    trial, good = tried(1.0)
    if good:
        return 1.0, trial
    corner = equations.corner(trial) if isinstance(equations, Cornered) else None
    if corner is not None:
        there, good = tried(corner)
        if good:
            return corner, there
    length = 1.0
    for _ in range(HALVINGS):
        length *= 0.5
        trial, good = tried(length)
        if good:
            break
    return length, trial


def _accuracy(errors: Sequence[float], tolerance: float) -> float:
    """Relative residual of the linear equations of the next step: as F has shrunk, squared.

    While states still change a step reduces F by little, however well it is known (S. C. Eisenstat &
    H. F. Walker, SIAM J. Sci. Comput. 17 (1996) 16, choice 2). No better than to a tenth of the tolerance.
    Across a branch two solutions make up a step, and what they leave adds up: steps there are solved well.
    """
    shrunk = errors[-1] / errors[-2] if len(errors) > 1 else 1.0
    asked = max(STEP_ACCURACY, 0.1 * tolerance / errors[-1])
    return float(np.clip(shrunk**2, asked, LEAST_ACCURACY))


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

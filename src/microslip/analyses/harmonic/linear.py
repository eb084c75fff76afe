"""Linear systems of harmonic balance: the condensed equations, a Krylov solver, a kept factorisation.

Every component that is open, touches or sticks all cycle is eliminated exactly (`condensed.py`), and GMRES
solves for the rest. Its preconditioner, a factorisation in single precision, is kept for later iterations,
frequencies and loads, and renewed when GMRES needs many iterations or other components change state. Where
many iterations renew it, components that no longer change are eliminated as well.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field

import numpy as np

from microslip.analyses.harmonic.condensed import (
    CoupledEquations,
    Elimination,
    Resonator,
    eliminate,
    static_share,
)
from microslip.analyses.harmonic.equations import derivative_times
from microslip.analyses.harmonic.factorisation import Factorisation
from microslip.analyses.harmonic.operator import LinearOperator
from microslip.contact.aft import ContactCycle
from microslip.numerics.continuation import ContinuationError
from microslip.typing import Array

RENEW_AFTER, WORTH_STEPS = 12, 60
"""A factorisation is made anew when GMRES needs so many iterations more than with a fresh one, or one more
for every so many unknowns if that is more: it costs as the cube of them, an iteration as the square."""

MAX_KRYLOV = 80

CHECKED = 1e-5
"""Relative residual below which the solution is put into the whole equations, and refined."""

REFINEMENTS = 3


def gmres(
    apply: Callable[[Array], Array],
    precondition: Callable[[Array], Array],
    right: Array,
    allowed: float,
    limit: int,
) -> tuple[Array, int, float]:
    """GMRES without restarts, preconditioned from the right.

    Returns the solution, the iterations and the residual reached, `allowed` or more.
    """
    size = float(np.linalg.norm(right))
    if size <= allowed:
        return np.zeros_like(right), 0, size
    basis, directions = np.empty((limit + 1, right.size)), np.empty((limit, right.size))
    basis[0] = right / size
    R = np.zeros((limit, limit))
    rotations: list[tuple[float, float]] = []
    rest = np.zeros(limit + 1)
    rest[0] = size
    used = 0
    for j in range(limit):
        directions[j] = precondition(basis[j])
        w = apply(directions[j])
        share = np.zeros(j + 1)
        for _ in range(2):
            more = basis[: j + 1] @ w
            w = w - more @ basis[: j + 1]
            share += more
        length = float(np.linalg.norm(w))
        if not np.isfinite(length):
            return np.zeros_like(right), j + 1, np.inf
        # the new column of the Hessenberg matrix, turned by all Givens rotations
        for i, (cos, sin) in enumerate(rotations):
            share[i], share[i + 1] = (
                cos * share[i] + sin * share[i + 1],
                cos * share[i + 1] - sin * share[i],
            )
        diagonal = float(np.hypot(share[j], length))
        if diagonal == 0.0:
            break
        cos, sin = share[j] / diagonal, length / diagonal
        rotations.append((cos, sin))
        share[j] = diagonal
        R[: j + 1, j] = share
        rest[j], rest[j + 1] = cos * rest[j], -sin * rest[j]
        used = j + 1
        if abs(rest[used]) <= allowed or length <= 1e-14 * size:
            break
        basis[used] = w / length
    weights = np.linalg.solve(R[:used, :used], rest[:used])
    return weights @ directions[:used], used, abs(float(rest[used]))


@dataclass
class Counts:
    """Work of the solver.

    Attributes
    ----------
    krylov, factorisations : int
    """

    krylov: int = 0
    factorisations: int = 0


@dataclass
class HarmonicSolver:
    """Keeps the last factorisation from one point to the next; the answers do not depend on it.

    Attributes
    ----------
    counts : Counts
    """

    counts: Counts = field(default_factory=Counts)
    _share: Array | None = None
    _sets: Elimination | None = None
    _resonator: Resonator | None = None
    _equations: CoupledEquations | None = None
    _factor: Factorisation | None = None
    _stale: bool = False
    _fresh_iterations: int = 0

    def linear_solve(
        self,
        operator: LinearOperator,
        cycle: ContactCycle,
        right: Array,
        tolerance: float,
        guess: Array | None = None,
    ) -> Array:
        """Solve ``J z = right`` to a relative residual, from a guess if there is one.

        Raises
        ------
        ContinuationError
            Where even a fresh factorisation does not solve it: the derivative is singular.
        """
        allowed = tolerance * float(np.linalg.norm(right))
        equations = self._condense(operator, cycle)
        z, error = self._solve(equations, right, allowed, guess)
        if tolerance <= CHECKED:
            for _ in range(REFINEMENTS):
                rest = right - derivative_times(operator, cycle, z)
                error = float(np.linalg.norm(rest))
                if error <= allowed:
                    break
                z = z + self._solve(equations, rest, 0.5 * allowed, None)[0]
        if not error <= 0.5 * max(float(np.linalg.norm(right)), 1e-300):
            raise ContinuationError(
                f"the linearised equations are singular (error {error / np.linalg.norm(right):.1e})"
            )
        return z

    def _solve(
        self, equations: CoupledEquations, right: Array, allowed: float, guess: Array | None
    ) -> tuple[Array, float]:
        known, particular = equations.condense(right)
        start = np.zeros_like(known) if guess is None else equations.coupled_part(guess)
        if guess is not None:
            known = known - equations.apply(start)
        for _ in range(2):
            fresh = self._factor is None or self._stale or self._factor.sets is not equations.sets
            if fresh:
                self._factor = Factorisation(equations)
                self._stale = False
                self.counts.factorisations += 1
            assert self._factor is not None
            with np.errstate(invalid="ignore", over="ignore"):
                x, iterations, error = gmres(
                    equations.apply, self._factor.solve, known, allowed, MAX_KRYLOV
                )
            self.counts.krylov += iterations
            if fresh:
                self._fresh_iterations = iterations
            late = max(RENEW_AFTER, len(known) // WORTH_STEPS)
            self._stale = iterations > self._fresh_iterations + late
            if error <= allowed or fresh:
                break
            self._stale = True
        return equations.restore(start + x, particular), error

    def _condense(self, operator: LinearOperator, cycle: ContactCycle) -> CoupledEquations:
        """The condensed equations, with what is left of the last ones."""
        last = self._equations
        large = self._stale and self._sets is not None and self._sets.spares(cycle)
        if last is not None and last.operator is operator and last.cycle is cycle and not large:
            return last
        if last is None or not self._fits(last.operator, operator):
            self._share, self._sets = static_share(operator.problem), None
        if self._sets is None or large or not self._sets.holds(cycle):
            assert self._share is not None
            self._sets, self._resonator = eliminate(operator.problem, cycle, self._share), None
        if self._resonator is None or not self._resonator.fits(operator):
            self._resonator = Resonator(operator, self._sets)
        self._equations = CoupledEquations(operator, cycle, self._sets, self._resonator)
        return self._equations

    def _fits(self, one: LinearOperator, other: LinearOperator) -> bool:
        old, new = one.problem, other.problem
        return old.table is new.table and old.residual is new.residual and old.walks == new.walks

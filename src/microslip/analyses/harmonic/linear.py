"""Linear systems of harmonic balance: the condensed equations, solved by GMRES with a kept factorisation.

Every component that is open, touches or sticks all cycle is eliminated exactly (`condensed.py`), and GMRES
solves for the rest. Its preconditioner, a factorisation in single precision, is kept for later iterations,
frequencies and loads, and renewed when GMRES needs many iterations or other components change state. Where
many iterations renew it, components that no longer change are eliminated as well.
"""

from __future__ import annotations

from dataclasses import dataclass, field
from functools import partial

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
from microslip.analyses.harmonic.krylov import Counts, Kept
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


@dataclass
class HarmonicSolver:
    """Keeps the last factorisation from one point to the next; the answers do not depend on it.

    Attributes
    ----------
    kept : Kept
    """

    kept: Kept[Factorisation] = field(default_factory=Kept)
    _share: Array | None = None
    _sets: Elimination | None = None
    _resonator: Resonator | None = None
    _equations: CoupledEquations | None = None

    @property
    def counts(self) -> Counts:
        """Work so far."""
        return self.kept.counts

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
        kept, late = self.kept, max(RENEW_AFTER, len(known) // WORTH_STEPS)
        if kept.factor is not None and kept.factor.sets is not equations.sets:
            kept.factor = None
        x, error = kept.solve(
            equations.apply, partial(Factorisation, equations), known, allowed, MAX_KRYLOV, late
        )
        return equations.restore(start + x, particular), error

    def _condense(self, operator: LinearOperator, cycle: ContactCycle) -> CoupledEquations:
        """The condensed equations, with what is left of the last ones."""
        last = self._equations
        large = self.kept.stale and self._sets is not None and self._sets.spares(cycle)
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

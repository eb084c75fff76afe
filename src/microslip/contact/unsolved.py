"""Why a planar contact problem was not solved, in a sentence that says what to try."""

from __future__ import annotations

import numpy as np

from microslip.contact.lemke import RAY, TOO_LONG, complementarity_form, lemke
from microslip.contact.pairs import normal, tangential
from microslip.contact.planar import PIVOTS, SMALLEST_PIVOTS
from microslip.contact.problem import Contact, Given, Problem

NOTHING_HOLDS = (
    "there is no solution: the load does work along a motion of the bodies that neither contact nor "
    "supports resist; it opens the joint or slides it apart"
)
FRICTION_ALONE = (
    "friction alone holds a motion of the bodies along which the load does work, and whether it can "
    "was not found; add a support"
)
NEGATIVE = (
    "a motion of the bodies has more inertia than support at this frequency, a negative stiffness, "
    "for which there need not be a solution"
)
NOT_DEFINITE = "the flexibility is not positive definite, and there need not be a solution"
NOT_ENDED = "the last resort did not end, and whether there is a solution is not known"
ROUNDING = (
    "a solution exists, but rounding keeps it from its residual; check the units and the mesh"
)


def why_unsolved(problem: Problem, given: Given, left: Contact | None = None) -> str:
    """Say why a problem that the solver left has no solution, or none that was found.

    With a positive definite W and no negative K_q the end of Lemke's method decides. On a ray its
    motion q proves that there is no solution where no reactions within the cones of friction do
    work against it, ``(R q)_n + mu |(R q)_t| <= 0`` at every pair, and the load does some with it.
    What the solver left says nothing of that and is not asked.
    """
    if (problem.stiffness < 0).any():
        return NEGATIVE
    if np.linalg.eigvalsh(problem.W)[0] <= 0:
        return NOT_DEFINITE
    M, b = complementarity_form(problem, given)
    outcome, z, _ = lemke(M, b, np.ones(len(b)), PIVOTS * len(b), SMALLEST_PIVOTS[-1])
    if outcome == TOO_LONG:
        return NOT_ENDED
    if outcome != RAY:
        return ROUNDING
    there, back = z[4 * len(problem.friction) :].reshape(-1, 2).T
    moved = problem.R @ ((there - back) * problem.scale)
    resisted = normal(moved) + problem.friction * np.abs(tangential(moved))
    return NOTHING_HOLDS if resisted.max() <= 1e-9 * np.abs(moved).max() else FRICTION_ALONE

"""Why a spatial contact problem was not solved, in a sentence that names the pair and says what to try."""

from __future__ import annotations

import numpy as np

from microslip.contact.lemke import RAY, lemke
from microslip.contact.pairs import normal, tangential_vectors
from microslip.contact.problem import Contact, Given, Problem
from microslip.contact.spatial_facets import PIVOTS, faceted_form, fan
from microslip.contact.spatial_problem import residual_of_pair, worst_pair
from microslip.contact.spatial_rescue import MOST_ROWS
from microslip.contact.unsolved import FRICTION_ALONE, NEGATIVE, NOT_DEFINITE, NOTHING_HOLDS
from microslip.typing import Array

SIDES = 16
"""Facets of the cones on which a free motion is looked for."""

NOT_FOUND = (
    "whether there is a solution is not known; take smaller steps, or less friction to compare with"
)


def why_unsolved(problem: Problem, given: Given, left: Contact) -> str:
    """Say why a problem that the solver left has no solution, or none that was found.

    A motion q with ``K_q q = 0`` proves that there is none where no reactions within the cones of friction
    do work against it, ``(R q)_n + mu |(R q)_t| <= 0`` at every pair, and the load does some with it.
    """
    if (problem.stiffness < 0).any():
        return NEGATIVE
    if np.linalg.eigvalsh(problem.W)[0] <= 0:
        return NOT_DEFINITE
    moved = free_motion(problem, given)
    if moved is not None:
        slip = np.linalg.norm(tangential_vectors(moved), axis=1)
        resisted = normal(moved, 3) + problem.friction * slip
        return NOTHING_HOLDS if resisted.max() <= 1e-9 * np.abs(moved).max() else FRICTION_ALONE
    pair = int(worst_pair(problem, given, left))
    size = residual_of_pair(problem, given.vt_old, left.r, left.v, pair)
    return f"the laws are violated most at pair {pair}, by {size:.1e} of its typical force; {NOT_FOUND}"


def free_motion(problem: Problem, given: Given) -> Array | None:
    """(3 m,) displacements of a motion of the bodies on which the contact ends, if there is one."""
    m = len(problem.friction)
    if not len(problem.stiffness) or m * (SIDES + 2) > MOST_ROWS:
        return None
    M, b = faceted_form(problem, given, fan(np.zeros((m, 2)), SIDES, 0.0, 0.0))
    outcome, z, _ = lemke(M, b, np.ones(len(b)), PIVOTS * len(b), 1e-15)
    if outcome != RAY:
        return None
    there, back = z[m * (SIDES + 2) :].reshape(-1, 2).T
    return np.asarray(problem.R @ ((there - back) * problem.scale))

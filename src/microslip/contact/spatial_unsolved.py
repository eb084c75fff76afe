"""Why a spatial contact problem was not solved, in a sentence that names the pair and says what to try."""

from __future__ import annotations

import numpy as np
from scipy.optimize import linprog

from microslip.contact.pairs import by_pair
from microslip.contact.problem import Contact, Given, Problem
from microslip.contact.spatial_problem import residual_of_pair, worst_pair
from microslip.contact.unsolved import NEGATIVE, NOT_DEFINITE, NOTHING_HOLDS

CUTS = 40
"""Rounds of tangent planes of the cones of friction."""

SMALL = 1e-9
"""Of motions of the size of one: what counts as none."""

NOT_FOUND = "whether there is a solution is not known"


def why_unsolved(problem: Problem, given: Given, left: Contact) -> str:
    """Say why a problem that the solver left has no solution, or none that was found."""
    if (problem.stiffness < 0).any():
        return NEGATIVE
    if np.linalg.eigvalsh(problem.W)[0] <= 0:
        return NOT_DEFINITE
    if nothing_holds(problem, given):
        return NOTHING_HOLDS
    pair = int(worst_pair(problem, given, left))
    size = residual_of_pair(problem, given.vt_old, left.r, left.v, pair)
    return f"the laws are violated most at pair {pair}, by {size:.1e} of its typical force; {NOT_FOUND}"


def nothing_holds(problem: Problem, given: Given) -> bool:
    """Whether the load does work along a motion of the bodies that neither contact nor supports resist.

    A motion q with ``K_q q = 0`` along which no reactions within the cones of friction do work,
    ``(R q)_n + mu |(R q)_t| <= 0`` at every pair, and with ``f_q q > 0`` proves that there is no solution.
    The cones are approached by their tangent planes where the motion last found touches them.
    """
    free = np.flatnonzero(problem.stiffness == 0)
    load = given.f_q[free] * problem.scale[free]
    top = np.abs(load).max(initial=0.0)
    if not top > 0:
        return False
    R = (problem.R[:, free] * problem.scale[free]).reshape(-1, 3, len(free)) / problem.mean
    angles = np.arange(8) * np.pi / 4
    rows = [R[:, 0] + problem.friction[:, None] * _along(R, np.cos(a), np.sin(a)) for a in angles]
    for _ in range(CUTS):
        planes = np.vstack(rows)
        found = linprog(-load / top, planes, np.zeros(len(planes)), bounds=(-1, 1), method="highs")
        if found.x is None or -found.fun <= SMALL:
            return False
        moved = by_pair(np.asarray(R.reshape(-1, len(free)) @ found.x), 3)
        slip = np.hypot(moved[:, 1], moved[:, 2])
        if (moved[:, 0] + problem.friction * slip).max() <= SMALL:
            return True
        way = moved[:, 1:] / np.where(slip > 0, slip, 1)[:, None]
        rows.append(R[:, 0] + problem.friction[:, None] * _along(R, way[:, :1], way[:, 1:]))
    return False


def _along(R: np.ndarray, c: np.ndarray | float, s: np.ndarray | float) -> np.ndarray:
    return np.asarray(c * R[:, 1] + s * R[:, 2])

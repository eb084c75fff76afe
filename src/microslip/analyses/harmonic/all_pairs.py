"""The equations of all pairs and those of half of them: one in terms of the other."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from microslip.analyses.harmonic.problem import HarmonicProblem, state_equations
from microslip.contact.law import ContactLaw
from microslip.typing import Array


def of_all_pairs(problem: HarmonicProblem) -> HarmonicProblem:
    """The same equations without the half turn.

    Bodies stand, and pairs that stick are held, where the clamp has put them.
    """
    friction = np.empty(problem.model.pairs)
    friction[problem.image], friction[problem.pairs] = problem.friction, problem.friction
    return state_equations(
        problem.model,
        problem.prestress,
        ContactLaw(friction, problem.compliance),
        problem.port,
        problem.coordinate,
        harmonics=problem.harmonics,
        half_turn=False,
    )


def placed_as(
    old: HarmonicProblem, new: HarmonicProblem, p: Array
) -> tuple[HarmonicProblem, Array]:
    """Equations of other pairs whose bodies stand, or walk from, where unknowns p of others have them.

    Returns them, and p as their unknowns.
    """
    places = np.linalg.pinv(new.rigid_modes) @ old.rigid_modes
    new = replace(new, walks=old.walks)
    stand = places @ old.place(p)
    if not old.walks:
        return replace(new, offset=np.zeros_like(stand)), stand
    drift = np.zeros_like(p)
    drift[old.walking] = p[old.walking]
    own, offset = new.walking, np.zeros_like(stand)
    offset[own] = stand[own] - new.rest_place[own]
    stand[own] = (places @ drift)[own]
    return replace(new, offset=offset), stand


def unfolded(
    problem: HarmonicProblem, whole: HarmonicProblem, w: Array
) -> tuple[HarmonicProblem, Array]:
    """The equations `whole` of all pairs for bodies that stand as in `problem`, and unknowns w as theirs."""
    held = np.empty_like(whole.held)
    held[problem.image], held[problem.pairs] = problem.held, problem.held
    u, _ = problem.split(w)
    new, p = placed_as(problem, replace(whole, table=problem.table, held=held), w[u.size :])
    return new, np.concatenate([problem.unfold(u).ravel(), p])


def folded(
    problem: HarmonicProblem, half: HarmonicProblem, w: Array
) -> tuple[HarmonicProblem, Array]:
    """The equations `half` for bodies that stand as in `problem` of all pairs, and unknowns w as theirs."""
    u, _ = problem.split(w)
    half = replace(half, held=problem.held[half.pairs])
    new, p = placed_as(problem, half, w[u.size :])
    return replace(new, table=problem.table), np.concatenate([u[half.rows].ravel(), p])

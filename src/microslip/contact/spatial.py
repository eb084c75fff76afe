"""Compiled solver of three-dimensional Signorini–Coulomb contact, one problem at a time.

Solves, for ``m`` contact pairs with ``v = (v_n, v_t)`` and two tangential directions per pair (layout of
`contact/pairs.py`),

    v = v_free + R q - W r,        K_q q + R^T r = f_q
    v_n <= 0,  r_n >= 0,  v_n r_n = 0                                   (Signorini)
    |r_t| <= mu r_n,  slip s = v_t - v_t_old:  |s| r_t = mu r_n s       (Coulomb)

with the round cone of friction: ``r_t`` has the direction of the slip wherever a pair slips. ``W`` is
the flexibility of the analysis, ``q`` are coordinates solved for in equilibrium.

Method. Semismooth Newton (`spatial_newton.py`) on a tableau of the touching pairs' stiffness
(`spatial_tableau.py`), from the states of the last problem: a few iterations as a rule and without a
guarantee. Behind it stand other starts (`spatial_rescue.py`). Whoever found it, a solution is
accepted only with its natural-map residual, computed from W.
"""

from __future__ import annotations

from microslip.contact.compiled import jit
from microslip.contact.problem import relative_displacement
from microslip.contact.spatial_newton import ACCEPTED, MOST, newton
from microslip.contact.spatial_problem import certify
from microslip.contact.spatial_rescue import (
    extragradient,
    facets,
    load_in_parts,
    other_scales,
    proximal,
)
from microslip.contact.tableau import WARM

PLAIN, RESCALED, PARTS, EXTRAGRADIENT, PROXIMAL, HALVED, FACETED, NOT_SOLVED = range(8)
"""How a problem was solved: Newton's method as it is, with other scales, on parts of the load, from
extragradient iterations, from proximal points, the load step halved, from faceted cones, not at all."""


@jit
def search(problem, memory, given, contact):
    """Newton's method from the states in `contact`, which holds the last solution.

    Returns ``(iterations, residual, rule)``; `rule` is `PLAIN`, `RESCALED` or `NOT_SOLVED`.
    """
    flags = memory.flags
    if flags[WARM]:
        for j in range(contact.v.shape[0]):
            contact.v[j] += given.v_free[j] - memory.v_free[j]
    else:
        memory.r[:] = contact.r
        memory.q[:] = contact.q
        memory.status[:] = contact.status
        relative_displacement(problem, given.v_free, contact.r, contact.q, contact.v)
        memory.v[:] = contact.v
    flags[WARM] = False
    iterations, residual = newton(problem, memory, given, contact, MOST, 1.0)
    if residual <= ACCEPTED:
        return iterations, residual, PLAIN
    more, residual = other_scales(problem, memory, given, contact)
    iterations += more
    if residual <= ACCEPTED:
        return iterations, residual, RESCALED
    return iterations, residual, NOT_SOLVED


@jit
def other_starts(problem, memory, given, contact):
    """The other ways, in their order; returns as `search`."""
    iterations = 0
    for rule in (PARTS, EXTRAGRADIENT, PROXIMAL, FACETED):
        if rule == PARTS:
            more, residual = load_in_parts(problem, memory, given, contact)
        elif rule == EXTRAGRADIENT:
            more, residual = extragradient(problem, memory, given, contact)
        elif rule == PROXIMAL:
            more, residual = proximal(problem, memory, given, contact)
        else:
            more, residual = facets(problem, memory, given, contact)
        iterations += more
        if residual <= ACCEPTED:
            return iterations, residual, rule
    return iterations, certify(problem, given, contact), NOT_SOLVED


@jit
def solve(problem, memory, given, contact):
    """Solve one contact problem from the states in `contact`.

    `contact` holds the last solution on entry and the new one on return.
    Returns ``(iterations, residual, rule)``; `rule` tells how it was solved.
    """
    iterations, residual, rule = search(problem, memory, given, contact)
    if rule == NOT_SOLVED:
        more, residual, rule = other_starts(problem, memory, given, contact)
        iterations += more
    memory.solved[rule] += 1
    return iterations, residual, rule

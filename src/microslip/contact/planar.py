"""Compiled solver of planar Signorini–Coulomb contact, one problem at a time.

Solves, for ``m`` contact pairs with ``v = (v_n, v_t)`` per pair (layout of `contact/pairs.py`),

    v = v_free + R q - W r,        K_q q + R^T r = f_q
    v_n <= 0,  r_n >= 0,  v_n r_n = 0                                   (Signorini)
    |r_t| <= mu r_n,  slip v_t - v_t_old parallel to r_t when |r_t| = mu r_n   (Coulomb)

``W`` is the flexibility of the analysis (static, time step, ...), ``q`` are coordinates solved for
in equilibrium (rigid-body modes, possibly with weak springs ``K_q``).

Method. An active set finds the states of the pairs from those of the last problem (`active_set.py`),
in a few iterations as a rule and without a guarantee. Where it fails, Lemke's method (`lemke.py`)
finds the states of a solution, which exists for positive definite W where no free motion lets the
load do work; for these states the equations are then solved as for any others. Whoever found it, a
solution is accepted only with its natural-map residual.
"""

from __future__ import annotations

import numpy as np

from microslip.contact.active_set import ACCEPTED, LEMKE, NOT_SOLVED, hold, search
from microslip.contact.compiled import jit
from microslip.contact.lemke import SOLUTION, complementarity_form, lemke, states_of

SMALLEST_PIVOTS = (1e-9, 1e-11, 1e-13, 1e-15)
"""Of the attempts at Lemke's method, each with a covering vector of its own: rounding may spoil one way
and not another, and a support that is soft beside the contact needs small pivots."""

PIVOTS = 30
"""Most pivots, over the number of rows; a few are usual."""


@jit
def solve(problem, memory, given, contact):
    """Solve one contact problem from the states in `contact`.

    `contact` holds the last solution on entry and the new one on return. The memory must belong to
    its states in the sense of `tableau.follow` or `tableau.restart`.
    Returns ``(iterations, residual, rule)``; `rule` tells how states were changed.
    """
    iterations, residual, rule = search(problem, memory, given, contact)
    if rule == NOT_SOLVED:
        more, residual, rule = last_resort(problem, memory, given, contact)
        iterations += more
    memory.solved[rule] += 1
    return iterations, residual, rule


@jit
def last_resort(problem, memory, given, contact):
    """Solve one contact problem by Lemke's method; takes nothing from `contact`, and returns as `solve`.

    Not tried with a negative K_q, for which it has no proof: what it found would be one of many.
    """
    for a in range(problem.stiffness.shape[0]):
        if problem.stiffness[a] < 0.0:
            return 0, np.inf, NOT_SOLVED
    M, b = complementarity_form(problem, given)
    n = b.shape[0]
    d = np.ones(n)
    iterations = 0
    residual = np.inf
    for attempt in range(len(SMALLEST_PIVOTS)):
        outcome, z, pivots = lemke(M, b, d, PIVOTS * n, SMALLEST_PIVOTS[attempt])
        iterations += pivots
        if outcome == SOLUTION:
            states_of(z, contact.status)
            residual = hold(problem, memory, given, contact)
            if not residual <= ACCEPTED:
                # rounding left pairs on the wrong side of a limit: the active set moves them
                more, residual, _ = search(problem, memory, given, contact)
                iterations += more
            if residual <= ACCEPTED:
                return iterations, residual, LEMKE
        for i in range(n):
            d[i] = 1.0 + 0.5 * np.sin(1.0 + (attempt + 1) * i)
    return iterations, residual, NOT_SOLVED

"""How far off the solution of a spatial contact problem is, by the laws of `spatial.py`.

Problems, what they are given and what is solved for are the named tuples of `problem.py`, with three
components a pair; ``vt_old`` is (m, 2). The unit of a pair's displacement is that of its own compliance,
one for both tangential directions so that it does not depend on how they are chosen.
"""

from __future__ import annotations

import numpy as np

from microslip.contact.compiled import jit
from microslip.contact.problem import relative_displacement


@jit
def own_stiffness(own, i):
    """Stiffness of pair i when all others are free of reactions, normal and mean tangential.

    By the diagonal of W, `own`.
    """
    n = 3 * i
    return 1.0 / own[n], 2.0 / (own[n + 1] + own[n + 2])


@jit
def off_cone(rn, r1, r2, trial_n, y1, y2, mu):
    """``|r - proj(r + rho v)|`` of one pair: the larger of its normal and its tangential part."""
    normal = abs(rn - max(0.0, trial_n))
    bound = mu * max(rn, 0.0)
    size = np.sqrt(y1 * y1 + y2 * y2)
    share = bound / size if size > bound else 1.0
    return max(normal, np.sqrt((r1 - share * y1) ** 2 + (r2 - share * y2) ** 2))


@jit
def residual_of_pair(problem, vt_old, r, v, i):
    """Natural map of one pair, ``|r - proj(r + rho (v - v_old))|``, over its typical force."""
    n = 3 * i
    rho_n, rho_t = own_stiffness(problem.diagonal, i)
    y1 = r[n + 1] + rho_t * (v[n + 1] - vt_old[i, 0])
    y2 = r[n + 2] + rho_t * (v[n + 2] - vt_old[i, 1])
    trial = r[n] + rho_n * v[n]
    found = off_cone(r[n], r[n + 1], r[n + 2], trial, y1, y2, problem.friction[i])
    return found / problem.force[i]


@jit
def natural_residual(problem, given, contact):
    """Largest violation of the contact laws and of equilibrium, relative to the problem's force.

    The natural map of every pair, and the imbalance of the coordinates q; `v` belongs to `r` and `q`.
    """
    R, stiffness, force = problem.R, problem.stiffness, problem.force
    r, q = contact.r, contact.q
    worst = 0.0
    total = 0.0
    for i in range(force.shape[0]):
        e = residual_of_pair(problem, given.vt_old, r, contact.v, i)
        if not e < np.inf:
            return np.inf
        worst = max(worst, e)
        total += force[i]
    for a in range(q.shape[0]):
        e = stiffness[a] * q[a] - given.f_q[a]
        size = 0.0
        for j in range(r.shape[0]):
            e += R[j, a] * r[j]
            size = max(size, abs(R[j, a]))
        if not abs(e) < np.inf:
            return np.inf
        if size > 0.0:
            worst = max(worst, abs(e) / (size * total))
    return worst


@jit
def certify(problem, given, contact):
    """Displacements of the reactions, from W itself, into `contact`; returns their residual."""
    relative_displacement(problem, given.v_free, contact.r, contact.q, contact.v)
    return natural_residual(problem, given, contact)


@jit
def worst_pair(problem, given, contact):
    """The pair that obeys the laws least."""
    worst = -1.0
    pair = -1
    for i in range(contact.status.shape[0]):
        e = residual_of_pair(problem, given.vt_old, contact.r, contact.v, i)
        if not e <= worst:
            worst = e
            pair = i
            if not e < np.inf:
                break
    return pair

"""Three-dimensional contact with a cone of facets, as a linear complementarity problem.

With ``r_t = sum_k beta_k d_k`` for some directions d_k of each pair, beta >= 0 and a slack lambda,
the laws of `spatial.py` for the pyramid ``sum beta_k <= mu r_n`` inside the cone are (Stewart & Trinkle,
Int. J. Numer. Methods Eng. 39 (1996) 2673; Anitescu & Potra, Nonlinear Dyn. 14 (1997) 231)

    -v_n                               >= 0   against  r_n
    lambda - d_k^T (v_t - v_t_old)     >= 0   against  beta_k
    mu r_n - sum beta_k                >= 0   against  lambda
    +-(K_q q + R^T r - f_q)            >= 0   against  q_+ and q_-,   q = q_+ - q_-

With W positive definite and no negative K_q its matrix is copositive, as that of the planar problem is
(`lemke.py`): Lemke's method ends in a solution, whatever the friction, unless the load does work
along a motion that nothing resists. As the facets become finer, solutions stay bounded, and where they
tend is a solution of the cone itself: what Newton's method is then started from.
"""

from __future__ import annotations

import numpy as np

from microslip.contact.compiled import jit
from microslip.contact.lemke import SOLUTION, lemke

PIVOTS = 30
"""Most pivots, over the number of rows."""


@jit
def fan(direction, facets, turn, focus):
    """(m, facets, 2) directions: evenly round, or with `focus` > 0 closer together round `direction`.

    The angle from the direction of a pair, in (-pi, pi], is ``a (focus + (1 - focus) |a|/pi)`` of evenly
    spaced a; with `turn` they start a share of their spacing further on.
    """
    m = direction.shape[0]
    out = np.empty((m, facets, 2))
    for i in range(m):
        centre = np.arctan2(direction[i, 1], direction[i, 0])
        for k in range(facets):
            a = 2.0 * (k + turn) / facets
            if a > 1.0:
                a -= 2.0
            if focus > 0.0:
                a *= focus + (1.0 - focus) * abs(a)
            out[i, k, 0] = np.cos(centre + np.pi * a)
            out[i, k, 1] = np.sin(centre + np.pi * a)
    return out


@jit
def faceted_form(problem, given, directions):
    """M and b of a contact problem with faceted cones; rows of a pair: r_n, beta_k, lambda; then q.

    Reactions are in units of displacement, and all displacements over that of the typical contact force.
    """
    W, R, stiffness, scale = problem.W, problem.R, problem.stiffness, problem.scale
    mu, mean = problem.friction, problem.mean
    v_free, f_q, vt_old = given.v_free, given.f_q, given.vt_old
    m, facets = directions.shape[0], directions.shape[1]
    N, e = R.shape
    rows = facets + 2
    unit = mean * np.mean(problem.force)
    # T: from the unknowns of the pairs to the components of r
    T = np.zeros((m * rows, N))
    n = m * rows + 2 * e
    M = np.zeros((n, n))
    b = np.zeros(n)
    for i in range(m):
        T[i * rows, 3 * i] = 1.0
        b[i * rows] = -v_free[3 * i] / unit
        for k in range(facets):
            j = i * rows + 1 + k
            slip = 0.0
            for a in range(2):
                T[j, 3 * i + 1 + a] = directions[i, k, a]
                slip += directions[i, k, a] * (v_free[3 * i + 1 + a] - vt_old[i, a])
            b[j] = -slip / unit
    P = np.dot(np.dot(T, W), T.T) / mean
    M[: m * rows, : m * rows] = P
    for i in range(m):
        last = i * rows + facets + 1
        M[last, i * rows] = mu[i]
        for k in range(facets):
            M[i * rows + 1 + k, last] = 1.0
            M[last, i * rows + 1 + k] = -1.0
    moved = np.dot(T, R)
    for a in range(e):
        row = m * rows + 2 * a
        for j in range(m * rows):
            x = moved[j, a] * scale[a] / mean
            M[j, row], M[j, row + 1] = -x, x
            M[row, j], M[row + 1, j] = x, -x
        k = scale[a] * stiffness[a] * scale[a] / mean
        M[row, row], M[row + 1, row + 1] = k, k
        M[row, row + 1], M[row + 1, row] = -k, -k
        b[row] = -scale[a] * f_q[a] / unit
        b[row + 1] = -b[row]
    return M, b


@jit
def solve_faceted(problem, given, directions, smallest, contact):
    """Reactions and coordinates of the faceted cones into `contact`; returns how it ended, and pivots."""
    scale = problem.scale
    M, b = faceted_form(problem, given, directions)
    n = b.shape[0]
    outcome, z, pivots = lemke(M, b, np.ones(n), PIVOTS * n, smallest)
    if outcome != SOLUTION:
        return outcome, pivots
    m, facets = directions.shape[0], directions.shape[1]
    rows = facets + 2
    force = np.mean(problem.force)
    for i in range(m):
        contact.r[3 * i] = z[i * rows] * force
        for a in range(2):
            total = 0.0
            for k in range(facets):
                total += z[i * rows + 1 + k] * directions[i, k, a]
            contact.r[3 * i + 1 + a] = total * force
    for a in range(contact.q.shape[0]):
        there = z[m * rows + 2 * a] - z[m * rows + 2 * a + 1]
        contact.q[a] = there * force * scale[a]
    return outcome, pivots

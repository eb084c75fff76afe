"""A planar contact problem: what is given, what is solved for, and how far off a solution is.

In the equations of `planar.py`, with the layout of `contact/pairs.py`; arrays and scales that belong
together are named tuples, which compiled functions take as they are.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from scipy.linalg import lapack

from microslip.contact.compiled import jit
from microslip.contact.folded import NOT_FOLDED, Folded, product
from microslip.contact.pairs import SEPARATED, STICK
from microslip.errors import ContactError
from microslip.typing import Array, Status


class Problem(NamedTuple):
    """A planar contact problem and the scales that make its equations comparable.

    Attributes
    ----------
    W : (2 m, 2 m) array
        Flexibility, layout of `contact/pairs.py`.
    R : (2 m, e) array
        Relative displacements per unit of the coordinates q.
    stiffness, scale : (e,) arrays
        K_q, and what q is measured in.
    friction, force : (m,) arrays
        Coefficient of friction and typical contact force of each pair.
    mean : float
        Of the diagonal of W: reactions times this are kept in the tableau.
    tolerance : float
        Violation of an inequality, relative to `force`, up to which a state stays.
    diagonal : (2 m,) array
        Of W, whose own lies far apart in memory.
    folded : Folded
        W taken apart, where it is its own image.
    """

    W: Array
    R: Array
    stiffness: Array
    scale: Array
    friction: Array
    force: Array
    mean: float
    tolerance: float
    diagonal: Array
    folded: Folded = NOT_FOLDED


class Given(NamedTuple):
    """What a contact problem is solved for.

    Attributes
    ----------
    v_free : (2 m,) array
        Relative displacement without contact.
    f_q : (e,) array
        Loads on the coordinates of equilibrium.
    vt_old : (m,) array
        Tangential displacement at which each pair sticks.
    """

    v_free: Array
    f_q: Array
    vt_old: Array


class Contact(NamedTuple):
    """States and unknowns of all pairs, changed in place from one solution to the next.

    Attributes
    ----------
    status : (m,) int8 array
    r : (2 m,) array
        Reactions.
    q : (e,) array
        Coordinates of equilibrium.
    v : (2 m,) array
        Relative displacements.
    """

    status: Status
    r: Array
    q: Array
    v: Array


def contact_problem(
    W: Array,
    R: Array,
    stiffness: Array,
    friction: Array,
    force: Array,
    tolerance: float,
    folded: Folded = NOT_FOLDED,
) -> Problem:
    """Arrays of a contact problem and the scales that make its equations comparable."""
    diagonal = np.ascontiguousarray(np.diag(W), dtype=float)
    mean = float(np.mean(diagonal))
    top = np.abs(R).max(axis=0, initial=0.0)
    scale = np.where(top > 0, mean / np.where(top > 0, top, 1), 1.0)
    W, R, stiffness, friction, force = (
        np.ascontiguousarray(a, dtype=float) for a in (W, R, stiffness, friction, force)
    )
    return Problem(W, R, stiffness, scale, friction, force, mean, tolerance, diagonal, folded)


def check_flexibility(W: Array) -> bool:
    """Whether W is positive definite, as every flexibility of supported bodies is.

    Raises
    ------
    ContactError
        Where W is singular to rounding: reactions would not be determined.

    Examples
    --------
    >>> check_flexibility(np.eye(2)), check_flexibility(np.diag([1.0, -1.0]))
    (True, False)
    """
    n = len(W)
    if not np.isfinite(W).all():
        raise ContactError("the flexibility of the contact holds numbers that are not finite")
    factor, failed = lapack.dpotrf(W, lower=1)
    if not failed:
        size = np.abs(W).sum(axis=0).max()
        inverse_condition, _ = lapack.dpocon(factor, size, uplo="L")
        if inverse_condition > n * np.finfo(float).eps:
            return True
    values = np.linalg.eigvalsh(W)
    rank = int((np.abs(values) > n * np.finfo(float).eps * np.abs(values).max(initial=0.0)).sum())
    if rank < n:
        raise ContactError(
            f"the flexibility of the contact is singular, of rank {rank} with {n} components of the "
            "pairs: reactions are not determined, as between parts that do not deform; keep the "
            "residual flexibility of truncated modes, or give the contact a stiffness"
        )
    return not failed


@jit
def relative_displacement(problem, v_free, r, q, v):
    """Compute ``v = v_free + R q - W r``; W is symmetric."""
    R = problem.R
    product(problem.W, problem.folded, r, v)
    for i in range(v.shape[0]):
        s = v_free[i]
        for a in range(q.shape[0]):
            s += R[i, a] * q[a]
        v[i] = s - v[i]


@jit
def natural_residual(problem, given, contact):
    """Largest violation of the contact laws and of equilibrium, relative to the problem's force.

    ``max_i |r - proj(r + v / W_ii)| / force_i`` over normal and tangential components, where the
    displacement is measured in units of the pair's own compliance, and the imbalance of the
    coordinates q; `v` belongs to `r` and `q`.
    """
    own, R, stiffness = problem.diagonal, problem.R, problem.stiffness
    mu, force = problem.friction, problem.force
    f_q, vt_old = given.f_q, given.vt_old
    r, q, v = contact.r, contact.q, contact.v
    worst = 0.0
    for i in range(mu.shape[0]):
        rn = r[2 * i]
        rt = r[2 * i + 1]
        en = abs(rn - max(0.0, rn + v[2 * i] / own[2 * i]))
        bound = mu[i] * max(rn, 0.0)
        trial = rt + (v[2 * i + 1] - vt_old[i]) / own[2 * i + 1]
        et = abs(rt - min(max(trial, -bound), bound))
        worst = max(worst, max(en, et) / force[i])
        if not (en < np.inf and et < np.inf):
            return np.inf
    total = 0.0
    for i in range(mu.shape[0]):
        total += force[i]
    for a in range(q.shape[0]):
        e = stiffness[a] * q[a] - f_q[a]
        size = 0.0
        for i in range(r.shape[0]):
            e += R[i, a] * r[i]
            size = max(size, abs(R[i, a]))
        if size > 0.0:
            worst = max(worst, abs(e) / (size * total))
    return worst


@jit
def unbalance(problem, given, contact):
    """Largest relative violation of the equations of the states by a solution and its v."""
    own, R, stiffness, force = problem.diagonal, problem.R, problem.stiffness, problem.force
    f_q, vt_old = given.f_q, given.vt_old
    status, r, q, v = contact.status, contact.r, contact.q, contact.v
    worst = 0.0
    total = 0.0
    for i in range(status.shape[0]):
        if status[i] == SEPARATED:
            continue
        e = abs(v[2 * i]) / (own[2 * i] * force[i])
        total += force[i]
        if status[i] == STICK:
            e = max(e, abs(v[2 * i + 1] - vt_old[i]) / (own[2 * i + 1] * force[i]))
        if not e < np.inf:
            return np.inf
        worst = max(worst, e)
    for a in range(q.shape[0]):
        e = f_q[a] - stiffness[a] * q[a]
        top = 0.0
        for i in range(r.shape[0]):
            e -= R[i, a] * r[i]
            top = max(top, abs(R[i, a]))
        if top > 0.0 and total > 0.0:
            worst = max(worst, abs(e) / (top * total))
    return worst

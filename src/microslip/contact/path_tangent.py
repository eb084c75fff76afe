"""Compiled linearisation of a load path: what small changes of the loads do to its solutions.

With the contact states of a step given, its equations (`planar.py`) are linear. A pair that is separated
keeps ``dr = 0``; one that sticks ``dv_n = 0`` and ``dv_t`` as it was; one that slips ``dv_n = 0`` and
``dr_t = s mu dr_n``; and

    dv = dv_free + R dq - W dr,    K_q dq + R^T dr = df_q

Many changes of the loads are taken along a path at once. Where no pair is on the verge of another state
these are the derivatives of the solutions: what a pair does otherwise while it switches is of second order.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from microslip.contact.compiled import jit
from microslip.contact.pairs import SEPARATED, STICK
from microslip.contact.solver import ContactSolver, load_kernels, singularity_named
from microslip.contact.tableau import exchange, follow, memory, pending
from microslip.model.flexibility import Flexibility
from microslip.typing import Array, Status

KEPT = 16
"""Components that states may differ in before the tableau follows."""


class PathTangent(NamedTuple):
    """Derivatives of a path of n steps in c directions; row 0 is the entry.

    Attributes
    ----------
    r : (n + 1, c, 2 m) array
    q : (n + 1, c, e) array
    vt : (c, m) array
        Of the tangential displacements at which the pairs stick at the end.
    """

    r: Array
    q: Array
    vt: Array


def path_tangent(
    solver: ContactSolver,
    flexibility: Flexibility,
    status: Status,
    changes: Array,
    vt: Array | None = None,
) -> PathTangent:
    """Derivatives of a path that has been followed, by changes of its loads.

    Parameters
    ----------
    solver : ContactSolver
        That followed it; it is left as it is.
    flexibility : Flexibility
    status : (n + 1, m) int8 array
        States along the path.
    changes : (n + 1, c, p) array
        Of the amplitudes of all ports, in c directions.
    vt : (c, m) array, optional
        Derivatives at entry of the displacements at which the pairs stick; none by default.

    Raises
    ------
    ContactError
        Where the states of a step make its equations singular.
    """
    load_kernels()
    steps, count = changes.shape[:2]
    n, e = len(flexibility.W), len(flexibility.stiffness)
    found = PathTangent(
        r=np.zeros((steps, count, n)),
        q=np.zeros((steps, count, e)),
        vt=np.zeros((count, n // 2)) if vt is None else np.array(vt, dtype=float),
    )
    with singularity_named():
        carry(
            solver.problem,
            memory(n // 2, e),
            np.ascontiguousarray(status),
            changes @ flexibility.loads_v.T,
            changes @ flexibility.loads_q.T,
            found,
        )
    return found


@jit
def carry(problem, memory, status, v_free, f_q, found):
    """Solve for the changes of every step in turn, with the tableau that follows its states."""
    r, q, vt = found
    scale, mean = problem.scale, problem.mean
    N, nr = problem.R.shape
    count = vt.shape[0]
    weights = np.empty((count, N + nr))
    x = np.empty((count, N + nr))
    J = np.empty(N + nr, np.int64)
    nothing = np.zeros(N + nr)
    for step in range(1, status.shape[0]):
        follow(problem, memory, status[step])
        k = pending(memory.held, status[step], J)
        if k > KEPT:
            if not exchange(memory, J[:k], nothing):
                raise np.linalg.LinAlgError("Matrix is singular to machine precision.")
            k = 0
        held = memory.held
        for a in range(count):
            for i in range(N):
                w = v_free[step, a, i]
                if i % 2 == 1:
                    w -= vt[a, i // 2]
                weights[a, i] = w if held[i] else 0.0
                v_free[step, a, i] = w
            for i in range(nr):
                weights[a, N + i] = scale[i] * f_q[step, a, i]
        np.dot(weights, memory.transposed, x)
        for a in range(count):
            for i in range(N):
                if not held[i]:
                    x[a, i] += v_free[step, a, i]
        if k > 0:
            try_states(memory, J[:k], x)
        scatter(problem, memory.sign, status[step], x, r[step], vt)
        for a in range(count):
            for i in range(nr):
                q[step, a, i] = x[a, N + i] * scale[i] / mean


@jit
def try_states(memory, J, x):
    """Unknowns of states that differ from the tableau's in the components J."""
    k = J.shape[0]
    rows = np.empty((k, x.shape[1]))
    C = np.empty((k, k))
    y = np.empty((k, x.shape[0]))
    for b in range(k):
        rows[b] = memory.transposed[J[b]]
        y[b] = x[:, J[b]]
        for a in range(k):
            C[a, b] = rows[b, J[a]]
    solved = np.ascontiguousarray(np.linalg.solve(C, y).T)
    x -= np.dot(solved, rows)
    for b in range(k):
        x[:, J[b]] = solved[:, b]


@jit
def scatter(problem, sign, status, x, r, vt):
    """Reactions and tangential displacements from the unknowns of given states."""
    mu, inverse = problem.friction, 1.0 / problem.mean
    for a in range(x.shape[0]):
        for i in range(status.shape[0]):
            n, t = 2 * i, 2 * i + 1
            if status[i] == SEPARATED:
                r[a, n], r[a, t] = 0.0, 0.0
                vt[a, i] += x[a, t]
                continue
            r[a, n] = x[a, n] * inverse
            r[a, t] = sign[i] * mu[i] * r[a, n]
            if status[i] == STICK:
                r[a, t] += x[a, t] * inverse
            else:
                vt[a, i] += x[a, t]

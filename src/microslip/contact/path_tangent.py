"""Compiled linearisation of a load path: what small changes of the loads do to its solutions.

With the contact states of a step given, its equations are linear (`linearised.py`). Many changes of the loads
are taken along a path at once. Where no pair is on the verge of another state
these are the derivatives of the solutions: what a pair does otherwise while it switches is of second order.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from microslip.contact.compiled import jit
from microslip.contact.linearised import solve_states
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
        if k > KEPT and not exchange(memory, J[:k], nothing):
            raise np.linalg.LinAlgError("Matrix is singular to machine precision.")
        w = v_free[step]
        for a in range(count):
            for i in range(N):
                if i % 2 == 1:
                    w[a, i] -= vt[a, i // 2]
                weights[a, i] = w[a, i] if memory.held[i] else 0.0
            for i in range(nr):
                weights[a, N + i] = scale[i] * f_q[step, a, i]
        solve_states(problem, memory, status[step], w, weights, x, r[step])
        for a in range(count):
            for i in range(vt.shape[1]):
                vt[a, i] += x[a, 2 * i + 1]
            for i in range(nr):
                q[step, a, i] = x[a, N + i] * scale[i] / mean

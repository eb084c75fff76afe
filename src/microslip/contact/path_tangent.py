"""Compiled linearisation of a load path: what small changes of the loads do to its solutions.

With the contact states of a step given, its equations are linear (`linearised.py`, in space
`spatial_linearised.py`). Many changes of the loads
are taken along a path at once. Where no pair is on the verge of another state
these are the derivatives of the solutions: what a pair does otherwise while it switches is of second order.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from microslip.contact.by_dimension import dimension_of, recall, solve_states
from microslip.contact.compiled import jit
from microslip.contact.path import PathRecord
from microslip.contact.solver import ContactSolver, loaded, singularity_named
from microslip.model.flexibility import Flexibility
from microslip.typing import Array


class PathTangent(NamedTuple):
    """Derivatives of a path of n steps in c directions; row 0 is the entry.

    Attributes
    ----------
    r : (n + 1, c, d m) array
    q : (n + 1, c, e) array
    vt : (c, (d - 1) m) array
        Of the tangential displacements at which the pairs stick at the end.
    """

    r: Array
    q: Array
    vt: Array


def path_tangent(
    solver: ContactSolver,
    flexibility: Flexibility,
    record: PathRecord,
    changes: Array,
    vt: Array | None = None,
) -> PathTangent:
    """Derivatives of a path that has been followed, by changes of its loads.

    Parameters
    ----------
    solver : ContactSolver
        That followed it; it is left as it is.
    flexibility : Flexibility
    record : PathRecord
        What happened along the path.
    changes : (n + 1, c, p) array
        Of the amplitudes of all ports, in c directions.
    vt : (c, (d - 1) m) array, optional
        Derivatives at entry of the displacements at which the pairs stick; none by default.

    Raises
    ------
    ContactError
        Where the states of a step make its equations singular.
    """
    kernels = loaded(solver.dimension)
    steps, count = changes.shape[:2]
    n, e, d = len(flexibility.W), len(flexibility.stiffness), record.dimension
    slips = (d - 1) * n // d
    found = PathTangent(
        r=np.zeros((steps, count, n)),
        q=np.zeros((steps, count, e)),
        vt=np.zeros((count, slips)) if vt is None else np.array(vt, dtype=float),
    )
    with singularity_named():
        carry(
            solver.problem,
            kernels.tableau.memory(n // d, e),
            record,
            changes @ flexibility.loads_v.T,
            changes @ flexibility.loads_q.T,
            found,
        )
    return found


@jit
def carry(problem, memory, record, v_free, f_q, found):
    """Solve for the changes of every step in turn, with the tableau that follows its states."""
    r, q, vt = found
    status, v = record.status, record.v
    scale, mean = problem.scale, problem.mean
    N, nr = problem.R.shape
    d = dimension_of(memory)
    count = vt.shape[0]
    weights = np.empty((count, N + nr))
    x = np.empty((count, N + nr))
    for step in range(1, status.shape[0]):
        recall(problem, memory, status[step], record.r[step], v[step] - v[step - 1])
        w = v_free[step]
        for a in range(count):
            for i in range(N):
                part = i % d
                if part > 0:
                    w[a, i] -= vt[a, (d - 1) * (i // d) + part - 1]
                weights[a, i] = w[a, i] if memory.held[i] else 0.0
            for i in range(nr):
                weights[a, N + i] = scale[i] * f_q[step, a, i]
        solve_states(problem, memory, status[step], w, weights, x, r[step])
        for a in range(count):
            for i in range(N):
                part = i % d
                if part > 0:
                    vt[a, (d - 1) * (i // d) + part - 1] += x[a, i]
            for i in range(nr):
                q[step, a, i] = x[a, N + i] * scale[i] / mean

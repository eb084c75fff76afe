"""Load path: one contact problem after another, halving a step that does not solve."""

from __future__ import annotations

from collections.abc import Callable
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from microslip.contact import active_set, spatial
from microslip.contact.by_dimension import dimension_of, other_ways, restart, search
from microslip.contact.compiled import jit
from microslip.contact.fallbacks import Counts, fallbacks
from microslip.contact.problem import Given
from microslip.contact.solver import CERTIFICATE, PLANAR, ContactSolver, singularity_named
from microslip.contact.unsolved import NOTHING_HOLDS
from microslip.errors import ContactError
from microslip.model.flexibility import Flexibility
from microslip.numerics.execute import one_thread
from microslip.typing import Array, Status

FRICTION, NORMAL = 0, 1
"""Places in the last direction of `PathRecord.work`."""

PLAIN = 0
"""Rule by which most problems are solved, in the plane and in space."""


class Halving(NamedTuple):
    """How steps that do not solve are halved.

    Attributes
    ----------
    rule : int
        Its number among the rules.
    most : int
        Halvings of a step; then the solver's other ways are tried.
    rescues : bool
        Whether they are.
    """

    rule: int
    most: int
    rescues: bool


HALVINGS = {2: Halving(active_set.HALVED, 8, True), 3: Halving(spatial.HALVED, 4, True)}
"""By components per pair."""


class PathRecord(NamedTuple):
    """What happened along a path of n steps; row 0 is the state at entry.

    Attributes
    ----------
    r, v : (n + 1, d m) arrays
        Reactions and relative displacements, layout of `contact/pairs.py`.
    q : (n + 1, e) array
        Coordinates of equilibrium.
    status : (n + 1, m) int8 array
    iterations : (n + 1,) int array
    residual : (n + 1,) array
        Complementarity residual.
    rule : (n + 1,) int array
        How states were found, numbered as in `active_set.py` or in `spatial.py`: 0 is the plain way.
    work : (n + 1, m, 2) array
        Work of friction and of the normal reactions of each step and pair, J (per metre of
        width in two dimensions).
    """

    r: Array
    v: Array
    q: Array
    status: Status
    iterations: NDArray[np.int64]
    residual: Array
    rule: NDArray[np.int64]
    work: Array

    @property
    def dimension(self) -> int:
        """Components per contact pair."""
        return self.r.shape[1] // self.status.shape[1]

    @property
    def fallbacks(self) -> Counts:
        """Steps by how they were solved."""
        rules = active_set if self.dimension == PLANAR.dimension else spatial
        count = np.bincount(self.rule[1:], minlength=rules.NOT_SOLVED + 1)
        return fallbacks(count, self.dimension)

    @property
    def friction_work(self) -> Array:
        """Work dissipated by each pair along the path, J per metre of width."""
        return np.asarray(self.work[1:, :, FRICTION].sum(axis=0))

    @property
    def normal_work(self) -> float:
        """Work of the normal reactions along the path, J per metre of width."""
        return float(self.work[1:, :, NORMAL].sum())


def follow_path(
    solver: ContactSolver,
    flexibility: Flexibility,
    path: Array,
    vt_old: Array,
    *,
    where: Callable[[int], str],
    remedy: str,
    rescues: bool = True,
) -> PathRecord:
    """Take a solver along the rows of a load path, from the state that it is in.

    Parameters
    ----------
    solver : ContactSolver
        On `flexibility`, at the state of ``path[0]``; left at that of ``path[-1]``.
    flexibility : Flexibility
    path : (n + 1, p) array
        Amplitudes of all ports.
    vt_old : (m,) or (m, 2) array
        Tangential displacement at which each pair sticks, as `pairs.slip_history` gives it; changed in
        place.
    where : function of int to str
        What to say of a step that does not solve, after its number.
    remedy : str
        What to try then.
    rescues : bool
        Whether the solver's other ways are tried on a step that halving does not solve; not where there is
        hardly a solution.

    Raises
    ------
    ContactError
        Where a step does not solve.
    """
    n, m = len(path), len(solver.status)
    record = PathRecord(
        r=np.zeros((n, len(solver.r))),
        v=np.zeros((n, len(solver.v))),
        q=np.zeros((n, len(solver.q))),
        status=np.zeros((n, m), dtype=np.int8),
        iterations=np.zeros(n, dtype=np.int64),
        residual=np.zeros(n),
        rule=np.zeros(n, dtype=np.int64),
        work=np.zeros((n, m, 2)),
    )
    record.r[0], record.v[0], record.q[0] = solver.r, solver.v, solver.q
    record.status[0] = solver.status
    with singularity_named(), one_thread():
        failed = march(
            solver.problem,
            solver.memory,
            np.ascontiguousarray(flexibility.loads_v),
            np.ascontiguousarray(flexibility.loads_q),
            np.ascontiguousarray(path),
            vt_old,
            solver.contact,
            record,
            HALVINGS[solver.dimension]._replace(rescues=rescues),
        )
    if failed >= 0 or not record.residual.max() <= CERTIFICATE:
        step = failed if failed >= 0 else int(np.argmax(record.residual))
        load = path[step]
        given = Given(flexibility.loads_v @ load, flexibility.loads_q @ load, vt_old)
        why = solver.why_unsolved(given)
        # more steps do not help where there is no solution
        remedy = "take a smaller load, or a support" if why == NOTHING_HOLDS else remedy
        raise ContactError(
            f"contact not solved at step {step} of {n - 1} {where(step)}: residual "
            f"{record.residual[step]:.1e}; {why}; {remedy}"
        )
    return record


@jit
def march(problem, memory, loads_v, loads_q, path, vt_old, contact, record, halving):
    """Solve along the rows of `path` (port amplitudes); row 0 is the state at entry.

    Friction work ``(r_t + r_t_old)/2 . (v_t - v_t_old)`` and the work of the normal reactions are
    accumulated per step and pair in ``record.work``. Returns the first unsolved step, or -1.
    """
    status, r, q, v = contact.status, contact.r, contact.q, contact.v
    work = record.work
    m = status.shape[0]
    d = dimension_of(memory)
    sticks_at = vt_old.reshape(m, d - 1)
    not_solved = memory.solved.shape[0] - 1
    v_free = np.empty(d * m)
    f_q = np.empty(q.shape[0])
    given = Given(v_free, f_q, vt_old)
    r_old, q_old, v_old, status_old = r.copy(), q.copy(), v.copy(), status.copy()
    for step in range(1, path.shape[0]):
        done = 0.0
        part = 1.0
        halvings = 0
        count = 0
        worst = 0.0
        top_rule = PLAIN
        work[step] = 0.0
        while done < 1.0:
            target = min(1.0, done + part)
            load = path[step - 1] + target * (path[step] - path[step - 1])
            v_free[:] = np.dot(loads_v, load)
            f_q[:] = np.dot(loads_q, load)
            its, residual, rule = search(problem, memory, given, contact)
            count += its
            if rule == not_solved and halvings == halving.most:
                if halving.rescues:
                    its, residual, rule = other_ways(problem, memory, given, contact)
                    count += its
                if rule == not_solved:
                    record.residual[step] = residual
                    record.iterations[step] = count
                    record.rule[step] = not_solved
                    memory.solved[not_solved] += 1
                    return step
            elif rule == not_solved:
                halvings += 1
                part *= 0.5
                status[:] = status_old
                r[:] = r_old
                q[:] = q_old
                v[:] = v_old
                restart(problem, memory, status)
                top_rule = max(top_rule, halving.rule)
                continue
            top_rule = max(top_rule, rule)
            worst = max(worst, residual)
            for i in range(m):
                n = d * i
                for a in range(d - 1):
                    t = n + 1 + a
                    work[step, i, FRICTION] += 0.5 * (r[t] + r_old[t]) * (v[t] - v_old[t])
                    sticks_at[i, a] = v[t]
                work[step, i, NORMAL] += 0.5 * (r[n] + r_old[n]) * (v[n] - v_old[n])
            r_old[:] = r
            q_old[:] = q
            v_old[:] = v
            status_old[:] = status
            done = target
        record.r[step] = r
        record.v[step] = v
        record.q[step] = q
        record.status[step] = status
        record.iterations[step] = count
        record.residual[step] = worst
        record.rule[step] = top_rule
        memory.solved[top_rule] += 1
    return -1

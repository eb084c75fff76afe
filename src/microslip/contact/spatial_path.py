"""Load path of spatial contact: one problem after another, halving a step that does not solve."""

from __future__ import annotations

import numpy as np

from microslip.contact.compiled import jit
from microslip.contact.problem import Given
from microslip.contact.spatial import HALVED, NOT_SOLVED, PLAIN, other_starts, search
from microslip.contact.spatial_tableau import restart

MAX_HALVINGS = 4

FRICTION, NORMAL = 0, 1
"""Places in the last direction of `path.PathRecord.work`."""


@jit
def march_spatial(problem, memory, loads_v, loads_q, path, vt_old, contact, record):
    """Solve along the rows of `path` (port amplitudes); row 0 is the state at entry.

    Friction work ``(r_t + r_t_old)/2 . (v_t - v_t_old)`` and the work of the normal reactions are
    accumulated per step and pair in ``record.work``. Returns the first unsolved step, or -1.
    """
    status, r, q, v = contact.status, contact.r, contact.q, contact.v
    work = record.work
    m = status.shape[0]
    v_free = np.empty(3 * m)
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
            if rule == NOT_SOLVED and halvings == MAX_HALVINGS:
                its, residual, rule = other_starts(problem, memory, given, contact)
                count += its
                if rule == NOT_SOLVED:
                    record.residual[step] = residual
                    record.iterations[step] = count
                    record.rule[step] = NOT_SOLVED
                    memory.solved[NOT_SOLVED] += 1
                    return step
            elif rule == NOT_SOLVED:
                halvings += 1
                part *= 0.5
                status[:] = status_old
                r[:] = r_old
                q[:] = q_old
                v[:] = v_old
                restart(problem, memory, status)
                top_rule = max(top_rule, HALVED)
                continue
            top_rule = max(top_rule, rule)
            worst = max(worst, residual)
            for i in range(m):
                n = 3 * i
                for a in range(2):
                    t = n + 1 + a
                    work[step, i, FRICTION] += 0.5 * (r[t] + r_old[t]) * (v[t] - v_old[t])
                    vt_old[i, a] = v[t]
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

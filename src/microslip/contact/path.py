"""Compiled load path: one contact problem after another, halving a step that does not solve."""

from __future__ import annotations

import numpy as np

from microslip.contact.planar import NOT_SOLVED, solve
from microslip.contact.tableau import _jit, restart

MAX_HALVINGS = 8


@_jit
def march(
    problem,
    memory,
    loads_v,
    loads_q,
    path,
    vt_old,
    status,
    r,
    q,
    v,
    r_out,
    v_out,
    q_out,
    status_out,
    iterations_out,
    residual_out,
    rule_out,
    work_out,
):
    """Solve along the rows of `path` (port amplitudes); row 0 is the state at entry.

    Friction work ``(r_t + r_t_old)/2 (v_t - v_t_old)`` and the work of the normal reactions are
    accumulated per step and pair in ``work_out[step, pair, 0 | 1]``. Returns the first unsolved
    step, or -1.
    """
    m = status.shape[0]
    v_free = np.empty(2 * m)
    f_q = np.empty(q.shape[0])
    r_old = r.copy()
    v_old = v.copy()
    status_old = status.copy()
    for step in range(1, path.shape[0]):
        done = 0.0
        part = 1.0
        halvings = 0
        count = 0
        worst = 0.0
        top_rule = 0
        work_out[step] = 0.0
        while done < 1.0:
            target = min(1.0, done + part)
            load = path[step - 1] + target * (path[step] - path[step - 1])
            v_free[:] = np.dot(loads_v, load)
            f_q[:] = np.dot(loads_q, load)
            its, residual, rule = solve(problem, memory, v_free, f_q, vt_old, status, r, q, v)
            count += its
            if rule == NOT_SOLVED:
                halvings += 1
                if halvings > MAX_HALVINGS:
                    residual_out[step] = residual
                    iterations_out[step] = count
                    rule_out[step] = NOT_SOLVED
                    return step
                part *= 0.5
                status[:] = status_old
                r[:] = r_old
                v[:] = v_old
                restart(problem, memory, status)
                top_rule = NOT_SOLVED
                continue
            top_rule = max(top_rule, rule)
            worst = max(worst, residual)
            for i in range(m):
                mean_t = 0.5 * (r[2 * i + 1] + r_old[2 * i + 1])
                work_out[step, i, 0] += mean_t * (v[2 * i + 1] - v_old[2 * i + 1])
                mean_n = 0.5 * (r[2 * i] + r_old[2 * i])
                work_out[step, i, 1] += mean_n * (v[2 * i] - v_old[2 * i])
                vt_old[i] = v[2 * i + 1]
            r_old[:] = r
            v_old[:] = v
            status_old[:] = status
            done = target
        r_out[step] = r
        v_out[step] = v
        q_out[step] = q
        status_out[step] = status
        iterations_out[step] = count
        residual_out[step] = worst
        rule_out[step] = top_rule
    return -1

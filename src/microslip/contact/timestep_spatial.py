"""Compiled time stepping of a joint model with exact spatial contact.

The scheme, its energies and what stands for a step are those of `timestep.py`, with two tangential
directions a pair: friction takes ``(r_t0 + r_t1)/2 . (v_t1 - v_t0)``. An opening pair gives up its push and
its traction in the same share, so that they stay within the cone.
"""

from __future__ import annotations

import numpy as np

from microslip.contact.compiled import jit
from microslip.contact.problem import Contact, Given
from microslip.contact.spatial import NOT_SOLVED, solve
from microslip.contact.tableau import WARM, add_rows
from microslip.contact.timestep import (
    DISSIPATIVE,
    EASED,
    EXTERNAL,
    FRICTION,
    MODAL,
    NORMAL,
    RESIDUAL,
    SLIGHT,
    WHOLE,
    work_on_residual,
)


@jit
def opened_spatial(problem, r_old, r, v, reduced):
    """Whether pairs open in a step; what they would push after they have, into `reduced`."""
    any_opened = False
    for i in range(v.shape[0] // 3):
        n = 3 * i
        reduced[n], reduced[n + 1], reduced[n + 2] = 0.0, 0.0, 0.0
        if r_old[n] > 0.0 and v[n] < 0.0:
            any_opened = True
            pull = -v[n] / problem.W[n, n]
            after = pull / (r_old[n] + pull)
            for a in range(3):
                reduced[n + a] = after * r_old[n + a]
    return any_opened


@jit
def spatial_contact_work(r, carried, v, v_old):
    """Work of normal contact and of friction over a step."""
    normal_work, slip_work = 0.0, 0.0
    for i in range(v.shape[0] // 3):
        n = 3 * i
        normal_work += 0.5 * (r[n] + carried[n]) * (v[n] - v_old[n])
        for t in range(n + 1, n + 3):
            slip_work += 0.5 * (r[t] + carried[t]) * (v[t] - v_old[t])
    return normal_work, slip_work


@jit
def step_through_spatial(problems, memories, constants, load, motion, records):
    """March over the steps of `load` (row 0 is the state at entry); `motion` is updated in place.

    `problems` are those of a step and of a dissipative step, each with its memory.
    Returns the failed step, or -1.
    """
    problem, dissipative_problem = problems
    memory, dissipative_memory = memories
    psi_t, omega = constants.psi_t, constants.omega
    h, c, gain = constants.mode_step, constants.mode_damping, constants.mode_gain
    tau, dt, drive = constants.tau, constants.dt, constants.drive
    drive_modes, drive_v = constants.drive_modes, constants.drive_v
    constant_modes, constant_v = constants.constant_modes, constants.constant_v
    out_modes, out_v, out_load = constants.out_modes, constants.out_v, constants.out_load
    eta, eta1, eta2, s = motion.eta, motion.rate, motion.acceleration, motion.residual_v
    r, v, taken = motion.r, motion.v, motion.taken
    vt_old, status = motion.vt_old, motion.status
    outputs, works, friction = records.output, records.works, records.friction_work
    r_out, v_out, status_out = records.r, records.v, records.status
    iterations, residuals, again = records.iterations, records.residual, records.dissipative
    k = eta.shape[0]
    N = v.shape[0]
    m = status.shape[0]
    decay = tau / dt
    keep = r_out.shape[0] == load.shape[0]
    nothing = np.empty(0)
    v_free = np.empty(N)
    given = Given(v_free, nothing, vt_old)
    contact = Contact(status, r, nothing, v)
    pv = np.empty(k)
    denominator = np.empty(k)
    start = np.empty(k)
    predicted = np.empty(k)
    carried = np.empty(N)
    reduced = np.empty(N)
    r_old = r.copy()
    v_old = v.copy()
    slight = 0.0
    for i in range(m):
        slight = max(slight, SLIGHT * problem.force[i] ** 2 * problem.W[3 * i, 3 * i])
    for j in range(k):
        denominator[j] = 1.0 + 0.5 * h[j] * c[j] + 0.25 * h[j] ** 2 * omega[j] ** 2
    for step in range(1, load.shape[0]):
        stage = WHOLE
        iterations[step] = 0
        carried[:] = r_old
        while True:
            for j in range(k):
                pe = eta[j] + h[j] * eta1[j] + 0.25 * h[j] ** 2 * eta2[j]
                pv[j] = eta1[j] + 0.5 * h[j] * eta2[j]
                external = constant_modes[j] + drive_modes[j] * load[step]
                start[j] = (external - c[j] * pv[j] - omega[j] ** 2 * pe) / denominator[j]
                predicted[j] = pe + 0.25 * h[j] ** 2 * start[j]
            for i in range(N):
                v_free[i] = (constant_v[i] + drive_v[i] * load[step] + decay * s[i]) / (1.0 + decay)
            add_rows(psi_t, predicted, v_free)
            if stage == DISSIPATIVE:
                its, residual, rule = solve(dissipative_problem, dissipative_memory, given, contact)
            else:
                its, residual, rule = solve(problem, memory, given, contact)
            iterations[step] += its
            if rule == NOT_SOLVED or stage == DISSIPATIVE:
                break
            if stage == WHOLE and opened_spatial(problem, r_old, r, v, reduced):
                stage = EASED
            else:
                normal_work, slip_work = spatial_contact_work(r, carried, v, v_old)
                left = taken[0] + normal_work + slip_work
                if stage == EASED:
                    reduced[:] = r_old - carried
                    left += work_on_residual(constants, predicted, denominator, r, v, s, reduced)
                if left >= -slight:
                    break
                stage = DISSIPATIVE
                again[step] = True
                reduced[:] = carried
                dissipative_memory.flags[WARM] = False
            for j in range(k):
                x = 0.0
                p = psi_t[j]
                for i in range(N):
                    x += p[i] * reduced[i]
                eta2[j] += gain[j] * x
            carried[:] = carried - reduced
        residuals[step] = residual
        if rule == NOT_SOLVED:
            return step
        full = 0.0
        if stage == DISSIPATIVE:
            full = 1.0
            carried[:] = r
            r_old[:] = r
            memory.flags[WARM] = False
        raised = load[step] - load[step - 1]
        for i in range(N):
            works[RESIDUAL] += 0.5 * (r[i] + r_old[i]) * (s[i] + drive_v[i] * raised)
            s[i] = v[i]
        for j in range(k):
            x = 0.0
            p = psi_t[j]
            for i in range(N):
                x += p[i] * r[i]
            x *= gain[j]
            share = x / denominator[j]
            acceleration = start[j] - share + full * (x - share)
            position = predicted[j] - (1.0 + full) * 0.25 * h[j] ** 2 * share
            works[MODAL] += c[j] * (position - eta[j]) ** 2 / (gain[j] * h[j])
            eta[j] = position
            eta1[j] = pv[j] + 0.5 * h[j] * (acceleration - full * x)
            eta2[j] = acceleration
            for i in range(N):
                s[i] -= position * p[i]
        for i in range(N):
            works[RESIDUAL] -= 0.5 * (r[i] + r_old[i]) * s[i]
        for i in range(m):
            for a in range(2):
                t = 3 * i + 1 + a
                friction[i] += 0.5 * (r[t] + carried[t]) * (v[t] - v_old[t])
                vt_old[i, a] = v[t]
        if stage == DISSIPATIVE:
            normal_work, slip_work = spatial_contact_work(r, carried, v, v_old)
            left = taken[0] + normal_work + slip_work
        works[FRICTION] += slip_work
        works[NORMAL] += normal_work
        taken[0] = max(left, 0.0)
        for o in range(outputs.shape[1]):
            y = out_load[0, o] + out_load[1, o] * load[step]
            for j in range(k):
                y += out_modes[j, o] * eta[j]
            for i in range(N):
                y -= out_v[o, i] * r[i]
            outputs[step, o] = y
        works[EXTERNAL] += (
            0.5 * (load[step] + load[step - 1]) * (outputs[step, drive] - outputs[step - 1, drive])
        )
        if keep:
            r_out[step] = r
            v_out[step] = v
            status_out[step] = status
        r_old[:] = r
        v_old[:] = v
    return -1

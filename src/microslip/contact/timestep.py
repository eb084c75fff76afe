"""Compiled time stepping of a joint model with exact contact.

Hilber–Hughes–Taylor on the modes (``alpha`` in [0, 1/3], gamma = 1/2 + alpha, beta = (1 + alpha)²/4,
Hughes, The Finite Element Method, 9.3), with ``f`` all external and contact forces on a mode,

    eta''_1 + (1 - alpha)(c eta'_1 + omega² eta_1) + alpha (c eta'_0 + omega² eta_0)
        = (1 - alpha) f_1 + alpha f_0

and the residual flexibility quasi-static behind its share of the stiffness damping,
``s + tau s' = V_res a - W_res r`` (backward Euler). One contact problem per step:

    v = v_free - W_step r,   W_step = W_res / (1 + tau/dt) + Psi S Psi^T

with ``S`` the displacement of a mode at the end of a step per unit force there.

Impacts. The scheme splits the push of a reaction between the step at whose end it acts and the
next one. Where a pair closes at speed, the whole impulse is spent in its first step, and what is
left for the next one would throw it off again faster than it came: energy from nothing. Such a
pair is known by a reaction that opens it in the next step without having fallen before; that
remainder is dropped and the step solved again. A contact that opens smoothly has a falling reaction
and keeps the second order.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from microslip.contact.compiled import jit
from microslip.contact.planar import NOT_SOLVED, solve
from microslip.contact.problem import Contact, Given
from microslip.contact.tableau import add_rows
from microslip.typing import Array, Status

IMPACT = 0.5
"""An impact is a reaction above this share of the largest under the clamp. Weaker ones, as where a
front of contact passes a pair, are left to the scheme: their energy is below what it dissipates,
and a choice that flips from cycle to cycle would keep a steady vibration from repeating."""

EXTERNAL, FRICTION, NORMAL, MODAL, RESIDUAL = 0, 1, 2, 3, 4
"""Places in the array of works: of the load, friction, normal reactions, damping of the modes,
damping of the residual part."""


class StepConstants(NamedTuple):
    """A joint model with k modes, m pairs and p ports, and one way of stepping it.

    Attributes
    ----------
    psi_t : (k, 2 m) array
        Relative displacements of the modes, transposed.
    omega, damping : (k,) arrays
        Circular frequency (rad/s) and viscous damping c (1/s) of each mode.
    tau : float
        Share of the residual part's stiffness in its damping, s.
    alpha, dt : float
        Numerical dissipation, and step (s).
    drive_modes, drive_v : (k,) and (2 m,) arrays
        Forces on the modes and relative displacements per unit load.
    constant_modes, constant_v : (k,) and (2 m,) arrays
        The same of the loads that are held.
    out_modes, out_v : (k, p) and (p, 2 m) arrays
        Outputs of all ports per unit of the modes and of minus the reactions.
    out_load : (2, p) array
        Outputs of the loads that are held, and per unit load.
    drive : int
        Driven port among the outputs.
    """

    psi_t: Array
    omega: Array
    damping: Array
    tau: float
    alpha: float
    dt: float
    drive_modes: Array
    drive_v: Array
    constant_modes: Array
    constant_v: Array
    out_modes: Array
    out_v: Array
    out_load: Array
    drive: int


class Motion(NamedTuple):
    """State of a joint model, changed in place from step to step.

    Attributes
    ----------
    eta, rate, acceleration, modal_force : (k,) arrays
        Modal coordinates, their derivatives, and all forces f on the modes.
    residual_v, r, v : (2 m,) arrays
        Residual part s of the relative displacement, reactions, relative displacements.
    r_before : (m,) array
        Normal reactions one step before `r`.
    vt_old : (m,) array
        Tangential displacement at which each pair sticks.
    status : (m,) int8 array
    """

    eta: Array
    rate: Array
    acceleration: Array
    modal_force: Array
    residual_v: Array
    r: Array
    v: Array
    r_before: Array
    vt_old: Array
    status: Status


class Records(NamedTuple):
    """What is written while marching n steps, row 0 is the state at entry.

    Attributes
    ----------
    output : (n + 1, p) array
        Outputs of all ports; row 0 is given.
    works : (5,) array
        Works since the start, at `EXTERNAL` to `RESIDUAL`, J per metre of width.
    friction_work : (m,) array
        Friction work of each pair.
    r, v : (n + 1, 2 m) arrays, or (0, 2 m)
    status : (n + 1, m) int8 array, or (0, m)
        Histories, not kept where they have no rows.
    iterations, residual : (n + 1,) arrays
        Of the contact solver.
    """

    output: Array
    works: Array
    friction_work: Array
    r: Array
    v: Array
    status: Status
    iterations: NDArray[np.int64]
    residual: Array


@jit
def step_through(problem, memory, constants, load, motion, records):
    """March over the steps of `load` (row 0 is the state at entry); `motion` is updated in place.

    Returns the failed step, or -1.
    """
    psi_t, omega, damping = constants.psi_t, constants.omega, constants.damping
    tau, alpha, dt, drive = constants.tau, constants.alpha, constants.dt, constants.drive
    drive_modes, drive_v = constants.drive_modes, constants.drive_v
    constant_modes, constant_v = constants.constant_modes, constants.constant_v
    out_modes, out_v, out_load = constants.out_modes, constants.out_v, constants.out_load
    eta, eta1, eta2 = motion.eta, motion.rate, motion.acceleration
    modal_force, s = motion.modal_force, motion.residual_v
    r, v, r_before = motion.r, motion.v, motion.r_before
    vt_old, status = motion.vt_old, motion.status
    outputs, works, friction = records.output, records.works, records.friction_work
    r_out, v_out, status_out = records.r, records.v, records.status
    iterations, residuals = records.iterations, records.residual
    k = eta.shape[0]
    N = v.shape[0]
    m = vt_old.shape[0]
    gamma = 0.5 + alpha
    beta = 0.25 * (1.0 + alpha) ** 2
    a1 = 1.0 - alpha
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
    external = np.empty(k)
    r_old = r.copy()
    v_old = v.copy()
    for j in range(k):
        denominator[j] = 1.0 + a1 * (gamma * dt * damping[j] + beta * dt * dt * omega[j] ** 2)
    dropped = np.zeros(m, np.bool_)
    for step in range(1, load.shape[0]):
        dropped[:] = False
        iterations[step] = 0
        while True:
            for j in range(k):
                pe = eta[j] + dt * eta1[j] + dt * dt * (0.5 - beta) * eta2[j]
                pv[j] = eta1[j] + dt * (1.0 - gamma) * eta2[j]
                external[j] = constant_modes[j] + drive_modes[j] * load[step]
                start[j] = (
                    a1 * (external[j] - damping[j] * pv[j] - omega[j] ** 2 * pe)
                    + alpha * (modal_force[j] - damping[j] * eta1[j] - omega[j] ** 2 * eta[j])
                ) / denominator[j]
                predicted[j] = pe + beta * dt * dt * start[j]
            for i in range(N):
                v_free[i] = (constant_v[i] + drive_v[i] * load[step] + decay * s[i]) / (1.0 + decay)
            add_rows(psi_t, predicted, v_free)
            its, residual, rule = solve(problem, memory, given, contact)
            iterations[step] += its
            if rule == NOT_SOLVED:
                break
            opened = False
            for i in range(m):
                strong = r_old[2 * i] > IMPACT * problem.force[i]
                sudden = strong and r_old[2 * i] >= r_before[i] and r[2 * i] <= 0.0
                if sudden and not dropped[i]:
                    dropped[i] = True
                    opened = True
                    for j in range(k):
                        x = psi_t[j, 2 * i] * r_old[2 * i] + psi_t[j, 2 * i + 1] * r_old[2 * i + 1]
                        modal_force[j] += x
                        eta2[j] += a1 * x / denominator[j]
            if not opened:
                break
        residuals[step] = residual
        if rule == NOT_SOLVED:
            return step
        for i in range(N):
            works[RESIDUAL] += 0.5 * (r[i] + r_old[i]) * s[i]
            s[i] = v[i]
        for j in range(k):
            x = 0.0
            p = psi_t[j]
            for i in range(N):
                x += p[i] * r[i]
            acceleration = start[j] - a1 * x / denominator[j]
            position = predicted[j] - beta * dt * dt * a1 * x / denominator[j]
            rate = (position - eta[j]) / dt
            works[MODAL] += damping[j] * rate**2 * dt
            eta[j] = position
            eta1[j] = pv[j] + gamma * dt * acceleration
            eta2[j] = acceleration
            modal_force[j] = external[j] - x
            for i in range(N):
                s[i] -= position * p[i]
        for i in range(N):
            works[RESIDUAL] -= 0.5 * (r[i] + r_old[i]) * s[i]
        for i in range(m):
            if dropped[i]:
                r_old[2 * i] = 0.0
                r_old[2 * i + 1] = 0.0
            work = 0.5 * (r[2 * i + 1] + r_old[2 * i + 1]) * (v[2 * i + 1] - v_old[2 * i + 1])
            friction[i] += work
            works[FRICTION] += work
            works[NORMAL] += 0.5 * (r[2 * i] + r_old[2 * i]) * (v[2 * i] - v_old[2 * i])
            vt_old[i] = v[2 * i + 1]
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
        for i in range(m):
            r_before[i] = r_old[2 * i]
        r_old[:] = r
        v_old[:] = v
    return -1

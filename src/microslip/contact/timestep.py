"""Compiled time stepping of a joint model with exact contact.

Hilber–Hughes–Taylor on the modes (``alpha`` in [0, 1/3], gamma = 1/2 + alpha,
beta = (1 + alpha)²/4), the residual flexibility quasi-static with its share of the stiffness
damping. One contact problem per step:

    v = v_free - W_step r,   W_step = W_res / (1 + tau/dt) + Psi S Psi^T

with ``S`` the displacement of a mode at the end of a step per unit force there.
"""

from __future__ import annotations

import numba as nb
import numpy as np

from microslip.contact.planar import _jit, _refactor, solve

assert nb


@_jit
def step_cycles(
    W, R, stiffness, scale, mu, force, tolerance, psi, psi_t, W_res, omega, damping, tau, alpha,
    dt, drive_modes, drive_v, constant_modes, constant_v, load, out_modes, out_v, out_load,
    eta, eta1, eta2, modal_force, s, vt_old, status, G, slots, slot_of, touching, r, q, v,
    outputs, friction, normal, damped, r_out, v_out, status_out, keep, iterations, residuals,
):
    """March over ``load.shape[0] - 1`` steps; the state arrays are updated in place.

    ``load`` is the amplitude of the driving port at every step; outputs are written per step,
    work and damping summed. Returns (touching, failed step or -1).
    """
    k = eta.shape[0]
    N = v.shape[0]
    m = mu.shape[0]
    gamma = 0.5 + alpha
    beta = 0.25 * (1.0 + alpha) ** 2
    a1 = 1.0 - alpha
    decay = tau / dt
    v_free = np.empty(N)
    f_q = np.empty(0)
    pe = np.empty(k)
    pv = np.empty(k)
    denominator = np.empty(k)
    compliance = np.empty(k)
    start = np.empty(k)
    eta_new = np.empty(k)
    new_force = np.empty(k)
    r_old = r.copy()
    v_old = v.copy()
    res = np.empty(N)
    for j in range(k):
        denominator[j] = 1.0 + a1 * (gamma * dt * damping[j] + beta * dt * dt * omega[j] ** 2)
        compliance[j] = a1 * beta * dt * dt / denominator[j]
    for step in range(1, load.shape[0]):
        for j in range(k):
            pe[j] = eta[j] + dt * eta1[j] + dt * dt * (0.5 - beta) * eta2[j]
            pv[j] = eta1[j] + dt * (1.0 - gamma) * eta2[j]
            external = constant_modes[j] + drive_modes[j] * load[step]
            rhs = (
                a1 * external
                + alpha * (modal_force[j] - damping[j] * eta1[j] - omega[j] ** 2 * eta[j])
                - a1 * (damping[j] * pv[j] + omega[j] ** 2 * pe[j])
            )
            start[j] = rhs / denominator[j]
            eta_new[j] = pe[j] + beta * dt * dt * start[j]
            new_force[j] = external
        for i in range(N):
            v_free[i] = (constant_v[i] + drive_v[i] * load[step] + decay * s[i]) / (1.0 + decay)
        for j in range(k):
            x = eta_new[j]
            p = psi_t[j]
            for i in range(N):
                v_free[i] += x * p[i]
        touching, its, residual, rule = solve(
            W, R, stiffness, scale, mu, force, tolerance, v_free, f_q, vt_old, status, G, slots,
            slot_of, touching, r, q, v,
        )
        iterations[step] = its
        residuals[step] = residual
        if rule == 3:
            return touching, step
        for j in range(k):
            x = 0.0
            p = psi_t[j]
            for i in range(N):
                x += p[i] * r[i]
            acceleration = start[j] - a1 * x / denominator[j]
            velocity = pv[j] + gamma * dt * acceleration
            position = eta_new[j] - compliance[j] * x
            mean_velocity = (position - eta[j]) / dt
            damped[0] += damping[j] * mean_velocity**2 * dt
            eta[j] = position
            eta1[j] = velocity
            eta2[j] = acceleration
            modal_force[j] = new_force[j] - x
        for i in range(N):
            res[i] = v[i]
        for j in range(k):
            x = eta[j]
            p = psi_t[j]
            for i in range(N):
                res[i] -= x * p[i]
        for i in range(N):
            # residual part: its own damping force is tau * (stiffness) * rate
            s[i] = res[i]
        for i in range(m):
            mean_t = 0.5 * (r[2 * i + 1] + r_old[2 * i + 1])
            friction[i] += mean_t * (v[2 * i + 1] - v_old[2 * i + 1])
            mean_n = 0.5 * (r[2 * i] + r_old[2 * i])
            normal[0] += mean_n * (v[2 * i] - v_old[2 * i])
            vt_old[i] = v[2 * i + 1]
        for o in range(outputs.shape[1]):
            y = out_load[0, o] + out_load[1, o] * load[step]
            for j in range(k):
                y += out_modes[j, o] * eta[j]
            for i in range(N):
                y -= out_v[i, o] * r[i]
            outputs[step, o] = y
        if keep:
            r_out[step] = r
            v_out[step] = v
            status_out[step] = status
        r_old[:] = r
        v_old[:] = v
    return touching, -1

"""Time integration of the joint model with exact contact, and its steady state by marching.

See `contact/timestep.py` for the scheme. Its period error is ``(omega dt)²/12`` relative (longer) to
leading order for alpha = 0; compare methods at the frequency corrected for it.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from microslip.contact.planar import SEPARATED, STICK, _refactor
from microslip.contact.solver import TOLERANCE
from microslip.contact.timestep import step_cycles
from microslip.errors import ContactError
from microslip.harmonics import harmonic
from microslip.model import JointModel
from microslip.statics import Prestress

Array = NDArray[np.float64]


class TimeIntegrator:
    def __init__(self, model, prestress, friction, dt, port="moment", alpha=0.05, compliance=None):
        self.model, self.dt, self.alpha = model, dt, alpha
        m, N = model.pairs, 2 * model.pairs
        self.mu = np.full(m, float(friction))
        self.tau = model.rayleigh[1]
        gamma, beta, a1 = 0.5 + alpha, 0.25 * (1 + alpha) ** 2, 1 - alpha
        self.damping = model.modal_damping()
        den = 1 + a1 * (gamma * dt * self.damping + beta * dt**2 * model.omega**2)
        S = a1 * beta * dt**2 / den
        W = model.residual / (1 + self.tau / dt) + (model.mode_v * S) @ model.mode_v.T
        if compliance is not None:
            W = W + np.diag(compliance)
        self.W = np.ascontiguousarray(0.5 * (W + W.T))
        self.psi_t = np.ascontiguousarray(model.mode_v.T)
        p, c = model.port(port), model.port("clamp")
        self.drive = p
        P = prestress.clamp
        self.constant_modes = model.port_modes[:, c] * P
        self.constant_v = model.port_v[:, c] * P
        self.drive_modes = np.ascontiguousarray(model.port_modes[:, p])
        self.drive_v = np.ascontiguousarray(model.port_v[:, p])
        self.out_load = np.vstack([model.port_port[c] * P, model.port_port[p]])
        # state
        sol = prestress.solution
        self.r, self.v = sol.r.copy(), sol.v.copy()
        x = model.mode_v.T @ self.r
        e = model.equilibrium_modes
        self.eta = np.zeros(len(model.omega))
        self.eta[:e] = sol.q
        self.eta[e:] = (self.constant_modes - x)[e:] / model.omega[e:] ** 2
        self.eta1 = np.zeros_like(self.eta)
        self.eta2 = np.zeros_like(self.eta)
        self.modal_force = self.constant_modes - x
        self.s = self.v - model.mode_v @ self.eta
        self.vt_old = self.v[1::2].copy()
        self.status = np.where(prestress.touching, STICK, SEPARATED).astype(np.int8)
        self.force = np.full(m, np.abs(sol.r).max())
        self.G = np.zeros((N, N))
        self.slots = np.zeros(m, np.int64)
        self.slot_of = np.zeros(m, np.int64)
        self.R = np.zeros((N, 0))
        self.e0 = np.zeros(0)
        self.touching = _refactor(self.G, self.W, self.R, self.e0, self.e0, self.mu, self.status, self.slots, self.slot_of)
        self.rest = self.out_load[0] + model.port_modes.T @ self.eta - model.port_v.T @ self.r

    def march(self, load, keep=False):
        m, N = self.model.pairs, 2 * self.model.pairs
        n = len(load)
        outputs = np.zeros((n, len(self.model.ports)))
        friction, normal, damped = np.zeros(m), np.zeros(1), np.zeros(1)
        kk = n if keep else 1
        r_out, v_out = np.zeros((kk, N)), np.zeros((kk, N))
        st = np.zeros((kk, m), np.int8)
        its, res = np.zeros(n, np.int64), np.zeros(n)
        outputs[0] = self.rest
        self.touching, failed = step_cycles(
            self.W, self.R, self.e0, self.e0, self.mu, self.force, TOLERANCE, self.model.mode_v,
            self.psi_t, self.model.residual, self.model.omega, self.damping, self.tau, self.alpha,
            self.dt, self.drive_modes, self.drive_v, self.constant_modes, self.constant_v, load,
            self.model.port_modes, self.model.port_v, self.out_load,
            self.eta, self.eta1, self.eta2, self.modal_force, self.s, self.vt_old, self.status,
            self.G, self.slots, self.slot_of, self.touching, self.r, self.e0, self.v,
            outputs, friction, normal, damped, r_out, v_out, st, keep, its, res)
        if failed >= 0:
            raise ContactError(f"step {failed}")
        return outputs - self.rest, friction, normal[0], damped[0], its, res

"""Harmonic balance of the modes alone, with contact solved behind what the harmonics left out give way by.

The dynamic Lagrangian method (`equations.py`) augments reactions by a stiffness eps of every component; here
a whole matrix takes its place, ``W_S^-1``, which is the augmentation of all pairs together. With

    y(t) = v(t) + W_S r(t),        W_S = W_res + sum_n s_n psi_n psi_n^T

contact answers a motion y by reactions r that obey its laws at every sample (`contact/driven.py`): no sample
is in a wrong state, however far from a solution y is. The reactions act on the modes harmonic by harmonic.
With the amplitudes ``zeta_n = eta_n + s_n psi_n^T r`` of the kept modes

    y_h = sum_n psi_n zeta_n,h + d_h
    Z_n,h zeta_n,h + (1 - Z_n,h s_n) psi_n^T r_h = f_n,h,        Z_n,h = omega_n² - h² omega² + i h omega c_n

are the equations: of a few modes, not of all pairs. ``d`` is the little that is left, the lag of the residual
flexibility behind its damping and the dynamics of modes far above the harmonics. The harmonics left out see
``W_S`` as they see 1/eps there, and again that vanishes from the answer as harmonics grow. Its

    s_n = 1 / max(omega_n, (H + 1/2) omega)²

is static for modes above the harmonics, and for those below what their inertia gives way by at the first
harmonic that is left out.

It is harmonic balance of the massless-boundary model (D. Monjaraz Tec, J. Gross & M. Krack, Computers &
Structures 260 (2022) 106698) with a boundary that has as much of the modes as their harmonics leave out.

Bodies that walk have the change of their place per cycle as unknowns beside the mean of y; their place is
given, as in `equations.py`.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from microslip.analyses.harmonic.operator import linear_operator
from microslip.analyses.harmonic.problem import HarmonicProblem
from microslip.brief import Brief
from microslip.contact.driven import DrivenContact, DrivenCycle, DrivenTangent
from microslip.contact.pairs import tangential_vectors
from microslip.contact.samples import sample_table
from microslip.numerics.continuation import ContinuationError
from microslip.numerics.fourier import to_complex, to_real
from microslip.typing import Array, Complex

SAMPLES_PER_HARMONIC = 8
"""As contact is exact at every sample, what they miss is only where between them it changes."""

LEAST_SAMPLES = 128

REACH = 1.5
"""Modes up to this much above the highest harmonic are unknowns; those beyond are in `d` of `modal.py`."""


def with_modal_samples(problem: HarmonicProblem, harmonics: int) -> HarmonicProblem:
    """The same equations with so many harmonics, and the samples that contact behind a flexibility needs."""
    samples = max(LEAST_SAMPLES, SAMPLES_PER_HARMONIC * harmonics)
    return replace(problem, table=sample_table(harmonics, samples))


@dataclass(frozen=True, repr=False)
class ModalMotion(Brief):
    """A guess or a solution.

    Attributes
    ----------
    zeta : (k, c) array
        Coefficients of the kept modes.
    drift : (s,) array
        Changes of the sliding unknowns per cycle.
    rest : (d m, c) array
        d, m.
    """

    zeta: Array
    drift: Array
    rest: Array


@dataclass(frozen=True, repr=False)
class ModalEvaluation(Brief):
    """Equations at a motion.

    Attributes
    ----------
    motion : ModalMotion
    cycle : DrivenCycle
    r : (d m, c) array
        Coefficients of the reactions.
    F : (n,) array
        Residual, N (per metre of width in the plane).
    """

    motion: ModalMotion
    cycle: DrivenCycle
    r: Array
    F: Array


class ModalEquations:
    """The equations at one frequency under one load.

    Parameters
    ----------
    problem : HarmonicProblem
        Of all pairs.
    omega : float
        rad/s.
    load : float
    softer : float
        Of s_n of the modes below the harmonics, over what it is above.

    Raises
    ------
    ContinuationError
        Where damping couples the modes.
    """

    def __init__(
        self, problem: HarmonicProblem, omega: float, load: float, softer: float = 1.0
    ) -> None:
        model, H = problem.model, problem.harmonics
        if model.damping is not None:
            raise ContinuationError("damping couples the modes: they are not balanced alone")
        assert not problem.half_turn
        self.problem, self.load = problem, load
        self.operator = operator = linear_operator(problem, omega)
        self.e = e = len(problem.rigid_modes)
        self.k = k = max(int(np.sum(model.omega < REACH * H * omega)), e)
        self.psi, rest = model.mode_v[:, :k], model.mode_v[:, k:]
        softness = 1 / np.maximum(model.omega, (H + 0.5) * omega / np.sqrt(softer)) ** 2
        self.s = softness[:k]
        self.beyond, static = rest, 1 / model.omega[k:] ** 2
        W = problem.residual[0] + (rest * static) @ rest.T + (self.psi * self.s) @ self.psi.T
        W = 0.5 * (W + W.T)
        force = np.full(model.pairs, problem.force_scale)
        self.contact = DrivenContact(W, problem.friction, force)
        h = np.arange(H + 1)[:, None] * omega
        damping = model.modal_damping()[:k]
        self.Z: Complex = model.omega[:k] ** 2 - h**2 + 1j * h * damping
        self.Q = 1 - self.Z * self.s
        held, driven = problem.held_load, problem.driven(load)
        self.f = np.zeros((k, 2 * H + 1))
        self.f[:, 0], self.f[:, 1] = model.port_modes[:k] @ held, model.port_modes[:k] @ driven
        # what d is linear in
        self.late = 1 - operator.lag
        self.dynamic = static - operator.modal[:, k:]
        free: Complex = np.zeros((H + 1, len(rest)), dtype=complex)
        for order, loads in ((0, held), (1, driven)):
            free[order] = operator.lag[order] * (model.port_v @ loads)
            free[order] += rest @ (operator.modal[order, k:] * (model.port_modes[k:] @ loads))
        self.free = to_real(free)
        # scales that make forces of all residuals
        self.by_mode = 1 / np.maximum(np.abs(self.psi).max(axis=0), 1e-12 * np.abs(self.psi).max())
        self.by_component = 1 / np.diag(W)
        self.places = np.linalg.pinv(problem.rigid_modes)
        self.slides = problem.slides if problem.walks else 0

    @property
    def shape(self) -> tuple[int, int]:
        """Of zeta."""
        return self.k, self.problem.table.coefficients

    @property
    def modal_size(self) -> int:
        """Unknowns of the modes, with the places of the nearly rigid ones and the walk."""
        k, c = self.shape
        return k * c - self.e + self.problem.rigid_modes.shape[1] + self.slides

    def pack(self, motion: ModalMotion) -> Array:
        """Unknowns: zeta but for the mean of the nearly rigid modes, their places, the walk, d as a force."""
        zeta = motion.zeta.ravel()
        mean = np.arange(self.e) * self.shape[1]
        return np.concatenate(
            [
                np.delete(zeta, mean),
                self.places @ motion.zeta[: self.e, 0],
                motion.drift,
                (motion.rest * self.by_component[:, None]).ravel(),
            ]
        )

    def unpack(self, z: Array) -> ModalMotion:
        """The motion of some unknowns."""
        k, c = self.shape
        rigid = self.problem.rigid_modes
        free = k * c - self.e
        zeta = np.empty(k * c)
        mean = np.arange(self.e) * c
        inner = np.ones(k * c, dtype=bool)
        inner[mean] = False
        zeta[inner] = z[:free]
        zeta[mean] = rigid @ z[free : free + rigid.shape[1]]
        drift = z[free + rigid.shape[1] : self.modal_size]
        rest = z[self.modal_size :].reshape(-1, c) / self.by_component[:, None]
        return ModalMotion(zeta.reshape(k, c), drift, rest)

    def _rows(self, modal: Array, place: Array, rest: Array) -> Array:
        """Residuals in the order of the unknowns, as forces."""
        rigid = self.problem.rigid_modes
        imbalance = rigid.T @ modal[: self.e, 0] * self.problem.spring
        scaled = (modal * self.by_mode[:, None]).ravel()
        inner = np.delete(scaled, np.arange(self.e) * self.shape[1])
        rest = (rest * self.by_component[:, None]).ravel()
        return np.concatenate([inner, imbalance, place, rest])

    def linear(self, zeta: Array, rest: Array, r: Array) -> Array:
        """What is linear in the equations, without loads and places."""
        g = self.psi.T @ r
        modal = to_real(self.Z * to_complex(zeta) + self.Q * to_complex(g))
        place = self._place(zeta, g)[len(self.places) - self.slides :]
        return self._rows(modal, place, rest - self.left_out(r))

    def _place(self, zeta: Array, g: Array) -> Array:
        """Where the bodies stand under mean forces g of the reactions, in unknowns."""
        e = self.e
        return np.asarray(self.places @ (zeta[:e, 0] - self.s[:e] * g[:e, 0]))

    def left_out(self, r: Array) -> Array:
        """d of reactions alone, (d m, c)."""
        R = to_complex(r)
        moved = ((R @ self.beyond) * self.dynamic) @ self.beyond.T
        return to_real(moved + self.late[:, None] * (R @ self.problem.residual[0]))

    def y(self, zeta: Array, rest: Array) -> Array:
        """Samples of y, (N, d m)."""
        return np.asarray(self.problem.table.basis.T @ (self.psi @ zeta + rest).T)

    def walk(self, drift: Array) -> Array:
        """Displacements of all pairs over a cycle, (d m,)."""
        problem = self.problem
        walk = np.zeros(len(self.psi))
        if self.slides:
            moved = problem.rigid_spread[:, -self.slides :] @ drift
            along = tangential_vectors(walk, problem.dimension)
            along += tangential_vectors(moved, problem.dimension)
        return walk

    def at(self, z: Array) -> ModalEvaluation:
        """Evaluate.

        Raises
        ------
        ContactError
            Where contact is not solved.
        """
        motion, problem = self.unpack(z), self.problem
        held = problem.held[:, 0] if problem.dimension == 2 else problem.held
        y = self.y(motion.zeta, motion.rest)
        cycle = self.contact.cycle(y, held, self.walk(motion.drift))
        r = (problem.table.projection @ cycle.r).T
        F = self.linear(motion.zeta, motion.rest, r) - self._rows(self.f, self._stand(), self.free)
        return ModalEvaluation(motion, cycle, r, F)

    def _stand(self) -> Array:
        """Where walking bodies are to stand, in unknowns."""
        problem = self.problem
        place = problem.rest_place + problem.offset
        return np.asarray(place[len(place) - self.slides :])

    def derivative_times(self, tangent: DrivenTangent, z: Array) -> Array:
        """Derivative of the residual along unknowns; `tangent` is that of the evaluation's cycle."""
        change = self.unpack(z)
        dr = tangent.times(self.y(change.zeta, change.rest), self.walk(change.drift))
        r = (self.problem.table.projection @ dr).T
        return self.linear(change.zeta, change.rest, r)

    def motion_of(self, w: Array) -> ModalMotion:
        """The motion whose reactions are those of unknowns w of the problem."""
        r, q = self.problem.split(w)
        p, e = w[r.size :], self.e
        g = self.psi.T @ r
        with np.errstate(divide="ignore", invalid="ignore"):
            eta = (to_complex(self.f) - to_complex(g)) / self.Z
        eta[0, :e] = q
        zeta = to_real(eta + self.s * to_complex(g))
        drift = p[len(p) - self.slides :]
        return ModalMotion(zeta, drift, self.free + self.left_out(r))

    def unknowns(self, evaluation: ModalEvaluation) -> Array:
        """Unknowns w of the problem of a solution."""
        p = self._place(evaluation.motion.zeta, self.psi.T @ evaluation.r)
        p[len(p) - self.slides :] = evaluation.motion.drift
        return np.concatenate([evaluation.r.ravel(), p])

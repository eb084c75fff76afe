"""Multi-harmonic balance of the joint model with exact contact, condensed to the contact pairs.

With ``y(t) = Y_0 + sum_h Im(Y_h e^{i h omega t})`` the joint model is one linear relation per harmonic,

    v_h = v_free,h - W_h r_h
    W_h = W_res / (1 + i h omega tau) + Psi diag(1 / (omega_n² - h² omega² + i h omega c_n)) Psi^T

(tau: the residual flexibility follows behind its share of the stiffness damping, as in
`contact/timestep.py`), and the contact laws in time close it. In the mean the nearly rigid modes would
swamp W with their flexibility; their mean amplitudes q are unknowns of equilibrium, as in statics:

    v_0 = v_free,0 + R q - W_0 r_0,      K_q q + R^T r_0 = f_q

Unknowns are the coefficients of all reactions and q, and the equations of the reactions are

    F(r) = r - C(r + eps v(r)) = 0

with ``C`` the compiled contact cycle of `contact/aft.py` (dynamic Lagrangian; Nacivet, Pierre, Thouverez
& Jezequel, J. Sound Vib. 265 (2003) 201). ``1/eps`` is the flexibility that harmonics beyond the last
one see; it vanishes from the answer as harmonics grow. An elastic contact is a compliance on the
diagonal of ``W_res``.

`HarmonicProblem` states the equations; `microslip.harmonic_solver` solves them at one frequency;
`microslip.response` walks over frequencies and loads.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from microslip.contact.aft import (
    ContactCycle,
    SampleTable,
    contact_cycle,
    sample_table,
    times_derivative,
)
from microslip.errors import MicroslipError
from microslip.flexibility import harmonic_compliance
from microslip.model import JointModel
from microslip.statics import Prestress

Array = NDArray[np.float64]
Complex = NDArray[np.complex128]

SAMPLES_PER_HARMONIC = 24
LEAST_SAMPLES = 128


@dataclass(frozen=True)
class HarmonicProblem:
    """Equations of harmonic balance for one joint and one driven port.

    Attributes
    ----------
    model : JointModel
    prestress : Prestress
        Its clamp force is held; its frictionless displacements are where stuck pairs stay.
    friction : (m,) array
    port : str
        Driven port, ``load sin(omega t)``.
    table : SampleTable
        Harmonics and samples.
    residual : (2 m, 2 m) array
        Residual flexibility, with the compliance of an elastic contact on its diagonal.
    stiffness : (2 m,) array
        Augmentation eps of each component, N/m per metre of width.
    held : (m,) array
        Tangential displacement at which a pair sticks that never slips, m.
    unit_q : (e,) array
        Mean amplitude of each nearly rigid mode that counts as one newton in the unknowns.
    """

    model: JointModel
    prestress: Prestress
    friction: Array
    port: str
    table: SampleTable
    residual: Array
    stiffness: Array
    held: Array
    unit_q: Array

    @property
    def harmonics(self) -> int:
        """Number of harmonics H beside the mean."""
        return self.table.harmonics

    @property
    def shape(self) -> tuple[int, int]:
        """Of the unknowns: components of all reactions by real coefficients, (2 m, 2 H + 1)."""
        return 2 * self.model.pairs, self.table.coefficients

    @cached_property
    def force_scale(self) -> float:
        """Largest reaction of the prestress, N per metre of width: the unit of residuals."""
        return float(np.abs(self.prestress.solution.r).max())

    @cached_property
    def spring(self) -> float:
        """Mean augmentation, N/m: turns imbalance times `unit_q` into a force."""
        return float(self.stiffness.mean())

    @property
    def size(self) -> int:
        """Number of unknowns."""
        return self.shape[0] * self.shape[1] + len(self.unit_q)

    def split(self, w: Array) -> tuple[Array, Array]:
        """Coefficients of the reactions (2 m, c), a view, and q, from the unknowns."""
        cut = self.shape[0] * self.shape[1]
        return w[:cut].reshape(self.shape), w[cut:] * self.unit_q

    def join(self, u: Array, q: Array) -> Array:
        """Inverse of `split`."""
        return np.concatenate([u.ravel(), q / self.unit_q])

    def rest(self) -> Array:
        """Unknowns at prestress."""
        u = np.zeros(self.shape)
        u[:, 0] = self.prestress.solution.r
        return self.join(u, self.prestress.solution.q)


def harmonic_problem(
    model: JointModel,
    prestress: Prestress,
    friction: float | Array,
    *,
    harmonics: int = 5,
    samples: int | None = None,
    port: str = "moment",
    compliance: Array | None = None,
    stiffness: Array | None = None,
) -> HarmonicProblem:
    """State the equations.

    Parameters
    ----------
    model : JointModel
        With ports ``clamp`` and `port`; each of its modes with some stiffness.
    prestress : Prestress
    friction : float or (m,) array
    harmonics : int
        H >= 1, beside the mean; even ones are included.
    samples : int, optional
        Samples per cycle; at least 128 and 24 per harmonic by default.
    port : str
        Driven port.
    compliance : (2 m,) array, optional
        Contact compliance, m/N (elastic contact).
    stiffness : (2 m,) array, optional
        Augmentation, by default the inverse of the diagonal of the residual flexibility.

    Raises
    ------
    MicroslipError
        Where a mode has no stiffness (its mean position would be undetermined), or the residual
        flexibility of some component is zero and no `stiffness` is given.
    ContactError
        Where the samples do not resolve the harmonics.
    """
    model.port(port)
    count = samples if samples is not None else _samples(harmonics)
    friction = np.broadcast_to(np.asarray(friction, dtype=float), (model.pairs,)).copy()
    if not (np.isfinite(friction).all() and (friction >= 0).all()):
        raise MicroslipError("coefficient of friction must be finite and not negative")
    if not model.omega.min() > 1e-9 * model.omega.max():
        free = int(np.argmin(model.omega))
        raise MicroslipError(
            f"mode {free} has no stiffness ({model.omega[free] / (2 * np.pi):.3g} Hz): harmonic "
            "balance cannot find its mean position; support the joint with a weak spring"
        )
    residual = model.residual + (np.diag(compliance) if compliance is not None else 0.0)
    if stiffness is None:
        own = np.diag(residual)
        if not own.min() > 0:
            raise MicroslipError(
                f"component {int(np.argmin(own))} of the contact pairs has no residual flexibility "
                "of its own: give the augmentation `stiffness`, or keep fewer modes dynamic"
            )
        stiffness = 1 / own
    stiffness = np.broadcast_to(np.asarray(stiffness, dtype=float), (2 * model.pairs,)).copy()
    rigid = np.abs(model.mode_v[:, : model.equilibrium_modes])
    return HarmonicProblem(
        model=model,
        prestress=prestress,
        friction=friction,
        port=port,
        table=sample_table(harmonics, count),
        residual=np.ascontiguousarray(residual),
        stiffness=stiffness,
        held=prestress.solution.v[1::2].copy(),
        unit_q=1 / (stiffness[:, None] * rigid).max(axis=0, initial=1e-300),
    )


def _samples(harmonics: int) -> int:
    return max(LEAST_SAMPLES, SAMPLES_PER_HARMONIC * harmonics)


def with_harmonics(problem: HarmonicProblem, harmonics: int) -> HarmonicProblem:
    """The same equations with another number of harmonics and the samples that go with it."""
    samples = max(_samples(harmonics), problem.table.samples)
    return replace(problem, table=sample_table(harmonics, samples))


def padded(old: HarmonicProblem, new: HarmonicProblem, w: Array) -> Array:
    """Unknowns of `old` as unknowns of `new`: harmonics appended (zero) or cut off."""
    u, q = old.split(w)
    out = np.zeros(new.shape)
    keep = min(u.shape[1], out.shape[1])
    out[:, :keep] = u[:, :keep]
    return new.join(out, q)


def to_complex(u: Array) -> Complex:
    """Coefficients ``Y_h``, (H + 1, n), of real ones (n, 2 H + 1); the mean is real."""
    Y = np.empty((u.shape[1] // 2 + 1, len(u)), dtype=complex)
    Y[0] = u[:, 0]
    Y[1:] = (u[:, 1::2] + 1j * u[:, 2::2]).T
    return Y


def to_real(Y: Complex) -> Array:
    """Inverse of `to_complex`."""
    u = np.empty((Y.shape[1], 2 * len(Y) - 1))
    u[:, 0] = Y[0].real
    u[:, 1::2], u[:, 2::2] = Y[1:].real.T, Y[1:].imag.T
    return u


@dataclass(frozen=True)
class LinearOperator:
    """The linear side at one frequency: ``v = v_free + R q - W r``, every harmonic at once.

    In the mean the nearly rigid modes are left out of W and of the modal compliance.

    Attributes
    ----------
    problem : HarmonicProblem
    omega : float
        rad/s.
    modal : (H + 1, k) complex array
        Compliance of every mode at every harmonic.
    lag : (H + 1,) complex array
        ``1 / (1 + i h omega tau)``.
    """

    problem: HarmonicProblem
    omega: float
    modal: Complex
    lag: Complex

    def flexibility(self, u: Array) -> Array:
        """``W r`` of coefficients (2 m, c)."""
        psi = self.problem.model.mode_v
        own = to_complex(self.problem.residual @ u) * self.lag[:, None]
        return to_real(own) + psi @ to_real(to_complex(psi.T @ u) * self.modal)

    def dense(self, h: int) -> Complex:
        """``W_h`` as a matrix."""
        psi = self.problem.model.mode_v
        return self.problem.residual * self.lag[h] + (psi * self.modal[h]) @ psi.T

    def free(self, load: float) -> Array:
        """Displacement without reactions under the clamp and ``load sin(omega t)``."""
        return self.response("clamp", 0, self.problem.prestress.clamp) + self.response(
            self.problem.port, 1, load
        )

    def response(self, port: str, h: int, amplitude: float) -> Array:
        """Relative displacement under a port's amplitude at harmonic h."""
        model = self.problem.model
        p = model.port(port)
        Y = np.zeros((self.problem.harmonics + 1, len(model.mode_v)), dtype=complex)
        Y[h] = model.port_v[:, p] * self.lag[h]
        Y[h] += model.mode_v @ (self.modal[h] * model.port_modes[:, p])
        return to_real(Y * amplitude)

    def modes(self, u: Array, q: Array, load: float) -> Complex:
        """Modal amplitudes (H + 1, k) under clamp, load and reactions."""
        model = self.problem.model
        force = -to_complex(model.mode_v.T @ u)
        force[0] += model.port_modes[:, model.port("clamp")] * self.problem.prestress.clamp
        force[1] += model.port_modes[:, model.port(self.problem.port)] * load
        modes = force * self.modal
        modes[0, : len(q)] = q
        return modes

    def outputs(self, u: Array, q: Array, load: float) -> Complex:
        """Outputs of all ports, (H + 1, p), total."""
        model = self.problem.model
        residual = -to_complex(model.port_v.T @ u)
        residual[0] += model.port_port[model.port("clamp")] * self.problem.prestress.clamp
        residual[1] += model.port_port[model.port(self.problem.port)] * load
        return residual * self.lag[:, None] + self.modes(u, q, load) @ model.port_modes

    def frequency_derivative(self, u: Array, load: float) -> Array:
        """Derivative of the relative displacement by omega at constant reactions."""
        model = self.problem.model
        h = np.arange(self.problem.harmonics + 1)[:, None]
        slope = 2 * h**2 * self.omega - 1j * h * model.modal_damping()
        modes = slope * self.modal * self.modes(u, np.zeros(len(self.problem.unit_q)), load)
        own = -to_complex(self.problem.residual @ u)
        own[0] += model.port_v[:, model.port("clamp")] * self.problem.prestress.clamp
        own[1] += model.port_v[:, model.port(self.problem.port)] * load
        tau = model.rayleigh[1]
        return to_real(own * (-1j * h * tau * self.lag[:, None] ** 2) + modes @ model.mode_v.T)


def linear_operator(problem: HarmonicProblem, omega: float) -> LinearOperator:
    """Linear side at circular frequency `omega` (rad/s, > 0)."""
    if not (np.isfinite(omega) and omega > 0):
        raise MicroslipError(f"frequency {omega / (2 * np.pi):g} Hz must be positive")
    modal, lag = harmonic_compliance(problem.model, omega, problem.harmonics)
    modal[0, : len(problem.unit_q)] = 0.0
    return LinearOperator(problem, float(omega), modal, lag)


@dataclass(frozen=True)
class Evaluation:
    """Equations evaluated at one set of unknowns.

    Attributes
    ----------
    w : (n,) array
        Unknowns.
    v : (2 m, c) array
        Relative displacements.
    cycle : ContactCycle
    F : (n,) array
        ``r - C(r + eps v)``, and the imbalance of the nearly rigid modes; N per metre of width.
    """

    w: Array
    v: Array
    cycle: ContactCycle
    F: Array


def evaluate(operator: LinearOperator, load: float, w: Array) -> Evaluation:
    """Residual of the unknowns `w` under an amplitude of the load."""
    problem = operator.problem
    model = problem.model
    u, q = problem.split(w)
    e = len(q)
    rigid = model.mode_v[:, :e]
    v = operator.free(load) - operator.flexibility(u)
    v[:, 0] += rigid @ q
    x = u + problem.stiffness[:, None] * v
    cycle = contact_cycle(
        problem.table,
        x.reshape(-1, 2, problem.table.coefficients),
        problem.friction,
        problem.stiffness[1::2] * problem.held,
    )
    clamp = model.port_modes[:e, model.port("clamp")] * problem.prestress.clamp
    imbalance = model.omega[:e] ** 2 * q + rigid.T @ u[:, 0] - clamp
    F = np.concatenate(
        [(u - cycle.r.reshape(u.shape)).ravel(), imbalance * problem.unit_q * problem.spring]
    )
    return Evaluation(w, v, cycle, F)


def derivative_times(operator: LinearOperator, cycle: ContactCycle, z: Array) -> Array:
    """Derivative of the residual along `z`: ``J z``."""
    problem = operator.problem
    u, q = problem.split(z)
    rigid = problem.model.mode_v[:, : len(q)]
    own = -operator.flexibility(u)
    own[:, 0] += rigid @ q
    x = u + problem.stiffness[:, None] * own
    out = np.empty_like(cycle.r)
    times_derivative(cycle.nn, cycle.tn, cycle.tt, x.reshape(out.shape), out)
    imbalance = problem.model.omega[: len(q)] ** 2 * q + rigid.T @ u[:, 0]
    return np.concatenate(
        [(u - out.reshape(u.shape)).ravel(), imbalance * problem.unit_q * problem.spring]
    )

"""The linear side of harmonic balance at one frequency, every harmonic at once.

``v_h = v_free,h + R q - W_h r_h`` with the flexibility of `equations.py`; parities of the half turn
are in the arrays of `HarmonicProblem`.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property, lru_cache
from typing import NamedTuple

import numpy as np

from microslip.analyses.harmonic.problem import HarmonicProblem
from microslip.brief import Brief
from microslip.errors import MicroslipError
from microslip.model.flexibility import amplitudes_under, harmonic_compliance
from microslip.numerics.fourier import parity, to_complex, to_real
from microslip.typing import Array, Complex, Indices


class Slope(NamedTuple):
    """Derivative of the linear side by a parameter.

    Attributes
    ----------
    modal : (H + 1, k) or (H + 1, k, k) complex array
        Derivative of the modal compliance over that compliance; of the shape of the latter.
    lag : (H + 1,) complex array
    """

    modal: Complex
    lag: Complex


@dataclass(frozen=True, repr=False)
class LinearOperator(Brief):
    """The linear side at one frequency: ``v = v_free + R q - W r``, every harmonic at once.

    In the mean the nearly rigid modes are left out of W and of the modal compliance.

    Attributes
    ----------
    problem : HarmonicProblem
    omega : float
        rad/s.
    modal : (H + 1, k) or (H + 1, k, k) complex array
        Compliance of every mode at every harmonic; a matrix where damping couples them.
    lag : (H + 1,) complex array
        ``1 / (1 + i h omega tau)``.
    """

    problem: HarmonicProblem
    omega: float
    modal: Complex
    lag: Complex

    def flexibility(self, u: Array) -> Array:
        """``W r`` of coefficients (2 m, c)."""
        p = self.problem
        own = to_complex(by_parity(p.residual, u)) * self.lag[:, None]
        return to_real(own) + self.of_modes(amplitudes_under(self.modal, self.on_modes(u)))

    def on_modes(self, u: Array) -> Complex:
        """Forces on the modes, (H + 1, k), to reactions, (2 m, c), along the displacements."""
        return to_complex(by_parity(self.problem.gather.transpose(0, 2, 1), u))

    def of_modes(self, eta: Complex) -> Array:
        """Relative displacement, (2 m, c), under modal amplitudes (H + 1, k)."""
        return by_parity(self.problem.spread, to_real(eta))

    def dense(self, h: int) -> Complex:
        """``W_h`` as a matrix."""
        p, odd = self.problem, h % 2
        own, modal = p.residual[odd] * self.lag[h], self.modal[h]
        moved = p.spread[odd] * modal if modal.ndim == 1 else p.spread[odd] @ modal
        return np.asarray(own + moved @ p.gather[odd].T)

    def free(self, load: float) -> Array:
        """Displacement without reactions under the clamp and ``load sin(omega t)``."""
        return self._held + self._per_load * load

    def per_load(self) -> Array:
        """Relative displacement per unit amplitude of the driven port."""
        return self._per_load

    @cached_property
    def _held(self) -> Array:
        p = self.problem
        return self._under(p.held_load / p.prestress.force, 0) * p.prestress.force

    @cached_property
    def _per_load(self) -> Array:
        return self._under(self.problem.driven(1.0), 1)

    def _under(self, a: Array, h: int) -> Array:
        """Relative displacement under amplitudes of all ports at harmonic h."""
        problem, model = self.problem, self.problem.model
        Y: Complex = np.zeros((problem.harmonics + 1, len(problem.rows)), dtype=complex)
        Y[h] = (model.port_v[problem.rows] @ a) * self.lag[h]
        force = (model.port_modes @ a)[None]
        Y[h] += problem.spread[h % 2] @ amplitudes_under(self.modal[h : h + 1], force)[0]
        return to_real(Y)

    def modes(self, u: Array, q: Array, load: float) -> Complex:
        """Modal amplitudes (H + 1, k) under clamp, load and reactions, total."""
        problem, model = self.problem, self.problem.model
        force = -to_complex(by_parity(problem.gather.transpose(0, 2, 1), u))
        force[0] += model.port_modes @ problem.held_load
        force[1] += model.port_modes @ problem.driven(load)
        modes = amplitudes_under(self.modal, force)
        modes[0, : len(q)] = q
        return modes

    def outputs(self, u: Array, q: Array, load: float) -> Complex:
        """Outputs of all ports, (H + 1, p), total."""
        problem, model = self.problem, self.problem.model
        residual = -to_complex(model.port_v.T @ problem.unfold(u))
        residual[0] += problem.held_load @ model.port_port
        residual[1] += problem.driven(load) @ model.port_port
        return residual * self.lag[:, None] + self.modes(u, q, load) @ model.port_modes

    def frequency_derivative(self, u: Array, load: float) -> Array:
        """Derivative of the relative displacement by omega at constant reactions."""
        return self._displacement(u, load, self.by_frequency)

    def damping_derivative(self, u: Array, load: float) -> Array:
        """Derivative of the relative displacement by alpha of the damping."""
        return self._displacement(u, load, self.by_damping)

    @cached_property
    def by_frequency(self) -> Slope:
        """Derivative by omega."""
        problem, h = self.problem, np.arange(self.problem.harmonics + 1)[:, None]
        model = problem.model
        modal = 2 * h**2 * self.omega - 1j * h * model.modal_damping()
        if model.damping is not None:
            modal = (
                modal[:, :, None] * np.eye(len(model.omega)) - 1j * h[:, :, None] * model.damping
            )
        lag = -1j * h[:, 0] * model.rayleigh[1] * self.lag**2
        slope = modal * self.modal if modal.ndim == 2 else self.modal @ modal
        return Slope(np.asarray(slope), np.asarray(lag))

    @cached_property
    def by_damping(self) -> Slope:
        """Derivative by alpha of the damping."""
        h = np.arange(self.problem.harmonics + 1).reshape(-1, *[1] * (self.modal.ndim - 1))
        return Slope(np.asarray(-1j * h * self.omega * self.modal), np.zeros_like(self.lag))

    def _displacement(self, u: Array, load: float, slope: Slope) -> Array:
        problem, model = self.problem, self.problem.model
        modes = amplitudes_under(
            slope.modal, self.modes(u, np.zeros(len(problem.rigid_modes)), load)
        )
        own = -to_complex(by_parity(problem.residual, u))
        own[1] += model.port_v[problem.rows] @ problem.driven(load)
        return to_real(own * slope.lag[:, None]) + by_parity(problem.spread, to_real(modes))

    def outputs_derivative(self, u: Array, load: float, slope: Slope) -> Complex:
        """Derivative of the outputs of all ports, (H + 1, p), at constant reactions."""
        problem, model = self.problem, self.problem.model
        modes = amplitudes_under(
            slope.modal, self.modes(u, np.zeros(len(problem.rigid_modes)), load)
        )
        residual = -to_complex(model.port_v.T @ problem.unfold(u))
        residual[1] += problem.driven(load) @ model.port_port
        return residual * slope.lag[:, None] + modes @ model.port_modes


def by_parity(matrices: Array, u: Array) -> Array:
    """First matrix times the coefficients of even harmonics, second times those of odd ones."""
    even, odd = _columns_by_parity(u.shape[1])
    out = np.empty((matrices.shape[1], u.shape[1]))
    out[:, even] = matrices[0] @ u[:, even]
    out[:, odd] = matrices[1] @ u[:, odd]
    return out


@lru_cache
def _columns_by_parity(coefficients: int) -> tuple[Indices, Indices]:
    """Places of the coefficients of even and of odd harmonics."""
    even = parity(coefficients) > 0
    return np.flatnonzero(even), np.flatnonzero(~even)


def linear_operator(problem: HarmonicProblem, omega: float) -> LinearOperator:
    """Linear side at circular frequency `omega` (rad/s, > 0)."""
    if not (np.isfinite(omega) and omega > 0):
        raise MicroslipError(f"frequency {omega / (2 * np.pi):g} Hz must be positive")
    modal, lag = harmonic_compliance(problem.model, omega, problem.harmonics)
    modal[0, : len(problem.rigid_modes)] = 0.0
    return LinearOperator(problem, float(omega), modal, lag)

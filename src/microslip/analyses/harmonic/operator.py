"""The linear side of harmonic balance at one frequency, every harmonic at once.

``v_h = v_free,h + R q - W_h r_h`` with the flexibility of `equations.py`; parities of the half turn
are in the arrays of `HarmonicProblem`.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from microslip.analyses.harmonic.problem import HarmonicProblem
from microslip.brief import Brief
from microslip.errors import MicroslipError
from microslip.model.flexibility import harmonic_compliance
from microslip.numerics.fourier import parity, to_complex, to_real
from microslip.typing import Array, Complex


@dataclass(frozen=True, repr=False)
class LinearOperator(Brief):
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
        p = self.problem
        own = to_complex(_by_parity(p.residual, u)) * self.lag[:, None]
        return to_real(own) + self.of_modes(self.on_modes(u) * self.modal)

    def on_modes(self, u: Array) -> Complex:
        """Forces on the modes, (H + 1, k), to reactions, (2 m, c), along the displacements."""
        return to_complex(_by_parity(self.problem.gather.transpose(0, 2, 1), u))

    def of_modes(self, eta: Complex) -> Array:
        """Relative displacement, (2 m, c), under modal amplitudes (H + 1, k)."""
        return _by_parity(self.problem.spread, to_real(eta))

    def dense(self, h: int) -> Complex:
        """``W_h`` as a matrix."""
        p, odd = self.problem, h % 2
        return p.residual[odd] * self.lag[h] + (p.spread[odd] * self.modal[h]) @ p.gather[odd].T

    def free(self, load: float) -> Array:
        """Displacement without reactions under the clamp and ``load sin(omega t)``."""
        p = self.problem
        held = self._under(p.held_load / p.prestress.force, 0) * p.prestress.force
        return held + self.per_load() * load

    def per_load(self) -> Array:
        """Relative displacement per unit amplitude of the driven port."""
        return self._under(self.problem.driven(1.0), 1)

    def _under(self, a: Array, h: int) -> Array:
        """Relative displacement under amplitudes of all ports at harmonic h."""
        problem, model = self.problem, self.problem.model
        Y: Complex = np.zeros((problem.harmonics + 1, len(problem.rows)), dtype=complex)
        Y[h] = (model.port_v[problem.rows] @ a) * self.lag[h]
        Y[h] += problem.spread[h % 2] @ (self.modal[h] * (model.port_modes @ a))
        return to_real(Y)

    def modes(self, u: Array, q: Array, load: float) -> Complex:
        """Modal amplitudes (H + 1, k) under clamp, load and reactions, total."""
        problem, model = self.problem, self.problem.model
        force = -to_complex(_by_parity(problem.gather.transpose(0, 2, 1), u))
        force[0] += model.port_modes @ problem.held_load
        force[1] += model.port_modes @ problem.driven(load)
        modes = force * self.modal
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
        problem, model = self.problem, self.problem.model
        h = np.arange(problem.harmonics + 1)[:, None]
        slope: Complex = 2 * h**2 * self.omega - 1j * h * model.modal_damping()
        modes: Complex = (
            slope * self.modal * self.modes(u, np.zeros(len(problem.rigid_modes)), load)
        )
        own = -to_complex(_by_parity(problem.residual, u))
        own[1] += model.port_v[problem.rows] @ problem.driven(load)
        own = own * (-1j * h * model.rayleigh[1] * self.lag[:, None] ** 2)
        return to_real(own) + _by_parity(problem.spread, to_real(modes))


def _by_parity(matrices: Array, u: Array) -> Array:
    """First matrix times the coefficients of even harmonics, second times those of odd ones."""
    even = parity(u.shape[1]) > 0
    out = np.empty((matrices.shape[1], u.shape[1]))
    out[:, even] = matrices[0] @ u[:, even]
    out[:, ~even] = matrices[1] @ u[:, ~even]
    return out


def linear_operator(problem: HarmonicProblem, omega: float) -> LinearOperator:
    """Linear side at circular frequency `omega` (rad/s, > 0)."""
    if not (np.isfinite(omega) and omega > 0):
        raise MicroslipError(f"frequency {omega / (2 * np.pi):g} Hz must be positive")
    modal, lag = harmonic_compliance(problem.model, omega, problem.harmonics)
    modal[0, : len(problem.rigid_modes)] = 0.0
    return LinearOperator(problem, float(omega), modal, lag)

"""Extended periodic motions over their amplitude, frequency and damping among the unknowns.

A motion of the sprung mode (`extended_motion.py`) of amplitude A obeys the equations of harmonic balance,
``F(w; omega, xi) = 0``, and its spring, which has its share of the stiffness damping, gives the mode nothing,

    g = (1 + i omega beta) Q_1(w, omega, xi) / A - 1 = 0.

Two real unknowns border the equations and two real equations: with

    J a = -F,   J b = -F_omega,   J c = -F_xi,   dw = a + d_omega b + d_xi c

a two by two system gives ``d_omega`` and ``d_xi``. Continuation follows them over ``p = log A``.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from microslip.analyses.harmonic.equations import (
    damping_derivative,
    frequency_derivative,
    load_derivative,
)
from microslip.analyses.harmonic.linear import HarmonicSolver
from microslip.analyses.harmonic.operator import linear_operator
from microslip.analyses.harmonic.paths import EquationsAt
from microslip.analyses.harmonic.problem import HarmonicProblem
from microslip.numerics.continuation import ContinuationError
from microslip.typing import Array

BORDER = 1e-3
"""Relative residual of b and c."""


class MotionEquations:
    """The equations of a motion and of its spring at one state (`continuation.Linearised`).

    Parameters
    ----------
    path : MotionPath
    u : (n + 2,) array
        w, omega (rad/s) and xi (1/s).
    amplitude : float
    """

    def __init__(self, path: MotionPath, u: Array, amplitude: float) -> None:
        problem = path.problem
        alpha, beta = problem.model.rayleigh
        self.path, self.amplitude = path, amplitude
        self.w, self.omega, self.xi = u[:-2], float(u[-2]), float(u[-1])
        if not self.omega > 0:
            raise ContinuationError("the stiffness of the mode is not positive")
        model = replace(problem.model, rayleigh=(alpha - self.xi, beta))
        self.operator = linear_operator(replace(problem, model=model), self.omega)
        self.port = problem.model.port(problem.port)
        self.load = path.spring * amplitude
        self.motion = EquationsAt(
            self.operator, self.omega / (2 * np.pi), self.load, self.w, path.solver, "load"
        )
        self.twist = 1 + 1j * self.omega * beta
        self.output = self._output(self.w, self.load)

    def _output(self, w: Array, load: float) -> complex:
        u, q = self.operator.problem.split(w)
        return complex(self.operator.outputs(u, q, load)[1, self.port])

    @property
    def F(self) -> Array:
        """Residual over the largest prestress reaction, then real and imaginary part of g."""
        g = self.twist * self.output / self.amplitude - 1
        return np.append(self.motion.F, [g.real, g.imag])

    def by_parameter(self) -> Array:
        """Derivative by the logarithm of the amplitude."""
        F = load_derivative(self.operator, self.motion.point) * (self.load / self.motion.scale)
        pushed = self._output(self.w, 2 * self.load) - self.output
        g = self.twist * (pushed - self.output) / self.amplitude
        return np.append(F, [g.real, g.imag])

    def solve(self, right: Array, tolerance: float, guess: Array | None = None) -> Array:
        """Solve with the derivative by all unknowns."""
        b, c = self._border()
        a = self.motion.solve(right[:-2], tolerance, None if guess is None else guess[:-2])
        u = self.operator.problem.split(self.w)[0]
        by_omega, by_alpha = (
            self.operator.outputs_derivative(u, self.load, slope)[1, self.port] * self.twist
            for slope in (self.operator.by_frequency, self.operator.by_damping)
        )
        by_omega += 1j * self.operator.problem.model.rayleigh[1] * self.output
        columns = np.array([self._along(b) + by_omega, self._along(c) - by_alpha]) / self.amplitude
        rest = complex(right[-2], right[-1]) - self._along(a) / self.amplitude
        try:
            d_omega, d_xi = np.linalg.solve(
                np.array([columns.real, columns.imag]), np.array([rest.real, rest.imag])
            )
        except np.linalg.LinAlgError as error:
            raise ContinuationError(f"frequency and damping are not determined: {error}") from error
        return np.append(a + d_omega * b + d_xi * c, [d_omega, d_xi])

    def _along(self, dw: Array) -> complex:
        """Change of the output, twisted, along a change of the unknowns."""
        return self.twist * (self._output(dw, 0.0) - self._output(np.zeros_like(dw), 0.0))

    def _border(self) -> tuple[Array, Array]:
        """b and c, found once at every state, from those of the state before."""
        if self._found is None:
            scale, point = self.motion.scale, self.motion.point
            by_omega = frequency_derivative(self.operator, point, self.load) / scale
            by_xi = -damping_derivative(self.operator, point, self.load) / scale
            old = self.path.border or (None, None)
            self._found = (
                self.motion.solve(-by_omega, BORDER, old[0]),
                self.motion.solve(-by_xi, BORDER, old[1]),
            )
            self.path.border = self._found
        return self._found

    _found: tuple[Array, Array] | None = None


class MotionPath:
    """Motions over the logarithm of their amplitude (`continuation.Problem`).

    Parameters
    ----------
    problem : HarmonicProblem
        Of the sprung mode, driven at its port.
    spring : float
        kappa, 1/s².
    solver : HarmonicSolver
    """

    parameter_scale = 1.0

    def __init__(self, problem: HarmonicProblem, spring: float, solver: HarmonicSolver) -> None:
        self.problem, self.spring, self.solver = problem, spring, solver
        reactions = np.full(problem.shape, 1 / (problem.force_scale**2 * len(problem.pairs)))
        self.weight = np.append(reactions.ravel(), np.zeros(problem.rigid_modes.shape[1] + 2))
        self.border: tuple[Array, Array] | None = None

    def at(self, u: Array, p: float) -> MotionEquations:
        """Equations of the motion of amplitude exp(p)."""
        return MotionEquations(self, u, float(np.exp(p)))

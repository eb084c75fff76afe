"""Newton's method for the equations of `modal.py`.

The derivative is applied by taking small changes round the cycle, friction with its memory
(`driven.DrivenTangent`), and GMRES solves with it. Its preconditioner is the derivative over modes and
harmonics as a matrix, without `d`; it is kept from step to step while it serves.
"""

from __future__ import annotations

from functools import partial

import numpy as np
import scipy.linalg as sl

from microslip.analyses.harmonic.krylov import Kept
from microslip.analyses.harmonic.modal import ModalEquations, ModalEvaluation
from microslip.contact.driven import DrivenTangent
from microslip.numerics.continuation import ContinuationError, StepControl, solve_at
from microslip.typing import Array

RENEW_AFTER = 15
"""The preconditioner is made anew when GMRES needs so many iterations more than with a fresh one."""

MAX_KRYLOV = 100

SOLVED = 0.3
"""Relative residual at which a step is no use."""


class ModalPath:
    """The equations as Newton's method takes them; the parameter is not used (`continuation.Problem`).

    Parameters
    ----------
    equations : ModalEquations
    """

    parameter_scale = 1.0

    def __init__(self, equations: ModalEquations) -> None:
        self.equations = equations
        self.kept: Kept[Preconditioner] = Kept()

    @property
    def weight(self) -> Array:
        """Nothing is followed."""
        return np.ones(1)

    def at(self, u: Array, p: float) -> ModalAt:
        """The equations at some unknowns."""
        return ModalAt(self, self.equations.at(u))

    def linear_solve(self, tangent: DrivenTangent, right: Array, tolerance: float) -> Array:
        """Solve the linearised equations, scaled, to a relative residual.

        Raises
        ------
        ContinuationError
            Where they are not solved.
        """
        size = float(np.linalg.norm(right))
        z, error = self.kept.solve(
            partial(self._scaled_derivative, tangent),
            partial(Preconditioner, self.equations, tangent),
            right,
            tolerance * size,
            MAX_KRYLOV,
            RENEW_AFTER,
        )
        if not error <= SOLVED * size:
            raise ContinuationError(
                f"the linearised equations of the modes are not solved (error {error / size:.1e})"
            )
        return z

    def _scaled_derivative(self, tangent: DrivenTangent, z: Array) -> Array:
        return self.equations.derivative_times(tangent, z) / self.equations.problem.force_scale


class ModalAt:
    """Equations at one point, scaled, with their derivative (`continuation.Linearised`).

    Parameters
    ----------
    path : ModalPath
    evaluation : ModalEvaluation
    """

    def __init__(self, path: ModalPath, evaluation: ModalEvaluation) -> None:
        self.path, self.evaluation = path, evaluation
        self.tangent: DrivenTangent | None = None
        self.F = evaluation.F / path.equations.problem.force_scale

    def solve(self, right: Array, tolerance: float, guess: Array | None = None) -> Array:
        """Solve with the derivative by the unknowns, from zero."""
        if self.tangent is None:
            self.tangent = self.path.equations.contact.linearised(self.evaluation.cycle)
        return self.path.linear_solve(self.tangent, right, tolerance)

    def by_parameter(self) -> Array:
        """There is no parameter."""
        raise NotImplementedError


class Preconditioner:
    """Derivative without `d`, scaled and factorised.

    Parameters
    ----------
    equations : ModalEquations
    tangent : DrivenTangent
    """

    def __init__(self, equations: ModalEquations, tangent: DrivenTangent) -> None:
        self.equations = equations
        k, _ = equations.shape
        table = equations.problem.table
        coupled = tangent.matrix(equations.psi, table.basis, table.projection)
        Q, Z = equations.Q, equations.Z
        matrix = np.empty_like(coupled)
        matrix[:, 0] = Q[0].real[:, None, None] * coupled[:, 0]
        real, imaginary = (part.T[:, :, None, None] for part in (Q[1:].real, Q[1:].imag))
        a = 2 * np.arange(len(Z) - 1) + 1
        b, n = a + 1, np.arange(k)
        sine, cosine = coupled[:, a], coupled[:, b]
        matrix[:, a] = real * sine - imaginary * cosine
        matrix[:, b] = imaginary * sine + real * cosine
        matrix[n, 0, n, 0] += Z[0].real
        n = n[:, None]
        matrix[n, a, n, a] += Z[1:].real.T
        matrix[n, b, n, b] += Z[1:].real.T
        matrix[n, a, n, b] -= Z[1:].imag.T
        matrix[n, b, n, a] += Z[1:].imag.T
        out = self._arranged(matrix)
        if equations.slides:
            self._walking(out, coupled[: equations.e, 0].reshape(equations.e, -1), tangent)
        # a singular one gives what is not finite, which GMRES finds
        self.lu, self.pivots, _ = sl.lapack.dgetrf(out.T, overwrite_a=True)

    def _arranged(self, matrix: Array) -> Array:
        """Rows and columns as the unknowns are."""
        equations = self.equations
        k, c = equations.shape
        e, rigid = equations.e, equations.problem.rigid_modes
        whole = matrix.reshape(k * c, k * c)
        mean = np.arange(e) * c
        inner = np.delete(np.arange(k * c), mean)
        scale = np.repeat(equations.by_mode, c)[inner]
        f = rigid.shape[1]
        size, cut = equations.modal_size, len(inner)
        out = np.zeros((size, size))
        out[:cut, :cut] = scale[:, None] * whole[np.ix_(inner, inner)]
        out[:cut, cut : cut + f] = scale[:, None] * (whole[np.ix_(inner, mean)] @ rigid)
        weigh = equations.problem.spring * rigid.T
        out[cut : cut + f, :cut] = weigh @ whole[np.ix_(mean, inner)]
        out[cut : cut + f, cut : cut + f] = weigh @ whole[np.ix_(mean, mean)] @ rigid
        return out

    def _walking(self, out: Array, pushed: Array, tangent: DrivenTangent) -> None:
        """Columns of the walk, and rows of where the bodies stand.

        `pushed` is the derivative of the mean of ``psi^T r`` by zeta, of the nearly rigid modes.
        """
        equations = self.equations
        k, c = equations.shape
        e, s, size = equations.e, equations.slides, equations.modal_size
        rigid = equations.problem.rigid_modes
        stands = -equations.s[:e, None] * pushed
        mean = np.arange(e) * c
        stands[np.arange(e), mean] += 1.0
        stands = equations.places[len(equations.places) - s :] @ stands
        cut = k * c - e
        out[size - s :, :cut] = np.delete(stands, mean, axis=1)
        out[size - s :, cut : size - s] = stands[:, mean] @ rigid
        for column in range(size - s, size):
            unit = np.zeros(size + equations.psi.shape[0] * c)
            unit[column] = 1.0
            out[:, column] = equations.derivative_times(tangent, unit)[:size]

    def solve(self, right: Array) -> Array:
        """Approximate solution of the scaled equations."""
        size = self.equations.modal_size
        out = right * self.equations.problem.force_scale
        out[:size], _ = sl.lapack.dgetrs(self.lu, self.pivots, out[:size], trans=1)
        return out


def solved(path: ModalPath, z: Array, control: StepControl) -> tuple[ModalEvaluation, int]:
    """Newton's method; the solution and its steps.

    Raises
    ------
    ContinuationError
    """
    _, at, iterations = solve_at(path, z, 0.0, control)
    assert isinstance(at, ModalAt)
    return at.evaluation, iterations

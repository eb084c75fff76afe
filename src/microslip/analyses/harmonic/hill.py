"""Stability of responses found by harmonic balance: Hill's method on the condensed equations.

A small disturbance ``e^{st} sum_h (...)`` of a periodic response obeys the linearised equations with
``i h omega`` replaced by ``i h omega + s`` in the flexibility. The response is stable where every s has a
negative real part. What decides near a lightly damped resonance are the slow disturbances of
amplitude and phase, |s| << omega. Near a harmonic of omega the flexibility of a mode has a pole, so
the disturbances eta of the modes are unknowns beside those z of the reactions, with ``p = i h omega``:

    (omega_n² + (p + s)² + (p + s) c_n) eta + Psi^T z = 0
    z - D (z + eps (Psi eta - W_res(s) z)) = 0.

That is quadratic in s but for the residual flexibility, which changes over ``1/tau`` and is expanded to
second order. With ``X = (z, eta)`` and ``(J_0 + s J_1 + s² J_2) X = 0``, ``mu = 1/s`` and ``Y = mu X``,

    mu Y = -J_0^-1 (J_1 Y + J_2 X),      mu X = Y,

whose largest mu, the s nearest to zero, Arnoldi's method finds with the linear solver that found the
response: eta is eliminated from ``J_0``. A fold is where a real s passes zero.

Approximations. The memory of friction, ``D``, is taken at s = 0: a traction held for part of a cycle
remembers the disturbance of that part of the cycle before, a relative error of |s| T. Where some sample
sits exactly on a change of state, the derivative is that of one side. With the half turn in use,
disturbances that break the symmetry are not seen: state the problem with ``half_turn=False``.

The period map of the time scheme needs none of these, and stands beside this as a check; but it costs
some tens of periods of integration per point, and it does not follow an unstable response.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
import scipy.sparse.linalg as spla

from microslip.analyses.harmonic.equations import evaluate
from microslip.analyses.harmonic.linear import HarmonicSolver
from microslip.analyses.harmonic.operator import LinearOperator, linear_operator
from microslip.analyses.harmonic.points import HarmonicPoint
from microslip.analyses.harmonic.problem import HarmonicProblem
from microslip.brief import Brief
from microslip.contact.aft import ContactCycle, times_derivative
from microslip.contact.aft_states import cycle_of_states
from microslip.model.flexibility import amplitudes_under
from microslip.numerics.continuation import ContinuationError
from microslip.numerics.fourier import EVEN, ODD, to_complex, to_real
from microslip.typing import Array, Complex

SLOW = 0.25
"""Share of omega below which an exponent counts as slow: friction's memory is frozen."""

SOLVED = 1e-9
"""Relative residual of the linear systems."""


@dataclass(frozen=True, repr=False)
class HillExponents(Brief):
    """Slow disturbances of a periodic response.

    Attributes
    ----------
    exponents : (k,) complex array
        s, 1/s, nearest to zero first; only those that are slow.
    period : float
        Of the response, s.
    """

    exponents: Complex
    period: float

    @property
    def stable(self) -> bool:
        """Whether every disturbance found decays."""
        return bool((self.exponents.real < 0).all())

    @property
    def multipliers(self) -> Complex:
        """Factor by which each disturbance changes over a period."""
        return np.asarray(np.exp(self.exponents * self.period))


def exponents_of(point: HarmonicPoint) -> HillExponents:
    """Slow exponents of a point, from the equations it solves.

    Of one whose contact was solved behind a flexibility with the states that it has there.

    Raises
    ------
    ContactError
        Where such a point is spatial.
    """
    problem = point.problem
    cycle = None
    if point.modal:
        u, _ = problem.split(point.w)
        r = u.reshape(-1, problem.dimension, problem.table.coefficients)
        cycle = cycle_of_states(problem.table, r, point.status[problem.pairs], problem.friction)
    return hill_exponents(problem, point.frequency, point.load, point.w, cycle=cycle)


def hill_exponents(
    problem: HarmonicProblem,
    frequency: float,
    load: float,
    w: Array,
    *,
    count: int = 4,
    solver: HarmonicSolver | None = None,
    cycle: ContactCycle | None = None,
) -> HillExponents:
    """Exponents nearest to zero of the response with unknowns `w`.

    Parameters
    ----------
    problem : HarmonicProblem
    frequency, load : float
        Hz, and amplitude of the driven port.
    w : (n,) array
        A solution of `problem`.
    count : int
        How many exponents are sought; those that are not slow are left out.
    solver : HarmonicSolver, optional
        With a factorisation to reuse.
    cycle : ContactCycle, optional
        Contact in the response; that of `problem` by default.

    Raises
    ------
    ContinuationError
        Where the exponents do not converge.
    """
    solver = solver or HarmonicSolver()
    operator = linear_operator(problem, 2 * np.pi * frequency)
    cycle = evaluate(operator, load, w).cycle if cycle is None else cycle
    first, second = _derivatives(operator)
    slope = problem.model.modal_damping() + 2j * operator.omega * _orders(operator)
    D = problem.model.damping
    # modal disturbances times omega²: of the size of the reactions
    modal = operator.modal * operator.omega**2
    slope, inverse_square = slope / operator.omega**2, 1 / operator.omega**2
    e = len(problem.rigid_modes)
    damping = (problem.rigid_modes.T * problem.model.modal_damping()[:e]) @ problem.rigid_modes
    if D is not None:
        damping += problem.rigid_modes.T @ D[:e, :e] @ problem.rigid_modes
    mass = problem.rigid_modes.T @ problem.rigid_modes
    damping[:, problem.walking] = mass[:, problem.walking] = 0.0
    out = np.empty_like(cycle.r)

    coefficients = problem.table.coefficients
    felt = _felt(problem)
    size = problem.size + operator.modal.shape[1] * coefficients

    def modes_of(X: Array) -> Complex:
        return to_complex(X[problem.size :].reshape(-1, coefficients))

    def disturb(both: Array) -> Array:
        Y, X = both[:size], both[size:]
        y, z = Y[: problem.size], X[: problem.size]
        u, u2 = problem.split(y)[0], problem.split(z)[0]
        moving = modes_of(Y)
        pushed = slope * moving + inverse_square * modes_of(X)
        inertia = damping @ y[u.size :] + mass @ z[u.size :]
        if D is not None:
            # modes of the mean that are unknowns of equilibrium are not among those of `moving`
            rigid = problem.rigid_modes @ problem.means(y[u.size :])
            pushed += inverse_square * (moving @ D)
            pushed[0] += D[:, :e] @ rigid
            inertia += problem.rigid_modes.T @ (D[:e] @ moving[0].real) * inverse_square
        x = first.flexibility(u) + 0.5 * second.flexibility(u2)
        x += operator.of_modes(amplitudes_under(operator.modal, pushed))
        x *= problem.stiffness[:, None]
        times_derivative(cycle.nn, cycle.tn, cycle.tt, x.reshape(out.shape), out)
        right = np.concatenate([out.ravel(), problem.spring * inertia])
        new = -solver.linear_solve(operator, cycle, right, SOLVED)
        eta = -amplitudes_under(modal, pushed + operator.on_modes(problem.split(new)[0]))
        eta[EVEN], eta[ODD] = eta[EVEN] @ felt[0], eta[ODD] @ felt[1]
        return np.concatenate([new, to_real(eta).ravel(), Y])

    inverse = spla.LinearOperator((2 * size, 2 * size), matvec=disturb, dtype=float)
    start = np.random.default_rng(0).standard_normal(2 * size)
    try:
        values = spla.eigs(inverse, k=count, which="LM", v0=start, return_eigenvectors=False)
    except spla.ArpackNoConvergence as error:
        values = error.eigenvalues
        if len(values) == 0:
            raise ContinuationError(
                f"stability at {frequency:.6g} Hz: no exponent converged; ask for fewer"
            ) from error
    exponents = 1 / values[np.argsort(-np.abs(values))]
    slow = np.abs(exponents) < SLOW * operator.omega
    return HillExponents(exponents[slow], 1 / frequency)


def _derivatives(operator: LinearOperator) -> tuple[LinearOperator, LinearOperator]:
    """The linear side with ``W_res'`` and with ``W_res''`` in place of W."""
    tau, lag = operator.problem.model.rayleigh[1], operator.lag
    none = np.zeros_like(operator.modal)
    return (
        replace(operator, modal=none, lag=-tau * lag**2),
        replace(operator, modal=none, lag=2 * tau**2 * lag**3),
    )


ALIKE = 1e-5
"""Relative difference of frequencies below which modes mix: those of two equal bodies do."""


def _felt(problem: HarmonicProblem) -> Array:
    """Projectors (2, k, k) on the modes that even and odd harmonics of the reactions excite.

    Under the half turn half of the combinations of the modes of two equal bodies have the other
    parity. Nothing here would hold them, and they would vibrate as if they were free.
    """
    omega = problem.model.omega
    groups = np.split(np.arange(len(omega)), np.flatnonzero(np.diff(omega) > ALIKE * omega[1:]) + 1)
    projectors = np.zeros((2, len(omega), len(omega)))
    for gather, projector in zip(problem.gather, projectors, strict=True):
        for group in groups:
            _, size, directions = np.linalg.svd(gather[:, group], full_matrices=False)
            kept = directions[size > 1e-5 * np.abs(problem.gather[:, :, group]).max()]
            projector[np.ix_(group, group)] = kept.T @ kept
    return projectors


def _orders(operator: LinearOperator) -> Array:
    """Order of every harmonic, (H + 1, 1)."""
    return np.arange(operator.problem.harmonics + 1.0)[:, None]

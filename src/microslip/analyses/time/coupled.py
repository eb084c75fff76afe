"""Modes that damping couples, marched without error of their own: a mass and damping with the true poles.

``eta'' + C eta' + K eta = f`` with ``K = diag(omega²)`` and any symmetric C is, in ``(Omega eta, eta')``, a
system of first order with the matrix

    A = [[0, Omega], [-Omega, -C]],

and its free motion over dt is ``exp(A dt)``. The trapezoidal rule on ``M~ u'' + C~ u' + K~ u = f`` does the
same where its first-order matrix is ``(2/dt) tanh(A dt/2) = A F``, with ``F = tanh(z)/z``, ``z = A dt/2``. A
is self-adjoint in an indefinite product, and so is every function of it; therefore the moments ``Gamma_n``,
the upper right blocks of the powers of ``A F`` in the coordinates (eta, eta'), are symmetric, and with them
(Gohberg, Lancaster & Rodman, Matrix Polynomials, 1982)

    M~ = Gamma_1^-1 = F_22^-1,    K~^-1 = -Gamma_-1 = Omega^-1 (F^-1)_11 Omega^-1,
    C~ = -M~ Gamma_2 M~ = M~ [(F²)_22 C - (F²)_21 Omega] M~.

The congruence ``eta = S u``, ``S = Omega^-1 (F^-1)_11^-1/2 Omega``, gives the rule K itself for its
stiffness, so that a static force does what it did: poles and statics are true. The shapes of the motions are
S times theirs, which is theirs but for terms of second order in the step times the coupling. Without coupling
M~ is ``(dt/h)²`` with the step h of `microslip.analyses.time.poles`, and everything as there.

Under a load of known frequency Omega the rule sees ``O = (2/dt) tan(Omega dt/2)``; with the steps and gains
of modes without damping, ``M~ = diag(dt/h)²`` and ``C~ = diag(g) C Omega / O``, every linear steady state is
exact (`microslip.analyses.time.poles.driven_steps`).
"""

from __future__ import annotations

import numpy as np

from microslip.analyses.time.poles import ModeSteps
from microslip.contact.coupled_modes import Coupling
from microslip.contact.timestep import StepConstants
from microslip.typing import Array

TERMS = 16
"""Terms of the continued fraction of tanh for phases per step up to `poles.REACH`: to rounding."""

SOFTEST = 1e-7
"""Of the largest frequency: softer modes are scaled by it."""


def tanh_over(z: Array) -> tuple[Array, Array]:
    """``F = tanh(z) / z`` of a matrix, and its inverse: ``1/F = 1 + z²/(3 + z²/(5 + ...))``.

    Examples
    --------
    >>> F, inverse = tanh_over(np.array([[0.0, 0.5], [-0.5, 0.0]]))
    >>> bool(np.allclose(F, np.tan(0.5) / 0.5 * np.eye(2), rtol=1e-15))
    True
    """
    one, square = np.eye(len(z)), z @ z
    terms = TERMS + int(np.linalg.norm(z, 2))
    inverse = (2 * terms + 1) * one
    for n in range(2 * terms - 1, 0, -2):
        inverse = n * one + np.linalg.solve(inverse.T, square.T).T
    return np.asarray(np.linalg.inv(inverse)), np.asarray(inverse)


def matched_matrices(omega: Array, C: Array, dt: float) -> tuple[Array, Array]:
    """Mass and damping matrix, (k, k) both, with which the trapezoidal rule has the true poles.

    Parameters
    ----------
    omega : (k,) array
        Circular frequencies, rad/s, within the reach of dt.
    C : (k, k) array
        Symmetric, 1/s.
    dt : float
        s.

    Examples
    --------
    Of one mode without damping the mass is ``(dt/h)²``, ``h omega/2 = tan(omega dt/2)``:

    >>> M, _ = matched_matrices(np.array([2.0]), np.zeros((1, 1)), 0.5)
    >>> bool(np.isclose(M[0, 0], (0.5 / np.tan(0.5)) ** 2))
    True
    """
    k = len(omega)
    first = 0.5 * dt * np.block([[np.zeros((k, k)), np.diag(omega)], [-np.diag(omega), -C]])
    F, inverse = tanh_over(first)
    twice = F @ F
    M = np.linalg.inv(_even(F[k:, k:]))
    damping = M @ (twice[k:, k:] @ C - twice[k:, :k] * omega) @ M
    values, vectors = np.linalg.eigh(_even(inverse[:k, :k]))
    root = (vectors * (np.sqrt(values) - 1)) @ vectors.T
    w = np.maximum(omega, SOFTEST * omega.max())
    back = np.eye(k) + root * w / w[:, None]
    return _even(back.T @ M @ back), _even(back.T @ damping @ back)


def coupled_steps(
    omega: Array, C: Array, dt: float, steps: ModeSteps, frequency: float | None, matched: bool
) -> tuple[ModeSteps, Coupling]:
    """How modes are stepped that damping couples.

    Parameters
    ----------
    omega, C, dt
        As for `matched_matrices`, of the modes that are followed.
    steps : ModeSteps
        Of the same modes without damping.
    frequency : float, optional
        Of a load whose periodic answer is sought, Hz.
    matched : bool
        Whether poles are true; as for `microslip.analyses.time.scheme.time_scheme`.

    Returns
    -------
    steps : ModeSteps
        All of them of length dt.
    coupling : Coupling
    """
    gain = steps.gain
    if not matched:
        M, damping = np.eye(len(omega)), C
    elif frequency is None:
        M, damping = matched_matrices(omega, C, dt)
    else:
        true = 2 * np.pi * frequency
        M = np.diag((dt / steps.step) ** 2)
        damping = gain[:, None] * C * (true * 0.5 * dt / np.tan(0.5 * true * dt))
    whole = M + 0.5 * dt * damping + np.diag((0.5 * dt * omega) ** 2)
    coupling = Coupling(
        damping=np.ascontiguousarray(damping),
        answer=np.ascontiguousarray(np.linalg.inv(whole)),
        release=np.ascontiguousarray(np.linalg.inv(M)),
        loss=np.ascontiguousarray(damping / gain[:, None] / dt),
    )
    return ModeSteps(np.full(len(omega), float(dt)), np.diag(damping).copy(), gain), coupling


def accelerations(kernel: StepConstants, force: Array, rate: Array) -> Array:
    """Accelerations (..., k) of modes at given rates, under forces with those of their stiffness."""
    coupling = kernel.coupling
    if not len(coupling.answer):
        return np.asarray(force - kernel.mode_damping * rate)
    return np.asarray((force - rate @ coupling.damping.T) @ coupling.release.T)


def kinetic_energy(kernel: StepConstants, rate: Array) -> float:
    """Of the modes, J per metre of width; their rates are those of the scheme."""
    if not len(kernel.coupling.answer):
        return float(0.5 * np.sum(rate**2))
    return float(0.5 * rate @ np.linalg.solve(kernel.coupling.release, rate))


def _even(matrix: Array) -> Array:
    """The symmetric part, which is all but rounding."""
    return np.asarray(0.5 * (matrix + matrix.T))

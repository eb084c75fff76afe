"""Damping of joints from files: alpha M + beta K where that is what is given, else that and a full matrix.

The kept modes Phi of the joint model are damped by ``diag(alpha + beta omega²) + D``, what is truncated by
its share of beta K. Of a matrix C, alpha and beta are those that come nearest in the kept modes, each weighed
by its damping,

    min sum_n (C_nn - alpha - beta omega_n²)² / C_nn²,     D = Phi^T C Phi - diag(alpha + beta omega²),

and what they miss is measured by all entries of D over those of ``Phi^T C Phi``, each over ``sqrt(c_m c_n)``,
c the diagonal. Of damping ratios ``zeta_n`` of modes phi_n of the stuck joint

    C = alpha M + beta K + sum_n d_n (M phi_n)(M phi_n)^T,    d_n = 2 zeta_n omega_n - alpha - beta omega_n²,

with no d_n negative: else what slides, and has less of K than the stuck mode, could gain energy. Modes that
no ratio is given of have the alpha and beta, as large as that allows.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import scipy.sparse as sp
from scipy.optimize import linprog, nnls

from microslip.errors import Caution, InputError
from microslip.model.modes import LinearModes
from microslip.typing import Array

SAME = 1e-6
"""Part of the damping that alpha and beta may miss without a matrix beside them."""

NOTICED = 1e-2
"""Part of the damping of the joint's own mode by which the model may be off in silence."""

RATIOS = "damping.ratios"
"""Key of ratios of modes."""


@dataclass(frozen=True)
class GivenDamping:
    """What damps a joint model whose file gives a matrix, or the ratios of modes.

    Attributes
    ----------
    alpha : float
        1/s.
    beta : float
        s.
    missed : float
        Part of the damping that these two are not: of a matrix in the kept modes, else in the modes with a
        ratio.
    of : str
        Key of the file that says the damping.
    at, ratios : tuples of float
        Natural frequencies (rad/s) and damping ratios of the modes whose ratios were given, in the order of
        the file.
    matrix : (k, k) array, optional
        D, 1/s; None where alpha and beta are all of it.
    off : float
        Part of the damping of the joint's own mode, sliding or stuck, by which the joint model misses that of
        the matrix on all degrees of freedom.
    """

    alpha: float
    beta: float
    missed: float
    of: str = "matrices.damping"
    at: tuple[float, ...] = ()
    ratios: tuple[float, ...] = ()
    matrix: Array | None = None
    off: float = 0.0

    @property
    def cautions(self) -> tuple[Caution, ...]:
        """What should be known of it."""
        if not self.off > NOTICED:
            return ()
        return (
            Caution(
                "input",
                self.of,
                f"the damping of the joint's mode is {self.off:.1%} off: what is truncated is damped by "
                f"beta = {self.beta:.4g} s and the stiffness",
                "keep more modes (matrices.modes)",
            ),
        )


def through_ratios(omega: Array, ratio: Array, shapes: Array) -> GivenDamping:
    """The damping with given ratios of modes of the stuck joint.

    ``alpha + beta omega_n² = 2 zeta_n omega_n`` where two numbers can do that; of one mode alone, alpha = 0.

    Parameters
    ----------
    omega : (n,) array
        Natural frequencies of modes of the stuck joint, rad/s.
    ratio : (n,) array
        Their damping ratios, positive.
    shapes : (k, n) array
        Their shapes in the kept modes, of unit length and orthogonal.

    Examples
    --------
    >>> found = through_ratios(np.array([100.0, 300.0]), np.array([0.01, 0.02]), np.eye(2))
    >>> found.matrix is None, round(found.alpha / 200 + 50 * found.beta, 12)
    (True, 0.01)
    >>> found = through_ratios(np.array([1.0, 2.0]), np.array([0.01, 0.04]), np.eye(2))
    >>> round(found.beta, 12), np.diag(found.matrix).round(12).tolist()
    (0.02, [0.0, 0.08])
    """
    own = 2 * ratio * omega
    given = tuple(omega.tolist()), tuple(ratio.tolist())
    if len(omega) == 1:
        return GivenDamping(0.0, float(own[0] / omega[0] ** 2), 0.0, RATIOS, *given)
    alpha, beta = _nearest(omega, own, 1 / own)
    missed = float(np.linalg.norm((alpha + beta * omega**2) / own - 1) / np.sqrt(len(omega)))
    if missed <= SAME:
        return GivenDamping(alpha, beta, missed, RATIOS, *given)
    alpha, beta = _below(omega, own)
    beyond = np.maximum(own - alpha - beta * omega**2, 0.0)
    return GivenDamping(alpha, beta, missed, RATIOS, *given, (shapes * beyond) @ shapes.T)


def _nearest(omega: Array, own: Array, weight: Array) -> tuple[float, float]:
    """alpha and beta, not negative, for which ``alpha + beta omega²`` is nearest to the damping of modes."""
    system = np.column_stack([weight, weight * omega**2])
    scale = np.linalg.norm(system, axis=0)
    alpha, beta = nnls(system / scale, weight * own)[0] / scale
    return float(alpha), float(beta)


def _below(omega: Array, own: Array) -> tuple[float, float]:
    """The largest alpha and beta, not negative, with ``alpha + beta omega²`` nowhere above the damping."""
    shares = np.column_stack([1 / own, omega**2 / own])
    scale = shares.max(axis=0)
    found = linprog(-(shares / scale).sum(axis=0), A_ub=shares / scale, b_ub=np.ones(len(own)))
    alpha, beta = found.x / scale
    return float(alpha), float(beta)


def damping_by_matrix(C: sp.csc_matrix, modes: LinearModes) -> GivenDamping:
    """The damping of a matrix in the kept modes.

    Parameters
    ----------
    C : (n, n) sparse
        Symmetric; N s/m on the degrees of freedom of the structure.
    modes : LinearModes
        Mass-normalised.

    Raises
    ------
    InputError
        Where it gives energy to a mode, or to some motion of them together.

    Examples
    --------
    >>> modes = LinearModes(np.array([10.0, 20.0, 40.0]), np.eye(3), np.array([]))
    >>> found = damping_by_matrix(sp.csc_matrix(np.diag(0.5 + 1e-3 * modes.omega**2)), modes)
    >>> round(found.alpha, 12), round(found.beta, 12), found.matrix
    (0.5, 0.001, None)
    """
    shapes = modes.shapes
    full = shapes.T @ (C @ shapes)
    full = 0.5 * (full + full.T)
    own = full.diagonal()
    largest = float(np.abs(full).max(initial=0.0))
    if not largest > 0:
        return GivenDamping(0.0, 0.0, 0.0)
    if own.min() < -SAME * largest:
        k = int(np.argmin(own))
        raise InputError(
            f"matrices.damping: gives energy to the mode of {modes.frequency[k]:.4g} Hz: its damping is "
            f"{own[k]:.3g} 1/s; is the sign of C right?"
        )
    least = float(np.linalg.eigvalsh(full)[0])
    if least < -SAME * largest:
        raise InputError(
            f"matrices.damping: gives energy to a motion of the kept modes together: the least eigenvalue in "
            f"them is {least:.3g} 1/s, the largest entry {largest:.3g} 1/s; are all entries of C there?"
        )
    weight = 1 / np.maximum(own, SAME * largest)
    alpha, beta = _nearest(modes.omega, own, weight)
    left = full - np.diag(alpha + beta * modes.omega**2)
    size = np.sqrt(np.outer(weight, weight))
    missed = float(np.linalg.norm(left * size) / np.linalg.norm(full * size))
    return GivenDamping(alpha, beta, missed, matrix=None if missed <= SAME else left)

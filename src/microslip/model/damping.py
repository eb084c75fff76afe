"""A damping matrix as the Rayleigh damping that the joint model has.

Modes are uncoupled, and truncated ones follow behind their stiffness damping, where ``C = alpha M + beta K``.
Of a matrix C, alpha and beta are those that come nearest in the kept modes Phi, each weighed by its damping:

    D = Phi^T C Phi,   min sum_n (D_nn - alpha - beta omega_n²)² / D_nn²,

and what they miss is measured by all entries, ``|D - diag(alpha + beta omega²)| / |D|`` in the norm of the
matrix whose entries are over ``sqrt(d_m d_n)``, d the diagonal.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import scipy.sparse as sp
from scipy.optimize import nnls

from microslip.errors import Caution, InputError
from microslip.model.modes import LinearModes

SAME = 1e-6
"""Part of the damping that may be missed in silence."""

MOST = 0.1
"""Part that may be missed at all."""


@dataclass(frozen=True)
class FittedDamping:
    """Rayleigh damping in place of a matrix.

    Attributes
    ----------
    alpha : float
        1/s.
    beta : float
        s.
    missed : float
        Part of the matrix that it is not, in the kept modes.
    """

    alpha: float
    beta: float
    missed: float

    @property
    def cautions(self) -> tuple[Caution, ...]:
        """What should be known of it."""
        if self.missed <= SAME:
            return ()
        return (
            Caution(
                "input",
                "matrices.damping",
                f"taken as alpha = {self.alpha:.4g} 1/s and beta = {self.beta:.4g} s, which misses "
                f"{self.missed:.2%} of it in the kept modes",
                "damping in proportion to mass and stiffness is what the model has",
            ),
        )


def rayleigh_of(C: sp.csc_matrix, modes: LinearModes) -> FittedDamping:
    """The Rayleigh damping nearest to a matrix.

    Parameters
    ----------
    C : (n, n) sparse
        Symmetric; N s/m on the degrees of freedom of the structure.
    modes : LinearModes
        Mass-normalised.

    Raises
    ------
    InputError
        Where it gives energy to a mode, or is too far from any Rayleigh damping.

    Examples
    --------
    >>> modes = LinearModes(np.array([10.0, 20.0, 40.0]), np.eye(3), np.array([]))
    >>> found = rayleigh_of(sp.csc_matrix(np.diag(0.5 + 1e-3 * modes.omega**2)), modes)
    >>> round(found.alpha, 12), round(found.beta, 12)
    (0.5, 0.001)
    """
    shapes = modes.shapes
    D = shapes.T @ (C @ shapes)
    own = D.diagonal()
    largest = float(np.abs(D).max(initial=0.0))
    if not largest > 0:
        return FittedDamping(0.0, 0.0, 0.0)
    if own.min() < -SAME * largest:
        k = int(np.argmin(own))
        raise InputError(
            f"matrices.damping: gives energy to the mode of {modes.frequency[k]:.4g} Hz: its damping is "
            f"{own[k]:.3g} 1/s; is the sign of C right?"
        )
    weight = 1 / np.maximum(own, SAME * largest)
    system = np.column_stack([weight, weight * modes.omega**2])
    scale = np.linalg.norm(system, axis=0)
    alpha, beta = nnls(system / scale, weight * own)[0] / scale
    left = D - np.diag(alpha + beta * modes.omega**2)
    size = np.sqrt(np.outer(weight, weight))
    missed = float(np.linalg.norm(left * size) / np.linalg.norm(D * size))
    if missed > MOST:
        off = D - np.diag(own)
        coupled = float(np.linalg.norm(off * size) / np.linalg.norm(D * size))
        raise InputError(
            f"matrices.damping: no alpha M + beta K comes near it: the nearest, alpha = {alpha:.3g} 1/s and "
            f"beta = {beta:.3g} s, misses {missed:.0%} of it in the kept modes, {coupled:.0%} couples them; "
            "the model has damping in proportion to mass and stiffness: leave it out and give [damping] "
            "alpha and beta that fit the modes of interest"
        )
    return FittedDamping(float(alpha), float(beta), missed)

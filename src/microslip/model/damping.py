"""A damping matrix, or damping ratios of modes, as the Rayleigh damping that the joint model has.

Modes are uncoupled, and truncated ones follow behind their stiffness damping, where ``C = alpha M + beta K``.
Of a matrix C, alpha and beta are those that come nearest in the kept modes Phi, each weighed by its damping:

    D = Phi^T C Phi,   min sum_n (D_nn - alpha - beta omega_n²)² / D_nn²,

and what they miss is measured by all entries, ``|D - diag(alpha + beta omega²)| / |D|`` in the norm of the
matrix whose entries are over ``sqrt(d_m d_n)``, d the diagonal. Of ratios ``zeta_n`` of modes it is the same
with ``D_nn = 2 zeta_n omega_n`` and nothing beside the diagonal.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
import scipy.sparse as sp
from scipy.optimize import nnls

from microslip.errors import Caution, InputError
from microslip.model.modes import LinearModes
from microslip.typing import Array

SAME = 1e-6
"""Part of the damping that may be missed in silence."""

MOST = 0.1
"""Part that may be missed at all."""

RATIOS = "damping.ratios"
"""Key of ratios of modes."""


@dataclass(frozen=True)
class FittedDamping:
    """Rayleigh damping in place of a matrix, or of the ratios of modes.

    Attributes
    ----------
    alpha : float
        1/s.
    beta : float
        s.
    missed : float
        Part of the damping that it is not: of a matrix in the kept modes, else in the modes with a ratio.
    of : str
        Key of the file that says the damping.
    at : tuple of float
        Natural frequencies of the modes whose ratios were given, rad/s, in the order of the file.
    """

    alpha: float
    beta: float
    missed: float
    of: str = "matrices.damping"
    at: tuple[float, ...] = ()

    def ratio(self, omega: float) -> float:
        """Damping ratio ``(alpha + beta omega²) / (2 omega)`` at a natural frequency, rad/s."""
        return (self.alpha + self.beta * omega**2) / (2 * omega)

    @property
    def cautions(self) -> tuple[Caution, ...]:
        """What should be known of it."""
        if self.missed <= SAME:
            return ()
        where = " in the kept modes" if self.of == "matrices.damping" else ""
        return (
            Caution(
                "input",
                self.of,
                f"taken as alpha = {self.alpha:.4g} 1/s and beta = {self.beta:.4g} s, which misses "
                f"{self.missed:.2%} of it{where}",
                "damping in proportion to mass and stiffness is what the model has",
            ),
        )


def rayleigh_through(omega: Array, ratio: Array) -> FittedDamping:
    """The Rayleigh damping with given damping ratios at natural frequencies, or the nearest to them.

    ``alpha + beta omega_n² = 2 zeta_n omega_n``; of one mode alone, alpha = 0.

    Parameters
    ----------
    omega : (n,) array
        Natural frequencies of modes of the stuck joint, rad/s.
    ratio : (n,) array
        Their damping ratios, positive.

    Raises
    ------
    InputError
        Where it misses too much of them.

    Examples
    --------
    >>> found = rayleigh_through(np.array([100.0, 300.0]), np.array([0.01, 0.02]))
    >>> round(found.ratio(100.0), 12), round(found.ratio(300.0), 12)
    (0.01, 0.02)
    """
    own = 2 * ratio * omega
    if len(omega) == 1:
        return FittedDamping(0.0, float(own[0] / omega[0] ** 2), 0.0, RATIOS, (float(omega[0]),))
    alpha, beta = _nearest(omega, own, 1 / own)
    found = FittedDamping(alpha, beta, 0.0, RATIOS, tuple(omega.tolist()))
    off = (alpha + beta * omega**2) / own - 1
    missed = float(np.linalg.norm(off) / np.sqrt(len(omega)))
    if missed > MOST:
        said = ", ".join(f"{found.ratio(w):.3g} at {w / (2 * np.pi):.4g} Hz" for w in omega)
        raise InputError(
            f"{RATIOS}: no alpha M + beta K has them: the nearest has {said}; damping ratios of the model "
            f"fall as 1/omega and rise as omega: {_instead(omega)}"
        )
    return replace(found, missed=missed)


def _instead(omega: Array) -> str:
    """What to give in place of ratios that are not met; two are where neither alpha nor beta is negative."""
    if len(omega) > 2:
        return "give one or two, of the modes of interest"
    apart = float(omega.max() / omega.min())
    return (
        f"two are met where the second is {1 / apart:.3g} to {apart:.3g} times the first; give one, of the "
        "mode of interest"
    )


def _nearest(omega: Array, own: Array, weight: Array) -> tuple[float, float]:
    """alpha and beta, not negative, for which ``alpha + beta omega²`` is nearest to the damping of modes."""
    system = np.column_stack([weight, weight * omega**2])
    scale = np.linalg.norm(system, axis=0)
    alpha, beta = nnls(system / scale, weight * own)[0] / scale
    return float(alpha), float(beta)


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
    alpha, beta = _nearest(modes.omega, own, weight)
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
    return FittedDamping(alpha, beta, missed)

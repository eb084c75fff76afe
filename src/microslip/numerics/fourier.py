"""Fourier coefficients of a steady cycle, with one sign convention everywhere.

``y(theta) = mean + sum_h Im(Y_h e^{i h theta})``, so a pure sine has ``Y_1 = 1`` and a force that
lags its displacement dissipates nothing only if ``F_1 / Q_1`` is real; ``Im(F_1 / Q_1) > 0`` damps.
"""

from __future__ import annotations

import numpy as np

from microslip.typing import Array, Complex


def harmonic(y: Array, theta: Array, order: int = 1) -> Complex:
    """Coefficient ``Y_h`` of samples over one period.

    Parameters
    ----------
    y : (s + 1, ...) array
        Samples at `theta`, the last one period after the first (it is not used).
    theta : (s + 1,) array
        Equally spaced phases.
    order : int
        h >= 1.

    Examples
    --------
    >>> theta = np.linspace(0, 2 * np.pi, 9)
    >>> np.round(harmonic(3 * np.sin(theta) + np.cos(theta), theta), 12)
    np.complex128(3+1j)
    """
    weight = 2j / (len(theta) - 1) * np.exp(-1j * order * theta[:-1])
    return np.tensordot(weight, y[:-1], axes=(0, 0))


def without_drift(y: Array, theta: Array) -> Array:
    """Samples over one period less the straight line that they end off by.

    A joint may walk: every cycle leaves it a little farther, with the same vibration about that.

    Examples
    --------
    >>> theta = np.linspace(0, 2 * np.pi, 9)
    >>> np.abs(without_drift(np.sin(theta) + 0.1 * theta, theta) - np.sin(theta)).max() < 1e-15
    np.True_
    """
    share = (theta - theta[0]) / (theta[-1] - theta[0])
    return np.asarray(y - np.multiply.outer(share, y[-1] - y[0]))


EVEN, ODD = slice(0, None, 2), slice(1, None, 2)
"""Even and odd harmonics among all, from the mean on."""


def parity(coefficients: int) -> Array:
    """+1 for real coefficients of even harmonics, -1 for those of odd ones.

    Examples
    --------
    >>> parity(5).tolist()  # mean, sin, cos, sin 2, cos 2
    [1.0, -1.0, -1.0, 1.0, 1.0]
    """
    h = (np.arange(coefficients) + 1) // 2
    return np.where(h % 2 == 0, 1.0, -1.0)


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

"""Fourier coefficients of a steady cycle, with one sign convention everywhere.

``y(theta) = mean + sum_h Im(Y_h e^{i h theta})``, so a pure sine has ``Y_1 = 1`` and a force that
lags its displacement dissipates nothing only if ``F_1 / Q_1`` is real; ``Im(F_1 / Q_1) > 0`` damps.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray


def harmonic(
    y: NDArray[np.float64], theta: NDArray[np.float64], order: int = 1
) -> NDArray[np.complex128]:
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

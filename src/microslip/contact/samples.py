"""Samples of one cycle and its harmonics.

``y = c_0 + sum_h c_{2h-1} sin(h theta) + c_{2h} cos(h theta)`` on N equal steps. Products of sines and
cosines are sines and cosines of sums and differences, and their sum over a run of samples is the
difference of two rows of a table.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from microslip.contact.compiled import jit
from microslip.errors import ContactError
from microslip.typing import Array


class SampleTable(NamedTuple):
    """Fourier basis on the samples of one cycle, and running sums of its products.

    Attributes
    ----------
    harmonics, samples : int
    basis : (2 H + 1, N) array
        1, sin, cos, sin 2, cos 2, ... at ``theta = 2 pi k / N``.
    projection : (2 H + 1, N) array
        Coefficients of a sampled signal are ``projection @ signal``.
    sums : (N + 1, 2, 2 H + 1) array
        Row k: sums of ``cos(g theta)`` and of ``sin(g theta)``, g = 0 .. 2 H, over the first k samples.
    """

    harmonics: int
    samples: int
    basis: Array
    projection: Array
    sums: Array

    @property
    def coefficients(self) -> int:
        """Number of real coefficients, 2 H + 1."""
        return 2 * self.harmonics + 1


def sample_table(harmonics: int, samples: int) -> SampleTable:
    """Basis of `harmonics` on `samples` equal steps.

    Raises
    ------
    ContactError
        Where the samples do not resolve the harmonics: at least four per period of the highest
        are asked for, as the contact laws double its frequency.

    Examples
    --------
    >>> table = sample_table(2, 16)
    >>> np.allclose(table.projection @ table.basis.T, np.eye(5))
    True
    """
    if harmonics < 1:
        raise ContactError(f"{harmonics} harmonics: at least the first is needed")
    if samples < 4 * harmonics:
        raise ContactError(
            f"{samples} samples per cycle do not resolve {harmonics} harmonics: take at least "
            f"{4 * harmonics} samples or fewer harmonics"
        )
    theta = 2 * np.pi * np.arange(samples) / samples
    basis = np.ones((2 * harmonics + 1, samples))
    for h in range(1, harmonics + 1):
        basis[2 * h - 1], basis[2 * h] = np.sin(h * theta), np.cos(h * theta)
    projection = 2 * basis / samples
    projection[0] /= 2
    angles = theta[:, None] * np.arange(2 * harmonics + 1)
    waves = np.stack([np.cos(angles), np.sin(angles)], axis=1)
    return SampleTable(
        harmonics=harmonics,
        samples=samples,
        basis=basis,
        projection=projection,
        sums=np.concatenate([np.zeros((1, *waves.shape[1:])), np.cumsum(waves, axis=0)]),
    )


@jit
def synthesise(basis, coefficients, out):
    """Samples of a signal with given coefficients."""
    N = out.shape[0]
    c = coefficients[0]
    for k in range(N):
        out[k] = c
    for j in range(1, coefficients.shape[0]):
        c = coefficients[j]
        row = basis[j]
        for k in range(N):
            out[k] += c * row[k]


@jit
def analyse(projection, signal, out):
    """Coefficients of a sampled signal."""
    for j in range(out.shape[0]):
        row = projection[j]
        s = 0.0
        for k in range(signal.shape[0]):
            s += row[k] * signal[k]
        out[j] = s


@jit
def add_run(total, sums, first, last, samples, factor):
    """Add to `total` the matrix ``projection basis^T`` summed over the samples first..last-1."""
    H = total.shape[0] // 2
    ca, cb = sums[first, 0], sums[last, 0]
    sa, sb = sums[first, 1], sums[last, 1]
    one = factor / samples
    total[0, 0] += one * (cb[0] - ca[0])
    for h in range(1, H + 1):
        s = one * (sb[h] - sa[h])
        c = one * (cb[h] - ca[h])
        total[0, 2 * h - 1] += s
        total[0, 2 * h] += c
        total[2 * h - 1, 0] += 2.0 * s
        total[2 * h, 0] += 2.0 * c
        for g in range(1, H + 1):
            up, down = h + g, abs(h - g)
            c_up, c_down = one * (cb[up] - ca[up]), one * (cb[down] - ca[down])
            s_up, s_down = one * (sb[up] - sa[up]), one * (sb[down] - sa[down])
            if h < g:
                s_down = -s_down
            total[2 * h - 1, 2 * g - 1] += c_down - c_up
            total[2 * h, 2 * g] += c_down + c_up
            total[2 * h - 1, 2 * g] += s_up + s_down
            total[2 * h, 2 * g - 1] += s_up - s_down

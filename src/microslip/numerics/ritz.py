"""Eigenvalues of a linear map from a few vectors and their images."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from microslip.typing import Array, Complex

NEGLIGIBLE = 1e-2
"""Directions that are this much smaller than the largest are left out."""


def ritz_values(vectors: Sequence[Array], images: Sequence[Array]) -> Complex:
    """Eigenvalues of the map that takes one to the other, largest modulus first.

    The map is the best in the sense of least squares on the span of the vectors.

    Parameters
    ----------
    vectors, images : sequences of (n,) arrays
        In coordinates whose squares sum to an energy. Vectors of no length are left out; without
        any other there are no eigenvalues.

    Examples
    --------
    >>> map = np.diag([0.9, -0.5, 0.1])
    >>> z = [np.array([1.0, 1.0, 0.0]), np.array([2.0, -1.0, 0.0])]
    >>> ritz_values(z, [map @ x for x in z]).real.round(6).tolist()
    [0.9, -0.5]
    """
    size = [np.linalg.norm(z) for z in vectors]
    if not any(size):
        return np.zeros(0, complex)
    Z = np.column_stack([z / s for z, s in zip(vectors, size, strict=True) if s > 0])
    A = np.column_stack([z / s for z, s in zip(images, size, strict=True) if s > 0])
    U, sigma, Vt = np.linalg.svd(Z, full_matrices=False)
    kept = sigma > NEGLIGIBLE * sigma[0]
    projected = (U[:, kept].T @ A @ Vt[kept].T) / sigma[kept]
    return by_modulus(np.linalg.eigvals(projected))


def by_modulus(values: Array | Complex) -> Complex:
    """In the order of their modulus, largest first."""
    values = np.asarray(values, dtype=complex)
    return np.asarray(values[np.argsort(-np.abs(values), kind="stable")])

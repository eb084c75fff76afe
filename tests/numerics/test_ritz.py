"""Ritz values against the eigenvalues of maps that are known."""

from __future__ import annotations

import numpy as np
import pytest

from microslip.numerics.ritz import ritz_values


def test_ritz_values_of_a_linear_map():
    """Deviations that span an invariant subspace give its eigenvalues."""
    rng = np.random.default_rng(3)
    vectors = rng.standard_normal((6, 6))
    values = np.array([0.95, 0.7, -0.4, 0.1, 0.05, 0.0])
    map = vectors @ np.diag(values) @ np.linalg.inv(vectors)
    z = list((vectors[:, :3] @ rng.standard_normal((3, 5))).T)
    found = ritz_values(z, [map @ x for x in z])
    assert found[:3] == pytest.approx(values[:3], abs=1e-6)
    assert len(ritz_values([], [])) == 0

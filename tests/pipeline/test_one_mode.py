"""A sliding and a stuck mode that cannot be one are said to be two."""

from __future__ import annotations

import numpy as np
import pytest

from microslip.analyses.prepared.joint_modes import JointMode
from microslip.pipeline.fitness import not_one_mode


def pair(sliding, stuck, overlap):
    two_pi, none = 2 * np.pi, np.zeros(0)
    return JointMode(1, two_pi * sliding, two_pi * stuck, none, none, overlap, {}, {})


@pytest.mark.parametrize(
    ("sliding", "stuck", "overlap", "said"),
    [
        (180.0, 190.0, 0.999, None),
        (180.0, 180.0, 1.0, None),
        (180.0, 400.0, 0.72, None),
        (55.14e3, 50.25e3, 0.82, "bonding never lowers"),
        (180.0, 400.0, 0.6, "mostly two modes"),
    ],
)
def test_rayleigh_and_assurance(sliding, stuck, overlap, said):
    """The fourth is a pin in a saddle, turned about its axis."""
    found = not_one_mode(pair(sliding, stuck, overlap))
    assert [said in str(caution) for caution in found] == [True] * (said is not None)
    if found:
        assert "gamma_eq" in str(found[0])


def test_a_constraint_raises_every_frequency():
    """Rayleigh, of the chain that the caution is about: order by order, never the other way."""
    K = 2 * np.eye(12) - np.eye(12, k=1) - np.eye(12, k=-1)
    free = np.linalg.eigvalsh(K)
    for held in range(12):
        bonded = np.linalg.eigvalsh(np.delete(np.delete(K, held, 0), held, 1))
        assert (bonded >= free[:-1] - 1e-12).all()

"""The spatial solver on the random problems of `benchmarks/population`: every step has a solution."""

from __future__ import annotations

import sys

import numpy as np
import pytest
from conftest import ROOT

POPULATION = ROOT / "benchmarks" / "population"
sys.path.insert(0, str(POPULATION))

from spatial_problems import problems  # noqa: E402
from spatial_solver import STUDY, natural_residual  # noqa: E402


@pytest.mark.parametrize("seed", [101, 102])
def test_every_step_is_solved(seed):
    found = STUDY.nothing()
    for W, mu, loads in problems(seed, 10):
        STUDY.take(found, W, mu, loads)
    assert found.count.sum() == 1000
    assert found.count[-1] == 0
    assert found.residual <= 1e-9


def test_jumps_of_load_and_strong_friction_need_other_ways_and_are_solved():
    """Loads in random order, friction to 3: beyond joints, where Newton's method alone may fail."""
    found = STUDY.nothing()
    order = np.random.default_rng(5)
    for W, mu, loads in problems(2, 60):
        STUDY.take(found, W, 3 * mu, loads[order.permutation(len(loads))])
    assert found.count.sum() == 6000
    assert found.count[-1] == 0
    assert found.count[0] < 6000
    assert found.residual <= 1e-9


def test_the_residual_of_the_page_knows_a_wrong_answer():
    W, v_free, nothing = np.eye(3), np.array([1.0, 3.0, 4.0]), np.zeros((1, 2))
    good = np.array([1.0, 0.18, 0.24])
    assert natural_residual(W, 0.3, v_free, nothing, good) == pytest.approx(0, abs=1e-15)
    assert natural_residual(W, 0.3, v_free, nothing, 0.5 * good) == pytest.approx(0.5)
    across = np.array([1.0, 0.24, -0.18])
    assert natural_residual(W, 0.3, v_free, nothing, across) > 0.3

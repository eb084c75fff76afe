"""The solver on the random contact problems of `benchmarks/population`: every step has a solution."""

from __future__ import annotations

import sys

import numpy as np
import pytest
from conftest import ROOT

from microslip.contact.fallbacks import Fallbacks, together

POPULATION = ROOT / "benchmarks" / "population"
sys.path.insert(0, str(POPULATION))

from contact_problems import problems  # noqa: E402
from contact_solver import STUDY, natural_residual  # noqa: E402

CYCLING = ((1, 8), (1, 26))
"""Problems, by seed and number, on which the active set cycles again and again."""


@pytest.mark.parametrize("seed", [2, 3, 104])
def test_every_step_is_solved(seed):
    found = STUDY.nothing()
    for W, mu, loads in problems(seed, 10):
        STUDY.take(found, W, mu, loads)
    assert found.count.sum() == 1000
    assert found.count[-1] == 0
    assert found.residual <= 1e-9


@pytest.mark.parametrize(("seed", "number"), CYCLING)
def test_where_the_active_set_cycles_lemke_solves(seed, number):
    found = STUDY.nothing()
    W, mu, loads = list(problems(seed, number + 1))[number]
    STUDY.take(found, W, mu, loads)
    assert found.count[-1] == 0
    assert found.count[-2] > 0
    assert found.residual <= 1e-9


def test_the_residual_of_the_page_knows_a_wrong_answer():
    """Half the reaction lets the pair penetrate by half the load."""
    W, v_free = np.eye(2), np.array([1.0, 0.0])
    nothing = np.zeros(1)
    assert natural_residual(W, 0.3, v_free, nothing, np.array([1.0, 0.0])) == 0
    assert natural_residual(W, 0.3, v_free, nothing, np.array([0.5, 0.0])) == pytest.approx(0.5)
    assert natural_residual(W, 0.3, v_free, nothing, np.array([1.0, 0.4])) == pytest.approx(0.4)


def test_counts_add_up():
    both = together([Fallbacks(plain=5, worst=1, lemke=2), Fallbacks(plain=2, halved=1)])
    assert both == Fallbacks(plain=7, worst=1, halved=1, lemke=2)
    assert (both.steps, both.hard) == (11, 4)

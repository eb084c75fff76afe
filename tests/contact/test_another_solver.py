"""A solver made of another one solves as a new one does, and leaves that alone."""

import numpy as np
import pytest

from microslip.contact.pairs import SEPARATED, STICK, slip_history
from microslip.contact.solver import ContactSolver
from microslip.model.flexibility import Flexibility


def flexibility(d, pairs, rng):
    n = d * pairs
    A = rng.standard_normal((n, n))
    nothing = np.zeros((n, 0))
    return Flexibility(
        W=A @ A.T + n * np.eye(n),
        R=nothing,
        stiffness=np.zeros(0),
        loads_v=nothing,
        loads_q=np.zeros((0, 0)),
        loads_loads=np.zeros((0, 0)),
    )


@pytest.mark.parametrize("d", [2, 3])
def test_another_solves_as_a_new_one(d):
    rng = np.random.default_rng(7)
    pairs = 12
    f = flexibility(d, pairs, rng)
    states = np.where(rng.random(pairs) < 0.5, STICK, SEPARATED).astype(np.int8)
    one = ContactSolver(f, 0.3, np.ones(pairs), np.full(pairs, STICK, np.int8))
    nothing = np.zeros(0)
    loads = rng.standard_normal((2, d * pairs)) * 40
    first = one.solve(loads[0], nothing, slip_history(np.zeros(d * pairs), d))
    other = one.another(states)
    assert np.array_equal(other.status, states)
    second = other.solve(loads[1], nothing, slip_history(np.zeros(d * pairs), d))
    assert len(np.unique(second.status)) > 1
    fresh = ContactSolver(f, 0.3, np.ones(pairs), states)
    wanted = fresh.solve(loads[1], nothing, slip_history(np.zeros(d * pairs), d))
    assert second.r == pytest.approx(wanted.r, abs=1e-10 * np.abs(wanted.r).max())
    assert np.array_equal(one.r, first.r)
    assert np.array_equal(one.status, first.status)

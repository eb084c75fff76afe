"""Contact laws with rounded corners against closed forms, bounds, the exact laws and finite differences."""

from __future__ import annotations

import numpy as np
import pytest
from test_aft import random_cycle

from microslip.contact.aft import CHANGING, LINEAR, OPEN, contact_cycle, times_derivative
from microslip.contact.samples import sample_table
from microslip.errors import ContactError


def rounded(cycle, delta):
    """Everything of `random_cycle`, rounded by `delta`."""
    table, x, friction, held = cycle
    return contact_cycle(table, x, friction, held, rounding=np.full((len(x), 2), delta))


@pytest.mark.parametrize("force", [-3.0, 0.0, 0.4, 20.0])
def test_a_reaction_and_its_gap_have_one_product(force):
    """The reaction to a steady force x is the positive root of ``r (r - x) = delta²``."""
    delta = 0.3
    x = np.zeros((1, 2, 3))
    x[0, 0, 0] = force
    r = rounded((sample_table(1, 16), x, np.zeros(1), np.zeros((1, 1))), delta).r[0, 0]
    assert r[0] > 0
    assert r[0] * (r[0] - force) == pytest.approx(delta**2, rel=1e-12)
    assert r[1:] == pytest.approx(0, abs=1e-14)


def test_friction_of_a_pull_is_eased_by_what_a_cycle_adds_up_to():
    """Within its limit a traction t is eased, in N samples, by ``delta² 2 t / (b² - t²)``, whatever N is.

    The recursion is run twice: the mean over the second cycle is that after one and a half.
    """
    delta, pull, limit = 1e-3, 0.5, 0.8
    x = np.zeros((1, 2, 3))
    x[0, 0, 0], x[0, 1, 0] = 2.0, pull
    eased = [
        pull - rounded((sample_table(1, N), x, np.full(1, 0.4), np.zeros((1, 1))), delta).r[0, 1, 0]
        for N in (64, 512)
    ]
    assert eased == pytest.approx([1.5 * delta**2 * 2 * pull / (limit**2 - pull**2)] * 2, rel=0.02)


def test_friction_beyond_its_limit_tends_to_it():
    """A traction that is pulled far beyond mu r_n in every cycle reaches it to what is rounded."""
    x = np.zeros((1, 2, 3))
    x[0, 0, 0], x[0, 1, 1] = 10.0, 1e3
    table, friction, held = sample_table(1, 256), np.full(1, 0.3), np.zeros((1, 1))
    exact = contact_cycle(table, x, friction, held).r[0, 1]
    assert rounded((table, x, friction, held), 1e-2).r[0, 1] == pytest.approx(exact, abs=1e-3)


@pytest.mark.parametrize("mean", [0.0, 2.0])
def test_exact_laws_as_the_rounding_vanishes(mean):
    """Normal reactions are off by delta at most, by less than which the positive part is rounded."""
    cycle = random_cycle(4, mean=mean)
    table, x, friction, held = cycle
    exact = contact_cycle(table, x, friction, held).r
    most = 2 * np.ones(exact.shape[2])  # a coefficient is twice a mean; the mean itself is one
    most[0] = 1
    for delta in (1e-1, 1e-3, 1e-5):
        assert (np.abs(rounded(cycle, delta).r[:, 0] - exact[:, 0]) <= most * delta).all()
    off = [np.abs(rounded(cycle, delta).r[:, 1] - exact[:, 1]).max() for delta in (1e-2, 1e-4)]
    assert off[1] < off[0] / 30
    assert off[1] < 1e-3


@pytest.mark.parametrize("mean", [0.0, 2.0])
def test_derivatives_by_differences(mean):
    cycle = random_cycle(5, mean=mean)
    table, x, friction, held = cycle
    along = np.random.default_rng(6).standard_normal(x.shape)
    step, delta = 1e-6, 0.2
    here = rounded(cycle, delta)
    out = np.empty_like(here.r)
    times_derivative(here.nn, here.tn, here.tt, along, out)
    ahead, behind = (
        rounded((table, x + side * step * along, friction, held), delta).r for side in (1, -1)
    )
    assert (here.kind == CHANGING).all()
    assert out == pytest.approx((ahead - behind) / (2 * step), abs=1e-8)


def test_what_hardly_changes_is_linear():
    """Far from its corners a pair touches and sticks, or is open; derivatives say so to a thousandth."""
    x = np.zeros((2, 2, 3))
    x[:, 0, 0], x[0, 1, 1] = (50.0, -50.0), 1.0
    cycle = rounded((sample_table(1, 64), x, np.full(2, 0.5), np.zeros((2, 1))), 0.1)
    assert cycle.kind.tolist() == [[LINEAR, LINEAR], [OPEN, OPEN]]
    assert cycle.nn[0] == pytest.approx(np.eye(3))
    assert cycle.tt[0, 0, 0] == pytest.approx(np.eye(3))
    assert not cycle.nn[1].any()
    assert not cycle.tt[1].any()
    assert cycle.r[0, 1] == pytest.approx(x[0, 1], abs=1e-3)


def test_neither_spatial_pairs_nor_walks_are_rounded():
    table = sample_table(1, 16)
    with pytest.raises(ContactError, match="spatial pairs"):
        contact_cycle(
            table, np.ones((1, 3, 3)), np.ones(1), np.zeros((1, 2)), rounding=np.ones((1, 3))
        )
    with pytest.raises(ContactError, match="walk"):
        contact_cycle(
            table,
            np.ones((1, 2, 3)),
            np.ones(1),
            np.zeros((1, 1)),
            np.ones((1, 1)),
            np.ones((1, 2)),
        )

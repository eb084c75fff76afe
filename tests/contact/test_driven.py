"""Contact behind a flexibility over a driven cycle, against the augmented laws and by differences."""

from __future__ import annotations

import numpy as np
import pytest

from microslip.contact.aft import contact_cycle
from microslip.contact.aft_states import cycle_of_states
from microslip.contact.driven import DrivenContact, Extrapolation
from microslip.contact.pairs import SEPARATED, STICK
from microslip.contact.samples import sample_table
from microslip.errors import ContactError

PAIRS, H = 5, 4
FRICTION = np.array([0.0, 0.2, 0.5, 0.8, 0.3])
TABLE = sample_table(H, 96)


def random_motion(seed, spread=1.0):
    """Augmented forces of pairs that touch, open, stick and slip, (m, 2, c)."""
    rng = np.random.default_rng(seed)
    x = spread * rng.standard_normal((PAIRS, 2, 2 * H + 1)) / (1 + np.arange(2 * H + 1) // 2)
    x[:, 0, 0] += 1.0
    return x


def flexible(seed):
    """A flexibility that couples all pairs, (2 m, 2 m)."""
    A = np.random.default_rng(seed).standard_normal((2 * PAIRS, 2 * PAIRS))
    return A @ A.T / PAIRS + 2 * np.eye(2 * PAIRS)


def samples(x):
    """(N, 2 m) of coefficients (m, 2, c)."""
    return TABLE.basis.T @ x.reshape(2 * PAIRS, -1).T


def coupled(seed):
    """A driven cycle of pairs that feel each other, and what it was driven by."""
    contact, y = (
        DrivenContact(flexible(seed), FRICTION, np.ones(PAIRS)),
        samples(random_motion(seed)),
    )
    return contact, y, contact.cycle(y, np.zeros(PAIRS))


@pytest.mark.parametrize("seed", range(6))
@pytest.mark.parametrize("walk", [0.0, 0.7])
def test_pairs_by_themselves_are_those_of_the_augmented_laws(seed, walk):
    """Behind a flexibility of its own a pair answers y as it answers the augmented force y / W."""
    own = np.random.default_rng(seed).uniform(0.5, 2.0, 2 * PAIRS)
    x, held = random_motion(seed), np.full(PAIRS, 0.1)
    W = own.reshape(PAIRS, 2)
    drift = np.zeros(2 * PAIRS)
    drift[1::2] = walk
    driven = DrivenContact(np.diag(own), FRICTION, np.ones(PAIRS)).cycle(
        samples(x * W[:, :, None]), held, drift
    )
    known = contact_cycle(
        TABLE, x, FRICTION, (held / W[:, 1])[:, None], (drift[1::2] / W[:, 1])[:, None]
    )
    r = (TABLE.projection @ driven.r).T.reshape(PAIRS, 2, -1)
    assert r == pytest.approx(known.r, abs=1e-9)
    # one without friction slips all cycle, whatever its state is called
    assert (known.status == driven.status.T)[1:].mean() > 0.99
    assert driven.residual < 1e-9


@pytest.mark.parametrize("seed", range(6))
def test_laws_hold_at_every_sample_of_coupled_pairs(seed):
    contact, y, cycle = coupled(seed)
    r, v = cycle.r.reshape(-1, PAIRS, 2), cycle.v.reshape(-1, PAIRS, 2)
    assert cycle.v == pytest.approx(y - cycle.r @ contact.flexibility.W, abs=1e-9)
    assert np.maximum(v[..., 0], -r[..., 0]).max() < 1e-9
    assert np.abs(r[..., 0] * v[..., 0]).max() < 1e-9
    assert (np.abs(r[..., 1]) - FRICTION * r[..., 0]).max() < 1e-9
    moved = v[..., 1] - np.roll(v[..., 1], 1, axis=0)
    lost = FRICTION * r[..., 0] * np.abs(moved) - r[..., 1] * moved
    assert np.abs(lost).max() < 1e-8
    assert {1, 2, 3, 4} <= set(np.unique(cycle.status[:, 1:]))


@pytest.mark.parametrize("seed", range(4))
def test_tangent_by_differences(seed):
    contact, y, cycle = coupled(seed)
    rng, step = np.random.default_rng(100 + seed), 1e-7
    dy = samples(random_motion(seed + 10))
    walk = np.zeros(2 * PAIRS)
    tangent = contact.linearised(cycle)
    ahead, behind = (contact.cycle(y + side * step * dy, np.zeros(PAIRS)) for side in (1, -1))
    assert (ahead.status == behind.status).all()
    slope = (ahead.r - behind.r) / (2 * step)
    found = tangent.times(dy, walk)
    assert found == pytest.approx(slope, abs=1e-5 * np.abs(slope).max())
    columns = rng.standard_normal((2 * PAIRS, 3))
    matrix = tangent.matrix(columns, TABLE.basis, TABLE.projection)
    z = rng.standard_normal((3, 2 * H + 1))
    forces = TABLE.projection @ tangent.times(TABLE.basis.T @ (columns @ z).T, walk) @ columns
    # pairs that forget through each other alone are taken round once
    close = 1e-3 * np.abs(forces).max()
    assert np.einsum("iajb,jb->ia", matrix, z) == pytest.approx(forces.T, abs=close)


def test_tangent_along_a_walk_by_differences():
    contact, y = DrivenContact(flexible(3), FRICTION, np.ones(PAIRS)), samples(random_motion(3))
    walk, along, step = np.zeros(2 * PAIRS), np.zeros(2 * PAIRS), 1e-7
    walk[1::2], along[1::2] = 0.5, 1.0
    cycle = contact.cycle(y, np.zeros(PAIRS), walk)
    ahead, behind = (
        contact.cycle(y, np.zeros(PAIRS), walk + side * step * along).r for side in (1, -1)
    )
    slope = (ahead - behind) / (2 * step)
    found = contact.linearised(cycle).times(np.zeros_like(y), along)
    assert found == pytest.approx(slope, abs=1e-5 * np.abs(slope).max())


def test_extrapolation_of_a_linear_map_ends_on_its_fixed_point():
    rng = np.random.default_rng(0)
    A = 0.9 * np.linalg.qr(rng.standard_normal((3, 3)))[0]
    b, way, x = rng.standard_normal(3), Extrapolation(), np.zeros(3)
    for _ in range(6):
        x = way.next(x, A @ x + b)
    assert x == pytest.approx(np.linalg.solve(np.eye(3) - A, b), abs=1e-9)


@pytest.mark.parametrize("seed", range(6))
def test_derivatives_from_states_are_those_of_the_augmented_laws(seed):
    known = contact_cycle(TABLE, random_motion(seed, 1.5), FRICTION, np.zeros((PAIRS, 1)))
    found = cycle_of_states(TABLE, known.r, known.status, FRICTION)
    for name in ("nn", "tn", "tt", "kind"):
        assert getattr(found, name) == pytest.approx(getattr(known, name), abs=1e-12)
    assert {STICK, SEPARATED} <= set(np.unique(known.status))


def test_derivatives_of_spatial_pairs_are_refused():
    with pytest.raises(ContactError, match="spatial"):
        cycle_of_states(TABLE, np.zeros((1, 3, 9)), np.ones((1, 96), np.int8), np.ones(1))

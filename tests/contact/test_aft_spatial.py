"""The spatial contact cycle against the laws written out, finite differences, turns and the planar one."""

from __future__ import annotations

import numpy as np
import pytest

from microslip.contact.aft import CHANGING, LINEAR, OPEN, contact_cycle, times_derivative
from microslip.contact.pairs import SEPARATED, SLIP, STICK
from microslip.contact.samples import sample_table


def random_cycle(seed, harmonics=3, samples=128, pairs=30, mean=1.0):
    rng = np.random.default_rng(seed)
    table = sample_table(harmonics, samples)
    x = rng.standard_normal((pairs, 3, table.coefficients))
    x[:, 0, 0] += mean
    friction = rng.uniform(0.1, 0.6, pairs)
    held = 0.1 * rng.standard_normal((pairs, 2))
    return table, x, friction, held


def written_out(table, x, friction, held, cycles=200):
    """The same laws sample by sample, marched over many cycles."""
    xn, xt = x[0] @ table.basis, (x[1:] @ table.basis).T
    rn = np.maximum(0.0, xn)
    rt = np.empty_like(xt)
    value, before = xt[-1] - held, xt[-1]
    for _ in range(cycles):
        for k in range(table.samples):
            value = value + xt[k] - before
            size, bound = np.hypot(*value), friction * rn[k]
            value = value * bound / size if size > bound else value
            rt[k], before = value, xt[k]
    return table.projection @ rn, (table.projection @ rt).T


def locked(cycle):
    """Pairs that stick all cycle, if not where they have stuck from the beginning."""
    return (cycle.kind[:, 1] == CHANGING) & (cycle.status == STICK).all(axis=1)


@pytest.mark.parametrize(
    "mean", [-4.0, 1.0, *(pytest.param(m, marks=pytest.mark.validate) for m in (0.0, 3.0, 20.0))]
)
def test_laws_written_out(mean):
    """Lift-off, mixed, always touching: marched for 200 cycles, which forget the start to rounding."""
    table, x, friction, held = random_cycle(1, mean=mean)
    cycle = contact_cycle(table, x, friction, held)
    free = locked(cycle)
    for i in range(len(x)):
        rn, rt = written_out(table, x[i], friction[i], held[i])
        if cycle.kind[i, 0] != LINEAR:
            assert cycle.r[i, 0] == pytest.approx(rn, abs=1e-12)
        if free[i]:
            # which of the tractions that it can lock in is open: marching ends in one of them, too
            rest = cycle.r[i, 1:] - rt
            assert np.abs(rest[:, 1:]).max() <= 1e-10
        else:
            assert cycle.r[i, 1:] == pytest.approx(rt, abs=1e-10)


@pytest.mark.parametrize("mean", [6.0, 12.0])
def test_locked_pairs_stick_at_the_nearest_place(mean):
    """Within the cone at every sample, and nearer to `held` than any other such place of a fine net."""
    seen = 0
    for seed in range(20, 26):
        table, x, friction, held = random_cycle(seed, pairs=60, mean=mean)
        held *= 30.0
        cycle = contact_cycle(table, x, friction, held)
        for i in np.flatnonzero(locked(cycle)):
            place = x[i, 1:, 0] - cycle.r[i, 1:, 0]
            assert np.abs(cycle.r[i, 1:, 1:] - x[i, 1:, 1:]).max() == 0.0
            limit = friction[i] * (x[i, 0] @ table.basis)
            xt = (x[i, 1:] @ table.basis).T

            def beyond(h, xt=xt, limit=limit):
                return (np.linalg.norm(xt - h[..., None, :], axis=-1) - limit).max(axis=-1)

            assert beyond(place) <= 1e-11 * limit.max()
            angle = np.linspace(0, 2 * np.pi, 721)
            ring = np.stack([np.cos(angle), np.sin(angle)], axis=-1)
            radius = np.linalg.norm(place - held[i])
            for share in (1 - 1e-6, 0.99, 0.9):
                assert (beyond(held[i] + share * radius * ring) > 0).all()
            seen += 1
    assert seen > 10


def test_two_discs_that_hardly_meet():
    """Pulled to and fro by a little less, and a little more, than twice the limit: both sides meet there."""
    table = sample_table(1, 128)
    found = []
    for pull in (0.5 * (1 - 1e-9), 0.5 * (1 + 1e-9)):
        x = np.zeros((1, 3, 3))
        x[0, 0, 0], x[0, 1, 1] = 1.0, pull
        cycle = contact_cycle(table, x, np.array([0.5]), np.array([[0.0, 0.3]]))
        found.append(cycle)
    assert (found[0].status == STICK).all()
    assert (found[1].status == SLIP).any()
    for cycle in found:
        assert np.isfinite(cycle.tt).all()
        assert np.abs(cycle.r[0, 1:] - [[0, 0.5, 0], [0, 0, 0]]).max() <= 1e-4


def test_a_body_that_has_gone_far_slips_as_near_by():
    """A large mean of x_t, as of a body that soft springs stop, costs no digits of those that slip."""
    table, x, friction, held = random_cycle(31, mean=1.0)
    far = x.copy()
    far[:, 1:, 0] += 2.0**40
    near, away = (contact_cycle(table, each, friction, held).r for each in (x, far))
    slips = (contact_cycle(table, x, friction, held).kind[:, 1] == CHANGING) & (
        contact_cycle(table, x, friction, held).status != STICK
    ).any(axis=1)
    assert np.abs(near - away)[slips].max() <= 1e-10


def test_kinds_are_what_they_say():
    seen = set()
    for mean in (-20.0, 0.0, 60.0):
        table, x, friction, held = random_cycle(2, mean=mean)
        cycle = contact_cycle(table, x, friction, held)
        for i, (n, t, other) in enumerate(cycle.kind):
            assert t == other
            seen |= {("n", int(n)), ("t", int(t))}
            if n == OPEN:
                assert not cycle.r[i].any()
                assert (cycle.status[i] == SEPARATED).all()
            if t == LINEAR:
                rest = cycle.r[i, 1:] - x[i, 1:]
                assert rest[:, 0] == pytest.approx(-held[i])
                assert not rest[:, 1:].any()
    assert seen == {(c, k) for c in "nt" for k in (OPEN, LINEAR, CHANGING)}


@pytest.mark.parametrize("mean", [0.0, 1.0, 6.0])
@pytest.mark.parametrize("harmonics", [1, 3, 5])
def test_derivative_against_differences(mean, harmonics):
    """Varying normal load, with and without lift-off, pairs that come to rest among them, to 1e-6."""
    table, x, friction, held = random_cycle(harmonics, harmonics, mean=mean)
    cycle = contact_cycle(table, x, friction, held)
    assert (cycle.kind[:, 1] == CHANGING).any()
    step = 1e-6
    rng = np.random.default_rng(harmonics)
    for _ in range(6):
        way = rng.standard_normal(x.shape)
        out = np.empty_like(x)
        times_derivative(cycle.nn, cycle.tn, cycle.tt, way, out)
        ahead = contact_cycle(table, x + step * way, friction, held).r
        behind = contact_cycle(table, x - step * way, friction, held).r
        error = np.abs((ahead - behind) / (2 * step) - out).max(axis=(1, 2))
        # a state that changes at a sample within the step bends the difference, not the derivative
        assert np.sort(error)[: int(0.9 * len(error))].max() <= 1e-6
        assert error.max() <= 1e-2


def test_turning_the_axes_turns_the_cycle():
    table, x, friction, held = random_cycle(3)
    c, s = np.cos(0.8), np.sin(0.8)
    Q = np.array([[c, -s], [s, c]])
    turned = x.copy()
    turned[:, 1:] = np.einsum("ab,mbc->mac", Q, x[:, 1:])
    one = contact_cycle(table, x, friction, held)
    other = contact_cycle(table, turned, friction, held @ Q.T)
    assert np.abs(other.r[:, 1:] - np.einsum("ab,mbc->mac", Q, one.r[:, 1:])).max() <= 1e-11
    assert np.abs(other.tn - np.einsum("ab,mbcd->macd", Q, one.tn)).max() <= 1e-8


@pytest.mark.parametrize("mean", [0.0, 1.0, 6.0])
def test_in_one_direction_it_is_the_planar_cycle(mean):
    """Where the planar one slips, it forgets its start within a cycle; coefficients and derivatives agree."""
    table, x, friction, held = random_cycle(4, mean=mean)
    x[:, 2] = 0.0
    held[:, 1] = 0.0
    flat = contact_cycle(table, x[:, :2], friction, held[:, :1])
    round_ = contact_cycle(table, x, friction, held)
    assert np.abs(round_.r[:, :2] - flat.r).max() <= 1e-11
    assert not round_.r[:, 2].any()
    assert np.array_equal(round_.kind[:, :2], flat.kind)
    assert np.abs(round_.nn - flat.nn).max() <= 1e-12
    assert np.abs(round_.tn[:, 0] - flat.tn[:, 0]).max() <= 1e-9
    assert np.abs(round_.tt[:, 0, 0] - flat.tt[:, 0, 0]).max() <= 1e-9


def test_a_drift_pushes_a_pair_that_would_stick_to_its_limit():
    """With v_t larger by a little each cycle a pair slips on that side: mean traction near the limit."""
    table = sample_table(1, 512)
    x = np.zeros((1, 3, 3))
    x[0, 0, 0], x[0, 1, 1] = 1.0, 0.1
    drift = np.array([[3e-3, 4e-3]])
    cycle = contact_cycle(table, x, np.array([0.5]), np.zeros((1, 2)), drift)
    assert (cycle.status == SLIP).any()
    assert cycle.r[0, 1:, 0] @ [0.6, 0.8] > 0.4
    step = 1e-7
    for a in range(2):
        more = drift + step * np.eye(2)[a]
        less = drift - step * np.eye(2)[a]
        slope = contact_cycle(table, x, np.array([0.5]), np.zeros((1, 2)), more).r
        slope = (slope - contact_cycle(table, x, np.array([0.5]), np.zeros((1, 2)), less).r) / (
            2 * step
        )
        assert cycle.td[0, :, a] == pytest.approx(slope[0, 1:], abs=1e-4)


@pytest.mark.parametrize("mean", [1.0, 6.0, 20.0])
def test_every_pair_comes_to_a_periodic_traction(mean):
    """Also those that come to rest by and by: an error would name them; going round once more stays."""
    for seed in range(3000, 3010):
        table, x, friction, held = random_cycle(seed, pairs=60, mean=mean)
        cycle = contact_cycle(table, x, friction, held)
        traction = np.einsum("mac,cn->man", cycle.r[:, 1:], table.basis)
        bound = friction[:, None] * np.maximum(0.0, x[:, 0] @ table.basis)
        assert np.isfinite(cycle.tt).all()
        assert np.abs(traction).max() <= 2 * bound.max()

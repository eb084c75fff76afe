"""The compiled contact cycle against the laws written out, finite differences and closed forms."""

from __future__ import annotations

import numpy as np
import pytest

from microslip.contact.aft import CHANGING, LINEAR, OPEN, contact_cycle
from microslip.contact.pairs import SEPARATED, STICK
from microslip.contact.samples import sample_table
from microslip.errors import ContactError


def random_cycle(seed, harmonics=3, samples=128, pairs=40, mean=1.0):
    rng = np.random.default_rng(seed)
    table = sample_table(harmonics, samples)
    x = rng.standard_normal((pairs, 2, table.coefficients))
    x[:, 0, 0] += mean
    friction = rng.uniform(0.1, 0.6, pairs)
    held = 0.1 * rng.standard_normal((pairs, 1))
    return table, x, friction, held


def written_out(table, x, friction, held, cycles=3):
    """The same laws sample by sample, marched over some cycles."""
    xn, xt = x[0] @ table.basis, x[1] @ table.basis
    rn = np.maximum(0.0, xn)
    rt = np.empty_like(rn)
    value, before = xt[0] - held[0], xt[0]
    for _ in range(cycles):
        for k in range(table.samples):
            value = np.clip(value + xt[k] - before, -friction * rn[k], friction * rn[k])
            rt[k], before = value, xt[k]
    return table.projection @ rn, table.projection @ rt


@pytest.mark.parametrize("mean", [-4.0, 0.0, 1.0, 3.0, 20.0])
def test_laws_written_out(mean):
    """Lift-off, mixed, always touching: one cycle of memory is enough, three change nothing."""
    table, x, friction, held = random_cycle(1, mean=mean)
    cycle = contact_cycle(table, x, friction, held)
    for i in range(len(x)):
        rn, rt = written_out(table, x[i], friction[i], held[i])
        if cycle.kind[i, 0] != LINEAR:
            assert cycle.r[i, 0] == pytest.approx(rn, abs=1e-12)
        assert cycle.r[i, 1] == pytest.approx(rt, abs=1e-12)


def test_kinds_are_what_they_say():
    """Open pairs carry nothing, linear components return the augmented force; both do occur."""
    seen = set()
    for mean in (-20.0, 0.0, 60.0):
        table, x, friction, held = random_cycle(2, mean=mean)
        cycle = contact_cycle(table, x, friction, held)
        for i, (n, t) in enumerate(cycle.kind):
            seen |= {("n", int(n)), ("t", int(t))}
            if n == OPEN:
                assert not cycle.r[i].any()
                assert (cycle.status[i] == SEPARATED).all()
            if n == LINEAR:
                assert (cycle.r[i, 0] == x[i, 0]).all()
            if t == LINEAR:
                assert (cycle.status[i] == STICK).all()
                assert cycle.r[i, 1] - x[i, 1] == pytest.approx(
                    np.eye(table.coefficients)[0] * -held[i]
                )
    assert seen == {(c, k) for c in "nt" for k in (OPEN, LINEAR, CHANGING)}


def derivative_error(table, x, friction, held, step=1e-6):
    """Largest difference between analytic and central differences, and the size of the latter."""
    cycle = contact_cycle(table, x, friction, held)
    worst = 0.0
    for component in range(2):
        for j in range(table.coefficients):
            ahead, behind = x.copy(), x.copy()
            ahead[:, component, j] += step
            behind[:, component, j] -= step
            slope = contact_cycle(table, ahead, friction, held).r
            slope = (slope - contact_cycle(table, behind, friction, held).r) / (2 * step)
            normal = cycle.nn[:, :, j] if component == 0 else np.zeros_like(slope[:, 0])
            tangential = (cycle.tn[:, 0] if component == 0 else cycle.tt[:, 0, 0])[:, :, j]
            error = np.maximum(
                np.abs(slope[:, 0] - normal).max(1), np.abs(slope[:, 1] - tangential).max(1)
            )
            worst = max(worst, error.max())
    return worst, cycle


@pytest.mark.parametrize("mean", [0.0, 1.0, 6.0])
@pytest.mark.parametrize("harmonics", [1, 3, 5])
def test_derivative_against_differences(mean, harmonics):
    """Varying normal load, with and without lift-off, to 1e-7."""
    worst, cycle = derivative_error(*random_cycle(harmonics, harmonics, mean=mean))
    print(f"H = {harmonics}, mean {mean}: {worst:.1e}; kinds {np.bincount(cycle.kind.ravel())}")
    assert (cycle.kind == CHANGING).any()
    assert worst < 1e-7


def test_elastic_law_derivative_against_differences():
    """A penalty contact: x = k v with the spring itself as augmentation, derivative by v."""
    table, v, friction, held = random_cycle(5, mean=0.5)
    stiffness = np.array([3.0, 7.0])[None, :, None]

    def force(displacement):
        return contact_cycle(table, stiffness * displacement, friction, held)

    cycle, step = force(v), 1e-6
    for j in range(table.coefficients):
        for component in range(2):
            ahead, behind = v.copy(), v.copy()
            ahead[:, component, j] += step
            behind[:, component, j] -= step
            slope = (force(ahead).r - force(behind).r) / (2 * step)
            block = (cycle.tn[:, 0] if component == 0 else cycle.tt[:, 0, 0])[:, :, j]
            analytic = block * stiffness[0, component]
            assert slope[:, 1] == pytest.approx(analytic, abs=1e-7 * 7.0)
            if component == 0:
                assert slope[:, 0] == pytest.approx(cycle.nn[:, :, j] * 3.0, abs=1e-7 * 7.0)


def driven_slider(amplitude, stiffness, limit, samples=4096, harmonics=3):
    """Spring and slider under ``X sin``: coefficients of the force."""
    table = sample_table(harmonics, samples)
    pairs = len(limit)
    x = np.zeros((pairs, 2, table.coefficients))
    x[:, 0, 0] = 1.0
    x[:, 1, 1] = stiffness * amplitude
    return contact_cycle(table, x, np.asarray(limit, dtype=float), np.zeros((pairs, 1)))


@pytest.mark.parametrize("ratio", [1.01, 1.5, 3.0, 50.0])
def test_jenkins_element(ratio):
    """Energy 4 F_s (X - F_s/k) per cycle, and the in-phase force of the closed form."""
    k, limit = 5.0, 0.7
    X = ratio * limit / k
    cycle = driven_slider(X, k, [limit])
    sine, cosine = cycle.r[0, 1, 1:3]
    assert np.pi * X * cosine == pytest.approx(4 * limit * (X - limit / k), rel=2e-5)
    angle = np.arccos(1 - 2 / ratio)
    assert sine == pytest.approx(k * X / np.pi * (angle - 0.5 * np.sin(2 * angle)), rel=2e-5)


def test_sliding_not_reached_is_a_spring():
    cycle = driven_slider(0.99 * 0.7 / 5.0, 5.0, [0.7])
    assert (cycle.kind[0] == LINEAR).all()
    assert cycle.r[0, 1, 1] == pytest.approx(0.99 * 0.7, rel=1e-14)


def test_iwan_element(published):
    """A four-parameter Iwan element as many sliders: dissipation per cycle of the closed form."""
    data = published["iwan4"]
    F_S, K_T, chi, beta, u = (data[key] for key in ("F_S", "K_T", "chi", "beta", "u"))
    phi_max = F_S * (1 + beta) / (K_T * (beta + (chi + 1) / (chi + 2)))
    R = F_S * (chi + 1) / (phi_max ** (chi + 2) * (beta + (chi + 1) / (chi + 2)))
    S = F_S / phi_max * beta / (beta + (chi + 1) / (chi + 2))
    count = 3000
    edges = phi_max * (np.arange(count + 1) / count) ** 2
    # springs of the sliders whose strength lies in a cell, and their mean strength
    spring = R * np.diff(edges ** (chi + 1)) / (chi + 1)
    strength = R * np.diff(edges ** (chi + 2)) / (chi + 2) / spring
    spring, strength = np.append(spring, S), np.append(strength, phi_max)
    table = sample_table(31, 1024)
    x = np.zeros((len(spring), 2, table.coefficients))
    x[:, 0, 0] = 1.0
    x[:, 1, 1] = spring * u
    force = (
        contact_cycle(table, x, strength * spring, np.zeros((len(spring), 1))).r[:, 1].sum(axis=0)
    )
    energy = np.pi * u * force[2]
    peak = force @ table.basis[:, 256]
    print(f"energy {energy / data['dissipation'] - 1:+.1e}, force {peak / data['force'] - 1:+.1e}")
    assert peak == pytest.approx(data["force"], rel=1e-3)
    assert spring.sum() == pytest.approx(K_T, rel=1e-9)
    assert energy == pytest.approx(data["dissipation"], rel=1e-3)


@pytest.mark.parametrize(("mean", "least"), [(6.0, 1.8), (1.0, 1.0)])
def test_more_samples_converge(mean, least):
    """Second order while touching; first where pairs close again, somewhere between two samples."""
    _, x, friction, held = random_cycle(7, pairs=400, mean=mean)
    fine = contact_cycle(sample_table(3, 8192), x, friction, held).r
    errors = [
        np.sqrt(np.mean((contact_cycle(sample_table(3, n), x, friction, held).r - fine) ** 2))
        for n in (64, 256, 1024)
    ]
    order = 0.5 * np.log2(np.array(errors[:-1]) / errors[1:])
    print(f"errors {errors}, orders {order}")
    assert (order > least).all()


def test_drift_of_a_walking_pair():
    """Against many cycles written out, in which v_t advances a little; and its derivative."""
    table, x, friction, held = random_cycle(11, mean=2.0)
    drift = 0.3 * np.random.default_rng(1).standard_normal((len(x), 1))
    cycle = contact_cycle(table, x, friction, held, drift)
    for i in range(len(x)):
        xn, xt = x[i] @ table.basis
        limit = friction[i] * np.maximum(0.0, xn)
        value, before, rt = 0.0, xt[0], np.empty(table.samples)
        for _ in range(40):
            for k in range(table.samples):
                value = np.clip(value + xt[k] - before + drift[i, 0] / 128, -limit[k], limit[k])
                rt[k], before = value, xt[k]
        assert cycle.r[i, 1] == pytest.approx(table.projection @ rt, abs=1e-12)
    step = 1e-6
    slope = contact_cycle(table, x, friction, held, drift + step).r
    slope = (slope - contact_cycle(table, x, friction, held, drift - step).r) / (2 * step)
    assert slope[:, 1] == pytest.approx(cycle.td[:, 0, 0], abs=1e-7)
    assert not slope[:, 0].any()


def test_shift_in_time_shifts_the_answer():
    """Starting the cycle elsewhere (by whole samples) turns every harmonic and nothing else."""
    table, x, friction, held = random_cycle(9)
    shift = 37
    turned = np.einsum("ik,pck->pci", table.projection, np.roll(x @ table.basis, -shift, axis=2))
    one = contact_cycle(table, x, friction, held)
    other = contact_cycle(table, turned, friction, held)
    slipping = one.kind[:, 1] == CHANGING
    back = np.roll(other.r @ table.basis, shift, axis=2)
    assert (one.r @ table.basis)[slipping] == pytest.approx(back[slipping], abs=1e-11)
    assert (np.roll(other.status, shift, axis=1) == one.status).all()


def test_bad_tables():
    with pytest.raises(ContactError, match="do not resolve"):
        sample_table(20, 64)
    with pytest.raises(ContactError, match="at least the first"):
        sample_table(0, 64)

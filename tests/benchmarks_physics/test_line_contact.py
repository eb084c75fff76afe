"""Two equal cylinders with parallel axes, pressed and sheared: Hertz, Cattaneo and Mindlin."""

from __future__ import annotations

import numpy as np
import pytest

from microslip.contact.pairs import SEPARATED, STICK, by_pair, normal, slip_history
from microslip.contact.path import follow_path
from microslip.contact.solver import ContactSolver
from microslip.model.flexibility import Flexibility

RADIUS, MODULUS, DATUM = 1.0, 1.0, 5.0
"""Relative radius, E* of both bodies, and a constant: a unit line force at 0 moves the surface at x by
``DATUM - 2 ln|x|/(pi E*)``, which in the plane is known to a motion as a whole."""


def strip(x: np.ndarray, half: float) -> np.ndarray:
    """Displacement at x of unit force spread over a strip: K. L. Johnson, Contact Mechanics, section 2.5."""

    def side(a):
        return a * np.log(np.abs(a))

    mean = (side(x + half) - side(x - half)) / (2 * half) - 1
    return DATUM - 2 / (np.pi * MODULUS) * mean


def sliding(share: np.ndarray | float, a: float, limit: float) -> np.ndarray | float:
    """Tangential displacement under ``Q = share mu P``, from ``d delta/dQ = DATUM - 2/(pi E*) ln(c/2)``,
    the compliance of a strip of half width ``c = a sqrt(1 - share)`` that sticks (Johnson, section 7.2)."""
    linear = share * limit * (DATUM - 2 / (np.pi * MODULUS) * np.log(a / 2))
    left = np.clip(1 - np.asarray(share), 1e-300, None)
    return linear + limit / (np.pi * MODULUS) * (left * np.log(left) + share)


def loss_of_a_cycle(share: float, limit: float) -> float:
    """Between ``+-Q``, by Masing's rule ``4 Q delta - 8 int_0^Q delta dQ``: its linear part drops out."""
    left = 1 - share
    g = left * np.log(left) + share
    below = share**2 / 2 - left**2 / 2 * np.log(left) + left**2 / 4 - 1 / 4
    return limit**2 / (np.pi * MODULUS) * (4 * share * g - 8 * below)


def test_loss_in_closed_form_is_that_of_the_loop():
    """Against quadrature of the loop, and for small loads against ``2 (mu P)² share³/(3 pi E*)``."""
    share, a, limit = 0.6, 0.1, 2.0
    q = np.linspace(0, share, 200_001)
    below = np.trapezoid(sliding(q, a, limit), q * limit)
    loop = 4 * share * limit * sliding(share, a, limit) - 8 * below
    assert loss_of_a_cycle(share, limit) == pytest.approx(loop, rel=1e-8)
    small = 2 / 3 * limit**2 * 0.01**3 / (np.pi * MODULUS)
    assert loss_of_a_cycle(0.01, limit) == pytest.approx(small, rel=0.01)


@pytest.mark.parametrize("share", [0.3, 0.6, 0.9])
def test_cattaneo_and_mindlin_on_a_line(share):
    """Pressing: force within 1 % under the approach of Hertz, half width within a strip. Shearing: force
    within 1 %, stick zone within a strip, loss of a cycle within 2 %."""
    mu, a, m = 0.3, 0.1, 241
    x = np.linspace(-1.2, 1.2, m) * a
    half = 0.5 * (x[1] - x[0])
    W = np.kron(strip(x[:, None] - x, half), np.eye(2))
    force = np.pi * MODULUS * a**2 / (4 * RADIUS)
    approach = force * (DATUM + (1 - 2 * np.log(a / 2)) / (np.pi * MODULUS))
    loads = np.zeros((2 * m, 2))
    normal(loads.T, 2)[0] = approach - x**2 / (2 * RADIUS)
    loads[:, 1] = np.kron(np.ones(m), [0.0, 1.0])
    none, states = np.zeros((2 * m, 0)), np.full(m, STICK, np.int8)
    flexibility = Flexibility(W, none, np.zeros(0), loads, np.zeros((0, 2)), np.zeros((2, 2)))
    scale = np.full(m, force / m)
    frictionless = ContactSolver(flexibility, 0.0, scale, states)
    start = frictionless.solve(loads[:, 0], np.zeros(0), np.zeros(m))
    assert start.residual < 1e-9
    assert normal(start.r, 2).sum() == pytest.approx(force, rel=0.01)
    touching = normal(start.r, 2) > 0
    assert np.abs(x[touching]).max() == pytest.approx(a, abs=2 * half)

    solver = ContactSolver(
        flexibility, mu, scale, np.where(touching, STICK, SEPARATED).astype(np.int8)
    )
    solver.start_from(start.r, start.q, start.v)
    delta = float(sliding(share, a, mu * force))
    quarter = np.linspace(0, delta, 21)
    path = np.r_[quarter, quarter[::-1][1:], -quarter[1:], -quarter[::-1][1:], quarter[1:]]
    along = np.column_stack([np.ones(len(path)), path])
    record = follow_path(
        solver, flexibility, along, slip_history(start.v, 2), where=str, remedy="smaller steps"
    )
    pull = by_pair(record.r, 2)[:, :, 1].sum(1)
    assert abs(pull[20]) == pytest.approx(share * mu * force, rel=0.01)
    assert pull[-1] == pytest.approx(pull[20], rel=0.01)
    sticks = record.status[20] == STICK
    edge = a * np.sqrt(1 - share)
    assert np.abs(x[sticks]).max() == pytest.approx(edge, abs=2 * half)
    assert sticks.sum() * half == pytest.approx(edge, abs=2 * half)
    assert record.work[21:, :, 0].sum() == pytest.approx(
        loss_of_a_cycle(share, mu * force), rel=0.02
    )

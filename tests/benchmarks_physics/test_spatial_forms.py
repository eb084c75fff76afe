"""Three-dimensional contact against closed forms: paths that turn, and a sphere on a half-space."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.integrate import solve_ivp

from microslip.contact.pairs import STICK, by_pair, normal, slip_history
from microslip.contact.path import follow_path
from microslip.contact.solver import ContactSolver
from microslip.model.flexibility import Flexibility

PRESSED, MU, SPRING = 2.0, 0.5, 4.0
REACH = MU * PRESSED / SPRING
"""Stretch of the spring at which the slider yields."""


def slider(path: np.ndarray) -> tuple[np.ndarray, float]:
    """Forces (n, 2) of a slider on a spring whose other end goes along a path, and friction's work."""
    W = np.eye(3) / SPRING
    loads = np.eye(3)
    none = np.zeros((3, 0))
    flexibility = Flexibility(W, none, np.zeros(0), loads, np.zeros((0, 3)), np.zeros((3, 3)))
    solver = ContactSolver(flexibility, MU, np.full(1, PRESSED), np.full(1, STICK, np.int8))
    solver.start_from(np.array([PRESSED, 0, 0]), np.zeros(0), np.zeros(3))
    along = np.column_stack([np.full(len(path), PRESSED / SPRING), path])
    record = follow_path(
        solver, flexibility, along, np.zeros((1, 2)), where=str, remedy="smaller steps"
    )
    return record.r[:, 1:], float(record.friction_work.sum())


@pytest.mark.parametrize("turn", [0.3, 0.8, 1.2, 1.5])
def test_a_spring_pulled_round_a_corner_follows_a_tractrix(turn):
    """After slip along x the end goes off at an angle: ``tan(phi/2) = tan(turn/2) exp(-s/reach)``.

    phi is between the stretch and the new way. Steps are of first order, so two lengths are extrapolated.
    """
    far = 1.5 * REACH

    def angle(steps):
        s = np.linspace(0, far, steps + 1)[:, None]
        corner = np.array([5 * REACH, 0.0])
        way = np.array([np.cos(turn), np.sin(turn)])
        there = np.linspace(0, 1, 50)[:, None] * corner
        force, _ = slider(np.vstack([there, corner + s[1:] * way]))
        assert np.hypot(*force[-1]) == pytest.approx(MU * PRESSED, rel=1e-9)
        return turn - np.arctan2(force[-1, 1], force[-1, 0])

    expected = 2 * np.arctan(np.tan(turn / 2) * np.exp(-far / REACH))
    coarse, fine, finest = angle(2000), angle(4000), angle(8000)
    once = 2 * fine - coarse, 2 * finest - fine
    assert once[1] + (once[1] - once[0]) / 3 == pytest.approx(expected, abs=1e-6)


def figure_of_eight(t, size):
    return size * np.array([np.sin(t), 0.6 * np.sin(2 * t)])


def exact_slider(size: float, turns: int) -> tuple[np.ndarray, float]:
    """Stretch at the end and work of friction of the last turn, by quadrature of the rate equations.

    ``e' = x'`` where it sticks, ``e' = x' - (e x') e/reach²`` at the limit as long as ``e x' > 0``;
    friction takes ``mu N |s'|`` with ``s' = (e x') e/reach²``.
    """

    def rate(t):
        return size * np.array([np.cos(t), 1.2 * np.cos(2 * t)])

    def sticking(t, y):
        return [*rate(t), 0.0]

    def slipping(t, y):
        push = y[:2] @ rate(t) / REACH**2
        return [*(rate(t) - push * y[:2]), MU * PRESSED * push * np.hypot(*y[:2])]

    def yields(t, y):
        return y[0] ** 2 + y[1] ** 2 - REACH**2

    def rests(t, y):
        return y[:2] @ rate(t)

    yields.terminal, yields.direction = True, 1
    rests.terminal, rests.direction = True, -1
    t, y, slips = 0.0, np.zeros(3), False
    before = 0.0
    for end in 2 * np.pi * np.arange(1, turns + 1):
        before = y[2]
        while t < end - 1e-13:
            law, stop = (slipping, rests) if slips else (sticking, yields)
            found = solve_ivp(law, (t, end), y, "DOP853", events=stop, rtol=1e-12, atol=1e-14)
            t, y = found.t[-1], found.y[:, -1]
            if found.status == 1:
                slips = not slips
                if slips:
                    y[:2] *= REACH / np.hypot(*y[:2])
    return y[:2], y[2] - before


@pytest.mark.parametrize(
    "size", [pytest.param(1.1 * REACH, marks=pytest.mark.validate), 1.5 * REACH, 6 * REACH]
)
def test_slider_on_a_figure_of_eight(size):
    """Force and loss per turn against quadrature; steps are of first order, and extrapolated."""
    stretch, loss = exact_slider(size, 3)

    def found(steps):
        t = np.linspace(0, 6 * np.pi, 3 * steps + 1)
        path = figure_of_eight(t, size).T
        force, work = slider(path)
        _, earlier = slider(path[: 2 * steps + 1])
        return np.array([*force[-1], work - earlier])

    coarse, fine, finest = found(10_000), found(20_000), found(40_000)
    once = 2 * fine - coarse, 2 * finest - fine
    limit = once[1] + (once[1] - once[0]) / 3
    expected = np.array([*SPRING * stretch, loss])
    scale = np.array([MU * PRESSED, MU * PRESSED, loss])
    assert np.abs((limit - expected) / scale).max() <= 1e-6


# -- a sphere on an elastic half-space ----------------------------------------------------------

RADIUS, MODULUS = 1.0, 1.0
"""Of the sphere, and E* of both bodies; Poisson's ratio 0, so that tangential tractions act as normal
ones do and the solution of Cattaneo and Mindlin is exact."""


def love(x: np.ndarray, y: np.ndarray, half: float) -> np.ndarray:
    """Displacement at (x, y) of unit force spread over a square: Love, Phil. Trans. A 228 (1929) 377."""

    def corner(a, b):
        return a * np.arcsinh(b / np.abs(a)) + b * np.arcsinh(a / np.abs(b))

    total = (
        corner(x + half, y + half)
        + corner(x - half, y - half)
        - corner(x + half, y - half)
        - corner(x - half, y + half)
    )
    return total / (np.pi * MODULUS * (2 * half) ** 2)


def sphere(cells: int, contact_radius: float):
    """Pairs on a square around the contact, their flexibility and half the width of a cell."""
    side = np.linspace(-1.2, 1.2, cells) * contact_radius
    half = 0.5 * (side[1] - side[0])
    x, y = (a.ravel() for a in np.meshgrid(side, side))
    one = love(x[:, None] - x, y[:, None] - y, half)
    W = np.kron(one, np.eye(3))
    return x, y, half, 0.5 * (W + W.T)


def test_cattaneo_and_mindlin_on_a_sphere():
    """Hertz' force and radius, the stick zone within a cell, the loss of a cycle within 2 %.

    With ``Q/(mu P) = 1 - u^(3/2)``, ``u = 1 - delta/delta_max``, ``(c/a)² = u``,
    ``delta_max = 3 mu P/(4 E* a)`` for Poisson's ratio 0 (K. L. Johnson, Contact Mechanics, 7.2d), and
    the loss of a cycle between ``+-delta`` by Masing's rule, ``8 int_0^delta Q - 4 Q delta``.
    """
    mu, a = 0.3, 0.1
    x, y, half, W = sphere(25, a)
    approach = a**2 / RADIUS
    force = 4 / 3 * MODULUS * a**3 / RADIUS
    m = len(x)
    loads = np.zeros((3 * m, 2))
    normal(loads.T, 3)[0] = approach - (x**2 + y**2) / (2 * RADIUS)
    loads[1::3, 1] = 1.0
    flexibility = Flexibility(
        W, np.zeros((3 * m, 0)), np.zeros(0), loads, np.zeros((0, 2)), np.zeros((2, 2))
    )
    scale = np.full(m, force / m)
    solver = ContactSolver(flexibility, mu, scale, np.full(m, STICK, np.int8))
    start = ContactSolver(flexibility, 0.0, scale, np.full(m, STICK, np.int8)).solve(
        loads[:, 0], np.zeros(0), np.zeros((m, 2))
    )
    found = normal(start.r, 3).sum()
    assert found == pytest.approx(force, rel=0.01)
    touching = normal(start.r, 3) > 0
    assert np.hypot(x, y)[touching].max() == pytest.approx(a, abs=2 * half)
    solver = ContactSolver(flexibility, mu, scale, np.where(touching, STICK, 4).astype(np.int8))
    solver.start_from(start.r, start.q, start.v)
    vt_old = slip_history(start.v, 3)
    farthest = mu * approach  # 3 mu P/(4 E* a) = mu a²/R: where all slips
    delta = 0.6 * farthest
    quarter = np.linspace(0, delta, 15)
    path = np.r_[quarter, quarter[::-1][1:], -quarter[1:], -quarter[::-1][1:], quarter[1:]]
    along = np.column_stack([np.ones(len(path)), path])
    record = follow_path(solver, flexibility, along, vt_old, where=str, remedy="smaller steps")
    u = 1 - delta / farthest
    pull = mu * force * (1 - u**1.5)
    forces = by_pair(record.r, 3)
    assert forces[14, :, 1].sum() == pytest.approx(pull, rel=0.01)
    assert forces[-1, :, 1].sum() == pytest.approx(pull, rel=0.01)
    assert np.abs(forces[:, :, 2]).max() <= 1e-9 * force / m
    sticks = record.status[14] == STICK
    assert np.sqrt(sticks.sum() * (2 * half) ** 2 / np.pi) == pytest.approx(
        a * np.sqrt(u), abs=2 * half
    )
    assert np.hypot(x, y)[sticks].max() == pytest.approx(a * np.sqrt(u), abs=2 * half)
    below = mu * force * (delta - 0.4 * farthest * (1 - u**2.5))  # int_0^delta Q
    expected = 8 * below - 4 * pull * delta
    assert record.work[15:, :, 0].sum() == pytest.approx(expected, rel=0.02)

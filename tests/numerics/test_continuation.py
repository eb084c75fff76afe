"""Continuation on problems with closed forms: a circle, Duffing's oscillator, a kink."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import pytest

from microslip.numerics.continuation import (
    ContinuationError,
    StepControl,
    advance,
    crossings,
    first_point,
    fold,
    load_branch,
    locate,
    save_branch,
    solve_at,
    trace,
    turned,
)


class Dense:
    """Linearised equations with a dense derivative."""

    def __init__(self, F, J, F_p):
        self.F, self._J, self._F_p = np.asarray(F, float), np.asarray(J, float), np.asarray(F_p)

    def solve(self, right, tolerance, guess=None):
        return np.linalg.solve(self._J, right)

    def by_parameter(self):
        return self._F_p


@dataclass
class Circle:
    """u² + p² = 1: two folds, at p = ±1."""

    parameter_scale: float = 1.0
    weight = np.ones(1)

    def at(self, u, p):
        return Dense([u[0] ** 2 + p**2 - 1], [[2 * u[0]]], np.array([2 * p]))


@dataclass
class Duffing:
    """x'' + 2 z x' + x + g x³ = f sin(w t), one harmonic: x = a sin + b cos."""

    z: float = 0.02
    g: float = 0.5
    f: float = 0.1
    parameter_scale: float = 0.1
    weight = np.ones(2)

    def at(self, u, p):
        a, b = u
        square = 0.75 * self.g * (a * a + b * b)
        own = 1 - p * p
        F = [(own + square) * a - 2 * self.z * p * b - self.f, (own + square) * b]
        F[1] += 2 * self.z * p * a
        J = [
            [own + square + 1.5 * self.g * a * a, 1.5 * self.g * a * b - 2 * self.z * p],
            [1.5 * self.g * a * b + 2 * self.z * p, own + square + 1.5 * self.g * b * b],
        ]
        F_p = np.array([-2 * p * a - 2 * self.z * b, -2 * p * b + 2 * self.z * a])
        return Dense(F, J, F_p)

    def frequencies(self, amplitude):
        """Closed form: both w² at which the amplitude is met."""
        stiff = 1 + 0.75 * self.g * amplitude**2
        middle = stiff - 2 * self.z**2
        root = np.sqrt(middle**2 - stiff**2 + (self.f / amplitude) ** 2)
        return middle - root, middle + root

    def folds(self):
        """Amplitudes of the folds: dw²/dA = 0 on either branch, by a fine table and bisection."""

        def slope(amplitude, branch, step=1e-6):
            ahead, behind = self.frequencies(amplitude + step), self.frequencies(amplitude - step)
            return (ahead[branch] - behind[branch]) / (2 * step)

        top = self.peak()[1]
        table = np.linspace(0.05, top * (1 - 1e-4), 4000)
        found = []
        for branch in (0, 1):
            values = np.array([slope(a, branch) for a in table])
            for i in np.flatnonzero(values[1:] * values[:-1] < 0):
                low, high = table[i], table[i + 1]
                for _ in range(50):
                    middle = 0.5 * (low + high)
                    same = slope(middle, branch) * slope(low, branch) > 0
                    low, high = (middle, high) if same else (low, middle)
                found.append((np.sqrt(self.frequencies(low)[branch]), low))
        return sorted(found)

    def peak(self):
        """Frequency and amplitude of the largest response: the discriminant vanishes."""
        low, high = 1e-3, 100.0
        for _ in range(200):
            A = 0.5 * (low + high)
            stiff = 1 + 0.75 * self.g * A * A
            positive = (stiff - 2 * self.z**2) ** 2 - stiff**2 + (self.f / A) ** 2 > 0
            low, high = (A, high) if positive else (low, A)
        return np.sqrt(1 + 0.75 * self.g * A * A - 2 * self.z**2), A


CONTROL = StepControl(first=0.02, largest=0.2, tolerance=1e-11)


def duffing_branch(problem, start, end, control=CONTROL):
    point = first_point(problem, np.zeros(2), start, control, np.sign(end - start))
    return trace(problem, point, (min(start, end), max(start, end)), control)


def test_circle_is_walked_round():
    """Two folds in one turn, every point on the circle."""
    problem = Circle()
    control = StepControl(first=0.1, largest=0.2, max_points=80)
    start = first_point(problem, np.array([1.0]), 0.0, control)
    branch = trace(problem, start, (-2.0, 2.0), control)
    radius = [np.hypot(point.u[0], point.p) for point in branch.points]
    assert radius == pytest.approx(np.ones(80), abs=1e-8)
    angle = np.unwrap([np.arctan2(point.p, point.u[0]) for point in branch.points])
    assert angle[-1] > 2 * np.pi
    assert (np.diff(angle) > 0).all()
    turn = fold(problem, branch, branch.folds[0], control)
    assert (turn.p, turn.u[0]) == pytest.approx((1.0, 0.0), abs=2e-3)
    assert branch.ended == "points"


def test_duffing_points_are_on_the_closed_form():
    problem = Duffing()
    branch = duffing_branch(problem, 0.5, 3.0)
    assert branch.ended == "range"
    assert branch.points[-1].p == 3.0
    for point in branch.points:
        w2 = problem.frequencies(np.linalg.norm(point.u))
        assert min(abs(point.p**2 - np.array(w2))) < 1e-9 * point.p**2


def test_duffing_folds_and_peak():
    """Both folds and the peak of the closed form."""
    problem = Duffing()
    branch = duffing_branch(problem, 0.5, 3.0)
    expected = problem.folds()
    assert len(expected) == len(branch.folds) == 2
    found = sorted(
        (f.p, np.linalg.norm(f.u)) for f in (fold(problem, branch, i) for i in branch.folds)
    )
    print(f"folds {found}, closed form {expected}")
    for (w, A), (w_closed, A_closed) in zip(found, expected, strict=True):
        assert [w, A] == pytest.approx([w_closed, A_closed], rel=1e-6)
    sizes = [np.linalg.norm(point.u) for point in branch.points]
    top = int(np.argmax(sizes))
    peak = locate(
        problem,
        branch.points[top - 1],
        branch.points[top + 1],
        lambda point: point.u @ point.tangent_u,
    )
    w, A = problem.peak()
    assert (peak.p, np.linalg.norm(peak.u)) == pytest.approx((w, A), rel=1e-6)


def test_fold_is_the_same_from_both_sides():
    """Rising and falling frequency pass the same three solutions at every frequency between."""
    problem = Duffing()
    up, down = duffing_branch(problem, 0.5, 3.0), duffing_branch(problem, 3.0, 0.5)
    (low, _), (high, _) = problem.folds()
    for p in np.linspace(low, high, 7)[1:-1]:
        sizes = []
        for branch in (up, down):
            roots = [solve_at(problem, u, p, CONTROL)[0] for u, _ in crossings(branch.points, p)]
            sizes.append(sorted(np.linalg.norm(root) for root in roots))
        assert len(sizes[0]) == 3
        assert sizes[0] == pytest.approx(sizes[1], rel=1e-9)
    turns = [sorted(fold(problem, b, i).p for i in b.folds) for b in (up, down)]
    assert turns[0] == pytest.approx(turns[1], rel=1e-7)


def test_restart_goes_on_where_it_stopped(tmp_path):
    problem = Duffing()
    whole = duffing_branch(problem, 0.5, 3.0)
    stop = len(whole.points) // 2
    control = StepControl(first=0.02, largest=0.2, tolerance=1e-11, max_points=stop)
    part = duffing_branch(problem, 0.5, 3.0, control)
    assert part.ended == "points"
    save_branch(tmp_path / "branch.npz", part)
    saved = load_branch(tmp_path / "branch.npz")
    assert saved.parameters == pytest.approx(part.parameters, rel=0, abs=0)
    rest = trace(problem, saved.points[-1], (0.5, 3.0), CONTROL, before=saved.points[-2])
    assert np.array([p.p for p in rest.points[1:]]) == pytest.approx(
        whole.parameters[stop:], rel=1e-12
    )


def test_turned_point_walks_back():
    problem = Duffing()
    branch = duffing_branch(problem, 0.5, 1.2)
    back = trace(problem, turned(branch.points[-1]), (0.5, 1.2), CONTROL)
    assert back.points[-1].p == 0.5
    assert back.points[-1].u == pytest.approx(branch.points[0].u, rel=1e-9)


@dataclass
class Kink:
    """u + 2 |u - 1| = p: a fold where the derivative jumps from -1 to 3.

    In this metric the corner is blunter than a right angle; a sharper one ends a branch.
    """

    parameter_scale: float = 3.0
    weight = np.ones(1)

    def at(self, u, p):
        sign = 1.0 if u[0] > 1 else -1.0
        return Dense([u[0] + 2 * abs(u[0] - 1) - p], [[1 + 2 * sign]], np.array([-1.0]))


def test_sharp_corner_is_named():
    problem = Kink(parameter_scale=1.0)
    start = first_point(problem, np.array([-1.0]), 3.0, StepControl(), -1.0)
    branch = trace(problem, start, (0.0, 3.0))
    assert branch.failed
    assert branch.points[-1].p == pytest.approx(1.0, abs=1e-3)


def test_fold_with_a_corner():
    problem = Kink()
    start = first_point(problem, np.array([-1.0]), 3.0, StepControl(), -1.0)
    branch = trace(problem, start, (0.0, 3.0))
    assert branch.ended == "range"
    assert branch.points[-1].u[0] == pytest.approx(5 / 3, rel=1e-9)
    assert fold(problem, branch, branch.folds[0]).p == pytest.approx(1.0, abs=1e-3)


@dataclass
class Ending(Circle):
    """The circle, with nothing defined beyond p = 0.7."""

    def at(self, u, p):
        if p > 0.7:
            raise ContinuationError("beyond the end")
        return super().at(u, p)


def test_failure_is_named_and_keeps_the_branch():
    problem = Ending()
    control = StepControl(first=0.1, smallest=1e-6)
    branch = trace(problem, first_point(problem, np.array([1.0]), 0.0, control), (-2, 2), control)
    assert branch.failed
    assert "beyond the end" in branch.ended
    assert len(branch.points) > 3
    assert branch.points[-1].p == pytest.approx(0.7, abs=1e-4)


def test_errors_are_named(tmp_path):
    problem = Circle()
    with pytest.raises(ContinuationError, match="no point near p = 3"):
        solve_at(problem, np.array([1.0]), 3.0, StepControl())
    start = first_point(problem, np.array([1.0]), 0.0, StepControl())
    ahead = advance(problem, start, 0.1, StepControl())
    with pytest.raises(ContinuationError, match="nothing to locate"):
        locate(problem, start, ahead, lambda point: 1.0)
    (tmp_path / "no.npz").write_bytes(b"nothing")
    with pytest.raises(ContinuationError, match="does not hold"):
        load_branch(tmp_path / "no.npz")


def test_observer_stops():
    problem = Circle()
    start = first_point(problem, np.array([1.0]), 0.0, StepControl())
    branch = trace(problem, start, (-2, 2), StepControl(), lambda point: point.p > 0.5)
    assert branch.ended == "stopped"
    assert branch.points[-1].p > 0.5 >= branch.points[-2].p


class Slider(Dense):
    """A slider on a soft spring, held by friction of one: ``k u + clip((u - h) / w, -1, 1) = p``."""

    k, h, w = 1e-4, 0.3, 1e-6
    knows = True

    def __init__(self, u, p):
        self.u = float(u[0])
        stuck = abs(self.u - self.h) < self.w
        friction = np.clip((self.u - self.h) / self.w, -1, 1)
        super().__init__([self.k * self.u + friction - p], [[self.k + stuck / self.w]], [-1.0])

    def corner(self, beyond):
        share = (self.h - self.u) / (beyond.u - self.u)
        return share if self.knows and 0 < share < 1 else None


@dataclass
class Sliding:
    """The same over the push p."""

    kind: type
    parameter_scale: float = 1.0
    weight = np.ones(1)

    def at(self, u, p):
        return self.kind(u, p)


@pytest.mark.parametrize("start", [500.0, -700.0])
def test_a_step_past_a_sharp_corner_is_taken_to_it(start):
    """Newton's method goes from one side of friction to the other and back, unless told where it holds."""
    control, push = StepControl(), 0.5
    u, _, steps = solve_at(Sliding(Slider), np.array([start]), push, control)
    held = (push + Slider.h / Slider.w) / (Slider.k + 1 / Slider.w)
    assert u[0] == pytest.approx(held, abs=1e-14)
    assert steps <= 5

    class Blind(Slider):
        knows = False

    with pytest.raises(ContinuationError, match="no point near"):
        solve_at(Sliding(Blind), np.array([start]), push, control)

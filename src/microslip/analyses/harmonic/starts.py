"""Guesses for harmonic balance whose contact states are known: other harmonics, a cycle over time.

Newton's method reads the contact states from the augmented force ``x = r + eps v(r)``. A guess of the
reactions alone gives it badly: the flexibility of the modes turns a small error of a high harmonic of r
into a large one of v, and the states that come of it are those of another motion. Where the
displacements are known as well, x is, and the first step is taken there,

    J(x) dr = -(r - C(x) - D(x) (x(r) - x)),

the equations linearised at x instead of at ``x(r)``; the steps after it are Newton's own. What x is:

- from fewer harmonics: that of the old answer, zero beyond. Contact answers it with reactions of all
  harmonics, ``r = C(x)``, those that the old equations left out among them;
- from a steady cycle of time integration: the harmonics of its reactions and displacements.

The augmentation. ``1/eps`` is the flexibility that the harmonics left out see. By default it is the residual
flexibility of a pair; where pairs open widely the modes carry them, and the flexibility of the harmonics left
out is up to some hundred times as large. With an augmentation that is too stiff the small displacements left
out are large augmented forces, and states change that should not: Newton's method does not converge. What the
left-out harmonics of a motion have is measured, ``|r_h| / |v_h|``.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, replace

import numpy as np

from microslip.analyses.harmonic.all_pairs import folded
from microslip.analyses.harmonic.equations import contact_at, evaluate_at
from microslip.analyses.harmonic.operator import linear_operator
from microslip.analyses.harmonic.paths import FrequencyPath
from microslip.analyses.harmonic.points import WALKS, HarmonicPoint
from microslip.analyses.harmonic.problem import HarmonicProblem, softened
from microslip.analyses.time.steady import SteadyState
from microslip.brief import Brief
from microslip.contact.pairs import STICK, tangential_vectors
from microslip.numerics.fourier import harmonic, to_real, without_drift
from microslip.typing import Array

FIRST_STEP = 1e-3
"""Relative residual to which the first step is solved."""

SOFTEST = 1e-3
"""Least augmentation over the default."""


@dataclass(frozen=True, repr=False)
class Start(Brief):
    """A guess of a response of some equations.

    Attributes
    ----------
    problem : HarmonicProblem
    w : (n,) array
        Unknowns.
    x : (d p, c) array
        Augmented forces that the contact states are read from.
    over_time : bool
        Whether it is a cycle of time integration.
    """

    problem: HarmonicProblem
    w: Array
    x: Array
    over_time: bool = False


def first_step(path: FrequencyPath, start: Start, frequency: float) -> Array:
    """Unknowns after one step of Newton's method with the contact states of the start.

    Parameters
    ----------
    path : FrequencyPath
        Of the problem of the start.
    start : Start
    frequency : float
        Hz.

    Raises
    ------
    ContinuationError
        Where the linearised equations are singular.
    """
    operator = linear_operator(start.problem, 2 * np.pi * frequency)
    point = evaluate_at(operator, path.load, start.w, start.x)
    return start.w + path.solver.linear_solve(operator, point.cycle, -point.F, FIRST_STEP)


def start_from_point(new: HarmonicProblem, point: HarmonicPoint) -> Start:
    """Start of the same equations with other harmonics, or another augmentation.

    Its bodies stand where those of the response do.
    """
    old, w = point.problem, point.w
    if new.half_turn and not old.half_turn:
        old, w = folded(old, new, w)
    new = replace(new, walks=old.walks, offset=old.offset, held=old.held)
    u, _ = old.split(w)
    x_old = u + new.stiffness[:, None] * point.v[new.rows]
    x = np.zeros(new.shape)
    keep = min(x.shape[1], x_old.shape[1])
    x[:, :keep] = x_old[:, :keep]
    p = w[u.size :]
    reactions = contact_at(new, x, p).r
    return Start(new, np.concatenate([reactions.ravel(), p]), x)


def start_from_cycle(problem: HarmonicProblem, steady: SteadyState) -> Start:
    """Start from a steady cycle of time integration, free to walk where that walks.

    Its bodies stand where those of the cycle do, and pairs that stick all through it are held there.
    Harmonics beyond a third of its steps are left at zero.
    """
    cycle = steady.cycle
    steps = steady.steps
    theta = steady.phase + 2 * np.pi * np.arange(steps + 1) / steps
    u = _coefficients(cycle.r[:, problem.rows], theta, problem.harmonics)
    v = _coefficients(without_drift(cycle.v, theta)[:, problem.rows], theta, problem.harmonics)
    drift = tangential_vectors(cycle.v[-1] - cycle.v[0], problem.dimension)
    span = float(np.ptp(tangential_vectors(cycle.v, problem.dimension), axis=0).max())
    walks = problem.slides > 0 and float(np.linalg.norm(np.median(drift, axis=0))) > WALKS * span
    problem = replace(problem, walks=walks)
    operator = linear_operator(problem, 2 * np.pi * steady.frequency)
    mean = v[:, 0] - operator.free(steady.load)[:, 0] + operator.flexibility(u)[:, 0]
    p = np.linalg.lstsq(problem.rigid_spread, mean, rcond=None)[0]
    own, offset = slice(len(p) - problem.slides, None), np.zeros_like(p)
    offset[own] = p[own] - problem.rest_place[own]
    problem = replace(problem, held=_held(problem, offset, steady))
    if walks:
        problem = replace(problem, offset=offset)
        sliding = problem.rigid_spread[:, own]
        along = tangential_vectors(sliding.T, problem.dimension).reshape(problem.slides, -1)
        p[own] = np.linalg.solve(along @ along.T, along @ drift[problem.pairs].ravel())
    x = u + problem.stiffness[:, None] * v
    return Start(problem, np.concatenate([u.ravel(), p]), x, over_time=True)


def _held(problem: HarmonicProblem, offset: Array, steady: SteadyState) -> Array:
    """Where pairs stick that stick all through a cycle, (p, d - 1), m; others where the bodies take them."""
    held = problem.held + tangential_vectors(problem.rigid_spread @ offset, problem.dimension)
    sticks = (steady.cycle.status[:, problem.pairs] == STICK).all(axis=0)
    slip = tangential_vectors(steady.cycle.v[:-1], problem.dimension).mean(axis=0)
    held[sticks] = slip[problem.pairs[sticks]]
    return held


def flexibility_of_cycle(problem: HarmonicProblem, steady: SteadyState) -> float:
    """Augmentation, over the problem's, of the flexibility that its left-out harmonics have in a cycle.

    ``|r_h| / |eps v_h|`` over the harmonics from H + 1 to 3 H (root of sums of squares).
    """
    cycle = steady.cycle
    steps = steady.steps
    theta = steady.phase + 2 * np.pi * np.arange(steps + 1) / steps
    most, first = 3 * problem.harmonics, problem.shape[1]
    u = _coefficients(cycle.r[:, problem.rows], theta, most)[:, first:]
    v = _coefficients(without_drift(cycle.v, theta)[:, problem.rows], theta, most)[:, first:]
    return _ratio(problem, u, v)


def flexibility_of_point(problem: HarmonicProblem, point: HarmonicPoint) -> float:
    """The same of the upper half of the harmonics that a response has."""
    u, _ = point.problem.split(point.w)
    first = 2 * max(point.harmonics // 2, 1) + 1
    return _ratio(problem, u[:, first:], point.v[problem.rows][:, first:])


def augmentations(measured: float) -> list[float]:
    """Augmentations to try over the default, from a measured one: the next half of a decade, its neighbours.

    Examples
    --------
    >>> [float(round(each, 3)) for each in augmentations(0.12)]
    [0.1, 0.316, 0.032]
    >>> [float(round(each, 3)) for each in augmentations(2.0)]
    [1.0, 0.316]
    """
    nearest = round(2 * np.log10(np.clip(measured, SOFTEST, 1.0)))
    return [10 ** (0.5 * k) for k in (nearest, nearest + 1, nearest - 1) if k <= 0]


def starts_from_cycle(problem: HarmonicProblem, steady: SteadyState) -> Iterator[Start]:
    """`start_from_cycle` with every augmentation to try, the likeliest first."""
    for factor in augmentations(flexibility_of_cycle(problem, steady)):
        yield start_from_cycle(softened(problem, factor), steady)


def starts_from_point(problem: HarmonicProblem, point: HarmonicPoint) -> Iterator[Start]:
    """`start_from_point` with every augmentation to try, the likeliest first."""
    for factor in augmentations(flexibility_of_point(problem, point)):
        yield start_from_point(softened(problem, factor), point)


def _ratio(problem: HarmonicProblem, u: Array, v: Array) -> float:
    moved = float(np.linalg.norm(problem.stiffness[:, None] * v))
    return float(np.linalg.norm(u)) / moved if moved > 0 else 1.0


def _coefficients(y: Array, theta: Array, harmonics: int) -> Array:
    """Coefficients (n, 2 H + 1) of samples (s + 1, n) over a period."""
    Y = np.zeros((harmonics + 1, y.shape[1]), dtype=complex)
    Y[0] = y[:-1].mean(axis=0)
    for h in range(1, min(harmonics, len(theta) // 3) + 1):
        Y[h] = harmonic(y, theta, h)
    return to_real(Y)

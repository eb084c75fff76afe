"""Random three-dimensional contact problems, harder than joints make them: friction to 1, paths that turn.

    for W, mu, loads in problems(seed, count): ...

W is symmetric positive definite, (3 m, 3 m), layout (normal, tangential, tangential) per pair; loads is
(steps, 3 m), the free relative displacement v_free of each step; pairs start sticking at zero tangential
displacement, history runs through the steps. For a positive definite W every one of these steps has
a solution.
"""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]


def layer(rng: np.random.Generator, m: int) -> Array:
    """Flexibility of an elastic layer under pairs strewn over a square, with some coupling of all."""
    x = rng.uniform(size=(m, 2))
    distance = np.linalg.norm(x[:, None] - x, axis=2)
    kernel = np.exp(-distance / rng.uniform(0.05, 0.7))
    W = np.zeros((3 * m, 3 * m))
    ratio = rng.uniform(0.5, 2, 2)
    for a, share in enumerate((1.0, ratio[0], rng.choice(ratio))):
        W[a::3, a::3] = share * kernel
    coupling = rng.normal(size=(3 * m, 3)) * rng.uniform(0, 1)
    return W + coupling @ coupling.T / 3 + 1e-3 * np.eye(3 * m)


def dense(rng: np.random.Generator, m: int) -> Array:
    """Flexibility without any order, well or badly conditioned."""
    A = rng.normal(size=(3 * m, 3 * m))
    return A @ A.T / (3 * m) + 10 ** rng.uniform(-4, 0) * np.eye(3 * m)


def problems(
    seed: int, count: int, steps: int = 100, most: int = 60
) -> Iterator[tuple[Array, float, Array]]:
    """Yield W, mu and the loads of one problem after another; every other one is a layer, the rest dense.

    Two loads at different phases and frequencies take every pair round a figure of its own, and every
    other problem has its pairs pulled apart on the way.
    """
    rng = np.random.default_rng(seed)
    for k in range(count):
        m = int(rng.integers(3, most))
        n = 3 * m
        W = layer(rng, m) if k % 2 else dense(rng, m)
        mu = 10 ** rng.uniform(-1.5, 0.0)
        base = np.zeros(n)
        base[::3] = W[::3, ::3].sum(1) * rng.uniform(0.2, 2)
        one, other = rng.normal(size=(2, n)) * rng.uniform(0.01, 0.5, (2, 1))
        theta = 0.13 * np.arange(steps)[:, None]
        path = (
            np.sin(theta) * one + np.sin(rng.integers(1, 4) * theta + rng.uniform(0, np.pi)) * other
        )
        opening = np.zeros(n)
        if k % 4 > 1:
            opening[::3] = rng.uniform(0, 1) * base[::3]
        noise = rng.uniform(0, 0.3) * rng.normal(size=(steps, n))
        yield W, mu, base + 10 * path - np.sin(0.05 * theta * theta) * opening + noise

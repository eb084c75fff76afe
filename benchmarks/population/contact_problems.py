"""Random planar contact problems, harder than joints make them: large jumps of load, friction to 2.

    for W, mu, loads in problems(seed, count): ...

W is symmetric positive definite, (2 m, 2 m), layout (normal, tangential) for each pair; `loads` is
(steps, 2 m), the free relative displacement of each step. Pairs start sticking at zero tangential
displacement, and history runs through the steps. The reactions of the constant part of the load
are of the order of 1. With a positive definite W every one of these steps has a solution
(Klarbring & Pang, SIAM J. Optim. 8 (1998) 381).
"""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]


def problems(seed: int, count: int, steps: int = 100) -> Iterator[tuple[Array, float, Array]]:
    """Yield W, mu and the loads of one problem after another; every other one is layer-like, the
    rest dense random."""
    draw = np.random.default_rng(seed)
    for number in range(count):
        m = int(draw.integers(3, 60))
        n = 2 * m
        if number % 2:
            x = np.linspace(0, 1, m)
            kernel = np.exp(-np.abs(x[:, None] - x) / draw.uniform(0.02, 0.5))
            W = np.zeros((n, n))
            W[::2, ::2] = kernel
            W[1::2, 1::2] = kernel * draw.uniform(0.5, 2)
            coupling = draw.normal(size=(n, 3)) * draw.uniform(0, 1)
            W += coupling @ coupling.T / 3 + 1e-3 * np.eye(n)
        else:
            A = draw.normal(size=(n, n))
            W = A @ A.T / n + 10 ** draw.uniform(-4, 0) * np.eye(n)
        mu = 10 ** draw.uniform(-1.5, 0.3)
        base = np.zeros(n)
        base[::2] = W[::2, ::2].sum(1) * draw.uniform(0.2, 2)
        direction = draw.normal(size=n) * draw.uniform(0.01, 0.5)
        noise = draw.uniform(0, 0.3)
        phase = np.sin(0.13 * np.arange(steps))
        yield W, mu, base + 10 * phase[:, None] * direction + noise * draw.normal(size=(steps, n))

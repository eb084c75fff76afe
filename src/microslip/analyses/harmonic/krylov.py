"""GMRES with a preconditioner that is kept from one linear system to the next while it serves."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field
from typing import Generic, Protocol, TypeVar

import numpy as np

from microslip.typing import Array


class Preconditioner(Protocol):
    """What solves the equations approximately."""

    def solve(self, right: Array) -> Array:
        """Approximate solution."""
        ...


Kind = TypeVar("Kind", bound=Preconditioner)


def gmres(
    apply: Callable[[Array], Array],
    precondition: Callable[[Array], Array],
    right: Array,
    allowed: float,
    limit: int,
) -> tuple[Array, int, float]:
    """GMRES without restarts, preconditioned from the right.

    Returns the solution, the iterations and the residual reached, `allowed` or more.
    """
    size = float(np.linalg.norm(right))
    if size <= allowed:
        return np.zeros_like(right), 0, size
    basis, directions = np.empty((limit + 1, right.size)), np.empty((limit, right.size))
    basis[0] = right / size
    R = np.zeros((limit, limit))
    rotations: list[tuple[float, float]] = []
    rest = np.zeros(limit + 1)
    rest[0] = size
    used = 0
    for j in range(limit):
        directions[j] = precondition(basis[j])
        w = apply(directions[j])
        share = np.zeros(j + 1)
        for _ in range(2):
            more = basis[: j + 1] @ w
            w = w - more @ basis[: j + 1]
            share += more
        length = float(np.linalg.norm(w))
        if not np.isfinite(length):
            return np.zeros_like(right), j + 1, np.inf
        # the new column of the Hessenberg matrix, turned by all Givens rotations
        for i, (cos, sin) in enumerate(rotations):
            share[i], share[i + 1] = (
                cos * share[i] + sin * share[i + 1],
                cos * share[i + 1] - sin * share[i],
            )
        diagonal = float(np.hypot(share[j], length))
        if diagonal == 0.0:
            break
        cos, sin = share[j] / diagonal, length / diagonal
        rotations.append((cos, sin))
        share[j] = diagonal
        R[: j + 1, j] = share
        rest[j], rest[j + 1] = cos * rest[j], -sin * rest[j]
        used = j + 1
        if abs(rest[used]) <= allowed or length <= 1e-14 * size:
            break
        basis[used] = w / length
    weights = np.linalg.solve(R[:used, :used], rest[:used])
    return weights @ directions[:used], used, abs(float(rest[used]))


@dataclass
class Counts:
    """Work of the solver.

    Attributes
    ----------
    krylov, factorisations : int
    """

    krylov: int = 0
    factorisations: int = 0


@dataclass
class Kept(Generic[Kind]):
    """The last preconditioner, until GMRES needs many more iterations with it than with a fresh one.

    Attributes
    ----------
    factor : Kind or None
    stale : bool
        Whether the next system gets a fresh one.
    counts : Counts
    """

    factor: Kind | None = None
    stale: bool = False
    counts: Counts = field(default_factory=Counts)
    _fresh_iterations: int = 0

    def solve(
        self,
        apply: Callable[[Array], Array],
        make: Callable[[], Kind],
        right: Array,
        allowed: float,
        limit: int,
        late: int,
    ) -> tuple[Array, float]:
        """Solution and residual reached; with a fresh preconditioner where that of the kept one is too large.

        Parameters
        ----------
        apply, make : callable
            The equations, and a preconditioner for them.
        right : (n,) array
        allowed : float
            Residual.
        limit, late : int
            Iterations at most; those more than with a fresh one after which it is made anew for the next
            system, and after twice as many for this one.
        """
        for _ in range(2):
            fresh = self.factor is None or self.stale
            if fresh:
                self.factor, self.stale = make(), False
                self.counts.factorisations += 1
            assert self.factor is not None
            most = limit if fresh else min(limit, self._fresh_iterations + 2 * late)
            with np.errstate(invalid="ignore", over="ignore"):
                x, iterations, error = gmres(apply, self.factor.solve, right, allowed, most)
            self.counts.krylov += iterations
            if fresh:
                self._fresh_iterations = iterations
            self.stale = iterations > self._fresh_iterations + late
            if error <= allowed or fresh:
                break
            self.stale = True
        return x, error

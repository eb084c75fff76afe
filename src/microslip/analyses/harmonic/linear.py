"""Linear systems of harmonic balance: exact derivative, Krylov solver, condensed factorisation.

The derivative of ``F(r) = r - C(r + eps (v_free - W r))`` is ``J = I - D (I - eps W)``, with ``D`` block
diagonal over pairs (from the contact cycle) and ``W`` block diagonal over harmonics. Neither structure
survives in the product, but most components are simple at any moment:

    open all cycle           D = 0:  z = y
    touching, stuck all      D = 1:  eps W z = y     linear, harmonic by harmonic
    changing                 D dense over the harmonics of its pair

Open components drop out, linear ones are eliminated by a Schur complement per harmonic, and only the
changing ones couple through a dense real matrix, which is factorised. Which component is simple is
found out anew at every evaluation. The factorisation, `Condensed`, is kept as a preconditioner of GMRES
for later iterations, frequencies and loads, and renewed when GMRES needs many iterations.
"""

from __future__ import annotations

import warnings
from collections.abc import Callable
from dataclasses import dataclass, field
from typing import Any

import numpy as np
import scipy.linalg as sl
from numpy.typing import NDArray

from microslip.analyses.harmonic.equations import derivative_times
from microslip.analyses.harmonic.operator import LinearOperator
from microslip.contact.aft import CHANGING, LINEAR, ContactCycle, times_derivative
from microslip.numerics.continuation import ContinuationError
from microslip.numerics.fourier import to_complex, to_real
from microslip.typing import Array, Complex

RENEW_AFTER = 12
"""A factorisation is made anew when GMRES needs so many iterations more than with a fresh one."""

MAX_KRYLOV = 80

COUPLED = 2500
"""Unknowns of the coupled factorisation at most, unless that leaves out low harmonics."""

LEAST_COUPLED = 3


class Condensed:
    """Inverse of the derivative at one evaluation, simple components condensed.

    Exact but for the single precision of the dense factors, and where it would be too large: then
    the high harmonics are taken one by one, without their coupling. The mean amplitudes of the
    nearly rigid modes are kept beside the changing components.

    Parameters
    ----------
    operator : LinearOperator
    cycle : ContactCycle
    """

    def __init__(self, operator: LinearOperator, cycle: ContactCycle) -> None:
        problem = operator.problem
        kind = cycle.kind.ravel()
        self.operator = operator
        self.cycle = cycle
        self.linear = np.flatnonzero(kind == LINEAR)
        self.changing = np.flatnonzero(kind == CHANGING)
        self.factors: list[Any] = []
        self.K: list[Complex] = []
        self.left: list[Complex] = []
        once = problem.once
        S: list[Complex] = []
        L, N = self.linear, self.changing
        for h in range(problem.harmonics + 1):
            W = operator.dense(h)
            if h == 0:
                W = np.ascontiguousarray(W.real)
            factor = sl.lu_factor(W[np.ix_(L, L)], check_finite=False)
            W_LN = W[np.ix_(L, N)]
            K = sl.lu_solve(factor, W_LN, check_finite=False)
            self.factors.append(factor)
            self.K.append(K)
            # W_NL W_LL^-1: the transpose of K, but the middle pair counts once and others twice
            self.left.append((K * once[L, None] / once[N]).T)
            S.append(W[np.ix_(N, N)] - W[np.ix_(N, L)] @ K)
        self.spread = problem.rigid_spread.copy()
        self.stiffness = problem.rigid_stiffness.copy()
        if problem.walks:
            self.spread[:, -1] = self.stiffness[:, -1] = 0.0
        self.linear_of_q = sl.lu_solve(self.factors[0], self.spread[L], check_finite=False)
        fitting = (COUPLED // max(len(N), 1) - 1) // 2
        coupled = min(max(fitting, LEAST_COUPLED), problem.harmonics)
        self.groups = [range(coupled + 1)]
        self.groups += [range(h, h + 1) for h in range(coupled + 1, problem.harmonics + 1)]
        # Single precision is enough for a preconditioner, and twice as fast.
        with warnings.catch_warnings():
            # a singular factor shows as a result that is not finite
            warnings.simplefilter("ignore", sl.LinAlgWarning)
            self.lu = [
                sl.lu_factor(self._assemble(S, group), overwrite_a=True, check_finite=False)
                for group in self.groups
            ]

    def _assemble(self, S: list[Complex], group: range) -> NDArray[np.float32]:
        """Matrix over changing components by the coefficients of some harmonics, then q.

        ``I - D_NN (I - eps S) + D_NL K`` beside ``-(D_NN eps R_S + D_NL W_LL^-1 R_L)``, with
        ``R_S = R_N - W_NL W_LL^-1 R_L``; below, the equilibrium of the nearly rigid modes.
        """
        N, L, cycle, problem = self.changing, self.linear, self.cycle, self.operator.problem
        own = _coefficients(group)
        mean = group[0] == 0
        n, c, e = len(N), own.stop - own.start, problem.rigid_modes.shape[1] if mean else 0
        eps = problem.stiffness
        # derivative of the augmented force x by (z_N, q), for changing and for linear components
        of_changing = _columns([np.eye(n) - eps[N, None] * S[h] for h in group], mean, n, c, e)
        of_linear = _columns([-self.K[h] for h in group], mean, len(L), c, e)
        M = np.eye(n * c + e, dtype=np.float32)
        if mean:
            R_S = self.spread[N] - self.left[0] @ self.spread[L]
            R_below = problem.rigid_gather[N] - self.K[0].T @ problem.rigid_gather[L]
            of_changing[:, 0, n * c :] = eps[N, None] * R_S
            of_linear[:, 0, n * c :] = self.linear_of_q
            M[n * c :, : n * c : c] = problem.spring * R_below.T
            stiffness = problem.rigid_gather[L].T @ self.linear_of_q + self.stiffness
            M[n * c :, n * c :] = problem.spring * stiffness
        row_of = np.zeros(len(problem.rows), dtype=np.int64)
        row_of[N], row_of[L] = np.arange(n), np.arange(len(L))
        changing = cycle.kind.ravel() == CHANGING
        rows = M[: n * c].reshape(n, c, n * c + e)
        for k, component in enumerate(N):
            pair, tangential = divmod(int(component), 2)
            if not tangential:
                rows[k] -= cycle.nn[pair, own, own] @ of_changing[k]
                continue
            rows[k] -= cycle.tt[pair, own, own] @ of_changing[k]
            normal = component - 1
            source = of_changing if changing[normal] else of_linear
            rows[k] -= cycle.tn[pair, own, own] @ source[row_of[normal]]
            if mean and problem.walks:
                drift = eps[component] * problem.rigid_spread[component, -1]
                rows[k, :, -1] -= cycle.td[pair, own] * drift
        return M

    def solve(self, right: Array) -> Array:
        """``J^-1 right`` at the evaluation of the factorisation."""
        L, N, cycle, problem = self.linear, self.changing, self.cycle, self.operator.problem
        cut = problem.shape[0] * problem.shape[1]
        y, y_q = right[:cut].reshape(problem.shape), right[cut:]
        eps = problem.stiffness
        z = y.copy()
        z[L] = 0.0
        z[N] = 0.0
        g = self.operator.flexibility(z)
        g_q = problem.spring * (problem.rigid_gather.T @ z[:, 0])
        c_L = to_complex(y[L] / eps[L, None] - g[L])
        g_N = to_complex(g[N])
        z_L = np.empty_like(c_L)
        for h, factor in enumerate(self.factors):
            part = c_L[h].real if h == 0 else c_L[h]
            z_L[h] = sl.lu_solve(factor, part, check_finite=False)
            g_N[h] += self.left[h] @ c_L[h]
        linear = to_real(z_L)
        x = np.zeros_like(y)
        x[N] = -eps[N, None] * to_real(g_N)
        x[L] = linear - y[L]
        out = np.empty_like(cycle.r)
        times_derivative(cycle.nn, cycle.tn, cycle.tt, x.reshape(out.shape), out)
        below = y_q - g_q - problem.spring * (problem.rigid_gather[L].T @ linear[:, 0])
        known = y[N] + out.reshape(y.shape)[N]
        q = y_q
        for group, lu in zip(self.groups, self.lu, strict=True):
            own = _coefficients(group)
            part = known[:, own].ravel()
            if group[0] == 0:
                part = np.concatenate([part, below])
            solved = sl.lu_solve(
                lu, part.astype(np.float32), overwrite_b=True, check_finite=False
            ).astype(float)
            size = len(N) * (own.stop - own.start)
            z[N, own] = solved[:size].reshape(len(N), own.stop - own.start)
            if group[0] == 0:
                q = solved[size:]
        Z = to_complex(z[N])
        for h, K in enumerate(self.K):
            z_L[h] -= K @ Z[h]
        z[L] = to_real(z_L)
        z[L, 0] += self.linear_of_q @ q
        return np.concatenate([z.ravel(), q])


def _coefficients(group: range) -> slice:
    """Real coefficients of consecutive harmonics."""
    return slice(max(2 * group[0] - 1, 0), 2 * group[-1] + 1)


def _columns(blocks: list[Complex], mean: bool, rows: int, c: int, extra: int) -> Array:
    """Complex blocks of consecutive harmonics as real ones, (rows, c, columns c + extra)."""
    columns = blocks[0].shape[1]
    out = np.zeros((rows, c, columns * c + extra), dtype=np.float32)
    inner = out[:, :, : columns * c]
    if mean:
        inner[:, 0, ::c] = blocks[0].real
    for k, block in enumerate(blocks[1:] if mean else blocks):
        s = 2 * k + int(mean)
        inner[:, s, s::c] = block.real
        inner[:, s + 1, s + 1 :: c] = block.real
        inner[:, s, s + 1 :: c] = -block.imag
        inner[:, s + 1, s::c] = block.imag
    return out


def gmres(
    apply: Callable[[Array], Array],
    precondition: Callable[[Array], Array],
    right: Array,
    tolerance: float,
    limit: int,
) -> tuple[Array, int, float]:
    """GMRES without restarts, preconditioned from the right.

    Returns the solution, the iterations and the relative residual reached.
    """
    shape = right.shape
    size = float(np.linalg.norm(right))
    if size == 0:
        return np.zeros(shape), 0, 0.0
    basis = np.empty((limit + 1, right.size))
    basis[0] = right.ravel() / size
    directions = []
    H = np.zeros((limit + 1, limit))
    error, j = 1.0, 0
    for j in range(1, limit + 1):
        direction = precondition(basis[j - 1].reshape(shape))
        directions.append(direction)
        w = apply(direction).ravel()
        if not np.isfinite(w).all():
            return np.zeros(shape), j, np.inf
        for _ in range(2):
            share = basis[:j] @ w
            w = w - share @ basis[:j]
            H[:j, j - 1] += share
        H[j, j - 1] = np.linalg.norm(w)
        first = np.zeros(j + 1)
        first[0] = size
        weights, *_ = np.linalg.lstsq(H[: j + 1, :j], first, rcond=None)
        error = float(np.linalg.norm(H[: j + 1, :j] @ weights - first)) / size
        if error <= tolerance or H[j, j - 1] <= 1e-14 * size:
            break
        basis[j] = w / H[j, j - 1]
    return np.tensordot(weights, directions, axes=1), j, error


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
class HarmonicSolver:
    """Keeps the last factorisation from one point to the next; the answers do not depend on it.

    Attributes
    ----------
    counts : Counts
    """

    counts: Counts = field(default_factory=Counts)
    _factor: Condensed | None = None
    _stale: bool = False
    _fresh_iterations: int = 0

    def linear_solve(
        self, operator: LinearOperator, cycle: ContactCycle, right: Array, tolerance: float
    ) -> Array:
        """Solve ``J z = right``.

        Raises
        ------
        ContinuationError
            Where even a fresh factorisation does not solve it: the derivative is singular.
        """
        for _ in range(2):
            if self._factor is None or self._stale or not self._fits(operator):
                self._factor = Condensed(operator, cycle)
                self._stale = False
                self.counts.factorisations += 1
                fresh = True
            else:
                fresh = False
            with np.errstate(invalid="ignore", over="ignore"):
                z, iterations, error = gmres(
                    lambda x: derivative_times(operator, cycle, x),
                    self._factor.solve,
                    right,
                    tolerance,
                    MAX_KRYLOV,
                )
            self.counts.krylov += iterations
            if fresh:
                self._fresh_iterations = iterations
            self._stale = iterations > self._fresh_iterations + RENEW_AFTER
            if error <= tolerance or fresh:
                break
            self._stale = True
        if not error <= 0.5:
            raise ContinuationError(f"the linearised equations are singular (error {error:.1e})")
        return z

    def _fits(self, operator: LinearOperator) -> bool:
        assert self._factor is not None
        old = self._factor.operator.problem
        new = operator.problem
        return old.table is new.table and old.residual is new.residual and old.walks == new.walks

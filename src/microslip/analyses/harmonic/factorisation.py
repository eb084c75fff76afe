"""Approximate inverse of the condensed equations of harmonic balance, a preconditioner for GMRES."""

from __future__ import annotations

import numpy as np
import scipy.linalg as sl
from numpy.typing import NDArray

from microslip.analyses.harmonic.condensed import CoupledEquations
from microslip.contact.pairs import tangential_vectors
from microslip.typing import Array, Complex

COUPLED = 4500
"""Unknowns of the coupled factorisation at most, unless that leaves out low harmonics."""

LEAST_COUPLED = 3


class Factorisation:
    """Approximate inverse of the condensed derivative: dense factors in single precision.

    Where they would be too large the high harmonics are taken one by one, without their coupling.

    Parameters
    ----------
    equations : CoupledEquations
    """

    def __init__(self, equations: CoupledEquations) -> None:
        problem = equations.problem
        self.sets = equations.sets
        self.shape = equations.shape
        n = self.shape[0]
        fitting = (COUPLED // max(n, 1) - 1) // 2
        coupled = min(max(fitting, LEAST_COUPLED), problem.harmonics)
        self.groups = [range(coupled + 1)]
        self.groups += [range(h, h + 1) for h in range(coupled + 1, problem.harmonics + 1)]
        self.lu = []
        for group in self.groups:
            # rows become columns, as LAPACK has them, and the transposed system is solved
            matrix = _matrix(equations, group)
            # LAPACK complains of no unknowns on the terminal
            if not matrix.size:
                self.lu.append((matrix, np.empty(0, dtype=np.int32)))
                continue
            lu, pivots, _ = sl.lapack.sgetrf(matrix.T, overwrite_a=True)
            self.lu.append((lu, pivots))

    def solve(self, right: Array) -> Array:
        """Approximate solution of the condensed equations."""
        n, c = self.shape
        known, out = right[: n * c].reshape(n, c), np.empty_like(right)
        z, q = out[: n * c].reshape(n, c), out[n * c :]
        for group, (lu, pivots) in zip(self.groups, self.lu, strict=True):
            own = _coefficients(group)
            part = known[:, own].ravel()
            if group[0] == 0:
                part = np.concatenate([part, right[n * c :]])
            if len(part) == 0:
                continue
            solved, _ = sl.lapack.sgetrs(lu, pivots, part.astype(np.float32), trans=1)
            size = n * (own.stop - own.start)
            z[:, own] = solved[:size].reshape(n, own.stop - own.start)
            if group[0] == 0:
                q[:] = solved[size:]
        return out


def _matrix(equations: CoupledEquations, group: range) -> NDArray[np.float32]:
    """Matrix over coupled components by the coefficients of some harmonics, then q."""
    sets, cycle, problem = equations.sets, equations.cycle, equations.problem
    lag, G = equations.operator.lag, equations.resonator.G
    own, mean = _coefficients(group), group[0] == 0
    N, pushing = sets.coupled, sets.pushing
    n, c = len(N), own.stop - own.start
    e = problem.rigid_modes.shape[1] if mean else 0
    eps = problem.stiffness[N, None]
    # derivative of the augmented force x by (z_N, q), of coupled and of pushing components
    S, K = [], []
    for h in group:
        s = h % 2
        eta = G[h] @ sets.Y[s].T
        S.append(np.eye(n) - eps * (lag[h] * sets.A[s] + sets.X[s] @ eta))
        K.append(-sets.P[s, pushing] - sets.B[s, pushing] @ eta / lag[h])
    of_coupled = _columns(S, mean, n, c, e)
    of_linear = _columns(K, mean, len(pushing), c, e)
    M = np.eye(n * c + e, dtype=np.float32)
    if mean:
        _rigid_columns(equations, M, of_coupled, of_linear)
    row_of = np.full(len(problem.rows), -1)
    row_of[N] = np.arange(n)
    row_of[sets.linear[pushing]] = np.arange(len(pushing))
    walk = tangential_vectors(problem.rigid_spread[:, problem.walking].T, problem.dimension)
    walk = walk.transpose(1, 2, 0)
    coupled = np.zeros(len(problem.rows), dtype=bool)
    coupled[N] = True
    single = [np.asarray(each[..., own, own], dtype=np.float32) for each in cycle[1:4]]
    rows = M[: n * c].reshape(n, c, n * c + e)
    d = problem.dimension
    for k, component in enumerate(N):
        pair, direction = divmod(int(component), d)
        nn, tn, tt = (each[pair] for each in single)
        if direction == 0:
            rows[k] -= nn @ of_coupled[k]
            continue
        for b in range(1, d):
            rows[k] -= tt[direction - 1, b - 1] @ of_coupled[row_of[d * pair + b]]
        pressing = d * pair
        if row_of[pressing] >= 0:
            source = of_coupled if coupled[pressing] else of_linear
            rows[k] -= tn[direction - 1] @ source[row_of[pressing]]
        if mean and problem.walks:
            drift = problem.along[pair, :, None] * walk[pair]
            rows[k, :, -drift.shape[1] :] -= cycle.td[pair, direction - 1, :, own].T @ drift
    return M


def _rigid_columns(
    equations: CoupledEquations,
    M: NDArray[np.float32],
    of_coupled: NDArray[np.float32],
    of_linear: NDArray[np.float32],
) -> None:
    """Columns of q and the rows of its equilibrium."""
    sets, problem = equations.sets, equations.problem
    e, c = problem.rigid_modes.shape[1], of_coupled.shape[1]
    if e == 0:
        return
    N, L = sets.coupled, sets.linear
    G = equations.resonator.G[0].real
    eta = G @ sets.rigid_modes
    of_coupled[:, 0, -e:] = problem.stiffness[N, None] * (sets.rigid - sets.X[0] @ eta)
    of_q = sets.rigid_linear - sets.B[0] @ eta
    of_linear[:, 0, -e:] = of_q[sets.pushing]
    of_z = sets.P[0] + sets.B[0] @ (G @ sets.Y[0].T)
    gather = problem.rigid_gather
    M[-e:, : len(N) * c : c] = problem.spring * (gather[N].T - gather[L].T @ of_z)
    M[-e:, -e:] = problem.spring * (gather[L].T @ of_q + equations.rigid_stiffness())


def _coefficients(group: range) -> slice:
    """Real coefficients of consecutive harmonics."""
    return slice(max(2 * group[0] - 1, 0), 2 * group[-1] + 1)


def _columns(
    blocks: list[Complex], mean: bool, rows: int, c: int, extra: int
) -> NDArray[np.float32]:
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

"""The linearised equations of harmonic balance on those components alone whose state changes.

The derivative of ``F(r) = r - C(r + eps (v_free + R q - W r))`` is ``J = I - D (I - eps W)`` beside the
equilibrium of the nearly rigid modes, with ``D`` block diagonal over pairs (from the contact cycle) and ``W``
block diagonal over harmonics, ``W_h = lag_h A + Psi diag(m_h) Gamma^T``. Three kinds of components,

    open all cycle           D = 0:  z = y
    touching, stuck all      D = 1:  W z - R q = y / eps =: c       harmonic by harmonic
    the others, `coupled`    D dense over the harmonics of its pair

The second kind is eliminated. With ``eta`` the amplitudes of the modes,

    z_L = A_LL^-1 (c_L - Psi_L eta) / lag - A_LL^-1 A_LN z_N
    (1/m + C / lag) eta = Y^T z_N + Gamma_L^T A_LL^-1 c_L / lag,      C = Gamma_L^T A_LL^-1 Psi_L
    (W z)_N = lag A_S z_N + X eta + A_NL A_LL^-1 c_L

the real matrices ``A_S``, X, Y and C depend on the kinds alone (`Elimination`), and the frequency enters
through small matrices ``G_h = (1/m + C/lag)^-1`` over the modes (`Resonator`); m is a matrix where damping
couples them. A set of coupled components that is larger than needed is as good, so that it can stay for a
while.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import scipy.linalg as sl
from numpy.typing import NDArray

from microslip.analyses.harmonic.operator import LinearOperator, by_parity
from microslip.analyses.harmonic.problem import HarmonicProblem
from microslip.brief import Brief
from microslip.contact.aft import (
    CHANGING,
    LINEAR,
    OPEN,
    ContactCycle,
    along_drift,
    times_derivative,
)
from microslip.numerics.fourier import EVEN, ODD, to_complex, to_real
from microslip.typing import Array, Complex, Indices

SINGULAR = 1e-11
"""Smallest eigenvalue of the residual flexibility over its largest: below, it is not inverted alone."""

NEIGHBOURS = 2
"""Pairs on either side of a changing one that are coupled with it when a set is made."""

WORTH = 0.95
"""A set is made anew, where a factorisation is, if it shrinks to less than this share."""

Particular = tuple[Array, Array]
"""Coefficients of all components, open ones alone not zero, and of the linear ones."""


@dataclass(frozen=True, repr=False)
class Elimination(Brief):
    """Sets of components and what eliminating the linear ones leaves; arrays (2, ...) by parity.

    Attributes
    ----------
    linear, coupled, open : int arrays
        Components.
    pushing : int array
        Linear components, as places in `linear`, on which the friction of a coupled one depends.
    share : (k,) array
        Static share of every mode that `A` contains; zero unless the residual flexibility is singular.
    inverse : (2, l, l) array
        ``A_LL^-1``.
    A : (2, n, n) array
        ``A_S``.
    X, Y : (2, n, k) arrays
    C : (2, k, k) array
    P, B : (2, l, n) and (2, l, k) arrays
        ``A_LL^-1 A_LN`` and ``A_LL^-1 Psi_L``.
    back : (2, n, l) array
        ``A_NL A_LL^-1``.
    gather : (2, k, l) array
        ``Gamma_L^T A_LL^-1``.
    rigid, rigid_linear : (n, f) and (l, f) arrays
        ``R_N - A_NL A_LL^-1 R_L`` and ``A_LL^-1 R_L``, in the mean.
    rigid_modes : (k, f) array
        ``Gamma_L^T A_LL^-1 R_L``, in the mean.
    """

    linear: Indices
    coupled: Indices
    open: Indices
    pushing: Indices
    share: Array
    inverse: Array
    A: Array
    X: Array
    Y: Array
    C: Array
    P: Array
    B: Array
    back: Array
    gather: Array
    rigid: Array
    rigid_linear: Array
    rigid_modes: Array

    def holds(self, cycle: ContactCycle) -> bool:
        """Whether its sets are right for a cycle: what changes is coupled."""
        kind = cycle.kind.ravel()
        return bool((kind[self.linear] == LINEAR).all() and (kind[self.open] == OPEN).all())

    def spares(self, cycle: ContactCycle) -> bool:
        """Whether a set made anew for a cycle would be so much smaller that it is worth it."""
        return int(coupled_components(cycle).sum()) < WORTH * len(self.coupled)


def coupled_components(cycle: ContactCycle) -> NDArray[np.bool_]:
    """Whether each component, (d p,), changes or stands beside one that does (`NEIGHBOURS`).

    Examples
    --------
    One pair of nine changes, and two on either side of it are coupled with it:

    >>> from microslip.contact.aft import contact_cycle
    >>> from microslip.contact.samples import sample_table
    >>> x = np.zeros((9, 2, 3)); x[:, 0, 0] = 1.0; x[4, 0, 1] = 2.0
    >>> cycle = contact_cycle(sample_table(1, 16), x, np.zeros(9), np.zeros((9, 1)))
    >>> np.flatnonzero(coupled_components(cycle)).tolist()
    [4, 6, 8, 10, 12]
    """
    changing = cycle.kind == CHANGING
    near = changing.copy()
    for step in range(1, NEIGHBOURS + 1):
        near[step:] |= changing[:-step]
        near[:-step] |= changing[step:]
    return near.ravel()


def eliminate(problem: HarmonicProblem, cycle: ContactCycle, share: Array) -> Elimination:
    """Couple the components that change and their neighbours, eliminate the other linear ones.

    `share` is that of `static_share`.
    """
    kind, near = cycle.kind.ravel(), coupled_components(cycle)
    linear = np.flatnonzero((kind == LINEAR) & ~near)
    idle = np.flatnonzero((kind == OPEN) & ~near)
    N, L = np.flatnonzero(near), linear
    place = np.full(len(near), -1)
    place[L] = np.arange(len(L))
    pressing = N - N % problem.dimension
    pushing = place[np.unique(pressing[pressing < N])]
    parts = []
    for A, psi, gamma in zip(problem.residual, problem.spread, problem.gather, strict=True):
        A = A + (psi * share) @ gamma.T if share.any() else A
        inverse = sl.inv(A[np.ix_(L, L)], check_finite=False) if len(L) else np.zeros((0, 0))
        back, gathered = A[np.ix_(N, L)] @ inverse, gamma[L].T @ inverse
        P = inverse @ A[np.ix_(L, N)]
        parts.append(
            (
                inverse,
                A[np.ix_(N, N)] - A[np.ix_(N, L)] @ P,
                psi[N] - back @ psi[L],
                gamma[N] - P.T @ gamma[L],
                gathered @ psi[L],
                P,
                inverse @ psi[L],
                back,
                gathered,
            )
        )
    inverse, A_S, X, Y, C, P, B, back, gather = (
        np.stack(list(each)) for each in zip(*parts, strict=True)
    )
    R = problem.rigid_spread.copy()
    R[:, problem.walking] = 0.0
    return Elimination(
        linear=L,
        coupled=N,
        open=idle,
        pushing=pushing[pushing >= 0],
        share=share,
        inverse=inverse,
        A=A_S,
        X=X,
        Y=Y,
        C=C,
        P=P,
        B=B,
        back=back,
        gather=gather,
        rigid=R[N] - back[0] @ R[L],
        rigid_linear=inverse[0] @ R[L],
        rigid_modes=gather[0] @ R[L],
    )


def static_share(problem: HarmonicProblem) -> Array:
    """Static compliance of every mode, (k,), that joins the residual flexibility where that is singular."""
    size = np.linalg.eigvalsh(problem.model.residual + np.diag(problem.compliance))
    share = np.zeros(len(problem.model.omega))
    if size[0] < SINGULAR * size[-1]:
        flexible = slice(problem.model.equilibrium_modes, None)
        share[flexible] = 1 / problem.model.omega[flexible] ** 2
    return share


class Resonator:
    """The modes of the joint with its linear components held, at one frequency: ``G_h``.

    Parameters
    ----------
    operator : LinearOperator
    sets : Elimination
    """

    def __init__(self, operator: LinearOperator, sets: Elimination) -> None:
        self.modal = operator.modal
        self.lag = operator.lag
        k, coupled = operator.modal.shape[1], operator.modal.ndim == 3
        m = operator.modal - (
            np.diag(sets.share) * operator.lag[:, None, None]
            if coupled
            else sets.share * operator.lag[:, None]
        )
        G = np.empty((len(m), k, k), dtype=complex)
        for own, C in ((EVEN, sets.C[0]), (ODD, sets.C[1])):
            held = m[own] @ C if coupled else m[own, :, None] * C
            G[own] = held / self.lag[own, None, None]
        G += np.eye(k)
        self.G = np.linalg.solve(G, m if coupled else m[:, :, None] * np.eye(k))

    def fits(self, operator: LinearOperator) -> bool:
        """Whether it is that of an operator."""
        return bool(
            (operator.lag == self.lag).all()
            and operator.modal.shape == self.modal.shape
            and (operator.modal == self.modal).all()
        )

    def amplitudes(self, forces: Array) -> Complex:
        """Amplitudes eta, (H + 1, k), under coefficients (k, c) of modal forces."""
        return np.asarray((self.G @ to_complex(forces)[:, :, None])[:, :, 0])


class CoupledEquations:
    """``J z = y`` at one evaluation, condensed to the coupled components and q.

    Parameters
    ----------
    operator : LinearOperator
    cycle : ContactCycle
    sets : Elimination
    resonator : Resonator
    """

    def __init__(
        self,
        operator: LinearOperator,
        cycle: ContactCycle,
        sets: Elimination,
        resonator: Resonator,
    ) -> None:
        problem = operator.problem
        self.operator, self.cycle, self.sets = operator, cycle, sets
        self.resonator = resonator
        self.problem = problem
        self.shape = len(sets.coupled), problem.shape[1]
        self.eps = problem.stiffness
        self._x = np.zeros(problem.shape)
        self._out = np.empty_like(cycle.r)
        self._pushing = sets.linear[sets.pushing]
        P, B = sets.P[:, sets.pushing], sets.B[:, sets.pushing]
        self._of_reactions = np.concatenate([sets.A, P, sets.Y.transpose(0, 2, 1)], axis=1)
        self._of_modes = np.concatenate([sets.X, B], axis=1)

    def apply(self, unknown: Array) -> Array:
        """The condensed derivative along the coupled reactions, component by component, and q."""
        sets, problem = self.sets, self.problem
        n, c = self.shape
        z, q = unknown[: n * c].reshape(n, c), unknown[n * c :]
        lag, pushes = self.operator.lag[:, None], n + len(sets.pushing)
        of_reactions = by_parity(self._of_reactions, z)
        forces = of_reactions[pushes:]
        forces[:, 0] += sets.rigid_modes @ q
        eta = to_real(self.resonator.amplitudes(forces))
        of_modes = by_parity(self._of_modes, eta)
        v = to_real(to_complex(of_reactions[:n]) * lag) + of_modes[:n]
        v[:, 0] -= sets.rigid @ q
        x = self._x
        x[sets.coupled] = z - self.eps[sets.coupled, None] * v
        pushed = -of_reactions[n:pushes] - to_real(to_complex(of_modes[n:]) / lag)
        pushed[:, 0] += sets.rigid_linear[sets.pushing] @ q
        x[self._pushing] = pushed
        times_derivative(
            self.cycle.nn, self.cycle.tn, self.cycle.tt, x.reshape(self._out.shape), self._out
        )
        if problem.walks:
            self._out[:, 1:] += along_drift(self.cycle, problem.along * problem.drift(q))
        top = z - self._out.reshape(problem.shape)[sets.coupled]
        mean = -sets.P[0] @ z[:, 0] - sets.B[0] @ eta[:, 0] + sets.rigid_linear @ q
        below = problem.rigid_gather[sets.coupled].T @ z[:, 0]
        below += problem.rigid_gather[sets.linear].T @ mean
        below += self.rigid_stiffness() @ q
        return np.concatenate([top.ravel(), problem.spring * below])

    def rigid_stiffness(self) -> Array:
        """Stiffness of the supports against q; none against the mean of a joint that walks."""
        stiffness = self.problem.rigid_stiffness
        if self.problem.walks:
            stiffness = stiffness.copy()
            stiffness[:, self.problem.walking] = 0.0
        return stiffness

    def condense(self, right: Array) -> tuple[Array, Particular]:
        """Right side of the condensed equations, and the other components without the coupled ones."""
        sets, problem = self.sets, self.problem
        L, N = sets.linear, sets.coupled
        cut = problem.shape[0] * problem.shape[1]
        y, y_q = right[:cut].reshape(problem.shape), right[cut:]
        z_open = np.zeros_like(y)
        z_open[sets.open] = y[sets.open]
        target = y[L] / self.eps[L, None]
        v = np.zeros(self.shape)
        if z_open.any():
            pushed = self.operator.flexibility(z_open)
            target -= pushed[L]
            v += pushed[N]
        over_lag = to_real(to_complex(target) / self.operator.lag[:, None])
        eta = self.resonator.amplitudes(by_parity(sets.gather, over_lag))
        lagging = to_real(eta / self.operator.lag[:, None])
        z_L = by_parity(sets.inverse, over_lag) - by_parity(sets.B, lagging)
        v += by_parity(sets.back, target) + by_parity(sets.X, to_real(eta))
        x = np.zeros_like(y)
        x[N] = -self.eps[N, None] * v
        x[L] = z_L - y[L]
        times_derivative(
            self.cycle.nn, self.cycle.tn, self.cycle.tt, x.reshape(self._out.shape), self._out
        )
        top = y[N] + self._out.reshape(y.shape)[N]
        mean = problem.rigid_gather[L].T @ z_L[:, 0]
        mean += problem.rigid_gather[sets.open].T @ z_open[sets.open, 0]
        below = y_q - problem.spring * mean
        return np.concatenate([top.ravel(), below]), (z_open, z_L)

    def restore(self, unknown: Array, particular: Particular) -> Array:
        """All unknowns from the coupled ones."""
        sets = self.sets
        n, c = self.shape
        z, q = unknown[: n * c].reshape(n, c), unknown[n * c :]
        forces = by_parity(sets.Y.transpose(0, 2, 1), z)
        forces[:, 0] += sets.rigid_modes @ q
        lagging = to_real(self.resonator.amplitudes(forces) / self.operator.lag[:, None])
        out, z_L = particular[0].copy(), particular[1].copy()
        z_L -= by_parity(sets.P, z) + by_parity(sets.B, lagging)
        z_L[:, 0] += sets.rigid_linear @ q
        out[sets.coupled], out[sets.linear] = z, z_L
        return np.concatenate([out.ravel(), q])

    def coupled_part(self, w: Array) -> Array:
        """The coupled reactions and q of all unknowns."""
        cut = self.problem.shape[0] * self.problem.shape[1]
        u = w[:cut].reshape(self.problem.shape)
        return np.concatenate([u[self.sets.coupled].ravel(), w[cut:]])

"""Stability of a steady state: Floquet multipliers of largest modulus.

A small deviation from a periodic motion becomes, one period of the load later, its image under the
linearised period map; the eigenvalues mu of that map are the Floquet multipliers. The motion is
stable where all lie inside the unit circle. Multipliers of a linear joint are those of its modes,

    mu = exp((-zeta omega +- i omega_d) T)

Two ways to them, both projections of the map on a few directions:

- `SteadyState.multipliers`: from what a search for the steady state has learned of the map. Free, and
  rough: it was learned on the way there.
- `floquet_multipliers`: Arnoldi's method (Saad, Numerical Methods for Large Eigenvalue Problems,
  6.2; for period maps Lust et al., SIAM J. Sci. Comput. 19 (1998) 1188), where each product with
  the linearised map is one more period, marched with a deviation that is carried along exactly
  for the contact states as they are (`microslip.contact.tangent`).

Two kinds of direction are no vibration; they are marked and have no part in the verdict.
*Translations*: a joint that slips widely is held sideways by soft springs at its far ends only. Its
bodies creep past each other, and slide to and fro together, with multipliers as near to 1 as those
springs and their damping are weak. *Locked-in tractions*: pairs that stick all the time keep any
traction they were given, multiplier 1, and pairs on the verge of slip keep it or not depending on
the sign of the deviation, so that the map has no derivative there and the number found, that of one
side, is no rate of growth: friction bounds it. Hardly anything moves in such a direction, and all
but a hundredth of its energy is in the tractions.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field, replace

import numpy as np

from microslip.analyses.prepared.joint_modes import walking_modes
from microslip.analyses.time.scheme import (
    LINEAR_FIELDS,
    State,
    TimeScheme,
    contact_memory,
    march,
    prestressed_state,
)
from microslip.analyses.time.steady import SteadyState
from microslip.brief import Brief
from microslip.contact.tangent import Tangents
from microslip.errors import MicroslipError
from microslip.model.joint import bonded_modes
from microslip.typing import Array, Complex, Mask

CLOSE = 1e-3
"""Arnoldi ends once the leading multipliers are known to this."""


STRAINED, RESTS = 0.2, 0.1
"""Share of a direction in tractions, and rates over the rest of it, of locked-in tractions that displace a
soft body: a vibration has a twentieth in tractions at most."""


@dataclass(frozen=True, repr=False)
class Multipliers(Brief):
    """Floquet multipliers of a steady state, largest modulus first.

    Attributes
    ----------
    values : (k,) complex array
        Conjugate pairs are both listed.
    residual : (k,) array
        Norm of ``L z - mu z`` of the direction z of unit norm.
    translation : (k,) array
        Share of the direction, in the squared norm, that moves the bodies sideways against the
        springs at their far ends.
    traction : (k,) array
        Share that is in tractions instead of motion.
    rate : (k,) array
        Share that is in rates.
    cycles : int
        Periods marched.
    direction : (n,) array
        Deviation of the state, of unit norm, of the largest multiplier of a vibration, its real part; empty
        where it was not asked for.
    """

    values: Complex
    residual: Array
    translation: Array
    traction: Array
    rate: Array
    cycles: int
    direction: Array = field(default_factory=lambda: np.zeros(0))

    @property
    def vibration(self) -> Mask:
        """Which directions are neither translations nor locked-in tractions."""
        return self._moving & ~self._at_rest

    @property
    def _moving(self) -> Mask:
        return np.asarray((self.translation < 0.5) & (self.traction < 0.5))

    @property
    def _at_rest(self) -> Mask:
        """Which are at rest, as far as one instant tells."""
        return np.asarray((self.traction > STRAINED) & (self.rate < RESTS * (1 - self.traction)))

    @property
    def largest(self) -> float:
        """Largest modulus of a vibration; nan where none was found."""
        kept = np.abs(self.values[self.vibration])
        return float(kept.max()) if len(kept) else float("nan")

    @property
    def verdict(self) -> str:
        """``stable``, ``unstable``, or ``undecided`` where the residual reaches the unit circle."""
        modulus, margin = np.abs(self.values[self.vibration]), self.residual[self.vibration]
        if (modulus - margin > 1).any():
            return "unstable"
        grows = np.abs(self.values) - self.residual > 1 + CLOSE
        if (grows & self._moving & self._at_rest).any():
            # a vibration that turns at this instant is at rest as well
            return "undecided"
        if len(modulus) and (modulus + margin < 1).all():
            return "stable"
        return "undecided"


class DeviationNorm:
    """Size of a deviation of states, from its energy.

        |z|² = sum_j (max(omega_j, omega_load) eta_j)² + |eta'|² + r^T W_res r

    Twice the energy of the free bodies, but that modes softer than the load are weighed as if they
    were as stiff as it: their position matters although it stores nothing.

    Parameters
    ----------
    scheme : TimeScheme
    omega : float
        Of the load, rad/s.
    """

    def __init__(self, scheme: TimeScheme, omega: float) -> None:
        self.model = scheme.joint.model
        self.weight = np.maximum(scheme.joint.model.omega, omega)

    def motion(self, z: State | Tangents) -> Array:
        """Weighted positions and rates of the modes; of rows, rows."""
        return np.concatenate([self.weight * z.eta, z.rate], axis=-1)

    def gram(self, one: Tangents, other: Tangents) -> Array:
        """Scalar products of two sets of deviations."""
        work = one.r @ self.model.residual @ other.r.T
        return np.asarray(self.motion(one) @ self.motion(other).T + work)

    def size(self, z: State) -> float:
        """Norm of a deviation."""
        row = as_rows([z])
        return float(np.sqrt(max(self.gram(row, row)[0, 0], 0.0)))

    def shares(self, motion: Array, directions: Array) -> tuple[Array, Array, Array]:
        """Shares of directions of unit norm that are translations, in tractions, and in rates.

        Parameters
        ----------
        motion : (p, 2 k) array
            Of the deviations that the directions are made of.
        directions : (p, n) array
        """
        energy = np.abs(motion.T @ directions) ** 2
        sideways = np.tile(walking_modes(self.model), 2)
        rates = energy[len(sideways) // 2 :]
        return energy[sideways].sum(axis=0), 1 - energy.sum(axis=0), rates.sum(axis=0)


def as_rows(states: Sequence[State]) -> Tangents:
    """Deviations, one a row."""
    return Tangents(*(np.array([getattr(z, name) for z in states]) for name in Tangents._fields))


def require_converged(steady: SteadyState) -> None:
    """Raise `MicroslipError` where a steady state did not converge: its neighbourhood says nothing."""
    if not steady.converged:
        raise MicroslipError(
            f"no stability at {steady.frequency:g} Hz: the steady state is not converged (last "
            f"change {steady.change:.1e}); allow more cycles"
        )


def floquet_multipliers(
    scheme: TimeScheme,
    steady: SteadyState,
    *,
    count: int = 4,
    max_cycles: int = 30,
    seed: int = 0,
) -> Multipliers:
    """Multipliers of largest modulus by Arnoldi's method on the period map.

    Parameters
    ----------
    scheme : TimeScheme
        The one `steady` was found with.
    steady : SteadyState
    count : int
        Ends when so many leading multipliers of vibrations have residuals below `CLOSE`.
    max_cycles : int
        Periods to march at most.
    seed : int
        Of the random deviation at the start.

    Raises
    ------
    MicroslipError
        Where the steady state did not converge: its neighbourhood says nothing.
    """
    require_converged(steady)
    omega = 2 * np.pi * steady.frequency
    norm = DeviationNorm(scheme, omega)
    orbit, wave, memory = steady.cycle.state, steady.cycle.load, contact_memory(scheme)

    def product(z: State) -> State:
        moved = march(scheme, orbit, wave, memory=memory, tangents=as_rows([z])).tangents
        return replace(z, **{name: field[0] for name, field in moved._asdict().items()})

    z = product(_random_motion(scheme, norm, omega, seed))
    basis = [_combined([1 / norm.size(z)], [z])]
    H = np.zeros((max_cycles + 1, max_cycles))
    size = 0
    while True:
        z = product(basis[-1])
        for _ in range(2):  # twice is enough: once loses orthogonality
            share = norm.gram(as_rows(basis), as_rows([z]))[:, 0]
            H[: size + 1, size] += share
            z = _combined([1.0, *-share], [z, *basis])
        H[size + 1, size] = norm.size(z)
        size += 1
        exhausted = H[size, size - 1] < 1e-12 * np.abs(H).max()
        found = _ritz(H, basis, norm, size, cycles=size + 1)
        kept = found.residual[found.vibration][:count]
        close = len(kept) == count and kept.max() < CLOSE
        if close or exhausted or size + 1 >= max_cycles:
            return found
        basis.append(_combined([1 / H[size, size - 1]], [z]))


def _ritz(
    H: Array, basis: Sequence[State], norm: DeviationNorm, size: int, cycles: int
) -> Multipliers:
    values, vectors = np.linalg.eig(H[:size, :size])
    order = np.argsort(-np.abs(values), kind="stable")
    values, vectors = values[order], vectors[:, order]
    vectors = vectors / np.linalg.norm(vectors, axis=0)
    translation, traction, rate = norm.shares(norm.motion(as_rows(basis)), vectors)
    return Multipliers(
        values=values.astype(complex),
        residual=np.abs(H[size, size - 1] * vectors[-1]),
        translation=translation,
        traction=traction,
        rate=rate,
        cycles=cycles,
    )


def _random_motion(scheme: TimeScheme, norm: DeviationNorm, omega: float, seed: int) -> State:
    """Rates of unit norm, random over the modes of the sliding state, less at high frequency.

    Rates of free bodies would let them into each other.
    """
    model = scheme.joint.model
    omegas, shapes = bonded_modes(model, scheme.joint.prestress.bonded(1))
    share = np.random.default_rng(seed).standard_normal(len(omegas))
    share *= omega**2 / np.maximum(omegas**2, omega**2)
    rest = prestressed_state(scheme)
    nothing = {name: np.zeros_like(getattr(rest, name)) for name in LINEAR_FIELDS}
    rate = shapes @ share
    return replace(rest, **{**nothing, "rate": rate / np.linalg.norm(rate)})


def _combined(shares: Sequence[float], states: Sequence[State]) -> State:
    """Sum of states, with the contact states of the first."""
    mixed = {
        name: sum(s * getattr(z, name) for s, z in zip(shares, states, strict=True))
        for name in LINEAR_FIELDS
    }
    return replace(states[0], **mixed)

"""Stability of every steady state, from the directions that its search has met; its error.

Newton's method has marched deviations of the soft modes, and so knows roughly in which directions
the Floquet multipliers of largest modulus lie. These directions, made orthonormal in the energy
(`DeviationNorm`), are Q; they are marched along the steady cycle once more, to J Q. Multipliers are
those of J projected on their span (Rayleigh and Ritz),

    H = Q^T J Q,    H y = mu y,    residual = |J Q y - mu Q y|

and where the residual of the largest leaves the verdict open, its images join Q (Saad, Numerical
Methods for Large Eigenvalue Problems, 5.1). Three cycles are mostly enough; Arnoldi's method
(`floquet_multipliers`), one deviation after another from a random one, takes some fifteen. Where the second
half of the motion is the image of its first, J is that of half a cycle (`half_period`).

The error of a steady state. One that still changes by ``F = P(x) - x`` over a cycle is off the periodic
state by ``(1 - J)^-1 F``, at most the change over the smallest ``|1 - mu|`` where directions are
orthogonal: a lightly damped joint at resonance that changes by 1e-5 of its vibration may be a
thousandth away from where it goes.
"""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np

from microslip.analyses.time.deviations import STILL, Derivative, StateSpace
from microslip.analyses.time.floquet import CLOSE, DeviationNorm, Multipliers, require_converged
from microslip.analyses.time.half_period import Passage, half_period_of
from microslip.analyses.time.scheme import ContactMemory, TimeScheme, contact_memory
from microslip.analyses.time.steady import CONFIRMED, LEADING, SteadyState, steady_state
from microslip.contact.tangent import Tangents
from microslip.typing import Array, Complex, Mask

SHARE = 1 / 3
"""Residual of the largest multiplier over its distance from 1, or from the unit circle, at most."""

SOFT = 0.1
"""Frequency of a mode over that of the load below which it may be part of a motion of the whole joint."""

DEPENDENT = 1e-8
"""A direction that is this small beside its part in the others adds nothing."""


def stability_of(
    scheme: TimeScheme,
    steady: SteadyState,
    *,
    max_cycles: int = 8,
    memory: ContactMemory | None = None,
) -> Multipliers:
    """Multipliers of largest modulus, as far as the verdict and the error need them.

    Parameters
    ----------
    scheme : TimeScheme
        The one `steady` was found with.
    steady : SteadyState
    max_cycles : int
        Periods to march at most.
    memory : ContactMemory, optional
        As for `steady_state`.

    Raises
    ------
    MicroslipError
        Where the steady state did not converge: its neighbourhood says nothing.
    """
    require_converged(steady)
    span = _Span(scheme, steady, memory)
    known = steady.directions if len(steady.directions) else span.directions_of_modes()
    span.widen(np.concatenate([known, span.motions_of_the_whole()]))
    while True:
        found, shares = span.ritz()
        unknown = _undecided(found)
        if span.cycles >= max_cycles or not unknown.any():
            return span.with_direction(found, shares)
        size = len(span.images)
        shares = shares[:, unknown & (found.values.imag >= 0)][:, : LEADING // 2]
        span.widen(np.concatenate([shares.real.T, shares.imag.T]) @ span.images)
        if len(span.images) == size:
            return span.with_direction(found, shares)


def settling_error(steady: SteadyState, found: Multipliers) -> float:
    """By how much the state may be off the periodic one, over the size of the vibration.

    The change of the last cycle over the smallest distance of a multiplier from 1, less what that is off by.

    Parameters
    ----------
    steady : SteadyState
    found : Multipliers
        Of it.
    """
    distance = np.abs(1 - found.values[found.vibration])
    distance -= np.minimum(found.residual[found.vibration], SHARE * distance)
    return steady.change / max(float(distance.min(initial=1.0)), 1e-12)


SURE = 100.0
"""The state goes on to be sought where its error may be so many times the tolerance,"""

FINER = 50
"""for so many cycles at most."""


def closer(
    scheme: TimeScheme,
    steady: SteadyState,
    error: float,
    tolerance: float,
    memory: ContactMemory | None = None,
) -> tuple[SteadyState, float]:
    """A steady state and its settling error, sought on where that is beyond `SURE` times the tolerance.

    Parameters
    ----------
    scheme : TimeScheme
        The one `steady` was found with.
    steady : SteadyState
    error : float
        Of it, see `settling_error`.
    tolerance : float
        It was sought to.
    memory : ContactMemory, optional
        As for `steady_state`.
    """
    if not error > SURE * tolerance:
        return steady, error
    later = steady_state(
        scheme,
        steady.frequency,
        steady.load,
        start=steady.end,
        tolerance=steady.change * SURE * tolerance / error / CONFIRMED,
        max_cycles=FINER,
        memory=memory,
        halves=steady.halved,
    )
    cycles, seconds = steady.cycles + later.cycles, steady.seconds + later.seconds
    if later.change >= steady.change:
        return replace(steady, cycles=cycles, seconds=seconds), error
    found = replace(later, converged=True, cycles=cycles, seconds=seconds)
    return found, error * later.change / steady.change


def _undecided(found: Multipliers) -> Mask:
    """Which multipliers have to be known better before the verdict and the error are sure."""
    size, off = np.abs(found.values), found.residual
    near = np.minimum(np.abs(1 - size), np.abs(1 - found.values))
    rough = off > np.maximum(SHARE * near, CLOSE)
    matters = size + off > (found.largest if np.isfinite(found.largest) else 0.0)
    return np.asarray(found.vibration & rough & matters)


class _Span:
    """Orthonormal deviations, and their images one cycle later, rows."""

    def __init__(
        self, scheme: TimeScheme, steady: SteadyState, memory: ContactMemory | None
    ) -> None:
        omega = 2 * np.pi * steady.frequency
        self.orbit = steady.cycle.state
        self.space, self.norm = StateSpace(scheme, omega), DeviationNorm(scheme, omega)
        half = half_period_of(scheme) if steady.halved else None
        self.passage = Passage(scheme, steady.cycle.load, memory or contact_memory(scheme), half)
        self.passages = 0
        self.basis: Array = np.zeros((0, len(self.space.rest)))
        self.images: Array = self.basis

    @property
    def cycles(self) -> int:
        """Marched so far."""
        return math.ceil(self.passages * self.passage.share)

    def directions_of_modes(self) -> Array:
        """The leading directions after a cycle with deviations of all soft modes."""
        derivative = Derivative(self.space)
        derivative.renew(self._marched(self.space.deviations(())), ())
        return derivative.leading(LEADING)

    def motions_of_the_whole(self) -> Array:
        """Positions and rates of motions that move no pair, far softer than the load.

        None where bodies only slide sideways together: that is no vibration.
        A rate of such a motion is many of its positions a cycle later, in a measure that takes it for as
        stiff as the load: J is far from normal there, and a direction of little rate grows by a part of that,
        with a small residual, though no multiplier is near. Both together are what J makes of them.
        """
        model = self.passage.scheme.joint.model
        soft = np.flatnonzero(model.omega < SOFT * self.norm.weight.min())
        _, size, shares = np.linalg.svd(model.mode_v[:, soft])
        moved = np.zeros(len(shares))
        moved[: len(size)] = size
        still = moved <= STILL * np.linalg.norm(model.mode_v, axis=0).max(initial=0.0)
        z = np.zeros((int(still.sum()), len(model.omega)))
        z[:, soft] = shares[still]
        if not np.abs(z[:, self.space.weight > 0]).max(initial=0.0) > STILL:
            z = z[:0]
        return self.space.vector(self.space.of_modes(z, z / self.space.steep))

    def widen(self, rows: Array) -> None:
        """Take more directions, and march them."""
        size = np.sqrt(np.maximum(np.diag(self._gram(rows, rows)), 0.0))
        rows = rows[size > 0] / size[size > 0, None]
        for _ in range(2):  # twice is enough: once loses orthogonality
            rows = rows - self._gram(rows, self.basis) @ self.basis
            values, vectors = np.linalg.eigh(self._gram(rows, rows))
            kept = values > DEPENDENT
            rows = (vectors[:, kept] / np.sqrt(values[kept])).T @ rows
        if len(rows):
            images = self.space.vector(self._marched(self._deviations(rows)))
            self.basis = np.concatenate([self.basis, rows])
            self.images = np.concatenate([self.images, images])

    def ritz(self) -> tuple[Multipliers, Complex]:
        """Multipliers, largest modulus first, and the shares of the directions in each, columns."""
        H, square = self._gram(self.basis, self.images), self._gram(self.images, self.images)
        values, shares = np.linalg.eig(H)
        order = np.argsort(-np.abs(values), kind="stable")
        values, shares = values[order].astype(complex), shares[:, order].astype(complex)
        beyond = np.einsum("ik,ij,jk->k", shares.conj(), square, shares).real - np.abs(values) ** 2
        motion = self.norm.motion(self._deviations(self.basis))
        translation, traction, rate = self.norm.shares(motion, shares)
        residual = np.sqrt(np.maximum(beyond, 0.0))
        if self.passage.half is not None:
            # J² z - mu² z = (J + mu) (J z - mu z), J z no larger than z
            values, residual = values**2, (1 + np.abs(values)) * residual
        found = Multipliers(
            values=values,
            residual=residual,
            translation=translation,
            traction=traction,
            rate=rate,
            cycles=self.cycles,
        )
        return found, shares

    def with_direction(self, found: Multipliers, shares: Complex) -> Multipliers:
        """The direction of the largest multiplier of a vibration, where there is one, with the others."""
        vibration = np.flatnonzero(found.vibration)
        if not len(vibration):
            return found
        z = shares[:, vibration[0]].real @ self.images
        return replace(found, direction=z / np.sqrt(self._gram(z[None], z[None])[0, 0]))

    def _marched(self, rows: Tangents) -> Tangents:
        self.passages += 1
        return self.passage.of(self.orbit, rows).tangents

    def _deviations(self, rows: Array) -> Tangents:
        return Tangents(*np.split(rows, self.space.cuts, axis=-1))

    def _gram(self, one: Array, other: Array) -> Array:
        """Scalar products of rows."""
        return self.norm.gram(self._deviations(one), self._deviations(other))

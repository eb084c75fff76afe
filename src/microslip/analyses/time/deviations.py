"""States of a motion as vectors, and what is known of the derivative of the period map.

The period map P takes a state to the one a period of the load later; its fixed point is the
steady state. A deviation is measured by the modes and the reactions,

    u = (eta', max(omega, omega_load) eta, sqrt(diag W_res) r)

twice the energy of the modes, and of each reaction alone, without the position of bodies that slide past
each other rigidly: their walk has no end and must not be extrapolated. Of the derivative J of P a
few columns are known, ``J ~ B V^T``: the images B of deviations whose shares in u are V. A Newton
step solves the fixed point equation with these,

    delta = F + J delta,    F = P(x) - x:    delta = F + B (1 - V^T u(B))^-1 V^T u(F)

and marches where nothing is known (Newton-Picard; Lust et al., SIAM J. Sci. Comput. 19 (1998) 1188). Each
further cycle corrects it by what it shows (Broyden, Math. Comp. 19 (1965) 577).
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from microslip.analyses.prepared.joint_modes import walking_modes
from microslip.analyses.time.coupled import accelerations
from microslip.analyses.time.scheme import State, TimeScheme, no_tangents, prestressed_state
from microslip.contact.pairs import normal_rows
from microslip.contact.tangent import Tangents
from microslip.typing import Array, Complex, Indices

FIELDS = Tangents._fields
"""Fields of a `State` in a vector; what contact has taken is history, and no steady state repeats it."""

WIDEST = 20
"""Modes, the softest, whose columns of the derivative are marched."""

STILL = 1e-3
"""Slip of bodies that move together over that of bodies that slide past each other."""

DOUBLED = 10
"""Most doublings of the cycles of a step."""

NEW = 1e-3
"""Share of a deviation beyond the modes' below which it adds no column."""


def vibration_weight(scheme: TimeScheme) -> Array:
    """Weight of the position of each mode in the size of a vibration, 1/s.

    Its circular frequency, at least 1 rad/s; nothing for modes that slide the bodies past each
    other rigidly.
    """
    model = scheme.joint.model
    return np.where(walking_modes(model), 0.0, np.maximum(model.omega, 1.0))


class StateSpace:
    """States of a scheme as vectors, and their measure.

    Parameters
    ----------
    scheme : TimeScheme
    omega : float
        Of the load, rad/s.
    """

    def __init__(self, scheme: TimeScheme, omega: float) -> None:
        self.scheme = scheme
        self.weight = vibration_weight(scheme)
        modes, N = len(self.weight), len(scheme.W)
        self.cuts = np.cumsum([modes, modes, modes, N, N, N])
        self.reaction = np.sqrt(np.diag(scheme.joint.model.residual))
        soft = np.arange(modes) < WIDEST
        # positions of modes softer than the load matter although they store nothing
        self.steep = np.maximum(scheme.joint.model.omega, omega)
        sideways = np.flatnonzero(self.weight == 0)
        self.shape = np.vstack([np.eye(modes)[self.weight > 0], _together(scheme, sideways)])
        self.rates = np.eye(modes)[soft]
        self.positions = (self.shape / self.steep)[(self.shape[:, soft] != 0).any(axis=1)]
        self.rest = self.vector(prestressed_state(scheme))

    @property
    def directions(self) -> int:
        """Columns of the derivative that belong to modes."""
        return len(self.rates) + len(self.positions)

    def vector(self, state: State | Tangents) -> Array:
        """A state, or rows of deviations."""
        return np.concatenate([getattr(state, name) for name in FIELDS], axis=-1)

    def state(self, vector: Array, like: State) -> State:
        """The state of a vector; contact states and what contact has taken are those of `like`."""
        parts = (a.copy() for a in np.split(vector, self.cuts))
        eta, rate, acceleration, residual_v, residual_before, r, v = parts
        return replace(
            like,
            eta=eta,
            rate=rate,
            acceleration=acceleration,
            residual_v=residual_v,
            residual_before=residual_before,
            r=r,
            v=v,
        )

    def vibration(self, vectors: Array) -> Array:
        """Rates of all modes and weighted positions, rows for rows."""
        eta, rate = np.split(vectors, self.cuts, axis=-1)[:2]
        return np.concatenate([rate, self.weight * eta], axis=-1)

    def measure(self, vectors: Array) -> Array:
        """u, rows for rows."""
        eta, rate, _, _, _, r, _ = np.split(vectors, self.cuts, axis=-1)
        position = (self.steep * eta) @ self.shape.T
        return np.concatenate([rate, position, self.reaction * r], axis=-1)

    def change(self, before: Array, after: Array) -> float:
        """Size of the change of the vibration over its size."""
        size = float(np.linalg.norm(self.vibration(after - self.rest)))
        return float(np.linalg.norm(self.vibration(after - before))) / max(size, 1e-300)

    def of_modes(self, rates: Array, positions: Array) -> Tangents:
        """Deviations of the modes alone, rows: those of the rates, and below them those of the positions."""
        model, kernel = self.scheme.joint.model, self.scheme.kernel
        found, moving = no_tangents(self.scheme, len(rates) + len(positions)), len(rates)
        found.rate[:moving] = rates
        found.acceleration[:moving] = accelerations(kernel, np.zeros_like(rates), rates)
        found.eta[moving:] = positions
        resisted, none = -(model.omega**2) * positions, np.zeros_like(positions)
        found.acceleration[moving:] = accelerations(kernel, resisted, none)
        found.residual_v[moving:] = -positions @ model.mode_v.T
        found.residual_before[moving:] = found.residual_v[moving:]
        return found

    def deviations(self, others: Sequence[Array]) -> Tangents:
        """Rates and positions of unit measure of the softest modes, one a row, and `others` below them."""
        own = self.of_modes(self.rates, self.positions)
        if not len(others):
            return own
        more = np.split(np.array(others), self.cuts, axis=-1)
        return Tangents(*(np.concatenate(rows) for rows in zip(own, more, strict=True)))

    def shares(self) -> Array:
        """The shares in u that `deviations` have, rows for rows."""
        return self.measure(self.vector(self.deviations(())))


def _together(scheme: TimeScheme, sideways: Indices) -> Array:
    """Shares of the modes, rows, that move bodies sideways without sliding them past each other.

    Rows of unit norm; soft springs alone act on such a motion and nothing damps it.
    """
    model = scheme.joint.model
    found = np.zeros((0, len(model.omega)))
    if len(sideways):
        slips = np.delete(model.mode_v, normal_rows(model.dimension), axis=0)
        _, size, turned = np.linalg.svd(slips[:, sideways])
        still = size < STILL * size[0]
        found = np.zeros((int(still.sum()), len(model.omega)))
        found[:, sideways] = turned[still]
    return found


def _resized(rows: Array, count: int) -> Array:
    """The first so many columns, and zeros where there are fewer."""
    found = np.zeros((len(rows), count))
    kept = min(count, rows.shape[1])
    found[:, :kept] = rows[:, :kept]
    return found


class Derivative:
    """What is known of the derivative of the period map, ``J ~ B V^T``.

    Parameters
    ----------
    space : StateSpace
    """

    def __init__(self, space: StateSpace) -> None:
        self.space = space
        self.images: Array = np.zeros((0, len(space.rest)))
        self.shares: Array = np.zeros((0, len(space.measure(space.rest))))

    @property
    def known(self) -> bool:
        """Whether any column is."""
        return len(self.images) > 0

    def of(self, space: StateSpace) -> Derivative:
        """The same columns for another scheme of nearly the same step.

        Modes that the one follows and the other does not are the stiffest ones; nothing is known of them.
        """
        found, own = Derivative(space), self.space
        images = np.split(self.images, own.cuts, axis=-1)
        k, rows = len(space.weight), int((space.weight > 0).sum())
        images[:3] = [_resized(part, k) for part in images[:3]]
        found.images = np.concatenate(images, axis=-1)
        before, split = len(own.weight), int((own.weight > 0).sum())
        rate, place, others = np.split(self.shares, [before, before + split], axis=-1)
        found.shares = np.concatenate([_resized(rate, k), _resized(place, rows), others], axis=-1)
        return found

    def renew(self, marched: Tangents, others: Sequence[Array]) -> None:
        """Take the images of `StateSpace.deviations` of the same others for it."""
        space, images = self.space, self.space.vector(marched)
        self.images, self.shares = images[: space.directions], space.shares()
        unit = self.shares
        for z, image in zip(others, images[space.directions :], strict=True):
            u = space.measure(z)
            beyond = u - (unit @ u) @ unit
            square = float(beyond @ beyond)
            if square > NEW**2 * float(u @ u):
                lacking = image - (self.shares @ u) @ self.images
                self.images = np.concatenate([self.images, lacking[None]])
                self.shares = np.concatenate([self.shares, (beyond / square)[None]])
                unit = np.concatenate([unit, (beyond / np.sqrt(square))[None]])

    def correct(self, moved: Array, image: Array) -> None:
        """Let it map the deviation `moved` to `image`, and change nothing across it."""
        u = self.space.measure(moved)
        square = float(u @ u)
        if square > 0:
            lacking = image - (self.shares @ u) @ self.images
            self.images = np.concatenate([self.images, lacking[None]])
            self.shares = np.concatenate([self.shares, (u / square)[None]])

    def _small(self) -> Array:
        return np.asarray(self.shares @ self.space.measure(self.images).T)

    def correction(self, change: Array, longest: float) -> Array:
        """What to add to an image of the map, the `change` being P(x) - x.

        The Newton step; where that moves the vibration by more than `longest`, what so many cycles
        of the linearised map would add, ``J F + J² F + ...``, as many as stay below it.
        """
        given = self.shares @ self.space.measure(change)
        power = self._small()
        try:
            whole = np.asarray(np.linalg.solve(np.eye(len(power)) - power, given) @ self.images)
        except np.linalg.LinAlgError:
            whole = np.full_like(change, np.inf)
        if self._length(whole) <= longest:
            return whole
        share, found = given, np.zeros_like(change)
        for _ in range(DOUBLED):
            step = np.asarray(share @ self.images)
            if not self._length(step) <= longest:
                break
            found, share, power = step, share + power @ share, power @ power
        return found

    def _length(self, vector: Array) -> float:
        return float(np.linalg.norm(self.space.vibration(vector)))

    def multipliers(self) -> Complex:
        """Eigenvalues, largest modulus first: estimates of the Floquet multipliers.

        Without the directions that slide the bodies past each other rigidly.
        """
        if not self.known:
            return np.zeros(0, complex)
        found = np.linalg.eigvals(self._vibrating()).astype(complex)
        return found[np.argsort(-np.abs(found), kind="stable")]

    def leading(self, most: int) -> Array:
        """Deviations of the largest multipliers, rows: real parts, and imaginary parts of pairs.

        Parameters
        ----------
        most : int
            Rows at most.
        """
        if not self.known:
            return self.images
        values, shares = np.linalg.eig(self._vibrating())
        order = np.argsort(-np.abs(values), kind="stable")
        rows: list[Array] = []
        for k in order[values[order].imag >= 0]:
            parts = (shares[:, k].real, shares[:, k].imag)[: 1 + bool(values[k].imag)]
            rows += [part @ self.images for part in parts]
        return np.array(rows[:most])

    def _vibrating(self) -> Array:
        """The small matrix, blind to bodies that slide past each other rigidly."""
        u = self.space.measure(self.images)
        u[:, : len(self.space.weight)][:, self.space.weight == 0] = 0.0
        return np.asarray(self.shares @ u.T)

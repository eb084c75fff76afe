"""The half turn of a motion: what happens at x happens at -x half a period later.

Where the joint is its own image under a half turn that keeps the preload and reverses the load, a state
that is marched over half a period and turned is the start of the next half as it is of the first: with
Phi the motion over half a period and S the half turn, the period map is

    P = (S Phi)²,      as  S Phi_(second half) S = Phi_(first half)  and  S² = 1.

A fixed point of S Phi is a periodic motion whose second half is the image of its first, and the Floquet
multipliers are the squares of the eigenvalues of the derivative of S Phi, of which each costs half a
cycle. All deviations are met, symmetric or not. Motions that are not their own image, which come in
pairs, are fixed points of the whole period alone.

The half turn of the modes, T, follows from the relative displacements and the loads that they have,
modes of equal frequency among each other.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from itertools import pairwise

import numpy as np

from microslip.analyses.time.scheme import ContactMemory, March, State, TimeScheme, march
from microslip.brief import Brief
from microslip.contact import tableau
from microslip.contact.pairs import components
from microslip.contact.tangent import Tangents
from microslip.numerics.alike import alike
from microslip.typing import Array, Indices

ALIKE = 1e-8
"""Relative difference of what counts as its own image."""

EQUAL = 1e-6
"""Relative difference of frequencies that are one."""

MOVES = 1e-9
"""Least displacement of a combination of modes of one frequency, over the largest, that tells its image."""


@dataclass(frozen=True, repr=False)
class HalfPeriod(Brief):
    """What the half turn does to states of a scheme.

    Attributes
    ----------
    pairs : (m,) int array
        Image of every pair.
    rows : (2 m,) int array
        Image of every component.
    modes : (k, k) array
        T: turned modal coordinates by those before.
    """

    pairs: Indices
    rows: Indices
    modes: Array

    def state(self, state: State) -> State:
        """The image of a state."""
        T, rows = self.modes, self.rows
        return State(
            eta=T @ state.eta,
            rate=T @ state.rate,
            acceleration=T @ state.acceleration,
            residual_v=state.residual_v[rows],
            residual_before=state.residual_before[rows],
            r=state.r[rows],
            v=state.v[rows],
            taken=state.taken,
            status=state.status[self.pairs],
        )

    def deviations(self, rows: Tangents) -> Tangents:
        """The images of deviations."""
        modal = (z @ self.modes.T for z in (rows.eta, rows.rate, rows.acceleration))
        of_pairs = (rows.residual_v, rows.residual_before, rows.r, rows.v)
        return Tangents(*modal, *(np.ascontiguousarray(z[:, self.rows]) for z in of_pairs))

    def turn_memory(self, memory: ContactMemory) -> None:
        """Make the memory of a contact solver fit the image of the state that it fits, in place.

        That of dissipative steps is made to fit wherever it is asked.
        """
        own = memory[0]
        assert isinstance(own, tableau.Memory)  # planar
        tableau.permute(own, self.rows, self.pairs)


@dataclass(frozen=True, repr=False)
class Passage(Brief):
    """The period map, or half of it where its halves are images.

    Attributes
    ----------
    scheme : TimeScheme
    wave : (n,) array
        The load over a period.
    memory : ContactMemory
    half : HalfPeriod or None
        None for the whole period.
    """

    scheme: TimeScheme
    wave: Array
    memory: ContactMemory
    half: HalfPeriod | None

    @property
    def share(self) -> float:
        """Of a period."""
        return 1.0 if self.half is None else 0.5

    def of(self, state: State, tangents: Tangents | None = None) -> March:
        """From `state` to its image, and of deviations of it; the march itself is that of the time spent."""
        if self.half is None:
            return march(self.scheme, state, self.wave, memory=self.memory, tangents=tangents)
        wave = self.wave[: len(self.wave) // 2 + 1]
        done = march(self.scheme, state, wave, memory=self.memory, tangents=tangents)
        self.half.turn_memory(self.memory)
        turned = self.half.deviations(done.tangents)
        return replace(done, state=self.half.state(done.state), tangents=turned)


def half_period_of(scheme: TimeScheme) -> HalfPeriod | None:
    """The half turn of a scheme; None where it has none.

    Planar, and without damping that couples the modes.

    Parameters
    ----------
    scheme : TimeScheme
    """
    joint, kernel = scheme.joint, scheme.kernel
    model = joint.model
    if model.image is None or model.dimension != 2 or len(kernel.coupling.answer):
        return None
    pairs, rows = model.image, components(model.image)
    T = _turned_modes(scheme, rows)
    prestress = joint.prestress.solution
    same = [
        (scheme.W, scheme.W[np.ix_(rows, rows)]),
        (model.mode_v @ T, model.mode_v[rows]),
        (T @ T.T, np.eye(len(T))),
        *(
            (T * diagonal, (T.T * diagonal).T)
            for diagonal in (model.omega, kernel.mode_step, kernel.mode_damping, kernel.mode_gain)
        ),
        (kernel.constant_v, kernel.constant_v[rows]),
        (T @ kernel.constant_modes, kernel.constant_modes),
        (kernel.drive_v, -kernel.drive_v[rows]),
        (T @ kernel.drive_modes, -kernel.drive_modes),
        (joint.law.friction, joint.law.friction[pairs]),
        (prestress.r, prestress.r[rows]),
    ]
    if not all(alike(a, b, ALIKE) for a, b in same):
        return None
    return HalfPeriod(pairs, rows, T)


def _turned_modes(scheme: TimeScheme, rows: Indices) -> Array:
    """T, as far as relative displacements and the load tell it.

    A combination of modes of one frequency that moves neither is not coupled to anything: it keeps its sign.
    """
    model, load = scheme.joint.model, scheme.kernel.drive_modes
    pushed = load / max(float(np.abs(load).max(initial=0.0)), 1e-300)
    size = max(float(np.abs(model.mode_v).max(initial=0.0)), 1e-300)
    seen = np.vstack([model.mode_v / size, pushed])
    image = np.vstack([model.mode_v[rows] / size, -pushed])
    T = np.zeros((len(model.omega), len(model.omega)))
    scale = np.maximum(model.omega, EQUAL * model.omega.max(initial=0.0))
    ends = np.flatnonzero(np.diff(model.omega) > EQUAL * scale[1:]) + 1
    for first, last in pairwise([0, *ends, len(model.omega)]):
        own = slice(first, last)
        _, moved, across = np.linalg.svd(seen[:, own], full_matrices=False)
        known = across[moved > MOVES * moved.max(initial=0.0)]
        found = np.linalg.lstsq(seen[:, own] @ known.T, image[:, own], rcond=None)[0]
        T[own, own] = known.T @ found + np.eye(last - first) - known.T @ known
    return T

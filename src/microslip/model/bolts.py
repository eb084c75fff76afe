"""Bolts that keep their length: their force is a result of how far they are shortened.

A bolt shortened by s adds a coordinate to the structure. With the blocks of its stiffness matrix,

    K x = P s - B^T r + loads,   F = K_ss s - P^T x,   P = -K_xs,

s is a load as others are, and F the force of the bolt. As a port it has the amplitude ``a_i = K_ii s_i`` and
the vector ``p_i = P_i / K_ii``: a is the force that the bolt would have if nothing gave, and

    F = C a - k y - D b,   C_ij = K_ij / K_jj,   k_i = K_ii,   y_i = p_i^T x,

with what other loads of amplitude b do on s itself, as where the bolt becomes warmer.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field, replace

import numpy as np

from microslip.brief import Brief
from microslip.typing import Array


@dataclass(frozen=True, repr=False)
class Bolts(Brief):
    """Bolts that keep their length.

    Attributes
    ----------
    names : tuple of str
        Their ports.
    stiffness : (b,) array
        k: force per shortening with all else held, N/m, per metre of width.
    coupling : (b, b) array
        C.
    direct : mapping of str to (b,) array
        D: what a unit of other loads does work on when a bolt is shortened, by port; those left out nothing.

    Examples
    --------
    >>> bolts = Bolts(("one",), np.array([2e8]), np.eye(1))
    >>> bolts.forces(np.array([12e3]), np.array([1e-5]))  # what gives by 10 µm takes 2 kN off
    array([10000.])
    """

    names: tuple[str, ...]
    stiffness: Array
    coupling: Array
    direct: Mapping[str, Array] = field(default_factory=dict)

    def forces(self, amplitudes: Array, outputs: Array) -> Array:
        """(b,) forces F from the amplitudes a of the ports and their outputs y, without other loads."""
        return np.asarray(self.coupling @ amplitudes - self.stiffness * outputs)

    def per_width(self, width: float) -> Bolts:
        """The same bolts per metre of a width."""
        return replace(self, stiffness=self.stiffness / width)


NO_BOLTS = Bolts((), np.zeros(0), np.zeros((0, 0)))
"""Where all that presses is a constant force."""


@dataclass(frozen=True)
class Tightening:
    """In which order a joint is pressed together, and by how much.

    Attributes
    ----------
    bolts : Bolts
        Of those that keep their length.
    order : mapping of str to int
        Of every port that is held: those with the same number together.
    force : mapping of str to float
        Forces that bolts are tightened to, N per metre of width.
    shortening : mapping of str to float
        How far the others are shortened from where they are snug, m.
    """

    bolts: Bolts
    order: Mapping[str, int] = field(default_factory=dict)
    force: Mapping[str, float] = field(default_factory=dict)
    shortening: Mapping[str, float] = field(default_factory=dict)

    @property
    def amplitudes(self) -> dict[str, float]:
        """What shortening adds to the amplitudes of ports, k s."""
        stiffness = dict(zip(self.bolts.names, self.bolts.stiffness, strict=True))
        return {name: float(stiffness[name] * s) for name, s in self.shortening.items()}

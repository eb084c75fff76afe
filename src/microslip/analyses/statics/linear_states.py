"""The two linear states of a joint, sliding and stuck, around its prestress.

Sliding: the pairs that touch at prestress are bonded in the normal direction and free to slide.
Stuck: the same pairs bonded in every direction. Of each state the mode that a given load excites
most (largest static response) is the one the reduced models are built on.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from microslip.model.modes import linear_modes
from microslip.model.structure import Structure
from microslip.typing import Array


@dataclass(frozen=True)
class LinearStates:
    """Sliding and stuck mode, mass-normalised, positive under the chosen load.

    Attributes
    ----------
    sliding, stuck : (n,) arrays
        Mode shapes.
    sliding_omega, stuck_omega : float
        rad/s.
    overlap : float
        ``Phi_sl^T M Phi_st``.
    pairs : (b,) int array
        The bonded pairs.
    load_on_sliding, load_on_stuck : mapping
        ``Phi^T p`` of every load of the structure.
    """

    sliding: Array
    stuck: Array
    sliding_omega: float
    stuck_omega: float
    overlap: float
    pairs: NDArray[np.int64]
    load_on_sliding: dict[str, float]
    load_on_stuck: dict[str, float]

    @property
    def sliding_frequency(self) -> float:
        """Hz."""
        return self.sliding_omega / (2 * np.pi)

    @property
    def stuck_frequency(self) -> float:
        """Hz."""
        return self.stuck_omega / (2 * np.pi)

    def ports(self, structure: Structure) -> dict[str, Array]:
        """Modal inertia loads ``M Phi``, as ports ``sliding`` and ``stuck``."""
        return {
            "sliding": structure.mass @ self.sliding,
            "stuck": structure.mass @ self.stuck,
        }


def linear_states(
    structure: Structure, pairs: NDArray[np.int64], load: str, search: int = 8
) -> LinearStates:
    """Sliding and stuck mode with the given pairs bonded.

    Parameters
    ----------
    structure : Structure
    pairs : (b,) int array
        Contact pairs to bond; for the joint's own states those touching at prestress.
    load : str
        The load whose static response picks the mode.
    search : int
        How many modes to look at.
    """
    d = structure.interface.dimension
    normal = d * pairs
    both = np.sort((d * pairs[:, None] + np.arange(d)).ravel())
    p = structure.loads[load]
    found = []
    for bonded in (normal, both):
        modes = linear_modes(structure, bonded, search, align=load)
        work = np.abs(modes.shapes.T @ p) / np.maximum(modes.omega, 1e-6 * modes.omega[-1]) ** 2
        k = int(np.argmax(work))
        found.append((modes.shapes[:, k], float(modes.omega[k])))
    (sliding, sliding_omega), (stuck, stuck_omega) = found
    return LinearStates(
        sliding=sliding,
        stuck=stuck,
        sliding_omega=sliding_omega,
        stuck_omega=stuck_omega,
        overlap=float(sliding @ (structure.mass @ stuck)),
        pairs=np.asarray(pairs),
        load_on_sliding={name: float(sliding @ q) for name, q in structure.loads.items()},
        load_on_stuck={name: float(stuck @ q) for name, q in structure.loads.items()},
    )

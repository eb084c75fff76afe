"""Linear states of a structure in contact: sliding and stuck.

*Sliding*: normal motion bonded over the given pairs, tangential motion free (the K of the equation of
motion). *Stuck*: both directions bonded. In each the mode that a given load excites most (largest
static response) is the one the reduced models are built on.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from microslip.brief import Brief
from microslip.model.modes import linear_modes
from microslip.model.structure import Structure
from microslip.typing import Array, Indices


@dataclass(frozen=True, repr=False)
class LinearStates(Brief):
    """Sliding and stuck mode on every degree of freedom, mass-normalised, positive under the load.

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
    """

    sliding: Array
    stuck: Array
    sliding_omega: float
    stuck_omega: float
    overlap: float
    pairs: Indices

    def ports(self, structure: Structure) -> dict[str, Array]:
        """Modal inertia loads ``M Phi``, as ports ``sliding`` and ``stuck``."""
        return {
            "sliding": structure.mass @ self.sliding,
            "stuck": structure.mass @ self.stuck,
        }


def linear_states(
    structure: Structure,
    pairs: Indices,
    bonded: tuple[Indices, Indices],
    load: str,
    search: int = 8,
    least: float = 0.0,
) -> LinearStates:
    """Sliding and stuck mode with the given pairs bonded.

    Parameters
    ----------
    structure : Structure
    pairs : (b,) int array
        Contact pairs to bond; for the joint's own states those touching at prestress.
    bonded : pair of int arrays
        Their components that the sliding and the stuck state hold: the normal ones, and all.
    load : str
        The load whose static response picks the mode.
    search : int
        How many modes to look at.
    least : float
        Lowest circular frequency of the mode, over that of the highest one looked at: bodies that nothing
        holds have motions below it.
    """
    p = structure.loads[load]
    found = []
    for held in bonded:
        modes = linear_modes(structure, held, search, align=load)
        work = np.abs(modes.shapes.T @ p) / np.maximum(modes.omega, 1e-6 * modes.omega[-1]) ** 2
        k = int(np.argmax(np.where(modes.omega >= least * modes.omega[-1], work, -1.0)))
        found.append((modes.shapes[:, k], float(modes.omega[k])))
    (sliding, sliding_omega), (stuck, stuck_omega) = found
    return LinearStates(
        sliding=sliding,
        stuck=stuck,
        sliding_omega=sliding_omega,
        stuck_omega=stuck_omega,
        overlap=float(sliding @ (structure.mass @ stuck)),
        pairs=np.asarray(pairs),
    )

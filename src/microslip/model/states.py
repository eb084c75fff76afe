"""Linear states of a structure in contact: sliding and stuck.

*Sliding*: normal motion bonded over the given pairs, tangential motion free (the K of the equation of
motion). *Stuck*: both directions bonded. Reduced models are built on the stuck mode that a given load
excites most (largest static response), and on the sliding mode that is most like it, of the largest modal
assurance ``(Phi_sl^T M Phi_st)²``. Were both picked by the load, they could be two modes that have nothing
to do with each other: in space several close ones bend this way and that, and twist.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from microslip.brief import Brief
from microslip.model.modes import linear_modes
from microslip.model.structure import Structure
from microslip.typing import Array, Indices, Mask


@dataclass(frozen=True, repr=False)
class LinearStates(Brief):
    """Sliding and stuck mode on every degree of freedom, mass-normalised; the load works on the stuck one.

    Attributes
    ----------
    sliding, stuck : (n,) arrays
        Mode shapes.
    sliding_omega, stuck_omega : float
        rad/s.
    overlap : float
        ``Phi_sl^T M Phi_st``, >= 0.
    pairs : (b,) int array
        The bonded pairs.
    drifting : float
        Share of the stuck mode, as assurance, that is motions in which sliding bodies drift held by nothing.
    """

    sliding: Array
    stuck: Array
    sliding_omega: float
    stuck_omega: float
    overlap: float
    pairs: Indices
    drifting: float = 0.0

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
        The load whose static response picks the stuck mode.
    search : int
        How many modes to look at.
    least : float
        Lowest circular frequency of the mode, over that of the highest one looked at: bodies that nothing
        holds have motions below it.
    """
    p = structure.loads[load]
    sliding, stuck = (linear_modes(structure, held, search, align=load) for held in bonded)
    work = np.abs(stuck.shapes.T @ p) / np.maximum(stuck.omega, 1e-6 * stuck.omega[-1]) ** 2
    vibrates = sliding.omega >= least * sliding.omega[-1]
    k = largest_of(work, stuck.omega >= least * stuck.omega[-1])
    overlap = sliding.shapes.T @ (structure.mass @ stuck.shapes[:, k])
    partner = largest_of(overlap**2, vibrates)
    sign = 1.0 if overlap[partner] >= 0 else -1.0
    return LinearStates(
        sliding=sign * sliding.shapes[:, partner],
        stuck=stuck.shapes[:, k],
        sliding_omega=float(sliding.omega[partner]),
        stuck_omega=float(stuck.omega[k]),
        overlap=float(abs(overlap[partner])),
        pairs=np.asarray(pairs),
        drifting=float((overlap[~vibrates] ** 2).sum()),
    )


def largest_of(values: Array, among: Mask) -> int:
    """Index of the largest of some values, none of them negative.

    Examples
    --------
    >>> largest_of(np.array([3.0, 1.0, 2.0]), np.array([False, True, True]))
    2
    """
    return int(np.argmax(np.where(among, values, -1.0)))

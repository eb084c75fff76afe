"""Contact fields: what acts and moves at every pair, with the signs that all results have.

Pressure is positive in compression. The traction ``f`` acts on the upper body along x, so
``f = -r_t / area``: forward slip, where the upper body moves towards +x, has ``f = -mu p``. Slip is
the tangential displacement of the upper body relative to the lower, counted from prestress; the gap
is positive where the interface is open. All quantities are per metre of width.

Tractions are nodal forces over nodal areas: exact where the pressure is linear over an element,
unsmoothed everywhere, so that they integrate to the forces and stay inside the friction cone.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from microslip.analyses.statics.cycle import Prestress
from microslip.contact.pairs import normal, tangential
from microslip.model.joint import JointModel
from microslip.typing import Array, Mask


@dataclass(frozen=True)
class ContactFields:
    """Contact fields of planar pairs, each ``(..., m)``; signs in the header of this module.

    Attributes
    ----------
    pressure, traction : arrays
        Pa.
    slip, gap : arrays
        m; slip relative to prestress.
    """

    pressure: Array
    traction: Array
    slip: Array
    gap: Array


def contact_fields(r: Array, v: Array, start: Prestress, model: JointModel) -> ContactFields:
    """Tractions, slip and gap of every pair from reactions and relative displacements.

    Parameters
    ----------
    r, v : (..., 2 m) arrays
        N per metre of width, and m.
    start : Prestress
    model : JointModel
    """
    return ContactFields(
        pressure=normal(r) / model.area,
        traction=-tangential(r) / model.area,
        slip=tangential(v) - tangential(start.solution.v),
        gap=-normal(v),
    )


def contact_extent(position: Array, touching: Mask) -> tuple[float, float]:
    """Ends of the patch of touching pairs that holds the centre, or lies nearest to it.

    Patches that close separately, at the tips of the beams, do not count.

    Examples
    --------
    >>> x = np.linspace(-3, 3, 7)
    >>> contact_extent(x, np.array([True, False, True, True, True, True, False]))
    (-1.0, 2.0)
    """
    if not touching.any():
        return math.nan, math.nan
    pairs = np.flatnonzero(touching)
    left = right = int(pairs[np.argmin(np.abs(position[pairs]))])
    while left > 0 and touching[left - 1]:
        left -= 1
    while right < len(touching) - 1 and touching[right + 1]:
        right += 1
    return float(position[left]), float(position[right])

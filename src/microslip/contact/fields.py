"""Contact fields by name, from reactions and relative displacements of the pairs.

Signs. Pressure is positive in compression. The traction ``f`` acts on the upper body along x, so
``f = -r_t / area``: forward slip, where the upper body moves towards +x, has ``f = -mu p``. Slip is
the tangential displacement of the upper body relative to the lower, counted from prestress; the gap
is positive where the interface is open. Tractions and slips of spatial pairs are vectors in the two
tangential directions of the pair; the components of r for each pair say which pairs they are.

Tractions are nodal forces over nodal areas: exact where the pressure is linear over an element,
unsmoothed everywhere, so that they integrate to the forces and stay inside the friction cone.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from microslip.brief import Brief
from microslip.contact.pairs import normal, tangential, tangential_vectors
from microslip.typing import Array, Mask


@dataclass(frozen=True, repr=False)
class ContactFields(Brief):
    """Contact fields, each ``(..., m)``, spatial vectors ``(..., m, 2)``; signs in the module's header.

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


def contact_fields(r: Array, v: Array, rest: Array, area: Array) -> ContactFields:
    """Tractions, slip and gap of every pair.

    Parameters
    ----------
    r, v : (..., d m) arrays
        Reactions (N, per metre of width in two dimensions) and relative displacements (m).
    rest : (d m,) array
        Relative displacements at prestress, m.
    area : (m,) array
        Of the pairs, m² (m per metre of width in two dimensions).

    Examples
    --------
    One pair of area 2 that carries 6 N/m and has slipped forward by 1 µm:

    >>> r, v = np.array([6.0, 3.0]), np.array([0.0, 1e-6])
    >>> found = contact_fields(r, v, np.zeros(2), np.array([2.0]))
    >>> found.pressure, found.traction, found.slip
    (array([3.]), array([-1.5]), array([1.e-06]))
    """
    dimension = r.shape[-1] // len(area)
    if dimension != 2:
        return ContactFields(
            pressure=normal(r, dimension) / area,
            traction=-tangential_vectors(r) / area[:, None],
            slip=tangential_vectors(v) - tangential_vectors(rest),
            gap=-normal(v, dimension),
        )
    return ContactFields(
        pressure=normal(r) / area,
        traction=-tangential(r) / area,
        slip=tangential(v) - tangential(rest),
        gap=-normal(v),
    )


def contact_extent(position: Array, touching: Mask) -> tuple[float, float]:
    """Ends of the patch of touching pairs that holds the middle of the interface, or lies nearest to it.

    Patches that close separately, at the tips of the beams, do not count. Of pairs that are not in line, on a
    surface or on several interfaces, the ends of all that touch.

    Examples
    --------
    >>> x = np.linspace(-3, 3, 7)
    >>> contact_extent(x, np.array([True, False, True, True, True, True, False]))
    (-1.0, 2.0)
    >>> contact_extent(x + 103.0, np.array([True, False, True, True, True, True, False]))
    (102.0, 105.0)
    """
    if not touching.any():
        return math.nan, math.nan
    pairs = np.flatnonzero(touching)
    if (np.diff(position) <= 0).any():
        return float(position[pairs].min()), float(position[pairs].max())
    middle = 0.5 * (position[0] + position[-1])
    left = right = int(pairs[np.argmin(np.abs(position[pairs] - middle))])
    while left > 0 and touching[left - 1]:
        left -= 1
    while right < len(touching) - 1 and touching[right + 1]:
        right += 1
    return float(position[left]), float(position[right])

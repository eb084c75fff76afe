"""Normals of pairs on planes of symmetry.

Half a structure, held along the normal of its plane of symmetry, has contact pairs at the edge of a curved
surface, where the mean normal of the facets leans out of that plane. By symmetry the normal lies in it: what
a support holds at a node is taken out of the normal there, unless little else of it is left.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from microslip.model.mortar.coupling import MortarCoupling
from microslip.model.mortar.segments import tangents_of
from microslip.typing import Mask

LEANS = 0.5
"""Sine of the angle up to which a normal is taken to lean out of the plane."""


def in_planes_of_symmetry(coupling: MortarCoupling, held: Mask) -> MortarCoupling:
    """The coupling with normals that do not lean towards what supports hold.

    Parameters
    ----------
    coupling : MortarCoupling
    held : (n, d) bool array
        Components of the nodes of the mesh that do not move.
    """
    own = held[coupling.nodes]
    leaning = np.linalg.norm(np.where(own, coupling.normal, 0.0), axis=1)
    moved = (leaning > 0) & (leaning <= LEANS)
    if not moved.any():
        return coupling
    normal = coupling.normal.copy()
    normal[moved] = np.where(own, 0.0, normal)[moved]
    normal[moved] /= np.linalg.norm(normal[moved], axis=1, keepdims=True)
    tangents = coupling.tangents.copy()
    tangents[moved] = tangents_of(normal[moved])
    return replace(coupling, normal=normal, tangents=tangents)

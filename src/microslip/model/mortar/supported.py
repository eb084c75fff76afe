"""Pairs on planes of symmetry.

Half a structure, held along the normal of its plane of symmetry, has contact pairs on that plane. By symmetry
their normals lie in it: of a curved surface the mean normal of the facets leans out of it, and what a support
holds at a node is taken out of the normal there, unless little else of it is left. By symmetry, too, nothing
slips across the plane and no traction acts across it. Where nodes do not match, the mean over the master's
facets reaches inside and would move a little, too little for a flexibility: that component is left out.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from microslip.model.mortar.coupling import MortarCoupling
from microslip.model.mortar.segments import tangents_of
from microslip.typing import Array, Mask

LEANS = 0.5
"""Sine of the angle up to which a normal is taken to lean out of the plane."""


SAME = 1e-9
"""Of the size of an interface: nodes of both sides that are no farther apart across it lie in one plane."""


def in_planes_of_symmetry(coupling: MortarCoupling, held: Mask, points: Array) -> MortarCoupling:
    """The coupling with normals, and without slip, across planes in which supports hold both sides.

    Parameters
    ----------
    coupling : MortarCoupling
    held : (n, d) bool array
        Components of the nodes of the mesh that do not move.
    points : (n, d) array
        The nodes.
    """
    own = held[coupling.nodes]
    leaning = np.linalg.norm(np.where(own, coupling.normal, 0.0), axis=1)
    moved = (leaning > 0) & (leaning <= LEANS)
    normal, tangents = coupling.normal.copy(), coupling.tangents.copy()
    normal[moved] = np.where(own, 0.0, normal)[moved]
    normal[moved] /= np.linalg.norm(normal[moved], axis=1, keepdims=True)
    tangents[moved] = tangents_of(normal[moved])
    both = own & _on_both_sides(coupling, held, points)
    still = (np.where(both[:, None], 0.0, tangents) == 0.0).all(axis=2)
    return replace(coupling, normal=normal, tangents=tangents, still=still)


def _on_both_sides(coupling: MortarCoupling, held: Mask, points: Array) -> Mask:
    """(m, d) whether the master of a pair has a node in the same plane across a component that it holds."""
    met = coupling.master_weights.tocoo()
    near = SAME * np.ptp(coupling.points, axis=0).max()
    in_plane = np.abs(points[met.col] - coupling.points[met.row]) <= near
    out = np.zeros(coupling.points.shape, dtype=bool)
    np.logical_or.at(out, met.row, in_plane & held[met.col])
    return out

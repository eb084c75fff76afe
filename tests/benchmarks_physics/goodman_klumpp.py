"""Goodman & Klumpp's pressed cantilevers: two beams that slip on each other in bending.

Two beams, each h high and L long, are clamped at ``x = 0`` and pressed together by an even pressure
p on their outer faces; the tip load F is halved over both tips. The plane of contact is the neutral
axis of the whole, where beam theory has an even shear stress ``3 F / (4 h)`` (per metre of width):
it slips everywhere at once when that reaches ``mu p``, and then dissipates per cycle

    D = 8 mu p L³ / (E h²) (F - F_slip),    F_slip = (4/3) mu p h.

The normal support of the clamped end is the contact corner of each beam: then the pressure of
contact is exactly p before bending, and bending, odd about the plane of contact, does not change it.
"""

from __future__ import annotations

import numpy as np
import scipy.sparse as sp
import skfem

from microslip.model.elasticity import Material, elastic_body, traction_load
from microslip.model.interface import Interface, matching_interface
from microslip.model.structure import Structure, constrain


def pressed_cantilevers(
    length: float, thickness: float, material: Material, along: int, through: int
) -> Structure:
    """Two pressed cantilevers with `along` x `through` elements each.

    Loads: ``clamp`` a unit force pressing both outer faces over the whole length, ``tip`` a unit
    downward force, half of it spread over each tip. The pair at the clamped end cannot move and is
    left out of the interface.
    """
    x = np.linspace(0, length, along + 1)
    y = np.linspace(0, thickness, through + 1)
    tol = 1e-9 * length
    stiffness, mass, clamp, tip, nodes, meshes = [], [], [], [], [], []
    for side, layer in ((-1.0, -y[::-1]), (1.0, y)):
        mesh = skfem.MeshQuad.init_tensor(x, layer)
        body = elastic_body(mesh, material)
        outer = mesh.facets_satisfying(
            lambda p, side=side: np.abs(p[1] - side * thickness) < tol, True
        )
        end = mesh.facets_satisfying(lambda p: np.abs(p[0] - length) < tol, True)
        press = -side / length
        clamp.append(traction_load(body, outer, lambda x, y, p=press: (0 * x, p + 0 * x)))
        shear = -0.5 / thickness
        tip.append(traction_load(body, end, lambda x, y, s=shear: (0 * x, s + 0 * x)))
        stiffness.append(body.stiffness)
        mass.append(body.mass)
        nodes.append(body.nodes)
        meshes.append(mesh)
    count = nodes[0].shape[1]
    lines, fixed = [], []
    for offset, points in zip((0, count), nodes, strict=True):
        on = np.flatnonzero(np.abs(points[1]) < tol)
        on = on[np.argsort(points[0, on])]
        lines.append(offset + on)
        clamped = offset + np.flatnonzero(np.abs(points[0]) < tol)
        fixed += [*(2 * clamped), 2 * lines[-1][0] + 1]
    whole = matching_interface(lines[0], lines[1], np.sort(nodes[0][0, lines[0]]), 4 * count)
    interface = Interface(whole.position[1:], whole.area[1:], whole.relative[2:])
    return constrain(
        sp.block_diag(stiffness, format="csc"),
        sp.block_diag(mass, format="csc"),
        interface,
        {"clamp": np.concatenate(clamp), "tip": np.concatenate(tip)},
        np.array(fixed, dtype=np.int64),
        tuple(meshes),
    )

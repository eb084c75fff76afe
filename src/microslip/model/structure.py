"""Finite-element structures ready for reduction: matrices, interface and named load vectors.

A `Structure` is all that the rest of the program sees of a mesh: constrained degrees of freedom
are already removed.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from functools import partial

import numpy as np
import scipy.sparse as sp
import skfem

from microslip.brief import Brief
from microslip.model.elasticity import (
    Material,
    elastic_body,
    pressed_length_load,
    traction_load,
    traction_stiffness,
)
from microslip.model.interface import Interface, matching_interface
from microslip.model.lap_mesh import LapGeometry, MeshControl, lap_joint_meshes
from microslip.typing import Array, Indices


@dataclass(frozen=True, repr=False)
class Structure(Brief):
    """Two (or more) bodies with free interfaces.

    Attributes
    ----------
    stiffness, mass : (n, n) sparse
        Free of any contact; per metre of width in 2D.
    interface : Interface
    loads : mapping of str to (n,) array
        Unit load vectors by name. A load is also an output: ``load @ x`` is its conjugate
        displacement.
    free : (n,) int array
        Degree of freedom of the mesh behind each one here.
    meshes : tuple of skfem.MeshQuad
        For pictures; empty where the structure did not come from a mesh.
    """

    stiffness: sp.csc_matrix
    mass: sp.csc_matrix
    interface: Interface
    loads: Mapping[str, Array]
    free: Indices
    meshes: tuple[skfem.MeshQuad, ...] = field(default=())

    @property
    def dofs(self) -> int:
        """Number of degrees of freedom."""
        return self.stiffness.shape[0]


def lap_joint_structure(
    geometry: LapGeometry,
    material: Material,
    control: MeshControl,
    *,
    horizontal_spring: float,
    vertical_support: str = "middle",
) -> Structure:
    """The lap joint: two beams, supports and unit loads, per metre of width.

    Loads (unit amplitude): ``clamp`` 1 N/m pressing both outer faces over the clamped length;
    ``moment`` 1 N m/m at both far ends, positive bends the joint concave up, applied as a linear
    traction over the end faces. Outputs: ``u_clamp_edge`` horizontal displacement of the lower
    contact node nearest to ``x = clamp_half_length``, ``lift`` vertical displacement of the middle
    of the joint (mean of both beams at ``x = 0``).

    Parameters
    ----------
    geometry, material, control
        See their classes.
    horizontal_spring : float
        Stiffness of the horizontal springs at each far end, N/m per metre of width, spread evenly
        over the end face.
    vertical_support : str
        ``"middle"`` holds the node nearest to mid-height of each far end, ``"none"`` holds none.
    """
    g = geometry
    lower_mesh, upper_mesh = lap_joint_meshes(g, control)
    lower, upper = elastic_body(lower_mesh, material), elastic_body(upper_mesh, material)
    count = lower.nodes.shape[1]
    tol = 1e-9 * g.length
    stiffness, mass = [], []
    clamp, moment = [], []
    fixed = []
    for offset, body, side in ((0, lower, -1.0), (count, upper, 1.0)):
        mesh = body.mesh
        far = side * (g.length - g.overlap_half_length)
        middle = side * g.thickness / 2
        end = mesh.facets_satisfying(lambda x, far=far: np.abs(x[0] - far) < tol, True)
        outer = mesh.facets_satisfying(
            lambda x, side=side: np.abs(x[1] - side * g.thickness) < tol, True
        )
        spring = traction_stiffness(body, end, horizontal_spring / g.thickness, 0)
        stiffness.append(body.stiffness + spring)
        mass.append(body.mass)
        clamp.append(-side * pressed_length_load(body, outer, g.clamp_half_length))
        gradient = -side * 12 / g.thickness**3
        traction = partial(_linear_traction, centre=middle, gradient=gradient)
        moment.append(traction_load(body, end, traction))
        if vertical_support == "middle":
            distance = np.hypot(body.nodes[0] - far, body.nodes[1] - middle)
            fixed.append(2 * (offset + int(np.argmin(distance))) + 1)
    total = 4 * count
    lower_nodes = _interface_nodes(lower.nodes, g.overlap_half_length, tol)
    upper_nodes = count + _interface_nodes(upper.nodes, g.overlap_half_length, tol)
    interface = matching_interface(
        lower_nodes,
        upper_nodes,
        lower.nodes[0, lower_nodes],
        total,
        image=np.arange(len(lower_nodes))[::-1].copy(),
    )
    observe = np.zeros(total)
    near = int(np.argmin(np.abs(interface.position - g.clamp_half_length)))
    observe[2 * lower_nodes[near]] = 1.0
    lift = np.zeros(total)
    centre = int(np.argmin(np.abs(interface.position)))
    lift[2 * lower_nodes[centre] + 1] = lift[2 * upper_nodes[centre] + 1] = 0.5
    loads = {
        "clamp": np.concatenate(clamp),
        "moment": np.concatenate(moment),
        "u_clamp_edge": observe,
        "lift": lift,
    }
    return constrain(
        sp.block_diag(stiffness, format="csc"),
        sp.block_diag(mass, format="csc"),
        interface,
        loads,
        np.array(fixed, dtype=np.int64),
        (lower_mesh, upper_mesh),
    )


def _linear_traction(x: Array, y: Array, centre: float, gradient: float) -> tuple[Array, Array]:
    """Horizontal traction that grows linearly over the height, as bending stress does."""
    return gradient * (y - centre), np.zeros_like(x)


def _interface_nodes(nodes: Array, half_length: float, tol: float) -> Indices:
    """Nodes on ``y = 0`` within the overlap, in order of ascending x."""
    on = np.flatnonzero((np.abs(nodes[1]) < tol) & (np.abs(nodes[0]) <= half_length + tol))
    return on[np.argsort(nodes[0, on])]


def constrain(
    stiffness: sp.csc_matrix,
    mass: sp.csc_matrix,
    interface: Interface,
    loads: Mapping[str, Array],
    fixed: Indices,
    meshes: tuple[skfem.MeshQuad, ...] = (),
) -> Structure:
    """Remove the degrees of freedom in `fixed` (held at zero)."""
    free = np.setdiff1d(np.arange(stiffness.shape[0]), fixed)
    return Structure(
        stiffness=stiffness[free][:, free].tocsc(),
        mass=mass[free][:, free].tocsc(),
        interface=replace(interface, relative=interface.relative[:, free].tocsr()),
        loads={name: load[free] for name, load in loads.items()},
        free=free,
        meshes=meshes,
    )

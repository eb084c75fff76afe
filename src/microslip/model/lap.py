"""The finite elements of a lap joint, from its description.

`structure_of` is all that a run needs; `lap_joint_structure` is what it calls, for those who have
dimensions and a material and no description.
"""

from __future__ import annotations

from functools import partial

import numpy as np
import scipy.sparse as sp
from numpy.typing import NDArray

from microslip.describe.lap import LapJoint
from microslip.model.elasticity import (
    Material,
    elastic_body,
    pressed_length_load,
    traction_load,
    traction_stiffness,
)
from microslip.model.interface import matching_interface
from microslip.model.lap_mesh import LapGeometry, MeshControl, lap_joint_meshes
from microslip.model.points import with_outputs
from microslip.model.structure import Structure, constrain
from microslip.typing import Array


def geometry(joint: LapJoint) -> LapGeometry:
    """Dimensions of a described joint, m."""
    b = joint.beams
    return LapGeometry(b.length, b.thickness, b.overlap_half_length, joint.clamp.half_length)


def material(joint: LapJoint) -> Material:
    """Material of both beams of a described joint."""
    m = joint.material
    return Material(m.youngs_modulus, m.poissons_ratio, m.density, m.plane)


def mesh_control(joint: LapJoint) -> MeshControl:
    """Fineness of the mesh, with the number of contact pairs that is used."""
    m = joint.mesh
    return MeshControl(joint.contact.pairs_used, m.overlap_growth, m.max_layer, m.rest_size)


def structure_of(joint: LapJoint) -> Structure:
    """Matrices, interface and unit loads of a described joint, as `lap_joint_structure` says.

    Every output of the description is a load beside them, see `microslip.model.points`.
    """
    structure = lap_joint_structure(
        geometry(joint),
        material(joint),
        mesh_control(joint),
        horizontal_spring=joint.support.horizontal_spring,
    )
    return with_outputs(structure, joint.outputs, joint.clamp.half_length)


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


def _interface_nodes(nodes: Array, half_length: float, tol: float) -> NDArray[np.int64]:
    """Nodes on ``y = 0`` within the overlap, in order of ascending x."""
    on = np.flatnonzero((np.abs(nodes[1]) < tol) & (np.abs(nodes[0]) <= half_length + tol))
    return on[np.argsort(nodes[0, on])]

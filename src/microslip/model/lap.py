"""The finite elements of a lap joint, from its description.

`structure_of` is all that a run needs; `lap_joint_structure` is what it calls, for those who have
dimensions and a material and no description.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
import scipy.sparse as sp
from numpy.typing import NDArray

from microslip.describe.lap import LapJoint
from microslip.errors import ModelError
from microslip.model.bodies import rigid_motions
from microslip.model.elasticity import Body, Material, elastic_body, traction_stiffness
from microslip.model.end_loads import (
    BOTH,
    CLAMPED,
    FREE,
    PINNED,
    EndLoad,
    EndReaction,
    FarEnd,
    end_load,
    end_motion,
)
from microslip.model.interface import matching_interface
from microslip.model.lap_mesh import LapGeometry, MeshControl, lap_joint_meshes
from microslip.model.points import with_outputs
from microslip.model.pressing import Pressing, parabolic, pressed_load, tabulated, uniform
from microslip.model.reactions import FreeStructure, with_held
from microslip.model.structure import Structure, constrain
from microslip.typing import Array, Indices

SIDES = (-1.0, 1.0)
"""Where the lower and the upper beam have their far ends."""


def geometry(joint: LapJoint) -> LapGeometry:
    """Dimensions of a described joint, m."""
    b, clamp = joint.beams, joint.clamp
    return LapGeometry(
        b.length,
        b.thickness,
        b.overlap_half_length,
        clamp.half_length,
        clamp.centre,
        b.upper.length,
        b.upper.thickness,
    )


def materials(joint: LapJoint) -> tuple[Material, Material]:
    """Materials of the lower and the upper beam of a described joint."""
    m = joint.material
    lower, upper = zip(m.moduli, m.ratios, m.densities, strict=True)
    return Material(*lower, m.plane), Material(*upper, m.plane)


def pressing(joint: LapJoint) -> Pressing:
    """How the clamp of a described joint presses."""
    clamp = joint.clamp
    if isinstance(clamp.pressure, str):
        named = {"uniform": uniform, "parabolic": parabolic}[clamp.pressure]
        return named(clamp.centre, clamp.half_length)
    return tabulated(clamp.centre + np.array(clamp.pressure.x), np.array(clamp.pressure.values))


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
        materials(joint),
        mesh_control(joint),
        horizontal_spring=joint.spring_used,
        clamp=pressing(joint),
        ends=(joint.support.left, joint.support.right),
        weak_spring=joint.weak_spring,
        ports=[EndLoad(port.name, port.kind, port.at or BOTH, port.axis) for port in joint.ports],
        reactions=[
            EndReaction(output.port, str(output.x).removesuffix(" end"), output.direction)
            for output in joint.outputs
            if output.reacts
        ],
    )
    return with_outputs(structure, joint.outputs, joint.clamp.edge)


def lap_joint_structure(
    geometry: LapGeometry,
    material: Material | tuple[Material, Material],
    control: MeshControl,
    *,
    horizontal_spring: float,
    clamp: Pressing | None = None,
    ends: tuple[str, str] = (PINNED, PINNED),
    weak_spring: float = 0.0,
    ports: Sequence[EndLoad] = (),
    reactions: Sequence[EndReaction] = (),
) -> Structure:
    """The lap joint: two beams, supports and unit loads, per metre of width.

    Loads (unit amplitude): ``clamp`` 1 N/m pressing both outer faces over the clamped length;
    ``moment`` 1 N m/m at both far ends, positive bends the joint concave up, applied as a linear
    traction over the end faces; those of `ports`. Outputs: ``u_clamp_edge`` horizontal displacement
    of the lower contact node nearest to the right end of the clamp, ``lift`` vertical displacement
    of the middle of the joint (mean of both beams at ``x = 0``).

    Parameters
    ----------
    geometry : LapGeometry
    material : Material or pair of Material
        Of both beams, or of the lower and the upper one.
    control : MeshControl
    horizontal_spring : float
        Stiffness of the horizontal springs at each pinned end, N/m per metre of width, spread
        evenly over the end face.
    clamp : Pressing, optional
        How the clamp presses; evenly over the clamped length when left out.
    ends : pair of str
        What holds the left and the right far end: ``"pinned"`` holds the node nearest to its
        mid-height vertically, ``"clamped"`` the whole face, ``"free"`` nothing.
    weak_spring : float
        Stiffness of springs at a free end, in the same unit, that hold the mean position: horizontal
        ones, and vertical ones; these, where an end is clamped, are weaker by thickness over
        length, because a slender cantilever would feel them.
    ports : sequence of EndLoad
        Further loads, by name.
    reactions : sequence of EndReaction
        What the supports of ends hold with, as outputs.
    """
    g = geometry
    both = (material, material) if isinstance(material, Material) else material
    pressed = clamp or uniform(g.clamp_centre, g.clamp_half_length)
    sides = tuple(
        _far_end(side, elastic_body(mesh, own), length, thickness, g.overlap_half_length)
        for side, mesh, own, length, thickness in zip(
            SIDES, lap_joint_meshes(g, control), both, g.lengths, g.thicknesses, strict=True
        )
    )
    lower, upper = (side.body for side in sides)
    count = lower.nodes.shape[1]
    total = 2 * (count + upper.nodes.shape[1])
    tol = 1e-9 * max(g.lengths)
    slender = min(g.thicknesses) / sum(g.lengths)
    supports, presses, motions, fixed = [], [], [], []
    for offset, end, kind in zip((0, count), sides, ends, strict=True):
        body = end.body
        spring = {PINNED: horizontal_spring, FREE: weak_spring, CLAMPED: 0.0}[kind]
        along = traction_stiffness(body, end.face, spring / end.thickness, 0)
        if kind == FREE:
            across = spring * (slender if CLAMPED in ends else 1.0)
            along = along + traction_stiffness(body, end.face, across / end.thickness, 1)
        supports.append(along)
        outer = body.mesh.facets_satisfying(
            lambda x, end=end: np.abs(x[1] - end.side * end.thickness) < tol, True
        )
        presses.append(-end.side * pressed_load(body, outer, pressed))
        motions.append(rigid_motions(body.nodes, offset, total))
        fixed.append(2 * offset + held_dofs(end, kind))
    lower_nodes = _interface_nodes(lower.nodes, g.overlap_half_length, tol)
    upper_nodes = count + _interface_nodes(upper.nodes, g.overlap_half_length, tol)
    symmetric = (
        len(set(g.lengths)) == len(set(g.thicknesses)) == len(set(both)) == len(set(ends)) == 1
    )
    interface = matching_interface(
        lower_nodes,
        upper_nodes,
        lower.nodes[0, lower_nodes],
        total,
        image=np.arange(len(lower_nodes))[::-1].copy() if symmetric and pressed.symmetric else None,
    )
    observe = np.zeros(total)
    near = int(np.argmin(np.abs(interface.position - g.clamp_centre - g.clamp_half_length)))
    observe[2 * lower_nodes[near]] = 1.0
    lift = np.zeros(total)
    centre = int(np.argmin(np.abs(interface.position)))
    lift[2 * lower_nodes[centre] + 1] = lift[2 * upper_nodes[centre] + 1] = 0.5
    loads = {
        "clamp": np.concatenate(presses),
        "moment": end_load(EndLoad("moment", "moment"), sides),
        "u_clamp_edge": observe,
        "lift": lift,
    }
    structure = FreeStructure(
        stiffness=sp.block_diag(
            [side.body.stiffness + k for side, k in zip(sides, supports, strict=True)], format="csc"
        ),
        mass=sp.block_diag([side.body.mass for side in sides], format="csc"),
        supports=sp.block_diag(supports, format="csc"),
        interface=interface,
        loads=loads | {port.name: end_load(port, sides) for port in ports},
        fixed=np.concatenate(fixed),
    )
    held = constrain(
        structure.stiffness,
        structure.mass,
        interface,
        structure.loads,
        structure.fixed,
        (lower.mesh, upper.mesh),
        motions=np.hstack(motions),
        supports=structure.supports,
    )
    return with_held(held, structure, {each.name: end_motion(each, sides) for each in reactions})


def _far_end(side: float, body: Body, length: float, thickness: float, overlap: float) -> FarEnd:
    far = side * (length - overlap)
    tol = 1e-9 * length
    face = body.mesh.facets_satisfying(lambda x: np.abs(x[0] - far) < tol, True)
    return FarEnd(side, body, far, thickness, face)


def held_dofs(end: FarEnd, kind: str) -> Indices:
    """Degrees of freedom of a body that the support of its far end holds.

    Raises
    ------
    ModelError
        Where there is no such support.
    """
    nodes = end.body.nodes
    if kind == FREE:
        return np.zeros(0, dtype=np.int64)
    if kind == CLAMPED:
        on = np.flatnonzero(np.abs(nodes[0] - end.x) < 1e-9 * np.abs(end.x))
        return np.sort(np.concatenate([2 * on, 2 * on + 1]))
    if kind == PINNED:
        distance = np.hypot(nodes[0] - end.x, nodes[1] - end.middle)
        return np.array([2 * int(np.argmin(distance)) + 1])
    raise ModelError(f"no support {kind!r}: choose {PINNED}, {CLAMPED} or {FREE}")


def _interface_nodes(nodes: Array, half_length: float, tol: float) -> NDArray[np.int64]:
    """Nodes on ``y = 0`` within the overlap, in order of ascending x."""
    on = np.flatnonzero((np.abs(nodes[1]) < tol) & (np.abs(nodes[0]) <= half_length + tol))
    return on[np.argsort(nodes[0, on])]

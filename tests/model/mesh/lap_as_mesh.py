"""The lap joint of a description as a mesh that knows nothing of laps."""

from __future__ import annotations

import numpy as np

from microslip.model.lap import geometry, materials, mesh_control
from microslip.model.lap_mesh import lap_joint_meshes
from microslip.model.mesh.boundary import boundary
from microslip.model.mesh.finite_elements import Block, FiniteElementMesh, Section, Surface


def lap_as_mesh(joint):
    """Points in the order of the degrees of freedom of `structure_of`."""
    g = geometry(joint)
    points, blocks, first, sets = [], [], 0, {}
    for name, mesh in zip(
        ("lower", "upper"), lap_joint_meshes(g, mesh_control(joint)), strict=True
    ):
        middle = mesh.p[:, mesh.facets].mean(axis=1)
        own = np.hstack([mesh.p, middle]).T
        nodes = np.vstack([mesh.t, mesh.p.shape[1] + mesh.t2f]).T + first
        labels = 1 + sum(b.count for b in blocks) + np.arange(len(nodes))
        sets[name] = labels - 1
        blocks.append(Block("quad8", nodes, labels))
        points.append(own)
        first += len(own)
    points = np.vstack(points)
    faces, _ = boundary(blocks)
    ends = []
    for e, f in zip(faces.elements, faces.faces, strict=True):
        block = blocks[0] if e < blocks[0].count else blocks[1]
        own = block.nodes[e if e < blocks[0].count else e - blocks[0].count]
        ends.append(points[own[list(block.type.faces[f][1])]])
    x, y = np.array(ends)[:, :, 0], np.array(ends)[:, :, 1]
    lower = faces.elements < blocks[0].count
    far = [g.overlap_half_length - g.lengths[0], g.lengths[1] - g.overlap_half_length]

    def named(chosen):
        return Surface(faces.elements[chosen], faces.faces[chosen])

    contact = (np.abs(y) < 1e-12).all(1) & (np.abs(x) < g.overlap_half_length * (1 + 1e-9)).all(1)
    surfaces = {
        "lower_contact": named(contact & lower),
        "upper_contact": named(contact & ~lower),
        "left_end": named((np.abs(x - far[0]) < 1e-12).all(1)),
        "right_end": named((np.abs(x - far[1]) < 1e-12).all(1)),
    }
    below, above = materials(joint)
    return FiniteElementMesh(
        points,
        1 + np.arange(len(points)),
        tuple(blocks),
        element_sets=sets,
        surfaces=surfaces,
        materials={"below": below, "above": above},
        sections=(Section("lower", "below"), Section("upper", "above")),
    )

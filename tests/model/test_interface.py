"""Contact pairs: rigid motions, areas and the half-turn symmetry of the mesh."""

from __future__ import annotations

import numpy as np
import pytest
from conftest import GEOMETRY, MATERIAL, joint_structure

from microslip.contact.pairs import normal, tangential
from microslip.model.elasticity import elastic_body
from microslip.model.interface import matching_interface, nodal_areas
from microslip.model.lap_mesh import LapGeometry, MeshControl, lap_joint_meshes


@pytest.fixture(scope="module", params=[21, 51])
def joint(request):
    structure = joint_structure(request.param)
    nodes = [elastic_body(mesh, MATERIAL).nodes for mesh in structure.meshes]
    return structure, nodes


def displacement(structure, nodes, lower, upper):
    """Displacement of the structure from ``(x, y) -> (u_x, u_y)`` of each body."""
    full = np.concatenate(
        [np.column_stack(f(*xy)).ravel() for f, xy in zip((lower, upper), nodes, strict=True)]
    )
    return full[structure.free]


def still(x, y):
    return 0 * x, 0 * x


RIGID = {
    "x": lambda x, y: (1 + 0 * x, 0 * x),
    "y": lambda x, y: (0 * x, 1 + 0 * x),
    "turn": lambda x, y: (-y, x),
}


@pytest.mark.parametrize("name", RIGID)
def test_common_rigid_motion_is_no_relative_motion(joint, name):
    structure, nodes = joint
    move = RIGID[name]
    assert np.all(structure.interface.relative @ displacement(structure, nodes, move, move) == 0)


@pytest.mark.parametrize(
    ("name", "closes", "slips"), [("x", 0, 1), ("y", -1, 0), ("turn", "-x", 0)]
)
def test_upper_body_moves_alone(joint, name, closes, slips):
    """Moving up opens (v_n < 0), moving right slips forward (v_t > 0)."""
    structure, nodes = joint
    v = structure.interface.relative @ displacement(structure, nodes, still, RIGID[name])
    x = structure.interface.position
    assert np.array_equal(normal(v), -x if closes == "-x" else closes + 0 * x)
    assert np.array_equal(tangential(v), slips + 0 * x)


def test_lower_body_moving_up_closes(joint):
    structure, nodes = joint
    v = structure.interface.relative @ displacement(structure, nodes, RIGID["y"], still)
    assert np.all(normal(v) == 1)
    assert np.all(tangential(v) == 0)


def test_pairs_join_coincident_nodes(joint):
    structure, nodes = joint
    count = nodes[0].shape[1]
    xy = np.hstack(nodes)
    relative = structure.interface.relative
    for k in range(structure.interface.pairs):
        dofs = structure.free[relative[2 * k].indices]
        lower, upper = np.sort(dofs // 2)
        assert lower < count <= upper
        assert np.array_equal(xy[:, lower], xy[:, upper])
        assert xy[0, lower] == structure.interface.position[k]
        assert xy[1, lower] == 0


@pytest.mark.parametrize("pairs", [21, 51, 201])
def test_areas_sum_to_the_overlap(pairs):
    interface = joint_structure(pairs).interface
    assert interface.pairs == pairs
    assert interface.area.sum() == pytest.approx(2 * GEOMETRY.overlap_half_length, rel=1e-14)
    assert np.all(interface.area > 0)
    assert np.all(np.diff(interface.position) > 0)


def test_areas_integrate_cubics_on_an_uneven_line():
    corners = np.array([0.0, 0.1, 0.35, 0.5, 1.0])
    x = np.sort(np.concatenate([corners, 0.5 * (corners[1:] + corners[:-1])]))
    for power in range(4):
        assert nodal_areas(x) @ x**power == pytest.approx(1 / (power + 1), rel=1e-14)


def test_even_number_of_pairs_is_raised_by_one():
    assert joint_structure(20).interface.pairs == 21


@pytest.mark.parametrize(
    "geometry",
    [GEOMETRY, LapGeometry(0.3, 0.011, 0.047, 0.0313), LapGeometry(0.1, 0.01, 0.05, 0.02)],
)
@pytest.mark.parametrize("pairs", [21, 77])
def test_half_turn_maps_the_mesh_on_itself_bit_for_bit(geometry, pairs):
    lower, upper = lap_joint_meshes(geometry, MeshControl(contact_pairs=pairs))
    assert np.array_equal(upper.p, -lower.p)
    assert np.array_equal(upper.t, lower.t)
    a, b = elastic_body(lower, MATERIAL), elastic_body(upper, MATERIAL)
    assert np.array_equal(b.nodes, -a.nodes)
    on = np.abs(a.nodes[1]) == 0
    x = np.sort(a.nodes[0, on & (a.nodes[0] >= -geometry.overlap_half_length)])
    assert np.array_equal(x, -x[::-1])
    assert x[0] == -geometry.overlap_half_length


def test_half_turn_maps_the_matrices_on_each_other():
    """Element matrices are even in the coordinates, so the image has the same ones."""
    lower, upper = lap_joint_meshes(GEOMETRY, MeshControl(contact_pairs=21))
    a, b = elastic_body(lower, MATERIAL), elastic_body(upper, MATERIAL)
    for one, two in ((a.stiffness, b.stiffness), (a.mass, b.mass)):
        assert abs(one - two).max() <= 1e-15 * abs(one).max()


def test_meshes_fill_the_beams():
    lower, upper = lap_joint_meshes(GEOMETRY, MeshControl(contact_pairs=21))
    g = GEOMETRY
    for mesh, side in ((lower, -1), (upper, 1)):
        far = side * (g.length - g.overlap_half_length)
        near = -side * g.overlap_half_length
        assert sorted((mesh.p[0].min(), mesh.p[0].max())) == pytest.approx(sorted((near, far)))
        edges = sorted((0.0, side * g.thickness))
        assert sorted((mesh.p[1].min(), mesh.p[1].max())) == pytest.approx(edges)


def test_relative_displacement_and_reaction_do_the_same_work():
    """``B`` and ``B^T`` are conjugate: a pair of unit reactions presses the bodies apart."""
    interface = matching_interface(np.arange(3), np.arange(3, 6), np.array([0.0, 0.5, 1.0]), 12)
    force = -interface.relative.T @ np.eye(6)[0]  # K x = f - B^T r
    assert force[1] == -1  # lower node pushed down
    assert force[7] == 1  # upper node pushed up

"""Named points against fields that the elements hold exactly, reciprocity, and beam theory."""

from __future__ import annotations

import numpy as np
import pytest
import skfem
from scipy.sparse.linalg import spsolve

from microslip.describe.outputs import Output
from microslip.describe.reading import parse_joint
from microslip.errors import ModelError
from microslip.model.elasticity import Material, elastic_body, traction_load
from microslip.model.lap import structure_of
from microslip.model.points import (
    AXIAL,
    VERTICAL,
    bodies_of,
    output_load,
    point_load,
    rotation_load,
)

DOCUMENT = {
    "beams": {"length": "200 mm", "thickness": "10 mm", "overlap_half_length": "30 mm"},
    "material": {"youngs_modulus": "70 GPa", "poissons_ratio": 0.3, "density": "2 g/cm^3"},
    "contact": {"friction": 0.25, "pairs": 21},
    "clamp": {"force": "1 MN/m", "half_length": "20 mm"},
    "analysis": {"cycle": {}},
}
EXTENT = {"lower": (-0.17, 0.03), "upper": (-0.03, 0.17)}


def joint_with(**output):
    return parse_joint({**DOCUMENT, "output": [{"name": "wanted", **output}]})


@pytest.fixture(scope="module")
def structure():
    return structure_of(parse_joint(DOCUMENT))


def nodal(structure, lower, upper):
    """Displacements of all nodes from two fields ``(x, y) -> (u_x, u_y)``, one for each body."""
    values = []
    for mesh, field in zip(structure.meshes, (lower, upper), strict=True):
        nodes = elastic_body(mesh, Material(1.0, 0.0, 1.0)).nodes
        values.append(np.column_stack(field(*nodes)).ravel())
    return np.concatenate(values)


@pytest.mark.parametrize("x", [-0.17, -0.1234, -0.03, 0.0, 0.0123, 0.03])
@pytest.mark.parametrize("y", [-0.01, -0.0071, 0.0])
def test_quadratic_displacements_are_read_exactly(structure, x, y):
    def field(x, y):
        return 1 + 2 * x - 3 * y + 40 * x * y - 5 * y**2, 0.5 - x + 4 * y + 70 * x**2

    u = nodal(structure, field, field)
    lower = bodies_of(structure.meshes)[0]
    assert point_load(lower, x, y, AXIAL) @ u == pytest.approx(field(x, y)[0], rel=1e-12)
    assert point_load(lower, x, y, VERTICAL) @ u == pytest.approx(field(x, y)[1], rel=1e-12)


@pytest.mark.parametrize("x", [-0.17, -0.05, 0.0012, 0.03])
def test_a_turned_section_has_its_angle(structure, x):
    def turned(x, y):
        return 3e-3 - 2e-3 * y, 2e-3 * x

    u = nodal(structure, turned, turned)
    lower = bodies_of(structure.meshes)[0]
    assert rotation_load(lower, x) @ u == pytest.approx(2e-3, rel=1e-12)


def test_warping_that_bends_nothing_is_no_rotation(structure):
    """Stretch and a parabola over the height are orthogonal to a linear stress."""
    lower = bodies_of(structure.meshes)[0]
    u = nodal(structure, lambda x, y: (7 * x + 3 * (y + 0.005) ** 2, 0 * x), lambda x, y: (x, y))
    assert abs(rotation_load(lower, -0.0777) @ u) < 1e-12


def test_the_ends_turn_by_what_the_end_moments_do_work_on():
    structure = structure_of(
        parse_joint(
            {
                **DOCUMENT,
                "output": [
                    {"name": name, "quantity": "rotation", "x": f"{name} end"}
                    for name in ("left", "right")
                ],
            }
        )
    )
    loads = structure.loads
    difference = loads["output right"] - loads["output left"]
    assert difference == pytest.approx(loads["moment"], rel=1e-10, abs=1e-10)


@pytest.mark.parametrize("x", [0.0, 0.011, -0.0297])
def test_slip_is_how_far_the_upper_beam_moves_to_the_right(structure, x):
    def lower(x, y):
        return 1e-6 + 0 * x, 2e-6 * x

    def upper(x, y):
        return 1e-6 + 5e-4 * x**2, 2e-6 * x + 3e-6

    u = nodal(structure, lower, upper)
    bodies = bodies_of(structure.meshes)

    def read(quantity):
        return output_load(Output(name="o", quantity=quantity, x=x), bodies, 0.02) @ u

    assert read("slip") == pytest.approx(5e-4 * x**2, rel=1e-9, abs=1e-20)
    assert read("gap") == pytest.approx(3e-6, rel=1e-12)


def test_slip_between_pairs_is_interpolated_from_theirs(structure):
    """On an element of the interface three pairs define a parabola."""
    rng = np.random.default_rng(1)
    u = rng.normal(size=structure.dofs)
    interface = structure.interface
    v_t = (interface.relative @ u)[1::2]
    k = 6  # a corner, its mid-side and the next corner
    x = interface.position[k : k + 3]
    at = 0.3 * x[0] + 0.7 * x[2]
    bodies = bodies_of(structure.meshes)
    p = output_load(Output(name="o", quantity="slip", x=float(at)), bodies, 0.02)[structure.free]
    assert p @ u == pytest.approx(np.polyval(np.polyfit(x, v_t[k : k + 3], 2), at), rel=1e-9)


def test_the_usual_deflection_is_the_mean_of_both_beams_at_the_middle(structure):
    assert structure.loads["output deflection"] == pytest.approx(structure.loads["lift"], abs=1e-14)


@pytest.mark.parametrize(
    ("output", "place"),
    [
        ({"x": "left end"}, (-0.17, -0.005)),
        ({"x": "right end", "side": "top"}, (0.17, 0.01)),
        ({"x": "right end", "beam": "lower"}, (0.03, 0.0)),
        ({"x": "left end", "beam": "upper", "side": "bottom"}, (-0.03, 0.0)),
        ({"x": "100 mm", "side": "bottom"}, (0.1, 0.0)),
        ({"x": "clamp edge", "beam": "upper", "side": "mid-height"}, (0.02, 0.005)),
    ],
)
def test_words_for_places(output, place):
    joint = joint_with(**output)
    structure = structure_of(joint)
    field = nodal(structure, lambda x, y: (0 * x, x + 10 * y), lambda x, y: (0 * x, x + 10 * y))
    x, y = place
    if output.get("beam") == "lower" and "side" not in output:
        y = -0.005  # the middle of its height: it alone is asked for
    expected = x + 10 * y
    load = output_load(joint.outputs[0], bodies_of(structure.meshes), 0.02)
    assert load @ field == pytest.approx(expected, rel=1e-12)


def test_off_the_bodies_is_an_error(structure):
    lower = bodies_of(structure.meshes)[0]
    for x, y in ((0.2, -0.005), (0.0, 0.02)):
        with pytest.raises(ModelError, match="lies off the lower beam"):
            point_load(lower, x, y, AXIAL)


# a cantilever ---------------------------------------------------------------------------------------

LENGTH, HEIGHT = 1.0, 0.02
ALUMINIUM = Material(70e9, 0.3, 2700.0, "stress")
STIFFNESS = 70e9 * HEIGHT**3 / 12


@pytest.fixture(scope="module")
def cantilever():
    mesh = skfem.MeshQuad.init_tensor(np.linspace(0, LENGTH, 41), np.linspace(0, HEIGHT, 3))
    body = elastic_body(mesh, ALUMINIUM)
    free = np.flatnonzero(np.repeat(body.nodes[0] > 1e-9, 2))
    return body, bodies_of([mesh], ["beam"])[0], free


def solve(cantilever, load):
    body, _, free = cantilever
    u = np.zeros(len(load))
    u[free] = spsolve(body.stiffness[free][:, free], load[free])
    return u


def test_a_tip_force_bends_a_slender_cantilever(cantilever):
    _, beam, _ = cantilever
    force = point_load(beam, LENGTH, HEIGHT / 2, VERTICAL)
    u = solve(cantilever, force)
    assert force @ u == pytest.approx(LENGTH**3 / (3 * STIFFNESS), rel=0.01)
    half = point_load(beam, LENGTH / 2, HEIGHT, VERTICAL)
    assert half @ u == pytest.approx(5 * LENGTH**3 / (48 * STIFFNESS), rel=0.01)
    assert rotation_load(beam, LENGTH) @ u == pytest.approx(LENGTH**2 / (2 * STIFFNESS), rel=0.01)


def test_a_moment_turns_its_end(cantilever):
    """M L / E I; the other way round it deflects as a force turns: reciprocity."""
    _, beam, _ = cantilever
    moment = rotation_load(beam, LENGTH)
    force = point_load(beam, 0.3, HEIGHT, VERTICAL)
    assert moment @ solve(cantilever, moment) == pytest.approx(LENGTH / STIFFNESS, rel=0.01)
    one, other = force @ solve(cantilever, moment), moment @ solve(cantilever, force)
    assert one == pytest.approx(other, rel=1e-6)
    assert one == pytest.approx(0.3**2 / (2 * STIFFNESS), rel=0.01)


def test_a_unit_rotation_load_is_a_unit_moment_of_bending_stress(cantilever):
    body, beam, _ = cantilever
    end = body.mesh.facets_satisfying(lambda x: x[0] > LENGTH - 1e-9, True)
    gradient = -12 / HEIGHT**3
    traction = traction_load(
        body, end, lambda x, y: (gradient * (y - HEIGHT / 2), np.zeros_like(x))
    )
    assert rotation_load(beam, LENGTH) == pytest.approx(traction, rel=1e-9, abs=1e-9)

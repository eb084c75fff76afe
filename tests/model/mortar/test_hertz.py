"""Hertz' line contact: a cylinder on a flat of the same material, whose meshes do not match."""

import sys
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

sys.path.insert(0, str(Path(__file__).parents[1] / "mesh"))
from grids import box

from microslip.contact.pairs import FORWARD, normal, normal_rows
from microslip.contact.solver import ContactSolver
from microslip.model.elasticity import Material
from microslip.model.flexibility import static_flexibility
from microslip.model.joint import Reducer
from microslip.model.mesh.boundary import joined, surface_of_nodes, with_surfaces
from microslip.model.mesh.loads import resultant_load
from microslip.model.meshed import structure_from_mesh
from microslip.model.mortar.coupling import couple

STEEL = Material(210e9, 0.3, 7800.0)
WIDTH, RADIUS = 1.0, 0.4
HALF_WIDTH = 0.01


def graded(first, fine, last, growth=1.3):
    """From 0 to `last`, elements of `first` up to `fine`, then longer and longer."""
    x, step = list(np.arange(0.0, fine + 0.5 * first, first)), first
    while x[-1] < last:
        step *= growth
        x.append(x[-1] + step)
    return np.array(x) * (last / x[-1] if x[-1] > last * 1.2 else 1.0)


def body(first, shape):
    """A body below y = 0; `shape` lifts its upper side."""
    half = graded(first, 2.0 * HALF_WIDTH, WIDTH)
    x = np.concatenate([-half[:0:-1], half])
    y = -graded(first, HALF_WIDTH, WIDTH)[::-1]
    depth = -y[0]
    mesh = box("quad8", [x, y])
    points = mesh.points.copy()
    points[:, 1] += shape(points[:, 0]) * (1 + points[:, 1] / depth)
    near = np.flatnonzero(
        (np.abs(mesh.points[:, 1]) < 1e-12) & (np.abs(x_of(mesh)) < 4 * HALF_WIDTH)
    )
    surfaces = {
        "touch": surface_of_nodes(mesh.blocks, near),
        "far": surface_of_nodes(mesh.blocks, np.flatnonzero(mesh.points[:, 1] < y[0] + 1e-12)),
    }
    sets = {"far": np.flatnonzero(mesh.points[:, 1] < y[0] + 1e-12)}
    return with_surfaces(replace(mesh, points=points, node_sets=sets), surfaces)


def x_of(mesh):
    return mesh.points[:, 0]


def renamed(mesh, name):
    return replace(
        mesh,
        surfaces={f"{name}_{key}": s for key, s in mesh.surfaces.items()},
        node_sets={f"{name}_{key}": s for key, s in mesh.node_sets.items()},
    )


def cylinder_on_flat():
    flat = renamed(body(HALF_WIDTH / 12, lambda x: 0 * x), "flat")
    round_ = body(
        HALF_WIDTH / 10, lambda x: -(RADIUS - np.sqrt(RADIUS**2 - np.minimum(np.abs(x), 0.2) ** 2))
    )
    cylinder = renamed(replace(round_, points=-round_.points), "cylinder")
    return joined(flat, cylinder)


@pytest.mark.parametrize("slave", ["flat_touch", "cylinder_touch"])
def test_pressure_and_half_width_are_those_of_hertz(slave):
    """``a² = 4 F R / (pi E*)``, ``p = p0 sqrt(1 - x²/a²)``, ``p0 = 2 F / (pi a)``; Johnson, section 4.2."""
    mesh = cylinder_on_flat()
    modulus = STEEL.plane_modulus() / 2
    force = np.pi * modulus * HALF_WIDTH**2 / (4 * RADIUS)
    p0 = 2 * force / (np.pi * HALF_WIDTH)
    pairs = couple(
        mesh, "flat_touch", "cylinder_touch", slave=slave, reach=HALF_WIDTH, overlap=1e-6
    )
    load = resultant_load(mesh, "cylinder_far", np.array([0.0, -1.0]))
    structure = structure_from_mesh(
        mesh,
        [pairs],
        held={"flat_far": (0, 1), "cylinder_far": (0,)},
        loads={"press": load},
        materials=STEEL,
    ).structure
    model = Reducer(structure, 12, (0.0, 0.0)).model(structure.loads)
    flexibility = static_flexibility(model)
    a = model.amplitudes({"press": force})
    v_free = flexibility.loads_v @ a
    v_free[normal_rows()] -= pairs.gap
    solver = ContactSolver(
        flexibility, 0.0, p0 * model.area, np.full(model.pairs, FORWARD, dtype=np.int8)
    )
    solution = solver.solve(v_free, flexibility.loads_q @ a, np.zeros(model.pairs))
    assert solution.residual < 1e-9
    reaction = normal(solution.r)
    assert reaction @ pairs.normal[:, 1] == pytest.approx(force, rel=1e-9)
    x, pressure = pairs.points[:, 0], reaction / model.area
    inside = pressure > 0.3 * p0
    square, slope = np.linalg.lstsq(
        np.column_stack([np.ones(inside.sum()), x[inside] ** 2]), pressure[inside] ** 2, rcond=None
    )[0]
    assert np.sqrt(square) == pytest.approx(p0, rel=0.01)
    assert np.sqrt(-square / slope) == pytest.approx(HALF_WIDTH, rel=0.01)
    hertz = p0 * np.sqrt(np.maximum(1 - (x / HALF_WIDTH) ** 2, 0))
    deep = np.abs(x) < 0.9 * HALF_WIDTH
    assert np.abs(pressure - hertz)[deep].max() < 0.01 * p0
    assert np.abs(x[reaction > 0]).max() == pytest.approx(HALF_WIDTH, abs=HALF_WIDTH / 10)

"""A rigid flat: constant stress, symmetry, Hertz' line and point contact, and what does not meet it."""

import sys
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from test_hertz import HALF_WIDTH, RADIUS, STEEL, body, graded

sys.path.insert(0, str(Path(__file__).parents[1] / "mesh"))
from blocks import block
from grids import box

from microslip.contact.pairs import FORWARD, normal, normal_rows
from microslip.contact.solver import ContactSolver
from microslip.errors import ModelError
from microslip.model.flexibility import static_flexibility
from microslip.model.joint import Reducer
from microslip.model.mesh.assembly import assemble
from microslip.model.mesh.boundary import joined, surface_of_nodes, with_surfaces
from microslip.model.mesh.finite_elements import FiniteElementMesh
from microslip.model.mesh.loads import resultant_load, spring_stiffness, traction_load
from microslip.model.meshed import structure_from_mesh
from microslip.model.mortar.coupling import couple
from microslip.model.mortar.flat import couple_with_flat


def turned(mesh, angle):
    """About the axis of the last but one and the last coordinate."""
    c, s = np.cos(angle), np.sin(angle)
    R = np.eye(mesh.dimension)
    R[-2:, -2:] = [[c, -s], [s, c]]
    return replace(mesh, points=mesh.points @ R.T), R


@pytest.mark.parametrize("kind", ["tri3", "tri6", "quad8", "tet10", "hex8", "hex20", "wedge15"])
@pytest.mark.parametrize("angle", [0.0, 0.7])
def test_constant_stress_is_in_equilibrium_with_the_flat(kind, angle):
    """At every node, with reactions ``r = A (-n s n, t s n)``."""
    mesh, R = turned(block(kind, 1, 3, shake=0.2), angle)
    d = mesh.dimension
    n = R[:, -1]
    pairs = couple_with_flat(mesh, "touch1", n, 0.0)
    assert np.abs(pairs.gap).max() < 1e-14
    G = 1e-3 * np.random.default_rng(5).standard_normal((d, d))
    strain = 0.5 * (G + G.T)
    lam, mu = STEEL.lame()
    stress = lam * np.trace(strain) * np.eye(d) + 2 * mu * strain
    K, _ = assemble(mesh, STEEL)
    outside = traction_load(mesh, "rest1", lambda x, out: out @ stress)
    traction = pairs.normal @ stress
    r = np.empty((pairs.pairs, d))
    r[:, 0] = -np.sum(traction * pairs.normal, axis=1)
    r[:, 1:] = np.einsum("md,mtd->mt", traction, pairs.tangents)
    r *= pairs.area[:, None]
    balance = K @ (mesh.points @ G.T).ravel() + pairs.relative().T @ r.ravel() - outside
    assert np.abs(balance).max() < 1e-10 * np.abs(r).max()


def pressed(structure, gap, force):
    """Reactions and pressures without friction under the load ``press``."""
    model = Reducer(structure, 20, (0.0, 0.0)).model(structure.loads)
    flexibility = static_flexibility(model)
    a = model.amplitudes({"press": force})
    v_free = flexibility.loads_v @ a
    v_free[normal_rows(model.dimension)] -= gap
    typical = np.full(model.pairs, force / model.pairs)
    solver = ContactSolver(flexibility, 0.0, typical, np.full(model.pairs, FORWARD, np.int8))
    rest = np.zeros(model.pairs if model.dimension == 2 else (model.pairs, 2))
    solution = solver.solve(v_free, flexibility.loads_q @ a, rest)
    assert solution.residual < 1e-9
    reaction = normal(solution.r, model.dimension)
    return reaction, reaction / model.area


@pytest.mark.parametrize("kind", ["quad8", "hex8"])
def test_a_body_on_a_flat_is_half_of_two_that_mirror_each_other(kind):
    """Pressed on a part of their far sides, so that the rest of the contact opens."""
    upper = block(kind, 1, 6)
    d = upper.dimension
    axis = np.eye(d)[-1]
    top = np.flatnonzero((upper.points[:, -1] > 1 - 1e-9) & (upper.points[:, 0] < 0.34))
    upper = with_surfaces(upper, {"part": surface_of_nodes(upper.blocks, top)})
    given = {"held": {}, "materials": STEEL}
    flat = couple_with_flat(upper, "touch1", axis, 0.0)
    loads = {"press": resultant_load(upper, "part", -axis)}
    soft = sum(spring_stiffness(upper, "part", 1e6, k) for k in range(d))
    one = structure_from_mesh(upper, [flat], loads=loads, springs=soft, **given)
    mirror = np.ones(d)
    mirror[-1] = -1
    lower = replace(
        upper,
        points=upper.points * mirror,
        surfaces={f"{k}_below": s for k, s in upper.surfaces.items()},
    )
    both = mirrored(lower, upper)
    pairs = couple(both, "touch1", "touch1_below", slave="touch1")
    loads = {
        "press": resultant_load(both, "part", -axis) + resultant_load(both, "part_below", axis)
    }
    parts = ("part", "part_below")
    soft = sum(spring_stiffness(both, name, 1e6, k) for name in parts for k in range(d))
    two = structure_from_mesh(both, [pairs], loads=loads, springs=soft, **given)
    half, whole = (pressed(each.structure, each.gap, 1e6)[1] for each in (one, two))
    assert (half == 0).any()
    assert np.abs(half - whole).max() < 1e-8 * half.max()


def mirrored(lower, upper) -> FiniteElementMesh:
    """Both in one mesh; elements of the mirrored one count their nodes the other way round."""
    own = lower.blocks[0]
    shape = own.type
    at = shape.nodes.copy()
    at[:, -1] *= -1
    order = [int(np.argmin(np.abs(shape.nodes - x).max(axis=1))) for x in at]
    faces = [frozenset(nodes) for _, nodes in shape.faces]
    new = {
        k: faces.index(frozenset(order.index(n) for n in nodes)) for k, nodes in enumerate(faces)
    }
    surfaces = {
        name: replace(s, faces=np.array([new[int(f)] for f in s.faces]))
        for name, s in lower.surfaces.items()
    }
    block_ = replace(own, nodes=own.nodes[:, order], labels=own.labels + 1000)
    return joined(replace(lower, blocks=(block_,), surfaces=surfaces), upper)


def test_line_contact_on_a_rigid_flat_is_that_of_hertz():
    """``a² = 4 F R / (pi E*)`` with E* of the cylinder alone; Johnson (1985), section 4.2."""
    round_ = body(
        HALF_WIDTH / 10, lambda x: -(RADIUS - np.sqrt(RADIUS**2 - np.minimum(np.abs(x), 0.2) ** 2))
    )
    mesh = replace(round_, points=-round_.points)
    modulus = STEEL.plane_modulus()
    force = np.pi * modulus * HALF_WIDTH**2 / (4 * RADIUS)
    pairs = couple_with_flat(mesh, "touch", np.array([0.0, 1.0]), 0.0, reach=HALF_WIDTH)
    load = resultant_load(mesh, "far", np.array([0.0, -1.0]))
    found = structure_from_mesh(
        mesh, [pairs], held={"far": (0,)}, loads={"press": load}, materials=STEEL
    )
    reaction, pressure = pressed(found.structure, pairs.gap, force)
    assert reaction.sum() == pytest.approx(force, rel=1e-9)
    check_hertz(pairs.points[:, 0], pressure, 2 * force / (np.pi * HALF_WIDTH))


def check_hertz(r, pressure, p0):
    """``p² = p0² (1 - r²/a²)``."""
    inside = pressure > 0.3 * p0
    square, slope = np.linalg.lstsq(
        np.column_stack([np.ones(inside.sum()), r[inside] ** 2]), pressure[inside] ** 2, rcond=None
    )[0]
    assert np.sqrt(square) == pytest.approx(p0, rel=0.01)
    assert np.sqrt(-square / slope) == pytest.approx(HALF_WIDTH, rel=0.01)


@pytest.mark.validate
def test_point_contact_on_a_rigid_flat_is_that_of_hertz():
    """A quarter of a sphere: ``a³ = 3 F R / (4 E*)``, ``p0 = 3 F / (2 pi a²)``; Johnson, section 4.2."""
    a, far = HALF_WIDTH, 10 * HALF_WIDTH
    side = graded(a / 8, 1.5 * a, far, 1.4)
    up = graded(a / 8, a, far, 1.4)

    def lift(p):
        out = p.copy()
        out[:, 2] += (p[:, 0] ** 2 + p[:, 1] ** 2) / (2 * RADIUS) * (1 - p[:, 2] / up[-1])
        return out

    plain = box("hex8", [side, side, up], formulation="incompatible")
    flat = plain.points
    near = np.flatnonzero((flat[:, 2] < 1e-12) & (np.hypot(*flat[:, :2].T) < 2 * a))
    top = np.flatnonzero(flat[:, 2] > up[-1] - 1e-12)
    mesh = with_surfaces(
        replace(
            plain,
            points=lift(flat),
            node_sets={
                "x": np.flatnonzero(flat[:, 0] < 1e-12),
                "y": np.flatnonzero(flat[:, 1] < 1e-12),
            },
        ),
        {
            "touch": surface_of_nodes(plain.blocks, near),
            "far": surface_of_nodes(plain.blocks, top),
        },
    )
    modulus = STEEL.youngs_modulus / (1 - STEEL.poissons_ratio**2)
    force = 4 * modulus * a**3 / (3 * RADIUS)
    pairs = couple_with_flat(mesh, "touch", np.array([0.0, 0.0, 1.0]), 0.0, reach=a)
    load = resultant_load(mesh, "far", np.array([0.0, 0.0, -1.0]))
    found = structure_from_mesh(
        mesh, [pairs], held={"x": (0,), "y": (1,)}, loads={"press": load}, materials=STEEL
    )
    reaction, pressure = pressed(found.structure, pairs.gap, force / 4)
    assert reaction.sum() == pytest.approx(force / 4, rel=1e-9)
    check_hertz(np.hypot(*pairs.points[:, :2].T), pressure, 3 * force / (2 * np.pi * a**2))


def test_a_flat_that_is_not_met_is_named():
    mesh = block("quad8", 1, 3)
    for normal_, offset, said in (
        ([0.0, 1.0], -5.0, "never meets the rigid flat: its nodes are 5 to 5 m"),
        ([0.0, -1.0], 0.0, "does the normal point to the body"),
        ([0.0, 1.0], 0.3, "and 'the rigid flat' overlap by 0.3 m"),
    ):
        with pytest.raises(ModelError, match=said):
            couple_with_flat(mesh, "touch1", np.array(normal_), offset)

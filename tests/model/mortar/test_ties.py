"""Ties, equations and couplings: constraints that hold what they should and nothing else."""

import sys
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
import scipy.sparse as sp
import scipy.sparse.linalg as spla

sys.path.insert(0, str(Path(__file__).parents[1] / "mesh"))
from blocks import block, two_blocks
from grids import box

from microslip.errors import ModelError
from microslip.model.elasticity import Material
from microslip.model.mesh.assembly import assemble
from microslip.model.mesh.boundary import joined, surface_of_nodes, with_surfaces
from microslip.model.mesh.constraints import (
    Constraints,
    constraints_of,
    free_displacements,
    rotations_of,
)
from microslip.model.mesh.element_types import TYPES
from microslip.model.mesh.finite_elements import Coupling, Equation, Tie
from microslip.model.mesh.loads import nodal_load
from microslip.model.mortar.ties import tied

STEEL = Material(210e9, 0.3, 7800.0)


def rigid_rank(d):
    return 3 if d == 2 else 6


@pytest.mark.parametrize(
    ("lower", "upper"),
    [
        ("quad8", "tri6"),
        ("tri3", "quad4"),
        ("tet10", "hex20"),
        ("hex8", "wedge6"),
        ("hex20", "hex20"),
    ],
)
def test_tied_bodies_move_as_one_even_where_they_do_not_touch(lower, upper):
    """As many free motions as one body has, and a linear field passes."""
    for lift in (0.0, 0.004):
        mesh = two_blocks(lower, upper, tilt=0.2)
        d = mesh.dimension
        high = mesh.points[:, -1] > 0.2 * (mesh.points[:, 0] - 0.3) + 1e-9
        high[np.isin(np.arange(len(mesh.points)), mesh.bodies[1])] = True
        points = mesh.points + lift * high[:, None] * np.eye(d)[-1]
        moved, tying = tied(replace(mesh, points=points), Tie("t", "touch0", "touch1", 0.01))
        K, _ = assemble(moved, STEEL)
        T, kept = free_displacements(tying, np.zeros(0, int))
        assert abs(tying.rows @ T).max() < 1e-12
        values = np.linalg.eigvalsh((T.T @ K @ T).toarray())
        zero = np.sum(np.abs(values) < 1e-9 * values.max())
        assert zero == rigid_rank(d)
        assert len(kept) == mesh.points.size - tying.rows.shape[0]
        field = (moved.points @ np.random.default_rng(0).standard_normal((d, d))).ravel()
        assert np.abs(tying.rows @ field).max() < 1e-12


def test_a_tie_that_never_meets_names_itself():
    lower, upper = block("quad8", 0, 4), block("quad8", 1, 5)
    mesh = joined(lower, replace(upper, points=upper.points + np.array([0.0, 0.5])))
    with pytest.raises(ModelError, match="tie 'weld': surfaces 'touch0' and 'touch1' never meet"):
        tied(mesh, Tie("weld", "touch0", "touch1", 0.01))


def test_a_tie_of_part_of_a_surface_says_so():
    mesh = two_blocks("quad8", "quad8", sizes=(1.0, 0.5))
    moved, _ = tied(mesh, Tie("weld", "touch0", "touch1"))
    assert "only 50% of 'touch0'" in str(moved.cautions[-1])


def bar(kind, length=10.0):
    """A cantilever of unit height with a reference node off its end."""
    d = TYPES[kind].dimension
    axes = [np.linspace(0, length, 21), np.linspace(-0.5, 0.5, 3)]
    if d == 3:
        axes.append(np.linspace(-0.5, 0.5, 2))
    mesh = box(kind, axes)
    end = surface_of_nodes(mesh.blocks, np.flatnonzero(mesh.points[:, 0] > length - 1e-9))
    reference = np.array([[length + 1.0, *[0.0] * (d - 1)]])
    mesh = replace(
        mesh,
        points=np.vstack([mesh.points, reference]),
        node_labels=np.append(mesh.node_labels, 9999),
    )
    return with_surfaces(mesh, {"end": end})


@pytest.mark.parametrize("way", ["kinematic", "distributing"])
@pytest.mark.parametrize("kind", ["quad8", "hex20"])
def test_force_and_moment_on_a_reference_node_bend_as_in_beam_theory(way, kind):
    """Deflection and rotation under a force F and a moment M at the node, L + 1 from the root."""
    mesh = bar(kind)
    d, node, E = mesh.dimension, len(mesh.points) - 1, 1e6
    mesh = replace(mesh, couplings=(Coupling("c", way, node, "end", tuple(range(6))),))
    rotations = rotations_of(mesh)
    K, _ = assemble(mesh, Material(E, 0.0, 1.0, plane="stress"))
    K = sp.block_diag([K, sp.csc_matrix((rotations.each, rotations.each))], format="csc")
    root = np.flatnonzero(mesh.points[:, 0] < 1e-9)
    fixed = (d * root[:, None] + np.arange(d)).ravel()
    T, _ = free_displacements(constraints_of(mesh, rotations), fixed)
    turn = rotations.of(node)[-1]
    load = np.zeros(rotations.dofs)
    load[d * node + 1], load[turn] = 3.0, 7.0
    u = T @ spla.spsolve((T.T @ K @ T).tocsc(), T.T @ load)
    EI, L = E / 12, 10.0
    M = 7.0 + 3.0 * 1.0
    shear = 3.0 * L / (5 / 6 * E / 2)
    tip = 3.0 * L**3 / (3 * EI) + M * L**2 / (2 * EI) + shear
    slope = 3.0 * L**2 / (2 * EI) + M * L / EI
    assert u[turn] == pytest.approx(slope, rel=5e-3)
    assert u[d * node + 1] == pytest.approx(tip + slope * 1.0, rel=5e-3)


def test_equations_hold_and_give_up_their_first_term():
    equal = Equation(((8, 1, 1.0), (2, 1, -1.0)))
    mesh = replace(box("quad4", [np.linspace(0, 1, 3)] * 2), equations=(equal,))
    constraints = constraints_of(mesh, rotations_of(mesh))
    T, kept = free_displacements(constraints, np.array([0, 1]))
    assert 17 not in kept
    u = T @ np.arange(1.0, len(kept) + 1)
    assert u[17] == u[5]
    assert (u[:2] == 0).all()


def test_constraints_that_say_the_same_twice_are_refused():
    rows = sp.csr_matrix([[1.0, -1.0, 0.0], [1.0, -1.0, 0.0]])
    with pytest.raises(ModelError, match="say the same twice or contradict"):
        free_displacements(Constraints(rows, np.array([0, 0])), np.zeros(0, int))


def test_a_nodal_load_is_the_mean_displacement():
    mesh = box("quad4", [np.linspace(0, 1, 3)] * 2)
    load = nodal_load(mesh, np.array([0, 3]), np.array([1.0, 0.0]))
    assert load @ mesh.points.ravel() == pytest.approx(mesh.points[[0, 3], 0].mean())

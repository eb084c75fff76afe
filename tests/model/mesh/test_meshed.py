"""Structures from meshes: supports, reduction, cautions; plane and in space."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
import scipy.sparse.linalg as spla
from blocks import two_blocks
from conftest import ROOT
from write_inp import write_inp

from microslip.errors import InputError, ModelError
from microslip.model.elasticity import Material
from microslip.model.flexibility import static_flexibility
from microslip.model.joint import Reducer
from microslip.model.mesh.boundary import joined, surface_of_nodes
from microslip.model.mesh.facets import facets_of
from microslip.model.mesh.finite_elements import Section, Tie
from microslip.model.mesh.loads import pressure_load, resultant_load, spring_stiffness
from microslip.model.mesh.read import read_mesh
from microslip.model.meshed import structure_from_mesh
from microslip.model.modes import linear_modes
from microslip.model.mortar.coupling import couple

STEEL = Material(210e9, 0.3, 7800.0)


def supported(lower, upper, held=((0, 1, 2), (0, 1, 2)), beside=0.0, **options):
    mesh = two_blocks(lower, upper, **options)
    above = np.isin(np.arange(len(mesh.points)), facets_of(mesh, "rest1").nodes)
    above |= np.isin(np.arange(len(mesh.points)), facets_of(mesh, "touch1").nodes)
    above |= mesh.points[:, -1] > 1e-9
    mesh = replace(mesh, points=mesh.points + beside * above[:, None] * np.eye(mesh.dimension)[0])
    ends = {
        "bottom": np.flatnonzero(mesh.points[:, -1] < -1 + 1e-9),
        "top": np.flatnonzero(mesh.points[:, -1] > 1 - 1e-9),
    }
    mesh = replace(mesh, node_sets=ends)
    pairs = couple(mesh, "touch0", "touch1")
    loads = {"press": pressure_load(mesh, "rest1")}
    keep = {name: c[: mesh.dimension] for name, c in zip(("bottom", "top"), held, strict=True) if c}
    return structure_from_mesh(mesh, [pairs], held=keep, loads=loads, materials=STEEL)


@pytest.mark.parametrize(
    ("lower", "upper"), [("quad8", "tri6"), ("tet10", "hex20"), ("hex8", "wedge6")]
)
def test_flexibility_of_the_pairs_is_that_of_the_whole_structure(lower, upper):
    """``W = B K^-1 B^T`` and ``B K^-1 f`` of the reduced model, by solving with all degrees of freedom."""
    structure = supported(lower, upper).structure
    B = structure.interface.relative
    solved = spla.splu(structure.stiffness.tocsc()).solve(B.T.toarray())
    model = Reducer(structure, 8, (0.0, 0.0)).model(structure.loads)
    flexibility = static_flexibility(model)
    W = B @ solved
    assert np.abs(flexibility.W - W).max() < 1e-7 * np.abs(W).max()
    v = solved.T @ structure.loads["press"]
    assert np.abs(flexibility.loads_v[:, 0] - v).max() < 1e-7 * np.abs(v).max()
    assert model.dimension == structure.interface.dimension


@pytest.mark.parametrize(("lower", "upper", "d"), [("quad8", "tri6", 2), ("tet10", "hex20", 3)])
def test_motions_that_supports_leave_free_have_no_stiffness(lower, upper, d):
    each = 3 if d == 2 else 6
    for held, free in ((((0, 1, 2), None), each), (((0, 1, 2), (0, 1, 2)), 0)):
        structure = supported(lower, upper, held).structure
        assert structure.motions.shape[1] == free
        force = structure.stiffness @ structure.motions
        assert np.abs(force).max(initial=0.0) < 1e-9 * np.abs(structure.stiffness.data).max()
    # u_x held on a plane z = constant: it moves along z, y and turns about an axis along y in it
    one_direction = supported(lower, upper, ((0, 1, 2), (0,))).structure
    assert one_direction.motions.shape[1] == each - (1 if d == 2 else 2)


def test_springs_hold_bodies():
    """The same two bodies, free but for springs under one of them."""
    mesh = two_blocks("quad8", "tri6")
    pairs = couple(mesh, "touch0", "touch1")
    springs = sum(spring_stiffness(mesh, "rest0", 1e3, axis) for axis in range(2))
    meshed = structure_from_mesh(mesh, [pairs], held={}, loads={}, materials=STEEL, springs=springs)
    assert meshed.structure.motions.shape[1] == 6


@pytest.mark.parametrize(("lower", "upper"), [("quad8", "tri6"), ("tet10", "hex20")])
def test_bodies_that_nothing_holds_are_named(lower, upper):
    with pytest.raises(ModelError, match=r"rigid motions? .* body 1 \(node 1\), body 2 \(node"):
        supported(lower, upper, (None, (0,)))


@pytest.mark.parametrize(("lower", "upper", "d"), [("quad8", "tri6", 2), ("tet10", "hex20", 3)])
def test_all_bodies_together_may_be_held_by_nothing(lower, upper, d):
    meshed = supported(lower, upper, (None, None))
    assert meshed.structure.motions.shape[1] == 2 * (3 if d == 2 else 6)
    assert meshed.structure.supports is None


def test_supports_that_no_node_has_are_named():
    mesh = replace(two_blocks("tet4", "tet4"), node_sets={"top": np.array([0])})
    pairs = couple(mesh, "touch0", "touch1")
    with pytest.raises(ModelError, match="node set 'top': its nodes have no component 4"):
        structure_from_mesh(mesh, [pairs], held={"top": (3,)}, loads={}, materials=STEEL)


def test_cautions_name_bad_elements_and_surfaces_that_meet_in_part():
    """A smaller surface that meets the other one wholly is no reason for one."""

    def said(**options):
        return " ".join(
            str(c) for c in supported("tri3", "quad8", counts=(12, 3), **options).cautions
        )

    assert "linear triangles bend too stiffly" in said()
    assert "50% of the smaller one face the other side" in said(sizes=(1.0, 1.0), beside=0.5)
    assert "face the other side" not in said(sizes=(1.0, 0.5))


def test_loads_have_the_resultants_that_they_say():
    mesh = two_blocks("tet10", "hex20", tilt=0.3)
    direction = np.array([1.0, 2.0, -2.0]) / 3
    load = resultant_load(mesh, "touch0", direction).reshape(-1, 3)
    assert np.allclose(load.sum(axis=0), direction)
    closed = joined(mesh, mesh)
    pressure = sum(pressure_load(closed, name) for name in ("touch0", "rest0")).reshape(-1, 3)
    assert np.abs(pressure.sum(axis=0)).max() < 1e-12


def test_a_file_of_another_kind_is_refused():
    with pytest.raises(InputError, match=r"body\.stl: a mesh is a file \.inp, \.msh"):
        read_mesh(Path("body.stl"))


def test_the_code_of_the_page_runs(tmp_path, monkeypatch):
    mesh = two_blocks("hex20", "tet10")
    surfaces = {
        "plate_top": mesh.surfaces["touch0"],
        "lug_bottom": mesh.surfaces["touch1"],
        "washer": surface_of_nodes(mesh.blocks, np.flatnonzero(mesh.points[:, 2] > 1 - 1e-9)),
    }
    mesh = replace(
        mesh,
        node_labels=1 + np.arange(len(mesh.points)),
        blocks=tuple(
            replace(block, labels=1 + start + np.arange(block.count))
            for block, start in zip(mesh.blocks, mesh.starts[:-1], strict=True)
        ),
        surfaces=surfaces,
        node_sets={"root": np.flatnonzero(mesh.points[:, 2] < -1 + 1e-9)},
        element_sets={"BODY": np.arange(mesh.elements)},
        materials={"steel": Material(210e3, 0.3, 7.8e-9)},
        sections=(Section("BODY", "steel"),),
    )
    write_inp(mesh, tmp_path / "joint.inp")
    monkeypatch.chdir(tmp_path)
    code = (ROOT / "docs" / "meshes.md").read_text("utf-8").split("```python")[1].split("```")[0]
    names = {}
    exec(code, names)
    structure = names["meshed"].structure
    assert structure.mass.sum() / 3 < 7800 * 2e-9  # what is held is left out
    assert structure.loads["bolt"].sum() == pytest.approx(-1.0)
    assert structure.interface.area.sum() == pytest.approx(1e-6)


@pytest.mark.parametrize(("lower", "upper"), [("quad8", "tri6"), ("hex20", "tet10")])
def test_bonded_pairs_are_a_tie(lower, upper):
    """Frequencies with all components of all pairs bonded are those of the tied mesh, inclined too."""
    mesh = two_blocks(lower, upper, tilt=0.3, turn=0.4)
    mesh = replace(mesh, node_sets={"root": far_nodes(mesh)})
    held = {"root": tuple(range(mesh.dimension))}
    pairs = couple(mesh, "touch0", "touch1")
    loads = {"press": pressure_load(mesh, "rest1")}
    open_ = structure_from_mesh(mesh, [pairs], held=held, loads=loads, materials=STEEL).structure
    bonded = np.arange(open_.interface.relative.shape[0])
    tie = Tie("weld", pairs.slave, pairs.master)
    tied = structure_from_mesh(
        replace(mesh, ties=(tie,)), [pairs], held=held, loads=loads, materials=STEEL
    ).structure
    stuck = linear_modes(open_, bonded, 5).omega
    assert stuck == pytest.approx(linear_modes(tied, np.array([], dtype=int), 5).omega, rel=1e-8)
    assert stuck[0] > linear_modes(open_, bonded[:: mesh.dimension], 5).omega[0] * (1 - 1e-9)


def far_nodes(mesh):
    """Nodes on the outside of the lower body, away from the interface."""
    facets = facets_of(mesh, "rest0").nodes
    near = facets_of(mesh, "touch0").nodes
    apart = np.linalg.norm(mesh.points[facets][:, None] - mesh.points[near], axis=2).min(axis=1)
    return facets[apart > 0.6]

"""Bolts that keep their length: bars in closed form, sections, and what is not a bolt."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from mesh_files import faces_where, grid, two_bodies

from microslip.analyses.prepared.prestress import prestress
from microslip.analyses.prepared.tightening import tighten
from microslip.errors import ModelError
from microslip.model.bolts import Tightening
from microslip.model.elasticity import Material
from microslip.model.flexibility import static_flexibility
from microslip.model.joint import Reducer
from microslip.model.mesh.bolts import bolt_between, bolt_through
from microslip.model.mesh.boundary import all_faces, joined, surface_of_cells, with_surfaces
from microslip.model.mesh.finite_elements import Equation, Surface
from microslip.model.mesh.loads import resultant_load
from microslip.model.meshed import structure_from_mesh
from microslip.model.mortar.coupling import couple

E, SIDE = 200e9, 0.01
BAR = Material(E, 0.0, 7800.0)
"""Without lateral contraction a bar is one-dimensional."""


def bars(d=3):
    """A sleeve of two bars, 20 and 40 mm long, that meet at z = 0 with other meshes, and beside it a bolt of
    60 mm that is cut at 20 mm. All stand on the floor; their tops move together, up and down alone. In m."""
    across = [np.linspace(0, SIDE, n + 1) for n in (2, 3)]
    lower = grid((*[across[0]] * (d - 1), np.linspace(-0.02, 0, 4)))
    upper = grid((*[across[1]] * (d - 1), np.linspace(0, 0.04, 5)))
    beside = grid((across[0] + 2 * SIDE, *[across[0]] * (d - 2), np.linspace(-0.02, 0.04, 7)))
    sleeve = two_bodies(lower, upper)
    labels = beside.blocks[0].labels + sleeve.elements
    mesh = joined(sleeve, replace(beside, blocks=(replace(beside.blocks[0], labels=labels),)))
    z = mesh.points[:, -1]
    top = np.flatnonzero(np.abs(z - 0.04) < 1e-9)
    together = tuple(Equation(((int(k), d - 1, 1.0), (int(top[0]), d - 1, -1.0))) for k in top[1:])
    mesh = replace(
        mesh,
        node_labels=1 + np.arange(len(mesh.points)),
        equations=together,
        node_sets={"floor": np.flatnonzero(np.abs(z + 0.02) < 1e-9), "top": top},
    )

    def flat(height, beside):
        return faces_where(
            mesh,
            lambda p: (np.abs(p[:, -1] - height) < 1e-9) & ((p[:, 0] > 1.5 * SIDE) == beside),
        )

    surfaces = {"bottom": flat(-0.02, False), "top": flat(0.04, False), "end": flat(0.04, True)}
    for name, side in (("lower", 0), ("upper", 1)):
        faces = flat(0.0, False)
        own = np.isin(faces.elements, mesh.element_sets[name])
        surfaces[f"touch{side}"] = Surface(faces.elements[own], faces.faces[own])
    return with_surfaces(mesh, surfaces | {"cut": section(mesh, 0.02)})


def section(mesh, z):
    """Faces at a height of the elements below it."""
    faces, corners = all_faces(mesh.blocks)
    middle = np.concatenate([mesh.points[b.nodes].mean(axis=1) for b in mesh.blocks])
    own = []
    for element, nodes in zip(faces.elements, corners, strict=True):
        level = np.abs(mesh.points[nodes[nodes >= 0], -1] - z).max() < 1e-9
        own.append(bool(level and middle[element, -1] < z and middle[element, 0] > 1.5 * SIDE))
    return Surface(faces.elements[own], faces.faces[own])


def held(d):
    """The floor, and the tops to the side."""
    return {"floor": list(range(d)), "top": list(range(d - 1))}


def tightened(mesh, bolt, **amount):
    """The bolt and the prestress."""
    found = structure_from_mesh(
        mesh,
        [couple(mesh, "touch0", "touch1")],
        held=held(mesh.dimension),
        loads={},
        materials=BAR,
        bolts=[bolt],
    )
    model = Reducer(found.structure, 20, (0.0, 0.0)).model(found.structure.loads)
    flexibility = static_flexibility(model)
    plan = Tightening(found.bolts, {bolt.name: 1}, **amount)
    done = tighten(model, flexibility, {}, plan)
    return done, prestress(model, flexibility, done.preload)


def area(d):
    return SIDE ** (d - 1)


@pytest.mark.parametrize("d", [2, 3])
def test_a_section_shortens_its_bolt(d):
    """``s / F = L / (E A)`` of the bolt and of the sleeve, and the pressure is F / A everywhere."""
    mesh, bolt = bolt_through(bars(d), "bolt", "cut")
    force, gives = 5e3, 2 * 0.06 / (E * area(d))
    done, start = tightened(mesh, bolt, force={"bolt": force})
    assert done.force[0] == pytest.approx(force, rel=1e-10)
    assert done.shortening[0] == pytest.approx(force * gives, rel=1e-8)
    np.testing.assert_allclose(start.pressure, force / area(d), rtol=1e-8)
    by, other = tightened(mesh, bolt, shortening={"bolt": 3e-6})
    assert by.force[0] == pytest.approx(3e-6 / gives, rel=1e-8)
    np.testing.assert_allclose(other.pressure, by.force[0] / area(d), rtol=1e-8)


@pytest.mark.parametrize("d", [2, 3])
@pytest.mark.parametrize("stiffness", [None, 2e8])
def test_a_bolt_between_head_and_nut_is_in_series_with_what_it_clamps(d, stiffness):
    """``s / F = 1 / k + 1 / K`` with K that of the sleeve and of the bar beside it, ``2 E A / L``; a rigid
    bolt has no 1 / k. The bar takes half of the force off the contact."""
    mesh = bars(d)
    up = np.eye(d)[-1]
    pull = resultant_load(mesh, "bottom", up) - resultant_load(mesh, "top", up)
    mesh, bolt = bolt_between(mesh, "bolt", pull, stiffness)
    gives = 0.06 / (2 * E * area(d)) + (0.0 if stiffness is None else 1 / stiffness)
    done, start = tightened(mesh, bolt, force={"bolt": 4e3})
    assert done.shortening[0] == pytest.approx(4e3 * gives, rel=1e-8)
    np.testing.assert_allclose(start.pressure, 2e3 / area(d), rtol=1e-8)
    by, _ = tightened(mesh, bolt, shortening={"bolt": 2e-6})
    assert by.force[0] == pytest.approx(2e-6 / gives, rel=1e-8)


@pytest.mark.parametrize("d", [2, 3])
def test_a_cut_that_keeps_its_length_is_no_cut(d):
    """Matrices of the structure are those of the mesh without the cut, up to the order."""
    plain = bars(d)
    options = {"held": held(d), "loads": {}, "materials": BAR}
    whole = structure_from_mesh(plain, [couple(plain, "touch0", "touch1")], **options)
    mesh, bolt = bolt_through(plain, "bolt", "cut")
    cut = structure_from_mesh(mesh, [couple(mesh, "touch0", "touch1")], bolts=[bolt], **options)
    for name in ("stiffness", "mass"):
        a, b = (getattr(each.structure, name).toarray() for each in (whole, cut))
        assert np.abs(a - b).max() <= 1e-12 * np.abs(a).max()
    assert whole.structure.motions.shape == cut.structure.motions.shape


def test_a_constant_force_in_a_section_leaves_its_axis_free():
    """The tops can move as the upper bar does; the pressure is that of a bolt that keeps its length."""
    mesh, bolt = bolt_through(bars(), "bolt", "cut", keeps_length=False)
    pairs = couple(mesh, "touch0", "touch1")
    options = {"held": held(3), "loads": {}, "materials": BAR}
    found = structure_from_mesh(mesh, [pairs], bolts=[bolt], **options)
    assert found.structure.motions.shape[1] == 1
    model = Reducer(found.structure, 20, (0.0, 0.0)).model(found.structure.loads)
    start = prestress(model, static_flexibility(model), {"bolt": 5e3})
    np.testing.assert_allclose(start.pressure, 5e3 / area(3), rtol=1e-8)


@pytest.mark.parametrize("d", [2, 3])
def test_cells_inside_a_bolt_are_a_section(d):
    """As a group of faces of a mesher is, in any order and looking either way: all on one side."""
    mesh = bars(d)
    faces, corners = all_faces(mesh.blocks)
    named = mesh.surfaces["cut"]
    own = [
        int(np.flatnonzero((faces.elements == e) & (faces.faces == f))[0])
        for e, f in zip(named.elements, named.faces, strict=True)
    ]
    cells = np.random.default_rng(1).permutation(corners[own])
    found = surface_of_cells(mesh.blocks, cells, "cut", mesh.points)
    mesh = with_surfaces(mesh, {"inside": found})
    done = [
        tightened(*bolt_through(mesh, "bolt", name), force={"bolt": 5e3})[0]
        for name in ("cut", "inside")
    ]
    assert done[0].shortening == pytest.approx(done[1].shortening, rel=1e-7)
    with pytest.raises(ModelError, match="between two"):
        surface_of_cells(mesh.blocks, cells, "cut")


def test_what_is_no_section_is_refused():
    mesh = bars()
    for name, surface in (
        ("outside", mesh.surfaces["top"]),
        ("half", Surface(mesh.surfaces["cut"].elements[:3], mesh.surfaces["cut"].faces[:3])),
        (
            "bent",
            Surface(
                np.append(mesh.surfaces["cut"].elements, mesh.surfaces["cut"].elements[0]),
                np.append(mesh.surfaces["cut"].faces, 2),
            ),
        ),
    ):
        mesh = with_surfaces(mesh, {name: surface})
    for name, said in (
        ("outside", "lies on the outside"),
        ("half", "does not cut its bolt through"),
        ("bent", "is not flat"),
        ("none", "no surface 'none'"),
    ):
        with pytest.raises(ModelError, match=said):
            bolt_through(mesh, "bolt", name)

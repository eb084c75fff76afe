"""Temperature in meshes: free expansion, a bar between walls, Timoshenko's bimetal strip."""

from dataclasses import replace

import numpy as np
import pytest
import scipy.sparse.linalg as spla
from grids import box, shaken
from write_inp import write_inp

from microslip.errors import InputError
from microslip.model.elasticity import Material
from microslip.model.mesh.assembly import assemble
from microslip.model.mesh.boundary import joined, surface_of_nodes, with_surfaces
from microslip.model.mesh.constraints import (
    constraints_of,
    free_displacements,
    rotations_of,
    stacked,
)
from microslip.model.mesh.element_types import TYPES
from microslip.model.mesh.finite_elements import Section, Tie
from microslip.model.mesh.read import read_mesh
from microslip.model.mesh.thermal import changes, thermal_load
from microslip.model.mortar.ties import tied

SOLIDS = [(name, "full") for name, shape in TYPES.items() if shape.family != "line"]
SOLIDS += [("quad4", "incompatible"), ("hex8", "incompatible")]
E, NU, ALPHA, WARMER = 200e9, 0.3, 12e-6, 40.0


def axes_of(kind):
    every = (np.linspace(0, 1.0, 3), np.linspace(0, 0.8, 4), np.linspace(0, 0.6, 3))
    return every[: TYPES[kind].dimension]


@pytest.mark.parametrize(
    ("kind", "formulation", "plane"),
    [
        (*solid, plane)
        for solid in SOLIDS
        for plane in ("strain", "stress")
        if plane == "strain" or TYPES[solid[0]].dimension == 2
    ],
)
def test_what_is_free_expands_without_stress(kind, formulation, plane):
    """``u = alpha T x`` balances the load; in plane strain ``(1 + nu) alpha T x``."""
    axes = axes_of(kind)
    mesh = box(kind, axes, shaken(axes, 4), formulation)
    material = Material(E, NU, 7800.0, plane, ALPHA)
    K, _ = assemble(mesh, material)
    load = thermal_load(mesh, changes(mesh, None, WARMER), material)
    more = 1 + NU if len(axes) == 2 and plane == "strain" else 1.0
    expanded = more * ALPHA * WARMER * mesh.points.ravel()
    assert np.abs(K @ expanded - load).max() < 1e-10 * np.abs(load).max()


@pytest.mark.parametrize(("kind", "formulation"), SOLIDS)
def test_a_bar_between_walls_presses_with_its_modulus(kind, formulation):
    """``sigma = -E alpha T`` along the bar, free across it."""
    axes = axes_of(kind)
    mesh = box(kind, axes, shaken(axes, 5), formulation)
    d = mesh.dimension
    material = Material(E, NU, 7800.0, "stress" if d == 2 else "strain", ALPHA)
    K, _ = assemble(mesh, material)
    load = thermal_load(mesh, changes(mesh, None, -WARMER), material)
    x = mesh.points
    walls = [np.flatnonzero(np.abs(x[:, 0] - at) < 1e-9) for at in (0.0, 1.0)]
    planes = [d * np.flatnonzero(np.abs(x[:, k]) < 1e-9) + k for k in range(1, d)]
    fixed = np.unique(np.concatenate([*(d * wall for wall in walls), *planes]))
    free = np.setdiff1d(np.arange(x.size), fixed)
    u = np.zeros(x.size)
    u[free] = spla.spsolve(K[free][:, free].tocsc(), load[free])
    held = K @ u - load
    area = 0.8 if d == 2 else 0.8 * 0.6
    pull = E * ALPHA * WARMER * area
    assert held[d * walls[1]].sum() == pytest.approx(pull, rel=1e-10)
    assert held[d * walls[0]].sum() == pytest.approx(-pull, rel=1e-10)


@pytest.mark.parametrize(
    ("kinds", "counts"), [(("quad8", "tri6"), (40, 33)), (("quad4", "quad8"), (60, 25))]
)
def test_a_bimetal_strip_bends_as_timoshenko_says(kinds, counts):
    """S. Timoshenko, Journal of the Optical Society of America 11 (1925) 233, eq. (4)."""
    thick, length = (1e-3, 1.5e-3), 60e-3
    moduli, alphas = {"low": 120e9, "high": 200e9}, {"low": 17e-6, "high": 9e-6}
    materials = {
        name: Material(moduli[name], NU, 8000.0, "stress", alpha) for name, alpha in alphas.items()
    }
    heights = (np.linspace(-thick[0], 0, 3), np.linspace(0, thick[1], 4))
    parts = []
    for kind, n, y, name in zip(kinds, counts, heights, materials, strict=True):
        part = box(
            kind,
            (np.linspace(0, length, n + 1), y),
            None,
            "incompatible" if kind == "quad4" else "full",
        )
        on = np.flatnonzero(np.abs(part.points[:, 1]) < 1e-12)
        part = replace(part, element_sets={name: np.arange(part.elements)})
        parts.append(with_surfaces(part, {f"{name}_face": surface_of_nodes(part.blocks, on)}))
    mesh = joined(*parts)
    mesh, tying = tied(mesh, Tie("weld", "low_face", "high_face"))
    K, _ = assemble(mesh, materials)
    load = thermal_load(mesh, changes(mesh, None, WARMER), materials)
    x = mesh.points
    clamp = np.flatnonzero((np.abs(x[:, 0]) < 1e-9) & (x[:, 1] > thick[1] - 1e-9))
    other = np.flatnonzero((np.abs(x[:, 0] - length) < 1e-9) & (x[:, 1] > thick[1] - 1e-9))
    fixed = np.unique(np.concatenate([2 * clamp, 2 * clamp + 1, 2 * other + 1]))
    every = stacked([tying, constraints_of(mesh, rotations_of(mesh))], x.size)
    basis, _ = free_displacements(every, fixed)
    u = basis @ spla.spsolve((basis.T @ K @ basis).tocsc(), basis.T @ load)
    top = np.flatnonzero(
        (x[:, 1] > thick[1] - 1e-9) & (x[:, 0] > 0.2 * length) & (x[:, 0] < 0.8 * length)
    )
    curvature = 2 * np.polyfit(x[top, 0], u[2 * top + 1], 2)[0]
    m, n = thick[0] / thick[1], moduli["low"] / moduli["high"]
    h = sum(thick)
    expected = 6 * (alphas["high"] - alphas["low"]) * WARMER * (1 + m) ** 2
    expected /= h * (3 * (1 + m) ** 2 + (1 + m * n) * (m**2 + 1 / (m * n)))
    assert curvature == pytest.approx(-expected, rel=1e-2)


def test_the_coefficient_is_read_from_a_deck(tmp_path):
    mesh = box("quad8", axes_of("quad8"))
    mesh = replace(
        mesh,
        element_sets={"all": np.arange(mesh.elements)},
        materials={"steel": Material(E, NU, 7800.0)},
        sections=(Section("all", "steel"),),
    )
    deck = write_inp(mesh, tmp_path / "deck.inp")
    text = deck.read_text()
    deck.write_text(text.replace("*DENSITY", "*EXPANSION, ZERO=20\n1.2E-5\n*DENSITY"))
    found = read_mesh(deck)
    assert found.materials["steel"].thermal_expansion == 1.2e-5
    assert not any("EXPANSION" in str(caution) for caution in found.cautions)
    deck.write_text(text.replace("*DENSITY", "*EXPANSION\n1.2E-5, 20\n1.3E-5, 200\n*DENSITY"))
    found = read_mesh(deck)
    assert found.materials["steel"].thermal_expansion == 0.0
    assert any("EXPANSION" in str(caution) for caution in found.cautions)
    deck.write_text(text.replace("*DENSITY", "*EXPANSION\n*DENSITY"))
    with pytest.raises(InputError, match=r"EXPANSION.*the coefficient is missing"):
        read_mesh(deck)

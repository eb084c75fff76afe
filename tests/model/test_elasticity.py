"""Finite elements against rigid motion, constant strain, beam theory and resultants."""

from __future__ import annotations

import numpy as np
import pytest
import scipy.sparse.linalg as spla
import skfem
from conftest import GEOMETRY, MATERIAL, joint_structure
from scipy.linalg import expm
from scipy.optimize import brentq

from microslip.model.elasticity import (
    Body,
    Material,
    elastic_body,
    traction_load,
    traction_stiffness,
)
from microslip.model.pressing import pressed_load, uniform

PLANES = ("strain", "stress")


def distorted_mesh() -> skfem.MeshQuad:
    """Unit square in 3 x 3 quadrilaterals with its interior corners moved about."""
    mesh = skfem.MeshQuad.init_tensor(np.linspace(0, 1, 4), np.linspace(0, 1, 4))
    points = mesh.p.copy()
    inside = np.all((points > 1e-9) & (points < 1 - 1e-9), axis=0)
    shift = np.array([[0.09, -0.07, 0.05, -0.1], [-0.06, 0.1, 0.08, -0.04]])
    points[:, inside] += shift
    return skfem.MeshQuad(points, mesh.t)


def interleave(x: np.ndarray, y: np.ndarray) -> np.ndarray:
    return np.column_stack([x, y]).ravel()


def beam(length: float, height: float, along: int, through: int, material: Material) -> Body:
    mesh = skfem.MeshQuad.init_tensor(
        np.linspace(0, length, along + 1), np.linspace(-height / 2, height / 2, through + 1)
    )
    return elastic_body(mesh, material)


@pytest.mark.parametrize("plane", PLANES)
def test_rigid_motion_makes_no_force(plane):
    body = elastic_body(distorted_mesh(), Material(70e9, 0.3, 2000.0, plane))
    x, y = body.nodes
    one, zero = np.ones_like(x), np.zeros_like(x)
    for motion in (interleave(one, zero), interleave(zero, one), interleave(-y, x)):
        force = body.stiffness @ motion
        assert np.abs(force).max() < 1e-13 * np.abs(body.stiffness).sum(axis=1).max()


@pytest.mark.parametrize("plane", PLANES)
@pytest.mark.parametrize(
    "strain", [(1.0, 0.0, 0.0), (0.0, 1.0, 0.0), (0.0, 0.0, 1.0), (0.3, -0.7, 0.4)]
)
def test_constant_strain_patch(plane, strain):
    """Linear displacements are in balance with the tractions of their constant stress."""
    E, nu = 70e9, 0.3
    body = elastic_body(distorted_mesh(), Material(E, nu, 2000.0, plane))
    ex, ey, g = strain
    if plane == "stress":
        sx, sy = E / (1 - nu**2) * np.array([ex + nu * ey, ey + nu * ex])
    else:
        factor = E / ((1 + nu) * (1 - 2 * nu))
        sx, sy = factor * np.array([(1 - nu) * ex + nu * ey, (1 - nu) * ey + nu * ex])
    sxy = E / (2 * (1 + nu)) * g
    x, y = body.nodes
    exact = interleave(ex * x + 0.5 * g * y, ey * y + 0.5 * g * x)
    load = np.zeros(2 * len(x))
    for axis, value in ((0, 0.0), (0, 1.0), (1, 0.0), (1, 1.0)):
        facets = body.mesh.facets_satisfying(
            lambda p, a=axis, c=value: np.abs(p[a] - c) < 1e-12, True
        )
        sign = 2 * value - 1
        tx, ty = (sx, sxy) if axis == 0 else (sxy, sy)
        load += traction_load(
            body, facets, lambda x, y, a=sign * tx, b=sign * ty: (a + 0 * x, b + 0 * x)
        )
    assert np.abs(body.stiffness @ exact - load).max() < 1e-13 * E
    held = np.array([2 * np.argmin(x + y), 2 * np.argmin(x + y) + 1, 2 * np.argmin(x - y)])
    free = np.setdiff1d(np.arange(len(load)), held)
    solved = exact.copy()
    right = load - body.stiffness[:, held] @ exact[held]
    solved[free] = spla.spsolve(body.stiffness[free][:, free].tocsc(), right[free])
    assert np.abs(solved - exact).max() < 1e-11


@pytest.mark.parametrize("plane", PLANES)
def test_slender_cantilever_bends_without_locking(plane):
    """Tip deflection of one element through the thickness: Euler-Bernoulli plus shear.

    delta = F L³/(3 E' I) + 6 F L/(5 G h). The end effects that beam theory leaves out are of
    relative order (h/L)³ = 3.7e-5 at L/h = 30; ten times that is allowed, less than half of the
    shear term.
    """
    length, height = 0.3, 0.01
    material = Material(70e9, 0.3, 2000.0, plane)
    body = beam(length, height, 60, 1, material)
    x, y = body.nodes
    end = body.mesh.facets_satisfying(lambda p: np.abs(p[0] - length) < 1e-12, True)
    load = traction_load(
        body, end, lambda x, y: (0 * x, 1.5 / height * (1 - (2 * y / height) ** 2))
    )
    root = np.flatnonzero(x < 1e-12)
    held = np.r_[2 * root, 2 * root[np.argmin(np.abs(y[root]))] + 1]
    free = np.setdiff1d(np.arange(len(load)), held)
    u = np.zeros(len(load))
    u[free] = spla.spsolve(body.stiffness[free][:, free].tocsc(), load[free])
    shear = 70e9 / 2.6
    bending = length**3 / (3 * material.plane_modulus() * height**3 / 12)
    expected = bending + 1.2 * length / (shear * height)
    assert load @ u == pytest.approx(expected, rel=10 * (height / length) ** 3)


def timoshenko(length, height, material, ends, count) -> np.ndarray:
    """Circular frequencies of a Timoshenko beam by its transfer matrix.

    Shear coefficient 5 (1 + nu)/(6 + 5 nu) (Timoshenko 1922; Hutchinson, J. Appl. Mech. 68 (2001)
    87), with nu/(1 - nu) for nu in plane strain.
    """
    EI = material.plane_modulus() * height**3 / 12
    nu = material.poissons_ratio
    plane_nu = nu if material.plane == "stress" else nu / (1 - nu)
    coefficient = 5 * (1 + plane_nu) / (6 + 5 * plane_nu)
    shear = coefficient * material.youngs_modulus / (2 * (1 + nu)) * height
    line, rotary = material.density * height, material.density * height**3 / 12
    known = slice(0, 2) if ends == "free" else slice(2, 4)

    def determinant(omega):
        # d/dx of (deflection, rotation, moment/EI, shear force/EI)
        A = np.array(
            [
                [0, 1, 0, EI / shear],
                [0, 0, 1, 0],
                [0, -rotary * omega**2 / EI, 0, -1],
                [-line * omega**2 / EI, 0, 0, 0],
            ]
        )
        return np.linalg.det(expm(A * length)[2:4, known])

    base = np.sqrt(EI / line) / length**2
    grid = base * np.linspace(1.0, 130.0, 130)
    values = [determinant(w) for w in grid]
    roots = [
        brentq(determinant, a, b)
        for a, b, fa, fb in zip(grid, grid[1:], values, values[1:], strict=False)
        if fa * fb < 0
    ]
    return np.array(roots[:count])


def test_transfer_matrix_has_the_textbook_limit():
    """The very slender Timoshenko beam has the roots 4.7300, 7.8532 and 1.8751, 4.6941."""
    material = Material(70e9, 0.3, 2000.0, "stress")
    base = np.sqrt(70e9 / 12 / 2000.0) * 1e-4
    for ends, roots in (("free", (4.730041, 7.853205)), ("clamped", (1.875104, 4.694091))):
        omega = timoshenko(1.0, 1e-4, material, ends, 2)
        assert np.sqrt(omega / base) == pytest.approx(roots, rel=1e-5)


@pytest.mark.parametrize("plane", PLANES)
@pytest.mark.parametrize("ends", ["free", "clamped"])
def test_bending_frequencies_of_a_slender_beam(plane, ends):
    """First three bending frequencies at L/h = 40 within 0.05 % of Timoshenko's.

    Two elements through the thickness: one alone cannot bend its cross-section into the cubic
    that shear makes, so its shear coefficient is 1 and its third frequency 0.1 % high.
    """
    length, height = 0.4, 0.01
    material = Material(70e9, 0.3, 2000.0, plane)
    body = beam(length, height, 80, 2, material)
    x, y = body.nodes
    held = np.array([], dtype=int)
    if ends == "clamped":
        root = np.flatnonzero(x < 1e-12)
        held = np.r_[2 * root, 2 * root[np.argmin(np.abs(y[root]))] + 1]
    free = np.setdiff1d(np.arange(2 * len(x)), held)
    K, M = (a[free][:, free].tocsc() for a in (body.stiffness, body.mass))
    values = spla.eigsh(K, k=8, M=M, sigma=-1e3, which="LM", return_eigenvectors=False)
    omega = np.sqrt(np.sort(values[values > 1.0]))
    expected = timoshenko(length, height, material, ends, 3)
    assert omega[:3] == pytest.approx(expected, rel=5e-4)


def test_axial_frequency_is_that_of_a_bar():
    """Lowest axial mode of a clamped bar in plane stress: omega = (pi/2) sqrt(E/rho) / L."""
    length, height = 0.4, 0.01
    body = beam(length, height, 40, 1, Material(70e9, 0.3, 2000.0, "stress"))
    x, y = body.nodes
    sliding = np.r_[2 * np.flatnonzero(x < 1e-12), 2 * np.flatnonzero(np.abs(y) < 1e-12) + 1]
    free = np.setdiff1d(np.arange(2 * len(x)), sliding)
    K, M = (a[free][:, free].tocsc() for a in (body.stiffness, body.mass))
    lowest = spla.eigsh(K, k=1, M=M, sigma=0, which="LM", return_eigenvectors=False)[0]
    # lateral inertia (Rayleigh-Love) lowers it by (nu k h)²/24 = 6e-7
    assert np.sqrt(lowest) == pytest.approx(np.pi / 2 * np.sqrt(70e9 / 2000) / length, rel=1e-5)


def test_total_mass_and_its_moments():
    body = elastic_body(distorted_mesh(), Material(70e9, 0.3, 2000.0))
    x, y = body.nodes
    one, zero = np.ones_like(x), np.zeros_like(x)
    tx, ty, spin = interleave(one, zero), interleave(zero, one), interleave(-y, x)
    assert tx @ body.mass @ tx == pytest.approx(2000.0, rel=1e-12)
    assert ty @ body.mass @ ty == pytest.approx(2000.0, rel=1e-12)
    assert abs(tx @ body.mass @ ty) < 1e-9
    assert spin @ body.mass @ ty == pytest.approx(1000.0, rel=1e-12)
    assert spin @ body.mass @ spin == pytest.approx(2000.0 * 2 / 3, rel=1e-12)


def test_joint_mass_is_that_of_two_beams():
    structure = joint_structure(21)
    along_x = (structure.free % 2 == 0).astype(float)
    total = along_x @ structure.mass @ along_x
    assert total == pytest.approx(2 * GEOMETRY.length * GEOMETRY.thickness * 2000.0, rel=1e-12)


def full_vectors(structure, *names):
    """Nodes of both meshes and loads back on all degrees of freedom."""
    nodes = np.hstack([elastic_body(mesh, MATERIAL).nodes for mesh in structure.meshes])
    vectors = []
    for name in names:
        full = np.zeros(2 * nodes.shape[1])
        full[structure.free] = structure.loads[name]
        vectors.append(full.reshape(-1, 2).T)
    return nodes, vectors


def test_moment_load_is_a_unit_couple_at_each_end():
    """Counter-clockwise at the right end, clockwise at the left: concave up."""
    nodes, (force,) = full_vectors(joint_structure(21), "moment")
    for side in (-1.0, 1.0):
        end = np.sign(nodes[0]) == side
        x, y, fx, fy = *nodes[:, end], *force[:, end]
        assert np.sum(x * fy - y * fx) == pytest.approx(side, rel=1e-12)
        assert abs(fx.sum()) < 1e-12 * np.abs(fx).sum()
        assert np.all(fy == 0)
        loaded = nodes[0][(force[0] != 0) & end]
        assert np.ptp(loaded) == 0.0


@pytest.mark.parametrize("pairs", [21, 51, 201])
def test_clamp_load_has_unit_resultant_on_each_face(pairs):
    nodes, (force,) = full_vectors(joint_structure(pairs), "clamp")
    for side in (-1.0, 1.0):
        face = nodes[1] == side * GEOMETRY.thickness
        assert force[1, face].sum() == pytest.approx(-side, rel=1e-12)
        assert abs(np.sum(nodes[0, face] * force[1, face])) < 1e-14
    assert np.all(force[0] == 0)
    assert force[1].sum() == pytest.approx(0.0, abs=1e-12)


@pytest.mark.parametrize("half_length", [0.5, 0.61, 0.75, 0.999, 1e-3])
def test_pressed_length_cut_by_an_edge_is_integrated_exactly(half_length):
    """Moments 0, 1 and 2 of an even pressure on |x| <= half_length are 1, 0, half_length²/3."""
    mesh = skfem.MeshQuad.init_tensor(np.linspace(-1, 1, 9) ** 3, np.array([0.0, 1.0]))
    body = elastic_body(mesh, MATERIAL)
    top = mesh.facets_satisfying(lambda x: np.abs(x[1] - 1) < 1e-12, True)
    load = pressed_load(body, top, uniform(0.0, half_length))
    x = body.nodes[0]
    assert np.all(load[::2] == 0)
    assert load[1::2].sum() == pytest.approx(1.0, rel=1e-12)
    assert abs(x @ load[1::2]) < 1e-14
    assert x**2 @ load[1::2] == pytest.approx(half_length**2 / 3, rel=1e-12)


def test_spread_springs_add_up():
    body = elastic_body(distorted_mesh(), MATERIAL)
    right = body.mesh.facets_satisfying(lambda x: np.abs(x[0] - 1) < 1e-12, True)
    spring = traction_stiffness(body, right, 1e5, 0)
    y = body.nodes[1]
    one, tilt = interleave(np.ones_like(y), 0 * y), interleave(y, 0 * y)
    assert one @ spring @ one == pytest.approx(1e5, rel=1e-12)
    assert tilt @ spring @ one == pytest.approx(1e5 / 2, rel=1e-12)
    assert tilt @ spring @ tilt == pytest.approx(1e5 / 3, rel=1e-12)
    across = interleave(0 * y, np.ones_like(y))
    assert np.abs(spring @ across).max() == 0.0

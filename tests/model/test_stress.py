"""What sections carry, against equilibrium and Euler-Bernoulli."""

from __future__ import annotations

import numpy as np
import pytest
import scipy.sparse.linalg as spla
import skfem
from conftest import GEOMETRY, MATERIAL, joint_structure

from microslip.model.elasticity import elastic_body
from microslip.model.modes import bonding, linear_modes
from microslip.model.stress import deflection, sections_of_beam, sections_outside


@pytest.fixture(scope="module")
def beam():
    """A slender beam of one body."""
    mesh = skfem.MeshQuad.init_tensor(np.linspace(0, 1, 61), np.linspace(-0.01, 0.01, 3))
    return elastic_body(mesh, MATERIAL)


@pytest.fixture(scope="module")
def structure():
    return joint_structure(31)


def interleaved(x, y):
    return np.column_stack([x, y]).ravel()


def test_pure_bending_and_tension(beam):
    """u = kappa x y + e x, v = -kappa x²/2 - nu' (...): M = E' I kappa, N = E' h e, everywhere."""
    x, y = beam.nodes
    kappa, e, h = 1e-3, 1e-5, 0.02
    nu = 0.3 / 0.7  # of the plane problem
    u = -kappa * x * y + e * x
    v = kappa * x**2 / 2 + nu * (kappa * y**2 / 2 - e * y)
    found = sections_of_beam(beam.mesh, MATERIAL, interleaved(u, v))
    bending = MATERIAL.plane_modulus() * h**3 / 12
    assert found.moment == pytest.approx(np.full(60, bending * kappa), rel=1e-9)
    assert found.force == pytest.approx(np.full(60, MATERIAL.plane_modulus() * h * e), rel=1e-9)
    assert found.stress == pytest.approx(
        np.full(60, MATERIAL.plane_modulus() * (e + kappa * h / 2)), rel=1e-9
    )
    assert found.position == pytest.approx((np.arange(60) + 0.5) / 60)


def test_a_rigid_motion_bears_nothing(beam):
    x, y = beam.nodes
    found = sections_of_beam(beam.mesh, MATERIAL, interleaved(1 - 0.1 * y, 2 + 0.1 * x))
    assert found.stress.max() < 1e-6 * MATERIAL.youngs_modulus * 0.1


def test_first_mode_of_a_slender_beam(beam):
    """phi = sqrt(2/(rho h L)) sin(pi x/L): sigma = E' h/2 (pi/L)² phi."""
    x, y = beam.nodes
    held = [2 * int(np.argmin(np.hypot(x - end, y))) + 1 for end in (0.0, 1.0)]
    free = np.setdiff1d(np.arange(2 * len(x)), held)
    K, M = beam.stiffness[free][:, free], beam.mass[free][:, free]
    values, shapes = spla.eigsh(K, k=4, M=M, sigma=1.0)
    bending = shapes[:, np.argmax(values > 1.0)]
    whole = np.zeros(2 * len(x))
    whole[free] = bending / np.sqrt(bending @ (M @ bending))
    found = sections_of_beam(beam.mesh, MATERIAL, whole)
    amplitude = np.sqrt(2 / (2000 * 0.02))
    curvature = np.pi**2 * amplitude * np.sin(np.pi * found.position)
    expected = MATERIAL.plane_modulus() * 0.01 * curvature
    assert found.stress == pytest.approx(expected, rel=5e-3, abs=5e-3 * expected.max())


def test_end_moments_at_rest_bend_every_section_alike(structure):
    """Statically determinate but for weak springs: M(x) = M."""
    held = np.arange(structure.interface.relative.shape[0])
    basis = bonding(structure.interface.relative, held)
    stiffness = (basis.T @ structure.stiffness @ basis).tocsc()
    bent = basis @ spla.spsolve(stiffness, basis.T @ structure.loads["moment"])
    found = sections_outside(structure, MATERIAL, bent)
    assert found.moment == pytest.approx(np.ones(len(found.moment)), rel=1e-4)
    assert np.abs(found.position).min() > GEOMETRY.overlap_half_length
    assert found.stress == pytest.approx(np.full(len(found.moment), 6 / 0.0125**2), rel=1e-4)
    lift = structure.loads["lift"] @ bent
    assert deflection(structure, bent) == pytest.approx(abs(lift), rel=0.02)


def test_a_mode_bends_a_section_as_its_inertia_does(structure):
    """Equilibrium of the outer part: m' = shear, shear' = -omega² rho h w, of the mode's own motion."""
    held = np.arange(structure.interface.relative.shape[0])
    modes = linear_modes(structure, held, 6, align="moment")
    k = int(np.argmax(np.abs(modes.shapes.T @ structure.loads["moment"]) / modes.omega**2))
    shape = modes.shapes[:, k]
    found = sections_outside(structure, MATERIAL, shape)
    left = found.position < 0
    x, moment = found.position[left], found.moment[left]
    order = np.argsort(x)
    x, moment = x[order], moment[order]
    mesh = structure.meshes[0]
    whole = np.zeros(structure.free.max() + 2)
    whole[structure.free] = shape
    nodes = mesh.p[:, :]
    deflected = whole[1 : 2 * nodes.shape[1] : 2]
    bottom = nodes[1] == nodes[1].min()
    w = np.interp(x, nodes[0, bottom], deflected[bottom])
    curvature_of_moment = np.gradient(np.gradient(moment, x), x)[4:-4]
    inertia = modes.omega[k] ** 2 * MATERIAL.density * 0.0125 * w[4:-4]
    # m'' = omega² rho h w, and rotary inertia, which is a per cent here
    assert curvature_of_moment == pytest.approx(inertia, rel=0.1, abs=0.1 * np.abs(inertia).max())

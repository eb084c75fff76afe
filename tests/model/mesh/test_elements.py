"""Finite elements of every type against closed forms and against scikit-fem's own."""

from dataclasses import replace

import numpy as np
import pytest
import scipy.linalg as la
import scipy.sparse.linalg as spla
import skfem
from grids import box, shaken
from skfem.models.elasticity import linear_elasticity

from microslip.errors import ModelError
from microslip.model.elasticity import Material
from microslip.model.mesh.assembly import assemble
from microslip.model.mesh.boundary import boundary, with_surfaces
from microslip.model.mesh.element_types import TYPES
from microslip.model.mesh.finite_elements import Block, FiniteElementMesh, bending_cautions
from microslip.model.mesh.loads import pressure_load

SOLIDS = [name for name, shape in TYPES.items() if shape.family != "line"]
MATERIAL = Material(210e9, 0.3, 7800.0)


def axes_of(kind, counts=(2, 3, 2), lengths=(1.0, 0.8, 0.6)):
    d = TYPES[kind].dimension
    return [np.linspace(0.0, s, n + 1) for s, n in zip(lengths[:d], counts[:d], strict=True)]


@pytest.mark.parametrize("kind", SOLIDS)
def test_shape_functions_interpolate_linear_fields_and_sum_to_one(kind):
    shape = TYPES[kind]
    xi, _ = shape.quadrature(4)
    assert np.allclose(shape.shapes(xi).sum(axis=1), 1.0, atol=1e-14)
    assert np.allclose(shape.shapes(xi) @ shape.nodes, xi, atol=1e-14)
    step = 1e-6
    for axis in range(shape.dimension):
        move = step * np.eye(shape.dimension)[axis]
        slope = (shape.shapes(xi + move) - shape.shapes(xi - move)) / (2 * step)
        assert np.allclose(shape.gradients(xi)[..., axis], slope, atol=1e-8)


@pytest.mark.parametrize(
    ("kind", "other"),
    [
        ("tri6", skfem.ElementTriP2()),
        ("quad8", skfem.ElementQuadS2()),
        ("quad9", skfem.ElementQuad2()),
        ("tet10", skfem.ElementTetP2()),
        ("hex20", skfem.ElementHexS2()),
        ("hex27", skfem.ElementHex2()),
        ("wedge6", skfem.ElementWedge1()),
    ],
)
def test_shape_functions_are_those_of_scikit_fem(kind, other):
    shape = TYPES[kind]
    family = shape.family
    low = {"tri": (0, 0), "tet": (0, 0, 0), "wedge": (0, 0, -1)}.get(
        family, (-1,) * shape.dimension
    )
    high = {"tri": (1, 1), "tet": (1, 1, 1)}.get(family, (1,) * shape.dimension)
    low, high = np.array(low), np.array(high)
    unit = (shape.nodes - low) / (high - low)
    xi = np.random.default_rng(3).uniform(0.05, 0.3, (5, shape.dimension))
    ours = shape.shapes(low + xi * (high - low))
    for i, at in enumerate(other.doflocs):
        k = int(np.argmin(np.abs(unit - at).max(axis=1)))
        assert np.allclose(unit[k], at)
        assert np.allclose(ours[:, k], other.lbasis(xi.T, i)[0], atol=1e-13)


@pytest.mark.parametrize("kind", SOLIDS)
def test_outward_faces_close_the_element(kind):
    """``∮ n dA = 0`` and ``∮ x · n dA = d V`` with the faces as they are numbered."""
    shape = TYPES[kind]
    d = shape.dimension
    closed, volume = np.zeros(d), 0.0
    for name, nodes in shape.faces:
        face = TYPES[name]
        xi, w = face.quadrature(4)
        x = shape.nodes[list(nodes)]
        tangents = np.einsum("kd,qkc->qdc", x, face.gradients(xi))
        if d == 2:
            normal = np.column_stack([tangents[:, 1, 0], -tangents[:, 0, 0]])
        else:
            normal = np.cross(tangents[:, :, 0], tangents[:, :, 1])
        at = face.shapes(xi) @ x
        closed += w @ normal
        volume += w @ np.einsum("qd,qd->q", at, normal) / d
    _, w = shape.quadrature(2)
    assert np.allclose(closed, 0.0, atol=1e-13)
    assert volume == pytest.approx(w.sum(), rel=1e-12)


def fields(points, seed=1):
    d = points.shape[1]
    gradient = 1e-3 * np.random.default_rng(seed).standard_normal((d, d))
    return points @ gradient.T, gradient


@pytest.mark.parametrize(
    ("kind", "formulation"),
    [(k, "full") for k in SOLIDS] + [("quad4", "incompatible"), ("hex8", "incompatible")],
)
def test_patch_test_and_mass(kind, formulation):
    """Displacements linear in the coordinates, held on the boundary, are what the inside takes."""
    axes = axes_of(kind)
    mesh = box(kind, axes, shaken(axes, 5), formulation)
    K, M = assemble(mesh, MATERIAL)
    d = mesh.dimension
    volume = np.prod([a[-1] for a in axes])
    for i in range(d):
        along = np.eye(d)[i][None].repeat(len(mesh.points), 0).ravel()
        assert along @ M @ along == pytest.approx(7800.0 * volume, rel=1e-12)
    u, _ = fields(mesh.points)
    boundary = np.zeros(len(mesh.points), bool)
    for axis, a in zip(mesh.points.T, axes, strict=True):
        boundary |= (axis < 1e-9) | (axis > a[-1] - 1e-9)
    inside = np.repeat(~boundary, d)
    x = u.ravel().copy()
    x[inside] = 0.0
    x[inside] = spla.spsolve(K[inside][:, inside].tocsc(), -(K @ x)[inside])
    assert np.abs(x - u.ravel()).max() < 1e-11 * np.abs(u).max()
    rigid = np.column_stack(
        [mesh.points[:, 1], -mesh.points[:, 0], *([0 * mesh.points[:, 0]] * (d - 2))]
    )
    assert np.abs(K @ rigid.ravel()).max() < 1e-10 * np.abs(K.data).max()


def cantilever(kind, elements, formulation="full", ratio=20.0):
    """Two lowest frequencies of a cantilever of unit height in one plane over Euler and Bernoulli's."""
    d = TYPES[kind].dimension
    axes = [np.linspace(0, ratio, elements + 1), np.linspace(0, 1.0, 3)]
    if d == 3:
        axes.append(np.linspace(0, 0.5, 2))
    mesh = box(kind, axes, formulation=formulation)
    K, M = assemble(mesh, Material(1.0, 0.0, 1.0))
    held = mesh.points[:, 0] < 1e-9
    free = np.repeat(~held, d)
    if d == 3:
        free[2::3] = False
    K, M = K[free][:, free].tocsc(), M[free][:, free].tocsc()
    values = spla.eigsh(K, k=2, M=M, sigma=0.0, return_eigenvectors=False)
    beta = np.array([1.8751040687, 4.6940911330]) / ratio
    return np.sqrt(np.sort(values)) / (beta**2 * np.sqrt(1 / 12))


GOOD = [k for k in SOLIDS if TYPES[k].order == 2]


@pytest.mark.parametrize(
    ("kind", "formulation"),
    [(k, "full") for k in GOOD] + [("quad4", "incompatible"), ("hex8", "incompatible")],
)
def test_cantilever_frequencies_are_those_of_beam_theory(kind, formulation):
    """Timoshenko's: shear and rotary inertia take 2 % off the second at a slenderness of 20."""
    found = cantilever(kind, 20, formulation)
    assert found[0] == pytest.approx(timoshenko()[0], rel=3e-3)
    assert found[1] == pytest.approx(timoshenko()[1], rel=1e-2)


def timoshenko(ratio=20.0, nu=0.0):
    """Cantilever by Timoshenko's theory over Euler and Bernoulli's, by a Ritz series in both fields."""
    kappa, shear = 10 * (1 + nu) / (12 + 11 * nu), 0.5 / (1 + nu)
    s, w = np.polynomial.legendre.leggauss(40)
    s, w = 0.5 * (s + 1), 0.5 * w
    legendre = [np.polynomial.Legendre.basis(n, [0, 1]) for n in range(14)]
    p = np.column_stack([s * f(s) for f in legendre])
    dp = np.column_stack([f(s) + s * f.deriv()(s) for f in legendre])
    inner = lambda a, b: a.T @ (w[:, None] * b)  # noqa: E731
    I, A = 1 / 12, 1.0
    kga = kappa * shear * A
    K = np.block(
        [
            [kga * inner(dp, dp) / ratio, -kga * inner(dp, p)],
            [-kga * inner(p, dp), I * inner(dp, dp) / ratio + kga * ratio * inner(p, p)],
        ]
    )
    M = la.block_diag(A * ratio * inner(p, p), I * ratio * inner(p, p))
    values = la.eigh(K, M, eigvals_only=True)[:2]
    beta = np.array([1.8751040687, 4.6940911330]) / ratio
    return np.sqrt(values) / (beta**2 * np.sqrt(I))


@pytest.mark.parametrize("kind", ["tri3", "quad4", "tet4", "hex8", "wedge6"])
def test_linear_elements_bend_too_stiffly_and_are_named(kind):
    assert cantilever(kind, 20)[0] > 1.02
    assert kind in bending_cautions(box(kind, axes_of(kind)))[0].where


@pytest.mark.parametrize(("kind", "order"), [("tri6", 4), ("quad8", 4), ("tri3", 2), ("quad4", 2)])
def test_frequencies_converge_with_the_order_of_the_element(kind, order):
    """The lowest eigenvalue of a square held all round, whose mode is smooth: error by h^(2p)."""
    found = []
    for n in (4, 8, 16):
        axes = [np.linspace(0, 1, n + 1)] * 2
        mesh = box(kind, axes)
        K, M = assemble(mesh, Material(1.0, 0.0, 1.0))
        free = np.repeat(mesh.points.min(axis=1) > 1e-9, 2)
        free &= np.repeat((mesh.points < 1 - 1e-9).all(axis=1), 2)
        K, M = K[free][:, free].tocsc(), M[free][:, free].tocsc()
        found.append(float(spla.eigsh(K, k=1, M=M, sigma=0.0, return_eigenvectors=False)[0]))
    rate = np.log2((found[0] - found[1]) / (found[1] - found[2]))
    assert rate == pytest.approx(order, abs=0.4)


def test_stiffness_and_mass_are_those_of_scikit_fem():
    mesh = box("quad8", axes_of("quad8"), shaken(axes_of("quad8"), 2))
    K, _ = assemble(mesh, MATERIAL)
    corners = mesh.blocks[0].nodes[:, :4]
    used = np.unique(corners)
    number = np.zeros(len(mesh.points), int)
    number[used] = np.arange(len(used))
    other = skfem.MeshQuad(mesh.points[used].T.copy(), number[corners].T.copy())
    basis = skfem.Basis(other, skfem.ElementVector(skfem.ElementQuadS2()), intorder=4)
    stiffness = skfem.asm(linear_elasticity(*MATERIAL.lame()), basis)
    assert np.allclose(
        np.sort(np.linalg.eigvalsh(K.toarray())),
        np.sort(np.linalg.eigvalsh(stiffness.toarray())),
        atol=1e-9 * np.abs(K.data).max(),
    )


def test_inverted_and_flat_elements_are_named():
    mesh = box("quad4", axes_of("quad4"))
    nodes = mesh.blocks[0].nodes.copy()
    nodes[3] = nodes[3, ::-1]
    bad = FiniteElementMesh(
        mesh.points, mesh.node_labels, (Block("quad4", nodes, mesh.blocks[0].labels),)
    )
    with pytest.raises(ModelError, match="element 103 has a negative Jacobian"):
        assemble(bad, MATERIAL)
    nodes[3] = [0, 1, 1, 0]
    bad = FiniteElementMesh(
        mesh.points, mesh.node_labels, (Block("quad4", nodes, mesh.blocks[0].labels),)
    )
    with pytest.raises(ModelError, match="element 103 has no volume"):
        assemble(bad, MATERIAL)


@pytest.mark.parametrize("kind", SOLIDS)
def test_faces_of_mirrored_elements_look_outward_too(kind):
    mesh = box(kind, axes_of(kind), shaken(axes_of(kind), 4))
    volume = np.prod([a[-1] for a in axes_of(kind)])
    for side in (1.0, -1.0):
        other = replace(mesh, points=mesh.points * [side, *[1.0] * (mesh.dimension - 1)])
        whole = with_surfaces(other, {"outside": boundary(mesh.blocks)[0]})
        # the divergence theorem: the pressure's work on a growth of all lengths is the volume's
        load = -pressure_load(whole, "outside")
        assert load @ other.points.ravel() == pytest.approx(mesh.dimension * volume, rel=1e-12)


def test_a_mesh_that_counts_the_other_way_round_is_the_same():
    mesh = box("hex8", axes_of("hex8"))
    mirrored = mesh.blocks[0].nodes[:, [4, 5, 6, 7, 0, 1, 2, 3]]
    other = FiniteElementMesh(
        mesh.points, mesh.node_labels, (Block("hex8", mirrored, mesh.blocks[0].labels),)
    )
    K, M = assemble(mesh, MATERIAL)
    K2, M2 = assemble(other, MATERIAL)
    assert abs(K - K2).max() < 1e-12 * abs(K).max()
    assert abs(M - M2).max() < 1e-12 * abs(M).max()

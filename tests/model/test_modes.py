"""Linear modes, free and bonded, and the frequencies of the reference joint."""

from __future__ import annotations

import numpy as np
import pytest
import scipy.sparse as sp
from conftest import GEOMETRY, bending_mode, build_reference, joint_structure

from microslip.analyses.prepared.prestress import prestress
from microslip.contact.pairs import components, normal, normal_components, tangential
from microslip.errors import ModelError
from microslip.model.flexibility import static_flexibility
from microslip.model.interface import Interface
from microslip.model.joint import Reducer
from microslip.model.modes import PartFactors, bonding, linear_modes, spectral_shift
from microslip.model.structure import Structure

NONE = np.array([], dtype=int)


def chain(masses: int) -> Structure:
    """Two masses-and-springs chains end to end, each fixed at its outer end; one contact pair.

    Unit masses and springs; degrees of freedom alternate x (chain) and y (loose spring of 50).
    """
    n = 2 * masses
    K = 2 * np.eye(n) - np.eye(n, k=1) - np.eye(n, k=-1)
    K[masses - 1, masses] = K[masses, masses - 1] = 0
    K[masses - 1, masses - 1] = K[masses, masses] = 1
    stiffness = np.kron(K, np.diag([1.0, 0.0])) + np.kron(np.eye(n), np.diag([0.0, 50.0]))
    relative = np.zeros((2, 2 * n))
    relative[0, [2 * masses - 1, 2 * masses + 1]] = 1, -1
    relative[1, [2 * masses - 2, 2 * masses]] = -1, 1
    return Structure(
        sp.csc_matrix(stiffness),
        sp.identity(2 * n, format="csc"),
        Interface(np.zeros(1), np.ones(1), sp.csr_matrix(relative)),
        {"end": np.eye(2 * n)[0]},
        np.arange(2 * n),
    )


def test_free_chains_have_their_textbook_frequencies():
    """Fixed-free chain of n: omega_k = 2 sin((2 k - 1) pi / (2 (2 n + 1))), twice each."""
    n = 6
    omega = linear_modes(chain(n), NONE, 6).omega
    k = np.repeat(np.arange(1, 4), 2)
    assert omega == pytest.approx(2 * np.sin((2 * k - 1) * np.pi / (2 * (2 * n + 1))), rel=1e-9)


def test_bonded_chains_share_one_displacement():
    """Bonding the pair in x joins the ends: 2 n - 1 displacements, a double mass in the middle.

    Odd modes of the joined chain have a node there: fixed-fixed chains of n - 1. Even ones are
    those of a fixed-free chain whose end mass and end spring are whole: the free chain itself.
    """
    n = 6
    modes = linear_modes(chain(n), np.array([1]), 5)
    symmetric = 2 * np.sin((2 * np.arange(1, 4) - 1) * np.pi / (2 * (2 * n + 1)))
    odd = 2 * np.sin(np.arange(1, 3) * np.pi / (2 * n))
    assert modes.omega == pytest.approx(np.sort(np.r_[symmetric, odd]), rel=1e-9)
    assert np.abs((chain(n).interface.relative @ modes.shapes)[1]).max() < 1e-12


def test_sign_follows_the_load_that_aligns():
    modes = linear_modes(chain(5), np.array([1]), 4, align="end")
    assert np.all(modes.shapes[0] >= 0)


@pytest.fixture(scope="module")
def joint():
    return joint_structure(21)


def test_modes_are_mass_normalised_and_solve_the_eigenproblem(joint):
    bonded = normal_components(np.arange(6, 15))
    modes = linear_modes(joint, bonded, 8)
    shapes = modes.shapes
    assert shapes.T @ joint.mass @ shapes == pytest.approx(np.eye(8), abs=1e-8)
    stiffness = shapes.T @ joint.stiffness @ shapes
    assert np.abs(stiffness - np.diag(modes.omega**2)).max() < 1e-8 * modes.omega[-1] ** 2
    assert np.abs(joint.interface.relative[bonded] @ shapes).max() < 1e-12 * np.abs(shapes).max()
    force = joint.stiffness @ shapes - joint.mass @ shapes * modes.omega**2
    basis = bonding(joint.interface.relative, bonded)
    scale = np.abs(joint.mass @ shapes * modes.omega[-1] ** 2).max()
    assert np.abs(basis.T @ force).max() < 1e-6 * scale


def test_four_soft_modes_of_the_free_joint(joint):
    """Each beam may swing about its support and slide on its springs; nothing else is soft.

    Sliding of one beam: omega² = springs/(rho h L); swinging without gravity or rotary spring is
    held by the end face on the springs alone: k h²/12 over the moment of inertia rho h L³/3.
    """
    omega = linear_modes(joint, NONE, 6).omega
    mass = 2000.0 * GEOMETRY.thickness * GEOMETRY.length
    slide = np.sqrt(1e5 / mass)
    swing = np.sqrt(1e5 * GEOMETRY.thickness**2 / 12 / (mass * GEOMETRY.length**2 / 3))
    slender = (GEOMETRY.thickness / GEOMETRY.length) ** 2
    assert omega[:2] == pytest.approx(swing, rel=slender)
    assert omega[2:4] == pytest.approx(slide, rel=slender)
    assert omega[4] > 20 * slide


def test_bonding_more_never_lowers_a_frequency(joint):
    pairs = np.arange(5, 16)
    nothing = linear_modes(joint, NONE, 6).omega
    sliding = linear_modes(joint, normal_components(pairs), 6).omega
    stuck = linear_modes(joint, components(pairs), 6).omega
    small = 1e-6 * nothing[-1]
    assert np.all(sliding >= nothing - small)
    assert np.all(stuck >= sliding - small)


def test_basis_spans_the_bonded_displacements(joint):
    relative = joint.interface.relative
    sticking = components(np.arange(4, 9))
    bonded = np.union1d(normal_components(np.arange(21)), sticking)
    basis = bonding(relative, bonded)
    assert basis.shape == (joint.dofs, joint.dofs - len(bonded))
    assert np.abs(relative[bonded] @ basis).max() < 1e-14
    # independent columns: each of the displacements kept is one row of the identity
    rows = basis.tocsr()
    single = rows[np.diff(rows.indptr) == 1]
    assert len(np.unique(single.indices)) == basis.shape[1]


def test_bonding_a_component_twice_is_refused(joint):
    with pytest.raises(ModelError, match="bond"):
        bonding(joint.interface.relative, np.array([4, 4, 4]))


def test_shift_is_far_below_every_elastic_mode(joint):
    elastic = linear_modes(joint, NONE, 6).omega[4]
    assert 0 < spectral_shift(joint) < 1e-2 * elastic**2


def sliding_frequency(structure, touching) -> float:
    modes = linear_modes(structure, normal_components(np.flatnonzero(touching)), 8, align="moment")
    return modes.frequency[bending_mode(modes, structure)]


@pytest.mark.validate
def test_sliding_frequency_of_the_paper(published, finding):
    """Bonded over |x| <= 1.18 L_p the joint has the paper's 174.6 Hz."""
    structure = joint_structure(201)
    zone = published["paper"]["prestress_contact_half_length_over_Lp"] * GEOMETRY.clamp_half_length
    found = sliding_frequency(structure, np.abs(structure.interface.position) <= zone + 1e-12)
    off = abs(found - published["paper"]["sliding_frequency_hz"])
    finding("sliding frequency over the paper's contact against the paper, Hz", off, at_most=0.2)


@pytest.mark.validate
def test_sliding_frequency_converges_at_first_order(finding):
    """A fixed end of bonding leaves a square-root singularity: energy, and omega², of order 1.

    The end, 1.2 L_p, is an element corner of every mesh (with 51 pairs it is a mid-side node).
    """
    pairs = (101, 201, 401, 801)
    found = []
    for m in pairs:
        structure = joint_structure(m)
        x = np.abs(structure.interface.position) / GEOMETRY.clamp_half_length
        assert np.abs(x - 1.2).min() < 1e-9
        found.append(sliding_frequency(structure, x <= 1.2 + 1e-9))
    steps = np.diff(found)
    orders = np.log2(steps[:-1] / steps[1:])
    limit = found[-1] + steps[-1] / (2 ** orders[-1] - 1)
    print(f"sliding frequencies {found}, orders {orders}, limit {limit:.4f} Hz")
    what = "order of convergence of the sliding frequency with the mesh, off 1"
    finding(what, abs(orders[-1] - 1), at_most=0.05)
    assert abs(orders[-1] - 1) < abs(orders[0] - 1)


@pytest.mark.validate
def test_sliding_frequency_over_the_receding_contact_of_the_layers(published, finding):
    """The layers' contact, a/h = 2.391 for b/h = 2, is 1.1955 L_p: 174.90 Hz, between two nodes.

    Frequencies over the zones that end at the nodes around it bracket the one in between, and the
    prestress finds its end within one spacing of the layers'.
    """
    joint = build_reference(201)
    a = published["receding_contact"]["a_over_h"][1] * GEOMETRY.thickness
    x = np.abs(joint.model.position)
    low = sliding_frequency(joint.structure, x <= a)
    high = sliding_frequency(joint.structure, x <= a + joint.spacing)
    print(f"sliding frequency {low:.4f} .. {high:.4f} Hz, prestress {joint.states.sliding_omega}")
    assert low < 174.90 < high
    end = x[joint.start.touching].max()
    what = "end of the contact against the receding contact of layers, in spacings of the pairs"
    finding(what, abs(end - a) / joint.spacing, at_most=1.0)


def test_prestress_zone_is_the_paper_s(reference, published):
    """Contact half-length over L_p: 1.18 to 1.20, within one pair spacing."""
    end = np.abs(reference.model.position[reference.start.touching]).max()
    ratio = end / GEOMETRY.clamp_half_length
    spacing = reference.spacing / GEOMETRY.clamp_half_length
    assert 1.18 - spacing <= ratio <= 1.20 + spacing


def test_stuck_joint_is_stiffer_than_the_sliding_one(reference):
    assert reference.states.stuck_omega > 1.03 * reference.states.sliding_omega


def test_modes_do_not_depend_on_the_model(reference):
    """Rayleigh quotients of the shapes on the full matrices."""
    K, M, states = reference.structure.stiffness, reference.structure.mass, reference.states
    for omega, shape in (
        (states.sliding_omega, states.sliding),
        (states.stuck_omega, states.stuck),
    ):
        assert shape @ M @ shape == pytest.approx(1.0, rel=1e-10)
        assert np.sqrt(shape @ K @ shape) == pytest.approx(omega, rel=1e-8)


def test_half_turn_keeps_the_bending_mode(reference):
    """Bending is odd or even under the half turn, so its slip and gap are so along x."""
    v = reference.structure.interface.relative @ reference.states.sliding
    for part in (normal(v), tangential(v)):
        even, odd = np.abs(part - part[::-1]).max(), np.abs(part + part[::-1]).max()
        assert min(even, odd) < 1e-6 * np.abs(v).max()


def test_prestress_is_without_friction(small_reference):
    plain = small_reference.reducer.model(small_reference.structure.loads)
    start = prestress(plain, static_flexibility(plain), {"clamp": 1e6})
    assert np.all(tangential(start.solution.r) == 0)
    assert isinstance(small_reference.reducer, Reducer)


def test_equal_bodies_share_factors_and_have_modes_each(small_reference):
    """Modes of both satisfy their equation, orthonormal; a body that differs a little has its own."""
    structure = small_reference.structure
    shifted = (structure.stiffness + spectral_shift(structure) * structure.mass).tocsc()
    factors = PartFactors(shifted)
    assert factors.likeness == [0, 0]
    found = linear_modes(structure, NONE, 12, factors=factors)
    K, M, x = structure.stiffness, structure.mass, found.shapes
    assert x.T @ (M @ x) == pytest.approx(np.eye(12), abs=1e-8)
    assert x.T @ (K @ x) == pytest.approx(np.diag(found.omega**2), abs=1e-8 * found.omega[-1] ** 2)
    force = K @ x - (M @ x) * found.omega**2
    assert np.abs(force).max() < 1e-6 * np.abs(K @ x).max()
    other = shifted.copy()
    other[factors.parts[1][0], factors.parts[1][0]] *= 1 + 1e-12
    assert PartFactors(other.tocsc()).likeness == [0, 1]

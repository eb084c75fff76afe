"""Damping of joints from files: a matrix, a ratio at two frequencies, ratios of modes of the stuck joint."""

from __future__ import annotations

import numpy as np
import pytest
import scipy.sparse as sp
from conftest import ROOT
from matrices_files import as_matrices, sparse_parts
from same_joint import reference_document

from microslip.analyses.backbone.extended_motion import harmonic_backbone
from microslip.analyses.backbone.points import amplitude_scale
from microslip.analyses.prepared.joint_modes import joint_modes
from microslip.describe.reading import load_joint, parse_joint
from microslip.errors import InputError
from microslip.model.damping import rayleigh_through
from microslip.model.joint import bonded_modes
from microslip.model.lap import structure_of
from microslip.model.modes import linear_modes
from microslip.pipeline.prepare import assemble

ALPHA, BETA = 3.0, 2e-6


@pytest.fixture(scope="module")
def lap():
    document = reference_document(21)
    return parse_joint(document | {"analysis": {"cycle": {"moment": [2e3]}}})


def with_matrix(lap, folder, C, **units):
    np.savez(folder / "damping.npz", **sparse_parts("C", C))
    document = as_matrices(lap, folder) | {"load": {"moment": [20.0]}}
    document.pop("damping")
    document["matrices"] = document["matrices"] | {"damping": "damping.npz:C"}
    document["analysis"] = {"cycle": {"moment": [2e3]}}
    return document


def test_a_proportional_matrix_is_alpha_and_beta(lap, tmp_path):
    s = structure_of(lap)
    document = with_matrix(lap, tmp_path, ALPHA * s.mass + BETA * s.stiffness)
    found = assemble(parse_joint(document, "matrices", tmp_path))
    assert found.model.rayleigh == pytest.approx((ALPHA, BETA), rel=1e-8)
    assert found.damping.missed < 1e-8
    assert not found.damping.cautions


def test_only_part_of_a_matrix_that_is_not_quite_proportional_is_taken_and_said(lap, tmp_path):
    """Half of the degrees of freedom have a little more damping by mass."""
    s = structure_of(lap)
    rough = np.zeros(s.dofs)
    rough[: s.dofs // 2] = 1.0
    some = sp.diags(rough) @ s.mass @ sp.diags(rough)
    document = with_matrix(lap, tmp_path, ALPHA * (s.mass + 0.05 * some) + BETA * s.stiffness)
    found = assemble(parse_joint(document, "matrices", tmp_path))
    assert 1e-6 < found.damping.missed < 0.05
    assert any("misses" in str(caution) for caution in found.doubts)
    with pytest.raises(InputError, match="no alpha M \\+ beta K comes near it"):
        assemble(parse_joint(with_matrix(lap, tmp_path, some), "matrices", tmp_path))


def test_matrices_that_are_no_damping_are_refused(lap, tmp_path):
    s = structure_of(lap)
    one_sided = sp.triu(s.stiffness, 1) * 1e-6 + s.stiffness * 1e-6
    for C, said in (
        (-BETA * s.stiffness, "gives energy to the mode"),
        (one_sided, "is not symmetric"),
        (s.mass[:5, :5], "is 5 by 5"),
    ):
        document = with_matrix(lap, tmp_path, C)
        with pytest.raises(InputError, match=said):
            assemble(parse_joint(document, "matrices", tmp_path))
    both = with_matrix(lap, tmp_path, s.stiffness) | {"damping": {"beta": 1e-6}}
    with pytest.raises(InputError, match=r"is in matrices\.damping already"):
        parse_joint(both, "matrices", tmp_path)


@pytest.mark.parametrize(
    ("given", "said"),
    [
        ({"ratio": 0.01}, "are given both or not at all"),
        ({"ratio": 0.01, "frequencies": ["1 Hz"]}, "must be two"),
        ({"ratio": 0.01, "frequencies": [1.0, 2.0], "beta": 1e-6}, "remove alpha and beta"),
        ({"modes": [1]}, "says which modes ratios are of"),
        ({"ratios": [0.01], "beta": 1e-6}, "remove alpha, beta and ratio"),
        ({"ratios": [0.01, 0.02], "modes": [1]}, "are 1, and ratios 2"),
        ({"ratios": [0.01, 0.02], "modes": [2, 2]}, "names one thing twice"),
        ({"ratios": [0.01, 0.5]}, "less than 0.5"),
    ],
)
def test_a_ratio_needs_two_frequencies(lap, tmp_path, given, said):
    document = as_matrices(lap, tmp_path) | {"damping": given, "load": {"moment": [20.0]}}
    with pytest.raises(InputError, match=said):
        parse_joint(document, "matrices", tmp_path)


def by_ratios(lap, folder, **damping):
    document = as_matrices(lap, folder) | {"damping": damping, "load": {"moment": [20.0]}}
    document["analysis"] = {"cycle": {"moment": [2e3]}}
    return assemble(parse_joint(document, "matrices", folder))


@pytest.mark.parametrize(
    "given",
    [
        {"ratios": 0.01},
        {"ratios": [0.004, 0.01]},
        {"ratios": [0.02, 0.01], "modes": [3, 1]},
        {"ratios": 0.003, "modes": 2},
    ],
)
def test_modes_of_the_stuck_structure_decay_as_given(lap, tmp_path, given):
    """On all degrees of freedom: (alpha M + beta K) with the pairs that touch bonded."""
    found = by_ratios(lap, tmp_path, **given)
    alpha, beta = found.model.rayleigh
    s, start = found.structure, found.prestress
    stuck = linear_modes(s, start.bonded(2), 12)
    C = alpha * s.mass + beta * s.stiffness
    ratios = np.atleast_1d(given["ratios"])
    numbers = np.atleast_1d(given.get("modes", 1 + np.arange(len(ratios))))
    modes = joint_modes(found.model, start, found.prepared.law)
    assert found.damping.at == pytest.approx([modes[n - 1].stuck_omega for n in numbers])
    for number, ratio in zip(numbers, ratios, strict=True):
        k = int(np.argmin(np.abs(stuck.omega - modes[number - 1].stuck_omega)))
        shape, omega = stuck.shapes[:, k], stuck.omega[k]
        assert shape @ (C @ shape) / (2 * omega) == pytest.approx(ratio, rel=1e-6)
    assert not found.damping.cautions


def test_modes_have_stuck_modes_of_their_own():
    """Two sliding modes of the example are nearest to the same stuck one."""
    found = assemble(load_joint(ROOT / "examples" / "matrices_beam.toml"))
    start, law = found.prestress, found.prepared.law
    modes = joint_modes(found.model, start, law)
    _, stuck = bonded_modes(found.model, start.bonded(found.model.dimension), law.compliance)
    nearest = [int(np.argmax((mode.sliding @ stuck) ** 2)) for mode in modes]
    assert len(set(nearest)) < len(modes)
    assert len({mode.stuck_omega for mode in modes}) == len(modes)


def test_the_motion_of_small_amplitude_decays_as_given(lap, tmp_path):
    """The nonlinear mode by harmonic balance, where nothing slips yet."""
    found = by_ratios(lap, tmp_path, ratios=[0.004, 0.01])
    joint = found.prepared
    modes = joint_modes(joint.model, joint.prestress, joint.law)
    for number, ratio in ((1, 0.004), (2, 0.01)):
        mode = modes[number - 1]
        smallest = 1e-7 * amplitude_scale(joint, mode)
        backbone, failures = harmonic_backbone(joint, mode, [smallest], harmonics=1)
        assert not failures
        assert backbone.points[0].damping_ratio == pytest.approx(ratio, rel=1e-6)


@pytest.mark.parametrize("omega", [[100.0, 400.0], [400.0, 100.0]])
def test_two_ratios_that_are_too_far_apart_are_told_how_far_they_may_be(omega):
    """By beta alone ratios are as the frequencies, by alpha alone as their inverse."""
    omega = np.array(omega)
    for ratio in (0.001 * omega / 100, 0.001 * 100 / omega):
        assert rayleigh_through(omega, ratio).missed < 1e-12
    with pytest.raises(InputError, match=r"second is 0\.25 to 4 times the first; give one,"):
        rayleigh_through(omega, np.array([0.001, 0.008]))
    with pytest.raises(InputError, match="give one or two"):
        rayleigh_through(np.append(omega, 900.0), np.array([0.01, 0.001, 0.02]))


def test_ratios_that_no_rayleigh_damping_has(lap, tmp_path):
    with pytest.raises(InputError, match=r"damping\.ratios: no alpha M \+ beta K has them"):
        by_ratios(lap, tmp_path, ratios=[0.01, 0.001, 0.02])
    with pytest.raises(InputError, match=r"damping\.ratios: there is no mode 900"):
        by_ratios(lap, tmp_path, ratios=0.01, modes=900)
    own = by_ratios(lap, tmp_path, ratios=[0.01, 0.01])
    modes = joint_modes(own.model, own.prestress, own.prepared.law)
    near = [own.damping.ratio(mode.stuck_omega) for mode in modes[:3]]
    some = by_ratios(lap, tmp_path, ratios=[near[0], near[1], 1.02 * near[2]])
    assert 1e-6 < some.damping.missed < 0.02
    assert any("damping.ratios" in str(caution) for caution in some.doubts)

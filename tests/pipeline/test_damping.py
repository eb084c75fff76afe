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
from microslip.analyses.prepared.saved import load_model, save_model
from microslip.describe.reading import load_joint, parse_joint
from microslip.errors import InputError
from microslip.model.damping import through_ratios
from microslip.model.joint import bonded_modes
from microslip.model.lap import structure_of
from microslip.model.modes import linear_modes
from microslip.model.shape_damping import ratio_by_coupling
from microslip.pipeline.prepare import assemble
from microslip.pipeline.run import run

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


def test_a_matrix_is_taken_whole(lap, tmp_path):
    """Half of the degrees of freedom have more damping by mass, or all of it."""
    s = structure_of(lap)
    rough = np.zeros(s.dofs)
    rough[: s.dofs // 2] = 1.0
    some = sp.diags(rough) @ s.mass @ sp.diags(rough)
    for C, missed in (
        (ALPHA * (s.mass + 0.05 * some) + BETA * s.stiffness, (1e-6, 0.05)),
        (10 * ALPHA * some + BETA * s.stiffness, (0.1, 1.0)),
    ):
        found = assemble(parse_joint(with_matrix(lap, tmp_path, C), "matrices", tmp_path))
        assert missed[0] < found.damping.missed < missed[1]
        shapes = found.reducer.modes.shapes
        own = np.abs(found.model.damping_matrix()).max()
        np.testing.assert_allclose(
            found.model.damping_matrix(), shapes.T @ (C @ shapes), atol=1e-10 * own
        )
        # the joint's mode on all degrees of freedom, by its complex eigenvalue in the joint model
        mode, start = found.mode, found.prestress
        shape = found.states.stuck
        of_shape, _ = ratio_by_coupling(found.model, start.bonded(2), mode.stuck)
        true = shape @ (C @ shape) / (2 * mode.stuck_omega)
        assert of_shape == pytest.approx(true, rel=max(2 * found.damping.off, 1e-6))
        assert found.damping.off < 1e-2


def test_what_the_truncated_part_of_a_matrix_is_off_by_is_said(lap, tmp_path):
    """One stiff dashpot between two neighbours moves nothing as the kept modes do."""
    s = structure_of(lap)
    rates = np.zeros(s.dofs)
    relative = s.interface.relative.tocsr()[0]
    rates[relative.indices] = relative.data
    dashpot = sp.csc_matrix(np.outer(rates, rates))
    C = BETA * s.stiffness + 3e3 * dashpot
    found = assemble(parse_joint(with_matrix(lap, tmp_path, C), "matrices", tmp_path))
    off = []
    for shape in (found.states.sliding, found.states.stuck):
        off.append(shape @ (C @ shape))
    assert found.damping.matrix is not None
    assert np.linalg.eigvalsh(found.model.damping_matrix())[0] > 0
    said = any("is truncated" in str(caution) for caution in found.doubts)
    assert said == (found.damping.off > 1e-2)
    print(f"off by {found.damping.off:.2e}, damping {off}")


def test_matrices_that_are_no_damping_are_refused(lap, tmp_path):
    s = structure_of(lap)
    crossed = sp.lil_matrix(s.mass.shape)
    crossed[0, 1] = crossed[1, 0] = 1.0
    one_sided = sp.triu(s.stiffness, 1) * 1e-6 + s.stiffness * 1e-6
    for C, said in (
        (-BETA * s.stiffness, "gives energy to the mode"),
        (one_sided, "is not symmetric"),
        (BETA * s.stiffness + 1e6 * crossed.tocsc(), "gives energy to"),
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


FIVE = [0.01, 0.012, 0.004, 0.015, 0.009]


@pytest.fixture(scope="module")
def five(lap, tmp_path_factory):
    """Five ratios as a modal test has them: no alpha and beta come near them."""
    return by_ratios(lap, tmp_path_factory.mktemp("five"), ratios=FIVE)


def test_five_ratios_are_met_on_all_degrees_of_freedom(five):
    """C = alpha M + beta K + sum d_n (M phi_n)(M phi_n)^T with the stuck modes of the structure."""
    alpha, beta = five.model.rayleigh
    s, start = five.structure, five.prestress
    stuck = linear_modes(s, start.bonded(2), 12)
    modes = joint_modes(five.model, start, five.prepared.law)
    kept = five.reducer.modes.shapes
    D = five.model.damping
    assert np.linalg.eigvalsh(D)[0] > -1e-12 * np.abs(D).max()
    assert np.linalg.matrix_rank(D, tol=1e-9 * np.abs(D).max()) <= len(FIVE)
    for mode, ratio in zip(modes, FIVE, strict=False):
        k = int(np.argmin(np.abs(stuck.omega - mode.stuck_omega)))
        shape, omega = stuck.shapes[:, k], stuck.omega[k]
        own = kept.T @ (s.mass @ shape)
        damped = alpha + beta * omega**2 + own @ D @ own
        assert damped / (2 * omega) == pytest.approx(ratio, rel=1e-4)
    for number, ratio in enumerate(FIVE[:2]):
        shape = modes[number].stuck
        of_shape, coupled = ratio_by_coupling(five.model, start.bonded(2), shape)
        assert of_shape == pytest.approx(ratio, rel=1e-6)
        assert coupled == pytest.approx(ratio, rel=1e-4)


def test_five_ratios_are_those_of_small_motions(five):
    """The nonlinear mode where nothing slips; half-power and decay are those of the same pole."""
    joint = five.prepared
    modes = joint_modes(joint.model, joint.prestress, joint.law)
    for number in (1, 3):
        mode, ratio = modes[number - 1], FIVE[number - 1]
        smallest = 1e-7 * amplitude_scale(joint, mode)
        backbone, failures = harmonic_backbone(joint, mode, [smallest], harmonics=1)
        assert not failures
        # of first order in the damping but for what couples the mode to others
        assert backbone.points[0].damping_ratio == pytest.approx(ratio, rel=1e-4)


def test_a_saved_model_has_its_full_damping(five, tmp_path):
    again = load_model(save_model(five.prepared, tmp_path / "five.npz"))
    assert np.array_equal(again.model.damping, five.model.damping)
    with np.load(tmp_path / "five.npz") as file:
        entries = dict(file)
    assert int(entries["format_version"]) == 2
    for change, said in (
        (lambda D: D - 1e9 * np.eye(len(D)), "would drive the joint"),
        (lambda D: D + np.triu(D), "damping is not symmetric"),
        (lambda D: D[1:], "damping is"),
    ):
        np.savez(tmp_path / "other.npz", **entries | {"damping": change(entries["damping"])})
        with pytest.raises(InputError, match=said):
            load_model(tmp_path / "other.npz")


@pytest.mark.parametrize("omega", [[100.0, 400.0], [400.0, 100.0]])
def test_two_ratios_are_alpha_and_beta_as_far_as_these_go(omega):
    """By beta alone ratios are as the frequencies, by alpha alone as their inverse."""
    omega = np.array(omega)
    for ratio in (0.001 * omega / 100, 0.001 * 100 / omega):
        assert through_ratios(omega, ratio, np.eye(2)).matrix is None
    for ratio in ([0.001, 0.008], [0.05, 0.002]):
        found = through_ratios(omega, np.array(ratio), np.eye(2))
        damped = found.alpha + found.beta * omega**2 + np.diag(found.matrix)
        np.testing.assert_allclose(damped, 2 * np.array(ratio) * omega, rtol=1e-12)
        assert min(found.alpha, found.beta) >= 0
        assert found.matrix.min() >= 0
        assert np.diag(found.matrix).min() == pytest.approx(0, abs=1e-9)


def test_ratios_of_modes_that_are_not_there(lap, tmp_path):
    with pytest.raises(InputError, match=r"damping\.ratios: there is no mode 900"):
        by_ratios(lap, tmp_path, ratios=0.01, modes=900)


@pytest.mark.validate
def test_every_method_has_the_same_five_ratios(lap, tmp_path, finding):
    """Harmonic balance, time integration, the reduced model and three backbones of a joint that slips."""
    document = as_matrices(lap, tmp_path) | {
        "damping": {"ratios": FIVE},
        "load": {"moment": [60.0]},
    }
    document["analysis"] = {
        "response": {"from": "178 Hz", "to": "182 Hz", "count": 3, "checks": 0},
        "reduced": {"amplitudes": 16, "steps": 80},
        "harmonic": {"frequencies": [178.0, 182.0], "harmonics": 5},
        "time": {"frequencies": [178.0, 182.0]},
        "backbone": {"count": 2, "methods": ["quasi_static", "prescribed", "harmonic"]},
    }
    found = run(parse_joint(document, "matrices", tmp_path))
    assert not found.failures
    (response,) = found.responses
    (curve,) = found.harmonic
    for point in curve.points:
        assert point.dissipated + point.material_work == pytest.approx(
            point.external_work, rel=1e-3
        )
    for state in found.time_domain:
        frequency, size = state.steady.frequency, abs(state.steady.amplitude)
        near = min(curve.points, key=lambda p: abs(p.frequency - frequency))
        assert near.frequency == pytest.approx(frequency, rel=1e-12)
        reduced = abs(response.amplitude[np.argmin(np.abs(response.frequency - frequency))])
        finding(
            "harmonic balance against time integration",
            abs(abs(near.amplitude) / size - 1),
            at_most=0.01,
        )
        finding("reduced model against time integration", abs(reduced / size - 1), at_most=0.03)
    small = [backbone.points[0].damping_ratio for backbone in found.backbones]
    off = np.abs(np.array(small) / FIVE[0] - 1).max()
    finding("damping ratio of small motions in backbones against that given", off, at_most=2e-3)

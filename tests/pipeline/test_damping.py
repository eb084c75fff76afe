"""Damping of joints from files: a matrix, and a ratio at two frequencies."""

from __future__ import annotations

import numpy as np
import pytest
import scipy.sparse as sp
from matrices_files import as_matrices, sparse_parts
from same_joint import reference_document

from microslip.describe.reading import parse_joint
from microslip.errors import InputError
from microslip.model.lap import structure_of
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
    ],
)
def test_a_ratio_needs_two_frequencies(lap, tmp_path, given, said):
    document = as_matrices(lap, tmp_path) | {"damping": given, "load": {"moment": [20.0]}}
    with pytest.raises(InputError, match=said):
        parse_joint(document, "matrices", tmp_path)

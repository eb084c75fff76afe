"""Matrices that are their own image, taken apart, against numpy's products and whole contact problems."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

import microslip
from microslip.analyses.time.scheme import march, prestressed_state, time_scheme
from microslip.contact.folded import NOT_FOLDED, ROUNDING, folded, product
from microslip.contact.pairs import components


def own_image(pairs, seed=0):
    """A symmetric matrix that is its own image where pairs are read backwards."""
    rng, image = np.random.default_rng(seed), np.arange(pairs)[::-1]
    M, rows = rng.normal(size=(2 * pairs, 2 * pairs)), components(image)
    M = M + M.T
    return M + M[np.ix_(rows, rows)], image


@pytest.mark.parametrize("pairs", [80, 81, 150, 201])
def test_its_product_is_that_of_the_whole_matrix(pairs):
    """Also where a pair in the middle is its own image."""
    W, image = own_image(pairs)
    parts = folded(W, image)
    assert parts.even.size + parts.odd.size == pytest.approx(0.5 * W.size, rel=0.03)
    r, out = np.random.default_rng(1).normal(size=2 * pairs), np.full(2 * pairs, np.nan)
    # nothing of W is read beside its parts
    product(np.full_like(W, np.nan), parts, r, out)
    np.testing.assert_allclose(out, W @ r, rtol=0, atol=4e-16 * np.abs(W).sum(axis=1).max())


def test_images_need_not_be_in_any_order():
    W, image = own_image(90)
    mixed = np.random.default_rng(2).permutation(90)
    rows, place = components(mixed), np.argsort(mixed)
    W, image = W[np.ix_(rows, rows)], place[image[mixed]]
    parts, r, out = folded(W, image), np.arange(180.0), np.zeros(180)
    assert len(parts.even) == 90
    product(W, parts, r, out)
    np.testing.assert_allclose(out, W @ r, rtol=1e-13)


def test_one_that_is_not_its_own_image_to_rounding_stays_whole():
    W, image = own_image(100)
    at = np.abs(W).max()
    for change, whole in ((3 * ROUNDING, True), (0.3 * ROUNDING, False)):
        other = W.copy()
        other[3, 3] += change * at
        assert (len(folded(other, image).even) == 0) == whole
    assert folded(W, None) is folded(W[:40, :40], image[80:]) is NOT_FOLDED


def test_what_is_no_number_stays_none():
    W, image = own_image(80)
    r, out = np.zeros(160), np.zeros(160)
    r[7] = np.nan
    product(W, folded(W, image), r, out)
    assert np.isnan(out).any()


def test_marching_is_the_same_with_the_whole_matrix():
    joint = microslip.prepare(microslip.reference_joint(pairs=101))
    frequency, load = 178.0, 500.0
    scheme = time_scheme(joint, 1 / (150 * frequency), frequency=frequency)
    assert len(scheme.folded.even) == 102
    wave = load * np.sin(2 * np.pi * np.arange(301) / 150)
    by_parts, whole = (
        march(one, prestressed_state(one), wave)
        for one in (scheme, replace(scheme, folded=NOT_FOLDED))
    )
    assert (by_parts.state.status == whole.state.status).all()
    size = np.abs(whole.state.r).max()
    np.testing.assert_allclose(by_parts.state.r, whole.state.r, rtol=0, atol=1e-9 * size)
    np.testing.assert_allclose(
        by_parts.output, whole.output, atol=1e-9 * np.abs(whole.output).max()
    )
    assert by_parts.residual.max() < 1e-9
    # some pairs slip, or the test would hold of linear motions alone
    assert by_parts.friction_work.max() > 0


def test_a_joint_without_the_symmetry_is_marched_with_the_whole_matrix():
    joint = microslip.reference_joint(pairs=101)
    upper = joint.beams.upper.model_copy(update={"thickness": 14e-3})
    beams = joint.beams.model_copy(update={"upper": upper})
    joint = microslip.prepare(joint.model_copy(update={"beams": beams}))
    assert time_scheme(joint, 1e-4).folded is NOT_FOLDED

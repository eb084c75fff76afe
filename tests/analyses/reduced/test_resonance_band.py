"""Bands and peaks against oscillators whose resonance is known in closed form."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from microslip.analyses.reduced.anchors import Anchor
from microslip.analyses.reduced.band import (
    FINEST,
    MOST,
    STEP,
    Peak,
    band_around,
    goes_on,
    refined,
    widened,
)
from microslip.analyses.reduced.resonance import linear_resonance, resonance, resonance_of
from microslip.analyses.reduced.response import (
    Response,
    all_amplitudes,
    forced_response,
    held_to,
    swept_both_ways,
)
from microslip.analyses.reduced.sweep import CONVERGED
from microslip.analyses.reduced.table import EquivalentTable
from microslip.analyses.reduced.through_anchors import Held
from microslip.analyses.reduced.two_mode import TwoModeModel

OMEGA = 2 * np.pi * 175.0
ONE = np.array([1.0, 0.0])
LONE = np.array([[1.0, 0.0], [0.0, 0.0]])


def oscillator(zeta: float = 2e-3, offset: float = 0.0) -> TwoModeModel:
    """``q'' + 2 zeta omega q' + omega² q = sin`` per unit load; the second coordinate is idle."""
    return TwoModeModel(
        m=np.eye(2),
        k=np.diag([OMEGA**2, 4 * OMEGA**2]),
        E=LONE,
        X=np.zeros((2, 2)),
        argument=ONE,
        sliding=ONE,
        force=ONE,
        rayleigh=(2 * zeta * OMEGA, 0.0),
        omega=OMEGA,
        offset=np.array([offset, 0.0]),
    )


def table(k_eq, gamma_eq, amplitude) -> EquivalentTable:
    zero = np.zeros_like(amplitude)
    return EquivalentTable(
        "prescribed",
        1.0,
        OMEGA,
        amplitude,
        amplitude,
        k_eq * np.ones_like(amplitude),
        gamma_eq * np.ones_like(amplitude),
        zero.astype(complex),
        zero,
        zero,
    )


def softening(depth: float = 0.1, loss: float = 4e-3) -> EquivalentTable:
    """k_eq from `depth` down to minus that, so fast that the response folds."""
    a = np.geomspace(1e-9, 1e-2, 200)
    return table(depth * np.cos(np.pi * np.clip(np.log10(a / 1e-5) / 3, 0, 1)), loss, a)


@pytest.mark.parametrize("zeta", [1e-6, 1e-4, 3e-2, 0.4])
def test_linear_resonance_in_closed_form(zeta):
    """Ewins: ``omega² = omega_0² (1 - 2 zeta²)``, ``|q| = 1/(2 zeta omega_0² sqrt(1 - zeta²))``."""
    frequency, amplitude = linear_resonance(oscillator(zeta), 3.0)
    assert frequency == pytest.approx(175 * np.sqrt(1 - 2 * zeta**2), rel=1e-12)
    assert amplitude == pytest.approx(3 / (2 * zeta * OMEGA**2 * np.sqrt(1 - zeta**2)), rel=1e-9)


def test_a_linear_oscillator_without_damping_or_without_a_peak():
    assert linear_resonance(oscillator(0.0)) == (pytest.approx(175), np.inf)
    assert linear_resonance(oscillator(0.8)) == (0.0, pytest.approx(1 / OMEGA**2))


def test_an_automatic_band_holds_the_peak_of_an_oscillator():
    """From anywhere: the ends move until the closed-form peak is inside, and the points resolve it."""
    model = oscillator(5e-4)
    frequency, amplitude = linear_resonance(model)

    def respond(f):
        return [forced_response(model, None, f, 1.0)]

    for wrong in (100.0, 174.0, 175.0, 190.0):
        start = band_around([Peak(wrong, 0.1)])
        low, high = widened(respond, start, (True, True), 201)
        if abs(wrong - 175) < 20:
            assert low < frequency < high
        axis = refined(respond, np.linspace(low, high, 21))
        (found,) = respond(axis)
        assert (np.diff(axis) > 0).all()
        if not low < frequency < high:
            assert found.peak_at_edge
            continue
        assert not found.peak_at_edge
        assert found.peak_frequency == pytest.approx(frequency, rel=1e-6)
        assert found.peak_amplitude == pytest.approx(amplitude, rel=1e-4)
        steps = np.abs(np.diff(found.amplitude)) / amplitude
        assert steps.max() <= STEP * 1.01


def test_given_ends_stay():
    def respond(f):
        return [forced_response(oscillator(), None, f, 1.0)]

    assert widened(respond, (180.0, 190.0), (False, True), 51) == (180.0, 190.0)
    low, high = widened(respond, (180.0, 190.0), (True, False), 51)
    assert high == 190
    assert low < 175


def test_the_vertex_of_a_parabola_is_exact_on_uneven_grids():
    frequency = np.array([168.0, 171.0, 173.0, 174.0, 180.0])
    size = 5 - 0.02 * (frequency - 172.7) ** 2
    n = len(frequency)
    found = Response(
        "", "", np.nan, 1.0, 0.0, frequency, size.astype(complex), np.ones(n, int), np.zeros(n),
        np.full(n, CONVERGED),
    )  # fmt: skip
    assert found.peak_frequency == pytest.approx(172.7, rel=1e-12)
    assert found.peak_amplitude == pytest.approx(5, rel=1e-12)
    mirrored = replace(found, frequency=-frequency[::-1], amplitude=found.amplitude[::-1])
    assert mirrored.peak_frequency == pytest.approx(-172.7, rel=1e-12)
    # beside a jump, where the points lie close on one side only, nothing is added
    beside = replace(
        found,
        frequency=np.array([170.0, 171.0, 172.0, 172.0001, 173.0]),
        amplitude=np.array([4.0, 4.8, 5.0, 3.0, 2.9], complex),
    )
    assert (beside.peak_frequency, beside.peak_amplitude) == (172.0, 5.0)


@pytest.mark.parametrize(("where", "edge"), [(0, True), (1, False), (3, False), (4, True)])
def test_a_peak_at_the_edge_is_told(where, edge):
    size = np.ones(5, complex)
    size[where] = 2
    found = Response(
        "", "", np.nan, 1.0, 0.0, np.arange(5.0), size, np.ones(5, int), np.zeros(5),
        np.full(5, CONVERGED),
    )  # fmt: skip
    assert found.peak_at_edge is edge


@pytest.mark.parametrize(
    ("error", "anchored", "cut"),
    [(0.02, True, True), (0.002, True, False), (0.02, False, False), (np.inf, True, True)],
)
def test_a_band_goes_on_where_motions_at_its_end_may_be_the_largest(error, anchored, cut):
    """Towards a resonance below it, motions that beat at the end are shown smaller by a hundredth there."""
    size = np.array([1.99, 2.0, 1.8, 1.5, 1.0])
    found = Response(
        "", "", np.nan, 1.0, 0.0, np.arange(5.0), size.astype(complex), np.ones(5, int), np.zeros(5),
        np.full(5, CONVERGED), error_indicator=np.array([error, 0, 0, 0, 0.1]),
        anchors=(Anchor(0.0, 1.99, 0j, 0.0),) if anchored else (),
    )  # fmt: skip
    assert goes_on(found, 0) is cut
    assert not goes_on(found, -1)
    far = replace(found, amplitude=found.amplitude * np.array([0.9, 1, 1, 1, 1]))
    assert not goes_on(far, 0)
    unsure = replace(found, error_indicator=np.array([error, 0.004, 0, 0, 0.1]))
    assert goes_on(unsure, 0) is anchored, "the largest may be smaller"


def test_resonance_of_constant_stiffness_and_loss():
    """``omega² = omega_0² (1 + k)``, half-power width ``omega eta``, load
    ``a (gamma omega_0² + c omega)``."""
    model = oscillator(1e-3)
    a = np.array([1e-6, 1e-4])
    found = resonance_of(model, table(0.21, 0.01, a))
    omega = 1.1 * OMEGA
    push = a * (0.01 * OMEGA**2 + 2e-3 * OMEGA * omega)
    assert found.omega == pytest.approx(omega)
    assert found.load == pytest.approx(push)
    assert found.width == pytest.approx(push / a / omega)
    assert found.reached(0.5 * push[1]) == 1
    assert found.reached(0.5 * push[0]) == 0
    # the forced response under that load has that amplitude at that frequency
    response = forced_response(
        model, table(0.21, 0.01, np.geomspace(1e-6, 1e-3, 9)), np.array([1.1 * 175]), push[1]
    )
    assert abs(response.amplitude[0]) == pytest.approx(a[1], rel=1e-9)


def test_an_offset_changes_what_pushes():
    """A = q + c M: the response of the refined model at resonance, in A, is ``(p + D c) M``."""
    model = oscillator(1e-3, offset=-0.2 / OMEGA**2)
    a = np.array([1e-4])
    found = resonance(model, a, np.array([0.1 + 0.02j]))
    near = table(0.1, 0.02, np.geomspace(1e-6, 1e-3, 9))
    f = np.array([found.omega[0] / (2 * np.pi)])
    response = forced_response(model, near, f, float(found.load[0]))
    A = response.amplitude[0] + model.offset[0] * found.load[0]
    assert abs(A) == pytest.approx(1e-4, rel=1e-9)


def test_a_fold_is_not_halved_for_ever():
    """A jump stays a jump: the points around it are bounded, and the curve is resolved elsewhere."""
    model, soft = oscillator(1e-4), softening()
    found = resonance_of(model, soft)
    load = 0.5 * found.largest_load
    peak = found.omega[found.reached(load)] / (2 * np.pi)
    assert any(len(all_amplitudes(model, soft, f, load)) == 3 for f in np.linspace(165, 185, 81))

    def respond(f):
        return [forced_response(model, soft, f, load, downward=True)]

    low, high = widened(
        respond, band_around([Peak(peak, 0.5), Peak(183.5, 0.5)]), (True, True), 201
    )
    axis = refined(respond, np.linspace(low, high, 101))
    assert len(axis) < 1000 < MOST
    (response,) = respond(axis)
    assert not response.peak_at_edge
    change = np.abs(np.diff(response.amplitude)) / np.abs(response.amplitude).max()
    jumps = np.flatnonzero(change > 2 * STEP)
    assert 1 <= len(jumps) <= 3
    assert (np.diff(axis)[jumps] <= 4 * FINEST * (high - low)).all()


def test_points_are_limited():
    """Of a curve that is steep everywhere."""

    def respond(f):
        n = len(f)
        noise = np.where(np.arange(n) % 2 == 0, 1.0 + 0j, -1.0)
        return [
            Response(
                "", "", np.nan, 1.0, 0.0, f, noise, np.ones(n, int), np.zeros(n),
                np.full(n, CONVERGED),
            )
        ]  # fmt: skip

    assert len(refined(respond, np.linspace(1, 2, 11))) == MOST


def test_bands_are_round_and_wide_enough():
    for peaks in ([Peak(171.2, 1.0), Peak(185.5, 0.1)], [Peak(33.0, 20.0)], [Peak(5e4, 1e-3)]):
        low, high = band_around(peaks)
        assert 0 < low < min(p.frequency for p in peaks)
        assert high > max(p.frequency + 3 * p.width for p in peaks)


def test_a_downward_sweep_follows_the_larger_amplitudes():
    """Of a softening fold, whichever end of the band is farther from the sliding frequency."""
    model, soft = oscillator(1e-4), softening()
    load = 0.5 * resonance_of(model, soft).largest_load
    for band in (np.linspace(150, 190, 1601), np.linspace(160, 200, 1601)):
        found = forced_response(model, soft, band, load, downward=True)
        peak = found.peak
        others = all_amplitudes(model, soft, band[peak + 1], load)
        assert abs(found.amplitude[peak + 1]) == pytest.approx(others.max(), rel=1e-6)
    down = forced_response(model, soft, band, load, downward=True)
    up = forced_response(model, soft, band, load, downward=False)
    assert up.peak_amplitude < down.peak_amplitude
    assert (forced_response(model, soft, band, load).amplitude == down.amplitude).all()


def test_of_a_fold_both_stable_answers_are_given():
    """The larger and the smaller are the outer ones of three roots, which exist nowhere else."""
    model, soft = oscillator(1e-4), softening()
    load = 0.5 * resonance_of(model, soft).largest_load
    band = np.linspace(150, 200, 401)
    found = swept_both_ways(lambda down: forced_response(model, soft, band, load, downward=down))
    roots = [all_amplitudes(model, soft, f, load, points=2000) for f in band]
    three = np.flatnonzero([len(r) == 3 for r in roots])
    assert len(three) > 20
    assert set(found.folded) == {k for k in three if roots[k].max() > 1.01 * roots[k].min()}
    assert found.smaller is not None
    for k in found.folded:
        assert abs(found.amplitude[k]) == pytest.approx(roots[k].max(), rel=1e-6)
        assert abs(found.smaller.amplitude[k]) == pytest.approx(roots[k].min(), rel=1e-6)


@pytest.mark.parametrize(("larger", "off"), [(True, 0.97), (False, 1.03)])
def test_a_correction_that_leads_to_the_smaller_motion_leaves_no_other(larger, off):
    """Put right by 3 % the larger of two motions has a smaller one beside it, the smaller has none."""
    model, soft = oscillator(1e-4), softening()
    load = 0.5 * resonance_of(model, soft).largest_load
    band = np.linspace(150, 200, 201)
    base = swept_both_ways(lambda down: forced_response(model, soft, band, load, downward=down))
    assert base.smaller is not None
    motion = base.amplitude.copy()
    if not larger:
        motion[base.folded] = base.smaller.amplitude[base.folded]
    now = Held(off * motion, np.full(len(band), 0.01))
    found = held_to(base, "auto", now, {})
    assert list(found.folded) == (list(base.folded) if larger else [])


def test_where_the_larger_answer_leaves_the_table_the_smaller_is_given():
    """Every point with a root inside the table has an answer, and it is one of the roots."""
    model, whole = oscillator(1e-4), softening()
    short = replace(
        whole,
        **{
            name: getattr(whole, name)[:150]
            for name in ("load", "amplitude", "k_eq", "gamma_eq", "cross", "dissipated", "stored")
        },
    )
    load = 6 * resonance_of(model, short).largest_load
    band = np.linspace(150, 195, 181)
    found = swept_both_ways(lambda down: forced_response(model, short, band, load, downward=down))
    assert found.outgrown is not None
    assert 0 < found.outgrown.sum() < len(band)
    assert not (found.outgrown & (found.flag != CONVERGED)).any()
    for k in np.flatnonzero(found.outgrown)[::5]:
        roots = all_amplitudes(model, short, band[k], load)
        assert abs(found.amplitude[k]) == pytest.approx(roots.min(), rel=1e-6)
    held = swept_both_ways(
        lambda down: forced_response(model, whole, band, load / 1000, downward=down)
    )
    assert held.outgrown is None

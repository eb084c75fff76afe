"""The beam with three bolts by every route: backbones, harmonic balance, time integration."""

from __future__ import annotations

import sys

import numpy as np
import pytest
from conftest import ROOT

sys.path.insert(0, str(ROOT / "docs" / "evidence"))
sys.path.insert(0, str(ROOT / "examples" / "meshes"))

import make
import three_bolts

from microslip.analyses.harmonic.over_time import OverTime

pytestmark = pytest.mark.validate


@pytest.fixture(scope="module")
def joint(tmp_path_factory):
    """On a coarser mesh than that of the example: 159 pairs instead of 271."""
    pytest.importorskip("gmsh")
    folder = tmp_path_factory.mktemp("beam")
    make.main(["half_lap_beam", "--size", "24", "--rest", "48", "--out", str(folder)])
    return three_bolts.joint_of(folder / "half_lap_beam.inp")


@pytest.fixture(scope="module")
def curves(joint):
    return three_bolts.backbones(joint, [1e-4, 1e-3], harmonics=5)


def test_a_faint_vibration_is_the_stuck_mode(joint, curves):
    """Quasi-statics lacks the inertia of the other stuck modes: what it tends to is a sum over them."""
    stuck = curves["harmonic"].mode.stuck_frequency
    for name in ("harmonic", "prescribed"):
        assert curves[name].frequency[0] == pytest.approx(stuck, rel=1e-4)
    assert stuck < curves["quasi_static"].frequency[0] < 1.005 * stuck


@pytest.mark.parametrize(
    ("method", "frequency", "damping"), [("prescribed", 5e-4, 0.02), ("first_harmonic", 2e-3, 0.02)]
)
def test_routes_agree_in_microslip(curves, finding, method, frequency, damping):
    """As in the plane, where cycles with q prescribed are within 0.02 % in frequency and 1.6 % in damping.

    Quasi-statics has 0.05 % of its own, by what it lacks in the stuck mode.
    """
    exact, other = curves["harmonic"].points[1], curves[method].points[1]
    assert other.amplitude == pytest.approx(exact.amplitude, rel=0.01)
    for what, allowed in (("omega", frequency), ("damping_ratio", damping)):
        off = abs(getattr(other, what) / getattr(exact, what) - 1)
        finding(f"three bolts, {method} against harmonic balance, {what}", off, at_most=allowed)


def test_time_integration_stays_beside_harmonic_balance(joint, curves, finding):
    """At resonance: the load makes up for the damping of the backbone, which it lags by a quarter."""
    point = curves["harmonic"].points[1]
    answer = three_bolts.at_resonance(joint, curves["harmonic"], point, 5)
    assert abs(answer.amplitude) == pytest.approx(point.amplitude, rel=0.04)
    assert np.degrees(abs(answer.phase)) == pytest.approx(90, abs=5)
    beside = OverTime(joint, answer.load).beside(answer)
    assert beside is not None
    off = abs(abs(beside.steady.amplitude) / abs(answer.amplitude) - 1)
    finding("three bolts at resonance, time against harmonic balance", off, at_most=0.01)

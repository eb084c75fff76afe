"""The load of an analysis: rho, moments and ratios are one thing, and rho = 0 is a gentle one."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np
import pytest

from microslip.analyses.reduced.two_mode import two_mode_model
from microslip.describe.amplitude import Load as LoadSection
from microslip.describe.reference import reference_joint
from microslip.errors import MicroslipError
from microslip.pipeline.cycle import drive_cycles
from microslip.pipeline.loads import (
    GENTLE,
    Load,
    calibrated_scale,
    end_moment,
    frictionless_response,
    gentle_moment,
    given_scale,
    loads_of_file,
    on_port,
    opening_of,
    scale_of_file,
    strength,
)
from microslip.pipeline.outcome import Outcome
from microslip.pipeline.prepare import Assembly, assemble
from microslip.pipeline.progress import NullProgress
from microslip.pipeline.response import known_scale

SCALE = 2.03e-3
BAND = np.linspace(165, 195, 601)


@pytest.fixture(scope="module")
def assembly() -> Assembly:
    """The reference joint of 21 pairs: mu = 0.25, P = 1 MN/m, L = 251.5 mm."""
    return assemble(reference_joint(pairs=21))


def under(assembly: Assembly, **load: Any) -> Assembly:
    """The same joint with another section [load]."""
    return replace(assembly, joint=assembly.joint.model_copy(update={"load": LoadSection(**load)}))


def never() -> float:
    raise AssertionError("no load is gentle here")


def test_strength_is_mu_p_l(assembly: Assembly) -> None:
    assert strength(assembly) == pytest.approx(0.25 * 1e6 * 0.2515)


def test_the_three_keys_say_the_same(assembly: Assembly) -> None:
    """M = C mu P L / rho, by hand."""
    moment = SCALE * 0.25 * 251.5e3 / 2.4
    assert end_moment(assembly, "moment", moment) == moment
    ratio = moment / 251.5e3
    assert end_moment(assembly, "moment_over_clamp_force_length", ratio) == pytest.approx(moment)
    assert end_moment(assembly, "rho", 2.4, SCALE) == pytest.approx(moment)


def test_rho_without_scale_is_refused(assembly: Assembly) -> None:
    with pytest.raises(MicroslipError, match="rho has no scale"):
        end_moment(assembly, "rho", 2.4)
    with pytest.raises(MicroslipError, match="rho has no scale"):
        loads_of_file(under(assembly, rho=(0.0, 2.4)), np.nan, lambda: 1.0)


def test_loads_of_a_file(assembly: Assembly) -> None:
    """Moments are told rho with C = 1; rho = 0 takes the gentle moment."""
    limit = 0.25 * 251.5e3
    by_moment = loads_of_file(under(assembly, moment=(50.0, 20.0)), np.nan, never)
    assert [load.moment for load in by_moment] == [50.0, 20.0]
    assert [load.rho for load in by_moment] == pytest.approx([limit / 50, limit / 20])
    by_ratio = loads_of_file(under(assembly, moment_over_clamp_force_length=(1e-3,)), np.nan, never)
    assert by_ratio[0].moment == pytest.approx(251.5)
    by_rho = loads_of_file(under(assembly, rho=(0.0, 5.0)), SCALE, lambda: 0.125)
    assert by_rho == (Load(0.0, 0.125), Load(5.0, pytest.approx(SCALE * limit / 5)))
    assert loads_of_file(replace(assembly, joint=without_load(assembly)), np.nan, never) == ()


def without_load(assembly: Assembly) -> Any:
    return assembly.joint.model_copy(update={"load": None})


def test_the_mode_is_driven_as_close_to_opening(assembly: Assembly) -> None:
    moments = np.array([10.0, 20.0])
    assert on_port(assembly, "moment", moments) is moments
    ratio = opening_of(assembly, "sliding") / opening_of(assembly, "moment")
    np.testing.assert_allclose(on_port(assembly, "mode", moments), moments * ratio, rtol=1e-12)


def test_the_frictionless_joint_is_one_oscillator(assembly: Assembly) -> None:
    """``q = f_M M / (omega_sl² (1 + i omega beta) - omega²)``."""
    found = frictionless_response(assembly, BAND, 3.0)
    mode, (alpha, beta) = assembly.mode, assembly.model.rayleigh
    omega = 2 * np.pi * BAND
    stiffness = mode.sliding_omega**2 * (1 + 1j * omega * beta) - omega**2 + 1j * omega * alpha
    expected = mode.load_on_sliding["moment"] * 3.0 / stiffness
    np.testing.assert_allclose(found.amplitude, expected, rtol=1e-9)


def test_gentle_is_gentle(assembly: Assembly) -> None:
    """The peak is the amplitude of which the inertia is a small share of what opens the joint."""
    linear = frictionless_response(assembly, BAND)
    moment = gentle_moment(assembly, linear, {})
    peak = frictionless_response(assembly, BAND, moment).peak_amplitude
    inertia = peak * assembly.mode.sliding_omega**2
    assert inertia == pytest.approx(GENTLE * opening_of(assembly, "sliding"), rel=1e-9)
    # of a response to any moment, the same
    assert gentle_moment(assembly, frictionless_response(assembly, BAND, 7.0), {}) == (
        pytest.approx(moment, rel=1e-9)
    )


@pytest.fixture(scope="module")
def calibrated(assembly: Assembly) -> tuple[Any, Any]:
    """The consistent model with the table of the mode-driven cycles."""
    outcome = drive_cycles(assembly, "mode", NullProgress())
    assert outcome.value.table is not None
    return two_mode_model(assembly.prepared, "consistent"), outcome.value.table


def test_gentle_is_the_smallest_amplitude_of_a_table(
    assembly: Assembly, calibrated: tuple[Any, Any]
) -> None:
    table = calibrated[1]
    linear = frictionless_response(assembly, BAND)
    moment = gentle_moment(assembly, linear, {"mode": table})
    found = frictionless_response(assembly, BAND, moment)
    assert found.peak_amplitude == pytest.approx(table.amplitude.min(), rel=1e-9)


def test_scale_is_given_or_calibrated(assembly: Assembly, calibrated: tuple[Any, Any]) -> None:
    models = {"consistent": calibrated}
    assert scale_of_file(under(assembly, rho=(2.4,), rho_scale=SCALE), models) == SCALE
    assert np.isnan(scale_of_file(under(assembly, moment=(1.0,)), models))
    found = scale_of_file(under(assembly, rho=(1.0,), greatest_damping_at=2.4), models)
    twice = scale_of_file(under(assembly, rho=(1.0,), greatest_damping_at=4.8), models)
    assert twice == pytest.approx(2 * found, rel=1e-12)
    assert found == pytest.approx(
        calibrated_scale(assembly, calibrated, np.linspace(160, 200, 2001), 2.4), rel=1e-2
    )


def test_known_scale_prefers_what_is_given(assembly: Assembly) -> None:
    class Found:
        rho_scale = 3e-3

    done = {"response": Outcome(Found())}
    given, open_ = under(assembly, rho=(1.0,), rho_scale=SCALE), under(assembly, rho=(1.0,))
    assert given_scale(given) == known_scale(given, done) == SCALE
    assert np.isnan(given_scale(open_))
    assert known_scale(open_, done) == 3e-3
    assert np.isnan(known_scale(open_, {}))
    assert np.isnan(known_scale(open_, {"response": Outcome(None)}))

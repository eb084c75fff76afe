"""The load of an analysis: rho, moments and ratios are one thing, and rho = 0 is a gentle one."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np
import pytest

from microslip.describe.amplitude import RHO_CONSTANT
from microslip.describe.amplitude import Load as LoadSection
from microslip.describe.reference import reference_joint
from microslip.pipeline.cycle import drive_cycles
from microslip.pipeline.loads import (
    GENTLE,
    frictionless_resonance,
    frictionless_response,
    gentle_moment,
    loads_of_file,
    on_port,
    opening_amplitude,
    opening_of,
)
from microslip.pipeline.prepare import Assembly, assemble
from microslip.pipeline.progress import NullProgress

BAND = np.linspace(165, 195, 601)


@pytest.fixture(scope="module")
def assembly() -> Assembly:
    """The reference joint of 21 pairs: mu = 0.25, P = 1 MN/m, L = 251.5 mm."""
    return assemble(reference_joint(pairs=21))


def under(assembly: Assembly, **load: Any) -> Assembly:
    """The same joint with another section [load]."""
    return replace(assembly, joint=assembly.joint.model_copy(update={"load": LoadSection(**load)}))


def test_the_three_keys_say_the_same(assembly: Assembly) -> None:
    """M = C mu P L / rho, by hand."""
    moment = RHO_CONSTANT * 0.25 * 251.5e3 / 2.4
    joint = assembly.joint
    assert joint.end_moment("moment", moment) == moment
    ratio = moment / 251.5e3
    assert joint.end_moment("moment_over_clamp_force_length", ratio) == pytest.approx(moment)
    assert joint.end_moment("rho", 2.4) == pytest.approx(moment)


def test_loads_of_a_file(assembly: Assembly) -> None:
    """Moments have no rho; rho = 0 takes the gentle moment."""
    by_moment = loads_of_file(under(assembly, moment=(50.0, 20.0)))
    assert [load.amplitude for load in by_moment] == [50.0, 20.0]
    assert np.isnan([load.rho for load in by_moment]).all()
    by_ratio = loads_of_file(under(assembly, moment_over_clamp_force_length=(1e-3,)))
    assert by_ratio[0].amplitude == pytest.approx(251.5)
    without, with_friction = loads_of_file(under(assembly, rho=(0.0, 5.0), rho_scale=2e-3))
    assert (without.rho, without.amplitude) == (0.0, gentle_moment(assembly, {}))
    assert with_friction.rho == 5.0
    assert with_friction.amplitude == pytest.approx(2e-3 * 0.25 * 251.5e3 / 5)
    assert loads_of_file(replace(assembly, joint=without_load(assembly))) == ()


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


def test_the_frictionless_resonance_is_that_of_one_oscillator(assembly: Assembly) -> None:
    """Closed form against the response itself, sampled where it is largest."""
    frequency, amplitude = frictionless_resonance(assembly, 3.0)
    near = np.linspace(frequency - 0.01, frequency + 0.01, 2001)
    size = np.abs(frictionless_response(assembly, near, 3.0).amplitude)
    assert near[size.argmax()] == pytest.approx(frequency, abs=2e-5)
    assert size.max() == pytest.approx(amplitude, rel=1e-9)


def test_gentle_is_gentle(assembly: Assembly) -> None:
    """The peak is the amplitude of which the inertia is a small share of what opens the joint."""
    moment = gentle_moment(assembly, {})
    inertia = frictionless_resonance(assembly, moment)[1] * assembly.mode.sliding_omega**2
    assert inertia == pytest.approx(GENTLE * opening_of(assembly, "sliding"), rel=1e-9)
    assert opening_amplitude(assembly) == pytest.approx(
        inertia / GENTLE / (assembly.mode.sliding_omega**2)
    )


def test_gentle_is_the_smallest_amplitude_of_a_table(assembly: Assembly) -> None:
    table = drive_cycles(assembly, "mode", NullProgress()).value.table
    assert table is not None
    moment = gentle_moment(assembly, {"mode": table})
    peak = frictionless_resonance(assembly, moment)[1]
    assert peak == pytest.approx(table.amplitude.min(), rel=1e-9)


def test_without_damping_the_gentle_moment_is_a_share_of_the_opening_one(
    assembly: Assembly,
) -> None:
    prepared = assembly.prepared
    model = replace(prepared.model, rayleigh=(0.0, 0.0))
    undamped = replace(assembly, prepared=replace(prepared, model=model))
    assert np.isinf(frictionless_resonance(undamped)[1])
    assert gentle_moment(undamped, {}) == GENTLE * undamped.opening_moment

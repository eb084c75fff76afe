"""The refined model of beams whose far end is free: bending shortens them, and what slides along has mass.

The stuck joint is an eigenvalue problem, the sliding one is settled by time integration: neither knows
anything of cycles with a mode prescribed.
"""

import numpy as np
import pytest

import microslip
from microslip.analyses.prepared.joint_modes import walking_modes
from microslip.analyses.reduced.refined import load_offset, refined_table
from microslip.analyses.reduced.surface import contours, load_surface
from microslip.analyses.reduced.two_mode import two_mode_model
from microslip.analyses.statics.held import hold_mode, hold_port, resting
from microslip.analyses.statics.prescribed import cycle_at, in_equilibrium, prescribed_cycle
from microslip.analyses.time.scheme import time_scheme
from microslip.analyses.time.steady import steady_state
from microslip.errors import ContactError
from microslip.model.joint import bonded_modes

SHAPES = {  # length, thickness, half of the overlap, half of the clamp, mm
    "slender": (200, 10, 30, 20),
    "stout": (160, 16, 35, 25),
    "short overlap": (250, 12, 20, 12),
}
PAIRS = 15


def cantilever(length, thickness, overlap, clamp):
    return microslip.prepare(
        microslip.parse_joint(
            {
                "beams": {
                    "length": f"{length} mm",
                    "thickness": f"{thickness} mm",
                    "overlap_half_length": f"{overlap} mm",
                },
                "material": {
                    "youngs_modulus": "70 GPa",
                    "poissons_ratio": 0.33,
                    "density": "2700 kg/m^3",
                },
                "contact": {"friction": 0.3, "pairs": PAIRS},
                "clamp": {"force": "1 MN/m", "half_length": f"{clamp} mm"},
                "support": {"left": "clamped", "right": "free"},
                "damping": {"beta": "3 us"},
                "port": [{"name": "tip", "kind": "force", "at": "right", "direction": "y"}],
                "load": {"port": "tip", "force": ["2 N/m"]},
            }
        )
    )


@pytest.fixture(scope="module", params=SHAPES)
def joint(request):
    return cantilever(*SHAPES[request.param])


def opening(joint):
    mode = joint.principal()
    return microslip.opening_load(joint, mode.port) / mode.sliding_omega**2


def resonance(held, cycle):
    return np.sqrt(held.sliding_omega**2 + (cycle.force / cycle.q).real)


def test_small_amplitude_is_the_stuck_mode(joint):
    """Held with the inertia of the stuck frequency the mode resonates there; what slides has its mass."""
    omegas, _ = bonded_modes(joint.model, joint.prestress.bonded(2))
    stuck = float(omegas[np.argmin(np.abs(omegas - joint.principal().stuck_omega))])
    held = hold_mode(joint, stuck)
    small = prescribed_cycle(held, 1e-5 * opening(joint), steps=40, cycles=2)
    mode = joint.principal()
    massless = hold_port(
        joint, mode.port, mode.sliding_omega, stuck, static=walking_modes(joint.model)
    )
    without = prescribed_cycle(massless, 1e-5 * opening(joint), steps=40, cycles=2)
    error = resonance(held, small) / stuck - 1
    assert abs(error) < 0.02 * (resonance(massless, without) / stuck - 1)
    assert abs(error) < 1e-5


def test_wide_slip_has_a_cycle_though_equilibrium_has_none(joint):
    """Where equilibrium with the inertia of a sliding body is unstable, the body's motion is sought."""
    held = hold_mode(joint, joint.principal().stuck_omega)
    wide = 0.6 * opening(joint)
    with pytest.raises(ContactError):
        prescribed_cycle(held, wide, steps=100)
    found = cycle_at(held, wide, steps=100, cycles=4)
    assert not in_equilibrium(held, found)
    assert found.q == pytest.approx(wide, rel=1e-2)
    # what friction takes is the work of the force on the mode: pi |Q|² Im(F/Q)
    work = np.pi * abs(found.q) ** 2 * (found.force / found.q).imag
    assert found.dissipated == pytest.approx(work, rel=0.02)


def test_both_ways_agree_where_both_are_found(joint):
    held = hold_mode(joint, joint.principal().stuck_omega)
    amplitude = 0.05 * opening(joint)
    still = prescribed_cycle(held, amplitude, steps=100)
    sought = prescribed_cycle(held.loose, amplitude, steps=100)
    assert resonance(held, sought) == pytest.approx(resonance(held, still), rel=1e-4)


def test_a_symmetric_joint_slides_without_inertia(small_reference):
    """The stuck mode of a lap joint does not slide its beams past each other: their mean has no inertia."""
    joint = small_reference.joint
    walking = walking_modes(joint.model)
    np.testing.assert_array_equal(resting(joint, joint.principal()), walking)


def test_the_response_is_that_of_time_integration():
    """At the resonance and its flanks, under a load that makes the joint slip: within a per cent."""
    joint = cantilever(*SHAPES["slender"])
    mode, load = joint.principal(), 5.0
    middle, top = 0.5 * (mode.sliding_omega + mode.stuck_omega), opening(joint)
    held = hold_mode(joint, middle, upper=2)
    table, failures = refined_table(held, 1e-4 * top, 0.3 * top, 24, steps=120)
    assert failures == []
    model = two_mode_model(joint, "refined", load_offset(held, 1e-5 * top))
    frequency = np.linspace(0.995 * mode.sliding_frequency, 1.005 * mode.stuck_frequency, 201)
    answers = contours(load_surface(model, table, frequency, load), load)
    peak = frequency[answers.point[np.argmax(answers.size)]]
    for f in (peak - 0.3, peak, peak + 0.3):
        (own,) = contours(load_surface(model, table, np.array([f]), load), load).amplitude
        scheme = time_scheme(joint, 1 / (150 * f), frequency=f)
        steady = steady_state(scheme, f, load, guess=own)
        assert steady.change < 3e-5
        assert abs(own) == pytest.approx(abs(steady.amplitude), rel=0.01)

"""A period as two halves and their images: against marching it whole, and Arnoldi's method on the whole."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from microslip.analyses.time.deviations import StateSpace
from microslip.analyses.time.floquet import floquet_multipliers
from microslip.analyses.time.half_period import Passage, half_period_of
from microslip.analyses.time.scheme import contact_memory, march, prestressed_state, time_scheme
from microslip.analyses.time.stability import stability_of
from microslip.analyses.time.steady import raised_state, steady_state
from microslip.contact.law import contact_law

STEPS = 150
RATIO, SHIFT = 3e-4, 4.0
"""Moment over P L, and Hz above the sliding frequency: wide slip."""


@pytest.fixture
def scheme(small_reference):
    return scheme_of(small_reference.joint, small_reference)


def scheme_of(joint, reference):
    frequency = reference.joint.mode.sliding_frequency + SHIFT
    return time_scheme(joint, 1 / (frequency * STEPS), frequency=frequency)


def loads(reference):
    return RATIO * reference.moment * np.sin(2 * np.pi * np.arange(STEPS + 1) / STEPS)


def test_two_halves_and_their_images_are_a_period(small_reference, scheme):
    """From a state that is not its own image, with deviations: two turned halves are the whole."""
    frequency, wave = 1 / (scheme.dt * STEPS), loads(small_reference)
    start = raised_state(scheme, frequency, wave[STEPS // 4], 2)
    space = StateSpace(scheme, 2 * np.pi * frequency)
    carried = space.deviations(())
    whole = march(scheme, start, wave, tangents=carried)
    half = half_period_of(scheme)
    passage = Passage(scheme, wave, contact_memory(scheme), half)
    first = passage.of(start, carried)
    second = passage.of(first.state, first.tangents)
    assert space.change(space.vector(start), space.vector(first.state)) > 1e-2
    assert space.change(space.vector(whole.state), space.vector(second.state)) < 1e-9
    assert np.array_equal(whole.state.status, second.state.status)
    assert first.dissipated + second.dissipated == pytest.approx(whole.dissipated, rel=1e-9)
    size = np.abs(space.vector(whole.tangents)).max(axis=1, keepdims=True)
    missed = np.abs(space.vector(second.tangents) - space.vector(whole.tangents)) / size
    assert missed.max() < 1e-6


def test_the_image_of_the_image_is_the_state(small_reference, scheme):
    frequency, wave = 1 / (scheme.dt * STEPS), loads(small_reference)
    state, half = raised_state(scheme, frequency, wave[STEPS // 4], 2), half_period_of(scheme)
    space = StateSpace(scheme, 2 * np.pi * frequency)
    again = half.state(half.state(state))
    assert space.change(space.vector(state), space.vector(again)) < 1e-9
    rest = prestressed_state(scheme)
    turned = half.state(rest)
    assert np.abs(turned.v - rest.v).max() < 1e-9 * np.abs(rest.v).max()
    assert np.abs(turned.eta - rest.eta).max() < 1e-9 * np.abs(rest.eta).max()


def test_multipliers_of_halves_are_those_of_the_period(small_reference, scheme):
    """Searched by halves and whole, and Arnoldi's method, which marches whole periods."""
    frequency, wave = 1 / (scheme.dt * STEPS), loads(small_reference)
    start = raised_state(scheme, frequency, wave.max(), 10)
    by_halves, whole = (
        steady_state(scheme, frequency, wave.max(), start=start, halves=halves)
        for halves in (True, False)
    )
    assert by_halves.halved
    assert not whole.halved
    assert by_halves.amplitude == pytest.approx(whole.amplitude, rel=2e-4)
    found, arnoldi = stability_of(scheme, by_halves), floquet_multipliers(scheme, by_halves)
    known = max(m.residual[m.vibration][0] for m in (found, arnoldi))
    assert found.largest == pytest.approx(arnoldi.largest, abs=2 * max(known, 1e-3))


@pytest.mark.parametrize("cycles", [1, 3, 41, 50, 80])
def test_what_does_not_settle_by_halves_is_sought_whole(small_reference, scheme, cycles):
    """Nothing changes by less than nothing: half of the cycles by halves, the rest and the last one whole."""
    frequency, load = 1 / (scheme.dt * STEPS), RATIO * small_reference.moment
    found = steady_state(scheme, frequency, load, tolerance=-1.0, max_cycles=cycles)
    assert not found.converged
    assert not found.halved
    assert cycles <= found.cycles <= cycles + 2
    assert np.isfinite(found.amplitude)


def test_a_joint_that_is_not_its_own_image_is_marched_whole(small_reference):
    """Friction that differs from side to side; matrices are as symmetric as before."""
    reference = small_reference
    friction = np.linspace(0.2, 0.3, reference.model.pairs)
    law = contact_law(reference.model.pairs, friction)
    scheme = scheme_of(replace(reference.joint, law=law), reference)
    assert half_period_of(scheme) is None
    frequency, load = 1 / (scheme.dt * STEPS), RATIO * reference.moment
    found = steady_state(scheme, frequency, load)
    assert found.converged
    assert not found.halved

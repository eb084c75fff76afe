"""Where bodies that walk are when a motion counts: where they rest, or after so many cycles from the start.

A search moves bodies by as much as hundreds of cycles do, and one that begins beside another motion by what
those of that have walked. What raising the load from rest leads to is what is meant: from there a walk is
counted, where that is on the same branch; else from rest with the velocity of the motion.
"""

from __future__ import annotations

import numpy as np

from microslip.analyses.time.offset import elsewhere
from microslip.analyses.time.readings import opening_of
from microslip.analyses.time.resting import Rested, WalksOnError, rested
from microslip.analyses.time.scheme import State, TimeScheme, march, prestressed_state
from microslip.analyses.time.starts import Start
from microslip.analyses.time.steady import RAISED, SteadyState, raised_state, steady_state
from microslip.analyses.time.walking_on import marched_on
from microslip.errors import MicroslipError
from microslip.pipeline.targets import TOLERANCE

SOUGHT = 50
"""Cycles at most of a search for what is known with another past."""

SOON = 400
"""Cycles after which a motion is at rest or left to that, where that place is not found."""


def rested_soon(scheme: TimeScheme, steady: SteadyState, begin: State | Start) -> Rested | None:
    """Where bodies come to rest, soon by marching where that is not found otherwise.

    Raises
    ------
    WalksOnError
        Where they walk, and that is not found.
    """
    try:
        there = rested(scheme, steady, TOLERANCE, begin=begin)
        if there and (said := opening_of(there.steady.cycle, scheme.joint.model.position)):
            raise WalksOnError(said)
        return there
    except WalksOnError as walks:
        if not steady.converged:
            raise
        try:
            there = marched_on(scheme, steady, TOLERANCE, begin=begin, most=SOON)
        except MicroslipError:
            raise walks from None
        size = abs(steady.amplitude)
        opens = opening_of(there.steady.cycle, scheme.joint.model.position)
        falls = elsewhere(abs(there.steady.amplitude), (size, size))
        if there.offset is None or not there.steady.converged or opens or falls:
            raise
        return there


def after_raising(
    scheme: TimeScheme, load: float, cycles: int = RAISED
) -> tuple[State, SteadyState]:
    """The state after the load was raised from rest over so many cycles, and what a search from it ends in.

    It need not have settled.
    """
    return searched_from(scheme, load, raised_state(scheme, scheme.frequency, load, cycles))


def kicked(scheme: TimeScheme, load: float, amplitude: complex) -> State:
    """The state at phase 0 of what began at rest, with the velocity of a motion, when that went through zero.

    Raises
    ------
    MicroslipError
        Where a step does not solve.
    """
    whole, omega = scheme.steps, 2 * np.pi * scheme.frequency
    steps = whole - round(float(-np.angle(amplitude)) % (2 * np.pi) / (2 * np.pi) * whole)
    wave = load * np.sin(2 * np.pi * np.arange(-steps, 1) / whole)
    return march(scheme, prestressed_state(scheme, abs(amplitude), omega), wave).state


def searched_from(scheme: TimeScheme, load: float, start: State) -> tuple[State, SteadyState]:
    """A state at phase 0, and what a search from it ends in; it need not have settled."""
    steady = steady_state(
        scheme, scheme.frequency, load, start=start, tolerance=TOLERANCE, max_cycles=SOUGHT
    )
    return start, steady


def counted_from(
    scheme: TimeScheme, start: State, steady: SteadyState, size: float
) -> Rested | None:
    """Where bodies are that walk, counted from a start; None where they do not, or on another branch.

    Parameters
    ----------
    scheme : TimeScheme
    start : State
        After the load was raised from rest, or kicked, or what else a walk begins with, at phase 0.
    steady : SteadyState
        What a search from there has ended with.
    size : float
        Of a motion of the branch, anywhere on the walk.

    Raises
    ------
    WalksOnError
        Where it leads to the same branch, and it is not found where the bodies are then, or nothing settles.
    """
    other = elsewhere(abs(steady.amplitude), (size, size))
    try:
        there = rested_soon(scheme, steady, start)
    except WalksOnError:
        if other:
            return None
        raise
    if there is None:
        if steady.converged or other:
            return None
        raise WalksOnError("no vibration settles from where the walk begins")
    return None if elsewhere(abs(there.steady.amplitude), (size, size)) else there

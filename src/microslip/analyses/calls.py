"""Every analysis in one call on a prepared joint, with defaults that suit a first look.

The modules below have the parts: schemes, problems, tables, branches, for whoever wants to hold them.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from microslip.analyses.backbone.cycles import (
    CycleControl,
    prescribed_backbone,
    quasi_static_backbone,
)
from microslip.analyses.backbone.extended_motion import harmonic_backbone
from microslip.analyses.backbone.points import METHODS, Backbone, amplitude_scale, geometric
from microslip.analyses.harmonic.adaptive import Adaptive
from microslip.analyses.harmonic.over_time import OverTime
from microslip.analyses.harmonic.problem import harmonic_problem
from microslip.analyses.harmonic.response import HarmonicResponse, frequency_response
from microslip.analyses.prepared.joint import PreparedJoint
from microslip.analyses.prepared.joint_modes import joint_modes, pick_mode
from microslip.analyses.prepared.prestress import opening_load as limit_load
from microslip.analyses.prepared.scales import load_scale
from microslip.analyses.reduced.outputs import response_motion
from microslip.analyses.reduced.refined import load_offset, refined_table
from microslip.analyses.reduced.response import Response, forced_response
from microslip.analyses.reduced.trust import error_indicator
from microslip.analyses.reduced.two_mode import two_mode_model
from microslip.analyses.statics.cycle import Cycle, quasi_static_cycle
from microslip.analyses.statics.held import hold_mode
from microslip.analyses.time.scheme import time_scheme
from microslip.analyses.time.steady import SteadyState
from microslip.analyses.time.steady import steady_state as find_steady_state
from microslip.errors import MicroslipError
from microslip.typing import Array

UP_TO = 0.85
"""Largest amplitude of tables and backbones, over the one that opens the joint."""


def opening_load(joint: PreparedJoint, port: str | None = None) -> float:
    """Largest amplitude of a port that the preload holds; infinite where it holds any.

    Parameters
    ----------
    joint : PreparedJoint
    port : str, optional
        The driven port by default.

    Examples
    --------
    The end moment that opens the reference joint is P L_o:

    >>> import microslip
    >>> joint = microslip.prepare(microslip.reference_joint(pairs=21))
    >>> round(microslip.opening_load(joint) / (1e6 * 0.0375), 9)  # P times the half overlap
    1.0
    """
    return limit_load(joint.model, joint.prestress, port or joint.drive, joint.law.friction)


def cycle(
    joint: PreparedJoint,
    amplitude: float,
    *,
    port: str | None = None,
    steps: int = 300,
    max_cycles: int = 20,
    closure: float = 1e-6,
) -> Cycle:
    """Steady quasi-static cycle under ``amplitude sin(theta)`` on a port: where it slips, what it takes.

    Parameters
    ----------
    joint : PreparedJoint
    amplitude : float
        In the unit of the port: N m per metre of width for the end moment of a lap joint.
    port : str, optional
        The driven port by default.
    steps, max_cycles, closure
        See `microslip.analyses.statics.cycle.quasi_static_cycle`.

    Raises
    ------
    JointOpensError
        Where the preload does not hold the amplitude; names the limit.
    ContactError
        Where a load step does not solve.

    Examples
    --------
    >>> import microslip
    >>> joint = microslip.prepare(microslip.reference_joint(pairs=21))
    >>> loop = microslip.cycle(joint, 200.0, steps=100)
    >>> loop.pressure.shape, bool(loop.dissipated > 0)
    ((101, 21), True)
    """
    return quasi_static_cycle(
        joint,
        port or joint.drive,
        amplitude,
        steps=steps,
        max_cycles=max_cycles,
        closure=closure,
    )


def steady_state(
    joint: PreparedJoint,
    frequency: float,
    load: float,
    *,
    port: str | None = None,
    steps: int = 150,
    guess: complex = 0.0,
    tolerance: float = 1e-5,
    max_cycles: int = 400,
) -> SteadyState:
    """Steady vibration under ``load sin(2 pi frequency t)`` by time integration with full contact.

    Parameters
    ----------
    joint : PreparedJoint
    frequency : float
        Hz.
    load : float
        Amplitude on the port.
    port : str, optional
        The driven port by default.
    steps : int
        Time steps per cycle.
    guess, tolerance, max_cycles
        See `microslip.analyses.time.steady.steady_state`; without a guess motion starts from rest.

    Raises
    ------
    ContactError
        Where a time step does not solve.

    Examples
    --------
    >>> import microslip
    >>> joint = microslip.prepare(microslip.reference_joint(pairs=21))
    >>> state = microslip.steady_state(joint, 165.0, 20.0, steps=60)
    >>> state.converged
    True
    """
    scheme = time_scheme(joint, 1 / (frequency * steps), port=port, frequency=frequency)
    return find_steady_state(
        scheme, frequency, load, guess=guess, tolerance=tolerance, max_cycles=max_cycles
    )


def harmonic_response(
    joint: PreparedJoint,
    load: float,
    frequencies: Sequence[float] | Array,
    *,
    port: str | None = None,
    harmonics: int | None = 5,
) -> HarmonicResponse:
    """Periodic responses by harmonic balance, on every branch that the ends of the band lie on.

    Where those do not reach a frequency, a cycle over time from rest, the load raised slowly, leads to the
    response there and to its branch.

    Parameters
    ----------
    joint : PreparedJoint
    load : float
        Amplitude on the port.
    frequencies : (n,) array
        Hz, two or more; the first away from the resonance.
    port : str, optional
        The driven port by default.
    harmonics : int or None
        Beside the mean; None raises their number at each point until the amplitude is right to 0.3 %,
        as measured by time integration from the response, or estimated where that does not stay.

    Raises
    ------
    ContinuationError
        Where the equations cannot be stated; what is not found is in ``failures``.

    Examples
    --------
    >>> import microslip
    >>> joint = microslip.prepare(microslip.reference_joint(pairs=21))
    >>> found = microslip.harmonic_response(joint, 20.0, [165.0, 166.0], harmonics=1)
    >>> len(found.points), found.failures
    (2, ())
    """
    problem = harmonic_problem(joint, harmonics=harmonics or 5, port=port)
    adaptive = Adaptive() if harmonics is None else None
    return frequency_response(
        problem, load, frequencies, adaptive=adaptive, over_time=OverTime(joint, load, port)
    )


def reduced_response(
    joint: PreparedJoint,
    load: float,
    frequencies: Sequence[float] | Array,
    *,
    amplitudes: int = 48,
) -> Response:
    """Forced response of the refined reduced model, with its error indicator at every point.

    The table of the modal contact force is computed first, up to 0.85 of the amplitude that opens the
    joint; most of the time goes there. Its ``outputs`` are those of all ports, by their names. It is of
    prescribed cycles; of a joint that no half turn takes into itself, as most in space, `run` of a joint file
    makes a better one, of resonances.

    Parameters
    ----------
    joint : PreparedJoint
        With a mode.
    load : float
        Amplitude on the driven port.
    frequencies : (n,) array
        Hz, ascending.
    amplitudes : int
        Of the table.

    Raises
    ------
    ContactError
        Where the table cannot be computed.

    Examples
    --------
    >>> import microslip
    >>> joint = microslip.prepare(microslip.reference_joint(pairs=21))
    >>> found = microslip.reduced_response(joint, 20.0, [165.0, 170.0], amplitudes=8)
    >>> found.amplitude.shape, bool((found.error_indicator < 0.05).all())
    ((2,), True)
    """
    mode = joint.principal()
    held = hold_mode(joint, 0.5 * (mode.sliding_omega + mode.stuck_omega), upper=2)
    largest = UP_TO * load_scale(joint, mode.port) / mode.sliding_omega**2
    smallest = 1e-5 * largest
    table, _ = refined_table(held, smallest, largest, amplitudes)
    model = two_mode_model(joint, "refined", load_offset(held, smallest))
    response = forced_response(
        model, table, np.asarray(frequencies, dtype=float), load, variant="refined"
    )
    motion = response_motion(response, model, table, joint)
    return replace(
        response,
        error_indicator=error_indicator(response, model, table),
        outputs=dict(zip(joint.model.ports, motion.T, strict=True)),
    )


def backbone(
    joint: PreparedJoint,
    mode: int = 1,
    *,
    method: str = "quasi_static",
    count: int = 30,
    smallest: float = 1e-5,
    largest: float = UP_TO,
    harmonics: int = 5,
) -> Backbone:
    """Natural frequency and damping ratio of a mode of the joint against its amplitude.

    Parameters
    ----------
    joint : PreparedJoint
    mode : int
        Number of the mode, from 1.
    method : str
        ``"quasi_static"``, ``"prescribed"`` or ``"harmonic"``.
    count : int
        Amplitudes.
    smallest, largest : float
        Over the amplitude at which the inertia of the mode opens the joint.
    harmonics : int
        Of method ``"harmonic"``.

    Raises
    ------
    ModelError
        Where the joint has no such mode.
    MicroslipError
        Where the method is not known, or the mode does not move the interface.

    Examples
    --------
    >>> import microslip
    >>> joint = microslip.prepare(microslip.reference_joint(pairs=21))
    >>> curve = microslip.backbone(joint, count=3)
    >>> bool(curve.frequency[0] > curve.frequency[-1])  # it softens
    True
    """
    if method not in METHODS:
        raise MicroslipError(f"no method {method!r}: choose one of {', '.join(METHODS)}")
    picked = pick_mode(joint_modes(joint.model, joint.prestress, joint.law), mode)
    scale = amplitude_scale(joint, picked)
    if not np.isfinite(scale):
        raise MicroslipError(f"mode {mode} does not move the interface: it has no backbone")
    sizes = geometric(smallest * scale, largest * scale, count)
    if method == "harmonic":
        found, failures = harmonic_backbone(joint, picked, sizes, harmonics=harmonics)
    else:
        by_cycles = quasi_static_backbone if method == "quasi_static" else prescribed_backbone
        found, failures = by_cycles(joint, picked, sizes, control=CycleControl())
    return replace(found, failures=tuple(failures))

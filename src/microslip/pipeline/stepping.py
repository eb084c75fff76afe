"""What the time steps do to the steady states that a response is held to.

Contact that changes its state inside a step makes errors that no formula tells; four times the steps do
(`microslip.analyses.time.step_refinement`). Some states of a response are looked at so, and between
them the larger of two errors counts.
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import NamedTuple

import numpy as np

from microslip.analyses.prepared.joint import PreparedJoint
from microslip.analyses.time.scheme import time_scheme
from microslip.analyses.time.starts import Start
from microslip.analyses.time.steady import steady_state
from microslip.errors import MicroslipError
from microslip.numerics.execute import each, threads
from microslip.pipeline.walk import STEPS, TOLERANCE
from microslip.typing import Array

ACCURACY = 1e-3
"""Relative error of the amplitude that `STEPS` are taken to make where that is not known."""

FINER, PATIENCE = 4, 20
"""So many times the steps for a look, and cycles at most."""

LOOKS = 7
"""States of a response that are looked at."""


class Stepped(NamedTuple):
    """A steady state with `STEPS` steps per cycle.

    Attributes
    ----------
    frequency : float
        Hz.
    amplitude : complex
    state : Start
    """

    frequency: float
    amplitude: complex
    state: Start


def step_error(joint: PreparedJoint, load: float, one: Stepped) -> float:
    """Relative error of an amplitude that its steps make, at most; nan where more steps do not settle.

    The change with k times as many, times ``k / (k - 1)``: all of the error where it falls no faster than
    with the number of steps.
    """
    scheme = time_scheme(joint, 1 / (one.frequency * FINER * STEPS), frequency=one.frequency)
    try:
        found = steady_state(
            scheme,
            one.frequency,
            load,
            start=one.state,
            tolerance=TOLERANCE,
            max_cycles=PATIENCE,
        )
    except MicroslipError:
        return float("nan")
    if not found.converged:
        return float("nan")
    change = abs(abs(found.amplitude) / max(abs(one.amplitude), 1e-300) - 1)
    return float(change * FINER / (FINER - 1))


def step_errors(
    joint: PreparedJoint, load: float, states: Mapping[int, Stepped], count: int
) -> Array:
    """The same at every frequency of a response: the larger of those to either side that were looked at.

    Parameters
    ----------
    joint : PreparedJoint
    load : float
    states : mapping of int to Stepped
        Settled, by index of their frequency.
    count : int
        Frequencies of the response.

    Returns
    -------
    (count,) array
        `ACCURACY` where nothing is known.
    """
    chosen = _chosen(states)
    errors = np.array(list(each(lambda k: step_error(joint, load, states[k]), chosen, threads())))
    known = np.array(chosen)[np.isfinite(errors)] if len(chosen) else np.zeros(0)
    if not len(known):
        return np.full(count, ACCURACY)
    errors = errors[np.isfinite(errors)]
    right = np.searchsorted(known, np.arange(count))
    left = np.searchsorted(known, np.arange(count), side="right") - 1
    last = len(known) - 1
    return np.asarray(np.maximum(errors[np.clip(left, 0, last)], errors[np.clip(right, 0, last)]))


def _chosen(states: Mapping[int, Stepped]) -> list[int]:
    """The largest, and others evenly among them."""
    marks = sorted(states)
    if len(marks) <= LOOKS:
        return marks
    largest = max(marks, key=lambda k: abs(states[k].amplitude))
    even = np.linspace(0, len(marks) - 1, LOOKS - 1).round().astype(int)
    return sorted({largest, *(marks[i] for i in even)})

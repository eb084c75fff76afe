"""Steps refined where the slip of a pair turns, for joints with a handful of contacts.

Friction of a body directly on a slider jumps where its slip turns. A step sees the displacement
at its end only: as long as that has grown, friction keeps its sign to the end of the step,
although the body has turned already, so that the error is of first order in the step. Here each
step in which a pair begins or ends to stick, or in which its rate of slip changes sign, is
marched again in parts; the others stay as they are. Where friction acts behind the residual
flexibility of a body it is continuous, the error is of second order, and none of this is needed;
and where many pairs change state in every step it would refine them all.
"""

from __future__ import annotations

import time as clock
from dataclasses import dataclass

import numpy as np

from microslip.analyses.prepared.joint import PreparedJoint
from microslip.analyses.time.scheme import (
    March,
    State,
    TimeScheme,
    march,
    prestressed_state,
    time_scheme,
)
from microslip.brief import Brief
from microslip.contact.pairs import STICK, by_pair
from microslip.errors import MicroslipError
from microslip.typing import Array

CHUNK = 64
"""Steps marched before looking back for a turn."""

REPEATED = 10
"""Cycles in a row that must repeat."""


@dataclass(frozen=True, repr=False)
class TurningCycle(Brief):
    """Steady cycle under ``A sin(omega t)``, its turns refined.

    Attributes
    ----------
    frequency, load : float
        Hz, and amplitude of the driven port.
    time : (n,) array
        s, not evenly spaced.
    output : (n, p) array
        Outputs of all ports, change from prestress.
    state : State
        At the end.
    change : float
        Largest change of an extreme of an output over the last cycles, over its range.
    cycles : int
    converged : bool
    seconds : float
    """

    frequency: float
    load: float
    time: Array
    output: Array
    state: State
    change: float
    cycles: int
    converged: bool
    seconds: float

    @property
    def steps(self) -> int:
        """Steps marched in the cycle, those of the turns among them."""
        return len(self.time) - 1


def first_turn(part: March, before: Array) -> int | None:
    """Step in which first a pair begins or ends to stick, or its rate of slip turns by a right angle or more.

    Parameters
    ----------
    part : March
        Histories kept.
    before : (m, d - 1) array
        Slip one step before the first sample.
    """
    state = part.status
    x = by_pair(part.v, part.v.shape[1] // state.shape[1])[..., 1:]
    earlier = np.concatenate([before[None], x[:-2]]) if len(x) > 1 else x[:0]
    rate = 3 * x[1:] - 4 * x[:-1] + earlier
    turned = (np.sum(rate * np.diff(x, axis=0), axis=-1) < 0) & (state[1:] != STICK)
    found = np.flatnonzero(((state[1:] != state[:-1]) | turned).any(axis=1))
    return int(found[0]) if len(found) else None


def turning_cycle(
    joint: PreparedJoint,
    frequency: float,
    load: float,
    *,
    steps: int = 500,
    parts: int = 64,
    port: str | None = None,
    tolerance: float = 1e-4,
    max_cycles: int = 400,
) -> TurningCycle:
    """March to the steady cycle with refined turns.

    Parameters
    ----------
    joint : PreparedJoint
    frequency, load : float
        Hz, amplitude of the driven port.
    steps, parts : int
        Steps per cycle, and parts of a step in which a pair turns.
    port : str, optional
        Driven port; the joint's own by default.
    tolerance : float
        Change of the outputs' extremes from cycle to cycle, over their range, that `REPEATED`
        cycles in a row must keep below. Turns are placed to a part of a step, which leaves some
        1e-5.
    max_cycles : int

    Raises
    ------
    MicroslipError
        Where more than half of the steps hold a turn: this joint needs shorter steps, not this.
    """
    began = clock.perf_counter()
    coarse = time_scheme(joint, 1 / (frequency * steps), port=port, frequency=frequency)
    fine = time_scheme(joint, 1 / (frequency * steps * parts), port=port, frequency=frequency)
    if len(fine.joint.model.omega) != len(coarse.joint.model.omega):
        fine = time_scheme(coarse.joint, fine.dt, port=port, frequency=frequency)
    state = prestressed_state(coarse)
    before = _slip(state.v, coarse)
    extremes: list[Array] = []
    change = np.inf
    for _ in range(max_cycles):
        state, before, time, output = _cycle(coarse, fine, state, before, load, steps, parts)
        now = np.array([output.max(axis=0), output.min(axis=0)])
        size = np.maximum(np.ptp(now, axis=0), 1e-300)
        extremes.append(now)
        if len(extremes) > REPEATED:
            recent = np.array(extremes[-REPEATED - 1 :])
            change = float((np.abs(np.diff(recent, axis=0)) / size).max())
        if change <= tolerance:
            break
    return TurningCycle(
        frequency=frequency,
        load=load,
        time=time,
        output=output,
        state=state,
        change=change,
        cycles=len(extremes),
        converged=change <= tolerance,
        seconds=clock.perf_counter() - began,
    )


def _cycle(
    coarse: TimeScheme,
    fine: TimeScheme,
    state: State,
    before: Array,
    load: float,
    steps: int,
    parts: int,
) -> tuple[State, Array, Array, Array]:
    """One cycle from phase 0: state, slip one step before its end, times and outputs."""
    times: list[Array] = [np.zeros(1)]
    outputs: list[Array] = []
    k, turns = 0, 0
    while k < steps:
        count = min(CHUNK, steps - k)
        wave = load * np.sin(2 * np.pi * np.arange(k, k + count + 1) / steps)
        part = march(coarse, state, wave, keep=True)
        if not outputs:
            outputs.append(part.output[:1])
        turn = first_turn(part, before)
        if turn is not None and turn > 0:
            part = march(coarse, state, wave[: turn + 1], keep=True)
        if turn != 0:
            state, before = part.state, _slip(part.v[-2], coarse)
            times.append(np.asarray((k + np.arange(1, len(part.load))) * coarse.dt, dtype=float))
            outputs.append(part.output[1:])
            k += len(part.load) - 1
        if turn is not None:
            wave = load * np.sin(2 * np.pi * (k + np.arange(parts + 1) / parts) / steps)
            before = _slip(state.v, coarse)
            part = march(fine, state, wave)
            state = part.state
            times.append(np.asarray(k * coarse.dt + np.arange(1, parts + 1) * fine.dt, dtype=float))
            outputs.append(part.output[1:])
            k, turns = k + 1, turns + 1
            if turns > steps // 2:
                raise MicroslipError(
                    f"a pair turns in more than half of the {steps} steps of a cycle: shorter steps serve "
                    "this joint better than refined turns"
                )
    return state, before, np.concatenate(times), np.concatenate(outputs)


def _slip(v: Array, scheme: TimeScheme) -> Array:
    """Tangential displacements, (m, d - 1), of one instant."""
    return by_pair(v, scheme.joint.model.dimension)[:, 1:]

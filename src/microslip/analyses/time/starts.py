"""Starts of a search: the end of one steady state taken to another frequency, load or number of steps.

A scheme steps each mode by a length h of its own, and the rates of a motion that varies with Omega are,
for it, ``(2/h) tan(Omega dt/2) eta`` where those of the motion are ``Omega eta`` (`poles.py`). A
`Start` holds the latter.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from microslip.analyses.time.coupled import accelerations
from microslip.analyses.time.scheme import State, TimeScheme
from microslip.brief import Brief
from microslip.typing import Array, Status


@dataclass(frozen=True, repr=False)
class Start(Brief):
    """A motion at one phase of the load, of no particular scheme.

    Attributes
    ----------
    phase : float
        Of the load ``A sin(theta)``, rad.
    eta, rate : (k,) arrays
        Modal coordinates and their true rates.
    residual_rate : (d m,) array
        Mean rate of the residual part of the relative displacements over the last step.
    r, v : (d m,) arrays
        Reactions and relative displacements.
    taken : (1,) array
        Energy that contact has taken and not given back, J per metre of width.
    status : (m,) int8 array
    """

    phase: float
    eta: Array
    rate: Array
    residual_rate: Array
    r: Array
    v: Array
    taken: Array
    status: Status


def end_of(state: State, phase: float, scheme: TimeScheme, frequency: float) -> Start:
    """The start that a state of a scheme is, under a load of so many Hz."""
    rate = state.rate / _seen(scheme, frequency)
    residual = (state.residual_v - state.residual_before) / scheme.dt
    return Start(phase, state.eta, rate, residual, state.r, state.v, state.taken, state.status)


def true_rates(state: State, scheme: TimeScheme, frequency: float) -> Array:
    """Rates of the modes of a motion of so many Hz, in a state of a scheme."""
    return np.asarray(state.rate / _seen(scheme, frequency))


def placed(start: Start, scheme: TimeScheme, frequency: float, load: float) -> State:
    """The state of a scheme at a start; modes that the start has not followed are static there."""
    kernel, model = scheme.kernel, scheme.joint.model
    k = len(model.omega)
    known = min(k, len(start.eta))
    force = kernel.constant_modes + kernel.drive_modes * (load * np.sin(start.phase))
    force = force - kernel.mode_gain * (model.mode_v.T @ start.r)
    eta, rate = np.zeros(k), np.zeros(k)
    eta[:known], rate[:known] = start.eta[:known], start.rate[:known]
    eta[known:] = force[known:] / model.omega[known:] ** 2
    rate *= _seen(scheme, frequency)
    residual = start.v - model.mode_v @ eta
    return State(
        eta=eta,
        rate=rate,
        acceleration=accelerations(kernel, force - model.omega**2 * eta, rate),
        residual_v=residual,
        residual_before=residual - scheme.dt * start.residual_rate,
        r=start.r.copy(),
        v=start.v.copy(),
        taken=start.taken.copy(),
        status=start.status.copy(),
    )


def _seen(scheme: TimeScheme, frequency: float) -> Array:
    """Rates of the scheme over those of a motion of this frequency."""
    turn = np.pi * frequency * scheme.dt
    return np.asarray(scheme.dt / scheme.kernel.mode_step * np.tan(turn) / turn)


def mixed(mixture: Sequence[tuple[Start, float]]) -> Start:
    """Mixture of starts of one phase, in the modes that all follow; contact is that of the largest share."""
    main = max(mixture, key=lambda one: one[1])[0]
    count = min(len(start.eta) for start, _ in mixture)

    def sum_of(name: str, length: int | None = None) -> Array:
        return np.asarray(sum(share * getattr(start, name)[:length] for start, share in mixture))

    return replace(
        main,
        eta=sum_of("eta", count),
        rate=sum_of("rate", count),
        r=sum_of("r"),
        v=sum_of("v"),
    )

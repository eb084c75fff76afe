"""A motion marched cycle by cycle: the first harmonic of each."""

from __future__ import annotations

import numpy as np

from microslip.analyses.time.scheme import (
    ContactMemory,
    State,
    TimeScheme,
    contact_memory,
    march,
)
from microslip.numerics.fourier import harmonic
from microslip.typing import Array, Complex

SLOWEST = 0.95
"""Factor by which a drift is taken to fall from a third of them to the next, at most."""


LEAK, TURNS = 0.03, 2.5
"""Share of a beat by which its weighted mean over `TURNS` of it or more is off, at most: the Fourier
transform of the weights there."""


def watched(
    scheme: TimeScheme,
    load: float,
    state: State,
    cycles: int,
    phase: float = 0.0,
    memory: ContactMemory | None = None,
) -> tuple[Complex, list[State]]:
    """First harmonic of every cycle of a motion from a state at a phase of the load, and its ends."""
    theta = phase + 2 * np.pi * np.arange(scheme.steps + 1) / scheme.steps
    wave, memory = load * np.sin(theta), memory or contact_memory(scheme)
    port = scheme.joint.model.port(scheme.joint.coordinate)
    Q, ends = [], [state]
    for _ in range(cycles):
        cycle = march(scheme, ends[-1], wave, memory=memory)
        Q.append(harmonic(cycle.output[:, port], theta))
        ends.append(cycle.state)
    return np.array(Q), ends[1:]


def mean_of(size: Array) -> float:
    """Mean of what goes on to vary, from one end of it to the other.

    Weighted as ``exp(-1/(t (1 - t)))``, t from 0 to 1: of what is quasi-periodic that comes nearer with the
    number of cycles faster than any power of it, the plain mean as the first. For `TURNS` of it at least.

    References
    ----------
    S. Das, Y. Saiki, E. Sander & J. A. Yorke, Nonlinearity 30 (2017) 4111.

    Examples
    --------
    >>> n = np.arange(200)
    >>> size = 1 + 0.1 * np.cos(0.17 * n) + 0.1 * np.cos(0.7 * n + 1)
    >>> bool(abs(mean_of(size) - 1) < 1e-4), bool(abs(size.mean() - 1) > 2e-3)
    (True, True)
    >>> turn = 2 * np.pi * TURNS / 200
    >>> beats = [1 + np.cos(f * turn * n) for f in np.linspace(1, 9, 99)]
    >>> max(abs(mean_of(size) - 1) for size in beats) < LEAK
    True
    """
    t = (np.arange(len(size)) + 1) / (len(size) + 1)
    return float(np.average(size, weights=np.exp(-1 / (t * (1 - t)))))


def known_mean(size: Array) -> tuple[float, float]:
    """Mean of the last two thirds, and what it is not known by but for `LEAK`, relative.

    That of all lags behind it by half as much as it does behind the end, where it drifts evenly.

    Examples
    --------
    >>> mean, off = known_mean(1 + 1e-3 * np.arange(301))
    >>> round(mean, 3), round(mean * (1 + off), 3)
    (1.2, 1.3)
    """
    mean = mean_of(size[len(size) // 3 :])
    return mean, 2 * abs(mean_of(size) / mean - 1)


def goes_on_by(off: float, cycles: int, until: float) -> float:
    """What a mean that `known_mean` says is off by so much will be off by, if it drifts evenly until then.

    It lies at two thirds of the cycles, and drifts by that in a third of them.

    Examples
    --------
    >>> mean, off = known_mean(1 + 1e-3 * np.arange(301))
    >>> round(mean * (1 + goes_on_by(off, 300, 4000.0)), 3)
    5.2
    """
    return off * 3 * until / cycles


def to_come(size: Array) -> float:
    """By how much a size will still change: a geometric progression of what it did from third to third.

    Of a size that does not change ever less, as much as `SLOWEST` makes of it.
    """
    first, second, third = (float(part.mean()) for part in np.array_split(size, 3))
    before, last = abs(second - first), abs(third - second)
    factor = np.clip(last / max(before, 1e-300), 0.0, SLOWEST)
    return float(last * factor / (1 - factor))

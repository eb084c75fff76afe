"""What a motion under a harmonic load is, where the search for a periodic one ends without an answer.

The motion is looked at once per cycle of the load, at the same phase (Poincaré's section; Nayfeh
and Balachandran, Applied Nonlinear Dynamics, 1995, ch. 5 and 7). With z_k the state of the
vibration there (`vibration_weight`), and all distances over the size of the vibration:

| kind | evidence |
|---|---|
| periodic | ``|z_{k+1} - z_k|`` below the tolerance |
| slowly attracting | it falls by the same factor from cycle to cycle: the multiplier |
| period n | ``|z_{k+n} - z_k|`` below the tolerance, n the smallest |
| quasi-periodic | neighbours do not separate, a few lines hold the spectrum of the section |
| chaotic | neighbours separate: the largest Lyapunov exponent per cycle, from two motions side by side |
| irregular | neighbours neither separate nor close in, and no few lines hold the spectrum |

`size` is how far the section spreads over the vibration: an irregular motion may be irregular in
its fifth digit only. Beside its kind a motion may *walk*: bodies move past each other by the same
amount in every cycle; and it may *open*: at some instant no pair touches.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from microslip.analyses.time.scheme import (
    State,
    TimeScheme,
    contact_memory,
    march,
    prestressed_state,
)
from microslip.analyses.time.starts import Start, end_of
from microslip.analyses.time.steady import SteadyState, vibration_weight, walk_of
from microslip.brief import Brief
from microslip.contact.pairs import touches
from microslip.typing import Array

LONGEST = 8
"""Longest period looked for, cycles of the load."""

LOOKED = 240
"""Cycles that are marched to look at a motion."""

SEPARATED_BY = 1e-7
"""Distance of two neighbouring motions over the size of the vibration."""

CLOSING = 0.01
"""Lyapunov exponent per cycle beyond which neighbours close in on each other, or separate."""

LINES = 0.9
"""Share of the section's variance that the four largest lines of a quasi-periodic motion hold at least."""


@dataclass(frozen=True, repr=False)
class Motion(Brief):
    """A motion under a harmonic load.

    Attributes
    ----------
    kind : str
        ``periodic``, ``slowly attracting``, ``period n``, ``quasi-periodic``, ``chaotic`` or
        ``irregular``.
    change : float
        Last change from cycle to cycle over the size of the vibration.
    size : float
        Spread of the section over the size of the vibration; 0 of a periodic motion.
    period : int
        Cycles of the load after which it repeats; 0 where it does not.
    multiplier : float
        Factor by which the change falls per cycle; nan where not measured.
    exponent : float
        Largest Lyapunov exponent per cycle; nan where not measured.
    lines : float
        Share of the section's variance in the four largest lines of its spectrum; nan where not
        measured.
    walk : float
        Drift of the bodies past each other in a cycle, over the range of the slip.
    open_share : float
        Share of the cycle in which no pair touches.
    end : Start or None
        Where it was after the last cycle that was looked at; None where none was.
    """

    kind: str
    change: float
    size: float
    period: int
    multiplier: float
    exponent: float
    lines: float
    walk: float
    open_share: float
    end: Start | None = None

    @property
    def said(self) -> str:
        """Kind and evidence, in words."""
        evidence = {
            "periodic": f"changes by {self.change:.0e} per cycle",
            "slowly attracting": f"multiplier {self.multiplier:.4f}, last change {self.change:.0e}",
            "period n": f"n = {self.period}",
            "quasi-periodic": f"exponent {self.exponent:+.3f} per cycle, {100 * self.lines:.0f} % of the "
            f"section in four lines, spread {self.size:.0e}",
            "chaotic": f"exponent {self.exponent:+.3f} per cycle, spread {self.size:.0e}",
            "irregular": f"exponent {self.exponent:+.3f} per cycle, spread {self.size:.0e}",
        }[self.kind]
        opens = f"; no pair touches in {100 * self.open_share:.0f} % of the cycle"
        walks = f"; walks by {self.walk:+.1e} of the slip per cycle"
        return (
            f"{self.kind}, {evidence}"
            + (walks if abs(self.walk) > 1e-4 else "")
            + (opens if self.open_share else "")
        )


def motion_of(
    scheme: TimeScheme, steady: SteadyState, *, cycles: int = LOOKED, tolerance: float = 3e-5
) -> Motion:
    """Say what the motion is that a search for a steady state ended in.

    Parameters
    ----------
    scheme : TimeScheme
        The one that `steady` was sought with.
    steady : SteadyState
        Of a search that converged or did not.
    cycles : int
        Marched to look at it, where it did not converge.
    tolerance : float
        Change over the size of the vibration at which it repeats.
    """
    walk, open_share = walk_of(steady, scheme.joint.model.dimension), _open_share(steady)
    nothing = float("nan")
    if steady.converged:
        return Motion(
            "periodic", steady.change, 0.0, 1, nothing, nothing, nothing, walk, open_share
        )
    section, state = _section(scheme, steady, cycles)
    size = float(np.linalg.norm(section[-1] - _coordinates(scheme, prestressed_state(scheme))))
    step = np.linalg.norm(np.diff(section, axis=0), axis=1) / size
    late = section[cycles // 2 :]
    spread = float(np.linalg.norm(late - late.mean(axis=0), axis=1).max() / size)
    change = float(step[-1])

    def motion(kind: str, period: int = 0, **found: float) -> Motion:
        values = {"multiplier": nothing, "exponent": nothing, "lines": nothing, **found}
        end = end_of(state, steady.phase, scheme, steady.frequency)
        return Motion(
            kind, change, spread, period, walk=walk, open_share=open_share, end=end, **values
        )

    if step[-LONGEST:].max() <= tolerance:
        return motion("periodic", 1)
    for n in range(2, LONGEST + 1):
        if np.linalg.norm(late[n:] - late[:-n], axis=1)[-LONGEST:].max() / size <= tolerance:
            return motion("period n", n)
    rate, steadily = _decay(step)
    if steadily and rate < 1:
        return motion("slowly attracting", multiplier=rate)
    exponent, lines = _exponent(scheme, steady, state, size, cycles // 4), _share_of_lines(late)
    if exponent < -CLOSING:
        return motion("slowly attracting", multiplier=float(np.exp(exponent)), exponent=exponent)
    bounded = "quasi-periodic" if lines >= LINES else "irregular"
    kind = bounded if exponent < CLOSING else "chaotic"
    return motion(kind, exponent=exponent, lines=lines)


def _coordinates(scheme: TimeScheme, z: State) -> Array:
    """Position and rate of the vibration, weighted so that squares sum to energy."""
    return np.concatenate([vibration_weight(scheme) * z.eta, z.rate])


def _section(scheme: TimeScheme, steady: SteadyState, cycles: int) -> tuple[Array, State]:
    """States once per cycle, and the last."""
    memory, state = contact_memory(scheme), steady.cycle.state
    points = [_coordinates(scheme, state)]
    for _ in range(cycles):
        state = march(scheme, state, steady.cycle.load, memory=memory).state
        points.append(_coordinates(scheme, state))
    return np.array(points), state


def _decay(step: Array) -> tuple[float, bool]:
    """Factor per cycle by which steps fall, and whether they fall by more than twice their scatter.

    A straight line through their logarithms.
    """
    k, logs = np.arange(len(step)), np.log(np.maximum(step, 1e-300))
    slope, start = np.polyfit(k, logs, 1)
    scatter = float(np.std(logs - start - slope * k))
    return float(np.exp(slope)), bool(-slope * len(step) > 2 * scatter)


def _exponent(
    scheme: TimeScheme, steady: SteadyState, state: State, size: float, cycles: int
) -> float:
    """Largest Lyapunov exponent per cycle: mean logarithm of how two neighbours separate.

    The neighbour is brought back to `SEPARATED_BY` after every cycle (Benettin's method).
    """
    wave, memories = steady.cycle.load, (contact_memory(scheme), contact_memory(scheme))
    push = np.random.default_rng(0).standard_normal(len(state.rate))
    push *= SEPARATED_BY * size / np.linalg.norm(push)
    other = replace(state, rate=state.rate + push)
    logs = []
    for _ in range(cycles):
        state = march(scheme, state, wave, memory=memories[0]).state
        other = march(scheme, other, wave, memory=memories[1]).state
        apart = (
            float(np.linalg.norm(_coordinates(scheme, other) - _coordinates(scheme, state))) / size
        )
        share = SEPARATED_BY / max(apart, 1e-300)
        logs.append(-np.log(share))
        other = replace(
            state,
            eta=state.eta + share * (other.eta - state.eta),
            rate=state.rate + share * (other.rate - state.rate),
            acceleration=state.acceleration + share * (other.acceleration - state.acceleration),
            residual_v=state.residual_v + share * (other.residual_v - state.residual_v),
            residual_before=state.residual_before
            + share * (other.residual_before - state.residual_before),
            r=state.r + share * (other.r - state.r),
            v=state.v + share * (other.v - state.v),
        )
    return float(np.mean(logs[len(logs) // 4 :]))


def _share_of_lines(section: Array) -> float:
    """Share of the variance of a section in the four largest lines of its spectrum, neighbours with them."""
    window = np.hanning(len(section))[:, None]
    power = (np.abs(np.fft.rfft(window * (section - section.mean(axis=0)), axis=0)) ** 2).sum(
        axis=1
    )
    total, held = power.sum(), 0.0
    for _ in range(4):
        k = int(np.argmax(power))
        near = slice(max(k - 1, 0), k + 2)
        held += power[near].sum()
        power[near] = 0.0
    return float(held / total) if total > 0 else 0.0


def _open_share(steady: SteadyState) -> float:
    return float((~touches(steady.cycle.status[1:]).any(axis=1)).mean())

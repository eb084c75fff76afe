"""Steady state under harmonic load: marching, or Anderson acceleration of the period map.

The period map takes the state at one passage of the load's phase to the next. Its fixed point is
the steady state. Marching converges at the rate of the slowest transient (hundreds of cycles for a
lightly damped joint); the accelerated search combines the last few states so that their combined
change is least (Anderson; Walker & Ni, SIAM J. Numer. Anal. 49 (2011) 1715), in the energy norm of
the modes, which removes the few slow transients in about as many cycles as there are of them.
"""

from __future__ import annotations

import time as clock
from dataclasses import dataclass, replace

import numpy as np

from microslip.analyses.prepared.joint_modes import walking_modes
from microslip.analyses.time.scheme import (
    LINEAR_FIELDS,
    March,
    State,
    TimeScheme,
    contact_memory,
    march,
    prestressed_state,
)
from microslip.brief import Brief
from microslip.contact.pairs import tangential
from microslip.errors import ContactError
from microslip.numerics.fourier import harmonic
from microslip.numerics.ritz import ritz_values
from microslip.typing import Array, Complex

DEPTH = 10
"""States that the accelerated search combines."""

SECANTS = 12
"""States and images that the estimate of the multipliers is made from."""

STALLED, MARCHED = 40, 20
"""Cycles without a smaller change after which the search begins afresh, and cycles marched before."""

SHOWN = 0.05
"""Estimates of multipliers that the later secants alone move by more are dropped."""

CONFIRMED = 3.0
"""The cycle after the search may change by this many times the tolerance."""


@dataclass(frozen=True, repr=False)
class SteadyState(Brief):
    """Steady (or last) cycle under ``A sin(omega t)``.

    Attributes
    ----------
    frequency, load : float
        Hz, and amplitude of the driven port.
    cycle : March
        The last cycle, histories kept; its output starts at phase `phase`.
    phase : float
        Phase of the load at the start of the cycle, rad.
    amplitude : complex
        First harmonic of the modal coordinate (`PreparedJoint.coordinate`) against the load's sine.
    change : float
        Relative change of the state over the last cycle, energy norm.
    energy_change : float
        Relative change of the dissipated energy between the last two cycles.
    cycles : int
    converged : bool
    seconds : float
    history : (cycles,) array
        `change` of every cycle.
    unsolved : int
        Cycles that had to be repeated with the plain iteration.
    multipliers : (k,) complex array
        Floquet multipliers as far as the search has met them, largest modulus first; those of the
        bodies sliding sideways as rigid ones are not among them. Estimates:
        `microslip.analyses.time.floquet.floquet_multipliers` refines them.
    """

    frequency: float
    load: float
    cycle: March
    phase: float
    amplitude: complex
    change: float
    energy_change: float
    cycles: int
    converged: bool
    seconds: float
    history: Array
    unsolved: int
    multipliers: Complex


def steady_state(
    scheme: TimeScheme,
    frequency: float,
    load: float,
    *,
    guess: complex = 0.0,
    accelerate: bool = True,
    tolerance: float = 1e-5,
    max_cycles: int = 400,
    start: State | None = None,
) -> SteadyState:
    """Find the steady state at one frequency.

    Parameters
    ----------
    scheme : TimeScheme
        Its step must divide the period: ``1 / (frequency dt)`` steps per cycle.
    frequency : float
        Hz.
    load : float
        Amplitude of the driven port.
    guess : complex
        First harmonic of the modal coordinate, e.g. of the reduced model.
    accelerate : bool
        Anderson acceleration; False marches.
    tolerance : float
        Relative change of the state over a cycle at which it is steady. A joint that slips widely
        walks: both halves of a cycle push the beams past each other, against soft springs only.
        This walk is left out of the measure, so that it neither hides a steady vibration nor is
        extrapolated.
    max_cycles : int
    start : State, optional
        A state at phase 0 to start from instead of the guess.
    """
    steps = round(1 / (frequency * scheme.dt))
    omega = 2 * np.pi * frequency
    phase = 0.0 if start is not None or guess == 0 else float(-np.angle(guess))
    state = start if start is not None else prestressed_state(scheme, abs(guess), omega)
    theta = phase + 2 * np.pi * np.arange(steps + 1) / steps
    wave = load * np.sin(theta)
    began = clock.perf_counter()
    contact = contact_memory(scheme)
    memory = _Memory(scheme, DEPTH if accelerate else 0)
    history: list[float] = []
    dissipated = [0.0, np.inf]
    unsolved = 0
    stall = _Stall(accelerate)
    for _ in range(max_cycles):
        try:
            cycle = march(scheme, state, wave, memory=contact)
        except ContactError:
            if memory.plain is None:
                raise
            unsolved += 1
            state = memory.restart()
            continue
        change = memory.distance(state, cycle.state)
        history.append(change)
        memory.keep(state, cycle.state)
        dissipated = [dissipated[1], cycle.dissipated]
        if change <= tolerance:
            after = march(scheme, cycle.state, wave, keep=True, memory=contact)
            history.append(memory.distance(cycle.state, after.state))
            if history[-1] <= CONFIRMED * tolerance:
                break
        state = stall.next(memory, state, cycle.state, change)
    else:
        after = march(scheme, cycle.state, wave, keep=True, memory=contact)
        history.append(memory.distance(cycle.state, after.state))
    cycle, change = after, history[-1]
    reference = max(abs(cycle.dissipated), 1e-300)
    Q = harmonic(cycle.output[:, scheme.joint.model.port(scheme.joint.coordinate)], theta)
    return SteadyState(
        frequency=frequency,
        load=load,
        cycle=cycle,
        phase=phase,
        amplitude=complex(Q),
        change=change,
        energy_change=abs(cycle.dissipated - dissipated[1]) / reference,
        cycles=len(history) + unsolved,
        converged=change <= CONFIRMED * tolerance,
        seconds=clock.perf_counter() - began,
        history=np.array(history),
        unsolved=unsolved,
        multipliers=memory.multipliers(),
    )


def vibration_weight(scheme: TimeScheme) -> Array:
    """Weight of the position of each mode in the size of a vibration, 1/s.

    Its circular frequency, at least 1 rad/s; nothing for modes that slide the bodies past each
    other rigidly.
    """
    model = scheme.joint.model
    return np.where(walking_modes(model), 0.0, np.maximum(model.omega, 1.0))


def walk_of(scheme: TimeScheme, steady: SteadyState) -> float:
    """Drift of the bodies past each other over the last cycle, over the range of the slip.

    Median over the pairs of the change of slip from start to end of the cycle, over the largest
    range of a slip.
    """
    slip = tangential(steady.cycle.v)
    span = float(np.ptp(slip, axis=0).max())
    return float(np.median(slip[-1] - slip[0])) / span if span > 0 else 0.0


def raised_state(scheme: TimeScheme, frequency: float, load: float, cycles: int) -> State:
    """State after the load was raised slowly from rest, at phase 0 of the load.

    The amplitude grows as ``(1 - cos(pi t / t_1))/2`` over so many cycles. Pairs that stick all
    the time keep the tractions that the past has left in them; this is the past that is meant
    where none is given.
    """
    steps = round(1 / (frequency * scheme.dt))
    turn = np.arange(cycles * steps + 1) / steps
    wave = load * 0.5 * (1 - np.cos(np.pi * turn / cycles)) * np.sin(2 * np.pi * turn)
    return march(scheme, prestressed_state(scheme), wave).state


def _values(secants: list[tuple[Array, Array]]) -> Complex:
    return ritz_values([x for x, _ in secants], [y for _, y in secants])


class _Stall:
    """Lets a search that no longer comes closer march for a while, and begin afresh.

    Where pairs switch close to the fixed point the map has no derivative there, and states from afar
    mislead the combination.
    """

    def __init__(self, accelerate: bool) -> None:
        self.accelerate = accelerate
        self.best, self.waited, self.marching = np.inf, 0, 0

    def next(self, memory: _Memory, before: State, after: State, change: float) -> State:
        if change < 0.7 * self.best:
            self.best, self.waited = change, 0
        self.waited += 1
        if self.accelerate and self.waited > STALLED:
            self.best, self.waited, self.marching = np.inf, 0, MARCHED
        if self.marching:
            self.marching -= 1
            memory.plain = after
            memory.restart()
            memory.plain = after
            return after
        return memory.next(before, after)


class _Memory:
    """Last states and their changes, and the combination of least change.

    Changes are measured in the energy of the modes, without the position of modes that slide the
    bodies past each other rigidly.
    """

    def __init__(self, scheme: TimeScheme, depth: int) -> None:
        self.weight = vibration_weight(scheme)
        self.vibration = np.tile(self.weight > 0, 2)
        self.rest = prestressed_state(scheme)
        self.depth = depth
        self.images: list[State] = []
        self.changes: list[Array] = []
        self.plain: State | None = None
        self.secants: list[tuple[Array, Array]] = []

    def _energy_coordinates(self, state: State) -> Array:
        return np.concatenate([self.weight * (state.eta - self.rest.eta), state.rate])

    def distance(self, before: State, after: State) -> float:
        a, b = self._energy_coordinates(before), self._energy_coordinates(after)
        return float(np.linalg.norm(b - a)) / max(float(np.linalg.norm(b)), 1e-300)

    def keep(self, before: State, after: State) -> None:
        """Remember a state and its image for the multipliers."""
        pair = self._energy_coordinates(before), self._energy_coordinates(after)
        self.secants.append((pair[0][self.vibration], pair[1][self.vibration]))
        del self.secants[:-SECANTS]

    def multipliers(self) -> Complex:
        """Ritz values of the period map on the differences of successive states."""
        steps = [
            (b[0] - a[0], b[1] - a[1])
            for a, b in zip(self.secants[:-1], self.secants[1:], strict=True)
        ]
        found = _values(steps)
        again = _values(steps[len(steps) // 4 :])
        # what a part of the secants does not show is noise of pairs that switch
        return np.asarray([z for z in found if len(again) and np.abs(again - z).min() < SHOWN])

    def next(self, before: State, after: State) -> State:
        self.plain = after
        if self.depth == 0:
            return after
        change = self._energy_coordinates(after) - self._energy_coordinates(before)
        self.images.append(after)
        self.changes.append(change)
        del self.images[: -self.depth], self.changes[: -self.depth]
        count = len(self.changes)
        if count == 1:
            return after
        last = self.changes[-1]
        differences = np.column_stack([last - c for c in self.changes[:-1]])
        weights = np.linalg.lstsq(differences, last, rcond=1e-8)[0]
        share = np.append(weights, 1 - weights.sum())
        if np.abs(share).max() > 1e4:
            self.restart()
            return after
        mixed = {
            name: sum(w * getattr(image, name) for w, image in zip(share, self.images, strict=True))
            for name in LINEAR_FIELDS
            if name != "taken"  # what contact has taken is history, and no steady state repeats it
        }
        return replace(after, **mixed)

    def restart(self) -> State:
        self.images.clear()
        self.changes.clear()
        plain = self.plain
        assert plain is not None
        self.plain = None
        return plain

"""Steady state under harmonic load: marching, or Newton's method on the period map.

The period map takes the state at one passage of the load's phase to the next. Its fixed point is
the steady state. Marching converges at the rate of the slowest transient (hundreds of cycles for a
lightly damped joint); `microslip.analyses.time.search` steps to the fixed point of the linearised map
instead.
"""

from __future__ import annotations

import math
import time as clock
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from microslip.analyses.time.deviations import Derivative, StateSpace, vibration_weight
from microslip.analyses.time.half_period import Passage, half_period_of
from microslip.analyses.time.scheme import (
    ContactMemory,
    March,
    State,
    TimeScheme,
    contact_memory,
    march,
    prestressed_state,
)
from microslip.analyses.time.search import CYCLES, MARCHED, Search
from microslip.analyses.time.starts import Start, end_of, placed
from microslip.brief import Brief
from microslip.contact.pairs import tangential_vectors
from microslip.errors import ContactError
from microslip.numerics.fourier import harmonic
from microslip.typing import Array, Complex

__all__ = [
    "RAISED",
    "SteadyState",
    "drift_of",
    "linearised_state",
    "raised_state",
    "steady_state",
    "vibration_weight",
    "walk_of",
]

RAISED = 10
"""Cycles over which the load is raised from rest: the past that is meant where none is given."""

CONFIRMED = 3.0
"""The cycle after the search may change by this many times the tolerance."""

HALVED, FEWEST = 0.25, 40
"""Share of the cycles allowed after which a search by halves is given up, and so many at least, or half."""

LEADING = 8
"""Directions of largest multipliers that a search hands on."""


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
    history : (n,) array
        `change` of every cycle, or of every half of one where it was sought by halves; and of the last cycle.
    unsolved : int
        Cycles that had to be repeated with the plain iteration.
    multipliers : (k,) complex array
        Floquet multipliers as far as the search has met them, largest modulus first; those of the
        bodies sliding sideways as rigid ones are not among them. Estimates:
        `microslip.analyses.time.stability` makes them a verdict.
    directions : (k, n) array
        Deviations of the state of largest multipliers as far as the search has met them, rows; none where
        it ended by combining states or marching.
    end : Start
        Its state at `phase`, to start a search from under another load or at another frequency.
    halved : bool
        Whether it was found as a motion whose second half is the image of its first.
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
    directions: Array
    end: Start
    halved: bool = False

    @property
    def steps(self) -> int:
        """Per cycle."""
        return len(self.cycle.r) - 1


def steady_state(
    scheme: TimeScheme,
    frequency: float,
    load: float,
    *,
    guess: complex = 0.0,
    accelerate: bool = True,
    tolerance: float = 1e-5,
    max_cycles: int = 400,
    start: State | Start | None = None,
    memory: ContactMemory | None = None,
    halves: bool = True,
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
        Newton's method; False marches.
    tolerance : float
        Relative change of the state over a cycle at which it is steady. A joint that slips widely
        walks: both halves of a cycle push the beams past each other, against soft springs only.
        This walk is left out of the measure, so that it neither hides a steady vibration nor is
        extrapolated.
    max_cycles : int
    start : State or Start, optional
        To start from instead of the guess: a state of this scheme at phase 0, or the end of another
        steady state.
    memory : ContactMemory, optional
        From `contact_memory` of this scheme: what was factorised before is not again.
    halves : bool
        Where the joint is its own image under a half turn that reverses the load, motions whose second
        half is the image of their first are sought first, for a quarter of the cycles, and forty or half of
        them: a step of that search takes half of the time (`microslip.analyses.time.half_period`).
    """
    return linearised_state(
        scheme,
        frequency,
        load,
        guess=guess,
        accelerate=accelerate,
        tolerance=tolerance,
        max_cycles=max_cycles,
        start=start,
        memory=memory,
        halves=halves,
    )[0]


def linearised_state(
    scheme: TimeScheme,
    frequency: float,
    load: float,
    *,
    guess: complex = 0.0,
    accelerate: bool = True,
    tolerance: float = 1e-5,
    max_cycles: int = 400,
    start: State | Start | None = None,
    memory: ContactMemory | None = None,
    halves: bool = True,
    known: Derivative | None = None,
) -> tuple[SteadyState, Derivative]:
    """A steady state as of `steady_state`, and the derivative of the period map as its search knows it.

    Parameters
    ----------
    known : Derivative, optional
        Of the same motion in other steps: of halves of it where it is sought by halves, which is where
        the other was `halved`. The search begins with it in place of deviations marched along a cycle.
    """
    steps = round(1 / (frequency * scheme.dt))
    omega = 2 * np.pi * frequency
    if isinstance(start, Start):
        phase, state = start.phase, placed(start, scheme, frequency, load)
    elif start is not None or guess == 0:
        phase, state = 0.0, start or prestressed_state(scheme)
    else:
        phase, state = float(-np.angle(guess)), prestressed_state(scheme, abs(guess), omega)
    theta = phase + 2 * np.pi * np.arange(steps + 1) / steps
    wave = load * np.sin(theta)
    began = clock.perf_counter()
    space = StateSpace(scheme, omega)
    half = half_period_of(scheme) if halves and accelerate and steps % 2 == 0 else None
    contact = contact_memory(scheme) if memory is None else memory
    passage = Passage(scheme, wave, contact, half)
    near = start is not None and bool(np.any(state.rate))
    search = Search(space, accelerate, near=near, known=known, share=passage.share)
    by_halves = max(HALVED * max_cycles, min(FEWEST, 0.5 * max_cycles))
    most = max_cycles if half is None else max(round(by_halves / passage.share), 1)
    found = _sought(passage, search, state, tolerance, most, confirms=half is None)
    if half is not None and not found.settled:
        # it need not be its own image
        left = max(max_cycles - math.ceil(by_halves), 1)
        first = max(round(passage.share * search.marched), CYCLES[MARCHED])
        begin = search.nearest or found.cycle.state
        passage = replace(passage, half=None)
        search = Search(space, accelerate, near=False, first=min(first, max(left // 3, 1)))
        found = found.then(_sought(passage, search, begin, tolerance, left))
    cycle, change = found.cycle, found.history[-1]
    reference = max(abs(cycle.dissipated), 1e-300)
    Q = harmonic(cycle.output[:, scheme.joint.model.port(scheme.joint.coordinate)], theta)
    steady = SteadyState(
        frequency=frequency,
        load=load,
        cycle=cycle,
        phase=phase,
        amplitude=complex(Q),
        change=change,
        energy_change=abs(cycle.dissipated - found.dissipated) / reference,
        cycles=math.ceil(found.spent),
        converged=change <= CONFIRMED * tolerance,
        seconds=clock.perf_counter() - began,
        history=np.array(found.history),
        unsolved=found.unsolved,
        multipliers=search.derivative.multipliers() ** round(1 / passage.share),
        directions=search.derivative.leading(LEADING),
        end=end_of(cycle.state, phase, scheme, frequency),
        halved=passage.half is not None and found.settled,
    )
    return steady, search.derivative


@dataclass(frozen=True)
class _Sought:
    """What a search has come to.

    Attributes
    ----------
    cycle : March
        A whole one, after the last, histories kept; of halves that did not settle, the last of these.
    settled : bool
    history : list of float
        Changes.
    dissipated : float
        Over the cycle before the last, J per metre of width.
    spent : float
        Cycles.
    unsolved : int
        Passages that had to be repeated.
    """

    cycle: March
    settled: bool
    history: list[float]
    dissipated: float
    spent: float
    unsolved: int

    def then(self, later: _Sought) -> _Sought:
        """The later one, with what was spent before it."""
        return replace(
            later,
            history=self.history + later.history,
            spent=self.spent + later.spent,
            unsolved=self.unsolved + later.unsolved,
        )


def _sought(
    passage: Passage,
    search: Search,
    state: State,
    tolerance: float,
    most: int,
    confirms: bool = True,
) -> _Sought:
    """Search for the fixed point of a period map, for so many passages at most.

    A whole cycle is marched at the end, unless it is of no use where nothing has settled (`confirms`).
    """
    scheme, space, share = passage.scheme, search.space, passage.share
    history: list[float] = []
    unsolved, spent = 0, 0.0

    def confirmed(end: State, before: float, last: float) -> _Sought:
        # one cycle more, whole: what it changes is what counts
        cycle = march(scheme, end, passage.wave, keep=True, memory=passage.memory)
        history.append(space.change(space.vector(end), space.vector(cycle.state)))
        settled = last <= share * tolerance and history[-1] <= CONFIRMED * tolerance
        return _Sought(cycle, settled, history, before, spent, unsolved)

    for _ in range(most):
        spent += share
        try:
            done = passage.of(state, search.tangents)
        except ContactError:
            if search.plain is None:
                raise
            unsolved += 1
            state = search.again()
            continue
        change = space.change(space.vector(state), space.vector(done.state))
        history.append(change)
        if change <= share * tolerance:
            spent += 1
            found = confirmed(done.state, done.dissipated / share, change)
            if found.settled:
                return found
        state = search.next(state, done, change)
    if not confirms:
        return _Sought(done, False, history, done.dissipated / share, spent, unsolved)
    spent += 1
    return confirmed(done.state, done.dissipated / share, change)


def drift_of(steady: SteadyState, dimension: int) -> float:
    """By how much the bodies move past each other over the last cycle, m.

    Median over the pairs of the change of slip from start to end of the cycle. Spatial pairs have one in
    each tangential direction: the length of both together.
    """
    slip = tangential_vectors(steady.cycle.v, dimension)
    drift = np.median(slip[-1] - slip[0], axis=0)
    return float(drift[0] if len(drift) == 1 else np.linalg.norm(drift))


def walk_of(steady: SteadyState, dimension: int) -> float:
    """`drift_of` over the largest range of a slip."""
    slip = tangential_vectors(steady.cycle.v, dimension)
    span = float(np.linalg.norm(np.ptp(slip, axis=0), axis=-1).max())
    return drift_of(steady, dimension) / span if span > 0 else 0.0


def thinned(cycle: March, factor: int) -> March:
    """A march with every so-manieth sample; of iterations, residuals and flags the largest in between.

    Parameters
    ----------
    cycle : March
        With histories or without; the number of its steps is a multiple of `factor`.
    factor : int
    """

    def largest(y: np.ndarray) -> Any:
        return np.concatenate([y[:1], y[1:].reshape(-1, factor).max(axis=1)])

    kept = {
        name: getattr(cycle, name)[::factor].copy()
        for name in ("time", "load", "output", "r", "v", "status")
    }
    worst = {
        name: largest(getattr(cycle, name)) for name in ("iterations", "residual", "dissipative")
    }
    return replace(cycle, **kept, **worst)


def raised_state(
    scheme: TimeScheme,
    frequency: float,
    load: float,
    cycles: int,
    memory: ContactMemory | None = None,
) -> State:
    """State after the load was raised slowly from rest, at phase 0 of the load.

    The amplitude grows as ``(1 - cos(pi t / t_1))/2`` over so many cycles. Pairs that stick all
    the time keep the tractions that the past has left in them; this is the past that is meant
    where none is given.
    """
    steps = round(1 / (frequency * scheme.dt))
    turn = np.arange(cycles * steps + 1) / steps
    wave = load * 0.5 * (1 - np.cos(np.pi * turn / cycles)) * np.sin(2 * np.pi * turn)
    return march(scheme, prestressed_state(scheme), wave, memory=memory).state

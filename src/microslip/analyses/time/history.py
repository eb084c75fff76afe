"""Motion of a joint over time under a load that changes: sweeps, decays, measured signals.

The march is cut into blocks of about one cycle. At the end of each the energies are booked, the
joint is checked to be closed, and a caller may stop; what was done until then is kept.

Energies are per metre of width and counted from t = 0. With ``E`` the kinetic and strain energy
less the potential of the clamp,

    E(t) - E(0) = external - friction - modal damping - residual damping - normal - scheme

where ``normal`` is the work of the normal reactions (zero for exact contact in continuous time) and
``scheme`` what the time integration itself takes: both are errors of the step, never gains.
"""

from __future__ import annotations

import time as clock
from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.signal import find_peaks

from microslip.analyses.statics.cycle import quasi_static_cycle
from microslip.analyses.time.points import opening_of
from microslip.analyses.time.scheme import March, State, TimeScheme, contact_memory, march
from microslip.errors import MicroslipError
from microslip.model.flexibility import Flexibility
from microslip.typing import Array

STATIC_STEPS = 75
"""Load steps from prestress to a load that is held still."""


@dataclass(frozen=True)
class Energies:
    """Energies at the ends of the blocks, J per metre of width; all zero at t = 0.

    Attributes
    ----------
    time : (b,) array
        s.
    external, friction, modal_damping, residual_damping, normal : (b,) arrays
        Work of the load and what was lost.
    mechanical : (b,) array
        Change of kinetic and strain energy, the potential of the clamp included.
    """

    time: Array
    external: Array
    friction: Array
    modal_damping: Array
    residual_damping: Array
    normal: Array
    mechanical: Array

    @property
    def scheme(self) -> Array:
        """What the time integration itself took: the rest of the balance."""
        lost = self.friction + self.modal_damping + self.residual_damping + self.normal
        return self.external - lost - self.mechanical


@dataclass(frozen=True)
class History:
    """Motion under one load, as far as it was computed.

    Attributes
    ----------
    name, kind, drive : str
        Labels: of the history, of its signal, of what drives it.
    port : str
        Driven port.
    dt : float
        Step, s.
    time, load : (n,) arrays
        s; amplitude of the driven port, its value before the first step at t = 0.
    output : (n, p) array
        Outputs of all ports, change from prestress.
    watched : (w,) int array
        Pairs whose slip and gap are kept at every step.
    slip, gap : (n, w) arrays
        m, from prestress; slip of the upper body over the lower.
    energies : Energies
    kept : (f,) int array
        Steps at which the contact of all pairs is kept.
    status : (f, m) int8 array
    r, v : (f, d m) arrays
        Reactions and relative displacements there.
    friction_work : (m,) array
        By pair, J per metre of width.
    residual : float
        Largest residual of a contact problem.
    cycle_steps : int
        Steps per cycle of the signal, or of the sliding mode.
    steps : int
        How many steps were asked for.
    failure : str
        Why it ended early; empty where it did not fail.
    seconds : float
    """

    name: str
    kind: str
    drive: str
    port: str
    dt: float
    time: Array
    load: Array
    output: Array
    watched: NDArray[np.int64]
    slip: Array
    gap: Array
    energies: Energies
    kept: NDArray[np.int64]
    status: NDArray[np.int8]
    r: Array
    v: Array
    friction_work: Array
    residual: float
    cycle_steps: int
    steps: int
    failure: str
    seconds: float

    @property
    def complete(self) -> bool:
        """Whether it reached its end."""
        return len(self.time) == self.steps + 1


@dataclass(frozen=True)
class Recording:
    """What to keep of a march.

    Attributes
    ----------
    name, kind, drive : str
        Labels.
    watched : (w,) int array
        Pairs to keep at every step.
    kept : (f,) int array
        Steps to keep the contact of all pairs at, ascending.
    cycle_steps : int
        Steps per cycle: length of a block.
    """

    name: str
    kind: str
    drive: str
    watched: NDArray[np.int64]
    kept: NDArray[np.int64]
    cycle_steps: int


def nearest_pairs(position: Array, wanted: Sequence[float]) -> NDArray[np.int64]:
    """Contact pair nearest to each position, m.

    Examples
    --------
    >>> nearest_pairs(np.array([-1.0, 0.0, 1.0]), [0.9, -0.2])
    array([2, 1])
    """
    return np.array([int(np.argmin(np.abs(position - x))) for x in wanted], dtype=np.int64)


def field_steps(
    steps: int, dt: float, samples: int, begin: float | None, end: float | None
) -> NDArray[np.int64]:
    """Steps spread evenly over a part of a history.

    Examples
    --------
    >>> field_steps(100, 0.1, 3, 2.0, None)
    array([ 20,  60, 100])
    """
    if samples == 0:
        return np.zeros(0, dtype=np.int64)
    first = min(round((begin or 0.0) / dt), steps)
    last = steps if end is None else min(round(end / dt), steps)
    return np.unique(np.round(np.linspace(first, last, samples)).astype(np.int64))


def run_history(
    scheme: TimeScheme,
    state: State,
    load: Array,
    recording: Recording,
    *,
    advance: Callable[[], None] = lambda: None,
    stopped: Callable[[], bool] = lambda: False,
) -> History:
    """March through a load and keep what was asked for.

    Parameters
    ----------
    scheme : TimeScheme
    state : State
        At t = 0.
    load : (n,) array
        Amplitude of the driven port at every step, n >= 2.
    recording : Recording
    advance, stopped : callables
        Called after every block; a true answer of the second ends the march.

    Returns
    -------
    History
        Shorter than asked, with `failure`, where a step did not solve or the joint opened.
    """
    began = clock.perf_counter()
    book = _Book(scheme, state, load, recording)
    memory = contact_memory(scheme)
    failure = ""
    last = len(load) - 1
    while book.step < last and not stopped():
        end = min(book.step + recording.cycle_steps, last)
        try:
            block = load[book.step : end + 1]
            part = march(scheme, book.state, block, keep=True, memory=memory)
        except MicroslipError as error:
            failure = f"in the cycle that starts at t = {book.step * scheme.dt:.6g} s: {error}"
            break
        reason = opening_of(part, scheme.model.position, book.step * scheme.dt)
        book.enter(part)
        advance()
        if reason:
            failure = reason
            break
    return book.close(failure, clock.perf_counter() - began)


class _Book:
    """Arrays of a whole history, written block by block."""

    def __init__(self, scheme: TimeScheme, state: State, load: Array, what: Recording) -> None:
        self.scheme, self.state, self.load, self.what = scheme, state, load, what
        self.rest = scheme.prestress.solution.v
        d = scheme.model.dimension
        self.normal, self.tangential = d * what.watched, d * what.watched + 1
        n, w, f = len(load), len(what.watched), len(what.kept)
        self.output = np.zeros((n, len(scheme.model.ports)))
        self.slip, self.gap = np.zeros((n, w)), np.zeros((n, w))
        self.status = np.zeros((f, scheme.model.pairs), np.int8)
        self.r, self.v = np.zeros((f, len(self.rest))), np.zeros((f, len(self.rest)))
        self.friction_work = np.zeros(scheme.model.pairs)
        self.residual = 0.0
        self.step = 0
        self.works = [np.zeros(5)]
        self.times = [0.0]
        self.mechanical = [mechanical_energy(scheme, state, load[0])]
        self._keep(0, march(scheme, state, load[:1], keep=True))

    def _keep(self, begin: int, part: March) -> None:
        rows = slice(begin, begin + len(part.load))
        self.output[rows] = part.output
        self.slip[rows] = part.v[:, self.tangential] - self.rest[self.tangential]
        self.gap[rows] = -part.v[:, self.normal]
        first, last = np.searchsorted(self.what.kept, [begin, begin + len(part.load)])
        local = self.what.kept[first:last] - begin
        self.status[first:last] = part.status[local]
        self.r[first:last], self.v[first:last] = part.r[local], part.v[local]

    def enter(self, part: March) -> None:
        self._keep(self.step, part)
        self.step += len(part.load) - 1
        before, self.state = self.state, part.state
        self.friction_work += part.friction_work
        self.residual = max(self.residual, float(part.residual.max()))
        work = np.array(
            [
                part.external,
                part.dissipated,
                part.modal_damping,
                self._residual_damping(part, before),
                part.normal_work,
            ]
        )
        self.works.append(self.works[-1] + work)
        self.times.append(self.step * self.scheme.dt)
        self.mechanical.append(mechanical_energy(self.scheme, part.state, self.load[self.step]))

    def _residual_damping(self, part: March, before: State) -> float:
        """What the residual part lost: the work done on it less the energy it gained.

        A march books the work of the reactions alone, which over a whole cycle is the same.
        """
        scheme, model = self.scheme, self.scheme.model
        a = np.zeros((len(part.load), len(model.ports)))
        a[:, model.port("clamp")] = scheme.prestress.clamp
        a[:, model.port(scheme.port)] += part.load
        y = a @ model.port_port - part.r @ model.port_v
        by_ports = float((0.5 * (a[1:] + a[:-1]) * np.diff(y, axis=0)).sum())
        gained = residual_energy(scheme, part.state, part.load[-1]) - residual_energy(
            scheme, before, part.load[0]
        )
        return part.residual_damping + by_ports - gained

    def close(self, failure: str, seconds: float) -> History:
        done = slice(0, self.step + 1)
        fields = slice(0, int(np.searchsorted(self.what.kept, self.step, side="right")))
        external, friction, modal, residual, normal = np.array(self.works).T
        mechanical = np.array(self.mechanical) - self.mechanical[0]
        return History(
            name=self.what.name,
            kind=self.what.kind,
            drive=self.what.drive,
            port=self.scheme.port,
            dt=self.scheme.dt,
            time=self.scheme.dt * np.arange(self.step + 1, dtype=float),
            load=self.load[done],
            output=self.output[done],
            watched=self.what.watched,
            slip=self.slip[done],
            gap=self.gap[done],
            energies=Energies(
                np.array(self.times), external, friction, modal, residual, normal, mechanical
            ),
            kept=self.what.kept[fields],
            status=self.status[fields],
            r=self.r[fields],
            v=self.v[fields],
            friction_work=self.friction_work,
            residual=self.residual,
            cycle_steps=self.what.cycle_steps,
            steps=len(self.load) - 1,
            failure=failure,
            seconds=seconds,
        )


def mechanical_energy(scheme: TimeScheme, state: State, load: float) -> float:
    """Kinetic and strain energy less the potential of the clamp, J per metre of width."""
    model = scheme.model
    clamp, a = model.port("clamp"), _port_amplitudes(scheme, load)
    modes = 0.5 * np.sum(state.rate**2) + 0.5 * np.sum((model.omega * state.eta) ** 2)
    displaced = (
        model.port_modes[:, clamp] @ state.eta
        + model.port_port[clamp] @ a
        - model.port_v[:, clamp] @ state.r
    )
    potential = scheme.prestress.clamp * displaced
    return float(modes + residual_energy(scheme, state, load) - potential)


def residual_energy(scheme: TimeScheme, state: State, load: float) -> float:
    """Strain energy of the massless residual part and of the springs of an elastic contact.

    Half the product of the forces on it, ports ``a`` and reactions ``-r``, and their displacements
    ``Y_res a - V_res^T r`` and ``s``; the share of its own damping in the forces is left out of
    the energy only to first order in ``tau / dt``.
    """
    model, a = scheme.model, _port_amplitudes(scheme, load)
    y = model.port_port @ a - model.port_v.T @ state.r
    return float(0.5 * (a @ y - state.r @ state.residual_v))


def _port_amplitudes(scheme: TimeScheme, load: float) -> Array:
    a = np.zeros(len(scheme.model.ports))
    a[scheme.model.port("clamp")] = scheme.prestress.clamp
    a[scheme.model.port(scheme.port)] += load
    return a


def static_state(scheme: TimeScheme, flexibility: Flexibility, load: float) -> State:
    """At rest under the clamp and a load that was raised slowly from nothing, with friction.

    Parameters
    ----------
    scheme : TimeScheme
    flexibility : Flexibility
        Static, with the contact compliance of the scheme.
    load : float
        Amplitude of the driven port.

    Raises
    ------
    JointOpensError
        Where the clamp does not hold it.
    """
    model = scheme.model
    rise = quasi_static_cycle(
        model,
        flexibility,
        scheme.prestress,
        scheme.port,
        load,
        scheme.friction,
        steps=4 * STATIC_STEPS,
        max_cycles=1,
    )
    r, v, status = (np.array(x[STATIC_STEPS], copy=True) for x in (rise.r, rise.v, rise.status))
    a = _port_amplitudes(scheme, load)
    e = model.equilibrium_modes
    force = model.port_modes @ a - model.mode_v.T @ r
    rigid = np.linalg.lstsq(flexibility.R, v - flexibility.loads_v @ a + flexibility.W @ r)[0]
    eta = np.concatenate([rigid, force[e:] / model.omega[e:] ** 2])
    return State(
        eta=eta,
        rate=np.zeros_like(eta),
        acceleration=np.zeros_like(eta),
        modal_force=force,
        residual_v=v - model.mode_v @ eta,
        r=r,
        v=v,
        r_before=r[::2].copy(),
        status=status,
    )


# Reading a history -------------------------------------------------------------------------------


@dataclass(frozen=True)
class Decay:
    """Amplitude, frequency and damping of a vibration, one value for each of its extremes.

    Attributes
    ----------
    time : (k,) array
        Of the extreme, s.
    amplitude, offset : (k,) arrays
        Half the difference, and the mean, of an extreme and the average of its two neighbours.
    frequency : (k,) array
        Hz, from the time between the neighbours.
    damping : (k - 1,) array
        Ratio to critical damping from two successive amplitudes.
    """

    time: Array
    amplitude: Array
    offset: Array
    frequency: Array
    damping: Array


def extremes(time: Array, q: Array, cycle_steps: int) -> tuple[Array, Array]:
    """Times and values of the maxima and minima of a vibration, in turn.

    Each is the vertex of the parabola through three samples.

    Parameters
    ----------
    time, q : (n,) arrays
    cycle_steps : int
        Samples in about one cycle: extremes closer than a quarter of it count as one.
    """
    apart = max(cycle_steps // 4, 1)
    found = sorted(
        (int(k), sign) for sign in (1, -1) for k in find_peaks(sign * q, distance=apart)[0]
    )
    k = np.array(
        [n for i, (n, sign) in enumerate(found) if i == 0 or sign != found[i - 1][1]], np.int64
    )
    before, here, after = q[k - 1], q[k], q[(k + 1) % len(q)]
    curvature = before - 2 * here + after
    shift = np.divide(0.5 * (before - after), curvature, out=np.zeros(len(k)), where=curvature != 0)
    step = time[1] - time[0] if len(time) > 1 else 0.0
    return time[k] + shift * step, here - 0.25 * (before - after) * shift


def decay(time: Array, q: Array, cycle_steps: int) -> Decay:
    """Read a vibration extreme by extreme; insensitive to an offset that stays.

    Parameters
    ----------
    time, q : (n,) arrays
    cycle_steps : int
        Samples in about one cycle.

    Examples
    --------
    >>> t = np.linspace(0, 1, 2001)
    >>> found = decay(t, 3 + np.exp(-0.5 * t) * np.sin(2 * np.pi * 10 * t), 200)
    >>> round(float(found.frequency.mean()), 3), round(float(found.damping.mean() * 62.83), 3)
    (10.0, 0.5)
    """
    at, top = extremes(time, q, cycle_steps)
    if len(at) < 3:
        nothing = np.zeros(0)
        return Decay(nothing, nothing, nothing, nothing, nothing)
    other = 0.5 * (top[:-2] + top[2:])
    amplitude = 0.5 * np.abs(top[1:-1] - other)
    with np.errstate(divide="ignore", invalid="ignore"):
        decrement = np.log(amplitude[:-1] / amplitude[1:]) / np.pi
    return Decay(
        time=at[1:-1],
        amplitude=amplitude,
        offset=0.5 * (top[1:-1] + other),
        frequency=1 / (at[2:] - at[:-2]),
        damping=decrement / np.sqrt(1 + decrement**2),
    )


DWELL_HARMONICS = 5
"""Harmonics fitted at the end of a dwell, so that higher ones do not leak into the first."""


def dwell_response(
    time: Array, q: Array, frequencies: Sequence[float], cycles: float
) -> NDArray[np.complex128]:
    """First harmonic at the end of every dwell of a stepped sine, phase against its load.

    Least squares of a constant and five harmonics over the last whole cycle of each dwell, which
    need not be a whole number of steps; nan where the history ended before.

    Parameters
    ----------
    time, q : (n,) arrays
        From the start of the stepped sine.
    frequencies : sequence of float
        Hz, in order.
    cycles : float
        Periods at each.
    """
    found = np.full(len(frequencies), np.nan, dtype=complex)
    begin, turns = 0.0, 0.0
    for i, f in enumerate(frequencies):
        end = begin + cycles / f
        inside = (time > end - min(cycles, 1.0) / f) & (time <= end * (1 + 1e-12))
        if inside.sum() >= 4 * DWELL_HARMONICS and time[-1] >= end * (1 - 1e-9) - (
            time[1] - time[0]
        ):
            phase = 2 * np.pi * (turns + f * (time[inside] - begin))
            turns_of = phase[:, None] * np.arange(1, DWELL_HARMONICS + 1)
            basis = np.hstack([np.sin(turns_of), np.cos(turns_of), np.ones((len(phase), 1))])
            fit = np.linalg.lstsq(basis, q[inside])[0]
            found[i] = fit[0] + 1j * fit[DWELL_HARMONICS]
        begin, turns = end, turns + cycles
    return found

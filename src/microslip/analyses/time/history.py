"""Motion of a joint over time under a load that changes: sweeps, decays, measured signals.

The march is cut into blocks of about one cycle. At the end of each the energies are booked, the
joint is checked to be closed, and a caller may stop; what was done until then is kept. Energies are
counted from t = 0, see `microslip.analyses.time.energy`.
"""

from __future__ import annotations

import time as clock
from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np

from microslip.analyses.statics.cycle import quasi_static_cycle
from microslip.analyses.time.energy import (
    Energies,
    mechanical_energy,
    port_amplitudes,
    reaction_energy,
)
from microslip.analyses.time.readings import opening_of
from microslip.analyses.time.scheme import March, State, TimeScheme, contact_memory, march
from microslip.brief import Brief
from microslip.contact.pairs import normal, slip_history
from microslip.errors import MicroslipError
from microslip.typing import Array, Indices, Status

STATIC_STEPS = 75
"""Load steps from prestress to a load that is held still."""


@dataclass(frozen=True, repr=False)
class History(Brief):
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
        m, from prestress; slip of the upper body over the lower, (n, w, 2) of spatial pairs.
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
    watched: Indices
    slip: Array
    gap: Array
    energies: Energies
    kept: Indices
    status: Status
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


@dataclass(frozen=True, repr=False)
class Recording(Brief):
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
    watched: Indices
    kept: Indices
    cycle_steps: int


def nearest_pairs(position: Array, wanted: Sequence[float]) -> Indices:
    """Contact pair nearest to each position, m.

    Examples
    --------
    >>> nearest_pairs(np.array([-1.0, 0.0, 1.0]), [0.9, -0.2])
    array([2, 1])
    """
    return np.array([int(np.argmin(np.abs(position - x))) for x in wanted], dtype=np.int64)


def field_steps(
    steps: int, dt: float, samples: int, begin: float | None, end: float | None
) -> Indices:
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
        reason = opening_of(part, scheme.joint.model.position, book.step * scheme.dt)
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
        self.rest = scheme.joint.prestress.solution.v
        n, w, f = len(load), len(what.watched), len(what.kept)
        self.output = np.zeros((n, len(scheme.joint.model.ports)))
        self.dimension = scheme.joint.model.dimension
        self.slip0 = slip_history(self.rest, self.dimension)[what.watched]
        self.slip, self.gap = np.zeros((n, *self.slip0.shape)), np.zeros((n, w))
        self.status = np.zeros((f, scheme.joint.model.pairs), np.int8)
        self.r, self.v = np.zeros((f, len(self.rest))), np.zeros((f, len(self.rest)))
        self.friction_work = np.zeros(scheme.joint.model.pairs)
        self.residual = 0.0
        self.step = 0
        self.works = [np.zeros(5)]
        self.times = [0.0]
        self.mechanical = [mechanical_energy(scheme, state, load[0])]
        self._keep(0, march(scheme, state, load[:1], keep=True))

    def _keep(self, begin: int, part: March) -> None:
        rows = slice(begin, begin + len(part.load))
        self.output[rows] = part.output
        watched = self.what.watched
        self.slip[rows] = slip_history(part.v, self.dimension)[:, watched] - self.slip0
        self.gap[rows] = -normal(part.v, self.dimension)[:, watched]
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
        scheme = self.scheme
        gained = reaction_energy(scheme, part.state, part.load[-1]) - reaction_energy(
            scheme, before, part.load[0]
        )
        return part.residual_damping - gained

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


def static_state(scheme: TimeScheme, load: float) -> State:
    """At rest under the preload and a load that was raised slowly from nothing, with friction.

    Parameters
    ----------
    scheme : TimeScheme
    load : float
        Amplitude of the driven port.

    Raises
    ------
    JointOpensError
        Where the preload does not hold it.
    """
    model, flexibility = scheme.joint.model, scheme.joint.flexibility
    rise = quasi_static_cycle(
        scheme.joint,
        scheme.port,
        load,
        steps=4 * STATIC_STEPS,
        max_cycles=1,
    )
    r, v, status = (np.array(x[STATIC_STEPS], copy=True) for x in (rise.r, rise.v, rise.status))
    a = port_amplitudes(scheme, load)
    e = model.equilibrium_modes
    force = model.port_modes @ a - model.mode_v.T @ r
    rigid = np.linalg.lstsq(
        flexibility.R, v - flexibility.loads_v @ a + flexibility.W @ r, rcond=None
    )[0]
    eta = np.concatenate([rigid, force[e:] / model.omega[e:] ** 2])
    return State(
        eta=eta,
        rate=np.zeros_like(eta),
        acceleration=np.zeros_like(eta),
        residual_v=v - model.mode_v @ eta,
        residual_before=v - model.mode_v @ eta,
        r=r,
        v=v,
        taken=np.zeros(1),
        status=status,
    )

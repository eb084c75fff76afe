"""Cycles in which the motion of one mode is prescribed and the other modes have their inertia.

A joint that vibrates near a resonance moves along one mode, ``q = A sin(theta)``, and everything
else follows. What follows is not quasi-static: at circular frequency ``omega_0`` the rest of the
structure has the stiffness ``K - omega_0² M``. Cycles here march the contact through one period
with that stiffness, as statics does with K, and so keep its cost:

    (K - omega_0² M + kappa M Phi Phi^T M) x + B^T r = (omega_sl² - omega_0² + kappa) A sin(theta) M Phi
                                                      + M(t) p + sum of loads on upper modes

with ``Phi`` a mode of the sliding state. A ``kappa`` of a hundred times omega_sl² holds q to its
course. The modal contact force follows from the equation of the mode itself,
``F = load - (omega_sl² - omega_0² + kappa) q``.

The inertia is exact for the first harmonic only. Upper modes whose frequency lies near a multiple
of the first are given the rest of theirs as a load on their own port, see `refined.py`.

Rigid motions that slide the beams past each other and that the stuck mode leaves alone keep their static
stiffness: they are nearly at rest, and their steady offset has no inertia. Where the mode has some of such
a motion (a beam whose end is free shortens with its bending) that has its inertia too; from the amplitude on
at which equilibrium is then unstable it is sought as `floating.py` says (`cycle_at`).
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass

import numpy as np

from microslip.analyses.statics.closing import (
    ClosedCycle,
    Closure,
    cycle_by_halves,
    ramp,
    whole_cycle,
)
from microslip.analyses.statics.floating import Floating, balance
from microslip.analyses.statics.half_turn import HalfTurn
from microslip.analyses.statics.held import HeldMode
from microslip.brief import Brief
from microslip.contact.fallbacks import Counts, together
from microslip.contact.pairs import slip_history
from microslip.contact.path import PathRecord, follow_path
from microslip.contact.solver import ContactSolver
from microslip.errors import ContactError
from microslip.model.shape_damping import damping_of_shape
from microslip.numerics.fourier import harmonic, without_drift
from microslip.typing import Array, Complex, Status

BEGIN = -0.5 * np.pi
"""Phase at which cycles begin: q turns. What a joint has from rest when it first comes to its amplitude is
nearly what it has there in every cycle, and neighbouring amplitudes are nearest to each other there."""


@dataclass(frozen=True, repr=False)
class ContactState(Brief):
    """Where a cycle ends, and another may start.

    Attributes
    ----------
    status : (m,) int8 array
    r, q, v : arrays
    load : (p,) array
        Amplitudes of all ports.
    """

    status: Status
    r: Array
    q: Array
    v: Array
    load: Array


@dataclass(frozen=True, repr=False)
class PrescribedCycle(Brief):
    """First harmonics over one cycle with q prescribed.

    Attributes
    ----------
    q, force : complex
        ``Q_1`` and the modal contact force ``F_1``.
    upper : (u, h) complex array
        Harmonics of the upper modes, column ``h - 1`` for harmonic h.
    output : (p,) complex array
        First harmonics of the outputs of the joint's own ports.
    damping : float
        What damps its shape beyond alpha and beta, `microslip.model.shape_damping`, 1/s.
    dissipated : float
        Friction work, J per metre of width.
    closure : float
        Change of the reactions over the last cycle, over the largest prestress reaction.
    residual : float
        Largest complementarity residual.
    fallbacks : Fallbacks or SpatialFallbacks
        Steps of all cycles by how they were solved.
    state : ContactState
    """

    q: complex
    force: complex
    upper: Complex
    output: Complex
    damping: float
    dissipated: float
    closure: float
    residual: float
    fallbacks: Counts
    state: ContactState


def at_rest(held: HeldMode) -> ContactState:
    """The prestressed state."""
    s, start = held.prestress.solution, held.prestress
    return ContactState(start.status, s.r.copy(), s.q.copy(), s.v.copy(), held.carried)


def prescribed_cycle(
    held: HeldMode,
    amplitude: float,
    *,
    steps: int = 300,
    cycles: int = 4,
    closure: float = 1e-5,
    load: complex = 0.0,
    upper: Mapping[tuple[int, int], complex] | None = None,
    harmonics: int = 1,
    start: ContactState | None = None,
) -> PrescribedCycle:
    """March cycles with ``q = amplitude sin(theta)`` until they close.

    Parameters
    ----------
    held : HeldMode
    amplitude : float
        Of the mode, m sqrt(kg) per sqrt(m) of width.
    steps, cycles : int
        Load steps per cycle, and cycles at most.
    closure : float
        Cycles stop when no reaction changes by more than this between them, over what reactions vary by in
        one, or over the largest at prestress where that is less.
    load : complex
        First harmonic of the load on the driven port, its phase against q.
    upper : mapping of (mode, harmonic) to complex, optional
        Loads on upper modes.
    harmonics : int
        How many harmonics of the upper modes to return.
    start : ContactState, optional
        Where to start; at rest when left out.

    Raises
    ------
    ContactError
        Where a step does not solve.
    """
    f, model = held.flexibility, held.model
    state = at_rest(held) if start is None else start
    theta, path = prescribed_path(held, amplitude, steps)
    path[:, model.port(held.drive)] += (load * np.exp(1j * theta)).imag
    for (mode, order), push in (upper or {}).items():
        path[:, model.port(f"upper {mode}")] += (push * np.exp(1j * order * theta)).imag
    top = held.prestress.largest_reaction
    solver, vt_old = solver_at(held, state)
    taken: list[Counts] = []

    def march(path: Array) -> PathRecord:
        record = follow_path(
            solver,
            f,
            path,
            vt_old,
            where=lambda step: "of a prescribed cycle",
            remedy="try more load steps or a smaller amplitude",
        )
        taken.append(record.fallbacks)
        return record

    if not np.array_equal(state.load, path[0]):
        march(ramp(state.load, path[0]))
    turn = held.half_turn
    if held.floating is not None:
        closed = _balanced(held, held.floating, march, path, theta, amplitude, cycles, closure)
    elif turn is not None and turn.turns(path):
        closed = cycle_by_halves(turn, march, path, cycles, Closure(closure, top))
    else:
        closed = whole_cycle(march, path, cycles, Closure(closure, top))
    s = held.prestress.solution
    output = f.outputs(path, closed.q, closed.r) - f.outputs(held.carried, s.q, s.r)
    output = output[:, : len(model.ports)]
    y = output[:, model.port(held.port)]
    force = path[:, model.port(held.port)] - held.hold * y
    force = force + held.load_on_sliding * path[:, model.port(held.drive)]
    own, first = held.own_ports, len(model.ports) - len(held.upper_omega)
    moved = harmonic(without_drift(output[:, :first], theta), theta)
    tops = [harmonic(output[:, first:], theta, h) for h in range(1, harmonics + 1)]
    return PrescribedCycle(
        q=complex(harmonic(y, theta)),
        force=complex(harmonic(force, theta)),
        upper=np.array(tops).T,
        output=moved[:own],
        damping=damping_of_shape(model, moved[own:]),
        dissipated=closed.dissipated,
        closure=closed.change / top,
        residual=closed.residual,
        fallbacks=together(taken),
        state=_state_after(solver, turn if closed.turned else None, path[-1]),
    )


def cycle_at(
    held: HeldMode,
    amplitude: float,
    *,
    steps: int,
    cycles: int,
    closure: float = 1e-4,
    harmonics: int = 1,
    start: ContactState | None = None,
) -> PrescribedCycle:
    """A cycle in equilibrium; where that has no stable path, with the motions of loose bodies sought.

    A path that leaves the mode no stiffness is not stable either.

    Parameters as in `prescribed_cycle`; `start` is for the first.

    Raises
    ------
    ContactError
        Where neither is found.
    """

    def cycle(of: HeldMode, start: ContactState | None) -> PrescribedCycle:
        found = prescribed_cycle(
            of,
            amplitude,
            steps=steps,
            cycles=cycles,
            closure=closure,
            harmonics=harmonics,
            start=start,
        )
        if not of.sliding_omega**2 + (found.force / found.q).real > 0:
            raise ContactError("the stiffness of the mode is not positive")
        return found

    try:
        return cycle(held, start)
    except ContactError:
        if held.loose is None:
            raise
        return cycle(held.loose, None)


def in_equilibrium(held: HeldMode, cycle: PrescribedCycle) -> bool:
    """Whether a cycle was followed in equilibrium, not with the motions of loose bodies sought."""
    return len(cycle.state.load) == len(held.carried)


def prescribed_path(held: HeldMode, amplitude: float, steps: int) -> tuple[Array, Array]:
    """Phases (s + 1,) of a cycle with ``q = amplitude sin(theta)`` and the loads (s + 1, p) on all ports."""
    theta = BEGIN + 2 * np.pi * np.arange(steps + 1) / steps
    path = np.tile(held.carried, (steps + 1, 1))
    path[:, held.model.port(held.port)] = held.hold * amplitude * np.sin(theta)
    return theta, path


def solver_at(held: HeldMode, state: ContactState) -> tuple[ContactSolver, Array]:
    """Contact solver in a state, and the displacements (m,) at which the pairs stick there."""
    solver = held.resting.another(state.status)
    solver.start_from(state.r, state.q, state.v)
    return solver, slip_history(state.v, held.model.dimension)


def _balanced(
    held: HeldMode,
    loose: Floating,
    march: Callable[[Array], PathRecord],
    path: Array,
    theta: Array,
    amplitude: float,
    cycles: int,
    closure: float,
) -> ClosedCycle:
    """The cycle whose floating coordinates move as they are held; `path` gets their course."""
    top, count = held.prestress.largest_reaction, len(loose.rest)
    closed: list[ClosedCycle] = []

    def cycle(course: Array) -> Array:
        before = path[-1].copy()
        path[:, -count:] = course
        march(ramp(before, path[0]))
        closed[:] = [whole_cycle(march, path, cycles, Closure(closure, top))]
        return closed[0].q

    push, own = held.hold * amplitude, held.sliding_omega**2
    balance(loose, push, abs(amplitude), own, closure, theta, cycle)
    return closed[0]


def _state_after(solver: ContactSolver, turn: HalfTurn | None, load: Array) -> ContactState:
    """The state at the end of a cycle: that of the solver, or its image."""
    status, r, q, v = solver.status.copy(), solver.r.copy(), solver.q.copy(), solver.v.copy()
    if turn is not None:
        status, r, q, v = status[turn.pairs], r[turn.rows], turn.q @ q, v[turn.rows]
    return ContactState(status, r, q, v, load)

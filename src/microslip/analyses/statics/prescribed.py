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

Rigid motions that slide the beams past each other keep their static stiffness: they are nearly at
rest, and their steady offset has no inertia.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, replace

import numpy as np

from microslip.analyses.prepared.joint import PreparedJoint
from microslip.analyses.prepared.joint_modes import walking_modes
from microslip.analyses.prepared.prestress import Prestress
from microslip.analyses.statics.closing import ClosedCycle, cycle_by_halves, ramp, whole_cycle
from microslip.analyses.statics.floating import Floating, balance, floating
from microslip.analyses.statics.half_turn import HalfTurn, find_half_turn
from microslip.brief import Brief
from microslip.contact.fallbacks import Counts, together
from microslip.contact.pairs import normal_rows, slip_history
from microslip.contact.path import PathRecord, follow_path
from microslip.contact.solver import ContactSolver
from microslip.model.flexibility import Flexibility
from microslip.model.joint import JointModel, bonded_modes
from microslip.numerics.fourier import harmonic, without_drift
from microslip.typing import Array, Complex, Indices, Mask, Status

HOLD = 100.0
"""Stiffness that holds the mode to its course, over omega_sl²."""

RELATIVE = 1e-2
"""Share of the largest relative motion of the bodies below which they move together."""


@dataclass(frozen=True, repr=False)
class HeldMode(Brief):
    """A joint one of whose modes is held, ready for `prescribed_cycle`.

    Attributes
    ----------
    model : JointModel
        With one more port per upper mode, after its own.
    flexibility : Flexibility
        At the reference frequency, the prestress exact.
    prestress : Prestress
    friction : (m,) array
    sliding_omega, reference_omega, hold : float
        omega_sl, omega_0 (rad/s) and ``omega_sl² - omega_0² + kappa``.
    load_on_sliding : float
        ``Phi^T p`` of a unit load on the driven port.
    upper_omega : (u,) array
        Upper modes of the sliding state, rad/s.
    floating : Floating or None
        Motions with more inertia than support, where they are sought.
    port : str
        Port of the mode: its inertia load and its coordinate.
    drive : str
        Driven port.
    half_turn : HalfTurn, optional
        Where the joint is its own image: cycles are then marched by halves.
    """

    model: JointModel
    flexibility: Flexibility
    prestress: Prestress
    friction: Array
    sliding_omega: float
    reference_omega: float
    hold: float
    load_on_sliding: float
    upper_omega: Array
    floating: Floating | None
    port: str
    drive: str
    half_turn: HalfTurn | None = None

    @property
    def carried(self) -> Array:
        """(p,) amplitudes of all ports at prestress: the first preload carries all of it."""
        carrier, amplitude = next(iter(self.prestress.preload.items()))
        own = self.model.amplitudes({carrier: amplitude})
        return np.pad(own, (0, self.flexibility.loads_q.shape[1] - len(own)))


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
    dissipated: float
    closure: float
    residual: float
    fallbacks: Counts
    state: ContactState


def hold_mode(joint: PreparedJoint, reference_omega: float, *, upper: int = 0) -> HeldMode:
    """Prepare cycles with the joint's own mode prescribed.

    Parameters
    ----------
    joint : PreparedJoint
        With a mode.
    reference_omega : float
        Circular frequency at which the rest of the joint has its inertia, rad/s; 0 for statics.
    upper : int
        Modes above the sliding mode that get a port.
    """
    mode = joint.principal()
    return hold_port(
        joint,
        mode.port,
        mode.sliding_omega,
        reference_omega,
        upper=upper,
        load_on_mode=mode.load_on_sliding[joint.drive],
    )


def hold_port(
    joint: PreparedJoint,
    port: str,
    omega: float,
    reference_omega: float,
    *,
    static: Mask | None = None,
    floats: bool = False,
    upper: int = 0,
    load_on_mode: float = 0.0,
) -> HeldMode:
    """Prepare cycles with any mode of the sliding state prescribed.

    Parameters
    ----------
    joint : PreparedJoint
    port : str
        Inertia load ``M Phi`` of the mode.
    omega : float
        Its circular frequency, rad/s.
    reference_omega : float
        As in `hold_mode`.
    static : (k,) bool array, optional
        Free-interface modes without inertia; by default those that slide the bodies past each
        other.
    floats : bool
        Whether motions with more inertia than support are sought, see `floating.py`, where they
        would else follow step after step with a negative stiffness.
    upper : int
        As in `hold_mode`.
    load_on_mode : float
        ``Phi^T p`` of a unit load on the driven port.
    """
    model, start = joint.model, joint.prestress
    w0, w = reference_omega, omega
    g = model.port_modes[:, model.port(port)]
    omegas, shapes = bonded_modes(model, start.bonded(1))
    own = int(np.argmax(np.abs(shapes.T @ g)))
    chosen = np.arange(len(omegas))[own + 1 : own + 1 + upper]
    wide = model.with_modal_ports({f"upper {i}": shapes[:, n] for i, n in enumerate(chosen)})
    still = _sliding_past(model, walking_modes(model) if static is None else static)
    inertia = w0**2 * (np.eye(len(g)) - still @ still.T)
    stiffness = np.diag(model.omega**2) - inertia + HOLD * w**2 * np.outer(g, g)
    values, vectors = np.linalg.eigh(stiffness)
    order, soft = _unknowns_first(values, wide.mode_v @ vectors, np.median(model.omega))
    values, vectors = values[order], vectors[:, order]
    mode_v, ports = wide.mode_v @ vectors, vectors.T @ wide.port_modes
    v, p, give = mode_v[:, soft:], ports[soft:], 1 / values[soft:]
    loose = int((values[:soft] < 0).sum()) if floats else 0
    springs = np.where(np.arange(soft) < loose, HOLD * w**2, 0.0)
    to_springs = np.diag(springs)[:, :loose]
    W = wide.residual + (v * give) @ v.T + np.diag(joint.law.compliance)
    flexibility = Flexibility(
        W=np.ascontiguousarray(0.5 * (W + W.T)),
        R=np.ascontiguousarray(mode_v[:, :soft]),
        stiffness=values[:soft] + springs,
        loads_v=np.pad(wide.port_v + (v * give) @ p, ((0, 0), (0, loose))),
        loads_q=np.hstack([ports[:soft], to_springs]),
        loads_loads=np.pad(wide.port_port + (p.T * give) @ p, (0, loose)),
    )
    rest = vectors.T @ modal_rest(joint)
    carrier, amplitude = next(iter(start.preload.items()))
    free, turn = None, None
    if loose:
        own_inertia = vectors[:, :loose].T @ inertia @ vectors[:, :loose]
        bonded, column = start.bonded(model.dimension), model.port(port)
        still = vectors[:, :loose].T @ _sliding_past(model, walking_modes(model))
        free = floating(flexibility, springs[0], own_inertia, rest[:loose], still, bonded, column)
    flexibility = _carried(flexibility, start, rest[:soft], wide.port(carrier), amplitude)
    if not loose:
        turn = find_half_turn(model.image, flexibility, joint.law.friction, start.solution.r)
    return HeldMode(
        model=wide,
        flexibility=flexibility,
        prestress=replace(start, solution=replace(start.solution, q=rest[:soft])),
        friction=joint.law.friction,
        sliding_omega=w,
        reference_omega=w0,
        hold=w**2 - w0**2 + HOLD * w**2,
        load_on_sliding=load_on_mode,
        upper_omega=omegas[chosen],
        floating=free,
        port=port,
        drive=joint.drive,
        half_turn=turn,
    )


def _unknowns_first(values: Array, mode_v: Array, omega: float) -> tuple[Indices, int]:
    """Order of the coordinates in which those that statics solves for come first, and their number.

    These are the soft ones that move the bodies against each other; what moves them together is
    held by its inertia, and contact says nothing of it.
    """
    soft = values < 1e-4 * omega**2
    motion = np.abs(mode_v).max(axis=0, initial=0.0)
    felt = soft & (motion > RELATIVE * motion[soft].max(initial=0.0))
    return np.argsort(~felt, kind="stable"), int(felt.sum())


def _sliding_past(model: JointModel, among: Mask) -> Array:
    """Combinations (k, c) of modes that slide the bodies past each other: orthonormal columns.

    Two rigid motions of one frequency may come in any mixture. That in which the bodies move together is
    not among them: nothing holds it but its inertia.
    """
    chosen = np.flatnonzero(among)
    slips = np.delete(model.mode_v, normal_rows(model.dimension), axis=0)[:, chosen]
    _, size, directions = np.linalg.svd(slips, full_matrices=False)
    moving = directions[size > RELATIVE * size.max(initial=1e-300)]
    still = np.zeros((len(model.omega), len(moving)))
    still[chosen] = moving.T
    return still


def modal_rest(joint: PreparedJoint) -> Array:
    """Modal coordinates under the preload."""
    model, s = joint.model, joint.prestress.solution
    e = model.equilibrium_modes
    force = model.port_modes[e:] @ joint.held - model.mode_v[:, e:].T @ s.r
    return np.concatenate([s.q, force / model.omega[e:] ** 2])


def _carried(
    f: Flexibility, start: Prestress, q: Array, carrier: int, amplitude: float
) -> Flexibility:
    """The first preload's columns replaced so that prestress, a rest without inertia, solves them.

    It carries the whole preload: the others are not loaded in prescribed cycles.
    """
    s = start.solution
    loads_v, loads_q = f.loads_v.copy(), f.loads_q.copy()
    loads_v[:, carrier] = (s.v + f.W @ s.r - f.R @ q) / amplitude
    loads_q[:, carrier] = (f.stiffness * q + f.R.T @ s.r) / amplitude
    return replace(f, loads_v=loads_v, loads_q=loads_q)


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
        Cycles stop when no reaction changes by more than this between them.
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
    theta = 2 * np.pi * np.arange(steps + 1) / steps
    path = np.tile(held.carried, (steps + 1, 1))
    path[:, model.port(held.port)] = held.hold * amplitude * np.sin(theta)
    path[:, model.port(held.drive)] += (load * np.exp(1j * theta)).imag
    for (mode, order), push in (upper or {}).items():
        path[:, model.port(f"upper {mode}")] += (push * np.exp(1j * order * theta)).imag
    top = held.prestress.largest_reaction
    solver = ContactSolver(f, held.friction, np.full(model.pairs, top), state.status)
    solver.start_from(state.r, state.q, state.v)
    vt_old = slip_history(state.v, model.dimension)

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
        closed = cycle_by_halves(turn, march, path, cycles, closure * top)
    else:
        closed = whole_cycle(march, path, cycles, closure * top)
    s = held.prestress.solution
    output = f.outputs(path, closed.q, closed.r) - f.outputs(held.carried, s.q, s.r)
    output = output[:, : len(model.ports)]
    y = output[:, model.port(held.port)]
    force = path[:, model.port(held.port)] - held.hold * y
    force = force + held.load_on_sliding * path[:, model.port(held.drive)]
    first = len(model.ports) - len(held.upper_omega)
    tops = [harmonic(output[:, first:], theta, h) for h in range(1, harmonics + 1)]
    return PrescribedCycle(
        q=complex(harmonic(y, theta)),
        force=complex(harmonic(force, theta)),
        upper=np.array(tops).T,
        output=harmonic(without_drift(output[:, :first], theta), theta),
        dissipated=closed.dissipated,
        closure=closed.change / top,
        residual=closed.residual,
        fallbacks=together(taken),
        state=_state_after(solver, turn if closed.turned else None, path[-1]),
    )


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
        closed[:] = [whole_cycle(march, path, cycles, closure * top)]
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

"""A joint one of whose modes is held to its course, the others with their inertia at one frequency.

The equations are those of `prescribed.py`.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np
from scipy.linalg import eigh

from microslip.analyses.prepared.joint import PreparedJoint
from microslip.analyses.prepared.joint_modes import JointMode, walking_modes
from microslip.analyses.prepared.prestress import Prestress
from microslip.analyses.statics.floating import Floating, floating
from microslip.analyses.statics.half_turn import HalfTurn, find_half_turn
from microslip.brief import Brief
from microslip.contact.pairs import normal_rows
from microslip.contact.solver import ContactSolver
from microslip.model.flexibility import Flexibility
from microslip.model.joint import JointModel, bonded_modes
from microslip.model.shape_damping import with_mode_outputs
from microslip.typing import Array, Indices, Mask

HOLD = 100.0
"""Stiffness that holds the mode to its course, over omega_sl²."""

LINKED = 1e-6
"""Share of a body's slide in the stuck mode, and change of its frequency without that inertia, beyond which
the body moves with the mode, not as a mean."""

RIGID = 1e-3
"""Share of the reference frequency, squared, below which a motion is rigid."""

RELATIVE, ROUNDING = 1e-2, 1e-8
"""Share of the largest relative motion of soft coordinates, and of all, below which bodies move together."""


@dataclass(frozen=True, repr=False)
class HeldMode(Brief):
    """A joint one of whose modes is held, ready for `prescribed_cycle`.

    Attributes
    ----------
    model : JointModel
        With a port per kept mode where damping couples them and one per upper mode, after its own.
    flexibility : Flexibility
        At the reference frequency, the prestress exact.
    prestress : Prestress
    friction : (m,) array
    sliding_omega, reference_omega, hold : float
        omega_sl, omega_0 (rad/s) and ``omega_sl² - omega_0² + kappa``.
    load_on_sliding : float
        ``Phi^T p`` of a unit load on the driven port.
    upper_omega, upper_damping : (u,) arrays
        Upper modes of the sliding state: rad/s, and what damps them beyond alpha and beta, 1/s.
    floating : Floating or None
        Motions with more inertia than support, where they are sought.
    port : str
        Port of the mode: its inertia load and its coordinate.
    drive : str
        Driven port.
    half_turn : HalfTurn, optional
        Where the joint is its own image: cycles are then marched by halves.
    loose : HeldMode, optional
        The same with motions that have more inertia than support sought, for amplitudes at which
        equilibrium has no stable path; None where there are no such motions.
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
    upper_damping: Array
    floating: Floating | None
    port: str
    drive: str
    half_turn: HalfTurn | None = None
    loose: HeldMode | None = None

    @cached_property
    def resting(self) -> ContactSolver:
        """Contact solver in the states of prestress, that others are made of."""
        force = np.full(self.model.pairs, self.prestress.largest_reaction)
        return ContactSolver(self.flexibility, self.friction, force, self.prestress.status)

    @property
    def own_ports(self) -> int:
        """Number of the joint's own ports, the first ones."""
        modes = 0 if self.model.damping is None else len(self.model.omega)
        return len(self.model.ports) - len(self.upper_omega) - modes

    @property
    def carried(self) -> Array:
        """(p,) amplitudes of all ports at prestress: the first preload carries all of it."""
        carrier, amplitude = next(iter(self.prestress.preload.items()))
        own = self.model.amplitudes({carrier: amplitude})
        return np.pad(own, (0, self.flexibility.loads_q.shape[1] - len(own)))


def hold_mode(joint: PreparedJoint, reference_omega: float, *, upper: int = 0) -> HeldMode:
    """Prepare cycles with the joint's own mode prescribed.

    Bodies that slide past each other as the stuck mode has them do so with their inertia; where the mode
    leaves that motion alone, as by symmetry that of a lap joint does, it has a mean only, and no inertia,
    unless the stuck mode had another frequency without it.
    Where such a motion has more inertia than support, and equilibrium no stable path, it is sought. In space,
    where flexible modes below the one that is held would be sought with it, minutes an amplitude, it has a
    mean only.

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

    def held(static: Mask, floats: bool) -> HeldMode:
        return hold_port(
            joint,
            mode.port,
            mode.sliding_omega,
            reference_omega,
            static=static,
            floats=floats,
            upper=upper,
            load_on_mode=mode.load_on_sliding[joint.drive],
        )

    rest = resting(joint, mode)
    stiff = held(rest, False)
    own = stiff.flexibility.stiffness
    flexible = (own < 0) & (own > -(1 - RIGID) * reference_omega**2)
    if joint.model.dimension == 3 and flexible.any():
        return held(walking_modes(joint.model), False)
    return replace(stiff, loose=held(rest, True)) if (own < 0).any() else stiff


def resting(joint: PreparedJoint, mode: JointMode) -> Mask:
    """Modes (k,) without inertia: those that slide the bodies past each other, where the stuck mode leaves
    them alone and keeps its frequency without their inertia; none elsewhere.

    A small share of them in its shape is no proof that it keeps it: where they nearly swing against the rest
    at that frequency, little inertia does much.

    Parameters
    ----------
    joint : PreparedJoint
    mode : JointMode
    """
    still = np.asarray(walking_modes(joint.model) & (mode.stuck**2 < LINKED))
    if not still.any() or _keeps_its_frequency(joint, mode, still):
        return still
    return np.zeros_like(still)


def _keeps_its_frequency(joint: PreparedJoint, mode: JointMode, still: Mask) -> bool:
    """Whether the stuck mode has the same frequency where some modes (k,) are without inertia."""
    model, own = joint.model, mode.stuck_omega**2
    held = joint.prestress.bonded(model.dimension)
    omegas, shapes = bonded_modes(model, held, joint.law.compliance)
    slides = shapes.T @ _sliding_past(model, still)
    mass = np.eye(len(omegas)) - slides @ slides.T
    shifted = np.diag(omegas**2) + own * mass
    found, vectors = eigh(mass, shifted)
    nearest = int(np.argmax(np.abs(vectors.T @ (shifted @ (shapes.T @ mode.stuck)))))
    return bool(abs(found[nearest] * 2 * own - 1) <= LINKED)


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
    model = _without_residual(model, port)
    g = model.port_modes[:, model.port(port)]
    omegas, shapes = bonded_modes(model, start.bonded(1))
    own = int(np.argmax(np.abs(shapes.T @ g)))
    chosen = np.arange(len(omegas))[own + 1 : own + 1 + upper]
    wide = with_mode_outputs(model)
    wide = wide.with_modal_ports({f"upper {i}": shapes[:, n] for i, n in enumerate(chosen)})
    still = _sliding_past(model, walking_modes(model) if static is None else static)
    inertia = w0**2 * (np.eye(len(g)) - still @ still.T)
    stiffness = np.diag(model.omega**2) - inertia + HOLD * w**2 * np.outer(g, g)
    values, vectors = np.linalg.eigh(stiffness)
    order, soft = _unknowns_first(values, wide.mode_v @ vectors, model.usual_omega)
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
        upper_damping=np.diag(model.damping_beyond(shapes[:, chosen])).copy(),
        floating=free,
        port=port,
        drive=joint.drive,
        half_turn=turn,
    )


def _without_residual(model: JointModel, port: str) -> JointModel:
    """The model with a port that acts on the kept modes alone, ``M Phi`` with Phi of length one.

    The modes of a structure have a trace in the residual flexibility of its joint model. A port that is held
    to its course would feel it ``HOLD**2`` times: a stuck resonance half a per cent too low where 25 modes
    are kept.
    """
    column = model.port(port)
    if not (model.port_v[:, column].any() or model.port_port[column].any()):
        return model
    modes, v, own = model.port_modes.copy(), model.port_v.copy(), model.port_port.copy()
    modes[:, column] /= np.linalg.norm(modes[:, column])
    v[:, column] = own[column] = own[:, column] = 0.0
    return replace(model, port_modes=modes, port_v=v, port_port=own)


def _unknowns_first(values: Array, mode_v: Array, omega: float) -> tuple[Indices, int]:
    """Order of the coordinates in which those that statics solves for come first, and their number.

    These are the soft ones that move the bodies against each other; what moves them together, to rounding
    where nothing holds the joint as a whole, is held by its inertia, and contact says nothing of it.
    """
    soft = values < 1e-4 * omega**2
    motion = np.abs(mode_v).max(axis=0, initial=0.0)
    least = max(RELATIVE * motion[soft].max(initial=0.0), ROUNDING * motion.max(initial=0.0))
    felt = soft & (motion > least)
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

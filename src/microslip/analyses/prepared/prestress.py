"""Contact under the preload alone, and the load that opens the joint.

Prestress is without friction, so that the interface starts with no memory, unless friction is asked for or
alone keeps bodies from sliding (`microslip.analyses.prepared.settled`).
"""

from __future__ import annotations

from collections.abc import Collection, Mapping
from contextlib import suppress
from dataclasses import dataclass, replace

import numpy as np
import scipy.sparse as sp
from scipy.optimize import linprog

from microslip.analyses.prepared.balance import (
    ACROSS,
    AROUND,
    FACETS,
    FLAT,
    PULLED,
    SLIDING,
    SOLVED,
    UNBOUNDED,
    edges_of_cone,
    leans,
    opening_motions,
    pulled_apart,
    within_cones,
    without_slide,
    without_sliding,
)
from microslip.brief import Brief
from microslip.contact.pairs import (
    FORWARD,
    at_rest,
    by_pair,
    normal,
    normal_rows,
    slip_history,
    touches,
)
from microslip.contact.solver import ContactSolver, Solution
from microslip.errors import ContactError
from microslip.model.flexibility import Flexibility
from microslip.model.joint import JointModel
from microslip.typing import Array, Indices, Mask, Status

SETTLED = 1e-12
"""Residual above which a solution is solved once more, from where it ended."""

CARRIED = 1e-3
"""Of what friction holds, the force of springs that only keep bodies in place (`microslip.model.loose`)."""

TRACTION = 1e-9
"""Of the largest reaction: tangential ones below are none."""


@dataclass(frozen=True, repr=False)
class Prestress(Brief):
    """Contact under the preload alone, frictionless or with friction.

    Attributes
    ----------
    preload : mapping of str to float
        Amplitude of every port that is held, N per metre of width where it is a force.
    solution : Solution
    pressure : (m,) array
        Pa.
    touching : (m,) bool array
    raised : bool, optional
        Whether it is asked to be that of a preload raised with friction, True, or without, False; left out,
        see `microslip.analyses.prepared.settled.settled`.
    """

    preload: Mapping[str, float]
    solution: Solution
    pressure: Array
    touching: Mask
    raised: bool | None = None

    @property
    def force(self) -> float:
        """Size of the preload, sum of its amplitudes: every field of a receding contact scales with it."""
        return float(sum(abs(a) for a in self.preload.values()))

    @property
    def frictional(self) -> bool:
        """Whether friction takes a part of the preload: tractions that are locked in."""
        d = len(self.solution.v) // len(self.touching)
        tractions = by_pair(self.solution.r, d)[:, 1:]
        return bool(np.abs(tractions).max(initial=0.0) > TRACTION * self.largest_reaction)

    @property
    def largest_reaction(self) -> float:
        """Largest reaction, N per metre of width: the unit of residuals and changes."""
        return float(np.abs(self.solution.r).max())

    @property
    def status(self) -> Status:
        """Contact states to start from: pairs that touch stick."""
        return at_rest(self.touching)

    def bonded(self, directions: int) -> Indices:
        """Components of v of the touching pairs: the normal one, or the first `directions`."""
        pairs = np.flatnonzero(self.touching)
        d = len(self.solution.v) // len(self.touching)
        return np.sort((d * pairs[:, None] + np.arange(directions)).ravel())


def prestress(
    model: JointModel,
    flexibility: Flexibility,
    preload: Mapping[str, float],
    signed: Collection[str] = (),
) -> Prestress:
    """Frictionless contact under the preload.

    Parameters
    ----------
    model : JointModel
    flexibility : Flexibility
        Static, see `microslip.model.flexibility.static_flexibility`.
    preload : mapping of str to float
        Ports and their amplitudes, > 0: N per metre of width.
    signed : collection of str
        Ports among them that may have any: bolts whose length is kept, which a temperature may have tightened
        further than their shortening.

    Raises
    ------
    ContactError
        Where the preload presses no pair together or pulls bodies apart, or the solver does not converge.
    """
    for name, amplitude in preload.items():
        if not (0 < amplitude < np.inf or (name in signed and np.isfinite(amplitude))):
            raise ContactError(f"preload {name!r} is {amplitude:g}: it must be positive")
    if not preload:
        raise ContactError("no preload: nothing presses the contact together")
    a = model.amplitudes(preload)
    force = sum(map(abs, preload.values()))
    if pulled_apart(model, a):
        raise ContactError(PULLED)
    solution = _closed(model, flexibility, a, force)
    touching = touches(solution.status)
    if not touching.any():
        raise ContactError("no contact pair touches under the preload: is it pulling?")
    pressure = normal(solution.r, model.dimension) / model.area
    return Prestress(dict(preload), solution, pressure, touching)


def _closed(model: JointModel, flexibility: Flexibility, a: Array, force: float) -> Solution:
    """Contact closed without friction.

    Along slopes bodies slide only where the preload presses them together by that, as a taper into its seat,
    and where pressure holds them before they have left each other. Elsewhere pressure pushes them out, as a
    plate between two that are hardly not parallel: friction may keep them.
    """
    v_free, q_free = flexibility.loads_v @ a, flexibility.loads_q @ a

    def closed(least: float) -> Solution:
        held, C = without_sliding(model, flexibility, least)
        loads = C.T @ without_slide(model, a, q_free, least)
        found = without_friction(model, held, v_free, loads, force)
        return replace(found, q=C @ found.q)

    if leans(model, a):
        with suppress(ContactError):
            found = closed(FLAT)
            slid = np.linalg.norm(by_pair(found.v, model.dimension)[:, 1:], axis=1).max()
            if slid <= model.area.sum() ** (1 / (model.dimension - 1)):
                return found
    return closed(SLIDING)


def without_friction(
    model: JointModel, flexibility: Flexibility, v_free: Array, q_free: Array, force: float
) -> Solution:
    """Frictionless contact under given loads; pairs may all be open.

    Parameters
    ----------
    model : JointModel
    flexibility : Flexibility
    v_free : (d m,) array
        Relative displacements of the loads without contact.
    q_free : (e,) array
        Loads on the coordinates of equilibrium.
    force : float
        What residuals are measured by, N per metre of width.

    Raises
    ------
    ContactError
        Where the solver does not converge.
    """
    shares = force * model.area / model.area.sum()
    start = np.full(model.pairs, FORWARD, dtype=np.int8)
    solver = ContactSolver(flexibility, 0.0, shares, start)
    history = slip_history(np.zeros(len(v_free)), model.dimension)
    found = solver.solve(v_free, q_free, history)
    if found.residual > SETTLED:
        # all analyses start from it: what soft supports hold is known less well than forces at first
        with suppress(ContactError):
            return min(found, solver.solve(v_free, q_free, history), key=lambda one: one.residual)
    return found


def opening_load(
    model: JointModel, start: Prestress, port: str, friction: Array | float = 0.0
) -> float:
    """Largest amplitude of a port that the preloaded contact can balance (limit analysis).

    Maximises ``A`` over reactions within the cones of friction, ``|r_t| <= mu r_n``, that keep the rigid
    bodies in equilibrium with the preload and ``±A`` on the port, but for motions in which they slide past
    each other. Springs that support the bodies are left out, whatever their stiffness: they hold where the
    bodies are, not the joint together. Beyond ``A`` the contact alone does not hold and the joint opens;
    infinite where the load does not move the bodies against each other, or where their motions are not
    known.

    A flat interface has no shear against opening: friction does not matter. Where bodies turn about an edge
    that lies beside the interface, or this is bent, it does.

    Parameters
    ----------
    model : JointModel
    start : Prestress
    port : str
    friction : (m,) array or float
        Coefficient of every pair; left out, the contact is without friction. Round cones are taken 2 % too
        narrow between their `FACETS` edges: what is said to hold holds.

    Raises
    ------
    ContactError
        Where the preload alone is not in equilibrium, or the linear program fails.
    """
    if model.bodies is None or not model.bodies.v.shape[1]:
        return float("inf")
    parting, sliding = opening_motions(model.bodies.v, model.dimension)
    motions, ports = model.bodies.v @ parting, model.bodies.ports @ parting
    size = np.abs(ports[model.port(port)]).max(initial=0.0)
    slides = np.abs(model.bodies.ports[model.port(port)] @ sliding).max(initial=0.0)
    if not size > max(1e-12 * np.abs(ports).max(initial=0.0), ACROSS * slides):
        return float("inf")
    work = within_cones(motions, np.broadcast_to(friction, model.pairs), model.dimension)
    held = _held_over_force(model, start, ports)
    return _largest_balanced(port, ports[model.port(port)], held, work, start.force)


def sliding_load(model: JointModel, start: Prestress, port: str, friction: Array | float) -> float:
    """Amplitude of a port beyond which bodies slide away that only friction holds (limit analysis).

    Maximises ``A`` over reactions within the cones of friction that keep all motions in equilibrium that no
    support holds (`microslip.model.loose`), with the preload and ``±A`` on the port. Beyond it no
    quasi-static motion exists. Infinite where the load does no work on such a motion, where none moves bodies
    against each other, or where the linear program does not say: to refuse a load takes a proof. Round cones
    are taken up to 0.13 % too wide between their edges: what is said not to hold does not.

    Parameters
    ----------
    model : JointModel
    start : Prestress
    port : str
    friction : (m,) array or float
        Coefficient of every pair.
    """
    loose = model.loose_motions
    if not loose:
        return float("inf")
    relative = np.hstack(opening_motions(model.mode_v[:, :loose], model.dimension))
    ports = model.port_modes[:loose].T @ relative
    size = np.abs(ports).max(axis=1, initial=0.0)
    if not size[model.port(port)] > ACROSS * size.max():
        return float("inf")
    wider = np.broadcast_to(friction, model.pairs) / np.cos(np.pi / AROUND)
    work = within_cones(model.mode_v[:, :loose] @ relative, wider, model.dimension, AROUND)
    held = _held_over_force(model, start, ports)
    try:
        return _largest_balanced(port, ports[model.port(port)], held, work, start.force)
    except ContactError:
        return float("inf")


def slides_from(model: JointModel, start: Prestress, port: str, friction: Array | float) -> float:
    """Amplitude of a port from which bodies slide away that only friction holds, at prestressed pressure.

    Maximises ``A`` over tractions within the cones of friction, ``|r_t| <= mu r_n`` with the reactions r_n of
    the prestress, that keep the motions in equilibrium that no support holds and that slide the bodies, with
    the preload and ``±A`` on the port. Loads change the pressure, so that it is an estimate; `sliding_load`
    is a bound, by any pressure. Infinite where the load does no work on such a motion, and where the preload
    slides bodies along gentle slopes: the pressure there follows the load. Round cones are taken 2 % too
    narrow between their `FACETS` edges.

    Parameters
    ----------
    model : JointModel
    start : Prestress
    port : str
    friction : (m,) array or float
        Coefficient of every pair.
    """
    d, (v, works) = model.dimension, _held_by_friction(model, start, friction)
    if not v.shape[1] or leans(model, model.amplitudes(start.preload)):
        return float("inf")
    _, sliding = opening_motions(v, d)
    motions, ports = v @ sliding, works @ sliding
    load, moves = ports[model.port(port)], works[model.port(port)]
    size = max(np.abs(ports).max(initial=0.0), np.abs(moves).max())
    if not np.abs(load).max(initial=0.0) > ACROSS * size:
        return float("inf")
    pressed, r = start.touching, start.solution.r
    pressure = r[normal_rows(d)] @ motions[normal_rows(d)] / start.force
    held = _held_over_force(model, start, ports) - pressure
    most = (np.broadcast_to(friction, model.pairs) * normal(r, d))[pressed] / start.force
    slid = by_pair(motions.T, d)[:, pressed, 1:]
    edges = edges_of_cone(d, FACETS)
    work = np.hstack([most * (slid @ edge) for edge in edges])
    shares = sp.hstack([sp.eye(len(most))] * len(edges) + [sp.csr_matrix((len(most), 1))])
    try:
        found = _largest_balanced(port, load, held, work, start.force, shares.tocsc())
    except ContactError:
        return 0.0
    return found if found * size < start.force * np.abs(ports).max() / ACROSS**2 else float("inf")


def contact_length(model: JointModel) -> float:
    """How far the outermost pairs are apart, m."""
    return float(np.ptp(model.position, axis=0).max(initial=0.0))


def _held_by_friction(
    model: JointModel, start: Prestress, friction: Array | float
) -> tuple[Array, Array]:
    """Relative displacements (d m, e) of motions that friction alone holds, and work (p, e) of the ports.

    Those that nothing holds; without any, rigid motions that slide the bodies past each other against springs
    so soft that, over the length of the contact, they carry next to nothing of what friction does.
    """
    loose, d, length = model.loose_motions, model.dimension, contact_length(model)
    if loose or model.bodies is None or model.supports is None or not length > 0:
        return model.mode_v[:, :loose], model.port_modes[:loose].T
    _, sliding = opening_motions(model.bodies.v, d)
    coordinates = model.bodies.modes @ sliding
    stiffness = coordinates.T @ model.supports @ coordinates
    springs, apart = np.linalg.eigh(stiffness)
    sliding = sliding @ apart
    v = model.bodies.v @ sliding
    slip = np.linalg.norm(by_pair(v.T, d)[..., 1:], axis=-1)
    pressed = np.maximum(normal(start.solution.r, d), 0.0)
    holds = slip @ (np.broadcast_to(friction, model.pairs) * pressed)
    far = length / np.maximum(slip.max(axis=1, initial=0.0), 1e-300)
    soft = springs * far <= CARRIED * holds
    return v[:, soft], (model.bodies.ports @ sliding)[:, soft]


def _largest_balanced(
    port: str,
    load: Array,
    held: Array,
    work: Array,
    force: float,
    shares: sp.csc_matrix | None = None,
) -> float:
    """Largest A with which weights >= 0 of reactions do the work of the preload and of ``±A`` on the port.

    Parameters
    ----------
    port : str
        For the message.
    load : (f,) array
        Of a unit amplitude of the port on some motions.
    held : (f,) array
        Of the preload on them, over `force`.
    work : (f, c) array
        Of a unit weight of each reaction.
    force : float
        Size of the preload.
    shares : (k, c + 1) matrix, optional
        Sums of weights, the last of them A, that are at most 1.
    """
    size = np.abs(load).max()
    limits = []
    for sign in (1.0, -1.0):
        found = linprog(
            np.r_[np.zeros(work.shape[1]), -1.0],
            A_ub=shares,
            b_ub=None if shares is None else np.ones(shares.shape[0]),
            A_eq=np.hstack([work, -sign * load[:, None] / size]),
            b_eq=held,
            bounds=(0, None),
            method="highs",
        )
        if found.status not in (SOLVED, UNBOUNDED):
            raise ContactError(
                f"how much the joint holds on port {port!r} was not found: {found.message}"
            )
        limits.append(found.x[-1] * force / size if found.status == SOLVED else np.inf)
    return float(min(limits))


def _held_over_force(model: JointModel, start: Prestress, ports: Array) -> Array:
    """Work of the preload on motions, over its size."""
    return np.asarray((model.amplitudes(start.preload) / start.force) @ ports)

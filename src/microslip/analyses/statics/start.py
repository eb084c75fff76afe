"""What quasi-static paths begin with: a load that the preload holds, and the prestressed state."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from microslip.analyses.prepared.joint import PreparedJoint
from microslip.analyses.prepared.prestress import (
    CARRIED,
    contact_length,
    opening_load,
    slides_from,
    sliding_load,
)
from microslip.contact.pairs import by_pair, normal
from microslip.contact.path import PathRecord, follow_path
from microslip.contact.solver import ContactSolver
from microslip.errors import ContactError, JointOpensError
from microslip.typing import Array


def check_stays_closed(joint: PreparedJoint, port: str, largest: float) -> None:
    """Raise `JointOpensError` where a load opens the joint, and name the limit.

    Beyond it only the supports hold, with motions that mean nothing.
    """
    limit = opening_load(joint.model, joint.prestress, port, joint.law.friction)
    if largest >= limit:
        raise JointOpensError(
            f"the load {largest:.4g} on {port!r} opens the joint: the preload holds less than "
            f"{limit:.4g}"
        )


def check_held(joint: PreparedJoint, port: str, largest: float) -> None:
    """Raise for a load, alone beside the preload, that has no quasi-static motion.

    Raises
    ------
    JointOpensError
        Where it opens the joint.
    ContactError
        Where it slides bodies away that only friction holds.
    """
    check_stays_closed(joint, port, largest)
    limit = sliding_load(joint.model, joint.prestress, port, joint.law.friction)
    if largest > limit:
        raise ContactError(
            f"there is no solution: the load {largest:.4g} on {port!r} slides bodies away that friction "
            f"alone holds, and it holds no more than {limit:.4g}; take a smaller load, or a support"
        )


ROUNDING = 1e-6
"""Of the most that pairs can do on any motion that nothing else holds: what is less is none."""


def held_path(
    joint: PreparedJoint,
    path: Array,
    vt_old: Array,
    *,
    solver: ContactSolver,
    port: str | None = None,
    where: Callable[[int], str],
    remedy: str,
) -> PathRecord:
    """`follow_path` of a joint that must not slide away.

    Beyond what friction holds, only the springs hold the bodies that keep their mean position, at distances
    that mean nothing: what these carry tells of it.

    Parameters
    ----------
    joint : PreparedJoint
    path : (n + 1, p) array
    vt_old : array
        As of `follow_path`, with `where` and `remedy`.
    solver : ContactSolver
    port : str, optional
        The one that is loaded, where it is one.

    Raises
    ------
    ContactError
        Where a step does not solve, or bodies slide away.
    """
    floating = joint.model.loose_motions > 0
    entry = solver.r.copy(), solver.q.copy(), solver.v.copy()
    status, sticks_at = solver.status.copy(), vt_old.copy()

    def follow(*, rescues: bool) -> PathRecord:
        return follow_path(
            solver, joint.flexibility, path, vt_old, where=where, remedy=remedy, rescues=rescues
        )

    try:
        record = follow(rescues=not floating)
    except ContactError:
        limit, largest = _limit_and_load(joint, path, port)
        if largest > limit:
            raise _slides_away(port, largest, limit) from None
        if not floating:
            raise
        solver.start_from(*entry)
        solver.status[:], vt_old[:] = status, sticks_at
        solver.refresh()
        record = follow(rescues=True)
    carried, off = carried_by_springs(joint, record) > CARRIED, slid_off(joint, record)
    if carried or off:
        limit, largest = _limit_and_load(joint, path, port)
        if carried or largest > limit:
            raise _slides_away(port, largest, limit)
    return record


def _capacity(joint: PreparedJoint) -> Array:
    """(l,) most that pairs can do on each motion that nothing holds, by the reactions of the prestress."""
    model, loose = joint.model, joint.model.loose_motions
    r = np.maximum(normal(joint.prestress.solution.r, model.dimension), 0.0)
    v = by_pair(model.mode_v[:, :loose].T, model.dimension)
    size = np.abs(v[..., 0]) + joint.law.friction * np.linalg.norm(v[..., 1:], axis=-1)
    return np.asarray(size @ r)


def _limit_and_load(joint: PreparedJoint, path: Array, port: str | None) -> tuple[float, float]:
    """Load from which bodies slide away, and the largest of a path; infinite and 0 of several ports."""
    if port is None:
        return np.inf, 0.0
    column = joint.model.port(port)
    limit = slides_from(joint.model, joint.prestress, port, joint.law.friction)
    return limit, float(np.abs(path[:, column] - joint.held[column]).max())


def _slides_away(port: str | None, largest: float, limit: float) -> ContactError:
    what = "the loads slide" if port is None else f"the load {largest:.4g} on {port!r} slides"
    about = f", by the pressure of the prestress up to {limit:.4g}" if np.isfinite(limit) else ""
    return ContactError(
        f"there is no solution: {what} bodies away that friction alone holds{about}; take a smaller "
        "load, or a support"
    )


def slid_off(joint: PreparedJoint, record: PathRecord) -> bool:
    """Whether bodies have slid past each other by more than the length of their contact."""
    v = record.v.reshape(len(record.v), joint.model.pairs, -1)[..., 1:]
    reach = float(np.ptp(v, axis=0).max(initial=0.0))
    return reach > contact_length(joint.model)


def carried_by_springs(joint: PreparedJoint, record: PathRecord) -> float:
    """Largest force of a spring that only keeps a place, over what pairs can do on its motion."""
    capacity = _capacity(joint)
    springs = joint.flexibility.stiffness[: len(capacity)] * record.q[:, : len(capacity)]
    most = np.abs(springs - springs[0]).max(axis=0, initial=0.0)
    # a pin without friction spins: what holds that motion is rounding, and so may be what turns it
    capacity = np.maximum(capacity, ROUNDING * capacity.max(initial=0.0))
    return float((most / np.maximum(capacity, 1e-300))[capacity > 0].max(initial=0.0))


def prestressed_solver(joint: PreparedJoint) -> ContactSolver:
    """A solver on the static flexibility, at the prestressed state."""
    start = joint.prestress
    force = np.full(joint.model.pairs, start.largest_reaction)
    solver = ContactSolver(joint.flexibility, joint.law.friction, force, start.status)
    solver.start_from(start.solution.r, start.solution.q, start.solution.v)
    return solver

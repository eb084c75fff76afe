"""What quasi-static paths begin with: a load that the preload holds, and the prestressed state."""

from __future__ import annotations

import numpy as np

from microslip.analyses.prepared.joint import PreparedJoint
from microslip.analyses.prepared.prestress import opening_load, sliding_load
from microslip.contact.solver import ContactSolver
from microslip.errors import ContactError, JointOpensError


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


def prestressed_solver(joint: PreparedJoint) -> ContactSolver:
    """A solver on the static flexibility, at the prestressed state."""
    start = joint.prestress
    force = np.full(joint.model.pairs, start.largest_reaction)
    solver = ContactSolver(joint.flexibility, joint.law.friction, force, start.status)
    solver.start_from(start.solution.r, start.solution.q, start.solution.v)
    return solver

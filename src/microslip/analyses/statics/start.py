"""What quasi-static paths begin with: a load that the preload holds, and the prestressed state."""

from __future__ import annotations

import numpy as np

from microslip.analyses.prepared.joint import PreparedJoint
from microslip.analyses.prepared.prestress import opening_load
from microslip.contact.solver import ContactSolver
from microslip.errors import JointOpensError


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


def prestressed_solver(joint: PreparedJoint) -> ContactSolver:
    """A solver on the static flexibility, at the prestressed state."""
    start = joint.prestress
    force = np.full(joint.model.pairs, start.largest_reaction)
    solver = ContactSolver(joint.flexibility, joint.law.friction, force, start.status)
    solver.start_from(start.solution.r, start.solution.q, start.solution.v)
    return solver

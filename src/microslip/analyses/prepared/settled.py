"""Prestress of joints whose preload slides bodies that friction alone holds, as bolts aslant do."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from microslip.analyses.prepared.balance import friction_taken
from microslip.analyses.prepared.prestress import Prestress
from microslip.contact.pairs import normal, slip_history, touches
from microslip.contact.solver import ContactSolver
from microslip.errors import ContactError
from microslip.model.flexibility import Flexibility
from microslip.model.joint import JointModel
from microslip.typing import Array


def settled(
    model: JointModel, flexibility: Flexibility, start: Prestress, friction: Array | float
) -> Prestress:
    """The prestress with the friction that keeps bodies from sliding away.

    A prestress without friction leaves them where they are, and the part of the preload that slides them is
    balanced by nothing. Friction takes it from there, in one step: tractions and slips, from which all
    analyses start and outputs are measured. Unchanged where the preload slides nothing.

    Parameters
    ----------
    model : JointModel
    flexibility : Flexibility
        Static, with the compliance of the contact.
    start : Prestress
        Without friction.
    friction : (m,) array or float
        Coefficient of every pair.

    Raises
    ------
    ContactError
        Where friction does not hold the bodies.
    """
    a = model.amplitudes(start.preload)
    if not friction_taken(model, a, friction) > 0:
        return start
    s = start.solution
    force = np.full(model.pairs, start.largest_reaction)
    solver = ContactSolver(flexibility, friction, force, start.status)
    solver.start_from(s.r, s.q, s.v)
    stuck_at = slip_history(s.v, model.dimension)
    try:
        found = solver.solve(flexibility.loads_v @ a, flexibility.loads_q @ a, stuck_at)
    except ContactError as error:
        raise ContactError(
            f"the preload slides bodies past each other, and friction was not found to hold them: {error}"
        ) from None
    pressure = normal(found.r, model.dimension) / model.area
    return replace(start, solution=found, pressure=pressure, touching=touches(found.status))

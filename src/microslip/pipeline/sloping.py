"""What friction changes of the pressure where preloads press sloping surfaces together."""

from __future__ import annotations

import numpy as np

from microslip.analyses.prepared.balance import leans
from microslip.analyses.prepared.joint import PreparedJoint
from microslip.analyses.prepared.settled import raised
from microslip.contact.pairs import normal
from microslip.errors import Caution, ContactError

PARALLEL = 0.98
"""Share of a motion along the normals above which it does not slide bodies along slopes."""

ASIDE = 0.05
"""Share of the contact force that friction may change in silence."""


def sloping(prepared: PreparedJoint) -> tuple[Caution, ...]:
    """That pressing sloping surfaces together with friction, or without, makes a difference.

    Where the prestress is without friction because nothing says otherwise, it is solved once more with
    friction.
    """
    start, model = prepared.prestress, prepared.model
    if start.raised is not None or not np.max(prepared.law.friction) > 0:
        return ()
    if leans(model, prepared.held):
        reason = (
            "it presses bodies together along gentle slopes, so that the prestress is that of a preload "
            "raised slowly from nothing, with friction, which takes a part of it"
        )
        remedy = 'prestress = "frictionless" at the top of the file leaves that out'
        return (Caution("input", "preload", reason, remedy),)
    if not leans(model, prepared.held, PARALLEL):
        return ()
    try:
        other = raised(model, prepared.flexibility, start, prepared.law.friction)
    except ContactError:
        return ()
    without, taken = (normal(one.solution.r, model.dimension).sum() for one in (start, other))
    if abs(taken - without) <= ASIDE * without:
        return ()
    reason = (
        f"it presses sloping surfaces together, without friction here; raised slowly with friction, the "
        f"contact force under it is {taken / without:.0%} of what it is"
    )
    return (
        Caution(
            "input", "preload", reason, 'prestress = "frictional" at the top of the file takes it'
        ),
    )

"""Prestress with friction: of a preload raised slowly, and of what friction alone keeps from sliding."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from microslip.analyses.prepared.balance import friction_taken, leans, unheld
from microslip.analyses.prepared.prestress import Prestress
from microslip.contact.pairs import normal, slip_history, touches
from microslip.contact.path import follow_path
from microslip.contact.solver import ContactSolver
from microslip.errors import ContactError
from microslip.model.flexibility import Flexibility
from microslip.model.joint import JointModel
from microslip.typing import Array

STEPS = 16
"""In which a preload is raised. Where bodies are pressed in proportion one is enough."""

UNHELD = 1e-3
"""Of what friction can do: so much, missing to equilibrium along a slide, is left to the first load step."""


def settled(
    model: JointModel, flexibility: Flexibility, start: Prestress, friction: Array | float
) -> Prestress:
    """The prestress with friction, where that is asked for or needed.

    A preload that slides bodies along gentle slopes, as tapers into their seats, is raised from nothing with
    friction, which takes most of it; so is any where `Prestress.raised` is True. Where it slides them along
    flat surfaces, as bolts aslant do, or pressure pushes them out along slopes, a prestress without friction
    leaves them where they are, and what slides them is balanced by nothing: friction takes it from there, in
    one step.
    All analyses start from the tractions and slips that this leaves, and outputs are measured from it.
    Otherwise unchanged.

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
    if not np.max(friction, initial=0.0) > 0:
        return start
    a = model.amplitudes(start.preload)
    if leans(model, a) if start.raised is None else start.raised:
        return raised(model, flexibility, start, friction)
    s, loads = start.solution, flexibility.loads_q @ a
    missing = unheld(model, flexibility, loads, s.r, s.q, friction)
    if not (friction_taken(model, a, friction) > 0 or missing > UNHELD):
        return start
    solver = _solver(model, flexibility, start, friction)
    solver.start_from(s.r, s.q, s.v)
    stuck_at = slip_history(s.v, model.dimension)
    try:
        found = solver.solve(flexibility.loads_v @ a, loads, stuck_at)
    except ContactError as error:
        raise ContactError(
            f"the preload slides bodies past each other, and friction was not found to hold them: {error}"
        ) from None
    pressure = normal(found.r, model.dimension) / model.area
    return replace(start, solution=found, pressure=pressure, touching=touches(found.status))


def raised(
    model: JointModel,
    flexibility: Flexibility,
    start: Prestress,
    friction: Array | float,
    steps: int = STEPS,
) -> Prestress:
    """The prestress of a preload that is raised in proportion from nothing, with friction.

    Initial gaps and interference grow with it.

    Parameters
    ----------
    model, flexibility, friction
        As of `settled`.
    start : Prestress
        Without friction: what it touches is where the first step is sought from.
    steps : int

    Raises
    ------
    ContactError
        Where a step has no solution.
    """
    a = model.amplitudes(start.preload)
    s, first = start.solution, a / steps
    solver = _solver(model, flexibility, start, friction)
    solver.start_from(s.r / steps, s.q / steps, s.v / steps)
    history = slip_history(np.zeros_like(s.v), model.dimension)
    try:
        found = solver.solve(flexibility.loads_v @ first, flexibility.loads_q @ first, history)
    except ContactError as error:
        raise ContactError(
            f"the preload was not found to close the joint with friction: {error}"
        ) from None
    record = follow_path(
        solver,
        flexibility,
        np.arange(1, steps + 1)[:, None] / steps * a,
        slip_history(found.v, model.dimension),
        where=lambda step: f"{step} of {steps - 1} of the preload, raised with friction",
        remedy='prestress = "frictionless"',
    )
    solution = replace(
        found,
        r=record.r[-1],
        v=record.v[-1],
        q=record.q[-1],
        status=record.status[-1],
        residual=float(max(found.residual, record.residual.max())),
        iterations=int(found.iterations + record.iterations.sum()),
    )
    pressure = normal(solution.r, model.dimension) / model.area
    return replace(start, solution=solution, pressure=pressure, touching=touches(solution.status))


def _solver(
    model: JointModel, flexibility: Flexibility, start: Prestress, friction: Array | float
) -> ContactSolver:
    force = np.full(model.pairs, start.largest_reaction)
    return ContactSolver(flexibility, friction, force, start.status)

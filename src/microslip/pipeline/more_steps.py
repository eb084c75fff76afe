"""Steady states sought on with more time steps, and whether motions stay beside them.

A search finds periodic motions whether they are stable or not, and that depends on the steps as well: where a
branch turns unstable, few and many steps disagree by multipliers of a tenth. So both are asked of the same
state, with `REFINEMENT` times its steps.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping

from microslip.analyses.prepared.joint import PreparedJoint
from microslip.analyses.time.scheme import contact_memory, time_scheme
from microslip.analyses.time.staying import stay_of
from microslip.analyses.time.steady import steady_state
from microslip.analyses.time.step_refinement import REFINEMENT
from microslip.errors import MicroslipError
from microslip.numerics.execute import each, threads
from microslip.pipeline.targets import TOLERANCE, More, Stepped

PATIENCE = 100
"""Cycles with `REFINEMENT` times the steps at most."""


def with_more_steps(joint: PreparedJoint, load: float, one: Stepped) -> More:
    """A steady state with `REFINEMENT` times the steps, and what motions do beside it."""
    f = one.frequency
    scheme = time_scheme(joint, 1 / (f * REFINEMENT * one.steps), frequency=f)
    memory, spent = contact_memory(scheme), 0
    try:
        found = steady_state(
            scheme,
            f,
            load,
            start=one.state,
            tolerance=TOLERANCE,
            max_cycles=PATIENCE,
            memory=memory,
        )
        spent = REFINEMENT * found.cycles
        if not found.converged:
            return More(None, spent)
        stay = stay_of(scheme, found, memory)
    except MicroslipError:
        return More(None, spent)
    spent += REFINEMENT * stay.cycles
    return More(stay.amplitude if stay.strays < float("inf") else None, spent, stay.strays)


def more_steps(
    joint: PreparedJoint, load: float, states: Mapping[int, Stepped]
) -> Iterator[tuple[int, More]]:
    """Steady states with more steps, by index of their frequency, as they are found."""
    marks = sorted(states)
    found = each(lambda k: with_more_steps(joint, load, states[k]), marks, threads())
    return zip(marks, found, strict=True)

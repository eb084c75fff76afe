"""How a prescribed cycle answers small loads on upper modes: derivatives, not differences.

The cycle is marched once more with the states of its contact kept; the small loads are then taken along it
all at once (`microslip.contact.path_tangent`), cycle after cycle until what they leave behind in the
pairs repeats itself.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from microslip.analyses.statics.held import HeldMode
from microslip.analyses.statics.prescribed import PrescribedCycle, prescribed_path, solver_at
from microslip.contact.path import follow_path
from microslip.contact.path_tangent import path_tangent
from microslip.numerics.fourier import harmonic
from microslip.typing import Complex

REPEATED = 1e-4
"""Change of the reactions from cycle to cycle, relative, at which the answer is periodic: a tenth or less of
what the steps leave."""

CYCLES = 8
"""Cycles at most that the small loads are taken along."""


class UpperAnswers(NamedTuple):
    """Derivatives by the real and the imaginary part of loads on upper harmonics.

    Attributes
    ----------
    motion : (l, 2) complex array
        Of the harmonic of the loaded mode that the load acts with.
    force : (l, 2) complex array
        Of the modal contact force at given q: ``F_1 Q_0/Q_1``.
    """

    motion: Complex
    force: Complex


def upper_answers(
    held: HeldMode,
    cycle: PrescribedCycle,
    loads: Sequence[tuple[int, int]],
    *,
    steps: int,
    closure: float = REPEATED,
) -> UpperAnswers:
    """Derivatives of a cycle by loads ``Im(P exp(i h theta))`` on upper modes.

    Parameters
    ----------
    held : HeldMode
    cycle : PrescribedCycle
        Closed, without loads.
    loads : sequence of (mode, harmonic)
    steps : int
        Load steps per cycle.
    closure : float
        Change of the reactions over a cycle, relative, at which it is closed. What the pairs are displaced by
        may go on to change: bodies that walk past each other feel nothing of it.

    Raises
    ------
    ContactError
        Where a step does not solve.
    """
    f, model = held.flexibility, held.model
    theta, path = prescribed_path(held, abs(cycle.q), steps)
    solver, vt_old = solver_at(held, cycle.state)
    for _ in range(2):
        record = follow_path(
            solver,
            f,
            path,
            vt_old,
            where=lambda step: "of a prescribed cycle",
            remedy="try more load steps or a smaller amplitude",
        )
        change = np.abs(record.r[-1] - record.r[0]).max()
        if change <= closure * held.prestress.largest_reaction:
            break
    changes = np.zeros((steps + 1, 2 * len(loads), path.shape[1]))
    for k, (mode, order) in enumerate(loads):
        wave = np.exp(1j * order * theta)
        column = model.port(f"upper {mode}")
        changes[:, 2 * k, column], changes[:, 2 * k + 1, column] = wave.imag, wave.real
    tangent = path_tangent(solver, f, record, changes)
    for _ in range(CYCLES - 1):
        before = tangent.r[-1]
        tangent = path_tangent(solver, f, record, changes, tangent.vt)
        if np.abs(tangent.r[-1] - before).max() <= closure * np.abs(tangent.r).max(initial=1e-300):
            break
    tangent.r[0], tangent.q[0] = tangent.r[-1], tangent.q[-1]
    output = f.outputs(changes, tangent.q, tangent.r)
    y = harmonic(output[:, :, model.port(held.port)], theta)
    upper = [
        harmonic(output[:, [2 * k, 2 * k + 1], model.port(f"upper {mode}")], theta, order)
        for k, (mode, order) in enumerate(loads)
    ]
    force = -held.hold * y - cycle.force / cycle.q * y
    return UpperAnswers(np.array(upper), force.reshape(-1, 2))

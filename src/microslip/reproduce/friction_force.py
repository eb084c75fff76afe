"""Friction alone on the sliding mode: the paper's ``F_f``, the change of pressure left out.

The modal contact force of `microslip.analyses.reduced.table` is the whole of it, pressure
included. The paper's is friction:

    f = (B_t Phi_sl)^T r_t,   k_eq + i gamma_eq = F_1 / (omega_sl² Q_1)

Where the sliding mode is bonded in the normal direction pressure does no work on it, so the two
differ only by pairs that open or close.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from microslip.analyses.prepared import PreparedJoint
from microslip.analyses.reduced.table import EquivalentTable, modal_quantities
from microslip.analyses.statics.cycle import Cycle
from microslip.model.interface import Interface
from microslip.model.states import LinearStates
from microslip.numerics.fourier import harmonic
from microslip.typing import Array


def friction_modal_force(r: Array, interface: Interface, states: LinearStates) -> Array:
    """Friction alone on the sliding mode, ``(B_t Phi_sl)^T r_t``, the change of pressure left out.

    Parameters
    ----------
    r : (..., d m) array
        Reactions, N per metre of width.
    interface : Interface
    states : LinearStates

    Returns
    -------
    (...) array
        N per metre of width times the unit of the mode shape, 1/sqrt(kg/m).
    """
    d = interface.dimension
    psi = interface.relative @ states.sliding
    tangential = np.arange(len(psi)) % d != 0
    return np.asarray(r[..., tangential] @ psi[tangential])


def friction_table(
    table: EquivalentTable,
    cycles: Sequence[Cycle],
    interface: Interface,
    states: LinearStates,
    joint: PreparedJoint,
) -> EquivalentTable:
    """The table with friction alone in place of the whole contact force, as the paper defines it.

    The cross part on the second coordinate is left out with the pressure.

    Parameters
    ----------
    table : EquivalentTable
        Of the same cycles.
    cycles : sequence of Cycle
        Any order.
    interface : Interface
    states : LinearStates
        The sliding mode on all degrees of freedom: shape of the slip of every pair.
    joint : PreparedJoint
        With that mode.
    """
    omega2 = states.sliding_omega**2
    ordered = sorted(cycles, key=lambda cycle: abs(cycle.amplitude))
    ratio = []
    for cycle in ordered:
        q, _ = modal_quantities(cycle, joint)
        f = friction_modal_force(cycle.r, interface, states)
        ratio.append(harmonic(f, cycle.theta) / harmonic(q, cycle.theta) / omega2)
    values = np.array(ratio)
    return replace(
        table,
        k_eq=values.real,
        gamma_eq=values.imag,
        cross=np.zeros(len(values), complex),
        stored=0.5 * values.real * omega2 * table.amplitude**2,
    )

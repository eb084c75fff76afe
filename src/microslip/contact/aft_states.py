"""Derivatives of the contact laws over a cycle whose contact states are known, planar pairs.

Those of `aft.py` depend on states alone. Where contact was solved in another way than there
(`driven.py`), these are what its linearised equations need.
"""

from __future__ import annotations

import numpy as np

from microslip.contact.aft import ContactCycle
from microslip.contact.aft_normal import CHANGING, LINEAR, OPEN, normal_derivative
from microslip.contact.aft_planar import friction_derivative, steps_since_slip
from microslip.contact.compiled import jit
from microslip.contact.pairs import SEPARATED, STICK
from microslip.contact.samples import SampleTable, analyse
from microslip.errors import ContactError
from microslip.typing import Array, Status


def cycle_of_states(table: SampleTable, r: Array, status: Status, friction: Array) -> ContactCycle:
    """Reactions with the derivatives that their contact states have.

    Parameters
    ----------
    table : SampleTable
    r : (m, d, c) array
        Coefficients of the reactions.
    status : (m, N) int8 array
        Contact states at the samples of the table.
    friction : (m,) array

    Raises
    ------
    ContactError
        Of spatial pairs, whose derivative depends on more than states.
    """
    m, d, c = r.shape
    if d != 2:
        raise ContactError("derivatives of spatial contact are not known from its states")
    out = ContactCycle(
        r=r,
        nn=np.zeros((m, c, c)),
        tn=np.zeros((m, 1, c, c)),
        tt=np.zeros((m, 1, 1, c, c)),
        td=np.zeros((m, 1, 1, c)),
        kind=np.empty((m, 2), np.int8),
        status=np.ascontiguousarray(status),
    )
    _all_pairs(table, friction, out)
    return out


@jit
def _all_pairs(table, mu, cycle):
    """Derivatives of every pair into `cycle`."""
    sums = table.sums
    N, c = table.basis.shape[1], cycle.r.shape[2]
    transposed = np.ascontiguousarray(table.basis.T)
    since = np.empty(N)
    for i in range(mu.shape[0]):
        state = cycle.status[i]
        closed, stuck = 0, 0
        for k in range(N):
            closed += state[k] != SEPARATED
            stuck += state[k] == STICK
        cycle.kind[i, 0] = LINEAR if closed == N else (OPEN if closed == 0 else CHANGING)
        normal_derivative(sums, cycle.nn[i], state, closed)
        if closed == 0 or mu[i] == 0.0:
            cycle.kind[i, 1] = OPEN
        elif stuck == N:
            cycle.kind[i, 1] = LINEAR
            for j in range(c):
                cycle.tt[i, 0, 0, j, j] = 1.0
        else:
            cycle.kind[i, 1] = CHANGING
            anchor = 0
            while state[anchor] == STICK:
                anchor += 1
            friction_derivative(
                transposed, sums, mu[i], state, anchor, cycle.tn[i, 0], cycle.tt[i, 0, 0]
            )
            steps_since_slip(state, anchor, since)
            analyse(table.projection, since, cycle.td[i, 0, 0])

"""A joint with fewer contact pairs: those that stay stuck are bonded, those that stay open left out.

What a step of load or time costs goes with the square of the number of pairs, and most pairs of a large
interface never change: near bolts they stick, far from them they are open. One cycle at the largest load, of
all pairs, says which. An answer of the others alone is that of all pairs as long as those left out keep the
law, which `Condensed.check` finds out: their reactions and gaps follow from the answer,

    [ W_bb  -R_b ] [r_b]   [ v_free,b - o - W_bk r_k ]
    [ R_b^T  K_q ] [ q ] = [ f_q - R_k^T r_k         ],      v_o = v_free,o + R_o q - W_ob r_b - W_ok r_k

and must stay within the cone of friction, and apart.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import scipy.linalg as sl

from microslip.analyses.prepared.bonding import BOND, bonded_model
from microslip.analyses.prepared.joint import PreparedJoint, prepare_joint, with_principal_mode
from microslip.analyses.statics.cycle import Cycle
from microslip.brief import Brief
from microslip.contact.law import contact_law
from microslip.contact.pairs import by_pair, components, normal
from microslip.errors import ContactError
from microslip.typing import Array, Indices

SURE = 0.8
"""Share of friction that a pair may use at most to count as one that stays stuck."""

STILL = 1e-9
"""Of the largest displacement: a pair that moves less has not moved."""


@dataclass(frozen=True, repr=False)
class Condensed(Brief):
    """A joint of the pairs that change, and what is needed to answer for the others.

    Attributes
    ----------
    joint : PreparedJoint
        Of the pairs in `kept`, for any analysis. Its modes are those of the bonded joint.
    whole : PreparedJoint
        Of all pairs.
    kept, bonded, open : int arrays
        Pairs that change, that stay stuck and that stay open.
    """

    joint: PreparedJoint
    whole: PreparedJoint
    kept: Indices
    bonded: Indices
    open: Indices

    def left_out(self, cycle: Cycle) -> tuple[Array, Array]:
        """Reactions of the bonded pairs and relative displacements of the open ones, ``(s + 1, d b)`` and
        ``(s + 1, d o)``, of a quasi-static cycle of the kept ones."""
        whole, f = self.whole, self.whole.flexibility
        d = whole.model.dimension
        k, b, o = (components(pairs, d) for pairs in (self.kept, self.bonded, self.open))
        path = np.tile(whole.held, (len(cycle.load), 1))
        path[:, whole.model.port(cycle.port)] += cycle.load
        apart = path @ f.loads_v[b].T - whole.prestress.solution.v[b] - cycle.r @ f.W[np.ix_(k, b)]
        balance = path @ f.loads_q.T - cycle.r @ f.R[k]
        system = np.block([[f.W[np.ix_(b, b)], -f.R[b]], [f.R[b].T, np.diag(f.stiffness)]])
        found = sl.solve(system, np.hstack([apart, balance]).T).T
        r, q = found[:, : len(b)], found[:, len(b) :]
        v = (
            path @ f.loads_v[o].T
            + q @ f.R[o].T
            - r @ f.W[np.ix_(b, o)]
            - cycle.r @ f.W[np.ix_(k, o)]
        )
        return r, v

    def check(self, cycle: Cycle) -> float:
        """How much of its friction the worst bonded pair uses, at most 1.

        Raises
        ------
        ContactError
            Where a bonded pair would slip or open, or an open one close, in a cycle of the kept ones: then
            its answer is not that of all pairs.
        """
        r, v = self.left_out(cycle)
        d = self.whole.model.dimension
        if len(self.open):
            reach = normal(v, d).max(axis=0)
            if reach.max() > 0:
                raise _beyond(self.open[int(reach.argmax())], "would close", cycle)
        if not len(self.bonded):
            return 0.0
        pull = np.linalg.norm(by_pair(r, d)[..., 1:], axis=-1)
        push = normal(r, d)
        if push.min() <= 0:
            raise _beyond(self.bonded[int(push.min(axis=0).argmin())], "would open", cycle)
        holds = self.whole.law.friction[self.bonded] * push
        used = np.divide(pull, holds, out=np.where(pull > 0, np.inf, 0.0), where=holds > 0)
        worst = used.max(axis=0)
        if worst.max() > 1:
            raise _beyond(self.bonded[int(worst.argmax())], "would slip", cycle)
        return float(worst.max())


def _beyond(pair: int, what: str, cycle: Cycle) -> ContactError:
    return ContactError(
        f"pair {pair} was left out and {what} at {cycle.amplitude:.4g} on {cycle.port!r}: condense for a "
        "larger load, or with a smaller share of friction"
    )


def condensed(joint: PreparedJoint, cycle: Cycle, share: float = SURE) -> Condensed:
    """The joint without the pairs that stay stuck or open over a cycle.

    Parameters
    ----------
    joint : PreparedJoint
    cycle : Cycle
        Of all its pairs, at the largest load that is asked for; few steps are enough.
    share : float
        Of friction that a pair may use to be bonded, below 1.

    Raises
    ------
    ContactError
        Where no pair changes.

    Notes
    -----
    Pairs are bonded where they stand at prestress, so they must have stuck from the first loading on: one
    that uses less than `share` of its friction at the end of a cycle has, but for loads that push it harder
    later. `Condensed.check` judges answers, at other loads too.
    """
    d, start = joint.model.dimension, joint.prestress.solution
    pull = np.linalg.norm(by_pair(cycle.r, d)[..., 1:], axis=-1).max(axis=0)
    push = normal(cycle.r, d).min(axis=0)
    moved = by_pair(cycle.v - start.v, d)
    still = np.abs(moved[..., 1:]).max(axis=(0, -1)) <= STILL * np.abs(moved).max()
    bonded = still & (pull < share * joint.law.friction * push) & (push > 0)
    apart = -normal(cycle.v, d).max(axis=0) > STILL * np.abs(cycle.v).max()
    is_open = apart & ~by_pair(cycle.r, d).any(axis=(0, -1)) & ~joint.prestress.touching
    kept, stuck = np.flatnonzero(~(bonded | is_open)), np.flatnonzero(bonded)
    if not len(kept):
        raise ContactError("no pair slips or opens in this cycle: there is nothing to condense for")
    b = components(stuck, d)
    model = bonded_model(joint.model, kept, stuck, start.v[b], joint.law.compliance)
    k = components(kept, d)
    law = contact_law(len(kept), joint.law.friction[kept], joint.law.compliance[k], d)
    held = {**joint.prestress.preload, BOND: 1.0}
    prepared = prepare_joint(model, law, held, joint.drive)
    return Condensed(with_principal_mode(prepared), joint, kept, stuck, np.flatnonzero(is_open))

"""How large a load is large for a joint: what ranges of amplitudes are given over."""

from __future__ import annotations

import numpy as np

from microslip.analyses.prepared.joint import PreparedJoint
from microslip.analyses.prepared.prestress import opening_load, slides_from
from microslip.errors import ContactError
from microslip.typing import Array


def load_scale(joint: PreparedJoint, port: str) -> float:
    """Amplitude of a port that opens the joint or slides bodies away that friction alone holds, whichever is
    less; where none does, that the contact feels as the preload.

    No amplitude opens a joint whose bodies the load cannot move as rigid ones: their ends are held, or
    bolts keep their length. There it is the amplitude under which, with all touching pairs bonded, the
    largest change of a reaction is the largest reaction of the preload,

        W_bb r - R_b q = v_free_b,   R_b^T r + K q = q_free,   a = max r_0 / max |r|.

    Parameters
    ----------
    joint : PreparedJoint
    port : str

    Returns
    -------
    float
        In the unit of the port, > 0; infinite where the interface does not feel the load.

    Raises
    ------
    ContactError
        Where limit analysis fails, or the flexibility of the bonded pairs is singular.

    Examples
    --------
    >>> import microslip
    >>> joint = microslip.prepare(microslip.reference_joint(pairs=21))
    >>> load_scale(joint, "moment") == microslip.opening_load(joint)
    True
    """
    limit = min(
        bound(joint.model, joint.prestress, port, joint.law.friction)
        for bound in (opening_load, slides_from)
    )
    if np.isfinite(limit):
        return limit
    felt = float(np.abs(_change_of_reactions(joint, port)).max(initial=0.0))
    return joint.prestress.largest_reaction / felt if felt > 0 else float("inf")


def _change_of_reactions(joint: PreparedJoint, port: str) -> Array:
    """Reactions of bonded pairs to a unit load."""
    f, column = joint.flexibility, joint.model.port(port)
    bonded = joint.prestress.bonded(joint.model.dimension)
    W, R = f.W[np.ix_(bonded, bonded)], f.R[bonded]
    try:
        give = np.linalg.solve(W, np.column_stack([f.loads_v[bonded, column], R]))
        r, held = give[:, 0], give[:, 1:]
        if not R.shape[1]:
            return r
        q = np.linalg.solve(np.diag(f.stiffness) + R.T @ held, f.loads_q[:, column] - R.T @ r)
    except np.linalg.LinAlgError:
        raise ContactError(
            f"how the interface feels the port {port!r} is not known: its flexibility with all touching "
            "pairs bonded is singular; make the contact elastic, or keep more modes"
        ) from None
    return np.asarray(r + held @ q)

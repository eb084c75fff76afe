"""A joint model with some pairs bonded and some left out: the same joint with fewer contact pairs.

With the pairs b held where they are, ``v_b = o``, their reactions follow from all else,

    r_b = S (psi_b eta + V_b a - W_bk r_k - o),     S = W_bb^-1,

and what is left has the form of a joint model again, exactly: flexibility ``W_kk - W_kb S W_bk``, stiffness
``Omega² + psi_b^T S psi_b`` of the modes, which is diagonal in other coordinates, and o as one more port.
Pairs that are open have no reactions; their rows are left out.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import scipy.linalg as sl

from microslip.contact.pairs import components
from microslip.model.joint import JointModel, soft_modes
from microslip.typing import Array, Indices

BOND = "bond"
"""Port of the relative displacements at which pairs are bonded."""


def bonded_model(
    model: JointModel, kept: Indices, bonded: Indices, offset: Array, compliance: Array
) -> JointModel:
    """The model of the kept pairs alone, with the bonded ones held at an offset.

    Parameters
    ----------
    model : JointModel
    kept, bonded : int arrays
        Pairs; those in neither have no reactions.
    offset : (d b,) array
        Relative displacement of the bonded pairs, m, at amplitude 1 of the port `BOND`.
    compliance : (d m,) array
        Of the contact at all pairs, m/N: a bond is behind it.

    Returns
    -------
    JointModel
        With the port `BOND` after its own. Its free-interface modes are those of the bonded joint. Of the
        rigid motions of its bodies nothing is known.
    """
    k, b = components(kept, model.dimension), components(bonded, model.dimension)
    bond = sl.cho_factor(model.residual[np.ix_(b, b)] + np.diag(compliance[b]))
    psi, V = model.mode_v[b], np.column_stack([model.port_v[b], -offset])
    across = model.residual[np.ix_(k, b)]
    of_modes, of_ports = sl.cho_solve(bond, psi), sl.cho_solve(bond, V)
    omega, shapes = np.linalg.eigh(np.diag(model.omega**2) + _even(psi.T @ of_modes))
    omega = np.sqrt(np.maximum(omega, 0.0))
    mode_v = (model.mode_v[k] - across @ of_modes) @ shapes
    residual = _even(model.residual[np.ix_(k, k)] - across @ sl.cho_solve(bond, across.T))
    loads = np.column_stack([model.port_modes, np.zeros(len(model.omega))])
    own = np.pad(model.port_port, ((0, 1), (0, 1)))
    return replace(
        model,
        position=model.position[kept],
        area=model.area[kept],
        omega=omega,
        equilibrium_modes=soft_modes(omega, mode_v, float(np.mean(np.diag(residual)))),
        mode_v=mode_v,
        residual=residual,
        ports=(*model.ports, BOND),
        port_modes=shapes.T @ (loads - psi.T @ of_ports),
        port_v=np.column_stack([model.port_v[k], np.zeros(len(k))]) - across @ of_ports,
        port_port=_even(own - V.T @ of_ports),
        image=None,
        bodies=None,
        supports=None if model.supports is None else shapes.T @ model.supports @ shapes,
        damping=None if model.damping is None else model.damping_beyond(shapes),
    )


def _even(matrix: Array) -> Array:
    """The symmetric part, which is all but rounding."""
    return np.asarray(0.5 * (matrix + matrix.T))

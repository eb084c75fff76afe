"""Flexibility operators W of ``v = v_free + R q - W r``: static, and with contact compliance."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from microslip.model import JointModel

Array = NDArray[np.float64]


@dataclass(frozen=True)
class Flexibility:
    """The linear side of a contact problem.

    With port amplitudes ``a``:  ``v = loads_v a + R q - W r``,  ``k_q q + R^T r = loads_q^T a``,
    outputs ``y = loads_loads a + loads_q^T q - loads_v^T r``.

    Attributes
    ----------
    W : (d m, d m) array
        Flexibility at the pairs.
    R : (d m, e) array
        Relative displacement of the coordinates solved for in equilibrium.
    stiffness : (e,) array
        Their own stiffness k_q.
    loads_v : (d m, p) array
    loads_q : (e, p) array
    loads_loads : (p, p) array
    """

    W: Array
    R: Array
    stiffness: Array
    loads_v: Array
    loads_q: Array
    loads_loads: Array


def static_flexibility(model: JointModel) -> Flexibility:
    """Static flexibility; the nearly rigid modes stay unknowns of equilibrium."""
    rigid = model.equilibrium_modes
    v, g = model.mode_v[:, rigid:], model.port_modes[rigid:]
    soft = 1 / model.omega[rigid:] ** 2
    W = model.residual + (v * soft) @ v.T
    return Flexibility(
        W=np.ascontiguousarray(0.5 * (W + W.T)),
        R=np.ascontiguousarray(model.mode_v[:, :rigid]),
        stiffness=model.omega[:rigid] ** 2,
        loads_v=model.port_v + (v * soft) @ g,
        loads_q=np.ascontiguousarray(model.port_modes[:rigid]),
        loads_loads=model.port_port + (g.T * soft) @ g,
    )


def with_compliance(flexibility: Flexibility, compliance: Array) -> Flexibility:
    """Add a contact compliance (m/N per component, ``1 / (k area)``) to the diagonal of W.

    A penalty contact is the exact contact behind a spring: a Jenkins element is a rigid Coulomb
    slider in series with ``k_t``.
    """
    return replace(flexibility, W=flexibility.W + np.diag(compliance))

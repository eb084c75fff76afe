"""Den Hartog's oscillator: a mass on a spring and a Coulomb slider, made by hand.

    m x'' + k x + F sgn(x') = P0 cos(omega t)

One mode ``phi = 1/sqrt(m)`` and one contact pair whose normal direction is a unit flexibility of its
own, pressed with ``N = F/mu``; tangentially it has no residual flexibility. Port ``force`` drives and
reads the mass: its output is x.
"""

from __future__ import annotations

import numpy as np

from microslip.analyses.prepared.joint import PreparedJoint, prepare_joint
from microslip.contact.law import contact_law
from microslip.model.joint import JointModel

MASS, STIFFNESS, MU = 2.5, 4e4, 0.3
OMEGA = np.sqrt(STIFFNESS / MASS)
P0 = 100.0


def oscillator(friction_force: float, spring: float = np.inf) -> PreparedJoint:
    """Driven by a force on the mass; the slider behind a spring (N/m) where one is given."""
    phi = 1 / np.sqrt(MASS)
    model = JointModel(
        position=np.zeros(1),
        area=np.ones(1),
        dimension=2,
        omega=np.array([OMEGA]),
        equilibrium_modes=0,
        mode_v=np.array([[0.0], [phi]]),
        residual=np.diag([1.0, 0.0]),
        ports=("clamp", "force", "sliding"),
        port_modes=np.array([[0.0, phi, 1.0]]),
        port_v=np.array([[1.0, 0.0, 0.0], [0.0, 0.0, 0.0]]),
        port_port=np.zeros((3, 3)),
        rayleigh=(0.0, 0.0),
    )
    law = contact_law(1, MU, np.array([0.0, 1 / spring]))
    return prepare_joint(model, law, {"clamp": friction_force / MU}, "force")

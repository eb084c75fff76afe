"""The modes of a joint by number: each sliding mode with the stuck mode that it becomes.

Both are modes of the joint model with the pairs that touch at prestress bonded, in the normal
direction or in all of them: ``r = W_bb^-1 Psi_b eta`` adds the stiffness ``Psi_b^T W_bb^-1 Psi_b``.
Modes that only move the bodies on their supports do not count. Partners are those with the largest
modal assurance, ``(Phi_sl^T M Phi_st)²``.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from microslip.analyses.statics.cycle import Prestress
from microslip.errors import ModelError
from microslip.model.joint import JointModel
from microslip.typing import Array

ON_SUPPORTS = 0.5
"""Share of the strain energy in the supports beyond which a mode does not deform the joint."""


@dataclass(frozen=True)
class JointMode:
    """A sliding mode and its stuck partner.

    Attributes
    ----------
    number : int
        From 1, in the order of the sliding frequencies.
    omega, stuck_omega : float
        rad/s; the stuck joint may be the softer one, where bonding adds the mass of a body that
        slid before.
    shape, stuck_shape : (k,) arrays
        In the free-interface modes, mass-normalised.
    assurance : float
        ``(Phi_sl^T M Phi_st)²``.
    """

    number: int
    omega: float
    shape: Array
    stuck_omega: float
    stuck_shape: Array
    assurance: float

    @property
    def frequency(self) -> float:
        """Of the sliding state, Hz."""
        return self.omega / (2 * np.pi)

    @property
    def stuck_frequency(self) -> float:
        """Hz."""
        return self.stuck_omega / (2 * np.pi)

    @property
    def stiffening(self) -> float:
        """``(omega_st/omega_sl)² - 1``: how much of the mode the interface can change."""
        return (self.stuck_omega / self.omega) ** 2 - 1


def bonded_modes(
    model: JointModel, bonded: NDArray[np.int64], compliance: Array | None = None
) -> tuple[Array, Array]:
    """Circular frequencies, ascending, and shapes in the free-interface modes.

    Parameters
    ----------
    model : JointModel
    bonded : (b,) int array
        Components of v.
    compliance : (d m,) array, optional
        Of an elastic contact, m/N: the bond is behind it.
    """
    psi, W = model.mode_v[bonded], model.residual[np.ix_(bonded, bonded)]
    if compliance is not None:
        W = W + np.diag(compliance[bonded])
    bond = psi.T @ np.linalg.solve(W, psi)
    values, shapes = np.linalg.eigh(np.diag(model.omega**2) + 0.5 * (bond + bond.T))
    return np.sqrt(np.maximum(values, 0.0)), shapes


def joint_modes(
    model: JointModel, start: Prestress, compliance: Array | None = None
) -> tuple[JointMode, ...]:
    """All modes that deform the joint, in the order of their sliding frequencies."""
    omega, shapes = bonded_modes(model, start.bonded(1), compliance)
    stuck_omega, stuck = bonded_modes(model, start.bonded(model.dimension), compliance)
    rigid = slice(0, model.equilibrium_modes)
    held = model.omega[rigid] ** 2 @ shapes[rigid] ** 2
    deforming = np.flatnonzero(held <= ON_SUPPORTS * omega**2)
    assurance = (shapes.T @ stuck) ** 2
    found = []
    for number, k in enumerate(deforming, 1):
        partner = int(np.argmax(assurance[k]))
        found.append(
            JointMode(
                number=number,
                omega=float(omega[k]),
                shape=shapes[:, k],
                stuck_omega=float(stuck_omega[partner]),
                stuck_shape=stuck[:, partner],
                assurance=float(assurance[k, partner]),
            )
        )
    return tuple(found)


def pick_mode(modes: tuple[JointMode, ...], number: int) -> JointMode:
    """The mode of a number.

    Raises
    ------
    ModelError
        Where there is none: names how many there are.
    """
    if not 1 <= number <= len(modes):
        raise ModelError(
            f"there is no mode {number}: this joint model has {len(modes)} modes that deform it, "
            f"1 to {len(modes)} ({modes[0].frequency:.4g} to {modes[-1].frequency:.4g} Hz); keep "
            "more free-interface modes for more"
        )
    return modes[number - 1]


MODE_PORT = "joint mode"
"""Port of the mode under study: the inertia load ``M Phi`` and the coordinate ``Phi^T M x``."""


def with_mode_port(model: JointModel, mode: JointMode) -> JointModel:
    """The model with one more port, `MODE_PORT`.

    The shape is a mode of the joint model itself, so nothing of it is in the residual flexibility.
    """
    return replace(
        model,
        ports=(*model.ports, MODE_PORT),
        port_modes=np.column_stack([model.port_modes, mode.shape]),
        port_v=np.column_stack([model.port_v, np.zeros(len(model.port_v))]),
        port_port=np.pad(model.port_port, ((0, 1), (0, 1))),
    )

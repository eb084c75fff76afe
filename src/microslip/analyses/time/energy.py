"""Energies of a joint in motion, per metre of width.

With ``E`` the kinetic and strain energy less the potential of the preload,

    E(t) - E(0) = external - friction - modal damping - residual damping - normal - scheme

where ``normal`` is the work of the normal reactions (zero for exact contact in continuous time) and
``scheme`` what the time integration itself takes: both are errors of the step, never gains.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from microslip.analyses.time.coupled import kinetic_energy
from microslip.analyses.time.scheme import State, TimeScheme
from microslip.brief import Brief
from microslip.typing import Array


@dataclass(frozen=True, repr=False)
class Energies(Brief):
    """Energies at the ends of the blocks, J per metre of width; all zero at t = 0.

    Attributes
    ----------
    time : (b,) array
        s.
    external, friction, modal_damping, residual_damping, normal : (b,) arrays
        Work of the load and what was lost.
    mechanical : (b,) array
        Change of kinetic and strain energy, the potential of the preload included.
    """

    time: Array
    external: Array
    friction: Array
    modal_damping: Array
    residual_damping: Array
    normal: Array
    mechanical: Array

    @property
    def scheme(self) -> Array:
        """What the time integration itself took: the rest of the balance."""
        lost = self.friction + self.modal_damping + self.residual_damping + self.normal
        return self.external - lost - self.mechanical


def mechanical_energy(scheme: TimeScheme, state: State, load: float) -> float:
    """Kinetic and strain energy less the potential of the preload, J per metre of width."""
    model, a = scheme.joint.model, port_amplitudes(scheme, load)
    modes = kinetic_energy(scheme.kernel, state.rate)
    modes += 0.5 * np.sum((model.omega * state.eta) ** 2)
    potential = 0.0
    for name, amplitude in scheme.joint.prestress.preload.items():
        port = model.port(name)
        displaced = (
            model.port_modes[:, port] @ state.eta
            + model.port_port[port] @ a
            - model.port_v[:, port] @ state.r
        )
        potential += amplitude * displaced
    return float(modes + residual_energy(scheme, state, load) - potential)


def residual_energy(scheme: TimeScheme, state: State, load: float) -> float:
    """Strain energy of the massless residual part and of the springs of an elastic contact.

    Half the product of the forces on it, ports ``a`` and reactions ``-r``, and their displacements
    ``Y_res a - V_res^T r`` and ``s``; the share of its own damping in the forces is left out of
    the energy only to first order in ``tau / dt``.
    """
    model, a = scheme.joint.model, port_amplitudes(scheme, load)
    y = model.port_port @ a - model.port_v.T @ state.r
    return float(0.5 * (a @ y - state.r @ state.residual_v))


def reaction_energy(scheme: TimeScheme, state: State, load: float) -> float:
    """Strain energy of the residual part under the reactions alone, ``r^T W_res r / 2``.

    From its displacement, as in `residual_energy`.
    """
    follows = scheme.joint.model.port_v @ port_amplitudes(scheme, load)
    return float(0.5 * state.r @ (follows - state.residual_v))


def port_amplitudes(scheme: TimeScheme, load: float) -> Array:
    """(p,) amplitudes of all ports: the preload, and the load on the driven port."""
    a = scheme.joint.held
    a[scheme.joint.model.port(scheme.port)] += load
    return a

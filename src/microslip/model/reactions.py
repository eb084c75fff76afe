"""Reactions of supports, as outputs of a joint model.

With e a unit motion of held degrees of freedom, and of what ties make follow it, supports hold with

    R = e^T (K u + C u' + M u'' - f + B^T r),

f the loads, r the contact reactions, ``C = alpha M + beta K``. Of the displacements ``u = T x`` that are free

    s = T^T K e,   m = T^T M e,

and in the free-interface modes Phi, which alone have inertia and damping, the equation of motion

    eta'' = g^T a - psi^T r - (alpha + beta omega²) eta' - omega² eta

takes the place of the acceleration:

    R = rho^T (eta + beta eta') + (p + g (Phi^T m) - e^T f) a - (v + psi (Phi^T m) - B e)^T r,
    rho_i = phi_i^T (s - omega_i² m),

p and v the residual flexibilities of the load vector s. But for the damping this is an output as others
are, and holds in statics and in motion. Of inertia loads M phi of kept modes ``g (Phi^T m) - e^T f`` is
nothing, so that modal ports need nothing.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace

import numpy as np
import scipy.sparse as sp

from microslip.brief import Brief
from microslip.model.interface import Interface
from microslip.model.joint import JointModel
from microslip.model.structure import Reaction, Structure
from microslip.typing import Array, Indices

RATE = " rate"
"""Ends the name of the port of ``beta rho^T eta``, whose derivative belongs to the reaction."""


@dataclass(frozen=True, repr=False)
class FreeStructure(Brief):
    """A structure before what supports hold is taken out of it, N degrees of freedom.

    Attributes
    ----------
    stiffness, mass : (N, N) sparse
        The stiffness with that of the springs to the ground.
    supports : (N, N) sparse
        The part that these springs add.
    interface : Interface
    loads : mapping of str to (N,) array
    fixed : int array
        Degrees of freedom that are held.
    """

    stiffness: sp.csc_matrix
    mass: sp.csc_matrix
    supports: sp.csc_matrix
    interface: Interface
    loads: Mapping[str, Array]
    fixed: Indices


def with_held(
    structure: Structure, whole: FreeStructure, motions: Mapping[str, Array]
) -> Structure:
    """The structure with what its supports and the springs to the ground hold with, as outputs.

    Springs S hold with ``-e^T S u`` where they move; of what is held it is the reaction, so that

        s = K_fh e_h - S_ff e_f,   m = M_fh e_h.

    Parameters
    ----------
    structure : Structure
        What is left free, f, of `whole`.
    whole : FreeStructure
    motions : mapping of str to (N,) array
        Unit motions e of what is held, by the name of the port.
    """
    free, loads, reactions = structure.free, dict(structure.loads), {}
    for name, motion in motions.items():
        held = np.zeros(len(motion))
        held[whole.fixed] = motion[whole.fixed]
        springs = whole.supports @ (motion - held)
        loads[name] = (whole.stiffness @ held - springs)[free]
        reactions[name] = Reaction(
            mass=(whole.mass @ held)[free],
            pairs=whole.interface.relative @ held,
            loads={load: float(held @ vector) for load, vector in whole.loads.items()},
        )
    return replace(structure, loads=loads, reactions={**structure.reactions, **reactions})


def with_reactions(model: JointModel, structure: Structure, shapes: Array) -> JointModel:
    """The model with the outputs of `Structure.reactions`, whose load vectors s are its ports, as reactions.

    Parameters
    ----------
    model : JointModel
        Of the loads of the structure.
    structure : Structure
    shapes : (n, k) array
        Kept free-interface modes, mass-normalised.
    """
    if not structure.reactions:
        return model
    modes, v, direct = model.port_modes.copy(), model.port_v.copy(), model.port_port.copy()
    others = [k for k, name in enumerate(model.ports) if name not in structure.reactions]
    for name, reaction in structure.reactions.items():
        k, m = model.port(name), shapes.T @ reaction.mass
        modes[:, k] -= model.omega**2 * m
        v[:, k] += model.mode_v @ m - reaction.pairs
        at_once = np.array([reaction.loads.get(model.ports[p], 0.0) for p in others])
        added = m @ model.port_modes[:, others] - at_once
        direct[k, others] += added
        direct[others, k] += added
    return replace(model, port_modes=modes, port_v=v, port_port=direct)


def with_inertia_loads(
    model: JointModel, structure: Structure, shapes: Array, motions: Mapping[str, Array]
) -> JointModel:
    """The model with what inertia loads ``M phi`` that are ports of it do on held degrees of freedom.

    Parameters
    ----------
    model : JointModel
    structure : Structure
    shapes : (n, k) array
        Kept free-interface modes.
    motions : mapping of str to (n,) array
        phi by the name of its port.
    """
    if not structure.reactions:
        return model
    direct = model.port_port.copy()
    for name, reaction in structure.reactions.items():
        k, m = model.port(name), shapes.T @ reaction.mass
        for port, motion in motions.items():
            p = model.port(port)
            added = m @ model.port_modes[:, p] - reaction.mass @ motion
            direct[k, p] += added
            direct[p, k] += added
    return replace(model, port_port=direct)


def with_rates(model: JointModel, structure: Structure) -> JointModel:
    """The model with a port ``beta rho^T eta`` beside every reaction, where stiffness is damped."""
    beta = model.rayleigh[1]
    if not structure.reactions or not beta:
        return model
    return model.with_modal_ports(
        {name + RATE: beta * model.port_modes[:, model.port(name)] for name in structure.reactions}
    )

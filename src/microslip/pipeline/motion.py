"""Displacements of the whole structure, at rest or vibrating: back from the joint model.

With the load vectors p of the ports, their amplitudes a and the reactions r,

    M u'' + C u' + K u = P a - B^T r,

of which the joint model keeps the modes Phi and a residual flexibility. Both together are all of it:

    u = Phi eta + K_res^-1 (P a - B^T r)

is the displacement that the analyses have, whatever they keep of it: ``B u`` and ``P^T u`` are their
relative displacements and outputs. At rest this is the equilibrium of the finite elements. In a periodic
motion eta and the lag of the residual part follow harmonic by harmonic
(`microslip.model.flexibility.harmonic_compliance`), and its mean is an equilibrium.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from microslip.analyses.statics.cycle import Cycle
from microslip.brief import Brief
from microslip.model.flexibility import Flexibility, amplitudes_under, harmonic_compliance
from microslip.pipeline.prepare import Assembly
from microslip.typing import Array, Complex, Indices

FAINT = 1e-3
"""Weight of the springs of a nearly rigid motion beside the pairs that see it."""


@dataclass(frozen=True, repr=False)
class PeriodicMotion(Brief):
    """What drives a structure through a periodic motion: ``Y_0 + sum Im(Y_h e^{i h theta})``.

    Attributes
    ----------
    frequency : float
        Hz.
    a : (H + 1, p) complex array
        Amplitudes of all ports of the joint model, the preload in the mean.
    r : (H + 1, d m) complex array
        Reactions, total.
    v : (d m,) array
        Mean of the relative displacements, m.
    """

    frequency: float
    a: Complex
    r: Complex
    v: Array


def static_motion(assembly: Assembly, a: Array, r: Array, v: Array) -> Array:
    """Displacements from the unloaded structure, (s, n), of s equilibria.

    Parameters
    ----------
    assembly : Assembly
    a : (s, p) array
        Amplitudes of all ports of the joint model.
    r, v : (s, d m) arrays
        Reactions and relative displacements.
    """
    return _structure(assembly, _modes_at_rest(assembly, a, r, v), a, r)


def periodic_motion(assembly: Assembly, motion: PeriodicMotion, theta: Array) -> Array:
    """Displacements from the unloaded structure, (s, n), at phases of a periodic motion.

    Parameters
    ----------
    assembly : Assembly
    motion : PeriodicMotion
        Its structure has the damping of the joint model.
    theta : (s,) array
        Phases of the load, rad.
    """
    a, r = motion.a, motion.r
    omega = 2 * np.pi * motion.frequency
    modal, lag = harmonic_compliance(assembly.model, omega, len(r) - 1)
    modal[0] = 0.0  # the mean, which may be infinite, is made anew
    eta = amplitudes_under(modal, _on_modes(assembly, a, r))
    eta[0] = _modes_at_rest(assembly, a[:1].real, r[:1].real, motion.v[None])[0]
    each = (_at_phases(Y, theta) for Y in (eta, lag[:, None] * a, lag[:, None] * r))
    return _structure(assembly, *each)


def _at_phases(Y: Complex, theta: Array) -> Array:
    """Values (s, n) of harmonics (H + 1, n) at phases."""
    turn = np.exp(1j * np.outer(theta, np.arange(1, len(Y))))
    return np.asarray(Y[0].real + (turn @ Y[1:]).imag)


def _loads(assembly: Assembly) -> tuple[list[int], Array]:
    """Ports that are loads on the structure, and their vectors (n, l)."""
    structure = assembly.structure
    vectors = {**structure.loads, **assembly.states.ports(structure)}
    known = [k for k, name in enumerate(assembly.model.ports) if name in vectors]
    return known, np.column_stack([vectors[assembly.model.ports[k]] for k in known])


def _on_modes(assembly: Assembly, a: Complex | Array, r: Complex | Array) -> Complex:
    """Forces on the modes, (s, k)."""
    known, _ = _loads(assembly)
    model = assembly.model
    return np.asarray(a[:, known] @ model.port_modes[:, known].T - r @ model.mode_v, dtype=complex)


def _modes_at_rest(assembly: Assembly, a: Array, r: Array, v: Array) -> Array:
    """Modal coordinates of equilibria, (s, k)."""
    rigid, omega = assembly.model.equilibrium_modes, assembly.model.omega
    eta = _on_modes(assembly, a, r).real
    eta[:, rigid:] /= omega[rigid:] ** 2
    eta[:, :rigid] = _nearly_rigid(assembly.prepared.flexibility, a, r, v).T
    return eta


def _structure(assembly: Assembly, eta: Array, a: Array, r: Array) -> Array:
    """Displacements (s, n) of the modes, and of what is not among them under loads and reactions."""
    known, vectors = _loads(assembly)
    reducer = assembly.reducer
    force = vectors @ a[:, known].T - assembly.structure.interface.relative.T @ r.T
    return np.asarray((reducer.modes.shapes @ eta.T + reducer.residual_response(force)).T)


def prestressed_shape(assembly: Assembly) -> Array:
    """(n,) displacements from the unloaded structure under the preload alone."""
    start, a = assembly.prestress.solution, assembly.prepared.held[None]
    eta = _modes_at_rest(assembly, a, start.r[None], start.v[None])
    # a preload that slides bodies is not in balance with the springs that keep their place
    eta[:, : len(start.q)] = start.q
    return np.asarray(_structure(assembly, eta, a, start.r[None])[0])


def motion_from_prestress(
    assembly: Assembly, cycle: Cycle, steps: Sequence[int] | Indices
) -> Array:
    """Displacements from prestress, (s, n), at steps of a quasi-static cycle."""
    at = np.asarray(steps)
    a = np.tile(assembly.prepared.held, (len(at), 1))
    a[:, assembly.model.port(cycle.port)] += cycle.load[at]
    x = static_motion(assembly, a, cycle.r[at], cycle.v[at])
    return np.asarray(x - prestressed_shape(assembly))


def _nearly_rigid(f: Flexibility, a: Array, r: Array, v: Array) -> Array:
    """(e, s) coordinates of the modes that statics takes as unknowns: what the pairs see of them, and where
    these see nothing, what their springs balance."""
    if not len(f.stiffness):
        return np.zeros((0, len(a)))
    seen = v - a @ f.loads_v.T + r @ f.W
    pushed = a @ f.loads_q.T - r @ f.R
    springs = f.stiffness > 0
    rest = np.divide(pushed, f.stiffness, out=np.zeros_like(pushed), where=springs)
    weight = FAINT * np.abs(f.R).max(initial=0.0) or 1.0
    both = np.vstack([f.R, weight * np.diag(springs.astype(float))])
    return np.asarray(np.linalg.lstsq(both, np.hstack([seen, weight * rest]).T, rcond=None)[0])

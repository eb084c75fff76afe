"""What a load moves besides the joint's own mode: all other modes of the sliding state.

In the sliding state, where the pairs that touch at prestress are bonded in the normal direction and free
to slide, the motion under a harmonic load is a sum over its modes. The one that reduced models keep
is theirs; the others, and the flexibility of everything truncated, follow the load at once:

    h(omega) = sum_{n != own} phi_n^T y phi_n^T p / (omega_n² - omega² + i omega c_n) + residual.

Where damping couples the modes, these are coupled among each other by it, and not with the joint's own.
"""

from __future__ import annotations

import numpy as np

from microslip.analyses.prepared.joint import PreparedJoint
from microslip.model.joint import bonded_modes
from microslip.typing import Array, Complex

RIGID = 1e-12
"""Square of a frequency over that of the median mode below which a mode has no stiffness at all:
loads on it are in equilibrium, and only rounding moves it."""


def direct_motion(joint: PreparedJoint, port: str, omega: Array, *, stuck: bool = False) -> Complex:
    """Outputs of all ports per unit load on one, without the part of the joint's mode.

    Parameters
    ----------
    joint : PreparedJoint
        With a mode.
    port : str
        Loaded port.
    omega : (n,) array
        Circular frequencies, rad/s; 0 for a static load.
    stuck : bool
        Of the stuck state, without its stuck mode.

    Returns
    -------
    (n, p) complex array
        First harmonics against the sine of the load.

    Examples
    --------
    The inertia load of the mode moves nothing else, up to what the reduction leaves out:

    >>> import microslip
    >>> joint = microslip.prepare(microslip.reference_joint(pairs=21))
    >>> lift = joint.model.port("lift")
    >>> own = joint.mode.load_on_sliding["lift"] / joint.mode.sliding_omega**2
    >>> bool(abs(direct_motion(joint, "sliding", np.zeros(1))[0, lift]) < 1e-6 * abs(own))
    True
    """
    mode, w = joint.principal(), np.asarray(omega, dtype=float)
    if stuck:
        return _modal_sum(joint, port, w, joint.model.dimension, without=mode.stuck_port)
    return _modal_sum(joint, port, w, 1, without=mode.port)


def mode_motion(joint: PreparedJoint) -> Array:
    """(p,) outputs of all ports per unit of the joint's mode in the sliding state.

    The coordinate has the sign of `JointMode.sliding`. Of a reaction it is what supports hold the vibrating
    mode with.
    """
    model, mode = joint.model, joint.principal()
    bonded = joint.prestress.bonded(1)
    _, shapes = bonded_modes(model, bonded)
    own = shapes.T @ model.port_modes[:, model.port(mode.port)]
    k = int(np.argmax(np.abs(own)))
    shape = shapes[:, k] * np.sign(own[k])
    W, psi = model.residual[np.ix_(bonded, bonded)], model.mode_v[bonded]
    reaction = np.linalg.solve(W, psi @ shape)
    return np.asarray(shape @ model.port_modes - reaction @ model.port_v[bonded])


def stuck_oscillator(joint: PreparedJoint) -> tuple[float, Array, Array]:
    """The joint's stuck mode as its joint model has it, behind the compliance of the contact.

    Parameters
    ----------
    joint : PreparedJoint
        With a mode.

    Returns
    -------
    omega : float
        rad/s.
    shape : (k,) array
        In the free-interface modes, of length one and the sign of `JointMode.stuck`.
    output : (p,) array
        Outputs of all ports per unit of it, which of loads are what works on it: ``phi^T p`` less what the
        bonds' reactions to the truncated modes do.

    Examples
    --------
    >>> import microslip
    >>> joint = microslip.prepare(microslip.reference_joint(pairs=21))
    >>> omega, shape, output = stuck_oscillator(joint)
    >>> bool(abs(omega / joint.mode.stuck_omega - 1) < 1e-5)
    True
    >>> load = joint.mode.load_on_stuck["moment"]
    >>> bool(abs(output[joint.model.port("moment")] / load - 1) < 1e-3)
    True
    """
    model, mode = joint.model, joint.principal()
    bonded, compliance = joint.prestress.bonded(model.dimension), joint.law.compliance
    omegas, shapes = bonded_modes(model, bonded, compliance)
    like = shapes.T @ mode.stuck
    k = int(np.argmax(np.abs(like)))
    shape = shapes[:, k] * np.sign(like[k])
    W = model.residual[np.ix_(bonded, bonded)] + np.diag(compliance[bonded])
    reaction = np.linalg.solve(W, model.mode_v[bonded] @ shape)
    return float(omegas[k]), shape, shape @ model.port_modes - reaction @ model.port_v[bonded]


def stuck_motion(joint: PreparedJoint, port: str) -> Array:
    """Static outputs of all ports per unit load on one, with the touching pairs bonded in all directions.

    Parameters
    ----------
    joint : PreparedJoint
    port : str
        Loaded port.

    Returns
    -------
    (p,) array
    """
    return _modal_sum(joint, port, np.zeros(1), joint.model.dimension)[0].real


def _modal_sum(
    joint: PreparedJoint, port: str, omega: Array, directions: int, without: str | None = None
) -> Complex:
    """Outputs of all ports per unit load on one, with so many directions of the touching pairs bonded.

    The mode that the port `without` drives most is left out.
    """
    model, bonded = joint.model, joint.prestress.bonded(directions)
    compliance = joint.law.compliance if directions == model.dimension else None
    omegas, shapes = bonded_modes(model, bonded, compliance)
    W = model.residual[np.ix_(bonded, bonded)]
    if compliance is not None:
        W = W + np.diag(compliance[bonded])
    psi, V = model.mode_v[bonded], model.port_v[bonded]
    held = np.linalg.solve(W, V)
    y = shapes.T @ (model.port_modes - psi.T @ held)
    residual = (model.port_port - V.T @ held)[:, model.port(port)]
    kept = omegas**2 > RIGID * model.usual_omega**2
    if without is not None:
        kept[np.argmax(np.abs(shapes.T @ model.port_modes[:, model.port(without)]))] = False
    alpha, beta = model.rayleigh
    w, wn = omega[:, None], omegas[kept]
    give = 1 / (wn**2 - w**2 + 1j * w * (alpha + beta * wn**2))
    push = y[kept, model.port(port)]
    moved = give * push
    if model.damping is not None:
        D, k = model.damping_beyond(shapes[:, kept]), np.arange(len(wn))
        for n, at in enumerate(omega):
            resisted = 1j * at * D
            resisted[k, k] += 1 / give[n]
            moved[n] = np.linalg.solve(resisted, push)
    return np.asarray(moved @ y[kept] + residual / (1 + 1j * w * beta), dtype=complex)

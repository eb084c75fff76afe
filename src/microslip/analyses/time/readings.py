"""What is read off a steady state: equivalent stiffness and damping, harmonics, whether it opens."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from microslip.analyses.prepared.joint import PreparedJoint
from microslip.analyses.time.scheme import March
from microslip.analyses.time.steady import SteadyState
from microslip.contact.pairs import normal, touches
from microslip.model.shape_damping import damping_of_shape
from microslip.numerics.fourier import harmonic
from microslip.typing import Array, Complex


@dataclass(frozen=True)
class Equivalent:
    """Contact force on the sliding mode as stiffness and damping, from a steady state.

    Attributes
    ----------
    k_eq, gamma_eq : float
        Divided by omega_sl².
    stored : float
        Energy stored by the contact, ``|Q|² k_eq omega_sl² / 2`` as in the tables, J per
        metre of width.
    loop : float
        ``pi |Q|² gamma_eq omega_sl²``: area of the loop of the force over the sliding coordinate.
    """

    k_eq: float
    gamma_eq: float
    stored: float
    loop: float


def phases(steady: SteadyState) -> Array:
    """Phase of the load at every sample of the cycle, rad."""
    steps = len(steady.cycle.time) - 1
    return np.asarray(steady.phase + 2 * np.pi * np.arange(steps + 1) / steps, dtype=float)


def equivalent(steady: SteadyState, joint: PreparedJoint) -> Equivalent:
    """Equivalent stiffness and damping of a steady state.

    Parameters
    ----------
    steady : SteadyState
    joint : PreparedJoint
    """
    return equivalent_of(steady.amplitude, steady.frequency, steady.load, joint)


def equivalent_of(Q: complex, frequency: float, load: float, joint: PreparedJoint) -> Equivalent:
    """Equivalent stiffness and damping from the first harmonic of the modal coordinate.

    The equation of motion of the modal coordinate, with the linear part of the sliding state,

        q'' + c q' + omega_sl² q + f = f_M M(t),     c = alpha + beta omega_sl² + d

    (d of the sliding mode, `microslip.model.shape_damping`; how it couples that to other modes is in f)
    defines the modal contact force ``f = Phi_sl^T F_c``. Its first harmonic is

        F_1 = f_M M - (omega_sl² - omega² + i omega c) Q_1
        k_eq + i gamma_eq = F_1 / (omega_sl² Q_1)

    Parameters
    ----------
    Q : complex
        Q_1, against the sine of the load.
    frequency, load : float
        Hz, and amplitude M of the driving load.
    joint : PreparedJoint
        With a mode.
    """
    mode = joint.principal()
    omega2 = mode.sliding_omega**2
    linear = _sliding_stiffness(2 * np.pi * frequency, joint)
    push = mode.load_on_sliding[joint.drive] * load
    kappa = (push - linear * Q) / (omega2 * Q)
    return Equivalent(
        k_eq=float(kappa.real),
        gamma_eq=float(kappa.imag),
        stored=float(0.5 * abs(Q) ** 2 * kappa.real * omega2),
        loop=float(np.pi * abs(Q) ** 2 * kappa.imag * omega2),
    )


def _sliding_stiffness(omega: float, joint: PreparedJoint) -> complex:
    """Dynamic stiffness of the modal coordinate without contact force."""
    alpha, beta = joint.model.rayleigh
    mode = joint.principal()
    omega2 = mode.sliding_omega**2
    own = alpha + beta * omega2 + damping_of_shape(joint.model, mode.sliding)
    return omega2 - omega**2 + 1j * omega * own


def modal_force(steady: SteadyState, joint: PreparedJoint, harmonics: int) -> Array:
    """Modal contact force f at every sample of the steady cycle, from harmonics of q.

    The equation of `equivalent` harmonic by harmonic; high harmonics of q carry the noise of single
    steps and are left out.

    Returns
    -------
    (s + 1,) array
        As q counted from prestress, mean included.
    """
    mode, theta = joint.principal(), phases(steady)
    q = steady.cycle.output[:, joint.model.port(mode.port)]
    Q = harmonics_of(q, theta, harmonics)
    push = mode.load_on_sliding[joint.drive]
    force = push * steady.load * np.sin(theta) - mode.sliding_omega**2 * Q[0].real
    for h in range(1, harmonics + 1):
        linear = _sliding_stiffness(2 * np.pi * steady.frequency * h, joint)
        force = force - np.imag(linear * Q[h] * np.exp(1j * h * theta))
    return np.asarray(force, dtype=float)


def harmonics_of(y: Array, theta: Array, count: int) -> Complex:
    """Mean (as a real number) and harmonics 1 to `count` of samples over one cycle.

    Parameters
    ----------
    y : (s + 1, ...) array
    theta : (s + 1,) array
        From `phases`.
    count : int

    Returns
    -------
    (count + 1, ...) complex array
        ``y = mean + sum_h Im(Y_h e^{i h theta})``.
    """
    mean = y[:-1].mean(axis=0).astype(complex)
    return np.stack([mean, *(harmonic(y, theta, h) for h in range(1, count + 1))])


def opening_of(part: March, position: Array, start: float = 0.0) -> str:
    """Where and when a joint opens, as a message; empty where some pair touches all the time.

    Parameters
    ----------
    part : March
        Histories kept.
    position : (m,) array
        Of the pairs, m.
    start : float
        Time at the first sample, s.
    """
    touching = touches(part.status)
    open_all = ~touching.any(axis=1)
    if not open_all.any():
        return ""
    i = int(np.argmax(open_all))
    when = f"the joint opens at t = {start + part.time[i]:.6g} s under load {part.load[i]:.4g}"
    advice = "lower the load or raise the clamp force"
    if i == 0:
        return f"{when}: no pair touches; {advice}"
    dimension = part.r.shape[1] // len(position)
    force = np.where(touching[i - 1], normal(part.r[i - 1], dimension), -np.inf)
    k = int(np.argmax(force))
    return (
        f"{when}: the last pair to separate is {k} at x = {position[k]:.4g} m, which carried "
        f"{force[k]:.4g} N/m one step before; {advice}"
    )

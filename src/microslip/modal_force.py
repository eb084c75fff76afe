"""Contact force on the sliding mode: of a steady vibration in time, and of friction alone.

In a quasi-static cycle the modal contact force follows from equilibrium (`microslip.backbone`). In
time the inertia has its share. Projected on the sliding mode, with harmonic ``h`` of the load's
phase,

    F_h = g A_h - (omega_sl² + c D_v(z) + D_a(z)) Q_h,   c = alpha + beta omega_sl²

where ``D_v`` and ``D_a`` are what the time steps make of velocity and acceleration,
``z = exp(2 pi i h / steps)``; as the step tends to zero they are ``i h omega`` and
``-(h omega)²``. Taking them as the scheme has them leaves no period error in ``F``.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from microslip.backbone import EquivalentTable, modal_quantities
from microslip.harmonics import harmonic
from microslip.interface import Interface
from microslip.model import JointModel
from microslip.states import LinearStates
from microslip.statics import Cycle
from microslip.steady import SteadyState
from microslip.transient import ALPHA, scheme_constants

Array = NDArray[np.float64]
Complex = NDArray[np.complex128]


def phases(steady: SteadyState) -> Array:
    """Phase of the load at every sample of the steady cycle, rad."""
    steps = len(steady.cycle.load) - 1
    return np.asarray(steady.phase + 2 * np.pi * np.arange(steps + 1) / steps)


def step_operators(angle: float, dt: float, alpha: float = ALPHA) -> tuple[complex, complex]:
    """Velocity and (weighted) acceleration per displacement, of a harmonic in the time scheme.

    Parameters
    ----------
    angle : float
        Phase that one step advances, rad.
    dt : float
        Step, s.
    alpha : float
        Numerical dissipation.

    Returns
    -------
    velocity, acceleration : complex
        ``D_v`` (1/s) and ``D_a`` (1/s²).

    Examples
    --------
    >>> velocity, acceleration = step_operators(1e-3, 1e-3, 0.0)
    >>> abs(velocity - 1j) < 1e-6, abs(acceleration + 1) < 1e-6
    (True, True)
    """
    gamma, beta, a1 = scheme_constants(alpha)
    z = np.exp(1j * angle)
    newmark = beta * z**2 + (0.5 - 2 * beta + gamma) * z + (0.5 + beta - gamma)
    acceleration = (z - 1) ** 2 / (dt**2 * newmark)
    velocity = dt * (gamma * z + 1 - gamma) / (z - 1) * acceleration
    return complex(velocity), complex(acceleration * z / (a1 * z + alpha))


def dynamic_modal_force(
    steady: SteadyState, model: JointModel, states: LinearStates, load: str, orders: Sequence[int]
) -> tuple[Complex, Complex]:
    """Harmonics of the sliding coordinate and of the contact force on it.

    Parameters
    ----------
    steady : SteadyState
    model : JointModel
    states : LinearStates
    load : str
        Driven port.
    orders : sequence of int
        Harmonics h >= 1.

    Returns
    -------
    Q, F : (h,) complex arrays
        Against the load's sine.
    """
    theta = phases(steady)
    steps = len(theta) - 1
    dt = 1 / (steady.frequency * steps)
    q = steady.cycle.output[:, model.port("sliding")]
    alpha, beta = model.rayleigh
    push = states.load_on_sliding[load]
    Q, F = [], []
    for h in orders:
        amplitude = complex(harmonic(q, theta, h))
        velocity, acceleration = step_operators(2 * np.pi * h / steps, dt)
        omega2 = states.sliding_omega**2
        linear = omega2 + (alpha + beta * omega2) * velocity + acceleration
        driven = push * complex(harmonic(steady.cycle.load, theta, h))
        Q.append(amplitude)
        F.append(driven - linear * amplitude)
    return np.array(Q), np.array(F)


def dynamic_equivalent(
    steady: SteadyState, model: JointModel, states: LinearStates, load: str = "moment"
) -> complex:
    """``k_eq + i gamma_eq`` of a steady vibration, over omega_sl²: what its contact force does."""
    Q, F = dynamic_modal_force(steady, model, states, load, (1,))
    return complex(F[0] / Q[0] / states.sliding_omega**2)


def friction_modal_force(r: Array, interface: Interface, states: LinearStates) -> Array:
    """Friction alone on the sliding mode, ``(B_t Phi_sl)^T r_t``, the change of pressure left out.

    Parameters
    ----------
    r : (..., d m) array
        Reactions.
    interface : Interface
    states : LinearStates
    """
    d = interface.dimension
    psi = interface.relative @ states.sliding
    tangential = np.arange(len(psi)) % d != 0
    return np.asarray(r[..., tangential] @ psi[tangential])


def friction_table(
    table: EquivalentTable,
    cycles: Sequence[Cycle],
    model: JointModel,
    interface: Interface,
    states: LinearStates,
) -> EquivalentTable:
    """The table with friction alone in place of the whole contact force, as the paper defines it.

    The cross part on the second coordinate is left out with the pressure.
    """
    omega2 = states.sliding_omega**2
    ordered = sorted(cycles, key=lambda cycle: abs(cycle.amplitude))
    ratio = []
    for cycle in ordered:
        q, _ = modal_quantities(cycle, model, states)
        f = friction_modal_force(cycle.r, interface, states)
        ratio.append(harmonic(f, cycle.theta) / harmonic(q, cycle.theta) / omega2)
    values = np.array(ratio)
    return replace(
        table,
        k_eq=values.real,
        gamma_eq=values.imag,
        cross=np.zeros(len(values), complex),
        stored=0.5 * values.real * omega2 * table.amplitude**2,
    )

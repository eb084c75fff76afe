"""Modes marched without error of their own: the step and the damping that give a mode its true poles.

A mode ``eta'' + c eta' + omega² eta = f`` has the poles ``lambda = -c/2 +- sqrt(c²/4 - omega²)``;
in a time dt its free motion is multiplied by ``exp(lambda dt)``. The trapezoidal rule (Newmark's
method of average acceleration) with a step h multiplies it by ``(1 + h mu/2)/(1 - h mu/2)``, mu
the poles of what it is given. Modes are coupled by their forces alone, so each is stepped by a
length h and with a damping c~ of its own for which both are the same,

    h mu / 2 = tanh(lambda dt / 2) = u_1, u_2:    (omega h)² = 4 u_1 u_2,   c~ h = -2 (u_1 + u_2)

without damping ``omega h / 2 = tan(omega dt / 2)``. Seen over dt this is a mode of frequency
``omega~ = omega h / dt`` whose forces and displacements are scaled by ``omega~ / omega``: what a
force does to it statically, and its energy, are what they were.

A force that varies with Omega meets ``omega² - O² + i O c~`` instead of ``omega² - Omega² + i Omega c``,
with ``O = (2/h) tan(Omega dt / 2)``. At the pole and at rest they agree; elsewhere all modes answer
too little by the same share ``(Omega dt)²/6``, to leading order. Where motion is periodic under a load of
known frequency both can be the same there: with h from the undamped frequency,

    g = (omega² - O²)/(omega² - Omega²),    c~ = g c Omega / O

and the change of forces from prestress multiplied by g, every linear steady state is exact (`driven_steps`).
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from microslip.typing import Array

REACH = 2 * np.pi / 3
"""Largest phase per step, rad, of a mode that is followed: three steps in a period. A faster one acts
statically: its h would grow without bound up to two steps in a period."""


class ModeSteps(NamedTuple):
    """How modes are stepped.

    Attributes
    ----------
    step, damping : (k,) arrays
        h (s) and c~ (1/s).
    gain : (k,) array
        g, what the change of forces from prestress is multiplied by.
    """

    step: Array
    damping: Array
    gain: Array


def matched_steps(omega: Array, damping: Array, dt: float) -> ModeSteps:
    """Step and damping of every mode that dt can follow, so that it has its true poles.

    Parameters
    ----------
    omega, damping : (k,) arrays
        Circular frequency (rad/s, ascending) and viscous damping (1/s) of the modes.
    dt : float
        Time over which the poles are met, s.

    Returns
    -------
    ModeSteps
        Of the first so many modes, those with three steps in a period or more.

    Examples
    --------
    The second mode is too fast; of the first ``2 h/2 = tan(2 dt/2)``.

    >>> found = matched_steps(np.array([2.0, 5.0]), np.zeros(2), 0.5)
    >>> bool(np.isclose(found.step, np.tan(0.5)).all())
    True
    """
    followed = within_reach(omega, dt)
    w, c = omega[:followed], damping[:followed]
    root = np.sqrt((0.25 * c**2 - w**2).astype(complex))
    u = np.tanh(0.5 * dt * np.array([-0.5 * c + root, -0.5 * c - root]))
    turn = 2 * np.sqrt(np.maximum((u[0] * u[1]).real, 0.0))
    step = np.divide(turn, w, out=np.full(followed, dt), where=w * dt > NEGLIGIBLE)
    return ModeSteps(step, -2 * (u[0] + u[1]).real / step, np.ones(followed))


def driven_steps(omega: Array, damping: Array, dt: float, frequency: float) -> ModeSteps:
    """Step, damping and gain with which modes answer a load of one frequency without error.

    Their poles are true but for terms of second order in damping and step together.

    Parameters
    ----------
    omega, damping : (k,) arrays
        As for `matched_steps`.
    dt, frequency : float
        s, Hz; at least three steps per cycle of the load.

    Examples
    --------
    >>> found = driven_steps(np.array([2.0]), np.zeros(1), 0.1, 0.4)
    >>> bool(np.isclose(found.gain[0], 1 + (2 * np.pi * 0.4 * 0.1) ** 2 / 6, rtol=1e-3))
    True
    """
    followed = within_reach(omega, dt)
    w, c, true = omega[:followed], damping[:followed], 2 * np.pi * frequency
    h = np.full(followed, dt)
    h = np.divide(2 * np.tan(0.5 * w * dt), w, out=h, where=w * dt > NEGLIGIBLE)
    seen = 2 / h * np.tan(0.5 * true * dt)
    # where both vanish, the quotient of their derivatives
    slope = seen / true * dt / h / np.cos(0.5 * true * dt) ** 2
    apart = np.abs(w / true - 1) > 1e-5
    gain = np.divide(w**2 - seen**2, w**2 - true**2, out=slope, where=apart)
    return ModeSteps(h, gain * c * true / seen, gain)


ALTERNATING = 0.1
"""Half the loss factor of the residual part for what varies with a quarter of the rate of the steps."""

FEWEST = 8
"""Steps per cycle of the load from which on its frequency is the one of no error."""


def lags(tau: float, dt: float, frequency: float = 0.0) -> Array:
    """Damping of a part without inertia, by its displacements of now, one and two steps before.

    In place of ``tau s'`` stands, with z the delay by a step and ``phi = Omega dt``,

        D(z) s = [(tau/dt) (phi / sin phi) (cos phi - z) + kappa (1 - 2 cos phi z + z²)] s

    which is ``i Omega tau s`` without error at the frequency of the load, and where that is 0 at rest. With
    ``kappa = tau / (2 dt)`` it errs by ``(theta² - phi²) theta² / 4`` times tau/dt in phase and a third order
    beside it at the phase theta per step of any other harmonic (without a frequency these are backward
    differences of second order). Where motion is periodic under a load of known frequency `ALTERNATING`
    comes to kappa: a loss of ``2 kappa sin theta (cos phi - cos theta)``, none at the load, next to none
    where steps are many, and strong where reactions change from step to step, which the trapezoidal
    rule of the modes passes over.

    Parameters
    ----------
    tau : float
        Share of the part's stiffness in its damping, s.
    dt, frequency : float
        s, Hz.

    Returns
    -------
    (3,) array
        d_0, d_1, d_2 of ``D(z) = d_0 + d_1 z + d_2 z²``.

    Examples
    --------
    >>> z = np.exp(-0.2j)
    >>> bool(np.isclose(lags(0.03, 0.1, 1 / np.pi) @ [1, z, z**2], 0.06j))
    True
    """
    phi = 2 * np.pi * min(frequency, 1 / (FEWEST * dt)) * dt
    turn = 1 / np.sinc(phi / np.pi)
    kappa = 0.5 * tau / dt + (ALTERNATING if frequency > 0 else 0.0)
    first, cos = tau / dt * turn, np.cos(phi)
    return np.array([first * cos + kappa, -first - 2 * kappa * cos, kappa])


def within_reach(omega: Array, dt: float) -> int:
    """How many modes a step can follow; `omega` ascends."""
    return int(np.searchsorted(omega * dt, REACH))


NEGLIGIBLE = 1e-6
"""A phase per step whose square is below rounding: the step is dt."""

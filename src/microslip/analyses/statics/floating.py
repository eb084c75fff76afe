"""Motions with more inertia than support, in cycles with a mode prescribed.

Bodies that slide past each other, and modes below the one that is prescribed, have a negative
stiffness ``k - omega_0² m`` in such a cycle. Contact holds them while it sticks. Once they slip or
open, equilibrium step after step has no stable path, though there is a steady vibration, in which such
a body swings against the force on it. So each of them is held by a spring ``kappa`` to a motion of
its own, a mean and one harmonic,

    x(theta) = c + a sin(theta) + b cos(theta)

and that x is sought to which the coordinate itself moves, ``q_0 = c``, ``q_1 = a + i b``: the spring is
then without force in the mean and in the first harmonic, like that of
`microslip.analyses.backbone.extended_motion`. Inertia is that of the first harmonic, the mean has
none. Approximated: these motions have no higher harmonics, as the mode itself has none, and the
bodies slide past each other about where they rest under the preload; friction that is larger than
their supports settles that mean by its history.

The unknowns are found by Broyden's method (Math. Comp. 19 (1965) 577) from the stuck joint, which is
linear and has its solution and its derivative in closed form.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from microslip.brief import Brief
from microslip.errors import ContactError
from microslip.model.flexibility import Flexibility
from microslip.typing import Array, Indices

FORCELESS = 1e-5
"""Force of the springs, over that of the mode's own stiffness, that always counts as none."""

RESTING = 1e-3
"""Share of a direction in the floating coordinates from which on its mean stays at rest."""

BALANCED = 1e-4
"""Last step of the search, at most, over the amplitude of the mode."""

LONGEST = 0.02
"""Longest step, over the amplitude of the mode: beyond, the derivative is not believed."""

MOST_STEPS = 100

PATIENCE = 30
"""Steps without a smaller force of the springs than before, after which none is expected."""


@dataclass(frozen=True, repr=False)
class Floating(Brief):
    """The s floating coordinates of a held joint: the first ones of equilibrium.

    Attributes
    ----------
    spring : float
        kappa, 1/s².
    inertia : (s, s) array
        ``omega_0² m``, which the mean does not have, 1/s².
    rest : (s,) array
        Coordinates at prestress.
    mean : (s, c) array
        Orthonormal directions in which the mean is sought; in the others it stays at rest.
    answer : (s, s) array
        Motion of the stuck joint per unit of x.
    driven : (s,) array
        The same per unit load on the port of the mode.
    """

    spring: float
    inertia: Array
    rest: Array
    mean: Array
    answer: Array
    driven: Array

    def start(self, load: float) -> Array:
        """(3, s) unknowns of the stuck joint under a load ``sin(theta)`` on the mode."""
        x = np.zeros((3, len(self.rest)))
        x[1] = np.linalg.solve(np.eye(len(self.rest)) - self.answer, self.driven * load)
        return x

    def course(self, x: Array, theta: Array) -> Array:
        """(n, s) to what the springs hold the coordinates, the mean freed of its inertia."""
        freed = x.copy()
        freed[0] -= self.inertia @ x[0] / self.spring
        return _waves(theta) @ freed

    def motion(self, q: Array, theta: Array) -> Array:
        """Unknowns as the coordinates of a cycle have them, means at rest left out."""
        x = _waves(theta[1:]).T @ (q[1:, : len(self.rest)] - self.rest) / len(q[1:])
        return np.stack([self.mean @ (self.mean.T @ x[0]), 2 * x[1], 2 * x[2]])

    def derivative(self) -> Array:
        """(3 s, 3 s) derivative of `motion` less x by x, of the stuck joint."""
        s = len(self.rest)
        found = np.zeros((3, s, 3, s))
        still = self.answer @ (np.eye(s) - self.inertia / self.spring)
        found[0, :, 0] = self.mean @ (self.mean.T @ still)
        found[1, :, 1] = found[2, :, 2] = self.answer
        return found.reshape(3 * s, 3 * s) - np.eye(3 * s)


def _waves(theta: Array) -> Array:
    return np.column_stack([np.ones(len(theta)), np.sin(theta), np.cos(theta)])


def floating(
    flexibility: Flexibility,
    spring: float,
    inertia: Array,
    rest: Array,
    still: Array,
    bonded: Indices,
    port: int,
) -> Floating:
    """The floating coordinates of a joint whose springs are in the flexibility already.

    Parameters
    ----------
    flexibility : Flexibility
        Its last ports are what the springs hold the coordinates to.
    spring, inertia, rest
        See `Floating`.
    still : (s, w) array
        Directions in which the mean stays at rest.
    bonded : (c,) int array
        Components of v that stick.
    port : int
        Of the mode.
    """
    f, s = flexibility, len(rest)
    R = f.R[bonded]
    held = np.linalg.solve(f.W[np.ix_(bonded, bonded)], np.column_stack([R, f.loads_v[bonded]]))
    stiffness = np.diag(f.stiffness) + R.T @ held[:, : R.shape[1]]
    answers = np.linalg.solve(stiffness, f.loads_q - R.T @ held[:, R.shape[1] :])
    directions, size, _ = np.linalg.svd(still)
    mean = np.asarray(directions[:, int((size > RESTING).sum()) :])
    return Floating(
        spring, inertia, rest, mean, np.asarray(answers[:s, -s:]), np.asarray(answers[:s, port])
    )


def balance(
    floating: Floating,
    load: float,
    size: float,
    stiffness: float,
    closure: float,
    theta: Array,
    cycle: Callable[[Array], Array],
) -> None:
    """Seek the course of the floating coordinates that makes their springs without force.

    Parameters
    ----------
    floating : Floating
    load : float
        Amplitude of the load on the mode.
    size : float
        Amplitude of the mode.
    stiffness : float
        Of the mode, omega_sl².
    closure : float
        Force of the springs, over that of the mode's own stiffness, that counts as none; at least
        `FORCELESS`.
    theta : (n,) array
    cycle : function of an (n, s) array to an (n, e) array
        From what the springs hold the coordinates to, to the coordinates of a cycle; called last with
        the course that was sought.

    Raises
    ------
    ContactError
        Where it is not found.
    """
    x = floating.start(load)
    search = Broyden(np.asarray(np.linalg.inv(floating.derivative())))
    least, last = np.inf, 0
    for number in range(MOST_STEPS):
        residual = floating.motion(cycle(floating.course(x, theta)), theta) - x
        search.learn(x.ravel(), residual.ravel())
        step = search.step(residual.ravel()).reshape(x.shape)
        force = np.abs(residual).max() * floating.spring
        free = force <= max(closure, FORCELESS) * stiffness * size
        if free and np.abs(step).max() <= BALANCED * size:
            return
        if force < least:
            least, last = force, number
        elif number - last >= PATIENCE:
            break
        x = x + step * min(1.0, LONGEST * size / np.abs(step).max())
    raise ContactError(
        "the bodies do not settle into a motion of the mode's own frequency against each other"
    )


class Broyden:
    """Broyden's method for ``residual(x) = 0`` from a known inverse of the derivative.

    Examples
    --------
    >>> search, x = Broyden(np.array([[0.3]])), np.array([1.0])
    >>> for _ in range(8):
    ...     search.learn(x, x**2 - 2)
    ...     x = x + search.step(x**2 - 2)
    >>> bool(abs(x[0] - 2**0.5) < 1e-9)
    True
    """

    def __init__(self, inverse: Array) -> None:
        self.inverse = inverse.copy()
        self.last: tuple[Array, Array] | None = None

    def learn(self, x: Array, residual: Array) -> None:
        """Make the derivative fit the last two residuals."""
        if self.last is not None:
            dx = x - self.last[0]
            found = self.inverse @ (residual - self.last[1])
            size = dx @ found
            if abs(size) > 1e-9 * np.linalg.norm(dx) * np.linalg.norm(found):
                self.inverse += np.outer(dx - found, dx @ self.inverse) / size
        self.last = x.copy(), residual.copy()

    def step(self, residual: Array) -> Array:
        """What to add to the x of a residual."""
        return np.asarray(-self.inverse @ residual)

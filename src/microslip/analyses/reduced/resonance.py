"""Where a reduced model resonates: frequency, loss and the load that it takes, against amplitude.

With the contact force tabulated the refined model's equation in A = Q + c M is

    [D(omega) + omega_sl² kappa(a)] A = (Phi^T p + D(omega) c) M,
    D = omega_sl² (1 + i omega beta) - omega² + i omega alpha,      a = |A|

Resonance is where load and motion are a quarter of a period apart,

    omega²  = omega_sl² (1 + k_eq(a)),
    loss(a) = gamma_eq + (omega beta (1 + lossy k_eq)) + omega alpha / omega_sl²      over omega_sl²,

and the load that keeps it going is ``M(a) = a omega_sl² loss / |Phi^T p + D c|``. It rises with
amplitude as long as the loss does not fall faster; where the joint begins to open it no longer does.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from microslip.analyses.reduced.table import EquivalentTable
from microslip.analyses.reduced.two_mode import TwoModeModel
from microslip.brief import Brief
from microslip.typing import Array, Complex


@dataclass(frozen=True, repr=False)
class Resonance(Brief):
    """Resonance of a reduced model at the amplitudes of its table.

    Attributes
    ----------
    amplitude : (n,) array
        Ascending.
    omega : (n,) array
        Circular frequency, rad/s.
    width : (n,) array
        Between the half-power points of an oscillator of that stiffness and loss, rad/s.
    load : (n,) array
        Amplitude of the driving load that holds this resonance.
    """

    amplitude: Array
    omega: Array
    width: Array
    load: Array

    @property
    def largest_load(self) -> float:
        """Load beyond which no resonance lies in the table."""
        return float(self.load.max())

    def reached(self, load: float) -> int:
        """Index of the largest amplitude at which a load resonates; the last where it goes on."""
        if load > self.largest_load:
            return len(self.load) - 1
        above = np.flatnonzero(self.load <= load)
        return min(int(above[-1]) + 1, len(self.load) - 1) if len(above) else 0


def resonance(
    model: TwoModeModel, amplitude: Array, kappa: Complex, damping: Array | None = None
) -> Resonance:
    """Resonance at modal amplitudes whose contact force is known.

    Parameters
    ----------
    model : TwoModeModel
        With a sliding mode that its load excites.
    amplitude : (n,) array
        Ascending.
    kappa : (n,) complex array
        ``k_eq + i gamma_eq`` over omega_sl².
    damping : (n,) array, optional
        `EquivalentTable.damping`.

    Notes
    -----
    Exact for the refined model without upper harmonics; for those of two modes it is the one-mode
    answer. Amplitudes at which nothing is left of the stiffness are left out.
    """
    keep = kappa.real > -1
    k, gamma, a = kappa.real[keep], kappa.imag[keep], amplitude[keep]
    alpha, beta = model.own_rayleigh
    more = 0.0 if damping is None else damping[keep]
    w2 = model.omega**2
    omega = model.omega * np.sqrt(1 + k)
    loss = np.maximum(gamma, 0) + omega * beta * (1 + model.lossy * k) + omega * (alpha + more) / w2
    push = np.abs(model.force[0] + model.linear_stiffness(omega) * model.offset[0])
    return Resonance(a, omega, w2 * loss / omega, a * w2 * loss / np.maximum(push, 1e-300))


def resonance_of(model: TwoModeModel, table: EquivalentTable) -> Resonance:
    """`resonance` at the amplitudes of a table."""
    return resonance(model, table.amplitude, table.k_eq + 1j * table.gamma_eq, table.damping)


def linear_resonance(model: TwoModeModel, load: float = 1.0) -> tuple[float, float]:
    """Peak of the frictionless joint: frequency, Hz, and modal amplitude under a load.

    ``q = Phi^T p M / D(omega)``. With ``d = alpha + beta omega_sl² + d_11``, ``|D|²`` is least at
    ``omega² = omega_sl² - d²/2``, where it is ``d² (omega_sl² - d²/4)``. Without damping the
    amplitude is infinite; with ``d² >= 2 omega_sl²`` it is largest at rest.

    Examples
    --------
    >>> import numpy as np
    >>> no, one = np.zeros((2, 2)), np.array([1.0, 0.0])
    >>> oscillator = TwoModeModel(no, no, no, no, one, one, one, (2.0, 0.0), omega=10.0)
    >>> frequency, amplitude = linear_resonance(oscillator)
    >>> round(2 * np.pi * frequency, 4), round(1 / amplitude, 4)
    (9.8995, 19.8997)
    """
    alpha, beta = model.own_rayleigh
    w2 = model.omega**2
    d2 = (alpha + beta * w2) ** 2
    square = max(w2 - 0.5 * d2, 0.0)
    stiffness = np.sqrt(d2 * (w2 - 0.25 * d2)) if square > 0 else w2
    push = abs(model.force[0]) * load
    amplitude = push / stiffness if stiffness > 0 else np.inf * push
    return float(np.sqrt(square) / (2 * np.pi)), float(amplitude)

"""Equivalent stiffness and damping against amplitude, from steady quasi-static cycles.

With ``q = Phi_sl^T M (x - x_prestress)`` and the modal contact force ``f = Phi_sl^T F_c`` (contact
force beyond the linear sliding state), projection of static equilibrium on the sliding mode gives
``omega_sl² q + f = Phi_sl^T F`` exactly, whatever touches, slips or separates. First harmonics over
the steady cycle:

    k_eq + i gamma_eq = F_1 / (omega_sl² Q_1)          dimensionless

(theory: W_s = pi Re F_1, W_c = pi Im F_1 in the phase of q, so k_eq = W_s / (pi q omega_sl²)).
Everything depends on the load only through amplitude over preload.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from microslip.analyses.prepared.direct import direct_motion
from microslip.analyses.prepared.joint import PreparedJoint
from microslip.analyses.statics.cycle import Cycle
from microslip.brief import Brief
from microslip.numerics.fourier import harmonic, without_drift
from microslip.typing import Array, Complex, Indices


@dataclass(frozen=True, repr=False)
class UpperHarmonics(Brief):
    """Upper modes in superharmonic resonance, against the amplitude of the sliding mode.

    See `refined.py`. Per chosen (mode, harmonic) s and amplitude n:

    Attributes
    ----------
    order : (s,) int array
        Harmonic h.
    omega : (s,) array
        Circular frequency of the mode, rad/s.
    reference_omega : float
        omega_0, at which the table already has the mode's inertia.
    motion : (n, s) complex array
        eta_0 over the amplitude.
    compliance : (n, s) complex array
        S, s².
    in_phase, quadrature : (n, s) complex arrays
        T for the real and the imaginary part of the load.
    damping : (s,) array
        What damps the mode beyond alpha and beta, 1/s.
    """

    order: Indices
    omega: Array
    reference_omega: float
    motion: Complex
    compliance: Complex
    in_phase: Complex
    quadrature: Complex
    damping: Array


@dataclass(frozen=True, repr=False)
class EquivalentTable(Brief):
    """Equivalent stiffness and damping of the sliding mode against its amplitude.

    Attributes
    ----------
    drive : str
        What drove the cycles: the name of a port, ``"mode"``, or ``"prescribed"`` for the refined
        model.
    preload, omega : float
        Size of the preload (N/m) that the amplitudes belong to, and omega_sl (rad/s).
    load : (n,) array
        Amplitude of the driving load, in the unit of its port.
    amplitude : (n,) array
        ``|Q_1|``, first harmonic of the sliding coordinate, m sqrt(kg) per sqrt(m) of width;
        ascending.
    k_eq, gamma_eq : (n,) arrays
        Divided by omega_sl².
    cross : (n,) complex array
        Force on the second coordinate (the part of the stuck mode M-orthogonal to the sliding
        mode) over ``omega_sl² Q_1``.
    dissipated, stored : (n,) arrays
        Friction work per cycle and mean stored energy ``q W_s / (2 pi)``, J per metre of width.
    upper : UpperHarmonics, optional
        Of the refined model.
    uncertainty : (n,) array, optional
        Error of interpolation of ``k_eq + i gamma_eq``; of the refined model.
    motion : (n, p) complex array, optional
        First harmonics of the outputs of all ports over Q_1, without what the driving load moves
        besides the mode, see `outputs.py`.
    damping : (n,) array, optional
        d of the shape at each amplitude (`microslip.model.shape_damping`) less that of the sliding mode, 1/s;
        of the refined model where damping couples the modes.
    """

    drive: str
    preload: float
    omega: float
    load: Array
    amplitude: Array
    k_eq: Array
    gamma_eq: Array
    cross: Complex
    dissipated: Array
    stored: Array
    upper: UpperHarmonics | None = None
    uncertainty: Array | None = None
    motion: Complex | None = None
    damping: Array | None = None


def modal_quantities(cycle: Cycle, joint: PreparedJoint) -> tuple[Array, Array]:
    """Modal coordinate q and modal contact force f over a cycle, both ``(s + 1,)``."""
    mode = joint.principal()
    q = cycle.output[:, joint.model.port(mode.port)]
    push = 1.0 if cycle.port == mode.port else mode.load_on_sliding[cycle.port]
    return q, push * cycle.load - mode.sliding_omega**2 * q


def equivalent_table(cycles: Sequence[Cycle], joint: PreparedJoint, drive: str) -> EquivalentTable:
    """Table of equivalent stiffness and damping from steady cycles of one drive.

    Parameters
    ----------
    cycles : sequence of Cycle
        Any order.
    joint : PreparedJoint
        With a mode, for whose both ports the model has outputs.
    drive : str
        What the driven port is called in results.
    """
    mode = joint.principal()
    c = mode.overlap
    s = np.sqrt(1 - c**2)
    omega2 = mode.sliding_omega**2
    second2 = (mode.stuck_omega**2 - c**2 * omega2) / s**2
    stuck = joint.model.port(mode.stuck_port)
    direct: dict[str, Complex] = {}
    rows = []
    for cycle in cycles:
        q, f = modal_quantities(cycle, joint)
        own = cycle.port == mode.port
        push = c if own else mode.load_on_stuck[cycle.port]
        push_sl = 1.0 if own else mode.load_on_sliding[cycle.port]
        other = (cycle.output[:, stuck] - c * q) / s
        f_other = (push - c * push_sl) / s * cycle.load - second2 * other
        Q, F = harmonic(q, cycle.theta), harmonic(f, cycle.theta)
        ratio = F / Q / omega2
        cross = harmonic(f_other, cycle.theta) / Q / omega2
        stored = 0.5 * abs(Q) ** 2 * ratio.real * omega2
        if cycle.port not in direct:
            direct[cycle.port] = direct_motion(joint, cycle.port, np.zeros(1))[0]
        first = harmonic(without_drift(cycle.output, cycle.theta), cycle.theta)
        motion = (first - direct[cycle.port] * cycle.amplitude) / Q
        rows.append(
            (
                *(cycle.amplitude, abs(Q), ratio.real, ratio.imag, cross),
                *(cycle.dissipated, stored, motion),
            )
        )
    rows.sort(key=lambda row: row[1])
    load, amplitude, k, g, cross, dissipated, stored, motions = map(
        np.array, zip(*rows, strict=True)
    )
    return EquivalentTable(
        drive,
        joint.prestress.force,
        mode.sliding_omega,
        load,
        amplitude,
        k,
        g,
        cross,
        dissipated,
        stored,
        motion=motions,
    )

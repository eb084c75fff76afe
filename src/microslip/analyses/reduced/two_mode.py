"""Reduced models of two modes: the paper's as printed, the consistent and the refined.

Two coordinates, ``x = T y`` with ``T = [Phi_sl Phi_st]``. At each frequency

    [-omega² m + (1 + i omega beta) k + i omega (alpha m + d)] y + f_f(y) = T^T F

with ``d = T^T D T`` of what damps the kept modes beyond alpha and beta, and the friction force replaced by
its first harmonic from a table of equivalent stiffness and damping against amplitude:

``printed``      f_f = (k_eq + i gamma_eq)(|y_sl|) omega_sl² I y on the coordinates of T (the paper's
                 eqs. (15), (16); the misprints of its eqs. (6), (7), (10), (13), (14) corrected).
``consistent``   basis M-orthonormalised, the force itself projected: on the sliding mode
                 ``omega_sl² (k_eq + i gamma_eq)(|q|) q`` and on the second coordinate its measured
                 cross part, both functions of ``q = Phi_sl^T M x``.
``refined``      one coordinate; the force tabulated with q prescribed, at the amplitude of
                 ``q + c M``, with upper harmonics (`refined.py`). Where the table is of resonances of
                 the full joint (`resonant.py`) it is the stuck mode that slip softens, `stuck_model`.
"""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np

from microslip.analyses.prepared.direct import direct_motion, stuck_oscillator
from microslip.analyses.prepared.joint import PreparedJoint
from microslip.brief import Brief
from microslip.errors import MicroslipError
from microslip.model.shape_damping import damping_of_pair, damping_of_shape
from microslip.typing import Array, Complex

VARIANTS = ("printed", "consistent", "refined")


@dataclass(frozen=True, repr=False)
class TwoModeModel(Brief):
    """Linear part of the reduced model and where the table enters it.

    ``[-omega² m + (1 + i omega beta) k + i omega (alpha m + d)] y + omega_sl² (E kappa + X chi)
    (y + offset) = force``, with ``kappa = k_eq (1 + i omega beta lossy) + i gamma_eq`` and ``chi``
    the cross coefficient at ``a = |argument . (y + offset)|``; the modal amplitude reported is
    ``sliding . y``.

    Attributes
    ----------
    m, k, E, X : (2, 2) arrays
    argument, sliding, offset : (2,) arrays
        `offset` per unit load.
    lossy : float
        1 where the elastic part of the force has the material's loss, else 0.
    force : (2,) array
        Projection of a unit load.
    rayleigh : tuple of float
    omega : float
        omega_sl, rad/s; that of the stuck mode of `stuck_model`.
    damping : (2, 2) array
        d, 1/s.
    stuck : bool
        Whether it is the model of `stuck_model`.
    """

    m: Array
    k: Array
    E: Array
    X: Array
    argument: Array
    sliding: Array
    force: Array
    rayleigh: tuple[float, float]
    omega: float
    offset: Array = field(default_factory=lambda: np.zeros(2))
    lossy: float = 0.0
    damping: Array = field(default_factory=lambda: np.zeros((2, 2)))
    stuck: bool = False

    @property
    def own_rayleigh(self) -> tuple[float, float]:
        """``alpha + d_11`` and beta: those of the mode."""
        alpha, beta = self.rayleigh
        return alpha + float(self.damping[0, 0]), beta

    def linear_stiffness(self, omega: Array | float) -> Complex:
        """What the sliding mode resists without contact at circular frequencies, rad/s:
        ``D = omega_sl² (1 + i omega beta) - omega² + i omega (alpha + d_11)``."""
        alpha, beta = self.own_rayleigh
        w = np.asarray(omega, dtype=float)
        return np.asarray(self.omega**2 * (1 + 1j * w * beta) - w**2 + 1j * w * alpha)


def two_mode_model(
    joint: PreparedJoint, variant: str, offset: float = 0.0, *, port: str | None = None
) -> TwoModeModel:
    """Reduced model of the sliding and the stuck mode.

    Parameters
    ----------
    joint : PreparedJoint
        With a mode.
    variant : str
        One of `VARIANTS`.
    offset : float
        Of the refined model, see `microslip.analyses.reduced.refined.load_offset`.
    port : str, optional
        Driven port; the joint's own by default.
    """
    mode, rayleigh, load = joint.principal(), joint.model.rayleigh, port or joint.drive
    c = mode.overlap
    sl2, st2 = mode.sliding_omega**2, mode.stuck_omega**2
    d = damping_of_pair(joint.model, mode.sliding, mode.stuck)
    f_sl, f_st = mode.load_on_sliding[load], mode.load_on_stuck[load]
    if variant == "printed":
        T = np.array([[1.0, c], [0.0, np.sqrt(max(1 - c**2, 0.0))]])
        return TwoModeModel(
            m=np.array([[1.0, c], [c, 1.0]]),
            k=np.array([[sl2, c * sl2], [c * sl2, st2]]),
            E=np.eye(2),
            X=np.zeros((2, 2)),
            argument=np.array([1.0, 0.0]),
            sliding=np.array([1.0, c]),
            force=np.array([f_sl, f_st]),
            rayleigh=rayleigh,
            omega=mode.sliding_omega,
            damping=T.T @ d @ T,
        )
    if variant == "refined":
        return TwoModeModel(
            m=np.eye(2),
            k=np.diag([sl2, st2]),
            E=np.array([[1.0, 0.0], [0.0, 0.0]]),
            X=np.zeros((2, 2)),
            argument=np.array([1.0, 0.0]),
            sliding=np.array([1.0, 0.0]),
            force=np.array([f_sl, 0.0]),
            rayleigh=rayleigh,
            omega=mode.sliding_omega,
            offset=np.array([offset, 0.0]),
            lossy=1.0,
            damping=np.array([[d[0, 0], 0.0], [0.0, 0.0]]),
        )
    if variant != "consistent":
        raise MicroslipError(f"no variant {variant!r}: choose one of {', '.join(VARIANTS)}")
    s = np.sqrt(1 - c**2)
    return TwoModeModel(
        m=np.eye(2),
        k=np.diag([sl2, (st2 - c**2 * sl2) / s**2]),
        E=np.array([[1.0, 0.0], [0.0, 0.0]]),
        X=np.array([[0.0, 0.0], [1.0, 0.0]]),
        argument=np.array([1.0, 0.0]),
        sliding=np.array([1.0, 0.0]),
        force=np.array([f_sl, (f_st - c * f_sl) / s]),
        rayleigh=rayleigh,
        omega=mode.sliding_omega,
        damping=d,
    )


def stuck_model(joint: PreparedJoint) -> TwoModeModel:
    """The stuck mode as an oscillator in the joint's coordinate, which the contact force of slip softens.

    With ``phi`` the stuck mode of the joint model and ``s = Phi_sl^T M phi``, the stuck joint moves the
    coordinate by ``Q = A + d M``: A is the share of phi, d what the load moves by all other stuck modes, at
    the frequency of this one,

        [omega_st² (1 + i omega beta) - omega² + i omega alpha + omega_st² kappa(|A|)] A = s phi^T p M,

    and kappa vanishes where the joint sticks. The sliding mode does not come in: where it is unlike the stuck
    one an oscillator of it has neither the mass nor the load of what vibrates. In the terms of `TwoModeModel`
    the offset is ``c = -d``, and the load on A is ``s phi^T p + D c``: right at the resonance of the stuck
    joint, where D vanishes.

    Parameters
    ----------
    joint : PreparedJoint
        With a mode.

    Raises
    ------
    MicroslipError
        Where the stuck mode does not move the coordinate.
    """
    omega, shape, load = stuck_oscillator(joint)
    others = direct_motion(joint, joint.drive, np.array([omega]), stuck=True)[0]
    share = float(joint.model.port_modes[:, joint.model.port(joint.coordinate)] @ shape)
    if share == 0:
        raise MicroslipError(
            f"the stuck mode of {omega / (2 * np.pi):.4g} Hz does not move the coordinate "
            f"{joint.coordinate!r}: take another port"
        )
    one = np.array([1.0, 0.0])
    return TwoModeModel(
        m=np.eye(2),
        k=omega**2 * np.eye(2),
        E=np.diag(one),
        X=np.zeros((2, 2)),
        argument=one,
        sliding=one,
        force=share * load[joint.model.port(joint.drive)] * one,
        rayleigh=joint.model.rayleigh,
        omega=omega,
        offset=-float(others[joint.model.port(joint.coordinate)].real) * one,
        lossy=1.0,
        damping=damping_of_shape(joint.model, shape) * np.diag(one),
        stuck=True,
    )

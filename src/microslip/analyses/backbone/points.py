"""Backbones as results: vibration of one mode at one amplitude after another."""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np

from microslip.analyses.prepared.joint import PreparedJoint
from microslip.analyses.prepared.joint_modes import JointMode, with_mode_port
from microslip.analyses.prepared.prestress import opening_load
from microslip.brief import Brief
from microslip.errors import Failure, MicroslipError
from microslip.model.joint import JointModel
from microslip.typing import Array, Complex

METHODS = ("quasi_static", "prescribed", "harmonic")

IDLE = 1e-6
"""Stiffening below which the interface is said not to matter to a mode."""


@dataclass(frozen=True)
class BackbonePoint:
    """Vibration of one mode at one amplitude.

    Attributes
    ----------
    amplitude : float
        Of the modal coordinate, m sqrt(kg) per sqrt(m) of width.
    omega, damping_ratio : float
        rad/s; material damping included.
    dissipated : float
        Friction work per cycle, J per metre of width.
    residual : float
        Largest residual of the contact problem.
    closure : float
        Change of the reactions over the last cycle, over the largest prestress reaction; 0 where
        the method is periodic by construction.
    motion : (p,) complex array
        First harmonics of the outputs of all ports, phase against the modal coordinate; empty where they
        were not kept.
    damping : float
        What damps its shape beyond alpha and beta, `microslip.model.shape_damping`, 1/s.
    """

    amplitude: float
    omega: float
    damping_ratio: float
    dissipated: float
    residual: float
    closure: float
    motion: Complex = field(default_factory=lambda: np.zeros(0, complex), compare=False, repr=False)
    damping: float = 0.0


@dataclass(frozen=True, repr=False)
class Backbone(Brief):
    """Points of one mode by one method, in the order of their amplitudes.

    Attributes
    ----------
    mode : JointMode
    method : str
        One of `METHODS`.
    points : tuple of BackbonePoint
    scale : float
        Amplitude at which the inertia of the mode would open the joint, see `amplitude_scale`.
    failures : tuple of Failure
        Amplitudes that were not solved, where the caller keeps them here.
    """

    mode: JointMode
    method: str
    points: tuple[BackbonePoint, ...]
    scale: float
    failures: tuple[Failure, ...] = ()

    @property
    def interface_matters(self) -> bool:
        """Whether the interface can change the frequency of the mode noticeably."""
        return abs(self.mode.stiffening) > IDLE

    @property
    def amplitude(self) -> Array:
        """(n,) modal amplitudes."""
        return np.array([p.amplitude for p in self.points])

    @property
    def frequency(self) -> Array:
        """(n,) natural frequencies, Hz."""
        return np.array([p.omega for p in self.points]) / (2 * np.pi)

    @property
    def damping_ratio(self) -> Array:
        """(n,) damping ratios."""
        return np.array([p.damping_ratio for p in self.points])


def material_damping(model: JointModel, omega: float, beyond: float = 0.0) -> float:
    """Damping ratio ``(alpha + beta omega² + d) / (2 omega)`` of the material at a natural frequency.

    `beyond` is d, of the shape (`microslip.model.shape_damping`).
    """
    alpha, beta = model.rayleigh
    return (alpha + beta * omega**2 + beyond) / (2 * omega)


def amplitude_scale(joint: PreparedJoint, mode: JointMode) -> float:
    """Amplitude at which the inertia load of the mode, ``omega_sl² q M Phi``, opens the joint.

    Where limit analysis gives no such load, as the load only presses and shears the interface
    without moving the bodies, the amplitude at which the stuck joint's reactions change by as much
    as the largest prestress reaction; infinite for a mode that the interface does not feel.
    """
    model, start = joint.model, joint.prestress
    wide = with_mode_port(model, mode)
    limit = opening_load(wide, start, mode.port, joint.law.friction) / mode.sliding_omega**2
    if np.isfinite(limit):
        return float(limit)
    bonded = start.bonded(model.dimension)
    W = model.residual[np.ix_(bonded, bonded)]
    change = np.linalg.solve(W, model.mode_v[bonded] @ mode.stuck)
    felt = float(np.abs(change).max(initial=0.0))
    return float(start.largest_reaction / felt) if felt > 0 else float("inf")


def failed(mode: JointMode, method: str, amplitude: float, error: Exception) -> Failure:
    """What is said of an amplitude that was not solved."""
    name = method.replace("_", "-")
    where = f"mode {mode.number}, {name}, at amplitude {amplitude:.4g}"
    return Failure("backbone", where, str(error))


def geometric(smallest: float, largest: float, count: int) -> Array:
    """Amplitudes evenly spaced in their logarithm.

    Raises
    ------
    MicroslipError
        Where they do not ascend from a positive one.
    """
    if not 0 < smallest < largest < np.inf or count < 2:
        raise MicroslipError(
            f"{count} amplitudes from {smallest:g} to {largest:g}: at least 2, ascending from a "
            "positive one, are needed"
        )
    return np.geomspace(smallest, largest, count)

"""Backbones: natural frequency and damping ratio of a mode of the joint against its amplitude.

With ``q = Phi^T M (x - x_prestress)`` of a sliding mode, and everything per metre of width.

*Quasi-static modal analysis* (Lacayo & Allen, Mech. Syst. Signal Process. 118 (2019) 133; Balaji &
Brake 2020). Steady cycles under the inertia load of the mode,
``M Phi A sin(theta)``, inertia itself left out. Secant through the tips of the loop, and its area:

    omega² = range(A sin) / range(q),     zeta = Delta E / (2 pi omega² a²),     a = range(q) / 2

*Nonlinear mode* in the sense of the extended periodic motion (Krack, Computers & Structures 154
(2015) 59): the periodic motion that negative damping proportional to mass sustains,

    M x'' + (C - xi M) x' + K x + B^T r = clamp,     zeta = xi / (2 omega).

Projected on the mode, ``F/Q = omega² - omega_sl² + i omega (xi - c)``, exactly, so with
``F/Q = omega_sl² (k_eq + i gamma_eq)``

    omega² = omega_sl² (1 + k_eq),     zeta = gamma_eq / (2 (1 + k_eq)) + (alpha + beta omega²) / (2 omega).

F comes from cycles with q prescribed (`prescribed.py`) at the reference frequency that is the
mode's own, iterated at every amplitude. Approximated in this: higher harmonics and the mean have
the inertia of the first; q has no higher harmonics; other modes have no damping; the material's
damping is that of a mode of frequency omega, as if all of the stiffness had its loss.
`extended_motion.py` makes none of these approximations.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np

from microslip.analyses.statics.cycle import Prestress, opening_load, quasi_static_cycle
from microslip.analyses.statics.joint_modes import MODE_PORT, JointMode, with_mode_port
from microslip.analyses.statics.prescribed import hold_port, prescribed_cycle, walking_modes
from microslip.errors import ContactError, MicroslipError
from microslip.model.flexibility import static_flexibility, with_compliance
from microslip.model.joint import JointModel
from microslip.numerics.execute import in_threads, workers
from microslip.typing import Array

METHODS = ("quasi_static", "prescribed", "harmonic")

OWN_FREQUENCY = 1e-6
"""Relative change of the reference frequency at which it is the mode's own."""

MOST_FREQUENCIES = 12

LINKED = 1e-6
"""Share of a body's slide in the stuck mode beyond which it moves with the mode, not as a mean."""

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
    """

    amplitude: float
    omega: float
    damping_ratio: float
    dissipated: float
    residual: float
    closure: float


@dataclass(frozen=True)
class Backbone:
    """Points of one mode by one method, in the order of their amplitudes.

    Attributes
    ----------
    mode : JointMode
    method : str
        One of `METHODS`.
    points : tuple of BackbonePoint
    scale : float
        Amplitude at which the inertia of the mode would open the joint, see `amplitude_scale`.
    """

    mode: JointMode
    method: str
    points: tuple[BackbonePoint, ...]
    scale: float

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


def material_damping(model: JointModel, omega: float) -> float:
    """Damping ratio ``(alpha + beta omega²) / (2 omega)`` of the material at a natural frequency."""
    alpha, beta = model.rayleigh
    return (alpha + beta * omega**2) / (2 * omega)


def amplitude_scale(model: JointModel, start: Prestress, mode: JointMode) -> float:
    """Amplitude at which the inertia load of the mode, ``omega_sl² q M Phi``, opens the joint.

    Where limit analysis gives no such load, as the load only presses and shears the interface
    without moving the bodies, the amplitude at which the stuck joint's reactions change by as much
    as the largest prestress reaction; infinite for a mode that the interface does not feel.
    """
    wide = with_mode_port(model, mode)
    limit = opening_load(wide, static_flexibility(wide), start, MODE_PORT) / mode.omega**2
    if np.isfinite(limit):
        return float(limit)
    bonded = start.bonded(model.dimension)
    W = model.residual[np.ix_(bonded, bonded)]
    change = np.linalg.solve(W, model.mode_v[bonded] @ mode.stuck_shape)
    felt = float(np.abs(change).max(initial=0.0))
    return start.largest_reaction / felt if felt > 0 else float("inf")


@dataclass(frozen=True)
class CycleControl:
    """How cycles are computed.

    Attributes
    ----------
    steps, cycles : int
        Load steps per cycle, a multiple of four so that they meet the tips, and cycles at most.
    closure : float
        Cycles stop when no reaction changes by more than this between them, over the largest
        prestress reaction.
    """

    steps: int = 100
    cycles: int = 4
    closure: float = 1e-4


def quasi_static_backbone(
    model: JointModel,
    start: Prestress,
    mode: JointMode,
    friction: float | Array,
    amplitudes: Sequence[float] | Array,
    *,
    compliance: Array | None = None,
    control: CycleControl = CycleControl(),
    threads: int | None = None,
    advance: Callable[[], None] = lambda: None,
) -> tuple[Backbone, list[str]]:
    """Backbone by quasi-static modal analysis.

    Parameters
    ----------
    model : JointModel
        With a port ``clamp``.
    start : Prestress
    mode : JointMode
        From `mode_pairs.joint_modes`.
    friction : float or (m,) array
    amplitudes : (n,) array
        Of the inertia load over omega_sl²: the amplitudes of q that come out are close to these.
    compliance : (d m,) array, optional
        Of an elastic contact, m/N.
    control : CycleControl
    threads : int, optional
    advance : callable
        Called after every amplitude.

    Returns
    -------
    backbone : Backbone
    failures : list of str
        Amplitudes that could not be solved.
    """
    wide = with_mode_port(model, mode)
    flexibility = static_flexibility(wide)
    if compliance is not None:
        flexibility = with_compliance(flexibility, compliance)
    port = wide.port(MODE_PORT)

    def one(amplitude: float) -> BackbonePoint:
        cycle = quasi_static_cycle(
            wide,
            flexibility,
            start,
            MODE_PORT,
            amplitude * mode.omega**2,
            friction,
            steps=control.steps,
            max_cycles=control.cycles,
            closure=control.closure,
        )
        reach = float(np.ptp(cycle.output[:, port]))
        omega2 = float(np.ptp(cycle.load)) / reach
        friction_loss = cycle.dissipated / (2 * np.pi * omega2 * (reach / 2) ** 2)
        omega = float(np.sqrt(omega2))
        return BackbonePoint(
            amplitude=reach / 2,
            omega=omega,
            damping_ratio=friction_loss + material_damping(model, omega),
            dissipated=cycle.dissipated,
            residual=float(cycle.residual.max()),
            closure=cycle.closure,
        )

    return _collect(model, start, mode, "quasi_static", amplitudes, one, threads, advance)


def prescribed_backbone(
    model: JointModel,
    start: Prestress,
    mode: JointMode,
    friction: float | Array,
    amplitudes: Sequence[float] | Array,
    *,
    compliance: Array | None = None,
    control: CycleControl = CycleControl(),
    threads: int | None = None,
    advance: Callable[[], None] = lambda: None,
) -> tuple[Backbone, list[str]]:
    """Backbone of the nonlinear mode from cycles with its motion prescribed.

    Bodies that slide past each other as the stuck mode has them do so with their inertia; where
    the mode leaves that motion alone it has a mean only, and moves without inertia.

    Parameters and results as in `quasi_static_backbone`, but `amplitudes` are those of q.
    """
    wide = with_mode_port(model, mode)
    static = walking_modes(model) & (mode.stuck_shape**2 < LINKED)
    loose = bool((walking_modes(model) & ~static).any())
    hint = "; here the bodies slide past each other: try method harmonic" if loose else ""

    def one(amplitude: float) -> BackbonePoint:
        omega, tried = mode.stuck_omega, []
        for _ in range(MOST_FREQUENCIES):
            held = hold_port(
                wide,
                start,
                MODE_PORT,
                mode.omega,
                friction,
                omega,
                static=static,
                compliance=compliance,
            )
            try:
                cycle = prescribed_cycle(
                    held,
                    amplitude,
                    steps=control.steps,
                    cycles=control.cycles,
                    closure=control.closure,
                )
            except ContactError as error:
                raise ContactError(f"{error}{hint}") from None
            ratio = cycle.force / cycle.q
            if not mode.omega**2 + ratio.real > 0:
                raise ContactError("the stiffness of the mode is not positive")
            tried.append((omega, float(np.sqrt(mode.omega**2 + ratio.real))))
            if abs(tried[-1][1] / omega - 1) <= OWN_FREQUENCY:
                break
            omega = _secant(tried)
        else:
            raise ContactError(
                f"no frequency of its own: {tried[-2][1] / (2 * np.pi):.6g} and "
                f"{tried[-1][1] / (2 * np.pi):.6g} Hz came out last"
            )
        omega = tried[-1][1]
        return BackbonePoint(
            amplitude=abs(cycle.q),
            omega=omega,
            damping_ratio=ratio.imag / (2 * omega**2) + material_damping(model, omega),
            dissipated=cycle.dissipated,
            residual=cycle.residual,
            closure=cycle.closure,
        )

    return _collect(model, start, mode, "prescribed", amplitudes, one, threads, advance)


def _secant(tried: Sequence[tuple[float, float]]) -> float:
    """Next guess of ``omega = g(omega)`` from guesses and what came out; plain where it is wild."""
    x, y = tried[-1]
    if len(tried) == 1:
        return y
    x0, y0 = tried[-2]
    slope = (y - y0) / (x - x0) if x != x0 else 0.0
    return y if abs(slope) > 0.9 else x + (y - x) / (1 - slope)


def _collect(
    model: JointModel,
    start: Prestress,
    mode: JointMode,
    method: str,
    amplitudes: Sequence[float] | Array,
    one: Callable[[float], BackbonePoint],
    threads: int | None,
    advance: Callable[[], None],
) -> tuple[Backbone, list[str]]:
    """Points at independent amplitudes; those that fail are named."""

    def attempt(amplitude: float) -> BackbonePoint | str:
        try:
            return one(amplitude)
        except ContactError as error:
            return failed(mode, method, amplitude, error)

    points, failures = [], []
    wanted = sorted(float(a) for a in amplitudes)
    for outcome in in_threads(attempt, wanted, threads or workers()):
        if isinstance(outcome, str):
            failures.append(outcome)
        else:
            points.append(outcome)
        advance()
    return Backbone(mode, method, tuple(points), amplitude_scale(model, start, mode)), failures


def failed(mode: JointMode, method: str, amplitude: float, error: Exception) -> str:
    """What is said of an amplitude that was not solved."""
    name = method.replace("_", "-")
    return f"backbone of mode {mode.number}, {name}, at amplitude {amplitude:.4g}: {error}"


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

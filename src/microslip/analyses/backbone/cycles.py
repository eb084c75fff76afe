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

F comes from cycles with q prescribed (`microslip.analyses.statics.prescribed`) at the reference
frequency that is the mode's own, iterated at every amplitude. Approximated in this: higher
harmonics and the mean have the inertia of the first; q has no higher harmonics; other modes have no
damping; the material's damping is that of a mode of frequency omega, as if all of the stiffness had its loss.
Damping that couples the modes adds ``eta^H D eta / eta^H eta`` of the first harmonic of the cycle's shape.
`extended_motion.py` makes none of these approximations.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np

from microslip.analyses.backbone.points import (
    Backbone,
    BackbonePoint,
    amplitude_scale,
    failed,
    material_damping,
)
from microslip.analyses.prepared.joint import PreparedJoint
from microslip.analyses.prepared.joint_modes import JointMode, with_mode_port
from microslip.analyses.statics.cycle import quasi_static_cycle
from microslip.analyses.statics.held import hold_port, resting
from microslip.analyses.statics.prescribed import PrescribedCycle, prescribed_cycle
from microslip.errors import ContactError, Failure
from microslip.model.shape_damping import damping_of_shape, with_mode_outputs
from microslip.numerics.execute import Executor, each, threads
from microslip.numerics.fourier import harmonic, without_drift
from microslip.typing import Array

OWN_FREQUENCY = 1e-6
"""Relative change of the reference frequency at which it is the mode's own."""

MOST_FREQUENCIES = 12


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
    joint: PreparedJoint,
    mode: JointMode,
    amplitudes: Sequence[float] | Array,
    *,
    control: CycleControl = CycleControl(),
    executor: Executor | None = None,
    advance: Callable[[], None] = lambda: None,
) -> tuple[Backbone, list[Failure]]:
    """Backbone by quasi-static modal analysis.

    Parameters
    ----------
    joint : PreparedJoint
    mode : JointMode
        From `microslip.analyses.prepared.joint_modes.joint_modes`.
    amplitudes : (n,) array
        Of the inertia load over omega_sl²: the amplitudes of q that come out are close to these.
    control : CycleControl
    executor : Executor, optional
        Where amplitudes are computed; threads by default.
    advance : callable
        Called after every amplitude.

    Returns
    -------
    backbone : Backbone
    failures : list of Failure
        Amplitudes that could not be solved.
    """
    wide = joint.with_model(with_mode_outputs(with_mode_port(joint.model, mode)))
    port, own = wide.model.port(mode.port), len(joint.model.ports)

    def one(amplitude: float) -> BackbonePoint:
        cycle = quasi_static_cycle(
            wide,
            mode.port,
            amplitude * mode.sliding_omega**2,
            steps=control.steps,
            max_cycles=control.cycles,
            closure=control.closure,
        )
        reach = float(np.ptp(cycle.output[:, port]))
        omega2 = float(np.ptp(cycle.load)) / reach
        first = harmonic(without_drift(cycle.output, cycle.theta), cycle.theta)
        friction_loss = cycle.dissipated / (2 * np.pi * omega2 * (reach / 2) ** 2)
        omega = float(np.sqrt(omega2))
        beyond = damping_of_shape(joint.model, first[-len(joint.model.omega) :])
        return BackbonePoint(
            amplitude=reach / 2,
            omega=omega,
            damping_ratio=friction_loss + material_damping(joint.model, omega, beyond),
            dissipated=cycle.dissipated,
            residual=float(cycle.residual.max()),
            closure=cycle.closure,
            motion=first[:own] / first[port] * (reach / 2),
            damping=beyond,
        )

    return _collect(joint, mode, "quasi_static", amplitudes, one, executor, advance)


def prescribed_backbone(
    joint: PreparedJoint,
    mode: JointMode,
    amplitudes: Sequence[float] | Array,
    *,
    control: CycleControl = CycleControl(),
    executor: Executor | None = None,
    advance: Callable[[], None] = lambda: None,
) -> tuple[Backbone, list[Failure]]:
    """Backbone of the nonlinear mode from cycles with its motion prescribed.

    Bodies that slide past each other as the stuck mode has them do so with their inertia; where
    the mode leaves that motion alone it has a mean only, and moves without inertia, unless the stuck mode had
    another frequency without it. Where equilibrium
    with that inertia has no stable path, at wide slip, the motions of the bodies are sought as
    `microslip.analyses.statics.floating` says.

    Parameters and results as in `quasi_static_backbone`, but `amplitudes` are those of q.
    """
    wide = joint.with_model(with_mode_port(joint.model, mode))
    static = resting(joint, mode)

    def at_its_frequency(amplitude: float, floats: bool) -> tuple[PrescribedCycle, float]:
        omega, tried = mode.stuck_omega, []
        for _ in range(MOST_FREQUENCIES):
            held = hold_port(
                wide, mode.port, mode.sliding_omega, omega, static=static, floats=floats
            )
            cycle = prescribed_cycle(
                held,
                amplitude,
                steps=control.steps,
                cycles=control.cycles,
                closure=control.closure,
            )
            stiffness = mode.sliding_omega**2 + (cycle.force / cycle.q).real
            if not stiffness > 0:
                raise ContactError("the stiffness of the mode is not positive")
            tried.append((omega, float(np.sqrt(stiffness))))
            if abs(tried[-1][1] / omega - 1) <= OWN_FREQUENCY:
                return cycle, tried[-1][1]
            omega = _secant(tried)
        raise ContactError(
            f"no frequency of its own: {tried[-2][1] / (2 * np.pi):.6g} and "
            f"{tried[-1][1] / (2 * np.pi):.6g} Hz came out last"
        )

    def one(amplitude: float) -> BackbonePoint:
        try:
            cycle, omega = at_its_frequency(amplitude, False)
        except ContactError:
            cycle, omega = at_its_frequency(amplitude, True)
        ratio = cycle.force / cycle.q
        return BackbonePoint(
            amplitude=abs(cycle.q),
            omega=omega,
            damping_ratio=ratio.imag / (2 * omega**2)
            + material_damping(joint.model, omega, cycle.damping),
            dissipated=cycle.dissipated,
            residual=cycle.residual,
            closure=cycle.closure,
            motion=cycle.output[: len(joint.model.ports)] * (abs(cycle.q) / cycle.q),
            damping=cycle.damping,
        )

    return _collect(joint, mode, "prescribed", amplitudes, one, executor, advance)


def _secant(tried: Sequence[tuple[float, float]]) -> float:
    """Next guess of ``omega = g(omega)`` from guesses and what came out; plain where it is wild."""
    x, y = tried[-1]
    if len(tried) == 1:
        return y
    x0, y0 = tried[-2]
    slope = (y - y0) / (x - x0) if x != x0 else 0.0
    return y if abs(slope) > 0.9 else x + (y - x) / (1 - slope)


def _collect(
    joint: PreparedJoint,
    mode: JointMode,
    method: str,
    amplitudes: Sequence[float] | Array,
    one: Callable[[float], BackbonePoint],
    executor: Executor | None,
    advance: Callable[[], None],
) -> tuple[Backbone, list[Failure]]:
    """Points at independent amplitudes; those that fail are named."""

    def attempt(amplitude: float) -> BackbonePoint | Failure:
        try:
            return one(amplitude)
        except ContactError as error:
            return failed(mode, method, amplitude, error)

    points, failures = [], []
    wanted = sorted(float(a) for a in amplitudes)
    for outcome in each(attempt, wanted, executor or threads()):
        if isinstance(outcome, Failure):
            failures.append(outcome)
        else:
            points.append(outcome)
        advance()
    return Backbone(mode, method, tuple(points), amplitude_scale(joint, mode)), failures

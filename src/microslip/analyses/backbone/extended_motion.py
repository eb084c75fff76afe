"""The nonlinear mode by harmonic balance: extended periodic motion with several harmonics.

    M x'' + (C - xi M) x' + K x + B^T r = clamp,     zeta = xi / (2 omega)

(Krack, Computers & Structures 154 (2015) 59). ``-xi M x'`` only lowers alpha of the Rayleigh damping,
so the equations are those of `microslip.analyses.harmonic.equations` without a load. Such a system
has no phase and, besides its vibration, its rest as a solution. Both ambiguities go when a spring
``kappa`` holds the mode's coordinate to ``(L/kappa) sin(theta)``:

    kappa Phi (Phi^T M (x - x_prestress))  =  L sin(theta) M Phi       on the right-hand side,

a force that vanishes in the first harmonic where ``Q_1 = L / kappa``, which fixes omega and xi. On
higher harmonics of q alone, which are thousandths, the spring stays, as ``kappa / ((h² - 1) omega²)``.

Motions are followed over their amplitude with omega and xi among the unknowns (`motion_path.py`). Where that
does not get to, an outer iteration tries every amplitude by itself. With ``z = F_1/Q_1``, the equation of the
mode says ``omega² = omega_sl² + Re z`` and ``xi = c + Im z / omega``: the z that gives itself is sought; it
depends on its guess through the real part, which changes the amplitude, so a secant along that part suffices.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace

import numpy as np

from microslip.analyses.backbone.motion_path import MotionEquations, MotionPath
from microslip.analyses.backbone.points import Backbone, BackbonePoint, amplitude_scale, failed
from microslip.analyses.harmonic.linear import HarmonicSolver
from microslip.analyses.harmonic.operator import linear_operator
from microslip.analyses.harmonic.paths import CONTROL, LoadPath
from microslip.analyses.harmonic.points import HarmonicPoint, describe
from microslip.analyses.harmonic.problem import HarmonicProblem, state_equations
from microslip.analyses.prepared.joint import PreparedJoint
from microslip.analyses.prepared.joint_modes import JointMode, with_mode_port
from microslip.analyses.statics.held import modal_rest
from microslip.brief import Brief
from microslip.errors import Failure
from microslip.model.shape_damping import damping_of_shape
from microslip.numerics.continuation import (
    BranchPoint,
    ContinuationError,
    crossings,
    first_point,
    solve_at,
    trace,
)
from microslip.typing import Array

SPRING = 0.3
"""kappa over omega_sl²."""

SELF_CONSISTENT = 1e-8
"""Change of z over omega² at which the outer iteration has converged."""

MOST_ROUNDS = 25

HALVINGS = 4
"""So often the way to an amplitude that fails is halved."""

STUCK = 1e-4
"""First amplitude on the way from rest, over the one that opens the joint."""


@dataclass(frozen=True)
class SprungMode:
    """A joint whose mode is held by a spring, as equations of harmonic balance.

    Attributes
    ----------
    mode : JointMode
    problem : HarmonicProblem
    spring : float
        kappa, 1/s².
    """

    mode: JointMode
    problem: HarmonicProblem
    spring: float


def spring_mode(
    joint: PreparedJoint,
    mode: JointMode,
    *,
    harmonics: int = 5,
    spring: float = SPRING,
) -> SprungMode:
    """State the equations of a mode's motion.

    Parameters
    ----------
    joint : PreparedJoint
    mode : JointMode
    harmonics : int
        Beside the mean.
    spring : float
        kappa over omega_sl².
    """
    model, start, shape = joint.model, joint.prestress, mode.sliding
    kappa = spring * mode.sliding_omega**2
    wide = with_mode_port(model, mode)
    values, vectors = np.linalg.eigh(np.diag(model.omega**2) + kappa * np.outer(shape, shape))
    rest = modal_rest(joint)
    loads = wide.port_modes.copy()
    # the spring is relaxed at prestress; the first preload carries what that takes
    name, amplitude = next(iter(start.preload.items()))
    loads[:, wide.port(name)] += kappa * shape * (shape @ rest) / amplitude
    sprung = replace(
        wide,
        omega=np.sqrt(np.maximum(values, 0.0)),
        mode_v=model.mode_v @ vectors,
        port_modes=vectors.T @ loads,
        damping=None if model.damping is None else model.damping_beyond(vectors),
    )
    turned = (vectors.T @ rest)[: model.equilibrium_modes]
    problem = state_equations(
        sprung,
        replace(start, solution=replace(start.solution, q=turned)),
        joint.law,
        mode.port,
        mode.port,
        harmonics=harmonics,
    )
    return SprungMode(mode, problem, kappa)


@dataclass(frozen=True, repr=False)
class Nearby(Brief):
    """A motion to start from.

    Attributes
    ----------
    unknowns : (n,) array
        Of the harmonic balance.
    amplitude : float
        The load on the spring over its stiffness.
    omega, xi : float
        rad/s, and 1/s.
    """

    unknowns: Array
    amplitude: float
    omega: float
    xi: float


@dataclass(frozen=True)
class ExtendedMotion:
    """A periodic motion of one mode.

    Attributes
    ----------
    amplitude : complex
        First harmonic of the mode.
    omega, xi : float
        rad/s, and the negative damping that sustains it, 1/s.
    nearby : Nearby
        The motion as a start for others.
    point : HarmonicPoint
        Its load is the spring's.
    rounds : int
        Outer iterations.
    """

    amplitude: complex
    omega: float
    xi: float
    nearby: Nearby
    point: HarmonicPoint
    rounds: int


def extended_motion(
    sprung: SprungMode,
    amplitude: float,
    solver: HarmonicSolver,
    start: Nearby,
) -> ExtendedMotion:
    """The motion of one amplitude.

    Parameters
    ----------
    sprung : SprungMode
    amplitude : float
    solver : HarmonicSolver
        Kept from one motion to the next.
    start : Nearby

    Raises
    ------
    ContinuationError
        Where harmonic balance does not converge, or the outer iteration.
    """
    mode, problem, kappa = sprung.mode, sprung.problem, sprung.spring
    alpha, beta = problem.model.rayleigh
    w, last, omega, xi = start.unknowns, start.amplitude, start.omega, start.xi
    w2, port = mode.sliding_omega**2, problem.model.port(mode.port)
    load = kappa * amplitude
    z = complex(omega**2 - w2, omega * (xi - alpha - beta * w2))
    tried: list[tuple[complex, complex]] = []
    for rounds in range(1, MOST_ROUNDS + 1):
        if not w2 + z.real > 0:
            raise ContinuationError("the stiffness of the mode is not positive")
        omega = float(np.sqrt(w2 + z.real))
        xi = float(alpha + beta * w2 + z.imag / omega)
        model = replace(problem.model, rayleigh=(alpha - xi, beta))
        path = LoadPath(replace(problem, model=model), omega / (2 * np.pi), load)
        path.solver = solver
        try:
            w, point = _solved(path, w, kappa * last, load)
        except ContinuationError:
            if not tried:
                raise
            # too far from the round before
            z = 0.5 * (z + tried[-1][0])
            continue
        last = amplitude
        Q = complex(point.output[1, port])
        damping = alpha - xi + beta * (w2 + kappa)
        found = load / Q - (w2 + kappa - omega**2 + 1j * omega * damping)
        if abs(found - z) <= SELF_CONSISTENT * omega**2:
            nearby = Nearby(w, amplitude, omega, xi)
            return ExtendedMotion(Q, omega, xi, nearby, point, rounds)
        tried.append((z, found))
        z = _next(tried)
    raise ContinuationError(
        f"frequency and damping of the mode do not settle: {omega / (2 * np.pi):.6g} Hz and "
        f"{xi / (2 * omega):.3g} came out last"
    )


def _solved(path: LoadPath, w: Array, before: float, load: float) -> tuple[Array, HarmonicPoint]:
    """Solve at once from a solution nearby, or else follow the load from there."""
    try:
        w, _, iterations = solve_at(path, w, load, CONTROL)
    except ContinuationError:
        if before == load:
            raise
        low, high = sorted((before, load))
        first = first_point(path, w, before, CONTROL, np.sign(load - before))
        branch = trace(path, first, (low, high), CONTROL)
        if branch.points[-1].p != load:
            raise ContinuationError(
                f"harmonic balance got to {branch.points[-1].p / load:.3g} of it ({branch.ended})"
            ) from None
        w, _, iterations = solve_at(path, branch.points[-1].u, load, CONTROL)
    return w, describe(path.at(w, load), iterations, 0.0)


def _next(tried: Sequence[tuple[complex, complex]]) -> complex:
    """Next guess of ``z = g(z)``, g depending on the real part of z alone."""
    z, g = tried[-1]
    if len(tried) == 1:
        return g
    z0, g0 = tried[-2]
    if z.real == z0.real:
        return g
    slope = (g - g0) / (z.real - z0.real)
    if slope.real > 0.9:
        return g
    step = (g.real - z.real) / (1 - slope.real)
    return complex(z.real + step, (g + slope * step).imag)


def _reach(
    sprung: SprungMode,
    amplitude: float,
    solver: HarmonicSolver,
    start: Nearby,
    first: float,
    halvings: int,
) -> ExtendedMotion:
    """The motion of one amplitude, by way of amplitudes in between where it is too far away.

    `first` stands for the amplitude of a start at rest.
    """
    try:
        return extended_motion(sprung, amplitude, solver, start)
    except ContinuationError:
        between = float(np.sqrt(max(start.amplitude, first) * amplitude))
        if halvings == 0 or between >= amplitude:
            raise
    half = _reach(sprung, between, solver, start, first, halvings - 1)
    return _reach(sprung, amplitude, solver, half.nearby, first, halvings - 1)


def harmonic_backbone(
    joint: PreparedJoint,
    mode: JointMode,
    amplitudes: Sequence[float] | Array,
    *,
    harmonics: int = 5,
    advance: Callable[[], None] = lambda: None,
) -> tuple[Backbone, list[Failure]]:
    """Backbone of the nonlinear mode by harmonic balance.

    Parameters and results as in `microslip.analyses.backbone.cycles.prescribed_backbone`; each
    amplitude starts from the one below.
    """
    sprung = spring_mode(joint, mode, harmonics=harmonics)
    alpha, beta = joint.model.rayleigh
    solver = HarmonicSolver()
    omega = mode.stuck_omega
    beyond = damping_of_shape(joint.model, mode.stuck)
    state = Nearby(sprung.problem.rest(), 0.0, omega, alpha + beta * omega**2 + beyond)
    scale = amplitude_scale(joint, mode)
    points, failures = [], []
    sizes = sorted(float(a) for a in amplitudes)
    followed = _followed(sprung, sizes, solver, state, advance)
    halvings = HALVINGS
    for amplitude in sizes:
        try:
            motion = followed.get(amplitude) or _reach(
                sprung, amplitude, solver, state, STUCK * scale, halvings
            )
        except ContinuationError as error:
            failures.append(failed(mode, "harmonic", amplitude, error))
            halvings = 0  # the ways to larger ones lead through where this one got lost
        else:
            state, halvings = motion.nearby, HALVINGS
            points.append(_point(motion, len(joint.model.ports)))
        if amplitude not in followed:
            advance()
    return Backbone(mode, "harmonic", tuple(points), scale), failures


def _point(motion: ExtendedMotion, ports: int) -> BackbonePoint:
    return BackbonePoint(
        amplitude=abs(motion.amplitude),
        omega=motion.omega,
        damping_ratio=motion.xi / (2 * motion.omega),
        dissipated=motion.point.dissipated,
        residual=motion.point.residual,
        closure=0.0,
        motion=motion.point.output[1, :ports] * (abs(motion.amplitude) / motion.amplitude),
        damping=_of_shape(motion.point),
    )


def _of_shape(point: HarmonicPoint) -> float:
    """What damps the shape of the first harmonic beyond alpha and beta, 1/s."""
    problem = point.problem
    if problem.model.damping is None:
        return 0.0
    operator = linear_operator(problem, 2 * np.pi * point.frequency)
    eta = operator.modes(*problem.split(point.w), point.load)[1]
    return damping_of_shape(problem.model, eta)


def _first_motion(
    path: MotionPath, sprung: SprungMode, amplitude: float, solver: HarmonicSolver, start: Nearby
) -> BranchPoint:
    """First point of the branch: all unknowns at once, or as far as the outer iteration gets."""
    p = float(np.log(amplitude))
    try:
        return first_point(path, _unknowns(start), p, CONTROL)
    except ContinuationError:
        nearby = extended_motion(sprung, amplitude, solver, start).nearby
    return first_point(path, _unknowns(nearby), p, CONTROL)


def _unknowns(motion: Nearby) -> Array:
    return np.append(motion.unknowns, [motion.omega, motion.xi])


def _followed(
    sprung: SprungMode,
    amplitudes: Sequence[float],
    solver: HarmonicSolver,
    state: Nearby,
    advance: Callable[[], None],
) -> dict[float, ExtendedMotion]:
    """Motions of those amplitudes that the branch from the smallest one gets to."""
    if not amplitudes:
        return {}
    path = MotionPath(sprung.problem, sprung.spring, solver)
    wanted = {float(np.log(a)): a for a in amplitudes}
    first, last = min(wanted), max(wanted)
    found: dict[float, ExtendedMotion] = {}

    def keep(u: Array, p: float) -> None:
        _, equations, steps = solve_at(path, u, p, CONTROL)
        assert isinstance(equations, MotionEquations)
        omega, xi = equations.omega, equations.xi
        point = describe(equations.motion, steps, 0.0)
        nearby = Nearby(equations.w, wanted[p], omega, xi)
        found[wanted[p]] = ExtendedMotion(equations.output, omega, xi, nearby, point, 0)
        advance()

    passed: list[BranchPoint] = []

    def observe(point: BranchPoint) -> bool:
        passed.append(point)
        for p in wanted:
            if wanted[p] not in found:
                for guess, _ in crossings(passed[-2:], p)[:1]:
                    keep(guess, p)
        return len(found) == len(wanted)

    try:
        start = _first_motion(path, sprung, wanted[first], solver, state)
        observe(start)
        if last > first:
            trace(path, start, (first, last), CONTROL, observe, sorted(wanted))
        else:
            keep(start.u, first)
    except ContinuationError:
        pass
    return found

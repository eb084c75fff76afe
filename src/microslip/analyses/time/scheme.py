"""Time integration of the joint model with exact contact.

The scheme is that of `contact/timestep.py`: second order, unconditionally stable for the linear
joint, dissipative at high frequency only (numerical damping ratio of a mode
``alpha (omega dt)²/2 ...`` to leading order; alpha = 0.05 by default). Implicit steps lengthen the
period by ``(omega dt)²/12 (1 + ...)``: see `period_error`, and compare methods at a frequency
corrected for it.
"""

from __future__ import annotations

from dataclasses import dataclass, field, fields

import numpy as np

from microslip.analyses.prepared.joint import PreparedJoint
from microslip.brief import Brief
from microslip.contact import tableau
from microslip.contact.pairs import normal, tangential
from microslip.contact.problem import contact_problem
from microslip.contact.solver import CERTIFICATE, TOLERANCE, load_kernels, singularity_named
from microslip.contact.timestep import (
    EXTERNAL,
    MODAL,
    NORMAL,
    RESIDUAL,
    Motion,
    Records,
    StepConstants,
    step_through,
)
from microslip.errors import ContactError, MicroslipError
from microslip.typing import Array, Indices, Status

ALPHA = 0.05


@dataclass(frozen=True, repr=False)
class TimeScheme(Brief):
    """A joint model made ready for one step size and one driven port.

    Attributes
    ----------
    joint : PreparedJoint
    dt, alpha : float
        Step (s) and numerical dissipation.
    port : str
        Driven port.
    W : (d m, d m) array
        Flexibility over one step.
    kernel : StepConstants
        What the compiled stepping needs of all this.
    """

    joint: PreparedJoint
    dt: float
    alpha: float
    port: str
    W: Array
    kernel: StepConstants = field(repr=False)


@dataclass(frozen=True, repr=False)
class State(Brief):
    """Everything the next step depends on; frozen, marching returns a new one.

    Attributes
    ----------
    eta, rate, acceleration, modal_force : (k,) arrays
    residual_v : (d m,) array
        Residual part of the relative displacement.
    r, v : (d m,) arrays
    r_before : (m,) array
        Normal reactions one step before `r`; they tell an impact from a smooth opening.
    status : (m,) int8 array
    """

    eta: Array
    rate: Array
    acceleration: Array
    modal_force: Array
    residual_v: Array
    r: Array
    v: Array
    r_before: Array
    status: Status


LINEAR_FIELDS = ("eta", "rate", "acceleration", "modal_force", "residual_v", "r", "v", "r_before")
"""Fields of a `State` that may be combined linearly."""


@dataclass(frozen=True, repr=False)
class March(Brief):
    """Result of marching: samples at every step, the first is the state at entry.

    Attributes
    ----------
    time : (n,) array
        s.
    load : (n,) array
    output : (n, p) array
        Outputs of all ports, change from prestress.
    state : State
        At the end.
    friction_work : (m,) array
        J per metre of width.
    external, modal_damping, normal_work : float
        Work of the load, of material damping in the modes, and of the normal reactions (an error of
        discretisation), J per metre of width.
    residual_damping : float
        Work that the reactions do on the residual part, J per metre of width: its material damping
        over a full steady cycle; else the change of the energy stored there is in it as well.
    iterations, residual : (n,) arrays
    r, v, status : arrays or empty
        Histories, where asked for.
    """

    time: Array
    load: Array
    output: Array
    state: State
    friction_work: Array
    external: float
    modal_damping: float
    residual_damping: float
    normal_work: float
    iterations: Indices
    residual: Array
    r: Array
    v: Array
    status: Status

    @property
    def dissipated(self) -> float:
        """Friction work, J per metre of width."""
        return float(self.friction_work.sum())


def scheme_constants(alpha: float) -> tuple[float, float, float]:
    """Constants gamma, beta and ``1 - alpha`` of the scheme."""
    return 0.5 + alpha, 0.25 * (1 + alpha) ** 2, 1 - alpha


def period_error(omega_dt: float, alpha: float = ALPHA) -> float:
    """Relative lengthening of the period of an undamped linear oscillator by the scheme.

    From the eigenvalues of its amplification matrix; ``(omega dt)²/12`` for alpha = 0 and small
    steps.

    Examples
    --------
    >>> round(period_error(2 * np.pi / 150, 0.0) / ((2 * np.pi / 150) ** 2 / 12), 3)
    1.0
    """
    values = np.linalg.eigvals(amplification(omega_dt, alpha))
    principal = values[np.argmax(np.abs(values) * (np.abs(values.imag) > 1e-12))]
    return float(omega_dt / abs(np.angle(principal)) - 1)


def amplification(omega_dt: float, alpha: float) -> Array:
    """Amplification matrix of the scheme on ``(x, dt x', dt² x'')`` of an undamped oscillator."""
    gamma, beta, a1 = scheme_constants(alpha)
    w2 = omega_dt**2
    position = np.array([1.0, 1.0, 0.5 - beta])
    rate = np.array([0.0, 1.0, 1 - gamma])
    acceleration = -(a1 * w2 * position + alpha * w2 * np.array([1.0, 0, 0])) / (1 + a1 * beta * w2)
    return np.array([position + beta * acceleration, rate + gamma * acceleration, acceleration])


def time_scheme(
    joint: PreparedJoint, dt: float, *, port: str | None = None, alpha: float = ALPHA
) -> TimeScheme:
    """Prepare time integration.

    Parameters
    ----------
    joint : PreparedJoint
        Motion starts from its prestress; the preload is held.
    dt : float
        Step, s.
    port : str, optional
        Driven port; the joint's own by default.
    alpha : float
        Numerical dissipation, 0 to 1/3.
    """
    if not dt > 0:
        raise MicroslipError(f"time step {dt:g} s must be positive")
    model, port = joint.model, port or joint.drive
    gamma, beta, a1 = scheme_constants(alpha)
    damping = model.modal_damping()
    tau = model.rayleigh[1]
    denominator = 1 + a1 * (gamma * dt * damping + beta * dt**2 * model.omega**2)
    per_force = a1 * beta * dt**2 / denominator
    residual = model.residual + np.diag(joint.law.compliance)
    W = residual / (1 + tau / dt) + (model.mode_v * per_force) @ model.mode_v.T
    driven, held = model.port(port), joint.held
    kernel = StepConstants(
        psi_t=np.ascontiguousarray(model.mode_v.T),
        omega=model.omega,
        damping=damping,
        tau=float(tau),
        alpha=float(alpha),
        dt=float(dt),
        drive_modes=np.ascontiguousarray(model.port_modes[:, driven]),
        drive_v=np.ascontiguousarray(model.port_v[:, driven]),
        constant_modes=model.port_modes @ held,
        constant_v=model.port_v @ held,
        out_modes=np.ascontiguousarray(model.port_modes),
        out_v=np.ascontiguousarray(model.port_v.T),
        out_load=np.vstack([held @ model.port_port, model.port_port[driven]]),
        drive=driven,
    )
    return TimeScheme(
        joint=joint,
        dt=float(dt),
        alpha=float(alpha),
        port=port,
        W=np.ascontiguousarray(0.5 * (W + W.T)),
        kernel=kernel,
    )


def prestressed_state(scheme: TimeScheme, amplitude: float = 0.0, omega: float = 1.0) -> State:
    """At rest under the preload, or passing through it with the velocity of a harmonic motion.

    Parameters
    ----------
    scheme : TimeScheme
    amplitude : float
        Amplitude of `PreparedJoint.coordinate`.
    omega : float
        Its circular frequency, rad/s.
    """
    model, solution = scheme.joint.model, scheme.joint.prestress.solution
    contact = model.mode_v.T @ solution.r
    force = scheme.kernel.constant_modes - contact
    e = model.equilibrium_modes
    eta = np.concatenate([solution.q, force[e:] / model.omega[e:] ** 2])
    rate = np.zeros_like(eta)
    if amplitude:
        rate = _unit_rate(scheme.joint) * (amplitude * omega)
    return State(
        eta=eta,
        rate=rate,
        acceleration=np.zeros_like(eta),
        modal_force=force,
        residual_v=solution.v - model.mode_v @ eta,
        r=solution.r.copy(),
        v=solution.v.copy(),
        r_before=normal(solution.r).copy(),
        status=scheme.joint.prestress.status,
    )


def _unit_rate(joint: PreparedJoint) -> Array:
    """Rates of the modes, of least energy, at which the joint's coordinate moves by one per second."""
    g = joint.model.port_modes[:, joint.model.port(joint.coordinate)]
    square = g @ g
    # the port of a mode is of unit length already
    return g if joint.mode is not None or square == 0 else g / square


def contact_memory(scheme: TimeScheme) -> tableau.Memory:
    """Working memory of the contact solver for marches on one scheme, one at a time."""
    return tableau.memory(scheme.joint.model.pairs, 0)


@singularity_named()
def march(
    scheme: TimeScheme,
    state: State,
    load: Array,
    *,
    keep: bool = False,
    memory: tableau.Memory | None = None,
    start_time: float = 0.0,
) -> March:
    """Integrate over ``len(load) - 1`` steps from `state`.

    Parameters
    ----------
    scheme : TimeScheme
    state : State
    load : (n,) array
        Amplitude of the driven port at every step, ``load[0]`` at the state itself.
    keep : bool
        Keep reactions, relative displacements and contact states of every step.
    memory : Memory, optional
        From `contact_memory`, handed from march to march: saves factorising the contact problem
        each time. Results agree to rounding.
    start_time : float
        Time at the state, s: of a march that goes on another one, so that errors name its own time.

    Raises
    ------
    ContactError
        Where a step does not solve: names the time and the load.
    """
    load_kernels()
    load = np.ascontiguousarray(load, dtype=float)
    if not np.isfinite(load).all():
        raise MicroslipError(f"the load is not finite at step {int(np.argmin(np.isfinite(load)))}")
    n = len(load)
    motion = _motion(state)
    force = np.full(scheme.joint.model.pairs, scheme.joint.prestress.largest_reaction)
    nothing = np.zeros((len(state.v), 0))
    problem = contact_problem(
        scheme.W, nothing, np.zeros(0), scheme.joint.law.friction, force, TOLERANCE
    )
    memory = contact_memory(scheme) if memory is None else memory
    tableau.follow(problem, memory, motion.status)
    rest = _output(scheme, prestressed_state(scheme), 0.0)
    records = _records(scheme, n, n if keep else 0)
    records.output[0] = _output(scheme, state, load[0])
    if keep:
        records.r[0], records.v[0], records.status[0] = state.r, state.v, state.status
    failed = step_through(problem, memory, scheme.kernel, load, motion, records)
    residual = records.residual
    if failed >= 0 or not residual.max() <= CERTIFICATE:
        step = failed if failed >= 0 else int(np.argmax(residual))
        worst = int(np.argmax(np.abs(normal(motion.r))))
        raise ContactError(
            f"contact not solved at t = {start_time + step * scheme.dt:.6g} s (step {step}, load "
            f"{load[step]:.4g}, pair {worst} at x = {scheme.joint.model.position[worst]:.4g} m carries "
            "most): try more steps per cycle"
        )
    if not np.isfinite(motion.eta).all():
        raise MicroslipError("time integration gave a number that is not finite")
    return March(
        time=np.asarray(scheme.dt * np.arange(n), dtype=float),
        load=load,
        output=records.output - rest,
        state=State(**{f.name: getattr(motion, f.name) for f in fields(State)}),
        friction_work=records.friction_work,
        external=float(records.works[EXTERNAL]),
        modal_damping=float(records.works[MODAL]),
        residual_damping=float(records.works[RESIDUAL]),
        normal_work=float(records.works[NORMAL]),
        iterations=records.iterations,
        residual=residual,
        r=records.r,
        v=records.v,
        status=records.status,
    )


def _motion(state: State) -> Motion:
    """Copy of a state that may be changed in place."""
    own = {f.name: getattr(state, f.name).copy() for f in fields(state)}
    return Motion(**own, vt_old=tangential(state.v).copy())


def _records(scheme: TimeScheme, n: int, rows: int) -> Records:
    m, N = scheme.joint.model.pairs, len(scheme.W)
    return Records(
        output=np.zeros((n, len(scheme.joint.model.ports))),
        works=np.zeros(5),
        friction_work=np.zeros(m),
        r=np.zeros((rows, N)),
        v=np.zeros((rows, N)),
        status=np.zeros((rows, m), np.int8),
        iterations=np.zeros(n, np.int64),
        residual=np.zeros(n),
    )


def _output(scheme: TimeScheme, state: State, load: float) -> Array:
    k = scheme.kernel
    constant = k.out_load[0] + k.out_load[1] * load
    return constant + k.out_modes.T @ state.eta - k.out_v @ state.r

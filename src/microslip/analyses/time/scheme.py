"""Time integration of the joint model with exact contact.

The scheme is that of `contact/timestep.py`: the trapezoidal rule, with a step of its own for
every mode so that its poles are the true ones (`microslip.analyses.time.poles`). A free or a
linear periodic vibration has no error of the step at all; where contact changes it is of second
order. Without contact it neither gains nor loses energy; contact never makes any.
"""

from __future__ import annotations

from dataclasses import dataclass, field, fields, replace

import numpy as np

from microslip.analyses.prepared.joint import PreparedJoint
from microslip.analyses.time.coupled import accelerations, coupled_steps
from microslip.analyses.time.poles import ModeSteps, driven_steps, lags, matched_steps
from microslip.brief import Brief
from microslip.contact import spatial_tableau, tableau
from microslip.contact.coupled_modes import UNCOUPLED
from microslip.contact.folded import NOT_FOLDED, Folded, folded
from microslip.contact.pairs import normal, slip_history
from microslip.contact.problem import contact_problem
from microslip.contact.solver import CERTIFICATE, TOLERANCE, loaded, singularity_named
from microslip.contact.tangent import Tangents
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
from microslip.numerics.execute import one_thread
from microslip.typing import Array, Indices, Mask, Status


@dataclass(frozen=True, repr=False)
class TimeScheme(Brief):
    """A joint model made ready for one step size and one driven port.

    Attributes
    ----------
    joint : PreparedJoint
        With the modes that the step can follow; faster ones are in its residual flexibility, with the
        inertia that they have at the frequency of the load.
    dt : float
        Step, s.
    port : str
        Driven port.
    W, W_dissipative : (d m, d m) arrays
        Flexibility over a step, and over one in which the reactions of its end act all through.
    kernel : StepConstants
        What the compiled stepping needs of all this.
    folded : Folded
        W taken apart, where it is its own image under a half turn.
    frequency : float
        Of the load whose periodic answer is sought, Hz; nan where none was given.
    """

    joint: PreparedJoint
    dt: float
    port: str
    W: Array
    W_dissipative: Array
    kernel: StepConstants = field(repr=False)
    folded: Folded = field(repr=False)
    frequency: float = np.nan

    @property
    def steps(self) -> int:
        """Per cycle of that load."""
        return round(1 / (self.frequency * self.dt))


@dataclass(frozen=True, repr=False)
class State(Brief):
    """Everything the next step depends on; frozen, marching returns a new one.

    Attributes
    ----------
    eta, rate, acceleration : (k,) arrays
    residual_v, residual_before : (d m,) arrays
        Residual part of the relative displacement, and that of one step before.
    r, v : (d m,) arrays
    taken : (1,) array
        Energy that contact has taken and not given back, J per metre of width.
    status : (m,) int8 array
    """

    eta: Array
    rate: Array
    acceleration: Array
    residual_v: Array
    residual_before: Array
    r: Array
    v: Array
    taken: Array
    status: Status


LINEAR_FIELDS = tuple(f.name for f in fields(State) if f.name != "status")
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
        Work of the reactions on what the residual part does beyond following the load, J per metre of
        width: its material damping over a full steady cycle; else also the change of ``r^T W_res r / 2``.
    iterations, residual : (n,) arrays
    dissipative : (n,) bool array
        Steps in which the reactions of their end acted all through: contact would have given back
        more energy than it had taken.
    r, v, status : arrays or empty
        Histories, where asked for.
    tangents : Tangents
        Deviations at the end, where some were given.
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
    dissipative: Mask
    r: Array
    v: Array
    status: Status
    tangents: Tangents

    @property
    def dissipated(self) -> float:
        """Friction work, J per metre of width."""
        return float(self.friction_work.sum())


def time_scheme(
    joint: PreparedJoint,
    dt: float,
    *,
    port: str | None = None,
    frequency: float | None = None,
    matched: bool = True,
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
    frequency : float, optional
        Of a load whose periodic answer is sought, Hz: there the modes answer forces as in
        continuous time. Without it they do so at rest, and everywhere but for a share of ``(Omega
        dt)²/6``.
    matched : bool
        Modes have their true poles. False steps them as Newmark's method does, with its longer
        periods.

    Raises
    ------
    MicroslipError
        Where the step is not positive, or too long to follow the modes that move as rigid bodies.
    """
    if not dt > 0:
        raise MicroslipError(f"time step {dt:g} s must be positive")
    omega, damping = joint.model.omega, joint.model.modal_damping()
    if joint.model.damping is not None:
        damping = np.zeros_like(omega)  # steps are those without damping, which couples the modes
    if not matched:
        steps = ModeSteps(np.full(len(omega), float(dt)), damping, np.ones(len(omega)))
    elif frequency is None:
        steps = matched_steps(omega, damping, dt)
    else:
        steps = driven_steps(omega, damping, dt, frequency)
    static = _followed(joint, len(steps.step), dt).model
    joint = _followed(
        joint, len(steps.step), dt, 0.0 if frequency is None else 2 * np.pi * frequency
    )
    model, port = joint.model, port or joint.drive
    coupling = UNCOUPLED
    if model.damping is not None and len(steps.step):
        C = model.damping_matrix()
        steps, coupling = coupled_steps(model.omega, C, dt, steps, frequency, matched)
    h, c, gain = steps
    damped = lags(model.rayleigh[1], dt, 0.0 if frequency is None else frequency)
    per_force = gain * 0.25 * h**2 / (1 + 0.5 * h * c + 0.25 * (h * model.omega) ** 2)
    residual = (model.residual + np.diag(joint.law.compliance)) / (1 + damped[0])
    modal = (model.mode_v * per_force) @ model.mode_v.T
    if len(coupling.answer):
        modal = model.mode_v @ (0.25 * dt**2 * coupling.answer * gain) @ model.mode_v.T
    driven, held, r = model.port(port), joint.held, joint.prestress.solution.r
    at_rest = static.port_v @ held + (model.residual - static.residual) @ r
    at_rest += damped.sum() * (joint.prestress.solution.v - model.mode_v @ _at_rest(joint))
    kernel = StepConstants(
        psi_t=np.ascontiguousarray(model.mode_v.T),
        omega=model.omega,
        mode_step=h,
        mode_damping=c,
        mode_gain=gain,
        lags=damped,
        drive_modes=gain * model.port_modes[:, driven],
        drive_v=np.ascontiguousarray(model.port_v[:, driven]),
        constant_modes=model.port_modes @ held + (gain - 1) * (model.mode_v.T @ r),
        constant_v=at_rest,
        out_modes=np.ascontiguousarray(model.port_modes),
        out_v=np.ascontiguousarray(model.port_v.T),
        out_load=np.vstack([held @ model.port_port, model.port_port[driven]]),
        drive=driven,
        coupling=coupling,
    )
    W, W_dissipative = residual + modal, residual + 2 * modal
    W, W_dissipative = (np.ascontiguousarray(0.5 * (M + M.T)) for M in (W, W_dissipative))
    return TimeScheme(
        joint=joint,
        dt=float(dt),
        port=port,
        W=W,
        W_dissipative=W_dissipative,
        kernel=kernel,
        folded=folded(W, model.image),
        frequency=np.nan if frequency is None else float(frequency),
    )


def _followed(joint: PreparedJoint, modes: int, dt: float, omega: float = 0.0) -> PreparedJoint:
    """The joint with the first so many modes followed; the rest gives way as it does at omega."""
    model, mode = joint.model, joint.mode
    if modes == len(model.omega):
        return joint
    if modes < model.equilibrium_modes:
        raise MicroslipError(
            f"time step {dt:.4g} s is too long: the softest modes have less than three steps in a period"
        )
    if mode is not None:
        mode = replace(mode, sliding=mode.sliding[:modes], stuck=mode.stuck[:modes])
    return replace(joint, model=model.truncated(modes, omega), mode=mode)


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
    eta = _at_rest(scheme.joint)
    rate = np.zeros_like(eta)
    if amplitude:
        rate = _unit_rate(scheme.joint) * (amplitude * omega)
    return State(
        eta=eta,
        rate=rate,
        acceleration=accelerations(scheme.kernel, np.zeros_like(rate), rate),
        residual_v=solution.v - model.mode_v @ eta,
        residual_before=solution.v - model.mode_v @ eta,
        r=solution.r.copy(),
        v=solution.v.copy(),
        taken=np.zeros(1),
        status=scheme.joint.prestress.status,
    )


def _at_rest(joint: PreparedJoint) -> Array:
    """Modal coordinates under the preload."""
    model, solution = joint.model, joint.prestress.solution
    force = model.port_modes @ joint.held - model.mode_v.T @ solution.r
    e = model.equilibrium_modes
    return np.concatenate([solution.q, force[e:] / model.omega[e:] ** 2])


def _unit_rate(joint: PreparedJoint) -> Array:
    """Rates of the modes, of least energy, at which the joint's coordinate moves by one per second."""
    g = joint.model.port_modes[:, joint.model.port(joint.coordinate)]
    square = g @ g
    # the port of a mode is of unit length already
    return g if joint.mode is not None or square == 0 else g / square


ContactMemory = (
    tuple[tableau.Memory, tableau.Memory] | tuple[spatial_tableau.Memory, spatial_tableau.Memory]
)
"""Of the contact problems of a step and of a dissipative step, planar or spatial."""


def contact_memory(scheme: TimeScheme) -> ContactMemory:
    """Working memory of the contact solver for marches on one scheme, one at a time."""
    model, kernels = scheme.joint.model, loaded(scheme.joint.model.dimension).tableau
    modes = np.vstack([scheme.kernel.psi_t, scheme.kernel.drive_v])
    return kernels.memory(model.pairs, 0, modes), kernels.memory(model.pairs, 0)


@one_thread()
@singularity_named()
def march(
    scheme: TimeScheme,
    state: State,
    load: Array,
    *,
    keep: bool = False,
    memory: ContactMemory | None = None,
    start_time: float = 0.0,
    tangents: Tangents | None = None,
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
    memory : ContactMemory, optional
        From `contact_memory`, handed from march to march: saves factorising the contact problem
        each time. Results agree to rounding.
    start_time : float
        Time at the state, s: of a march that goes on another one, so that errors name its own time.
    tangents : Tangents, optional
        Small deviations of `state` to be carried along, see `microslip.contact.tangent`.

    Raises
    ------
    ContactError
        Where a step does not solve: names the time and the load.
    """
    model = scheme.joint.model
    kernels = loaded(model.dimension)
    load = np.ascontiguousarray(load, dtype=float)
    if not np.isfinite(load).all():
        raise MicroslipError(f"the load is not finite at step {int(np.argmin(np.isfinite(load)))}")
    n = len(load)
    motion = _motion(state, model.dimension)
    force = np.full(model.pairs, scheme.joint.prestress.largest_reaction)
    nothing = np.zeros((len(state.v), 0))
    problem, dissipative = (
        contact_problem(W, nothing, np.zeros(0), scheme.joint.law.friction, force, TOLERANCE, parts)
        for W, parts in ((scheme.W, scheme.folded), (scheme.W_dissipative, NOT_FOLDED))
    )
    memory = contact_memory(scheme) if memory is None else memory
    kernels.tableau.follow(problem, memory[0], motion.status)
    rest = _output(scheme, prestressed_state(scheme), 0.0)
    records = _records(scheme, n, n if keep else 0)
    records.output[0] = _output(scheme, state, load[0])
    if keep:
        records.r[0], records.v[0], records.status[0] = state.r, state.v, state.status
    carried = no_tangents(scheme, 0) if tangents is None else _copied(tangents)
    failed = step_through(
        (problem, dissipative), memory, scheme.kernel, load, motion, records, carried
    )
    if failed >= 0 or not records.residual.max() <= CERTIFICATE:
        step = failed if failed >= 0 else int(np.argmax(records.residual))
        worst = int(np.argmax(np.abs(normal(motion.r, model.dimension))))
        raise ContactError(
            f"contact not solved at t = {start_time + step * scheme.dt:.6g} s (step {step}, load "
            f"{load[step]:.4g}, pair {worst} at x = {model.position[worst]:.4g} m carries "
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
        residual=records.residual,
        dissipative=records.dissipative,
        r=records.r,
        v=records.v,
        status=records.status,
        tangents=carried,
    )


def no_tangents(scheme: TimeScheme, count: int) -> Tangents:
    """So many deviations of a state, all zero."""
    k, N = len(scheme.joint.model.omega), len(scheme.W)
    return Tangents(*(np.zeros((count, n)) for n in (k, k, k, N, N, N, N)))


def _copied(tangents: Tangents) -> Tangents:
    return Tangents(*(np.array(a, dtype=float, order="C") for a in tangents))


def _motion(state: State, dimension: int) -> Motion:
    """Copy of a state that may be changed in place."""
    own = {f.name: getattr(state, f.name).copy() for f in fields(state)}
    return Motion(**own, vt_old=slip_history(state.v, dimension))


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
        dissipative=np.zeros(n, np.bool_),
    )


def _output(scheme: TimeScheme, state: State, load: float) -> Array:
    k = scheme.kernel
    constant = k.out_load[0] + k.out_load[1] * load
    return constant + k.out_modes.T @ state.eta - k.out_v @ state.r

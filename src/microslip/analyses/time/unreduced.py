"""Time integration of every degree of freedom of a structure: what the reduction is checked against.

The scheme and the contact solver are those of `scheme.py`, without modes: for

    M x'' + C x' + K x + B^T r = p_held + p A(t),     C = alpha_R M + beta_R K

a step of Hilber–Hughes–Taylor (``gamma = 1/2 + alpha``, ``beta = (1 + alpha)²/4``,
``a = 1 - alpha``) solves for the acceleration at its end,

    S x''_1 = a (f_1 - C x'_p - K x_p - B^T r_1) + alpha (f_0 - C x'_0 - K x_0 - B^T r_0)
    S = M + a (gamma dt C + beta dt² K)
    x_p = x_0 + dt x'_0 + dt² (1/2 - beta) x''_0,   x'_p = x'_0 + dt (1 - gamma) x''_0

so that contact sees ``v = v_free - W r_1`` with ``W = a beta dt² B S^-1 B^T``. `S` is factorised
once; a step costs two solves. Impacts are treated as in `contact/timestep.py`.
Reactions and relative displacements have the layout and signs of
`contact/pairs.py`.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field

import numpy as np

from microslip.analyses.prepared.joint import PreparedJoint
from microslip.brief import Brief
from microslip.contact.pairs import by_pair, normal, slip_history
from microslip.contact.solver import ContactSolver
from microslip.errors import ContactError, ModelError
from microslip.model.flexibility import Flexibility
from microslip.model.modes import linear_modes, spectral_shift
from microslip.model.structure import Structure
from microslip.numerics.factors import factorise
from microslip.typing import Array, Status

ALPHA = 0.05
"""Numerical dissipation: without it, inertia on the contact nodes lets contact ring."""

IMPACT = 0.5
"""An impact is a reaction above this share of the largest under the clamp."""

CONSISTENT = 1e-6
"""Prestress that the mesh reproduces less closely, relative to contact displacement, is refused."""


@dataclass(frozen=True, repr=False)
class FullScheme(Brief):
    """A structure made ready for one step size and one driven port.

    Attributes
    ----------
    structure : Structure
    joint : PreparedJoint
        Of this structure: motion starts from its prestress, and the preload is held.
    dt, alpha : float
        Step (s) and numerical dissipation.
    port : str
        Driven port.
    outputs : mapping of str to (n,) array
        Vectors that the displacement is projected on.
    W : (d m, d m) array
        Flexibility over one step, m/N.
    """

    structure: Structure
    joint: PreparedJoint
    dt: float
    alpha: float
    port: str
    outputs: Mapping[str, Array]
    W: Array
    solve: Callable[[Array], Array] = field(repr=False)


@dataclass(frozen=True, repr=False)
class FullState(Brief):
    """Everything the next step depends on.

    Attributes
    ----------
    x, rate, acceleration : (n,) arrays
        Displacement (prestress included) and its derivatives.
    r, v : (d m,) arrays
    r_before : (m,) array
        Normal reactions one step before `r`.
    status : (m,) int8 array
    """

    x: Array
    rate: Array
    acceleration: Array
    r: Array
    v: Array
    r_before: Array
    status: Status


@dataclass(frozen=True, repr=False)
class FullMarch(Brief):
    """Result of marching; row 0 is the state at entry.

    Attributes
    ----------
    time, load : (s,) arrays
    output : mapping of str to (s,) array
        Projections of the displacement, change from prestress.
    r, v : (s, d m) arrays
    status : (s, m) int8 array
    state : FullState
        At the end.
    friction_work : (m,) array
        J per metre of width.
    external, damping, normal_work : float
        Work of the load, of material damping, and of the normal reactions (an error of
        discretisation), J per metre of width.
    residual : (s,) array
        Complementarity residual of every step.
    """

    time: Array
    load: Array
    output: Mapping[str, Array]
    r: Array
    v: Array
    status: Status
    state: FullState
    friction_work: Array
    external: float
    damping: float
    normal_work: float
    residual: Array

    @property
    def dissipated(self) -> float:
        """Friction work, J per metre of width."""
        return float(self.friction_work.sum())


def scheme_constants(alpha: float) -> tuple[float, float, float]:
    """Constants gamma, beta and ``1 - alpha`` of the scheme."""
    return 0.5 + alpha, 0.25 * (1 + alpha) ** 2, 1 - alpha


def full_scheme(
    structure: Structure,
    joint: PreparedJoint,
    dt: float,
    *,
    port: str | None = None,
    alpha: float = ALPHA,
    outputs: Mapping[str, Array] | None = None,
) -> FullScheme:
    """Factorise the step matrix and build its flexibility at the contact pairs.

    Parameters
    ----------
    structure : Structure
        With loads of the names of the joint's ports.
    joint : PreparedJoint
        Its prestress, friction and Rayleigh damping are taken; of rigid contact (no compliance).
    dt : float
        Step, s.
    port : str, optional
        Driven load of the structure; the joint's driven port by default.
    alpha : float
        Numerical dissipation, 0 to 1/3.
    outputs : mapping of str to (n,) array, optional
        More vectors to project the displacement on, beside the loads of the structure.

    Raises
    ------
    ModelError
        Where the step is not positive or the port is unknown, where the contact is not rigid, or
        where damping couples the modes.
    """
    if not dt > 0:
        raise ModelError(f"time step {dt:g} s must be positive")
    if not joint.law.exact:
        raise ModelError("marching every degree of freedom needs rigid contact, without compliance")
    if joint.model.damping is not None:
        raise ModelError(
            "marching every degree of freedom takes alpha M + beta K alone, and the damping of this joint "
            "couples its modes: march the joint model (time_scheme)"
        )
    port, rayleigh = port or joint.drive, joint.model.rayleigh
    if port not in structure.loads:
        raise ModelError(f"no load {port!r}; this structure has {', '.join(structure.loads)}")
    gamma, beta, a = scheme_constants(alpha)
    mass_share = 1 + a * gamma * dt * rayleigh[0]
    stiffness_share = a * (gamma * dt * rayleigh[1] + beta * dt**2)
    solve = factorise(mass_share * structure.mass + stiffness_share * structure.stiffness).solve
    B = structure.interface.relative
    W = a * beta * dt**2 * (B @ solve(B.T.toarray()))
    return FullScheme(
        structure=structure,
        joint=joint,
        dt=float(dt),
        alpha=float(alpha),
        port=port,
        outputs={**structure.loads, **(outputs or {})},
        W=np.ascontiguousarray(0.5 * (W + W.T)),
        solve=solve,
    )


def prestressed_full_state(scheme: FullScheme, rate: Array | None = None) -> FullState:
    """State under the preload alone, at rest or passing through it with the velocity `rate`.

    ``K x = p_held - B^T r`` with the reactions of the prestress. K is singular or nearly so for
    the rigid-body motions Z: the rest of x is solved for orthogonally to them, and their share is
    what makes ``B x`` the relative displacement of the prestress.

    Raises
    ------
    ModelError
        Where the prestress is not of this structure.
    """
    s, solution = scheme.structure, scheme.joint.prestress.solution
    B = s.interface.relative
    force = _held(scheme) - B.T @ solution.r
    count = len(solution.q)
    rigid = linear_modes(s, np.array([], dtype=np.int64), max(count, 1)).shapes[:, :count]
    momentum = s.mass @ rigid
    elastic_force = force - momentum @ (rigid.T @ force)
    solve = factorise(s.stiffness + spectral_shift(s) * s.mass).solve
    x = np.zeros(s.dofs)
    for _ in range(8):
        x += solve(elastic_force - s.stiffness @ x)
        x -= rigid @ (momentum.T @ x)
    share = np.linalg.lstsq(B @ rigid, solution.v - B @ x, rcond=None)[0]
    x += rigid @ share
    miss = np.abs(B @ x - solution.v).max()
    compression = np.abs(np.diff(B @ x)).max() + np.abs(B @ x).max()
    if not miss <= CONSISTENT * compression:
        raise ModelError(
            f"the prestress is not of this structure: relative displacements differ by {miss:.1e} m"
        )
    return FullState(
        x=x,
        rate=np.zeros(s.dofs) if rate is None else np.array(rate, dtype=float),
        acceleration=np.zeros(s.dofs),
        r=solution.r.copy(),
        v=solution.v.copy(),
        r_before=normal(solution.r, s.interface.dimension).copy(),
        status=scheme.joint.prestress.status,
    )


def march_full(scheme: FullScheme, load: Array, state: FullState | None = None) -> FullMarch:
    """Integrate over ``len(load) - 1`` steps.

    Parameters
    ----------
    scheme : FullScheme
    load : (s,) array
        Amplitude of the driven port at every step, ``load[0]`` at the state itself.
    state : FullState, optional
        Where to start; at rest under the preload by default.

    Raises
    ------
    ContactError
        Where a step does not solve; names the time and the load.

    Examples
    --------
    >>> from microslip.model.elasticity import Material
    >>> from microslip.model.lap_mesh import LapGeometry, MeshControl
    >>> from microslip.model.joint import Reducer
    >>> from microslip.analyses.prepared.joint import prepare_joint
    >>> from microslip.contact.law import contact_law
    >>> from microslip.model.lap import lap_joint_structure
    >>> joint = lap_joint_structure(
    ...     LapGeometry(0.2515, 0.0125, 0.0375, 0.025), Material(70e9, 0.3, 2000.0, "strain"),
    ...     MeshControl(contact_pairs=21), horizontal_spring=1e5)
    >>> model = Reducer(joint, 10, (0.0, 7.3e-7)).model(joint.loads)
    >>> prepared = prepare_joint(model, contact_law(21, 0.25), {"clamp": 1e6}, "moment")
    >>> scheme = full_scheme(joint, prepared, dt=4e-5)
    >>> rest = march_full(scheme, [0.0, 0.0, 0.0])  # the preload holds its own reactions
    >>> bool(abs(rest.r - rest.r[0]).max() < 1e-6 * rest.r.max())
    True
    """
    s, dt, alpha = scheme.structure, scheme.dt, scheme.alpha
    d = s.interface.dimension
    gamma, beta, a = scheme_constants(alpha)
    B, K, M = s.interface.relative, s.stiffness, s.mass
    load = np.asarray(load, dtype=float)
    state = prestressed_full_state(scheme) if state is None else state
    contact = _contact(scheme, state)
    x, rate, acceleration = state.x, state.rate, state.acceleration
    held, drive = _held(scheme), s.loads[scheme.port]
    none = np.zeros(0)
    record = _Record(scheme, load, state)
    unbalanced = held + drive * load[0] - _internal(scheme, x, rate) - B.T @ state.r
    damping = 0.0
    before = state.r_before
    for step in range(1, len(load)):
        external = held + drive * load[step]
        last, sticks_at = record.r[step - 1], slip_history(record.v[step - 1], d)
        dropped = np.zeros(len(before), dtype=bool)
        while True:
            position = x + dt * rate + dt**2 * (0.5 - beta) * acceleration
            velocity = rate + dt * (1 - gamma) * acceleration
            start = scheme.solve(
                a * (external - _internal(scheme, position, velocity)) + alpha * unbalanced
            )
            try:
                found = contact.solve(B @ (position + beta * dt**2 * start), none, sticks_at)
            except ContactError as error:
                raise ContactError(
                    f"contact not solved at t = {step * dt:.6g} s (load {load[step]:.4g}): {error}"
                ) from error
            strong = normal(last, d) > IMPACT * contact.force
            sudden = strong & (normal(last, d) >= before) & (normal(found.r, d) <= 0) & ~dropped
            if not sudden.any():
                break
            dropped |= sudden
            remainder = B.T @ np.where(sudden[:, None], by_pair(last, d), 0.0).ravel()
            unbalanced = unbalanced + remainder
            acceleration = acceleration + a * scheme.solve(remainder)
        before = normal(last, d)
        acceleration = start - a * scheme.solve(B.T @ found.r)
        new = position + beta * dt**2 * acceleration
        mean_rate = (new - x) / dt
        alpha_R, beta_R = scheme.joint.model.rayleigh
        damping += dt * float(mean_rate @ (alpha_R * (M @ mean_rate) + beta_R * (K @ mean_rate)))
        x, rate = new, velocity + gamma * dt * acceleration
        unbalanced = external - _internal(scheme, x, rate) - B.T @ found.r
        record.r[step], record.v[step], record.status[step] = found.r, found.v, found.status
        record.residual[step] = found.residual
        record.output[step] = record.vectors @ x
    return record.result(
        damping, FullState(x, rate, acceleration, found.r, found.v, before, found.status)
    )


def _held(scheme: FullScheme) -> Array:
    """The preload on every degree of freedom."""
    preload = scheme.joint.prestress.preload
    return np.asarray(sum(scheme.structure.loads[name] * a for name, a in preload.items()))


def _internal(scheme: FullScheme, x: Array, rate: Array) -> Array:
    """``K x + C x'``."""
    alpha_R, beta_R = scheme.joint.model.rayleigh
    s = scheme.structure
    return s.stiffness @ (x + beta_R * rate) + alpha_R * (s.mass @ rate)


def _contact(scheme: FullScheme, state: FullState) -> ContactSolver:
    n, pairs = len(state.v), len(state.status)
    empty = np.zeros((n, 0))
    flexibility = Flexibility(
        scheme.W, empty, np.zeros(0), empty, np.zeros((0, 0)), np.zeros((0, 0))
    )
    force = np.full(pairs, scheme.joint.prestress.largest_reaction)
    return ContactSolver(flexibility, scheme.joint.law.friction, force, state.status)


class _Record:
    """Histories of one march, row 0 filled from the state at entry."""

    def __init__(self, scheme: FullScheme, load: Array, state: FullState) -> None:
        self.scheme, self.load = scheme, load
        rows, m, n = len(load), len(state.status), len(state.v)
        self.r, self.v = np.zeros((rows, n)), np.zeros((rows, n))
        self.status = np.zeros((rows, m), dtype=np.int8)
        self.residual = np.zeros(rows)
        self.vectors = np.vstack(list(scheme.outputs.values()))
        self.output = np.zeros((rows, len(self.vectors)))
        self.r[0], self.v[0], self.status[0] = state.r, state.v, state.status
        self.output[0] = self.vectors @ state.x
        self.rest = self.vectors @ prestressed_full_state(scheme).x

    def result(self, damping: float, state: FullState) -> FullMarch:
        """Works by the trapezoidal rule: mean force times increment of displacement."""
        mean_r, dv = 0.5 * (self.r[1:] + self.r[:-1]), np.diff(self.v, axis=0)
        work = by_pair(np.sum(mean_r * dv, axis=0), self.scheme.structure.interface.dimension)
        mean_load = 0.5 * (self.load[1:] + self.load[:-1])
        names = list(self.scheme.outputs)
        output = dict(zip(names, (self.output - self.rest).T, strict=True))
        return FullMarch(
            time=np.arange(len(self.load), dtype=float) * self.scheme.dt,
            load=self.load,
            output=output,
            r=self.r,
            v=self.v,
            status=self.status,
            state=state,
            friction_work=work[:, 1:].sum(axis=1),
            external=float(mean_load @ np.diff(output[self.scheme.port])),
            damping=damping,
            normal_work=float(work[:, 0].sum()),
            residual=self.residual,
        )

"""Prestress and quasi-static cycles on the static flexibility (inertia left out).

Prestress: the clamp alone, without friction, so that the interface starts with no memory. Cycle:
the clamp held, another port driven by ``A sin(theta)``, with friction, until two successive cycles
end in the same state.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.optimize import linprog

from microslip.contact.pairs import (
    FORWARD,
    at_rest,
    by_pair,
    components,
    normal,
    tangential,
    touches,
)
from microslip.contact.path import PathRecord, follow_path
from microslip.contact.solver import ContactSolver, Solution
from microslip.errors import ContactError, JointOpensError
from microslip.model.flexibility import Flexibility
from microslip.model.joint import JointModel
from microslip.typing import Array


@dataclass(frozen=True)
class Prestress:
    """Contact under the clamp alone, frictionless.

    Attributes
    ----------
    clamp : float
        Clamp force, N per metre of width.
    solution : Solution
    pressure : (m,) array
        Pa.
    touching : (m,) bool array
    """

    clamp: float
    solution: Solution
    pressure: Array
    touching: NDArray[np.bool_]

    @property
    def largest_reaction(self) -> float:
        """Of all components, N per metre of width: the unit of reactions and their changes."""
        return float(np.abs(self.solution.r).max())

    def bonded(self, directions: int) -> NDArray[np.int64]:
        """Components of v of the touching pairs: the normal one, or the first `directions`."""
        pairs = np.flatnonzero(self.touching)
        d = len(self.solution.v) // len(self.touching)
        return np.asarray(by_pair(components(pairs, d), d)[:, :directions].ravel())


def prestress(model: JointModel, flexibility: Flexibility, clamp: float) -> Prestress:
    """Frictionless contact under the clamp force.

    Parameters
    ----------
    model : JointModel
        With a port ``clamp``.
    flexibility : Flexibility
        From `static_flexibility`.
    clamp : float
        N per metre of width, > 0.

    Raises
    ------
    ContactError
        Where the clamp presses no pair together or the solver does not converge.
    """
    if not clamp > 0:
        raise ContactError(f"clamp force is {clamp:g} N/m: it must be positive")
    column = model.port("clamp")
    force = clamp * model.area / model.area.sum()
    start = np.full(model.pairs, FORWARD, dtype=np.int8)
    solver = ContactSolver(flexibility, 0.0, force, start)
    solution = solver.solve(
        flexibility.loads_v[:, column] * clamp,
        flexibility.loads_q[:, column] * clamp,
        np.zeros(model.pairs),
    )
    pressure = normal(solution.r, model.dimension) / model.area
    touching = touches(solution.status)
    if not touching.any():
        raise ContactError("no contact pair touches under the clamp force: is it pulling?")
    return Prestress(clamp, solution, pressure, touching)


@dataclass(frozen=True)
class Cycle:
    """One steady quasi-static cycle (or the last one computed).

    Attributes
    ----------
    port : str
        Driven port.
    amplitude : float
        Its amplitude A: load ``A sin(theta)``.
    theta : (s + 1,) array
        Phase, from 0 to 2 pi.
    load : (s + 1,) array
    output : (s + 1, p) array
        Outputs of all ports, change from prestress.
    r, v : (s + 1, 2 m) arrays
        Reactions and relative displacements (total).
    status : (s + 1, m) int8 array
        Contact states; the first row repeats the last.
    friction_work : (m,) array
        Energy dissipated per cycle by each pair, J per metre of width.
    normal_work : float
        Work of the normal reactions over the cycle: an error of discretisation, tends to zero.
    external_work : float
        Work of the load over the cycle.
    cycles : int
        How many cycles were computed, the first loading included.
    closure : float
        Largest change of a reaction between the last two cycles over the largest prestress
        reaction.
    iterations, residual : (s + 1,) arrays
    hard_steps : int
        Steps that needed more than plain active-set changes.
    """

    port: str
    amplitude: float
    theta: Array
    load: Array
    output: Array
    r: Array
    v: Array
    status: NDArray[np.int8]
    friction_work: Array
    normal_work: float
    external_work: float
    cycles: int
    closure: float
    iterations: NDArray[np.int64]
    residual: Array
    hard_steps: int

    @property
    def dissipated(self) -> float:
        """Energy dissipated per cycle, J per metre of width."""
        return float(self.friction_work.sum())


def opening_load(
    model: JointModel, flexibility: Flexibility, prestress: Prestress, port: str
) -> float:
    """Largest amplitude of a port that the clamped contact can balance (limit analysis).

    Maximises ``A`` over compressive reactions that keep the nearly rigid bodies in equilibrium
    with the clamp and ``±A`` on the port, their soft supports left out. Beyond it the joint opens.
    """
    p, c = model.port(port), model.port("clamp")
    limits = []
    for sign in (1.0, -1.0):
        d, m = model.dimension, model.pairs
        R = flexibility.R
        columns = [by_pair(R.T, d)[..., k] for k in range(d)]
        bounds: list[tuple[float | None, float | None]] = [(0, None)] * m
        bounds += [(None, None)] * ((d - 1) * m)
        load = sign * flexibility.loads_q[:, [p]]
        if np.abs(load).max(initial=0.0) * 1e-12 > 0 and R.shape[1]:
            scale = prestress.clamp
            size = np.abs(load).max()
            A = np.hstack([*columns, -load / size])
            found = linprog(
                np.r_[np.zeros(d * m), -1.0],
                A_eq=A,
                b_eq=flexibility.loads_q[:, c],
                bounds=[*bounds, (0, None)],
                method="highs",
            )
            limits.append(found.x[-1] * scale / size if found.status == 0 else np.inf)
    return float(min(limits, default=np.inf))


def quasi_static_cycle(
    model: JointModel,
    flexibility: Flexibility,
    start: Prestress,
    port: str,
    amplitude: float,
    friction: float | Array,
    *,
    steps: int = 300,
    phase: float = 0.0,
    max_cycles: int = 20,
    closure: float = 1e-9,
) -> Cycle:
    """Steady cycle under the clamp and ``A sin(theta)`` on a port.

    Parameters
    ----------
    model : JointModel
    flexibility : Flexibility
        Static; with contact compliance where the contact is elastic.
    start : Prestress
        On the same flexibility.
    port : str
        Driven port.
    amplitude : float
        A, in the unit of the port.
    friction : float or (m,) array
        Coefficient of friction.
    steps : int
        Load steps per cycle.
    phase : float
        Phase at which loading starts; the load is ramped there from prestress first.
    max_cycles : int
        Cycles at most, the first loading included.
    closure : float
        Cycles stop when no reaction changes by more than this between successive cycles.

    Raises
    ------
    JointOpensError
        Where the amplitude is beyond what the clamp can hold; names the limit.
    ContactError
        Where a step does not solve; names the phase.
    """
    column, clamp_column = model.port(port), model.port("clamp")
    f = flexibility
    _check_stays_closed(opening_load(model, f, start, port), abs(amplitude), port)
    solver = _prestressed_solver(f, start, friction)
    ports = f.loads_v.shape[1]
    theta = phase + 2 * np.pi * np.arange(steps + 1) / steps
    path = np.zeros((steps + 1, ports))
    path[:, clamp_column] = start.clamp
    path[:, column] += amplitude * np.sin(theta)
    vt_old = tangential(start.solution.v).copy()

    def march(path: Array) -> PathRecord:
        return follow_path(
            solver,
            f,
            path,
            vt_old,
            where=lambda step: f"(load {path[step, column]:.4g} on {port!r})",
            remedy="try more load steps",
        )

    ramp_steps = int(np.ceil(abs(np.sin(phase)) * steps / 4))
    if ramp_steps:
        ramp = np.tile(path[0], (ramp_steps + 1, 1))
        ramp[:, column] *= np.linspace(0, 1, ramp_steps + 1)
        ramp[:, clamp_column] = start.clamp
        march(ramp)
    change = np.inf
    hard, last = 0, None
    for cycle in range(1, max_cycles + 1):  # noqa: B007 - reported
        record = march(path)
        hard += int(np.sum(record.rule[1:] > 0))
        if last is not None:
            change = float(np.abs(record.r - last).max() / start.largest_reaction)
        if change <= closure:
            break
        last = record.r
    load = path[:, column]
    output = path @ f.loads_loads.T + record.q @ f.loads_q - record.r @ f.loads_v
    rest = f.loads_loads[clamp_column] * start.clamp
    rest = rest + start.solution.q @ f.loads_q - start.solution.r @ f.loads_v
    output = output - rest
    mean_load = 0.5 * (load[1:] + load[:-1])
    status = record.status.copy()
    status[0] = status[-1]
    return Cycle(
        port=port,
        amplitude=float(amplitude),
        theta=theta,
        load=load,
        output=output,
        r=record.r,
        v=record.v,
        status=status,
        friction_work=record.friction_work,
        normal_work=record.normal_work,
        external_work=float(mean_load @ np.diff(output[:, column])),
        cycles=cycle,
        closure=change,
        iterations=record.iterations,
        residual=record.residual,
        hard_steps=hard,
    )


def _check_stays_closed(limit: float, amplitude: float, port: str) -> None:
    """Beyond the opening load only the soft supports hold, with motions that mean nothing."""
    if amplitude >= limit:
        raise JointOpensError(
            f"the load {amplitude:.4g} on {port!r} opens the joint: the clamp holds less than "
            f"{limit:.4g}"
        )


def _prestressed_solver(
    flexibility: Flexibility, start: Prestress, friction: float | Array
) -> ContactSolver:
    force = np.full(len(start.touching), start.largest_reaction)
    solver = ContactSolver(flexibility, friction, force, at_rest(start.touching))
    solver.start_from(start.solution.r, start.solution.q, start.solution.v)
    return solver
